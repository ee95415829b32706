"""What the panel changes, and its handles in the view, without widgets and without a window."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from tolerances import HANDLE_PIXELS

import persp_sw as psw
from persp_sw.volume.phantoms import synthetic_ct
from vr_plugin.cameras import Camera
from vr_plugin.panel.colours import decoded, encoded
from vr_plugin.panel.desk import Desk
from vr_plugin.panel.handles import (
    REACH,
    box_edges,
    handle_at,
    handles_of,
    move,
    pixel,
    pixels_from_world,
    steps_to,
)
from vr_plugin.panel.statistics import SECONDS, Recent
from vr_plugin.preview.session import open_preview, press

SIZE = (320, 240)
TURNED = np.array(
    [[0.0, -2.0, 0.0, 5.0], [1.5, 0.0, 0.0, -3.0], [0.0, 0.3, 1.0, 2.0], [0.0, 0.0, 0.0, 1.0]]
)  # turned, stretched and sheared


def desk_of(volume: psw.Volume, **keys: object) -> Desk:
    scene = psw.Scene.of_volume(volume, size=SIZE, **keys)
    preview, pictures = open_preview(scene, psw.Settings(), size=SIZE, presets=("mri", "fog"))
    desk = Desk(preview.choices, pictures)
    desk.preview = preview
    return desk


@pytest.fixture
def desk() -> Desk:
    return desk_of(psw.Volume(synthetic_ct(24).data, world_from_object=TURNED))


# --- the desk ----------------------------------------------------------------------------------------------


def test_presets_by_menu_and_by_key_are_steps_of_one_history(desk: Desk):
    own = desk.transfer
    desk.choose_preset("fog")
    assert desk.preset == "fog"
    press(desk.preview, ".")
    desk.take_over()
    mri = desk.transfer
    assert desk.preset == "mri" and mri is not own
    desk.edit.delete(0)
    desk.hand_over()
    assert desk.preset == "edited"
    for expected in ("mri", "fog"):
        desk.edit.undo()
        desk.hand_over()
        assert desk.preset == expected
    desk.edit.undo()
    desk.hand_over()
    assert desk.transfer is own
    assert not desk.edit.history.can_undo


def test_the_crop_box_stays_one_and_within_the_volume(desk: Desk):
    assert desk.crop == (0, 23, 0, 23, 0, 23)
    desk.set_crop(0, 5.5)
    desk.set_crop(1, 2.0)  # not past the other side
    assert desk.crop[:2] == (5.5, 5.5)
    desk.set_crop(1, 99.0)
    desk.set_crop(4, -3.0)
    assert desk.crop == (5.5, 23, 0, 23, 0, 23)
    assert desk.choices.edits.regions == psw.Regions(crop=desk.crop)
    desk.reset_regions()
    assert desk.choices.edits.regions is None


def test_clip_planes_come_go_and_turn(desk: Desk):
    centre = desk.volume.centre
    number = desk.add_clip((0.0, 0.0, -2.0))
    plane = np.array(desk.regions.clip[number])
    np.testing.assert_allclose(plane[:3], (0, 0, -1))
    assert plane[:3] @ centre + plane[3] == pytest.approx(0, abs=1e-12)
    desk.add_clip((1.0, 0.0, 0.0))
    desk.set_clip(0, -plane)
    assert desk.regions.clip[0] == tuple((-plane).tolist())
    desk.remove_clip(0)
    assert len(desk.regions.clip) == 1 and desk.regions.clip[0][0] == 1.0


def test_what_is_edited_is_what_the_scene_had_till_then():
    desk = desk_of(synthetic_ct(16), crop=(2, 12, 0, 15, 0, 15), clip=[(1, 0, 0, -4)])
    desk.set_crop(3, 9.0)
    assert desk.regions == psw.Regions(crop=(2, 12, 0, 9, 0, 15), clip=[(1, 0, 0, -4)])
    before = desk.choices.edits
    desk.set_regions(psw.Regions(crop=(2, 12, 0, 9, 0, 15), clip=[(1, 0, 0, -4)]))
    assert desk.choices.edits is before  # the same one is no edit


# --- handles -----------------------------------------------------------------------------------------------


def camera(desk: Desk, azimuth: float = 0.4, elevation: float = 0.3, far: float = 3.0) -> Camera:
    reach = far * float(np.ptp(box_edges(desk).reshape(-1, 3), axis=0).max())
    direction = np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )
    return Camera.look_at(desk.volume.centre + reach * direction, desk.volume.centre, (0, 0, 1), 0.7)


def test_pixels_are_those_of_the_pictures(desk: Desk):
    seen = camera(desk)
    view = psw.View(psw.Eye(seen.position), seen.wall(SIZE))
    for point in box_edges(desk)[:, 0]:
        x, y, w = view.viewport_from_world @ (*point, 1.0)
        np.testing.assert_allclose(pixel(pixels_from_world(seen, SIZE), point), (x / w, y / w), atol=1e-9)
    assert pixel(pixels_from_world(seen, SIZE), 2 * seen.position - seen.pivot) is None


def test_handles_are_on_their_sides_and_planes(desk: Desk):
    desk.set_crop(0, 5.0)
    desk.set_crop(3, 12.0)
    desk.set_regions(psw.Regions(crop=desk.crop, clip=[(1.0, 2.0, -0.5, 3.0)]))
    *sides, plane = handles_of(desk)
    object_from_world = np.linalg.inv(desk.volume.world_from_object)
    middle = np.array([14.0, 6.0, 11.5])
    for side, handle in enumerate(sides):
        place = middle.copy()
        place[side // 2] = desk.crop[side]
        np.testing.assert_allclose(object_from_world @ (*handle.point, 1), (*place, 1), atol=1e-9)
    assert np.dot((1.0, 2.0, -0.5), plane.point) + 3.0 == pytest.approx(0, abs=1e-9)
    np.testing.assert_allclose(plane.direction, np.array((1.0, 2.0, -0.5)) / np.linalg.norm((1, 2, -0.5)))


@given(
    st.floats(-3, 3),
    st.floats(-1.4, 1.4),
    st.integers(0, 6),
    st.floats(-25, 25),
)
def test_a_dragged_dot_stays_under_the_pointer(azimuth: float, elevation: float, which: int, along: float):
    desk = shared_desk()
    desk.reset_regions()
    desk.set_regions(psw.Regions(crop=(6, 17, 6, 17, 6, 17), clip=[(1.0, 2.0, -0.5, -6.0)]))
    matrix = pixels_from_world(camera(desk, azimuth, elevation, 8.0), SIZE)
    handle = handles_of(desk)[which]
    at, ahead = pixel(matrix, handle.point), pixel(matrix, handle.point + 1e-3 * handle.direction)
    line = (ahead - at) / 1e-3  # pixels a step
    assume(np.linalg.norm(line) >= 1.0)  # seen end on, a pixel would be many steps
    line = line / np.linalg.norm(line)
    pointer = at + along * line
    steps = steps_to(handle, matrix, tuple(pointer))
    assert steps is not None
    assume(handle.kind == "clip" or abs(steps) <= 5)  # where no other side stops it
    move(desk, handle, steps)
    now = handles_of(desk)[which]
    np.testing.assert_allclose(pixel(matrix, now.point), pointer, atol=HANDLE_PIXELS)
    # Beside its line it is as near as the line leads.
    aside = pointer + 7.0 * np.array([-line[1], line[0]])
    assert steps_to(handle, matrix, tuple(aside)) == pytest.approx(steps, abs=1e-4 + 1e-4 * abs(steps))


_SHARED: list[Desk] = []


def shared_desk() -> Desk:
    """One for all examples: making one costs more than they do."""
    if not _SHARED:
        _SHARED.append(desk_of(psw.Volume(synthetic_ct(24).data, world_from_object=TURNED)))
    return _SHARED[0]


def test_a_moved_plane_clips_what_the_renderer_shows(desk: Desk):
    desk.add_clip((1.0, 0.0, 0.0))
    (handle,) = [h for h in handles_of(desk) if h.kind == "clip"]
    move(desk, handle, 2.0)
    plane = np.array(desk.regions.clip[0])
    assert plane[:3] @ (handle.point + 2.0 * handle.direction) + plane[3] == pytest.approx(0, abs=1e-9)
    np.testing.assert_allclose(plane[:3], (1, 0, 0))


def test_the_nearest_dot_within_reach_is_taken(desk: Desk):
    seen = camera(desk)
    matrix, handles = pixels_from_world(seen, SIZE), handles_of(desk)
    for handle in handles:
        at = pixel(matrix, handle.point)
        assert handle_at(handles, matrix, tuple(at)) is handle
    assert handle_at(handles[:1], matrix, tuple(pixel(matrix, handles[0].point) + (REACH + 1, 0))) is None


def test_a_line_seen_end_on_moves_nothing(desk: Desk):
    handle = handles_of(desk)[1]
    eye = handle.point + 40 * handle.direction
    seen = Camera.look_at(eye, handle.point, (0, 0, 1), 0.7)
    assert steps_to(handle, pixels_from_world(seen, SIZE), (100.0, 100.0)) is None


# --- small things ------------------------------------------------------------------------------------------


def test_colours_come_back_from_their_encoding():
    for colour in ((0.0, 0.5, 1.0), (0.002, 0.02, 0.2)):
        np.testing.assert_allclose(decoded(encoded(colour)), colour, atol=1e-12)


def test_statistics_are_of_the_last_seconds():
    recent = Recent()
    assert recent.column("ms").size == recent.column("at_s").size == 0
    for n in range(20):
        recent.add(float(n), {"quality": 0.1 * n, "samples": n}, 0.001 * n)
    np.testing.assert_allclose(recent.column("at_s"), np.arange(-SECONDS, 1))
    np.testing.assert_allclose(recent.column("ms"), np.arange(19 - SECONDS, 20))


def test_counts_of_values_are_of_every_voxel_of_a_small_volume():
    data = np.array([0, 0, 1, 3, 3, 3, 3, 8], np.uint8).reshape(2, 2, 2)
    counts, edges = psw.value_counts(psw.Volume(data), 8)
    assert counts.tolist() == [2, 1, 0, 4, 0, 0, 0, 1]
    assert (edges[0], edges[-1]) == (0, 8)
    holes = data.astype(np.float32)
    holes[0, 0, 0] = np.nan
    assert psw.value_counts(psw.Volume(holes), 8)[0].sum() == 7


# --- light -------------------------------------------------------------------------------------------------


def test_light_is_switched_changed_and_comes_back_as_it_was(desk: Desk):
    assert desk.look.is_plain
    desk.shade(True)
    assert desk.choices.edits.look == psw.Look(psw.Lighting())
    desk.set_lighting(ambient=0.5, model="blinn")
    desk.set_light(0, psw.Light((1, 0, 0)))
    desk.set_light(1, psw.Light((0, 1, 0), shadows=True))
    desk.set_light(0, psw.Light((0, 0, 1)))
    lit = psw.Lighting(0.5, model="blinn", lights=(psw.Light((0, 0, 1)), psw.Light((0, 1, 0), shadows=True)))
    assert desk.look.lighting == lit
    desk.shade(False)
    assert desk.look.is_plain
    desk.shade(True)
    assert desk.look.lighting == lit
    desk.set_light(0, None)
    assert desk.look.lighting.lights == lit.lights[1:]
    desk.modulate(psw.Modulation(high=0.5))
    assert desk.look.modulation.high == 0.5
    desk.reset_look()
    assert desk.choices.edits.look is None and desk.look.is_plain


def test_the_light_of_the_desk_is_that_of_the_pictures(desk: Desk):
    pictures, preview = desk._pictures, desk.preview
    plain = pictures.composite(preview.advance(0.0)).inside.pictures[0]
    desk.shade(True)
    desk.set_lighting(ambient=0.1)
    lit = pictures.composite(preview.advance(0.1)).inside.pictures[0]
    renderer = psw.Renderer(
        desk.volume, desk.transfer, pictures.renderer.settings, look=psw.Look(psw.Lighting(ambient=0.1))
    )
    expected = renderer.render(lit.view)
    np.testing.assert_array_equal(pictures.renderer.warp(lit.image, lit.view), expected)
    assert np.abs(expected - pictures.renderer.warp(plain.image, plain.view)).max() > 0.01
    desk.reset_look()
    again = pictures.composite(preview.advance(0.2)).inside.pictures[0]
    before = pictures.renderer.warp(plain.image, plain.view)
    np.testing.assert_array_equal(pictures.renderer.warp(again.image, again.view), before)


def test_a_window_by_dragging_is_one_step(desk: Desk):
    own = desk.transfer
    for width in (50.0, 60.0, 70.0):
        desk.choices.window = (100.0, width)
        desk.take_over()
    desk.edit.undo()
    desk.hand_over()
    assert desk.transfer is own


# --- functions of value and gradient ----------------------------------------------------------------------


def test_both_kinds_of_functions_are_kept_while_the_other_is_shown(desk: Desk):
    own = desk.transfer
    desk.show_2d(True)
    first = desk.transfer
    assert desk.is_2d and desk.editor is desk.shapes and first is desk.shapes.transfer
    desk.shapes.add(psw.Triangle(100.0, (1.0, 20.0), 10.0, (1, 0, 0), 0.5))
    desk.hand_over()
    assert len(desk.transfer.shapes) == 2
    desk.show_2d(False)
    assert desk.transfer is own
    desk.show_2d(True)
    desk.shapes.undo()
    desk.hand_over()
    assert desk.transfer is first
    desk.choose_preset("fog")
    assert not desk.is_2d and desk.preset == "fog"
    desk.edit.undo()
    desk.hand_over()
    assert desk.transfer is own


def test_a_scene_may_start_with_a_2d_function():
    row = {"shape": "box", "values": [50, 200], "magnitudes": [0, 90], "colour": [1, 1, 1], "opacity": 0.2}
    desk = desk_of(synthetic_ct(16), tf2d=[row])
    assert desk.is_2d and desk.shapes.transfer is desk.transfer
    assert isinstance(desk.edit.transfer, psw.TransferFunction)
    assert desk.preset == "the scene's own"
