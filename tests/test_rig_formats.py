"""Wall files of other systems: ParaView's, VR Juggler's, and what all have in common."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from rig_texts import (
    PVX,
    corners,
    covise,
    jconf,
    near,
    read_in,
    said,
    viewport,
    wall,
    window,
)

from vr_plugin.formats import Reading, read_rig
from vr_plugin.pose import Pose
from vr_plugin.rig import RigError, WindowPlace


@pytest.fixture
def read_walls(tmp_path: Path) -> Callable[..., Reading]:
    """Reads a text as a wall file."""
    return partial(read_in, tmp_path)


def test_paraview_walls_are_where_they_are_said_to_be(read_walls):
    reading = read_walls(PVX, "ft", "wall.pvx")
    foot = 0.3048
    assert reading.system == "ParaView"
    assert near(corners(reading, "front") / foot, [[-1, -1, -1], [1, -1, -1], [-1, 1, -1]])
    assert near(corners(reading, "side") / foot, [[-1, -1, 1], [-1, -1, -1], [-1, 1, 1]])
    assert reading.rig.eyes.separation == pytest.approx(0.125 * foot)
    front, side = reading.rig.walls
    assert (front.machine, front.stereo, front.wall.pixels) == ("node1:0", "quad", (640, 480))
    assert (front.window.position, front.window.size) == ((10, 20), (640, 480))
    assert (side.machine, side.wall.pixels) == ("node2:0.1", (500, 500))
    assert side.window == WindowPlace(fullscreen=True)
    assert said(reading, "Sparkle") and said(reading, "Fog")


@pytest.mark.parametrize("left_out", ["LowerLeft", "LowerRight", "UpperRight", "UpperLeft"])
def test_paraview_takes_any_three_corners(read_walls, left_out: str):
    points = {"LowerLeft": "0 0 0", "LowerRight": "4 0 1", "UpperRight": "4 3 1", "UpperLeft": "0 3 0"}
    given = " ".join(f'{key}="{value}"' for key, value in points.items() if key != left_out)
    reading = read_walls(f'<pvx><Machine Name="w" Geometry="40x30+0+0" {given}/></pvx>', "m")
    assert near(corners(reading, "w"), [[0, 0, 0], [4, 0, 1], [0, 3, 0]])


def test_paraview_corners_that_contradict_are_a_problem(read_walls):
    given = 'LowerLeft="0 0 0" LowerRight="4 0 0" UpperRight="4 3 0" UpperLeft="0 4 0"'
    with pytest.raises(RigError, match="no parallelogram"):
        read_walls(f'<pvx><Machine Name="w" {given}/></pvx>', "m")


def test_paraview_displays_that_all_fill_one_are_hosts(read_walls):
    tile = '<Machine Name="{0}" Environment="DISPLAY=:0" LowerLeft="{0} 0 0"'
    tile += ' LowerRight="{1} 0 0" UpperRight="{1} 1 0"/>'
    reading = read_walls(f"<pvx>{tile.format(0, 1)}{tile.format(1, 2)}</pvx>", "m")
    assert reading.rig.machines == ("0", "1")
    one = read_walls(f"<pvx>{tile.format(0, 1)}</pvx>", "m")
    assert one.rig.machines == ("",)


def test_a_display_without_corners_is_refused_with_advice(read_walls):
    with pytest.raises(RigError, match=r"localhost.*LowerLeft, LowerRight, UpperRight.*configs/"):
        read_walls('<pvx><Machine Name="localhost" Geometry="300x300+300+0"/></pvx>', "m")


def test_all_that_is_broken_is_said_at_once_with_its_place(read_walls):
    text = (
        PVX.replace('"1 -1 -1"', '"1 0/05 -1"')
        .replace("500x500-5+0", "500 by 500")
        .replace('"0.125"', '"half"')
    )
    with pytest.raises(RigError) as told:
        read_walls(text, "m", "wall.pvx")
    lines = str(told.value).splitlines()
    assert any("wall.pvx:6: Machine 'front': LowerRight[1]" in line and "'0/05'" in line for line in lines)
    assert any("0.05?" in line for line in lines)
    assert any("wall.pvx:8: Machine 'side': Geometry" in line and "500 by 500" in line for line in lines)
    assert any("EyeSeparation" in line and "'half'" in line for line in lines)
    assert "--skip-broken" in lines[-1]


def test_what_is_broken_can_be_left_out(read_walls):
    reading = read_walls(PVX.replace('"1 -1 -1"', '"1 0/05 -1"'), "m", skip_broken=True)
    assert [wall.name for wall in reading.rig.walls] == ["side"]
    assert said(reading, "left out", "front", "0/05")


def test_pixels_that_no_file_states_can_be_given(read_walls):
    text = '<pvx><Machine Name="w" LowerLeft="0 0 0" LowerRight="4 0 0" UpperRight="4 3 0"/></pvx>'
    assert wall(read_walls(text, "m"), "w").wall.pixels == (1440, 1080)
    assert said(read_walls(text, "m"), "no pixels are stated")
    assert wall(read_walls(text, "m", pixels=(80, 60)), "w").wall.pixels == (80, 60)


# --- VR Juggler ---


def test_vr_juggler_walls_and_windows(read_walls):
    text = jconf(
        window("one", viewport(view="Stereo"), stereo=True, y=600) + window("two", viewport(view="Right Eye"))
    )
    reading = read_walls(text, name="cave.jconf")
    assert reading.system == "VR Juggler"
    assert near(corners(reading, "one"), [[-1, 0, -2], [1, 0, -2], [-1, 1.5, -2]])
    one, two = reading.rig.walls
    assert (one.stereo, two.stereo, one.wall.pixels) == ("quad", "right", (800, 600))
    # Counted from below: the upper window's top is the desktop's.
    assert (one.window.position, two.window.position) == ((100, 0), (100, 600))
    assert said(reading, "lower edge")


def test_vr_juggler_leaves_out_what_is_off_or_no_wall(read_walls):
    inside = "<simulator_viewports><simulator_viewport/></simulator_viewports>"
    simulator = f'<display_window name="sim">{inside}</display_window>'
    text = jconf(window("on", viewport()) + window("off", viewport(), active=False) + simulator
                 + window("half", viewport("v", active=False)) + "<joystick/>")  # fmt: skip
    reading = read_walls(text)
    assert [w.name for w in reading.rig.walls] == ["on"]
    assert (
        said(reading, "off", "not active") and said(reading, "sim", "simulator") and said(reading, "joystick")
    )


def test_vr_juggler_head_mounted_walls_go_with_the_head(read_walls):
    (hmd,) = read_walls(jconf(window("eye", viewport(tracked=True)))).rig.walls
    assert hmd.fixed_to == "head"
    assert near(hmd.in_room(Pose((0, 1.7, 0))).lower_left, [-1, 1.7, -2])


def test_vr_juggler_clusters_name_their_machines(read_walls):
    inside = f"<host_name>ptah</host_name><display_windows>{window('w', viewport())}</display_windows>"
    assert read_walls(jconf(f'<machine_specific name="Node">{inside}</machine_specific>')).rig.machines == (
        "ptah",
    )


def test_vr_juggler_heads(read_walls):
    alias = '<alias name="VJHead"><proxy>P</proxy></alias>'
    proxy = '<position_proxy name="P"><device>{}</device><unit>1</unit></position_proxy>'
    vrpn = '<vrpn name="V"><tracker_server>T0@host</tracker_server></vrpn>'
    place = "".join(f"<initial_position>{v}</initial_position>" for v in (0.5, 1.8, 0.25))
    simulated = f'<simulated_positional_device name="S">{place}</simulated_positional_device>'
    rest = window("w", viewport()) + alias + simulated + vrpn
    tracker = read_walls(jconf(rest + proxy.format("V"))).rig.tracker
    assert (tracker.kind, tracker.address, tracker.head) == ("vrpn", "T0@host", 1)
    assert near(read_walls(jconf(rest + proxy.format("S"))).rig.eyes.rest_pose.position, [0.5, 1.8, 0.25])


def test_vr_juggler_corners_must_agree_and_be_three_numbers(read_walls):
    with pytest.raises(RigError, match="no parallelogram"):
        read_walls(jconf(window("w", viewport(upper_left=(-1, 2, -2)))))
    with pytest.raises(RigError, match=r"upper_left_corner is 3 numbers; given '-1 2'"):
        read_walls(jconf(window("w", viewport(upper_left=(-1, 2)))))


# --- All of them ---


@pytest.mark.parametrize(
    ("unit", "metres"), [("m", 1), ("cm", 0.01), ("mm", 0.001), ("in", 0.0254), ("ft", 0.3048)]
)
def test_units_scale_corners(read_walls, unit: str, metres: float):
    assert near(
        corners(read_walls(PVX, unit), "front"), np.array([[-1, -1, -1], [1, -1, -1], [-1, 1, -1]]) * metres
    )


@pytest.mark.parametrize(("size", "likely"), [("2", "m"), ("2000", "mm"), ("200", "cm"), ("100", "cm")])
def test_a_unit_that_is_not_stated_is_asked_for(read_walls, size: str, likely: str):
    wall = f'LowerLeft="0 0 0" LowerRight="{size} 0 0" UpperRight="{size} {size} 0"'
    with pytest.raises(RigError, match=rf"--unit m\|mm\|cm\|in\|ft.* Most likely: --unit {likely}$"):
        read_walls(f'<pvx><Machine Name="w" {wall}/></pvx>')


def test_eyes_too_far_apart_are_refused_or_left_out(read_walls):
    text = covise().replace('separation="70"', 'separation="700"')
    with pytest.raises(RigError, match=r"the eyes would be 0\.7 m apart"):
        read_walls(text)
    assert read_walls(text, skip_broken=True).rig.eyes.separation == pytest.approx(0.064)


def test_a_wrong_unit_is_refused_by_what_it_makes(read_walls):
    with pytest.raises(RigError, match="2000 m long"):
        read_walls(covise(), "m")
    with pytest.raises(RigError, match="furlong"):
        read_walls(PVX, "furlong")


def test_a_unit_against_the_formats_own_is_said(read_walls):
    text = covise().replace('separation="70"', "")
    assert said(read_walls(text, "cm"), "counts in mm", "cm")
    assert near(corners(read_walls(text, "cm"), "FRONT")[0], [-10, -5, -10])


def test_a_wall_without_area_is_broken(read_walls):
    text = '<pvx><Machine Name="w" LowerLeft="0 0 0" LowerRight="1 0 0" UpperRight="3 0 0"/></pvx>'
    with pytest.raises(RigError, match="'w' has no area"):
        read_walls(text, "m")


def test_names_that_contradict_corners_are_said(read_walls):
    text = '<pvx><Machine Name="{}" LowerLeft="1 0 -1" LowerRight="2 0 -1" UpperRight="2 1 -1"/></pvx>'
    assert said(read_walls(text.format("Left"), "m"), "'Left'", "right")
    assert not said(read_walls(text.format("Right"), "m"), "to the viewer's")


def test_notes_of_read_rig_are_warnings(tmp_path: Path, caplog: pytest.LogCaptureFixture):
    path = tmp_path / "wall.pvx"
    path.write_text(PVX)
    assert len(read_rig(path, "m").walls) == 2
    assert any("Sparkle" in record.getMessage() for record in caplog.records)


def test_a_viewer_of_unknown_place_rests_before_all_walls(read_walls):
    # VR Juggler's head starts at the origin, which is in the plane of a floor at y = 0: it stands up.
    floor = {
        "lower_left": (-1, 0, 1), "lower_right": (1, 0, 1),
        "upper_right": (1, 0, -1), "upper_left": (-1, 0, -1),
    }  # fmt: skip
    tall = {"upper_right": (1, 3, -2), "upper_left": (-1, 3, -2)}
    reading = read_walls(jconf(window("floor", viewport(**floor)) + window("front", viewport(**tall))))
    assert near(reading.rig.eyes.rest_pose.position, [0, 1.7, 0])
    assert said(reading, "at rest", "standing")
    # Before a wall that does not reach to there, and whose plane has the origin: a metre off its middle.
    flat = '<pvx><Machine Name="w" LowerLeft="-1 -1 0" LowerRight="1 -1 0" UpperRight="1 1 0"/></pvx>'
    assert near(read_walls(flat, "m").rig.eyes.rest_pose.position, [0, 0, 1])


def test_walls_of_one_name_get_names_of_their_own(read_walls):
    one = '<Machine Name="w" LowerLeft="-1 -1 {0}" LowerRight="1 -1 {0}" UpperRight="1 1 {0}"/>'
    reading = read_walls("<pvx>" + "".join(one.format(z) for z in (-1, -2, -3)) + "</pvx>", "m")
    names = [wall.name for wall in reading.rig.walls]
    assert len(set(names)) == 3 and all(name.startswith("w") for name in names)
