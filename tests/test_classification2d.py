"""Two-dimensional transfer functions as tables, and their pictures."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from samples import ball, result_of
from test_composite import smooth_volume
from tolerances import BOX_TABLE, FLOAT32_IMAGE, PICTURE_2D
from views import DIRECTIONS, random_pose, view_of

from persp_sw import (
    Lighting,
    Look,
    Modulation,
    Renderer,
    Settings,
    TransferFunction,
    View,
    Volume,
    reference,
)
from persp_sw.optics.classification import Classification
from persp_sw.optics.classification2d import Classification2D, classify
from persp_sw.optics.transfer2d import Box, TransferFunction2D, Triangle
from persp_sw.volume.gradient import largest_magnitude

RED, BLUE = (1.0, 0.3, 0.1), (0.1, 0.4, 1.0)
DTYPES = [np.uint8, np.int16, np.float32]
BOX, TRIANGLE = Box((60, 150), (0, 40), RED, 0.5, 1.0), Triangle(170, (5, 80), 70, BLUE, 0.7, 1.0)
SOFT = TransferFunction2D([BOX, TRIANGLE], 1.0)
HAZE = TransferFunction([(60, BLUE, 0), (255, RED, 0.5)], 1.0)


def at_places(found, values, magnitudes):
    """The rows that a kernel finds for values and magnitudes, in its float32."""
    one = np.float32(1.5)
    entry = (values.astype(np.float32) - np.float32(found.origin)) * np.float32(found.scale) + one
    entry = np.clip(entry, 1, len(found.table) - 1).astype(int)
    m = np.floor(magnitudes.astype(np.float32) * np.float32(found.per_magnitude) + np.float32(0.5))
    return found.rows[entry + np.minimum(m, found.magnitudes - 1).astype(int) * len(found.table)]


# --- The table --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", DTYPES)
def test_entries_are_the_function_itself(dtype):
    volume = smooth_volume(dtype=dtype)
    found = classify(SOFT, volume)
    assert isinstance(found, Classification2D)
    rows = found.rows.reshape(found.magnitudes, len(found.table), 4)
    values = found.origin + np.arange(len(found.table) - 1) / found.scale
    magnitudes = np.arange(found.magnitudes) / found.per_magnitude
    for m, magnitude in enumerate(magnitudes):
        np.testing.assert_allclose(rows[m, 1:, 3], SOFT.extinction(values, magnitude), rtol=1e-6)
        np.testing.assert_allclose(rows[m, 1:, :3], SOFT.colour(values, magnitude), atol=1e-6)
    assert not rows[:, 0].any()
    np.testing.assert_array_equal(found.table[:, 3], rows[..., 3].max(0))
    np.testing.assert_array_equal(np.diff(found.seen), found.table[:, 3] > 0)


@pytest.mark.parametrize("dtype", DTYPES)
def test_what_is_looked_up_is_the_function_half_an_entry_away_at_most(dtype, rng):
    """Entries are the function itself, so it is enough to know which of them is taken."""
    volume = smooth_volume(dtype=dtype)
    found = classify(SOFT, volume)
    values = rng.uniform(60, min(240, volume.value_range[1]), 4000)  # the shapes'
    magnitudes = rng.uniform(0, 80, 4000)
    numbered = np.arange(len(found.rows), dtype=np.float32).repeat(4).reshape(-1, 4)
    number = at_places(replace(found, all_rows=numbered), values, magnitudes)[:, 3].astype(int)
    m, entry = np.divmod(number, len(found.table))
    off = np.abs(found.origin + (entry - 1) / found.scale - values)
    assert off.max() < (0.25 if dtype == np.uint8 else 180 / 1016) * (1 + 1e-4)
    assert np.abs(m / found.per_magnitude - magnitudes).max() < 80 / 252 * (1 + 1e-4)


@pytest.mark.parametrize("dtype", DTYPES)
def test_values_and_magnitudes_beyond_all_shapes_show_nothing(dtype):
    volume = smooth_volume(dtype=dtype)
    hard = TransferFunction2D([Box((80, 140), (5, 60), RED, 0.5, 0.0)], 1.0)
    found = classify(hard, volume)
    low, high = volume.value_range
    for value in (low, 79.4, 140.6, high):
        assert not at_places(found, np.full(3, value), np.array([6.0, 30, 59]))[:, 3].any()
    assert not at_places(found, np.full(4, 100.0), np.array([0, 4.2, 60.8, 1e9]))[:, 3].any()
    assert at_places(found, np.array([81.0, 139]), np.array([6.0, 59]))[:, 3].all()


def test_shapes_beyond_the_volumes_values_show_nothing():
    for dtype in DTYPES:
        volume = smooth_volume(dtype=dtype)
        found = classify(TransferFunction2D([Box((400, 500), (0, 60), RED, 0.5)]), volume)
        everywhere = np.linspace(*volume.value_range, 50)
        assert not at_places(found, everywhere, np.full(50, 30.0))[:, 3].any()
        image = Renderer(volume, TransferFunction2D([Box((400, 500), (0, 60), RED, 0.5)])).render(
            view_of(volume, DIRECTIONS[0], size=(8, 6))
        )
        assert not image.any()


def test_the_largest_magnitude_has_a_row_of_its_own():
    """Shapes that go on beyond all gradients of the volume are told apart where gradients are."""
    volume = smooth_volume()
    found = classify(TransferFunction2D([Box((0, 255), (0, 1e9), RED, 0.5, 0.0)], 1.0), volume)
    top = largest_magnitude(volume, 0.5)
    assert found.per_magnitude * top == pytest.approx(found.magnitudes - 2)
    np.testing.assert_allclose(
        at_places(found, np.full(3, 100.0), np.array([0, top / 2, top]))[:, 3], np.log(2)
    )


def test_a_volume_of_one_value_has_a_table():
    flat = Volume(np.full((3, 4, 5), 50, np.uint8))
    assert classify(SOFT, flat).per_magnitude > 0


# --- Pictures ---------------------------------------------------------------------------------------------


def eye_image(volume, transfer, view, look=None, **settings):
    return Renderer(volume, transfer, Settings(residual=0, **settings), look=look).composite(
        view.eye, [view.wall]
    )


LIT = Look(Lighting(headlight=0.8))


@pytest.mark.parametrize("look", [None, LIT, Look(None, None, 2.5)], ids=["plain", "lit", "far"])
def test_skipping_and_packing_change_no_pixel(look, rng):
    data = np.zeros((14, 15, 150), np.uint8)
    data[rng.random(data.shape) < 0.02] = 200
    volume = Volume(data)
    shapes = TransferFunction2D(
        [Box((90, 260), (0, 70), RED, 0.9), Triangle(150, (9, 99), 60, BLUE, 0.8)], 1.0
    )
    for towards in (DIRECTIONS[0], DIRECTIONS[2], DIRECTIONS[3]):
        view = view_of(volume, towards, distance=0.8)
        image, *others = (
            eye_image(volume, shapes, view, look, skip_empty=skip, pack_runs=pack)
            for skip, pack in ((True, True), (True, False), (False, False))
        )
        assert image.pixels[..., 3].max() > 0.3
        np.testing.assert_array_equal(image.pixels, others[0].pixels)
        if [face.size for face in image.faces] == [face.size for face in others[1].faces]:
            np.testing.assert_array_equal(image.pixels, others[1].pixels)


def test_a_box_over_all_magnitudes_is_a_function_of_values_alone():
    """Triangular over values: entries are a half instead of an eighth of a grey level apart."""
    volume = smooth_volume()
    box = TransferFunction2D([Box((20, 260), (0, 1e9), RED, 0.5, 1.0)], 1.0)
    values = np.linspace(20, 260, 241)
    alone = TransferFunction([(v, RED, float(box.opacity(v, 0))) for v in values], 1.0)
    for towards in DIRECTIONS[:3]:
        view = view_of(volume, towards)
        one, other = (eye_image(volume, transfer, view).pixels for transfer in (box, alone))
        assert one.max() > 0.5
        assert np.abs(one - other).max() < BOX_TABLE
    even = TransferFunction2D([Box((-1, 256), (0, 1e9), RED, 0.3, 0.0)], 1.0)
    one = eye_image(volume, even, view).pixels
    other = eye_image(volume, TransferFunction([(0, RED, 0.3)], 1.0), view).pixels
    assert np.abs(one - other).max() < FLOAT32_IMAGE / 10


@pytest.mark.parametrize("look", [None, LIT, Look(None, Modulation(0, 0.3, 0.7, 0.5), 1.5)])
@pytest.mark.parametrize("pose", ["identity", "sheared"])
def test_pictures_tend_to_the_reference(pose, look, rng):
    turned = np.eye(4) if pose == "identity" else random_pose(rng, spacing=(0.7, 1.2, 0.9), shear=0.3)
    volume = smooth_volume(world_from_object=turned)
    for towards in (DIRECTIONS[1], DIRECTIONS[4]):
        view = view_of(volume, towards, size=(24, 18))
        truth = reference.render(volume, SOFT, view, look=look, tolerance=1e-4)
        errors = []
        for samples in (1, 4):
            settings = Settings(quality=8, residual=0, samples_per_interval=samples, level_of_detail=False)
            errors.append(
                np.sqrt(np.mean((Renderer(volume, SOFT, settings, look=look).render(view) - truth) ** 2))
            )
        assert truth[..., 3].max() > 0.5
        assert errors[1] < PICTURE_2D and errors[1] < 0.8 * errors[0]


def test_magnitudes_matter():
    """Without the gradient the picture is another: what the function hides inside is seen."""
    volume = smooth_volume()
    view = view_of(volume, DIRECTIONS[1])
    wide = TransferFunction2D([replace(BOX, magnitudes=(0, 1e9))], 1.0)
    narrow = TransferFunction2D([replace(BOX, magnitudes=(25, 60))], 1.0)
    one, other = (eye_image(volume, transfer, view).pixels for transfer in (wide, narrow))
    assert one[:, 3].max() > other[:, 3].max() + 0.1 > 0.15


def scaled(shape, by):
    magnitudes = tuple(by * m for m in shape.magnitudes)
    if isinstance(shape, Box):
        return replace(shape, magnitudes=magnitudes, values=tuple(by * v for v in shape.values))
    return replace(shape, magnitudes=magnitudes, value=by * shape.value, width=by * shape.width)


@pytest.mark.parametrize("spacing", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("exponent", [-120, -50, -30, 20, 60, 110])
def test_values_of_any_size_make_the_same_picture(exponent, spacing):
    """Squares of gradients stay within float32, lit or not."""
    data, by = smooth_volume(dtype=np.float32).data, 2.0**exponent
    expected_volume = Volume(data, spacing=(spacing,) * 3)
    volume = Volume(np.ldexp(data, exponent), spacing=(spacing,) * 3)
    shapes = (replace(one, magnitudes=tuple(m / spacing for m in one.magnitudes)) for one in SOFT.shapes)
    plain = TransferFunction2D(shapes, spacing)
    larger = TransferFunction2D([scaled(shape, by) for shape in plain.shapes], spacing)
    view = view_of(volume, DIRECTIONS[1], size=(16, 12))
    expected = Renderer(expected_volume, plain, look=LIT).render(view)
    assert expected.max() > 0.1
    image = Renderer(volume, larger, look=LIT).render(view)
    np.testing.assert_allclose(image, expected, atol=FLOAT32_IMAGE)


def test_there_are_no_integrals_of_two_dimensional_functions():
    volume = smooth_volume()
    view = view_of(volume, DIRECTIONS[1], size=(16, 12))
    plain = Renderer(volume, SOFT, Settings(residual=0, preintegrated=False))
    asked = Renderer(volume, SOFT, Settings(residual=0, preintegrated=True))
    np.testing.assert_array_equal(asked.render(view), plain.render(view))
    assert asked.last["preintegrated"] is False
    asked.transfer = HAZE
    asked.render(view)
    assert asked.last["preintegrated"] is True
    opaque = TransferFunction2D([Box((60, 150), (0, 90), RED, 1.0)], 0.01)
    chosen = Renderer(volume, opaque)
    chosen.render(view)
    assert chosen.last["preintegrated"] is False and chosen.last["samples_per_interval"] == 2
    thin = Renderer(volume, TransferFunction2D([Box((60, 150), (0, 90), RED, 0.3)], 1.0))
    thin.render(view)
    assert thin.last["samples_per_interval"] == 1


def test_functions_of_one_and_two_dimensions_take_turns():
    volume = smooth_volume((20, 20, 20))
    view = view_of(volume, DIRECTIONS[1], size=(32, 24))
    mine = Renderer(volume, HAZE, look=LIT)
    for transfer, look in ((SOFT, LIT), (HAZE, LIT), (HAZE, None), (SOFT, None), (HAZE, None), (SOFT, LIT)):
        mine.transfer, mine.look = transfer, look
        image = mine.render(view)
        assert image.max() > 0.1
        np.testing.assert_array_equal(image, Renderer(volume, transfer, look=look).render(view))


def test_two_dimensional_functions_with_the_same_opacities_encode_once():
    volume = smooth_volume((20, 20, 20))
    view = view_of(volume, DIRECTIONS[1], size=(16, 12))
    mine = Renderer(volume, SOFT)
    mine.render(view)
    runs = {axis: mine.runs.axis(axis) for axis in range(3)}
    mine.transfer = TransferFunction2D([replace(BOX, colour=BLUE), TRIANGLE], 1.0)
    image = mine.render(view)
    assert all(mine.runs.axis(axis) is kept for axis, kept in runs.items())
    np.testing.assert_array_equal(image, Renderer(volume, mine.transfer).render(view))


def test_a_scene_file_renders_with_one(tmp_path):
    np.save(tmp_path / "ball.npy", ball())
    box = {
        "shape": "box",
        "values": [60, 190],
        "magnitudes": [0, 40],
        "colour": [1, 0.3, 0.1],
        "opacity": 0.2,
    }
    keys = {"volume": "ball.npy", "tf2d": [box], "opacity_unit": 1, "eye": [40, -50, 35], "size": [48, 40],
            "centre": [11.5, 11.5, 11.5], "up": [0, 0, 1], "fovy": 30}  # fmt: skip
    (tmp_path / "scene.json").write_text(json.dumps(keys))
    result_of("render", tmp_path / "scene.json", "-o", tmp_path / "out.npy")
    shape = Box((60, 190), (0, 40), (1, 0.3, 0.1), 0.2)
    view = View.look_at((40, -50, 35), (11.5, 11.5, 11.5), (0, 0, 1), 30, (48, 40))
    expected = Renderer(Volume(ball()), TransferFunction2D([shape], 1.0)).render(view)
    assert expected.max() > 0.3
    np.testing.assert_array_equal(np.load(tmp_path / "out.npy"), expected)


def test_either_kind_is_told_by_its_type():
    volume = smooth_volume()
    assert type(classify(HAZE, volume)) is Classification and classify(HAZE, volume).magnitudes == 1
    assert classify(SOFT, volume).magnitudes > 1
    assert not classify(SOFT, volume).hides_like(classify(HAZE, volume))
    assert classify(SOFT, volume).hides_like(
        classify(TransferFunction2D([replace(BOX, colour=BLUE), TRIANGLE], 1.0), volume)
    )
    found = classify(SOFT, volume)
    for changes in ({"origin": 1.0}, {"scale": 3.0}, {"per_magnitude": 1.0}, {"magnitudes": 2}):
        assert not found.hides_like(replace(found, **changes))
    assert found.hides_like(replace(found))
