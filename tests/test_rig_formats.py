"""Wall files of other systems: corners known by hand, and everything that such files do wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rig_texts import CALVR, CALVR_INPUT, INPUT, PVX, covise, jconf, viewport, window
from tolerances import RIG_CORNERS

from vr_plugin.eyes import before_wall
from vr_plugin.formats import Reading, import_rig, read_rig
from vr_plugin.formats.screens import ROOM_FROM_Z_UP, screen_corners, turn
from vr_plugin.pose import Pose, rotation_of
from vr_plugin.rig import RigError


@pytest.fixture
def read(tmp_path: Path):
    """Reads a text as a file."""

    def run(text: str, unit: str | None = None, name: str = "walls.xml", **options) -> Reading:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return import_rig(path, unit, **options)

    return run


def corners(reading: Reading, name: str) -> np.ndarray:
    """Lower left, lower right and upper left of a wall."""
    wall = next(wall for wall in reading.rig.walls if wall.name == name).wall
    return np.array([wall.lower_left, wall.lower_right, wall.upper_left])


def wall(reading: Reading, name: str):
    return next(wall for wall in reading.rig.walls if wall.name == name)


def near(found: np.ndarray, expected) -> bool:
    return np.abs(np.asarray(found) - np.asarray(expected, float)).max() <= RIG_CORNERS


def said(reading: Reading, *words: str) -> bool:
    """Whether a note has all these words."""
    return any(all(word in note for word in words) for note in reading.notes)


# --- ParaView ----------------------------------------------------------------------------------------------


def test_paraview_walls_are_where_they_are_said_to_be(read):
    reading = read(PVX, "ft", "wall.pvx")
    foot = 0.3048
    assert reading.system == "ParaView"
    assert near(corners(reading, "front") / foot, [[-1, -1, -1], [1, -1, -1], [-1, 1, -1]])
    assert near(corners(reading, "side") / foot, [[-1, -1, 1], [-1, -1, -1], [-1, 1, 1]])
    assert reading.rig.eyes.separation == pytest.approx(0.5 * foot)
    front, side = reading.rig.walls
    assert (front.machine, front.stereo, front.wall.pixels) == ("node1:0", "quad", (640, 480))
    assert (front.window.position, front.window.size) == ((10, 20), (640, 480))
    assert (side.machine, side.window.fullscreen, side.window.position) == ("node2:0.1", True, (-5, 0))
    assert said(reading, "Sparkle") and said(reading, "Fog")


@pytest.mark.parametrize("left_out", ["LowerLeft", "LowerRight", "UpperRight", "UpperLeft"])
def test_paraview_takes_any_three_corners(read, left_out: str):
    points = {"LowerLeft": "0 0 0", "LowerRight": "4 0 1", "UpperRight": "4 3 1", "UpperLeft": "0 3 0"}
    given = " ".join(f'{key}="{value}"' for key, value in points.items() if key != left_out)
    reading = read(f'<pvx><Machine Name="w" Geometry="40x30+0+0" {given}/></pvx>', "m")
    assert near(corners(reading, "w"), [[0, 0, 0], [4, 0, 1], [0, 3, 0]])


def test_paraview_corners_that_contradict_are_a_problem(read):
    given = 'LowerLeft="0 0 0" LowerRight="4 0 0" UpperRight="4 3 0" UpperLeft="0 4 0"'
    with pytest.raises(RigError, match="no parallelogram"):
        read(f'<pvx><Machine Name="w" {given}/></pvx>', "m")


def test_paraview_displays_that_all_fill_one_are_hosts(read):
    tile = '<Machine Name="{0}" Environment="DISPLAY=:0" LowerLeft="{0} 0 0"'
    tile += ' LowerRight="{1} 0 0" UpperRight="{1} 1 0"/>'
    reading = read(f"<pvx>{tile.format(0, 1)}{tile.format(1, 2)}</pvx>", "m")
    assert reading.rig.machines == ("0", "1")
    one = read(f"<pvx>{tile.format(0, 1)}</pvx>", "m")
    assert one.rig.machines == ("",)


def test_a_display_without_corners_is_refused_with_advice(read):
    with pytest.raises(RigError, match=r"localhost.*LowerLeft, LowerRight, UpperRight.*configs/"):
        read('<pvx><Machine Name="localhost" Geometry="300x300+300+0"/></pvx>', "m")


def test_all_that_is_broken_is_said_at_once_with_its_place(read):
    text = (
        PVX.replace('"1 -1 -1"', '"1 0/05 -1"')
        .replace("500x500-5+0", "500 by 500")
        .replace('"0.5"', '"half"')
    )
    with pytest.raises(RigError) as told:
        read(text, "m", "wall.pvx")
    lines = str(told.value).splitlines()
    assert any("wall.pvx:6: Machine 'front': LowerRight[1]" in line and "'0/05'" in line for line in lines)
    assert any("0.05?" in line for line in lines)
    assert any("wall.pvx:8: Machine 'side': Geometry" in line and "500 by 500" in line for line in lines)
    assert any("EyeSeparation" in line and "'half'" in line for line in lines)
    assert "--skip-broken" in lines[-1]


def test_what_is_broken_can_be_left_out(read):
    reading = read(PVX.replace('"1 -1 -1"', '"1 0/05 -1"'), "m", skip_broken=True)
    assert [wall.name for wall in reading.rig.walls] == ["side"]
    assert said(reading, "left out", "front", "0/05")


def test_pixels_that_no_file_states_can_be_given(read):
    text = '<pvx><Machine Name="w" LowerLeft="0 0 0" LowerRight="4 0 0" UpperRight="4 3 0"/></pvx>'
    assert wall(read(text, "m"), "w").wall.pixels == (1440, 1080)
    assert said(read(text, "m"), "no pixels are stated")
    assert wall(read(text, "m", pixels=(80, 60)), "w").wall.pixels == (80, 60)


# --- Units -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("unit", "metres"), [("m", 1), ("cm", 0.01), ("mm", 0.001), ("in", 0.0254), ("ft", 0.3048)]
)
def test_units_scale_corners(read, unit: str, metres: float):
    assert near(
        corners(read(PVX, unit), "front"), np.array([[-1, -1, -1], [1, -1, -1], [-1, 1, -1]]) * metres
    )


@pytest.mark.parametrize(("size", "likely"), [("2", "m"), ("2000", "mm"), ("200", "cm"), ("100", "cm")])
def test_a_unit_that_is_not_stated_is_asked_for(read, size: str, likely: str):
    wall = f'LowerLeft="0 0 0" LowerRight="{size} 0 0" UpperRight="{size} {size} 0"'
    with pytest.raises(RigError, match=rf"--unit m\|mm\|cm\|in\|ft.* Most likely: --unit {likely}$"):
        read(f'<pvx><Machine Name="w" {wall}/></pvx>')


def test_a_wrong_unit_is_refused_by_what_it_makes(read):
    with pytest.raises(RigError, match="2000 m long"):
        read(covise(), "m")
    with pytest.raises(RigError, match="furlong"):
        read(PVX, "furlong")


def test_a_unit_against_the_formats_own_is_said(read):
    assert said(read(covise(), "cm"), "counts in mm", "cm")
    assert near(corners(read(covise(), "cm"), "FRONT")[0], [-10, -5, -10])


# --- OpenCOVER ---------------------------------------------------------------------------------------------


def test_opencover_screens_stand_up_in_our_axes(read):
    reading = read(covise())
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
def test_stereo_modes_are_translated(read, given: str, ours: str, pixels: tuple[int, int]):
    reading = read(covise().replace('"LEFT"', f'"{given}"'))
    (front,) = reading.rig.walls
    assert (front.stereo, front.wall.pixels, front.window.size) == (ours, pixels, (800, 400))
    assert said(reading, "CHECKERBOARD", "mono") == (given == "CHECKERBOARD")


def test_stereo_switched_off_is_mono_and_one_eye_is_that_eye(read):
    assert read(covise('<Stereo value="off"/>')).rig.walls[0].stereo == "mono"
    bare = covise('<MonoView coconfig:deprecated="1" value="RIGHT"/>').replace(' stereoMode="LEFT"', "")
    assert read(bare).rig.walls[0].stereo == "right"


def test_two_screens_of_one_name_are_a_passive_pair(read):
    text = covise('<NumScreens value="2"/>').replace('<NumScreens value="1"/>', "").replace("FLOOR", "FRONT")
    assert [w.stereo for w in read(text.replace(' stereoMode="LEFT"', "")).rig.walls] == ["left", "right"]


def test_channels_lead_to_screens_windows_and_viewports(read):
    box = '<Viewport name="4" windowIndex="1" left="0.25" bottom="100" width="0.5" height="100"/>'
    text = covise(f'<ViewportConfig>{box}</ViewportConfig><NumChannels value="1"/>')
    text = text.replace('<NumScreens value="1"/>', '<NumScreens value="2"/>')
    text = text.replace(
        'name="0" windowIndex="0"', 'name="0" screenIndex="1" viewportIndex="4" windowIndex="0"'
    )
    text = text.replace(
        "</WindowConfig>", '<Window name="1" left="1000" top="50" width="800" height="400"/></WindowConfig>'
    )
    (floor,) = read(text).rig.walls
    assert (floor.name, floor.wall.pixels) == ("FLOOR", (400, 100))
    assert floor.window.position == (1000 + 200, 50 + 400 - 200)


def test_a_floor_lies_below_and_is_seen_from_above(read):
    text = covise().replace('<NumScreens value="1"/>', '<NumScreens value="2"/>')
    reading = read(text)
    assert near(corners(reading, "FLOOR"), [[-1, -0.5, 1], [1, -0.5, 1], [-1, -0.5, -1]])
    assert all(before_wall(np.zeros(3), wall) for wall in reading.rig.corners)


def test_a_screen_can_be_a_projectors_frustum(read):
    text = covise().replace(
        'comment="FRONT"', 'comment="FRONT" frustum="0;0;500;0;0;0;-45;45;-45;0" radius="1000"'
    )
    assert near(corners(read(text), "FRONT"), [[-1, -0.5, -1], [1, -0.5, -1], [-1, 0.5, -1]])


def test_hosts_of_two_names_are_one_and_every_host_sees_its_own(read):
    other = '<LOCAL HOST="second"><COVER><NumScreens value="1"/></COVER></LOCAL>'
    reading = read(covise(root=other))
    assert reading.rig.machines == ("wall", "second")  # not wall.site.de
    assert [w.name for w in reading.rig.walls] == ["FRONT", "GLOBAL"]
    assert read(covise(root=other), hosts=("second",)).rig.machines == ("second",)
    with pytest.raises(RigError, match=r"no walls of host third; it has those of wall, second"):
        read(covise(root=other), hosts=("third",))


def test_a_head_tracked_by_dtrack(read):
    reading = read(covise(top=INPUT.format(head="ArtHead")))
    tracker = reading.rig.tracker
    assert (tracker.kind, tracker.address, tracker.head, tracker.wand) == ("dtrack", "udp://5001", 0, 0)
    # Pose + body's offset + device's offset, in their axes: (205, 150, −1087) mm.
    head = tracker.room_from_head(Pose((0.1, 0.2, 0.3)))
    assert near(head.position, [0.205, -1.087, -0.150])
    assert near(rotation_of(head.orientation), np.eye(3))  # they look along y, we along −z
    assert reading.rig.eyes.separation == pytest.approx(0.061)
    assert said(reading, "DTrack", "body 0")


def test_a_head_tracked_by_vrpn_through_a_turned_device(read):
    tracker = read(covise(top=INPUT.format(head="VrpnHead"))).rig.tracker
    assert (tracker.kind, tracker.address, tracker.head) == ("vrpn", "Head0@tracks.site.de", 3)
    # h = 90°: the tracker's x is their y, which is our −z; a head that looked along y looks along −x.
    head = tracker.room_from_head(Pose((1.0, 0.0, 0.0)))
    assert near(head.position, [0, 0, -1])
    assert near(rotation_of(head.orientation) @ [0, 0, -1], [-1, 0, 0])


# --- CalVR -------------------------------------------------------------------------------------------------


def test_calvr_screens_of_several_roots(read):
    reading = read(CALVR, "mm", hosts=("a",))
    assert reading.system == "CalVR"
    front, left = reading.rig.walls
    assert near(corners(reading, "screen 0"), [[-1, -0.5, -1], [1, -0.5, -1], [-1, 0.5, -1]])
    assert near(corners(reading, "screen 1"), [[-1, -0.5, 1], [-1, -0.5, -1], [-1, 0.5, 1]])
    assert (front.machine, front.stereo, front.wall.pixels) == ("a:0.0", "quad", (1000, 500))
    assert (left.machine, left.stereo) == ("a:0.1", "left")
    assert reading.rig.eyes.separation == pytest.approx(0.066)
    assert all(before_wall(reading.rig.eyes.rest_pose.position, wall) for wall in reading.rig.corners)


def test_calvr_walls_for_fixed_eyes_are_seen_from_there(read):
    alone = read(CALVR, "mm", hosts=("b",))
    assert near(alone.rig.eyes.rest_pose.position, [0, 0.25, -3])
    assert all(before_wall(alone.rig.eyes.rest_pose.position, wall) for wall in alone.rig.corners)
    assert said(read(CALVR, "mm"), "fixed eyes", "--host")


def test_calvr_states_no_unit(read):
    with pytest.raises(RigError, match=r"Most likely: --unit mm$"):
        read(CALVR)


def test_calvr_tracking_by_vrpn(read):
    tracker = read(CALVR + CALVR_INPUT, "mm").rig.tracker
    assert (tracker.kind, tracker.address, tracker.head) == ("vrpn", "Art0@tracks", 2)
    assert near(tracker.room_from_head(Pose((0.5, 0, 0))).position, [0.510, 1.030, -0.020])


# --- VR Juggler --------------------------------------------------------------------------------------------


def test_vr_juggler_walls_and_windows(read):
    text = jconf(
        window("one", viewport(view="Stereo"), stereo=True, y=600) + window("two", viewport(view="Right Eye"))
    )
    reading = read(text, name="cave.jconf")
    assert reading.system == "VR Juggler"
    assert near(corners(reading, "one"), [[-1, 0, -2], [1, 0, -2], [-1, 1.5, -2]])
    one, two = reading.rig.walls
    assert (one.stereo, two.stereo, one.wall.pixels) == ("quad", "right", (800, 600))
    # Counted from below: the upper window's top is the desktop's.
    assert (one.window.position, two.window.position) == ((100, 0), (100, 600))
    assert said(reading, "lower edge")


def test_vr_juggler_leaves_out_what_is_off_or_no_wall(read):
    inside = "<simulator_viewports><simulator_viewport/></simulator_viewports>"
    simulator = f'<display_window name="sim">{inside}</display_window>'
    text = jconf(window("on", viewport()) + window("off", viewport(), active=False) + simulator
                 + window("half", viewport("v", active=False)) + "<joystick/>")  # fmt: skip
    reading = read(text)
    assert [w.name for w in reading.rig.walls] == ["on"]
    assert (
        said(reading, "off", "not active") and said(reading, "sim", "simulator") and said(reading, "joystick")
    )


def test_vr_juggler_head_mounted_walls_go_with_the_head(read):
    (hmd,) = read(jconf(window("eye", viewport(tracked=True)))).rig.walls
    assert hmd.fixed_to == "head"
    assert near(hmd.in_room(Pose((0, 1.7, 0))).lower_left, [-1, 1.7, -2])


def test_vr_juggler_clusters_name_their_machines(read):
    inside = f"<host_name>ptah</host_name><display_windows>{window('w', viewport())}</display_windows>"
    assert read(jconf(f'<machine_specific name="Node">{inside}</machine_specific>')).rig.machines == ("ptah",)


def test_vr_juggler_heads(read):
    alias = '<alias name="VJHead"><proxy>P</proxy></alias>'
    proxy = '<position_proxy name="P"><device>{}</device><unit>1</unit></position_proxy>'
    vrpn = '<vrpn name="V"><tracker_server>T0@host</tracker_server></vrpn>'
    place = "".join(f"<initial_position>{v}</initial_position>" for v in (0.5, 1.8, 0.25))
    simulated = f'<simulated_positional_device name="S">{place}</simulated_positional_device>'
    rest = window("w", viewport()) + alias + simulated + vrpn
    tracker = read(jconf(rest + proxy.format("V"))).rig.tracker
    assert (tracker.kind, tracker.address, tracker.head) == ("vrpn", "T0@host", 1)
    assert near(read(jconf(rest + proxy.format("S"))).rig.eyes.rest_pose.position, [0.5, 1.8, 0.25])


def test_vr_juggler_corners_must_agree_and_be_three_numbers(read):
    with pytest.raises(RigError, match="no parallelogram"):
        read(jconf(window("w", viewport(upper_left=(-1, 2, -2)))))
    with pytest.raises(RigError, match=r"upper_left_corner is 3 numbers; given '-1 2'"):
        read(jconf(window("w", viewport(upper_left=(-1, 2)))))


# --- All of them -------------------------------------------------------------------------------------------


def test_a_wall_without_area_is_broken(read):
    text = '<pvx><Machine Name="w" LowerLeft="0 0 0" LowerRight="1 0 0" UpperRight="3 0 0"/></pvx>'
    with pytest.raises(RigError, match="'w' has no area"):
        read(text, "m")


def test_names_that_contradict_corners_are_said(read):
    text = '<pvx><Machine Name="{}" LowerLeft="1 0 -1" LowerRight="2 0 -1" UpperRight="2 1 -1"/></pvx>'
    assert said(read(text.format("Left"), "m"), "'Left'", "right")
    assert not said(read(text.format("Right"), "m"), "to the viewer's")


def test_notes_of_read_rig_are_warnings(tmp_path: Path, caplog: pytest.LogCaptureFixture):
    path = tmp_path / "wall.pvx"
    path.write_text(PVX)
    assert len(read_rig(path, "m").walls) == 2
    assert any("Sparkle" in record.getMessage() for record in caplog.records)
