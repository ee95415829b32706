"""Wall files of real installations, their flaws included; expected corners by hand."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from data_folder import DATA
from tolerances import RIG_CORNERS

from vr_plugin.eyes import before_wall
from vr_plugin.formats import import_rig
from vr_plugin.rig import Rig, RigError


def real(name: str) -> Path:
    """A real configuration; skips the test where it is absent."""
    path = DATA / "rigs" / name
    if not path.is_file():
        pytest.skip(f"{path} is absent; set PERSP_SW_DATA to the data folder")
    return path


def corners(rig: Rig, name: str) -> np.ndarray:
    """Lower left, lower right and upper left of a wall."""
    wall = next(wall for wall in rig.walls if wall.name == name).wall
    return np.array([wall.lower_left, wall.lower_right, wall.upper_left])


def shared_corners(rig: Rig, one: str, other: str) -> int:
    """How many of their four corners two walls have in common."""
    names = [wall.name for wall in rig.walls]
    a, b = rig.corners[names.index(one)], rig.corners[names.index(other)]
    return int((np.abs(a[:, None] - b[None]).max(-1) < RIG_CORNERS).any(1).sum())


def assert_sound(rig: Rig) -> None:
    """Every wall is a rectangle and seen from the front at rest; floors are below the eye, ceilings above."""
    eye = rig.eyes.rest_pose.position
    for wall, (lower_left, lower_right, upper_right, upper_left) in zip(rig.walls, rig.corners, strict=True):
        across, up = lower_right - lower_left, upper_left - lower_left
        assert abs(across @ up) < 1e-9, wall.name
        assert np.abs(upper_right - lower_right - up).max() < RIG_CORNERS, wall.name
        assert before_wall(eye, np.array([lower_left, lower_right, upper_right, upper_left])), wall.name
        if "bottom" in wall.name.lower() or "floor" in wall.name.lower():
            assert lower_left[1] < eye[1], wall.name
        if "top" in wall.name.lower() or "ceiling" in wall.name.lower():
            assert lower_left[1] > eye[1], wall.name


# Wall: its centre in half edges, and where its right and its up point; by hand from h, p, r (first r about y,
# then p about x, then h about z; x right, y into the screen, z up; ours is x, z, −y).
_CUBE = {
    "FRONT": ((0, 0, -1), (1, 0, 0), (0, 1, 0)),  # h p r = 0 0 0
    "LEFT": ((-1, 0, 0), (0, 0, -1), (0, 1, 0)),  # 90 0 0
    "RIGHT": ((1, 0, 0), (0, 0, 1), (0, 1, 0)),  # −90 0 0
}
_FLOOR = ((0, -1, 0), (1, 0, 0), (0, 0, -1))  # 0 −90 0
_TURNED_FLOOR = ((0, -1, 0), (0, 0, 1), (1, 0, 0))  # 0 −90 90: the projector stands on its side
_CEILING = ((0, 1, 0), (-1, 0, 0), (0, 0, -1))  # 0 90 180, and 180 90 0


@pytest.mark.parametrize(
    ("name", "half", "hosts", "more", "eye"),
    [
        (
            name,
            1.35,
            [f"viscluster{n}" for n in (51, 53, 55, 57, 59)],
            {"BOTTOM": _FLOOR, "CEILING": _CEILING},
            (0, 0.2, 3.0),
        )
        for name in ("covise-config.cave.xml", "covise-config.cavevive.xml")
    ]
    + [
        (
            "covise-config.lcave.xml",
            1.25,
            [f"lcave{n:02}" for n in (2, 4, 6, 8, 10)],
            {"BOTTOM": _TURNED_FLOOR, "TOP": _CEILING},
            (0, 0.03, 2.0),
        )
    ],
)
def test_a_real_cave_of_five_walls(name: str, half: float, hosts: list[str], more: dict, eye: tuple):
    rig = import_rig(real(name), hosts=hosts).rig
    walls = {**_CUBE, **more}
    assert sorted(wall.name for wall in rig.walls) == sorted(walls)
    for wall, directions in walls.items():
        centre, right, up = half * np.array(directions, float)
        expected = [centre - right - up, centre + right - up, centre - right + up]
        assert np.abs(corners(rig, wall) - expected).max() < RIG_CORNERS, wall
    assert_sound(rig)
    assert np.abs(rig.eyes.rest_pose.position - eye).max() < RIG_CORNERS
    floor, ceiling = more
    for one, other in combinations(walls, 2):
        opposite = {one, other} in ({"LEFT", "RIGHT"}, {floor, ceiling})
        assert shared_corners(rig, one, other) == (0 if opposite else 2), (one, other)


def test_a_real_caves_projectors_pair_up_and_its_head_is_tracked():
    rig = import_rig(real("covise-config.cave.xml")).rig
    assert len(rig.walls) == 11
    for left in range(51, 60, 2):
        pair = [next(w for w in rig.walls if w.machine == f"viscluster{n}") for n in (left, left + 1)]
        assert [wall.stereo for wall in pair] == ["left", "right"]
        assert np.array_equal(pair[0].wall.lower_left, pair[1].wall.lower_left)
        assert all(wall.wall.pixels == (1600, 1600) for wall in pair)
        assert all(wall.window.position == (480, 0) for wall in pair)
    tracker = rig.tracker
    assert (tracker.kind, tracker.address) == ("dtrack", "udp://5000")
    assert np.allclose(tracker.room_from_tracker[:3, 3], [0, -1.327, 0])
    assert np.allclose(tracker.sensor_from_head.position, [0.105, -0.050, -0.060])


def test_a_real_powerwall_of_two_tiles():
    rig = import_rig(real("covise-config-vispw.xml"), hosts=["vispw1", "vispw2"]).rig
    assert np.allclose(corners(rig, "FRONT vispw2"), [[-1.7, -0.635, 0], [0, -0.635, 0], [-1.7, 0.635, 0]])
    assert shared_corners(rig, "FRONT vispw1", "FRONT vispw2") == 2
    assert np.allclose(rig.eyes.rest_pose.position, [0, 0, 2.5])
    assert_sound(rig)


def test_a_real_passive_wall_says_which_file_is_missing():
    reading = import_rig(real("covise-config-rrzk-pw.xml"))
    assert [w.stereo for w in reading.rig.walls] == ["mono", "left", "right", "quad"]
    assert reading.rig.machines == ("vispw", "vispw1", "vispw2", "vishp")  # not their long names
    assert reading.rig.eyes.separation == pytest.approx(0.060)  # of those that show stereo
    assert any("config-rrzk.xml" in note and ":207" in note for note in reading.notes)


def test_real_walls_back_to_back_are_seen_host_by_host():
    path = real("calvr-siggraph-4wall.xml")
    with pytest.raises(RigError, match=r"--unit mm$"):
        import_rig(path)
    reading = import_rig(path, "mm")
    assert len(reading.rig.walls) == 24
    assert any("fixed eyes" in note for note in reading.notes)
    for host, eye in {"vsage-00": (0, 0, -3), "vcglx2-10": (-3, 0, 0), "vcglx1-10": (3, 0, 0)}.items():
        rig = import_rig(path, "mm", hosts=[host]).rig
        assert np.abs(rig.eyes.rest_pose.position - eye).max() < RIG_CORNERS
        forward = rig.eyes.rest_pose.apply([0.0, 0.0, -1.0]) - eye
        assert forward @ (rig.middle - eye) > 0.7 * np.linalg.norm(rig.middle - eye)
        assert_sound(rig)
    front = import_rig(path, "mm", hosts=["vcalvr-00"]).rig
    expected = [[-2.044, 0.004, 0], [-1.028, 0.004, 0], [-2.044, 0.572, 0]]
    assert np.abs(corners(front, "screen 0") - expected).max() < RIG_CORNERS
    assert_sound(front)


def test_a_real_file_whose_walls_are_elsewhere_names_that_file():
    with pytest.raises(RigError, match=r"without a single wall.*tcave-screens\.xml"):
        import_rig(real("calvr-tcave.xml"), "mm")


def test_a_real_typing_error_is_told_and_can_be_left_out():
    path = real("left_right_floor.pvx")
    with pytest.raises(RigError, match=r"left_right_floor.pvx:21: Machine 'Floor': LowerRight\[2\].*'0/05'"):
        import_rig(path, "m")
    rig = import_rig(path, "m", skip_broken=True).rig
    assert [wall.name for wall in rig.walls] == ["Left", "Right"]
    assert np.allclose(
        corners(rig, "Left"), [[-1.13, -0.635, 1.04], [-1.13, -0.635, -1.22], [-1.13, 0.635, 1.04]]
    )
    assert shared_corners(rig, "Left", "Right") == 2
    assert rig.walls[1].window.position == (740, 1200)
    assert_sound(rig)


def test_other_real_files_of_paraview():
    swapped = import_rig(real("LeftRight.pvx"), "m")
    assert sum("name or its corners" in note for note in swapped.notes) == 2
    features = import_rig(real("CAVEFeatures.pvx"), "m").rig
    assert [wall.stereo for wall in features.walls] == ["left", "right"]
    with pytest.raises(RigError, match="'localhost': no LowerLeft"):
        import_rig(real("trivial.pvx"), "m")
    tiles = import_rig(real("kitware.pvx"), "m").rig
    assert tiles.machines == tuple(f"Amber{n}" for n in range(1, 7))
    assert shared_corners(tiles, "Amber1", "Amber2") == shared_corners(tiles, "Amber1", "Amber3") == 2
    assert_sound(tiles)


def test_real_files_of_vr_juggler():
    cave = import_rig(real("vrjuggler-sim.c6displays.mixin.jconf")).rig
    assert len(cave.walls) == 8
    half = 1.524
    assert np.allclose(corners(cave, "Floor Surface"), [[-half, 0, half], [half, 0, half], [-half, 0, -half]])
    for one, other in combinations(("Right", "Front", "Left", "Floor", "Ceiling", "Entrance"), 2):
        opposite = {one, other} in ({"Right", "Left"}, {"Floor", "Ceiling"}, {"Front", "Entrance"})
        assert shared_corners(cave, f"{one} Surface", f"{other} Surface") == (0 if opposite else 2)
    assert all(before_wall(cave.eyes.rest_pose.position, wall) for wall in cave.corners)
    assert np.array_equal(cave.eyes.rest_pose.orientation, [0, 0, 0, 1])  # walls all around: straight ahead
    (eye,) = import_rig(real("vrjuggler-hmd.displays.jconf")).rig.walls
    assert (eye.name, eye.stereo, eye.fixed_to) == ("Left Eye", "left", "head")


def test_real_files_without_walls_are_refused_with_advice():
    with pytest.raises(RigError, match=r"omegalib.*Formats read: ParaView"):
        import_rig(real("omegalib-sample.cfg"))
