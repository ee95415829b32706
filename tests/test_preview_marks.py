"""Marks, picks, window and level in the preview: keys, mouse, and the pictures of both ways to draw."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from samples import result_of
from tolerances import FLOAT32_IMAGE, MARK_HALF, MARK_OPENGL

import persp_sw as psw
from persp_sw.volume.phantoms import synthetic_ct
from vr_plugin.marks.marking import Marking
from vr_plugin.preview.controller import Preview
from vr_plugin.preview.figures import Rate, figures
from vr_plugin.preview.pictures import PreviewPictures
from vr_plugin.preview.run import software_frame
from vr_plugin.preview.session import open_preview, press
from vr_plugin.stereo import in_eyes_picture

m = psw.marks
SIZE = (192, 144)


@pytest.fixture(scope="module")
def scene() -> psw.Scene:
    volume = psw.Volume(synthetic_ct(24).data, spacing=(2, 2, 3), orientation="LPS", name="body")
    return psw.Scene.of_volume(volume, tf="surface", size=SIZE, background=(0.02, 0.01, 0.03))


@pytest.fixture
def opened(scene: psw.Scene) -> tuple[Preview, PreviewPictures]:
    return open_preview(scene, psw.Settings(), size=SIZE, presets=("fog", "surface"))


def shown(opened: tuple, keys: str = "", now: float = 0.0):
    preview, pictures = opened
    press(preview, keys)
    wanted = preview.advance(now)
    return wanted, pictures.draw(wanted, pictures.composite(wanted))[0]


def pick_at(preview: Preview, x: float, y: float) -> None:
    preview.pointer(x, y)
    press(preview, "I")


# --- keys and mouse -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("key", "name"), [("B", "box"), ("Y", "axes"), ("U", "scale_bar"), ("L", "legend")])
def test_keys_show_and_hide_marks(opened: tuple, key: str, name: str):
    preview, _ = opened
    before = preview.advance(0.0)
    assert not before.marks
    press(preview, key)
    wanted = preview.advance(0.1)
    assert wanted.marks == m.MarkChoice(**{name: True}) and wanted.moving
    assert wanted.eye_images == before.eye_images  # nothing is composited anew
    press(preview, key)
    assert not preview.advance(0.2).marks


def test_the_cursor_comes_with_planes_then_goes(opened: tuple, scene: psw.Scene):
    preview, _ = opened
    middle = tuple(scene.volume.centre)
    for cursor, planes in ((middle, False), (middle, True), (None, False), (middle, False)):
        press(preview, "C")
        marks = preview.advance(0.0).marks
        assert (marks.cursor, marks.planes) == (cursor, planes)


def test_picks_set_the_cursor_and_tell_the_distance(opened: tuple, scene: psw.Scene):
    preview, _ = opened
    probe, view = psw.Probe(scene.volume, scene.transfer), scene.view(0)
    one, two = (probe.pick(view, place) for place in ((96, 72), (110, 60)))
    pick_at(preview, 96, 72)
    wanted = preview.advance(0.0)
    np.testing.assert_allclose(wanted.marks.cursor, one.position_world, atol=1e-6)
    assert wanted.marks.ruler is None
    for words in (
        f"value {m.short(one.value)}",
        m.position_text(scene.volume, one.position_world),
        f"depth {m.short(one.distance)} mm",
    ):
        assert words in wanted.picked and words in wanted.message
    pick_at(preview, 110, 60)
    wanted = preview.advance(0.1)
    np.testing.assert_allclose(wanted.marks.ruler, (one.position_world, two.position_world), atol=1e-6)
    apart = np.linalg.norm(two.position_world - one.position_world)
    assert f"distance {m.short(apart)} mm" in wanted.picked
    figures_ = dict.fromkeys(("composite_ms", "warp_ms", "samples", "quality", "target_hz"), 1.0)
    figures_ |= {"faces": 1, "compositings": 1, "intermediate_size": (9, 9), "warp": "software", "why": ""}
    told = figures(wanted, figures_ | {"samples_per_interval": 1, "preintegrated": False}, Rate())
    assert [line.split()[0] for line in told.splitlines()][-5:] == [
        "value",
        "at",
        "depth",
        "distance",
        "help",
    ]
    pick_at(preview, 2, 2)
    wanted = preview.advance(0.2)
    assert "nothing" in wanted.message
    np.testing.assert_allclose(wanted.marks.cursor, two.position_world, atol=1e-6)
    press(preview, "C C")
    wanted = preview.advance(0.3)
    assert wanted.marks.cursor is wanted.marks.ruler is None and not wanted.picked
    pick_at(preview, 96, 72)  # measured distances begin anew
    assert preview.advance(0.4).marks.ruler is None


def test_ctrl_click_picks_and_drags_do_not(opened: tuple):
    preview, _ = opened
    home = preview.advance(0.0).camera

    def click(**modifiers: bool) -> None:
        preview.pointer(96, 72)
        preview.button("left", True, **modifiers)
        preview.button("left", False, **modifiers)

    click()
    assert preview.advance(0.1).marks.cursor is None
    click(control=True)
    wanted = preview.advance(1.0)
    assert wanted.marks.cursor is not None and wanted.window is None
    np.testing.assert_array_equal(wanted.camera.pose.matrix, home.pose.matrix)
    before = wanted.marks
    preview.button("left", True)
    preview.pointer(120, 72)
    preview.button("left", False)
    assert preview.advance(2.0).marks == before


def test_picks_in_halves_of_a_window_are_of_what_is_shown_there(opened: tuple, scene: psw.Scene):
    preview, _ = opened
    press(preview, "5")
    found = []
    for x in (48.0, 48.0 + 96):
        pick_at(preview, x, 72)
        found.append(preview.advance(0.0).marks.cursor)
    expected = psw.Probe(scene.volume, scene.transfer).pick(scene.view(0), (96, 72)).position_world
    np.testing.assert_allclose(found, [expected, expected], atol=1e-6)


def test_places_in_eyes_pictures():
    assert in_eyes_picture("mono", (200, 100), (150, 30)) == (150, 30)
    assert in_eyes_picture("anaglyph", (200, 100), (150, 30)) == (150, 30)
    assert in_eyes_picture("side_by_side", (200, 100), (150, 30)) == (100, 30)
    assert in_eyes_picture("top_bottom", (200, 100), (150, 80)) == (150, 60)


def test_nothing_is_picked_in_the_room(opened: tuple):
    preview, _ = opened
    press(preview, "TAB I")
    wanted = preview.advance(0.0)
    assert "Tab" in wanted.message and wanted.marks.cursor is None
    assert "nothing" in Marking().pick(None, (0, 0))


def test_ctrl_drags_change_window_and_level(opened: tuple, scene: psw.Scene):
    preview, pictures = opened

    def drag(right: float, down: float) -> tuple[float, float]:
        preview.pointer(90, 70)
        preview.button("left", True, control=True)
        preview.pointer(90 + right, 70 + down)
        preview.button("left", False, control=True)
        return preview.advance(0.0).window

    before = preview.advance(0.0)
    home = before.camera
    level, width = psw.window_of(scene.transfer)
    first = drag(0, -36)  # a quarter of the height upwards
    assert first == pytest.approx((level + width / 4, width))
    second = drag(48, 0)
    assert second == pytest.approx((first[0], 2 * width))  # a third of the height: 8^(1/3)
    wanted = preview.advance(9.0)
    assert wanted.eye_images != before.eye_images
    np.testing.assert_array_equal(wanted.camera.pose.matrix, home.pose.matrix)
    assert wanted.marks.cursor is None and "level" in wanted.message
    done = pictures.composite(wanted)
    assert psw.window_of(pictures.renderer.transfer) == pytest.approx(second)
    expected = psw.Renderer(scene.volume, psw.window_level(*second)).render(scene.view(0))
    np.testing.assert_allclose(pictures.draw(wanted, done)[0]["middle"], expected, atol=FLOAT32_IMAGE)
    press(preview, ".")
    wanted = preview.advance(9.1)
    assert wanted.window is None and wanted.preset == "fog"
    pictures.composite(wanted)
    fog = psw.Scene.of_volume(scene.volume, tf="fog").transfer
    np.testing.assert_array_equal(pictures.renderer.transfer.values, fog.values)


def test_windows_stay_within_what_there_is(scene: psw.Scene):
    marking = Marking(volume=scene.volume)
    low, high = scene.volume.value_range
    level, width = marking.window_after(None, 0, 0)
    assert (level, width) == pytest.approx(((low + high) / 2, high - low))
    assert marking.window_after((level, width), 99, 99) == pytest.approx((2 * high - low, 10 * width))
    level, narrow = marking.window_after((level, width), -99, 0)
    assert 0 < narrow < 1e-3


# --- pictures -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("keys", ["B", "Y", "U", "L", "C C", "B Y U L C"])
def test_marks_are_in_the_pictures_and_go_without_a_trace(opened: tuple, scene: psw.Scene, keys: str):
    _, before = shown(opened)
    before = before["middle"].copy()
    wanted, eyes = shown(opened, keys)
    view, palette = scene.view(0), m.Palette.over(scene.background)
    marks = wanted.marks.of_view(scene.volume, view, palette=palette)
    expected = m.painted(before, view, marks, opened[1].marks.probe)
    if wanted.marks.legend:
        legend, place = m.legend_for(SIZE, scene.transfer, scene.volume, palette)
        m.lay_over(expected, legend.picture, *place)
    np.testing.assert_allclose(eyes["middle"], expected, atol=FLOAT32_IMAGE)
    same = (expected == before).all(-1)
    assert 0.2 * same.size < same.sum() < same.size
    np.testing.assert_array_equal(eyes["middle"][same], before[same])
    back = {"C C": "C", "B Y U L C": "B Y U L C C"}.get(keys, keys)
    wanted, eyes = shown(opened, back)
    assert not wanted.marks
    np.testing.assert_array_equal(eyes["middle"], before)


@pytest.mark.parametrize("key", ["5", "6", "8"])
def test_each_eye_sees_marks_at_their_depth(opened: tuple, scene: psw.Scene, key: str):
    """In the pictures of both eyes they lie where their own view sees them."""
    preview, pictures = opened
    press(preview, f"{key} B")
    wanted = preview.advance(0.0)
    done = pictures.composite(wanted)
    plain = {p.eye: pictures.warp(p.eye, p.image, p.view).copy() for p in done.inside.pictures}
    drawn, _ = pictures.draw(wanted, done)
    changed = []
    for p in done.inside.pictures:
        marks = m.bounding_box(scene.volume, m.Palette.over(scene.background))
        expected = m.painted(plain[p.eye], p.view, marks, pictures.marks.probe)
        np.testing.assert_array_equal(drawn[p.eye], expected)
        changed.append((drawn[p.eye] != plain[p.eye]).any(-1))
    assert (changed[0] != changed[1]).any()


def test_a_scale_bar_is_in_one_place_for_both_eyes_and_not_in_the_room(opened: tuple):
    preview, pictures = opened
    press(preview, "8 U")
    wanted = preview.advance(0.0)
    done = pictures.composite(wanted)
    plain = {p.eye: pictures.warp(p.eye, p.image, p.view).copy() for p in done.inside.pictures}
    drawn, _ = pictures.draw(wanted, done)
    places = [(drawn[eye][100:, :60] != plain[eye][100:, :60]).any(-1) for eye in ("left", "right")]
    assert places[0].any()
    np.testing.assert_array_equal(*places)
    wanted, room = shown(opened, "TAB")
    _, without = shown(opened, "U")
    np.testing.assert_array_equal(room["left"], without["left"])


def test_marks_are_on_the_walls_of_a_room(opened: tuple):
    _, before = shown(opened, "TAB V")
    before = before["left"].copy()
    _, after = shown(opened, "B C C")
    assert (np.abs(after["left"] - before).max(-1) > 0.05).sum() > 30


@pytest.mark.gl
@pytest.mark.parametrize("keys", ["B", "Y", "U", "L", "C C", "5 B C U L", "6 Y L", "8 B C C", "TAB V B C"])
def test_opengl_draws_the_marks_that_the_processor_draws(
    gl_context: psw.OffscreenContext, scene: psw.Scene, keys: str
):
    from vr_plugin.preview.run import _TextureFrames

    preview, pictures = open_preview(scene, psw.Settings(), size=SIZE)
    press(preview, "O")
    plain = frames_of(preview, pictures, _TextureFrames(pictures))
    pick_at(preview, 96, 72)
    pick_at(preview, 110, 60)
    press(preview, "C C " + keys)
    preview.choices.message = ""
    software, texture = frames_of(preview, pictures, _TextureFrames(pictures))
    error = np.abs(software - texture).max(-1)
    drawn = np.abs(software - plain[0]).max(-1) > 0.1
    if "TAB" in keys:
        assert np.quantile(error, 0.8) < MARK_OPENGL
        return
    assert drawn.sum() > 50
    assert np.quantile(error, 0.98) < MARK_OPENGL
    assert error.mean() < MARK_OPENGL / 4


@pytest.mark.gl
@pytest.mark.parametrize("eye", [(70, 40, 60), (-30, 80, 20), (24, 20, 30)])
def test_each_kind_of_mark_is_what_the_processor_paints(
    gl_context: psw.OffscreenContext, scene: psw.Scene, eye: tuple
):
    """In one picture of float32, with nothing between: only rims of lines and of sheets may differ."""
    from vr_plugin.marks.shapes import MarkShapes
    from vr_plugin.screen.eye_target import EyeTarget
    from vr_plugin.screen.shapes import Shapes

    volume = scene.volume
    fog = psw.TransferFunction([(0, (0.3, 0.5, 0.9), 0), (200, (1, 0.6, 0.3), 0.05)], 1.0)
    renderer = psw.Renderer(volume, fog)
    probe, middle = psw.Probe.of(renderer), volume.centre
    view = psw.View.look_at(eye, middle + (3, 2, 1), (0, 0, 1), 50, SIZE)
    image = renderer.render(view)
    word = m.Label(middle + (-9, 8, -5), "H", (1.0, 0.9, 0.1), (0.0, 0.1, 0.0), letter=30)
    for marks in (
        m.bounding_box(volume),
        m.Marks(labels=[word]),
        m.Marks(m.cursor(volume, middle, planes=True).sheets),
        m.cursor(volume, middle),
    ):
        veiled = m.veil(marks, view, probe)
        expected = image.copy()
        m.paint(expected, view, veiled)
        target, shapes = EyeTarget(SIZE, "float32"), Shapes()
        drawn = MarkShapes(shapes)
        target.upload(image)
        with target.drawing(clear=False):
            drawn.draw(veiled, view, SIZE)
        texture = target.read()
        for part in (drawn, shapes, target):
            part.close()
        error = np.abs(texture - expected).max(-1)
        assert (np.abs(expected - image).max(-1) > 0.05).any() or eye == (24, 20, 30)
        assert np.quantile(error, 0.995) < MARK_HALF
        assert error.mean() < MARK_HALF


def frames_of(preview: Preview, pictures: PreviewPictures, texture_frames) -> tuple:
    """sRGB 0 … 1 of the processor and of OpenGL."""
    wanted = preview.advance(0.0)
    done = pictures.composite(wanted)
    software, _ = software_frame(pictures, wanted, done, Rate())
    texture, _ = texture_frames(pictures, wanted, done, Rate())
    return psw.images.srgb(software[..., :3]), psw.images.srgb(texture[..., :3])


def test_the_command_starts_with_marks(tmp_path: Path):
    np.save(tmp_path / "body.npy", synthetic_ct(24).data)
    common = ("--offscreen", "--size", 96, 72, "--press", "O", "--json")
    pictures = []
    for options in ((), ("--box", "--cursor", 12, 12, 12, "--planes"), ("--window", 120, 100)):
        out = tmp_path / str(len(pictures))
        values = result_of("view", tmp_path / "body.npy", *common[:-1], "-o", out, *options)
        pictures.append(np.asarray(psw_image(values["pictures"][0]), int))
    assert (np.abs(pictures[1] - pictures[0]).max(-1) > 20).sum() > 200
    assert (np.abs(pictures[2] - pictures[0]).max(-1) > 20).sum() > 200


def psw_image(path: str):
    from PIL import Image

    return Image.open(path)


def test_two_dimensional_functions_have_marks_but_no_legend(scene: psw.Scene):
    function = psw.TransferFunction2D([psw.Box((60, 255), (2, 90), (0.9, 0.5, 0.2), 0.6)], 1.0)
    preview, pictures = open_preview(scene, psw.Settings(), size=SIZE)
    pictures.renderer.transfer = function
    press(preview, "L")
    wanted = preview.advance(0.0)
    assert pictures.marks.legend(wanted) is None
    picture = pictures.renderer.render(scene.view(0))
    choice = m.MarkChoice(box=True, legend=True)
    with_box = m.with_marks(picture, pictures.renderer, scene.view(0), choice)
    without = m.with_marks(picture, pictures.renderer, scene.view(0), m.MarkChoice(box=True))
    np.testing.assert_array_equal(with_box, without)
    assert (with_box != picture).any()
    marking = Marking(volume=scene.volume, transfer=lambda: function)
    low, high = scene.volume.value_range
    assert marking.window_after(None, 0, 0) == pytest.approx(((low + high) / 2, high - low))
