"""Transfer functions and the tables made of them."""

import json

import numpy as np
import pytest
from tolerances import TABLE

from persp_sw import TransferFunction, Volume
from persp_sw.errors import TransferFunctionError
from persp_sw.optics.classification import Classification

RED, BLUE = (1, 0, 0), (0, 0, 1)
DTYPES = [np.uint8, np.int16, np.uint16, np.float32]


def test_linear_between_points_and_constant_beyond():
    tf = TransferFunction([(10, RED, 0.2), (20, BLUE, 0.6)], 1.0)
    np.testing.assert_allclose(tf.opacity([0, 10, 15, 20, 99]), [0.2, 0.2, 0.4, 0.6, 0.6])
    np.testing.assert_allclose(tf.colour([0, 15, 99]), [RED, (0.5, 0, 0.5), BLUE])


@pytest.mark.parametrize("at", [0, 1, 2])
def test_two_points_at_one_value_are_a_step_wherever_they_stand(at):
    points = [(10, RED, 0.1), (20, RED, 0.3), (30, RED, 0.5)]
    points.insert(at + 1, (points[at][0], BLUE, 0.9))
    tf = TransferFunction(points, 1.0)
    step = points[at][0]
    np.testing.assert_allclose(tf.opacity([step - 1e-9, step]), [points[at][2], 0.9], atol=1e-7)


def test_extinction_is_the_logarithm_per_unit_and_one_is_almost_one():
    tf = TransferFunction([(0, RED, 0.0), (1, RED, 0.5), (2, RED, 1.0)], opacity_unit=4.0)
    np.testing.assert_allclose(tf.extinction([0, 1]), [0, np.log(2) / 4])
    assert tf.extinction(2) == pytest.approx(-np.log(1e-6) / 4)


def test_the_unit_is_the_volumes_where_none_is_given():
    tf = TransferFunction([(0, RED, 0.5)])
    with pytest.raises(TransferFunctionError, match="opacity_unit"):
        tf.extinction(0)
    assert tf.with_unit(2.0).opacity_unit == 2.0
    assert tf.with_unit(2.0).with_unit(5.0).opacity_unit == 2.0
    volume = Volume(np.zeros((2, 2, 2), np.uint8), spacing=(3, 2, 5))
    assert Classification.of(tf, volume).table[1, 3] == pytest.approx(np.log(2) / 2)


@pytest.mark.parametrize(
    "points, message",
    [
        ([], "at least one"),
        ([(5, RED, 0), (4, RED, 0)], "sorted"),
        ([(5, RED, 0), (5, RED, 0.1), (5, RED, 0.2)], "three control points"),
        ([(np.nan, RED, 0)], "NaN"),
        ([(0, RED, np.inf)], "NaN or infinite"),
        ([(0, RED, 1.2)], "between 0 and 1"),
        ([(0, (2, 0, 0), 0.2)], "between 0 and 1"),
        ([(0, RED)], r"\(value, \(r, g, b\), opacity\)"),
        ("nonsense", "control points are"),
    ],
)
def test_what_is_not_a_transfer_function_is_refused(points, message):
    with pytest.raises(TransferFunctionError, match=message):
        TransferFunction(points)


@pytest.mark.parametrize("unit", [0, -1, np.nan])
def test_units_are_lengths(unit):
    with pytest.raises(TransferFunctionError, match="opacity_unit"):
        TransferFunction([(0, RED, 0.5)], unit)


def test_saved_and_loaded_it_is_the_same(tmp_path):
    tf = TransferFunction([(0.1, RED, 0.2), (1 / 3, BLUE, 0.7), (1 / 3, RED, 1)], 0.7)
    tf.save(tmp_path / "tf.json")
    other = TransferFunction.load(tmp_path / "tf.json")
    assert other.points == tf.points and other.opacity_unit == tf.opacity_unit
    assert set(json.loads((tmp_path / "tf.json").read_text())) == {"tf", "opacity_unit"}


@pytest.mark.parametrize("content", ["", "{", "[]", '{"tf": 5}', '{"tf": [[1, 2]]}', '{"points": []}'])
def test_files_that_hold_something_else_are_refused(tmp_path, content):
    path = tmp_path / "tf.json"
    path.write_text(content)
    with pytest.raises(TransferFunctionError):
        TransferFunction.load(path)
    with pytest.raises(TransferFunctionError, match="cannot read"):
        TransferFunction.load(tmp_path / "absent.json")


@pytest.mark.parametrize("dtype", DTYPES)
def test_the_table_gives_the_function_back(dtype):
    rng = np.random.default_rng(0)
    volume = Volume(rng.integers(0, 200, (9, 9, 9)).astype(dtype))
    tf = TransferFunction([(20, RED, 0.0), (90, BLUE, 0.3), (150, RED, 0.2)], 1.0)
    c = Classification.of(tf, volume)
    values = rng.uniform(0, 199, 1000)
    rows = np.clip(np.floor((values - c.origin) * c.scale + 1.5), 1, len(c.table) - 1).astype(int)
    assert np.abs(c.table[rows, 3] - tf.extinction(values)).max() < TABLE
    assert np.abs(c.table[rows, :3] - tf.colour(values)).max() < TABLE * 5
    assert not c.table[0].any()
    assert c.seen[-1] == (c.table[:, 3] > 0).sum()


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("points", [
    [(100, RED, 0), (100, BLUE, 0.5)],
    [(100, RED, 0), (100, BLUE, 0.5), (200, BLUE, 0.9)],
    [(50, RED, 0), (100, RED, 0), (100, BLUE, 0.5)],
])  # fmt: skip
def test_steps_are_where_they_belong_for_whole_values(dtype, points):
    volume = Volume(np.arange(27, dtype=dtype).reshape(3, 3, 3) + dtype(90))
    c = Classification.of(TransferFunction(points, 1.0), volume)
    rows = np.clip(np.floor((np.array([90, 99, 100, 116]) - c.origin) * c.scale + 1.5), 1, len(c.table) - 1)
    assert (c.table[rows.astype(int), 3] > 0).tolist() == [False, False, True, True]


@pytest.mark.parametrize("dtype", [np.int16, np.uint16, np.float32])
def test_at_least_twelve_bits_where_the_function_tells_values_apart(dtype):
    data = np.array([0, 1000, 1100, 30000], dtype).repeat(2).reshape(2, 2, 2)
    c = Classification.of(TransferFunction([(1000, RED, 0), (1100, RED, 0.5)], 1.0), Volume(data))
    assert 1 / c.scale <= 100 / 4095


def test_functions_constant_over_the_volume_need_one_entry():
    volume = Volume(np.full((2, 2, 2), 7.5, np.float32))
    for points in (
        [(0, RED, 0.5)],
        [(7.5, RED, 0.5)],
        [(0, RED, 0.5), (5, BLUE, 0.5)],
        [(9, RED, 0.5), (12, RED, 1)],
    ):
        c = Classification.of(TransferFunction(points, 1.0), volume)
        assert len(c.table) == 2 and c.table[1, 3] == pytest.approx(np.log(2))


def test_extremes_stay_within_float32():
    tiny = Volume(np.array([0, 1e-38, 2e-38, 3e-38] * 2, np.float32).reshape(2, 2, 2))
    c = Classification.of(TransferFunction([(0, RED, 0), (3e-38, RED, 0.5)], 1.0), tiny)
    assert np.isfinite(np.float32(c.scale))
    dense = Classification.of(TransferFunction([(0, RED, 1)], 1e-30), tiny)
    assert np.isfinite(dense.table).all()
    for points in ([(-1.7e308, RED, 0), (1.7e308, RED, 1)], [(0, RED, 0), (1e301, RED, 0)]):
        with pytest.raises(TransferFunctionError, match="too large"):
            TransferFunction(points)
    for unit in ("1", True, 0.0):
        with pytest.raises(TransferFunctionError, match="opacity_unit"):
            TransferFunction([(0, RED, 0.5)], unit)
