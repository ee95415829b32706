"""Screens of OpenCOVER and CalVR: hosts, channels and turns that can be worked out in the head."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from rig_texts import (
    CALVR,
    CALVR_INPUT,
    INPUT,
    corners,
    covise,
    near,
    read_in,
    said,
)
from tolerances import RIG_CORNERS

from vr_plugin.eyes import before_wall
from vr_plugin.formats import Reading
from vr_plugin.formats.screens import ROOM_FROM_Z_UP, screen_corners, turn
from vr_plugin.pose import Pose, rotation_of
from vr_plugin.rig import RigError


@pytest.fixture
def read_walls(tmp_path: Path) -> Callable[..., Reading]:
    """Reads a text as a wall file."""
    return partial(read_in, tmp_path)


def test_opencover_screens_stand_up_in_our_axes(read_walls):
    reading = read_walls(covise())
    assert reading.system == "OpenCOVER"
    assert near(corners(reading, "FRONT"), [[-1, -0.5, -1], [1, -0.5, -1], [-1, 0.5, -1]])
    (front,) = reading.rig.walls
    assert (front.machine, front.stereo, front.wall.pixels) == ("wall", "left", (800, 400))
    assert (front.window.position, front.window.size) == ((5, 7), (800, 400))
    assert near(reading.rig.eyes.rest_pose.position, [0.1, 0.3, 2.0])
    assert reading.rig.eyes.separation == pytest.approx(0.070)


def test_turns_are_openveruis_matrix(rng: np.random.Generator):
    # MAKE_EULER_MAT of OpenVRUI, written out: its rows are where x, y and z go.
    for h, p, r in rng.uniform(-360, 360, (50, 3)):
        (ch, cp, cr), (sh, sp, sr) = np.cos(np.radians([h, p, r])), np.sin(np.radians([h, p, r]))
        rows = [
            [ch * cr - sh * sr * sp, cr * sh + ch * sr * sp, -sr * cp],
            [-sh * cp, ch * cp, sp],
            [sp * cr * sh + sr * ch, sr * sh - sp * cr * ch, cr * cp],
        ]
        assert np.abs(turn(h, p, r) - np.transpose(rows)).max() <= RIG_CORNERS


def test_screens_go_back_to_the_rectangle_that_viewers_use(rng: np.random.Generator):
    # CalVR and OpenCOVER undo origin, h, p, r in turn, as row vectors, and find ±width/2, 0, ±height/2.
    def about(axis: int, degrees: float) -> np.ndarray:
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        i, j = [(1, 2), (2, 0), (0, 1)][axis]
        m = np.eye(3)
        m[i, i], m[i, j], m[j, i], m[j, j] = c, s, -s, c
        return m  # for row vectors

    for _ in range(20):
        origin, (h, p, r) = rng.uniform(-3, 3, 3), rng.uniform(-180, 180, 3)
        found = screen_corners(origin, 3.0, 2.0, turn(h, p, r))
        theirs = (np.array(found) @ ROOM_FROM_Z_UP - origin) @ about(2, -h) @ about(0, -p) @ about(1, -r)
        assert near(theirs, [[-1.5, 0, -1], [1.5, 0, -1], [-1.5, 0, 1]])


@pytest.mark.parametrize(
    ("given", "ours", "pixels"),
    [
        ("LEFT", "left", (800, 400)), ("RIGHT_EYE", "right", (800, 400)), ("quad_buffer", "quad", (800, 400)),
        ("ANAGLYPHIC", "anaglyph", (800, 400)), ("HORIZONTAL_SPLIT", "side_by_side", (400, 400)),
        ("VERTICAL_SPLIT", "top_bottom", (800, 200)), ("HORIZONTAL_INTERLACE", "interlaced", (800, 400)),
        ("MONO", "mono", (800, 400)), ("CHECKERBOARD", "mono", (800, 400)),
    ],
)  # fmt: skip
def test_stereo_modes_are_translated(read_walls, given: str, ours: str, pixels: tuple[int, int]):
    reading = read_walls(covise().replace('"LEFT"', f'"{given}"'))
    (front,) = reading.rig.walls
    assert (front.stereo, front.wall.pixels, front.window.size) == (ours, pixels, (800, 400))
    assert said(reading, "CHECKERBOARD", "mono") == (given == "CHECKERBOARD")


def test_stereo_switched_off_is_mono_and_one_eye_is_that_eye(read_walls):
    assert read_walls(covise('<Stereo value="off"/>')).rig.walls[0].stereo == "mono"
    bare = covise('<MonoView coconfig:deprecated="1" value="RIGHT"/>').replace(' stereoMode="LEFT"', "")
    assert read_walls(bare).rig.walls[0].stereo == "right"


def test_two_screens_of_one_name_are_a_passive_pair(read_walls):
    text = covise('<NumScreens value="2"/>').replace('<NumScreens value="1"/>', "").replace("FLOOR", "FRONT")
    assert [w.stereo for w in read_walls(text.replace(' stereoMode="LEFT"', "")).rig.walls] == [
        "left",
        "right",
    ]


def test_channels_lead_to_screens_windows_and_viewports(read_walls):
    box = '<Viewport name="4" windowIndex="1" left="0.25" bottom="100" width="0.5" height="100"/>'
    text = covise(f'<ViewportConfig>{box}</ViewportConfig><NumChannels value="1"/>')
    text = text.replace('<NumScreens value="1"/>', '<NumScreens value="2"/>')
    text = text.replace(
        'name="0" windowIndex="0"', 'name="0" screenIndex="1" viewportIndex="4" windowIndex="0"'
    )
    text = text.replace(
        "</WindowConfig>", '<Window name="1" left="1000" top="50" width="800" height="400"/></WindowConfig>'
    )
    (floor,) = read_walls(text).rig.walls
    assert (floor.name, floor.wall.pixels) == ("FLOOR", (400, 100))
    assert floor.window.position == (1000 + 200, 50 + 400 - 200)


def test_a_floor_lies_below_and_is_seen_from_above(read_walls):
    text = covise().replace('<NumScreens value="1"/>', '<NumScreens value="2"/>')
    reading = read_walls(text)
    assert near(corners(reading, "FLOOR"), [[-1, -0.5, 1], [1, -0.5, 1], [-1, -0.5, -1]])
    assert all(before_wall(np.zeros(3), wall) for wall in reading.rig.corners)


@pytest.mark.parametrize(
    ("heading", "expected"),
    [
        ("0", [[-1, -0.5, -1], [1, -0.5, -1], [-1, 0.5, -1]]),
        ("90", [[-1, -0.5, 1], [-1, -0.5, -1], [-1, 0.5, 1]]),
    ],
)
def test_a_screen_can_be_a_projectors_frustum(read_walls, heading: str, expected: list):
    # From 0.5 m up, 45° to both sides and down to the lower edge, none up: 2 m × 1 m at 1 m.
    frustum = f'comment="FRONT" frustum="0;0;500;{heading};0;0;-45;45;-45;0" radius="1000"'
    assert near(corners(read_walls(covise().replace('comment="FRONT"', frustum)), "FRONT"), expected)


def test_hosts_of_two_names_are_one_and_every_host_sees_its_own(read_walls):
    other = '<LOCAL HOST="second"><COVER><NumScreens value="1"/></COVER></LOCAL>'
    reading = read_walls(covise(root=other))
    assert reading.rig.machines == ("wall", "second")  # not wall.site.de
    assert [w.name for w in reading.rig.walls] == ["FRONT", "GLOBAL"]
    assert read_walls(covise(root=other), hosts=("second",)).rig.machines == ("second",)
    with pytest.raises(RigError, match=r"no walls of host third; it has those of wall, second"):
        read_walls(covise(root=other), hosts=("third",))


def test_a_head_tracked_by_dtrack(read_walls):
    reading = read_walls(covise(top=INPUT.format(head="ArtHead")))
    tracker = reading.rig.tracker
    assert (tracker.kind, tracker.address, tracker.head, tracker.wand) == ("dtrack", "udp://5001", 0, 0)
    # Pose + body's offset + device's offset, in their axes: (205, 150, −1087) mm.
    head = tracker.room_from_head(Pose((0.1, 0.2, 0.3)))
    assert near(head.position, [0.205, -1.087, -0.150])
    assert near(rotation_of(head.orientation), np.eye(3))  # they look along y, we along −z
    assert reading.rig.eyes.separation == pytest.approx(0.061)
    assert said(reading, "DTrack", "body 0")


def test_a_head_tracked_by_vrpn_through_a_turned_device(read_walls):
    tracker = read_walls(covise(top=INPUT.format(head="VrpnHead"))).rig.tracker
    assert (tracker.kind, tracker.address, tracker.head) == ("vrpn", "Head0@tracks.site.de", 3)
    # h = 90°: the tracker's x is their y, which is our −z; a head that looked along y looks along −x.
    head = tracker.room_from_head(Pose((1.0, 0.0, 0.0)))
    assert near(head.position, [0, 0, -1])
    assert near(rotation_of(head.orientation) @ [0, 0, -1], [-1, 0, 0])


# --- CalVR ---


def test_calvr_screens_of_several_roots(read_walls):
    reading = read_walls(CALVR, "mm", hosts=("a",))
    assert reading.system == "CalVR"
    front, left = reading.rig.walls
    assert near(corners(reading, "screen 0"), [[-1, -0.5, -1], [1, -0.5, -1], [-1, 0.5, -1]])
    assert near(corners(reading, "screen 1"), [[-1, -0.5, 1], [-1, -0.5, -1], [-1, 0.5, 1]])
    assert (front.machine, front.stereo, front.wall.pixels) == ("a:0.0", "quad", (1000, 500))
    assert (left.machine, left.stereo) == ("a:0.1", "left")
    assert reading.rig.eyes.separation == pytest.approx(0.066)
    assert all(before_wall(reading.rig.eyes.rest_pose.position, wall) for wall in reading.rig.corners)


def test_calvr_walls_for_fixed_eyes_are_seen_from_there(read_walls):
    alone = read_walls(CALVR, "mm", hosts=("b",))
    assert near(alone.rig.eyes.rest_pose.position, [0, 0.25, -3])
    assert near(rotation_of(alone.rig.eyes.rest_pose.orientation) @ [0, 0, -1], [0, 0, 1])  # at its wall
    assert all(before_wall(alone.rig.eyes.rest_pose.position, wall) for wall in alone.rig.corners)
    assert said(read_walls(CALVR, "mm"), "fixed eyes", "--host")


def test_calvr_states_no_unit(read_walls):
    with pytest.raises(RigError, match=r"Most likely: --unit mm$"):
        read_walls(CALVR)


def test_calvr_tracking_by_vrpn(read_walls):
    tracker = read_walls(CALVR + CALVR_INPUT, "mm").rig.tracker
    assert (tracker.kind, tracker.address, tracker.head) == ("vrpn", "Art0@tracks", 2)
    assert near(tracker.room_from_head(Pose((0.5, 0, 0))).position, [0.510, 1.030, -0.020])
