"""The picture of a room: everything in it, in its place."""

from __future__ import annotations

import numpy as np
import pytest
from rigs import CONFIGS, rig_of, wall_keys

import persp_sw as psw
from vr_plugin.placement import room_from_world
from vr_plugin.rigs.file import load_rig
from vr_plugin.room import drawing
from vr_plugin.room.drawing import Sheet
from vr_plugin.room.facts import WARNING
from vr_plugin.room.picture import SIZE, draw_room
from vr_plugin.room.plan import _Plan
from vr_plugin.room.scene import EDGES, RoomScene, between_walls
from vr_plugin.room.view import _View

AREA = (20, 30, 620, 430)
ALL = sorted(path.stem for path in CONFIGS.glob("*.toml"))


@pytest.fixture(scope="module")
def block() -> psw.Volume:
    """Everywhere opaque, so that its picture fills its box."""
    return psw.Volume(np.full((33, 49, 65), 255, np.uint8))


def scene_of(name: str, volume=None) -> RoomScene:
    return RoomScene.of(load_rig(CONFIGS / f"{name}.toml"), volume, None)


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("kind", [_View, _Plan])
def test_everything_is_within_the_picture(name, kind, block):
    scene = scene_of(name, block)
    places = kind(Sheet(*SIZE), AREA, scene).at(scene.points).reshape(-1, 2)
    assert (places > AREA[:2]).all() and (places < AREA[2:]).all()
    extent = np.ptp(places, axis=0) / np.subtract(AREA[2:], AREA[:2])
    assert extent.max() > 0.4  # and not small in a corner


@pytest.mark.parametrize("name", ["cave4", "powerwall"])
def test_the_volume_fills_its_box(name, block):
    """The renderer's picture and the drawn box come from different code; they agree to a pixel."""
    scene = scene_of(name, block)
    view = _View(Sheet(*SIZE), AREA, scene)
    renderer = psw.Renderer(
        block, psw.TransferFunction([(0, (1, 1, 1), 1), (255, (1, 1, 1), 1)]), psw.Settings(quality=4)
    )
    covered = np.argwhere(view.rendered(renderer)[..., 3] > 0.5)[:, ::-1] + 0.5 + AREA[:2]
    corners = view.at(scene.box)
    np.testing.assert_allclose(covered.min(0), corners.min(0), atol=1.5)
    np.testing.assert_allclose(covered.max(0), corners.max(0), atol=1.5)


def test_the_plan_is_to_scale_with_minus_z_up():
    scene = scene_of("cave4")
    plan = _Plan(Sheet(*SIZE), AREA, scene)
    origin, right, back, up = plan.at(np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]]))
    np.testing.assert_allclose(right - origin, (plan.scale, 0), atol=1e-9)
    np.testing.assert_allclose(back - origin, (0, plan.scale), atol=1e-9)
    np.testing.assert_allclose(up, origin, atol=1e-9)


def test_we_stand_behind_the_viewer_and_above():
    """Whichever way the viewer looks: farther things are ahead of the viewer."""
    for look in ((0, 0, -1), (1, 0, 0), (-1, 0, 1)):
        rig = rig_of(eyes={"rest_pose": {"look": list(look)}})
        view = _View(Sheet(*SIZE), AREA, RoomScene.of(rig, None, None))
        eye, rest = view.view.eye.position, rig.eyes.rest_pose.position
        assert (rest - eye) @ look > 0 and eye[1] > rest[1]


def test_letters_of_a_patient_or_axes():
    volume = psw.Volume(np.zeros((4, 4, 4), np.uint8), orientation="RAS")
    scene = scene_of("cave4", volume)
    words = {word: place - scene.box.mean(0) for word, place, _, _ in scene.letters}
    assert set(words) == set("LRAPSI")
    for word, opposite in ("LR", "AP", "SI"):
        np.testing.assert_allclose(words[word], -words[opposite], atol=1e-9)
    ends = scene.box[[1, 2, 4]] - scene.box[0]
    for letter, edge in zip("RAS", ends, strict=True):  # each where its axis grows
        assert words[letter] @ edge > 0
    axes = {word for word, *_ in scene_of("cave4", psw.Volume(volume.data)).letters}
    assert axes == {"x", "y", "z"}


def test_a_box_has_twelve_edges_along_its_axes():
    assert len(EDGES) == len(set(EDGES)) == 12
    assert all(bin(a ^ b).count("1") == 1 for a, b in EDGES)


def test_walls_in_one_place_are_drawn_once():
    rig = rig_of(wall_keys("a", stereo="left"), wall_keys("b", stereo="right"), wall_keys("c", pixels=[9, 9]))
    (wall,) = RoomScene.of(rig, None, None).walls
    assert wall.name == "a +2" and len(wall.eyes) == 3


def test_between_walls():
    points = np.array(
        [[0, 1.7, 0], [0, 1.7, -1.6], [0, -0.1, 0], [0, 1.7, 1.6], [1.4, 2.9, 1.4], [0, 3.1, 0]]
    )
    cave = load_rig(CONFIGS / "cave4.toml")
    assert between_walls(points, cave).tolist() == [True, False, False, False, True, False]
    screen = load_rig(CONFIGS / "powerwall.toml")  # a single screen has no sides
    assert between_walls(np.array([[9, 9, 9], [0, 1, -1]]), screen).tolist() == [True, False]
    assert between_walls(points, load_rig(CONFIGS / "hmd.toml")).all()


@pytest.mark.parametrize("name", ALL)
def test_every_config_has_a_picture(name, block):
    rig = load_rig(CONFIGS / f"{name}.toml")
    heads = rig.eyes.rest_pose.position + np.linspace(0, 0.3, 50)[:, None] * (1, 0.2, -0.5)
    picture = draw_room(rig, block, heads=heads)
    assert picture.size == SIZE and picture.mode == "RGB"
    assert (np.asarray(picture) < 250).any(-1).mean() > 0.02


def test_the_caller_may_give_no_more_than_a_wall():
    assert draw_room(rig_of()).size == SIZE


def test_the_room_of_the_scene_is_the_rigs(block):
    rig = load_rig(CONFIGS / "cave4.toml")
    assert np.array_equal(scene_of("cave4", block).room_from_world, room_from_world(rig, block))


def test_what_is_doubtful_is_in_the_picture_and_many_walls_fit():
    """Words in warning colour, only where there is something to say; twelve walls of long names."""

    def warned(rig) -> int:
        shades = np.asarray(draw_room(rig)).astype(int)
        return int((np.abs(shades - WARNING).max(-1) < 25).sum())

    names = [f"wall of tile number {n}" for n in range(12)]
    walls = [wall_keys(name, machine=f"viscluster{n}") for n, name in enumerate(names)]
    assert warned(rig_of(*walls)) == 0
    assert warned(rig_of(*walls[:3], wall_keys("flat", pixels=[64, 20]))) > 200


def test_words_without_a_font_of_the_system(monkeypatch):
    """Pillow's own font has no × or …; its replacements are there."""
    monkeypatch.setattr(drawing, "_font_file", lambda: None)
    drawing._font.cache_clear()
    try:
        assert drawing._spoken("3 × 4 …") == "3 x 4 ..."
        assert draw_room(rig_of()).size == SIZE
    finally:
        drawing._font.cache_clear()
