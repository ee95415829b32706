"""Two-dimensional transfer functions: shapes, their sums, and files."""

import json
from dataclasses import replace

import numpy as np
import pytest

from persp_sw.errors import TransferFunctionError
from persp_sw.optics.transfer2d import Box, Triangle
from persp_sw.optics.transfer2d import TransferFunction2D as Function

RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
BOX = Box((100, 140), (10, 30), RED, 0.8, 0.5)
TRIANGLE = Triangle(200, (5, 25), 40, BLUE, 0.6, 0.25)


def test_a_hard_box_holds_up_to_its_edges():
    box = replace(BOX, soft=0.0)
    np.testing.assert_array_equal(box.opacities([100, 120, 140], 20), 0.8)
    np.testing.assert_array_equal(box.opacities(120, [10, 20, 30]), 0.8)
    assert not box.opacities([99.999, 140.001, 120, 120], [20, 20, 9.999, 30.001]).any()


def test_a_soft_box_falls_to_zero_at_its_edges():
    # Half-sizes 20 and 10, half of each soft.
    np.testing.assert_allclose(BOX.opacities([100, 105, 110, 120, 135, 140], 20), [0, 0.4, 0.8, 0.8, 0.4, 0])
    np.testing.assert_allclose(BOX.opacities(120, [10, 12.5, 15, 27.5, 30]), [0, 0.4, 0.8, 0.4, 0])
    np.testing.assert_allclose(BOX.opacities(105, 12.5), 0.2)
    assert not BOX.opacities([99, 141, 120, 120], [20, 20, 9, 31]).any()


def test_magnitude_zero_is_no_edge():
    low = Box((100, 140), (0, 30), RED, 0.8, 0.5)
    np.testing.assert_allclose(low.opacities(120, [0, 1, 15, 26.25, 30]), [0.8, 0.8, 0.8, 0.4, 0])


def test_a_triangle_widens_from_its_apex():
    hard = replace(TRIANGLE, soft=0.0)
    for magnitude, half in ((10, 10), (15, 20), (25, 40)):
        inside = hard.opacities([200 - half, 200, 200 + half], magnitude)
        np.testing.assert_array_equal(inside, 0.6)
        assert not hard.opacities([200 - half - 1e-6, 200 + half + 1e-6], magnitude).any()
    assert not hard.opacities(200, [0, 4.99, 5, 25.01]).any()  # at 5 the apex itself


def test_a_soft_triangle_falls_to_zero_at_its_sides_and_its_top():
    # At 15 its half-width is 20, a quarter of which is soft; half its height is 10, of which 2.5 are.
    np.testing.assert_allclose(
        TRIANGLE.opacities([180, 182.5, 185, 200, 217.5, 220], 15), [0, 0.3, 0.6, 0.6, 0.3, 0]
    )
    np.testing.assert_allclose(TRIANGLE.opacities(200, [22.5, 23.75, 25]), [0.6, 0.3, 0], atol=1e-15)


def test_extinctions_add_and_colours_mix_by_them():
    other = Box((90, 130), (0, 100), BLUE, 0.5, 0.0)
    both = Function([replace(BOX, soft=0.0), other], 2.0)
    extinction = -np.log([0.2, 0.5])
    assert both.extinction(120, 20) == pytest.approx(extinction.sum() / 2)
    assert both.opacity(120, 20) == pytest.approx(1 - 0.2 * 0.5)
    mean = extinction / extinction.sum()
    np.testing.assert_allclose(both.colour(120, 20), (mean[0], 0, mean[1]))
    np.testing.assert_allclose(both.colour([95, 135, 300], 20), [BLUE, RED, (0, 0, 0)])
    assert both.colour(np.zeros((4, 1)), np.zeros(5)).shape == (4, 5, 3)
    assert both.opacity(np.zeros((4, 1)), np.zeros(5)).shape == (4, 5)


def test_opacity_one_lets_a_millionth_through():
    assert Function([Box((0, 1), (0, 1), RED, 1.0, 0.0)], 4.0).extinction(0.5, 0.5) == pytest.approx(
        -np.log(1e-6) / 4
    )


def test_the_unit_is_filled_in_where_none_is_given():
    free = Function([BOX])
    with pytest.raises(TransferFunctionError, match=r"call with_unit\(length\)"):
        free.extinction(1, 1)
    assert free.with_unit(3.0).opacity_unit == 3.0 and free.with_unit(3.0).with_unit(5.0).opacity_unit == 3.0
    assert free.with_unit(3.0).shapes == (BOX,)


def test_saved_and_loaded_it_is_the_same(tmp_path):
    function = Function([BOX, TRIANGLE, replace(BOX, values=(1 / 3, 0.7))], 0.7)
    function.save(tmp_path / "tf2d.json")
    again = Function.load(tmp_path / "tf2d.json")
    assert again.shapes == function.shapes and again.opacity_unit == 0.7
    rows = json.loads((tmp_path / "tf2d.json").read_text())["tf2d"]
    assert rows[1] == {
        "shape": "triangle",
        "value": 200,
        "magnitudes": [5, 25],
        "width": 40,
        "colour": [0, 0, 1],
        "opacity": 0.6,
        "soft": 0.25,
    }
    assert Function.from_dict({"tf2d": rows}).opacity_unit is None


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"tf2d": 3}', '{"tf": []}', '{"tf2d": [{"shape": "disc"}]}']
)
def test_files_that_are_none(tmp_path, text):
    (tmp_path / "bad.json").write_text(text)
    with pytest.raises(TransferFunctionError):
        Function.load(tmp_path / "bad.json")
    with pytest.raises(TransferFunctionError, match="cannot read"):
        Function.load(tmp_path / "none.json")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Function([]), "at least one shape"),
        (lambda: Function(BOX), "sequence of Box and Triangle"),
        (lambda: Function([BOX, 3]), "shape 1 is neither"),
        (lambda: Function([BOX], 0), "opacity_unit"),
        (lambda: replace(BOX, values=(2, 2)), "a box's values .*low < high"),
        (lambda: replace(BOX, values=(np.nan, 2)), "a box's values"),
        (lambda: replace(BOX, magnitudes=(-1, 2)), "a box's magnitudes .*0 ≤ low"),
        (lambda: replace(BOX, colour=(0, 0, 1.1)), "a box's colour"),
        (lambda: replace(BOX, opacity=1.5), "a box's opacity lies between 0 and 1"),
        (lambda: replace(BOX, soft=-0.1), "a box's soft"),
        (lambda: replace(TRIANGLE, width=0), "a triangle's width"),
        (lambda: replace(TRIANGLE, value="x"), "a triangle's value"),
        (lambda: replace(TRIANGLE, magnitudes=(3, 1)), "a triangle's magnitudes"),
        (
            lambda: Function.from_rows([{"shape": "box", "values": [1, 2]}]),
            "a box needs magnitudes, colour, opacity",
        ),
        (lambda: Function.from_rows([{"shape": "disc"}]), 'a shape is {"shape": "box" or "triangle"'),
        (lambda: Function.from_rows([{"shape": "box", "color": RED}]), r"no color; did you mean colour\?"),
        (lambda: Function.from_rows([{"shape": "triangle", "q": 1}]), "no q; its keys are value, magnitudes"),
        (lambda: Function.from_rows({"shape": "box"}), "tf2d is a list of shapes"),
    ],
)
def test_what_is_no_function_is_refused(make, message):
    with pytest.raises(TransferFunctionError, match=message):
        make()
