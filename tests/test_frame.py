"""One eye image for all walls: the same pictures as separate compositings, at the cost of one."""

from __future__ import annotations

import logging

import numpy as np
import pytest

import persp_sw as psw
from persp_sw.planning import EyePlan
from persp_sw.volume.phantoms import synthetic_ct
from vr_plugin.cave.wall_pictures import SoftwareDrawer, TextureDrawer
from vr_plugin.eyes import EyePair, before_wall, eyes_of_head
from vr_plugin.frame import FrameMaker
from vr_plugin.placement import room_from_world
from vr_plugin.pose import Pose, turn_about
from vr_plugin.rig import Eyes, Rig, RigError, RigWall

# Rays of two walls through one point differ by rounding alone: a few 1e-16 of the distance, magnified by
# pixels a voxel and voxels a grey level. OpenGL finds them in float32: 6e-8 · 40 pixels, 0.1 a pixel steep.
SHARED_RAY = {"software": 1e-6, "texture": 1e-5}


def cave(pixels: int = 48, stereo: str = "quad", size: float = 3.0) -> Rig:
    """Front, left, right and floor of a cube on the floor, centred about x = z = 0."""
    a = size / 2
    corners = {
        "front": ((-a, 0, -a), (a, 0, -a), (-a, size, -a)),
        "left": ((-a, 0, a), (-a, 0, -a), (-a, size, a)),
        "right": ((a, 0, -a), (a, 0, a), (a, size, -a)),
        "floor": ((-a, 0, a), (a, 0, a), (-a, 0, -a)),
    }
    return Rig([RigWall(psw.Wall(*c, (pixels, pixels), name), stereo) for name, c in corners.items()])


def maker_of(rig: Rig, edge: int = 24, **settings) -> FrameMaker:
    volume = synthetic_ct(edge)
    transfer = psw.TransferFunction(
        [(20, (0.2, 0.4, 0.9), 0), (120, (0.9, 0.6, 0.3), 0.2), (255, (1, 1, 1), 0.4)]
    )
    renderer = psw.Renderer(volume, transfer, psw.Settings(**settings))
    return FrameMaker(renderer, rig.walls, room_from_world(rig, volume))


def eyes_at(head: Pose) -> EyePair:
    return eyes_of_head(head, Eyes())


def test_four_walls_and_two_eyes_take_two_compositings():
    maker = maker_of(cave())
    calls = []
    composite = maker.renderer.composite
    maker.renderer.composite = lambda *a, **more: calls.append(a) or composite(*a, **more)
    frame = maker.make(Pose((0, 1.7, 0.6)), eyes_at(Pose((0, 1.7, 0.6))))
    assert len(calls) == frame.compositings == 2
    assert [(p.wall.name, p.eye) for p in frame.pictures] == [
        (wall, eye) for eye in ("left", "right") for wall in ("front", "left", "right", "floor")
    ]
    assert all(p.image is frame.images[p.eye] for p in frame.pictures)


@pytest.mark.parametrize("head", [(0.0, 1.7, 1.2), (0.3, 1.6, 0.1)])  # before the volume, and inside it
def test_shared_and_separate_compositings_are_the_same_bits(monkeypatch, head):
    maker = maker_of(cave())
    frame = maker.make(Pose(head), eyes_at(Pose(head)))
    assert frame.compositings == 2
    for picture in frame.pictures:
        # Faces, pitch and pixel grid pinned to the shared ones: what is left is whether walls matter.
        monkeypatch.setattr(EyePlan, "faces", lambda *_, p=picture: list(p.image.faces))
        alone = maker.renderer.composite(picture.view.eye, [picture.view.wall])
        np.testing.assert_array_equal(
            maker.renderer.warp(alone, picture.view), maker.renderer.warp(picture.image, picture.view)
        )


def test_every_wall_shows_what_the_reference_sees():
    maker = maker_of(cave(pixels=64), quality=2, samples_per_interval=2)
    head = Pose((0.4, 1.5, 0.8))
    covered = 0
    for picture in maker.make(head, eyes_at(head)).pictures:
        truth = psw.reference.render(maker.renderer.volume, maker.renderer.transfer, picture.view)
        error = maker.renderer.warp(picture.image, picture.view) - truth
        assert np.sqrt(np.mean(error**2)) < 10 ** (-40 / 20)  # 40 dB
        covered += bool(truth[..., 3].max() > 0.1)
    assert covered == 4  # two walls show the volume, to both eyes


@pytest.mark.parametrize("warp", ["software", pytest.param("texture", marks=pytest.mark.gl)])
def test_two_walls_agree_along_their_edge(rng, warp):
    maker, n, a = maker_of(cave()), 40, 1.5
    width = 3.0 / (
        n - 0.5
    )  # of a pixel; both walls reach half of one beyond the edge, so its centre is on it
    front = psw.Wall((-a, 0, -a), (a + width / 2, 0, -a), (-a, 3, -a), (n, n), "front")
    right = psw.Wall((a, 0, -a - width / 2), (a, 0, a), (a, 3, -a - width / 2), (n, n), "right")
    maker = FrameMaker(
        maker.renderer, [RigWall(front, "left"), RigWall(right, "left")], maker.room_from_world
    )
    drawer = TextureDrawer() if warp == "texture" else SoftwareDrawer(maker.renderer)
    seen = 0.0
    try:
        for _ in range(12):
            eye = np.array([rng.uniform(-1.2, -0.2), rng.uniform(1.2, 2.2), rng.uniform(0.2, 1.3)])
            maker.room_from_world = _towards(maker.renderer.volume, eye, (a, rng.uniform(1, 2), -a))
            pictures = drawer.draw(maker.make(Pose(eye), EyePair(eye, eye))).pictures
            one, other = pictures["front", "left"], pictures["right", "left"]
            np.testing.assert_allclose(one[:, -1], other[:, 0], atol=SHARED_RAY[warp])
            seen = max(seen, float(one[:, -1, 3].max()))
    finally:
        drawer.close()
    assert seen > 0.1  # the edge shows something


def _towards(volume: psw.Volume, eye, corner):
    """A volume of 1 m half way from the eye to a point on the edge."""
    rig = Rig(cave().walls)
    matrix = room_from_world(rig, volume)
    middle = matrix[:3, :3] @ ((np.array(volume.size) - 1) / 2) + matrix[:3, 3]
    matrix[:3, 3] += (np.asarray(eye) + corner) / 2 - middle
    return matrix


def test_a_wall_that_cannot_see_the_volume_costs_nothing():
    rig = cave()
    head = Pose((0, 1.7, 1.2))
    maker = maker_of(rig)
    back = RigWall(psw.Wall((1.5, 0, 1.5), (-1.5, 0, 1.5), (1.5, 3, 1.5), (512, 512), "back"), "quad")
    with_back = FrameMaker(maker.renderer, [*rig.walls, back], maker.room_from_world)
    few, more = maker.make(head, eyes_at(head)), with_back.make(head, eyes_at(head))
    for eye in ("left", "right"):
        assert more.images[eye].samples == few.images[eye].samples > 0
        assert more.images[eye].faces == few.images[eye].faces
    blank = next(p for p in more.pictures if p.wall.name == "back")
    assert not maker.renderer.warp(blank.image, blank.view).any()


def test_a_volume_behind_every_wall_is_not_composited():
    maker = maker_of(Rig(cave().walls[:1]))  # the front wall alone
    matrix = maker.room_from_world.copy()
    matrix[2, 3] += 40.0  # behind the viewer
    maker.room_from_world = matrix
    frame = maker.make(Pose((0, 1.7, 1.0)), eyes_at(Pose((0, 1.7, 1.0))))
    assert frame.compositings == 0
    assert all(s["samples"] == 0 and s["faces"] == 0 for s in frame.statistics.values())
    assert len(frame.pictures) == 2


def test_modes_choose_the_eyes():
    maker = maker_of(cave(stereo="mono"))
    head = Pose((0, 1.7, 1.0))
    assert set(maker.make(head, eyes_at(head)).images) == {"middle"}
    modes = {"front": "quad", "left": "left"}
    frame = maker.make(head, eyes_at(head), modes=modes)
    assert sorted((p.wall.name, p.eye) for p in frame.pictures) == [
        ("floor", "middle"), ("front", "left"), ("front", "right"), ("left", "left"), ("right", "middle"),
    ]  # fmt: skip


def test_an_eye_in_a_wall_plane_loses_that_wall_and_says_so_once(caplog):
    maker = maker_of(cave(stereo="mono"))
    head = Pose((0, 1.7, -1.5))  # in the front wall
    with caplog.at_level(logging.WARNING, "persp_sw"):
        frames = [maker.make(head, EyePair(head.position, head.position)) for _ in range(3)]
    assert all(frame.edge_on == ("front",) and len(frame.pictures) == 3 for frame in frames)
    assert [r.message.count("front") > 0 for r in caplog.records] == [True]


def test_pictures_do_not_depend_on_the_unit_of_the_world():
    head = Pose((0.2, 1.6, 1.1))
    pictures = []
    for unit in (1.0, 1000.0):
        volume = psw.Volume(synthetic_ct(24).data, spacing=(unit,) * 3)
        transfer = psw.TransferFunction([(20, (0.2, 0.4, 0.9), 0), (255, (1, 1, 1), 0.4)])
        rig = cave()
        maker = FrameMaker(psw.Renderer(volume, transfer), rig.walls, room_from_world(rig, volume))
        frame = maker.make(head, eyes_at(head), near=1.0)  # cuts into the volume
        pictures.append([maker.renderer.warp(p.image, p.view) for p in frame.pictures])
    for one, other in zip(*pictures, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-4)
    whole = maker.make(head, eyes_at(head))
    assert not np.allclose(
        maker.renderer.warp(whole.pictures[0].image, whole.pictures[0].view), pictures[1][0]
    )


def test_eyes_of_a_turned_head():
    head = Pose((1, 2, 3), turn_about((0, 1, 0), np.pi / 2))  # looks along −x
    pair = eyes_of_head(head, Eyes(separation=0.06, offset=(0, -0.1, -0.05)))
    np.testing.assert_allclose(pair.left, [0.95, 1.9, 3.03], atol=1e-12)
    np.testing.assert_allclose(pair.right, [0.95, 1.9, 2.97], atol=1e-12)
    np.testing.assert_allclose(pair.middle, [0.95, 1.9, 3.0], atol=1e-12)


def test_the_front_of_a_wall():
    corners = cave().corners[0]
    assert before_wall((0, 1, 0), corners) and not before_wall((0, 1, -2), corners)


def test_the_default_place_is_a_metre_of_volume_at_eye_height():
    volume = psw.Volume(np.zeros((5, 9, 3), np.uint8), spacing=(2, 3, 4))
    matrix = room_from_world(cave(), volume)
    ends = np.array([[0, 0, 0], [4, 24, 16]]) @ matrix[:3, :3].T + matrix[:3, 3]
    np.testing.assert_allclose(ends.mean(0), [0, 1.7, 0], atol=1e-12)
    assert np.abs(ends[1] - ends[0]).max() == pytest.approx(1.0)
    assert np.linalg.det(matrix[:3, :3]) > 0
    # Left, posterior, superior of the file: right, backwards (−z is forward, posterior is forward), up.
    np.testing.assert_allclose(matrix[:3, :3] * 24, [[1, 0, 0], [0, 0, 1], [0, -1, 0]], atol=1e-12)


def test_a_rig_needs_walls_with_names_of_their_own():
    wall = cave().walls[0]
    with pytest.raises(RigError, match="at least one"):
        Rig([])
    with pytest.raises(RigError, match="twice: front"):
        Rig([wall, wall])


def test_walls_that_come_and_go_are_not_kept():
    """A preview has a wall of its own for every frame."""
    maker = maker_of(cave(), 12)
    head = Pose((0, 1.7, 1.0))
    wall = maker.walls[0]
    for n in range(50):
        maker.walls = (RigWall(psw.Wall((-1, 0, -1), (1, 0, -1 - 0.01 * n), (-1, 2, -1), (16, 16)), "left"),)
        maker.moment(head, eyes_at(head))
    assert len(maker._room_walls) == 1
    maker.walls = (wall,)
    one, two = (maker.moment(head, eyes_at(head)) for _ in range(2))
    (first, *_), (second, *_) = (m.sights["left"].walls for m in (one, two))
    assert first is second  # made once
