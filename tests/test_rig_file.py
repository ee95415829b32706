"""Rig files: read whole, every problem told at once, written back the same."""

from __future__ import annotations

import copy
import logging

import numpy as np
import pytest
from rigs import assert_same_rig, rig_of, wall_keys
from views import random_rotation

from vr_plugin.pose import Pose, quaternion_of
from vr_plugin.rig import Eyes, Placement, QualityAim, Rig, RigError, RigWall, TrackerPlace, WindowPlace
from vr_plugin.rigs.check import findings
from vr_plugin.rigs.file import load_rig, rig_of_keys, rig_to_toml

try:
    from tomllib import loads as _toml
except ImportError:  # Python 3.10
    from tomli import loads as _toml

WHOLE = """
name = "lab"
[[wall]]
name = "front"
lower_left = [-1.5, 0, -1.5]
lower_right = [1.5, 0.0, -1.5]
upper_left = [-1.5, 3, -1.5]
pixels = [640, 480]
stereo = "side_by_side"
window = { monitor = 1, position = [10, -20], size = [1280, 480] }
[[wall]]
name = "floor"
lower_left = [-1.5, 0, 1.5]
lower_right = [1.5, 0, 1.5]
upper_left = [-1.5, 0, -1.5]
pixels = [512, 512]
machine = "node2"
fixed_to = "head"
window.fullscreen = true
[eyes]
separation = 0.06
offset = [0, 0.1, -0.05]
rest_pose = { position = [0, 1.6, 1], look = [1, 0, 0] }
near = 0.1
[tracker]
kind = "vrpn"
address = "Tracker0@host:3884"
head = 2
wand = 1
latency = 0.02
room_from_tracker = { position = [0, 1, 0], axes = ["x", "z", "-y"], scale = 0.001 }
sensor_from_head = { position = [0, 0, 0.1], turn = 90 }
[[recording]]
address = "walk.csv"
room_from_tracker = [[0.5, 0, 0, 1], [0, 0.5, 0, 2], [0, 0, 0.5, 3], [0, 0, 0, 1]]
[world]
room_from_world = { scale = 0.001 }
[quality]
target_hz = 90
quality = 1.5
min = 0.5
max = 3
"""


@pytest.fixture
def rig_file(tmp_path):
    def write(text):
        path = tmp_path / "rig.toml"
        path.write_text(text)
        return path

    return write


def problems_of(keys) -> list[str]:
    with pytest.raises(RigError) as caught:
        rig_of_keys(keys)
    return str(caught.value).split("\n  - ")[1:]


def problem_of(*walls, **keys) -> str:
    problems = problems_of({"wall": list(walls) or [wall_keys()], **keys})
    assert len(problems) == 1, problems
    return problems[0]


def test_every_key_arrives(rig_file):
    rig = load_rig(rig_file(WHOLE))
    front, floor = rig.walls
    assert (rig.name, front.name, front.stereo, front.fixed_to) == ("lab", "front", "side_by_side", "room")
    assert front.window == WindowPlace(1, (10, -20), (1280, 480))
    assert front.wall.pixels == (640, 480)
    assert front.wall.upper_left.tolist() == [-1.5, 3, -1.5]
    assert (floor.machine, floor.fixed_to, floor.window.fullscreen) == ("node2", "head", True)
    assert (rig.eyes.separation, rig.eyes.offset, rig.eyes.near) == (0.06, (0, 0.1, -0.05), 0.1)
    rest = rig.eyes.rest_pose
    np.testing.assert_allclose(rest.apply([0, 0, -2]), [2, 1.6, 1], atol=1e-12)  # looks along x
    np.testing.assert_allclose(rest.apply([0, 1, 0]), [0, 2.6, 1], atol=1e-12)
    tracker = rig.tracker
    assert (tracker.kind, tracker.address, tracker.head, tracker.wand) == ("vrpn", "Tracker0@host:3884", 2, 1)
    assert tracker.latency == 0.02
    np.testing.assert_allclose(tracker.room_from_tracker @ [0, 0, 500, 1], [0, 1.5, 0, 1], atol=1e-12)
    np.testing.assert_allclose(tracker.sensor_from_head.apply([0, 0, 1]), [1, 0, 0.1], atol=1e-12)
    (recording,) = rig.recordings
    assert (recording.kind, recording.address) == ("path", "walk.csv")
    assert recording.room_from_tracker[2].tolist() == [0, 0, 0.5, 3]
    assert rig.placement.room_from_world[0, 0] == 0.001
    assert rig.quality == QualityAim(90, 1.5, 0.5, 3)


def test_a_wall_alone_is_a_rig():
    rig = rig_of()
    assert rig.eyes.rest_pose.position.tolist() == [0, 1.7, 0]
    assert (rig.tracker.kind, rig.placement.room_from_world, rig.quality) == ("none", None, QualityAim())


def test_what_is_written_reads_back_the_same(rig_file, rng):
    rig = load_rig(rig_file(WHOLE))
    assert_same_rig(load_rig(rig_file(rig_to_toml(rig))), rig)
    assert_same_rig(rig_of(), load_rig(rig_file(rig_to_toml(rig_of()))))
    for _ in range(20):
        rig = random_rig(rng)
        text = rig_to_toml(rig)
        assert_same_rig(load_rig(rig_file(text)), rig)
        assert rig_to_toml(load_rig(rig_file(text))) == text


def random_rig(rng) -> Rig:
    """Numbers with all their digits, and names that need quoting."""

    def pose():
        return Pose(rng.normal(size=3), quaternion_of(random_rotation(rng)))

    def matrix(scale=1.0):
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = scale * random_rotation(rng), rng.normal(size=3)
        return matrix

    import persp_sw as psw

    walls = []
    for name in ('front "A"', "hinten\\ü", "tab\there\x7f"):
        low, (right, up, _) = rng.normal(size=3), random_rotation(rng)
        walls.append(RigWall(psw.Wall(low, low + right, low + 2 * up, (100, 200), name), machine=name))
    return Rig(
        walls,
        Eyes(-0.0612, tuple(rng.normal(size=3).tolist()), pose(), 0.3),
        TrackerPlace("dtrack", "udp://:5000", 3, None, matrix(0.001), 0.0123, pose()),
        Placement(matrix(0.01)) if rng.integers(2) else Placement(None, (0.1, 0.2, 0.3), 1.7),
        QualityAim(72, 1.1, 0.3, 4),
        "a \n rig",
        [TrackerPlace("path", "p.csv", room_from_tracker=matrix(0.7), sensor_from_head=pose())],
    )


def test_the_written_file_explains_itself():
    text = rig_to_toml(rig_of())
    assert "metres" in text and "side_by_side" in text and "vrpn" in text


def test_a_recording_beside_the_file_is_found(rig_file, tmp_path):
    (tmp_path / "walk.csv").touch()
    rig = load_rig(rig_file(WHOLE))
    assert rig.recordings[0].address == str(tmp_path / "walk.csv")
    assert rig.tracker_for("walk.csv").room_from_tracker[0, 3] == 1


# --- broken files -----------------------------------------------------------------------------------------


def test_all_problems_are_told_at_once():
    problems = problems_of(
        {
            "nam": "lab",
            "wall": [
                wall_keys("a", lower_left=[0, "x", 0], stereo="annaglyph", window={"monitr": 0}),
                wall_keys("b", upper_left=[1, 0.7, -2]),
                wall_keys("b", pixels=[0, 10.5]),
                {"name": "c"},
            ],
            "eyes": {"separation": 64},
            "tracker": {"kind": "vrpn"},
            "world": {"size": -1},
            "quality": {"min": 3},
        }
    )
    for words in (
        ("nam: unknown key", "name?"),
        ("wall[0] 'a'.lower_left[1]", "number", '"x"', "metres"),
        ("wall[0] 'a'.stereo", "annaglyph", "did you mean 'anaglyph'?"),
        ("wall[0] 'a'.window.monitr", "unknown key", "monitor?"),
        ("wall[1] 'b'", "one line", "[1.0, 0.7, -2.0]"),
        ("wall[2] 'b'.pixels[0]", "at least 1", "given 0"),
        ("wall[2] 'b'.pixels[1]", "whole number", "10.5"),
        ("wall[3] 'c'.lower_left", "missing", "[x, y, z] in metres"),
        ("wall[3] 'c'.pixels", "missing", "[width, height]"),
        ("eyes.separation", "64", "unit"),
        ("tracker", "vrpn", "address", "@host"),
        ("world.size", "greater than 0", "-1"),
        ("quality", "min ≤ quality ≤ max", "3"),
    ):
        assert any(all(word in problem for word in words) for problem in problems), (words, problems)
    assert len(problems) == 15  # these, and wall[3]'s other two corners


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"eyes": {"offset": [0, 0]}}, ("eyes.offset", "[x, y, z]", "given [0, 0]")),
        ({"eyes": {"offset": [0, 0, 0, 0]}}, ("eyes.offset", "[x, y, z]")),
        ({"eyes": {"near": float("nan")}}, ("eyes.near", "finite")),
        ({"eyes": {"rest_pose": {"look": [0, 2, 0]}}}, ("eyes.rest_pose", "parallel", "up")),
        ({"eyes": {"rest_pose": {"look": [0, 0, 0]}}}, ("eyes.rest_pose", "[0, 0, -1]")),
        ({"eyes": {"rest_pose": {"orientation": [0, 0, 0, 0]}}}, ("eyes.rest_pose", "quaternion")),
        (
            {"eyes": {"rest_pose": {"orientation": [0, 0, 0, 1], "look": [0, 0, -1]}}},
            ("eyes.rest_pose", "not both"),
        ),
        ({"eyes": {"seperation": 0.06}}, ("eyes.seperation", "did you mean separation?")),
        ({"eye": {}}, ("eye: unknown key", "eyes")),
        ({"tracker": {"kind": "optitrack"}}, ("tracker.kind", "'vrpn'", "optitrack")),
        ({"tracker": {"kind": "path"}}, ("tracker", "recording", ".csv")),
        ({"tracker": {"kind": "dtrack"}}, ("tracker", "udp://")),
        ({"tracker": {"kind": "vrpn", "address": "a@b", "wand": 0}}, ("tracker", "same sensor")),
        ({"tracker": {"room_from_tracker": [[1, 0], [0, 1]]}}, ("tracker.room_from_tracker", "four rows")),
        (
            {"tracker": {"room_from_tracker": np.diag([1, 1, -1, 1]).tolist()}},
            ("room_from_tracker", "mirrors"),
        ),
        ({"tracker": {"room_from_tracker": {"axes": ["x", "y", "-z"]}}}, ("room_from_tracker", "mirrors")),
        ({"tracker": {"room_from_tracker": {"axes": ["x", "y", "w"]}}}, ("axes[2]", "'-z'", '"w"')),
        ({"tracker": {"room_from_tracker": {"turns": 90}}}, ("turns: unknown key", "turn?")),
        ({"tracker": {"sensor_from_head": {"turn": 9, "orientation": [0, 0, 0, 1]}}}, ("not both",)),
        ({"tracker": {"latency": 20}}, ("tracker.latency", "at most 1", "20")),
        ({"recording": [{}]}, ("recording[0].address", "missing", "file name")),
        ({"world": {"room_from_world": {}, "size": 2}}, ("world", "size", "remove one")),
        ({"world": {"center": [0, 0, 0]}}, ("world.center", "did you mean centre?")),
        ({"quality": {"target_hz": 0}}, ("quality.target_hz", "at least 1")),
    ],
)
def test_a_broken_table(keys, words):
    problem = problem_of(**keys)
    assert all(word in problem for word in words), problem


@pytest.mark.parametrize(
    ("wall", "words"),
    [
        ({"lower_right": [-1, 0.7, -2]}, ("wall[0] 'front'", "one line")),
        ({"lower_right": [3000, 0.7, -2]}, ("wall[0] 'front'", "metres", "divide", "1000")),
        ({"pixels": [20000, 64]}, ("wall[0] 'front'.pixels[0]", "at most 16384")),
        ({"window": {"fullscreen": True, "size": [9, 9]}}, ("window", "fullscreen", "size", "remove")),
        ({"window": {"monitor": -1}}, ("window.monitor", "at least 0")),
        ({"fixed_to": "hand"}, ("fixed_to", "'head'", '"hand"')),
        ({"upper_right": [0, 0, 0]}, ("upper_right: unknown key", "did you mean")),
    ],
)
def test_a_broken_wall(wall, words):
    problem = problem_of(wall_keys(**wall))
    assert all(word in problem for word in words), problem


@pytest.mark.parametrize("wall", [None, [], {}, "front", ["front"], [3]])
def test_a_file_without_walls(wall):
    (problem,) = problems_of({} if wall is None else {"wall": wall})
    assert problem.startswith("wall")


@pytest.mark.parametrize("text", ["[[wall]\n", "wall = 3 4\n", "a = 1\na = 2\n"])
def test_not_toml(rig_file, text):
    with pytest.raises(RigError, match=r"not valid TOML.*line"):
        load_rig(rig_file(text))


def test_a_file_that_is_none(tmp_path):
    with pytest.raises(RigError, match="no rig file"):
        load_rig(tmp_path / "none.toml")
    with pytest.raises(RigError, match="cannot read"):
        load_rig(tmp_path)
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(RigError, match="not a text file"):
        load_rig(tmp_path / "binary.toml")


def test_what_is_doubtful_is_said_and_shown_all_the_same(rig_file, caplog):
    swapped = WHOLE.replace("lower_left = [-1.5, 0, -1.5]", "lower_left = [1.5, 0, -1.5]")
    swapped = swapped.replace("lower_right = [1.5, 0.0, -1.5]", "lower_right = [-1.5, 0.0, -1.5]")
    swapped = swapped.replace("upper_left = [-1.5, 3, -1.5]", "upper_left = [1.5, 3, -1.5]")
    with caplog.at_level(logging.WARNING, "persp_sw"):
        load_rig(rig_file(swapped))
    assert "wall 'front' turns its back" in caplog.text and "mirrored" in caplog.text


JUNK = (
    [None, True, -1, 0, 1e308, 1e-308, float("nan"), float("inf"), 10**30, "", "x", "\x00"]
    + [0.5, 0.02, 2, 3, -1.5, 1e-6, 1e6, "mouse", "quad"]  # which may do
    + [[], [[]], {}, {"x": {}}, [None, {}], [1, 2, 3], [0, 0, 0], [1e308, -1e308, 1e-308], [1e-308, 0, 0]]
    + [[1e9, -1e9, 1e9], [[0] * 4 for _ in range(4)], [[1, 2, 3, 4] for _ in range(4)]]
)


def test_whatever_a_file_holds_the_answer_is_a_rig_or_problems(rng):
    """2000 files with one to three values replaced by junk, or keys renamed; no other error."""
    good = _toml(WHOLE)
    outcomes = {"rig": 0, "problems": 0}
    for _ in range(2000):
        keys = copy.deepcopy(good)
        for _ in range(rng.integers(1, 4)):
            spoil(keys, rng)
        try:
            rig = rig_of_keys(keys)
            findings(rig)
            rig_to_toml(rig)
            outcomes["rig"] += 1
        except RigError as error:
            assert str(error).count("\n  - ") >= 1
            outcomes["problems"] += 1
    assert min(outcomes.values()) > 20, outcomes


def spoil(node, rng) -> None:
    """Replace a value somewhere below by junk, or give its key another name."""
    while True:
        places = list(node) if isinstance(node, dict) else list(range(len(node)))
        if not places:
            return
        place = places[rng.integers(len(places))]
        if isinstance(node[place], dict | list) and node[place] and rng.random() < 0.7:
            node = node[place]
            continue
        if isinstance(node, dict) and rng.random() < 0.2:
            node[place + "s"] = node.pop(place)
        else:
            node[place] = copy.deepcopy(JUNK[rng.integers(len(JUNK))])
        return
