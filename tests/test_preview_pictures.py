"""What the preview draws: the eyes' pictures, the room from outside, texts; the command without a screen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from samples import ball, fails, result_of
from tolerances import FLOAT32_IMAGE, ROOM_LINES

import persp_sw as psw
from persp_sw.volume.phantoms import synthetic_ct
from vr_plugin.cameras import Camera
from vr_plugin.pose import Pose
from vr_plugin.preview.controller import Preview
from vr_plugin.preview.figures import Rate
from vr_plugin.preview.pictures import PreviewPictures
from vr_plugin.preview.run import lay_texts, run_offscreen, software_frame
from vr_plugin.preview.session import open_preview, press
from vr_plugin.rigs.file import load_rig
from vr_plugin.room import outside
from vr_plugin.room.painter import BACKGROUND, RoomPainter, encoded
from vr_plugin.room.rooms import four_walls
from vr_plugin.screen.events import Button, Closing, Focus, Key, Pointer, Resized, Wheel
from vr_plugin.screen.lettering import lay_over, squeezed, text_panel

SIZE = (96, 64)
ROOT = Path(__file__).resolve().parent.parent
SRGB_STEP = 1 / 255  # half of one in each of two roundings, at most


@pytest.fixture(scope="module")
def scene() -> psw.Scene:
    return psw.Scene.of_volume(synthetic_ct(24), size=SIZE, background=(0.02, 0.01, 0.03))


@pytest.fixture
def opened(scene: psw.Scene) -> tuple[Preview, PreviewPictures]:
    return open_preview(scene, psw.Settings(), size=SIZE, presets=("fog", "surface"))


def drawn(opened: tuple, keys: str = "", now: float = 0.0):
    preview, pictures = opened
    press(preview, keys)
    wanted = preview.advance(now)
    done = pictures.composite(wanted)
    return wanted, done, pictures.draw(wanted, done)[0]


# --- the eyes' pictures ------------------------------------------------------------------------------------


def test_mono_is_the_scenes_own_picture(opened: tuple, scene: psw.Scene):
    wanted, _, eyes = drawn(opened)
    expected = psw.Renderer(scene.volume, scene.transfer).render(scene.view(0))
    np.testing.assert_allclose(eyes["middle"], expected, atol=FLOAT32_IMAGE)
    assert expected[..., 3].max() > 0.5
    shown = opened[1].window(wanted, eyes)
    over = expected[..., :3] + (1 - expected[..., 3:]) * scene.background
    np.testing.assert_allclose(shown[..., :3], over, atol=FLOAT32_IMAGE)


@pytest.mark.parametrize("key", ["5", "6", "7", "8"])
def test_stereo_shows_the_pictures_of_both_eyes_through_one_wall(opened: tuple, scene: psw.Scene, key: str):
    _, _, eyes = drawn(opened, key)
    wanted, done, _ = drawn(opened)
    assert done.statistics["compositings"] == 2
    renderer = psw.Renderer(scene.volume, scene.transfer)
    wall = wanted.camera.wall(SIZE)
    pixels = {"5": (48, 64), "6": (96, 32)}.get(key, SIZE)
    wall = psw.Wall(wall.lower_left, wall.lower_right, wall.upper_left, pixels)
    for name in ("left", "right"):
        expected = renderer.render(psw.View.through_wall(getattr(wanted.eyes, name), wall))
        np.testing.assert_allclose(eyes[name], expected, atol=FLOAT32_IMAGE)
    assert np.abs(eyes["left"] - eyes["right"]).max() > 0.05


def test_swapped_eyes_change_places(opened: tuple):
    wanted, _, eyes = drawn(opened, "5")
    before = opened[1].window(wanted, eyes)
    wanted, _, eyes = drawn(opened, "X")
    after = opened[1].window(wanted, eyes)
    np.testing.assert_array_equal(after, np.concatenate([before[:, 48:], before[:, :48]], 1))


def test_quality_reaches_the_renderer(opened: tuple):
    _, before, _ = drawn(opened)
    _, finer, _ = drawn(opened, "+ +")
    assert opened[1].renderer.settings.quality == pytest.approx(2)
    counts = [np.prod(done.statistics["intermediate_size"]) for done in (before, finer)]
    assert counts[1] > 2 * counts[0]


def test_presets_reach_the_renderer(opened: tuple, scene: psw.Scene):
    for keys in (".", "."):
        wanted, _, eyes = drawn(opened, keys)
        transfer = psw.Scene.of_volume(scene.volume, tf=wanted.preset).transfer
        expected = psw.Renderer(scene.volume, transfer).render(scene.view(0))
        np.testing.assert_allclose(eyes["middle"], expected, atol=FLOAT32_IMAGE)
        assert wanted.preset in ("fog", "surface")
    assert opened[1].renderer.transfer is not scene.transfer
    drawn(opened, ".")  # round to the scene's own
    assert opened[1].renderer.transfer is scene.transfer


# --- the room from outside ---------------------------------------------------------------------------------


def test_the_default_room_is_that_of_cave4():
    ours, theirs = four_walls(), load_rig(ROOT / "configs" / "cave4.toml")
    assert [wall.name for wall in ours.walls] == [wall.name for wall in theirs.walls]
    np.testing.assert_array_equal(ours.corners, theirs.corners)
    assert [wall.wall.pixels for wall in ours.walls] == [wall.wall.pixels for wall in theirs.walls]
    np.testing.assert_allclose(ours.eyes.rest_pose.matrix, theirs.eyes.rest_pose.matrix, atol=1e-12)
    assert ours.placement.size == theirs.placement.size
    assert ours.placement.centre == theirs.placement.centre


def test_from_outside_every_eye_is_composited_once_and_the_volume_once(opened: tuple):
    assert drawn(opened, "TAB")[1].statistics["compositings"] == 2
    assert drawn(opened, "8")[1].statistics["compositings"] == 3
    assert drawn(opened, "V")[1].statistics["compositings"] == 2


def test_a_head_mounted_displays_walls_stay_their_eyes(scene: psw.Scene):
    rig = ROOT / "configs" / "hmd.toml"
    opened = open_preview(scene, psw.Settings(), size=SIZE, rig_file=rig)
    for keys in ("TAB", "8", "M"):
        _, done, _ = drawn(opened, keys)
        eyes = {picture.wall.name: picture.eye for picture in done.inside.pictures}
        assert eyes == {wall.name: wall.stereo for wall in opened[0].rig.walls}
        assert sorted(eyes.values()) == ["left", "right"]


def test_walls_show_what_the_head_sees(opened: tuple, scene: psw.Scene):
    """A pixel of the room's picture is the pixel of the wall that its ray hits."""
    preview, pictures = opened
    press(preview, "TAB V")
    preview.resize(320, 240)
    wanted = preview.advance(0.0)
    done = pictures.composite(wanted)
    shown = pictures.window(wanted, pictures.draw(wanted, done)[0])
    front = next(p for p in done.inside.pictures if p.wall.name == "front")
    assert front.eye == "middle"
    wall_picture = pictures.renderer.warp(front.image, front.view)
    wall_picture = wall_picture[..., :3] + (1 - wall_picture[..., 3:]) * scene.background
    rows, columns = np.mgrid[40:340:20, 40:340:20]
    w = front.wall.wall
    points = (w.world_from_pixel @ np.stack([columns + 0.5, rows + 0.5, np.ones_like(rows)]).reshape(3, -1)).T
    view = psw.View.through_wall(wanted.camera.position, wanted.camera.wall(wanted.size))
    u, v = np.floor(view.project(points)).astype(int).T
    ours, theirs = shown[v, u, :3], wall_picture[rows.ravel(), columns.ravel()]
    # Names, the head and the box's edges cover some of the wall; most pixels are its own, seen through a
    # bilinear filter of its sRGB picture.
    error = np.abs(psw.images.srgb(ours) - psw.images.srgb(theirs)).max(-1)
    assert np.quantile(error, 0.7) < 3 * SRGB_STEP
    assert theirs.max() > 0.3


def test_a_picture_on_a_sheet_lies_where_projection_says():
    """A ramp in u and v on a slanted wall: each covered pixel's ray tells the ramp's value."""
    wall = psw.Wall((-1, -0.5, 0.2), (1.2, -0.4, -0.5), (-0.9, 0.8, 0.1), (200, 160), "ramp")
    across, down = np.meshgrid(np.arange(200) + 0.5, np.arange(160) + 0.5)
    ramp = np.stack([across, down, np.full_like(across, 128)], -1).round().astype(np.uint8)
    camera = Camera.look_at((0.5, 0.7, 3.0), (0, 0, 0), (0, 1, 0), 0.7)
    painter = RoomPainter(camera, (240, 200), {"ramp": ramp})
    (sheet,) = outside.sheets([wall])
    painter.sheet(sheet)
    shown = np.rint(255 * psw.images.srgb(painter.finished()[..., :3]))
    inverse = np.linalg.inv(
        np.column_stack([wall.lower_right - wall.lower_left, wall.lower_left - wall.upper_left, [0, 0, 0]])
        + np.outer(np.cross(wall.lower_right - wall.lower_left, wall.upper_left - wall.lower_left), [0, 0, 1])
    )
    directions, eye = painter.view.directions(), camera.position
    normal = np.cross(wall.lower_right - wall.lower_left, wall.upper_left - wall.lower_left)
    hit = eye + directions * (((wall.upper_left - eye) @ normal) / (directions @ normal))[..., None]
    share = (hit - wall.upper_left) @ inverse.T
    inside = (share[..., :2] > 0.03).all(-1) & (share[..., :2] < 0.97).all(-1)
    assert inside.mean() > 0.1
    expected = share[..., :2] * (200, 160)
    assert np.abs(shown[..., :2] - expected)[inside].max() <= 1.5  # a step of the ramp, rounded twice
    away = ((share[..., :2] < -0.03) | (share[..., :2] > 1.03)).any(-1)
    assert (np.abs(shown[away] - BACKGROUND) <= 1).all()


def test_lines_and_dots_lie_where_projection_says_and_nothing_behind_is_painted():
    camera = Camera.look_at((0, 0, 3.0), (0, 0, 0), (0, 1, 0), 0.7)
    painter = RoomPainter(camera, (120, 100), {})
    ends = np.array([(-0.5, 0.2, 0.4), (0.6, 0.2, -0.6)])
    painter.lines([outside.Line(ends, (255, 0, 0), 4.0)])
    painter.dots([outside.Dot(np.array((0.0, -0.5, 0.0)), (0, 255, 0), 4.0)])
    behind = np.array([(0.0, 0.0, 4.0), (0.5, 0.0, 9.0)])
    painter.lines([outside.Line(behind, (0, 0, 255), 3.0)])
    painter.dots([outside.Dot(behind[0], (0, 0, 255))])
    painter.labels([outside.Label(behind[0], "behind")])
    painter.lines(
        [outside.Line(np.array([(0.0, 0.9, 0.0), (0.0, 0.9, 50.0)]), (255, 255, 255), 2.0)]
    )  # partly
    shown = painter.finished()
    points = ends[0] + np.linspace(0.05, 0.95, 30)[:, None] * (ends[1] - ends[0])
    u, v = np.floor(painter.view.project(points)).astype(int).T
    assert (shown[v, u, 0] > 0.5).all()
    u, v = np.floor(painter.view.project(np.array((0.0, -0.5, 0.0)))).astype(int)
    assert shown[v, u, 1] > 0.9
    assert (shown[..., 2] < 0.1)[30:].all()  # no blue, no words
    u, v = np.floor(painter.view.project(np.array((0.0, 0.9, 0.3)))).astype(int)
    assert shown[v, u].min() > 0.5


def test_edges_of_a_box_are_parted_by_what_hides_them():
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float).reshape(2, 2, 2, 3)
    behind, before = outside.box_edges(corners, np.array((3, 4, 5)))
    assert (len(behind), len(before)) == (3, 9)
    for line in behind:  # those that meet in the corner that is farthest away
        assert np.abs(line.points).sum(1).min() == 0
    behind, before = outside.box_edges(corners, np.array((0.5, 0.5, 5)))
    assert (len(behind), len(before)) == (8, 4)  # seen face on
    behind, before = outside.box_edges(corners, np.array((0.5, 0.5, 0.5)))
    assert len(behind) == 12  # from inside: all are behind what is inside


def test_a_wall_that_an_eye_sees_from_behind_is_marked():
    (sheet,) = outside.sheets([psw.Wall((-1, 0, 0), (1, 0, 0), (-1, 2, 0), (10, 10), "front")])
    line, label = outside.frame_of(sheet, [np.array((0, 1, 1.0))])
    assert (line.colour, label.text) == (outside.FRAME, "front")
    line, label = outside.frame_of(sheet, [np.array((0, 1, 1.0)), np.array((0, 1, -1.0))])
    assert line.colour == outside.BLIND
    assert label.text == "front (seen from behind)"


def test_a_head_shows_where_it_looks_and_its_eyes():
    pose = Pose((1, 2, 3), (0, np.sin(0.4), 0, np.cos(0.4)))
    axes = outside.head_lines(pose)[-3:]
    for axis, line in zip(np.eye(3), axes, strict=True):
        np.testing.assert_allclose(line.points[0], (1, 2, 3))
        np.testing.assert_allclose(line.points[1], pose.apply(outside.AXIS_LENGTH * axis))
    assert [line.colour for line in axes] == list(outside.AXES)


def test_the_table_of_srgb_is_exact_to_a_step():
    light = np.linspace(0, 1, 20001)
    assert np.abs(encoded(light).astype(int) - np.rint(255 * psw.images.srgb(light))).max() <= 1
    assert encoded(np.array([-1.0, 2.0])).tolist() == [0, 255]


# --- texts -------------------------------------------------------------------------------------------------


def test_text_lies_over_the_picture_and_is_cut_at_its_edges():
    picture = np.ones((20, 30, 4), np.float32)
    panel = np.zeros((10, 10, 4), np.float32)
    panel[..., 3] = 0.5
    for x, y, count in ((5, 5, 100), (-4, -4, 36), (25, 15, 25), (40, 0, 0)):
        over = picture.copy()
        lay_over(over, panel, x, y)
        assert (over[..., 0] == 0.5).sum() == count
        assert (over[..., 3] == 1).all()


def test_a_text_is_squeezed_as_the_display_stretches_it(opened: tuple):
    panel = text_panel("figures", 12)
    assert squeezed(panel, 2, 1).shape == (panel.shape[0], panel.shape[1] // 2, 4)
    assert squeezed(panel, 1, 2).mean() == pytest.approx(panel[: panel.shape[0] // 2 * 2].mean(), rel=1e-5)
    wanted, _, eyes = drawn(opened, "5")
    with_text = lay_texts(wanted, [("figures", 12, "upper left")], eyes)
    for name in ("left", "right"):
        change = np.abs(with_text[name] - eyes[name]).max(-1) > 0
        rows, columns = np.flatnonzero(change.any(1)), np.flatnonzero(change.any(0))
        assert (rows[0], columns[0]) == (6, 3)
        assert len(columns) == pytest.approx(min(panel.shape[1] // 2, 48 - 3), abs=1)


# --- events ------------------------------------------------------------------------------------------------


def test_events_of_a_window_reach_the_controller(opened: tuple):
    from vr_plugin.preview.in_window import feed

    preview, _ = opened
    home = preview.advance(0.0).camera
    feed(
        preview,
        [
            Key("w", "8", True), Key("w", "8", False), Resized("w", 200, 100), Pointer("w", 100, 50),
            Button("w", "left", True), Pointer("w", 120, 50), Button("w", "left", False), Wheel("w", 1.0),
        ],
    )  # fmt: skip
    preview.advance(0.1)
    wanted = preview.advance(0.3)
    assert wanted.stereo.mode == "anaglyph"
    assert wanted.size == (200, 100)
    assert wanted.camera.distance < home.distance
    assert np.abs(wanted.camera.axes - home.axes).max() > 0.1
    feed(preview, [Key("w", "LEFT", True), Focus("w", False)])
    for now in np.arange(0.3, 5, 0.1):
        wanted = preview.advance(now)
    assert not wanted.moving
    feed(preview, [Closing("w")])
    assert preview.finished


# --- without a screen --------------------------------------------------------------------------------------


@pytest.mark.gl
@pytest.mark.parametrize(
    "keys", ["", "5", "6", "7", "8 X", "TAB", "TAB 8", "TAB V 5", "H", "2", "4", "TAB V R"]
)
def test_opengl_draws_what_the_processor_draws(gl_context: psw.OffscreenContext, scene: psw.Scene, keys: str):
    """But for smooth edges of lines and letters, and a filter of walls."""
    from vr_plugin.preview.run import _TextureFrames

    size = (192, 144)
    preview, pictures = open_preview(scene, psw.Settings(), size=size)
    press(preview, keys + ("" if "H" in keys else " O"))
    preview.orbit(1.3 if keys == "TAB V R" else 0.0)  # a wall is seen from behind
    wanted, rate = preview.advance(0.0), Rate()
    done = pictures.composite(wanted)
    software, _ = software_frame(pictures, wanted, done, rate)
    texture, figures = _TextureFrames(pictures)(pictures, wanted, done, rate)
    assert figures["warp"] == "texture"
    error = np.abs(psw.images.srgb(software[..., :3]) - psw.images.srgb(texture[..., :3])).max(-1)
    if "TAB" in keys:
        assert np.quantile(error, 0.8) < 2 * SRGB_STEP
        assert error.mean() < ROOM_LINES
    else:
        assert error.max() < 2 * SRGB_STEP
    assert software[..., :3].std() > 0.01


def test_frames_turn_and_are_written(opened: tuple, tmp_path: Path):
    preview, pictures = opened
    press(preview, "O P")
    done = run_offscreen(preview, pictures, frames=3, folder=tmp_path, name="body", turn=np.radians(30))
    names = [Path(row["picture"]).name for row in done.frames]
    assert names == ["body-0000.png", "body-0001.png", "body-0002.png"]
    first, second, _ = (np.asarray(Image.open(tmp_path / name)).astype(int) for name in names)
    assert first.shape == (*SIZE[::-1], 3)
    assert np.abs(first - second).mean() > 1
    (shot,) = done.screenshots
    np.testing.assert_array_equal(
        np.asarray(Image.open(shot)), first
    )  # the same but for texts, which are off


def test_the_command_writes_frames_and_figures(ball_file: Path, tmp_path: Path):
    out = tmp_path / "pictures"
    values = result_of(
        "view",
        ball_file,
        "--offscreen",
        "--frames",
        2,
        "--turn",
        10,
        "--size",
        *SIZE,
        "-o",
        out,
        "--outside",
        "--press",
        "O",
    )
    assert values["frames"] == 2
    assert values["compositings"] == 2
    assert values["warp"] == "software"
    assert min(values[key] for key in ("ms", "composite_ms", "warp_ms", "samples")) > 0
    assert sorted(map(str, out.iterdir())) == values["pictures"]
    corner = np.asarray(Image.open(values["pictures"][0]))[-1, -1]
    assert np.abs(corner.astype(int) - BACKGROUND).max() <= 1


def test_a_recorded_head_moves_from_frame_to_frame(ball_file: Path, tmp_path: Path):
    path = tmp_path / "optitrack-120hz.csv.gz"  # a name that cave4 knows; compressed or not is all the same
    rows = [f"{n / 60},{0.1 * n},1.7,1,0,0,0,1" for n in range(60)]
    path.write_text("\n".join(["t,x,y,z,qx,qy,qz,qw", *rows]))
    scene = psw.Scene.of_volume(psw.Volume(ball()), size=SIZE)
    preview, _ = open_preview(scene, psw.Settings(), size=SIZE, recording=path)
    press(preview, "TAB")
    preview.advance(0.0)
    np.testing.assert_allclose(preview.advance(10 / 60).head.position, (1.0, 1.7, 1.0), atol=1e-9)
    # In cave4 that tracker is turned by 180° about y, then shifted.
    rig = ROOT / "configs" / "cave4.toml"
    preview, _ = open_preview(scene, psw.Settings(), size=SIZE, rig_file=rig, recording=path)
    press(preview, "TAB")
    preview.advance(0.0)
    np.testing.assert_allclose(
        preview.advance(10 / 60).head.position, (-1.0 - 0.06, 1.7 + 0.95, -1.0 + 1.0), atol=1e-9
    )


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), "persp-sw render"),
        (("--offscreen", "--frames", 0), "--frames is at least 1"),
        (("--offscreen", "--press", "NONSENSE"), "there are no keys NONSENSE"),
        (("--offscreen", "--size", 3, 3), "16 … 16384 pixels"),
        (("--offscreen", "--rig", "nowhere.toml"), "nowhere.toml"),
        (("--offscreen", "--path", "nowhere.csv"), "nowhere.csv"),
        (("--offscreen", "-o", "/dev/null/x"), "choose another with -o"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(
    ball_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: tuple, words: str
):
    monkeypatch.chdir(tmp_path)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert words in fails("view", ball_file, *options)
