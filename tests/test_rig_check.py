"""What is doubtful in a rig, and what of it one machine can show."""

from __future__ import annotations

import math

import pytest
from rigs import rig_of, wall_keys

from vr_plugin.rig import RigError
from vr_plugin.rigs.check import WallMeasures, findings
from vr_plugin.rigs.one_machine import rig_on_machine

GOOD = wall_keys()


def test_a_good_rig_has_no_findings():
    assert findings(rig_of()) == []


@pytest.mark.parametrize(
    ("wall", "words"),
    [
        ({"upper_left": [-0.8, 2.7, -2]}, ("no rectangle", "84.3°")),
        (
            {"lower_left": [1, 0.7, -2], "lower_right": [-1, 0.7, -2], "upper_left": [1, 2.7, -2]},
            ("turns its back", "mirrored", "exchange"),
        ),
        (
            {"lower_left": [0, 0.7, -1], "lower_right": [0, 0.7, -3], "upper_left": [0, 2.7, -1]},
            ("edge-on",),
        ),
        (
            {"lower_left": [1, 2.7, -2], "lower_right": [-1, 2.7, -2], "upper_left": [1, 0.7, -2]},
            ("upside down",),
        ),
        (
            {"lower_left": [1, 0.7, -2], "lower_right": [1, 2.7, -2], "upper_left": [-1, 0.7, -2]},
            ("on its side",),
        ),
        ({"pixels": [64, 32]}, ("31.2 × 62.5 mm", "not square")),
        (
            {"lower_left": [0, 1.7, -0.1], "lower_right": [0.002, 1.7, -0.1], "upper_left": [0, 1.702, -0.1]},
            ("2 × 2 mm small",),
        ),
    ],
)
def test_a_doubtful_wall(wall, words):
    (finding,) = findings(rig_of(wall_keys(**wall)))
    assert "wall 'front'" in finding and all(word in finding for word in words), finding


def test_the_head_far_away():
    (finding,) = findings(rig_of(eyes={"rest_pose": {"position": [0, 1700, 0]}}))
    assert "rest_pose" in finding and "1700" in finding


@pytest.mark.parametrize(
    ("one", "other", "word"),
    [
        ({"fullscreen": True, "monitor": 1}, {"fullscreen": True, "monitor": 1}, "monitor 1"),
        ({"fullscreen": True}, {"fullscreen": True}, "the same monitor"),
        ({"fullscreen": True, "monitor": 0}, {"fullscreen": True, "monitor": 1}, None),
        ({"position": [0, 0]}, {"position": [63, 63]}, "overlap"),
        ({"position": [0, 0]}, {"position": [64, 0]}, None),
        ({"position": [0, 0], "size": [100, 64]}, {"position": [64, 0]}, "overlap"),
        ({}, {}, None),
    ],
)
def test_windows_that_clash(one, other, word):
    found = findings(rig_of(wall_keys("a", window=one), wall_keys("b", window=other)))
    assert len(found) == (word is not None)
    assert word is None or word in found[0]
    apart = rig_of(wall_keys("a", window=one, machine="m"), wall_keys("b", window=other, machine="n"))
    assert findings(apart) == []


def test_measures_of_a_wall():
    """2 × 2 m in 64 × 64 pixels, 2 m before the eye."""
    rig = rig_of()
    measures = WallMeasures.of(rig, rig.walls[0])
    assert measures.size == pytest.approx((2, 2)) and measures.pixel == pytest.approx((1 / 32, 1 / 32))
    assert measures.angle == pytest.approx(90) and measures.faces_eye
    assert measures.degrees == pytest.approx(2 * math.degrees(math.atan(0.5)))
    assert measures.pixels_a_degree == pytest.approx(64 * math.radians(1))


# --- several machines -------------------------------------------------------------------------------------

CLUSTER = (wall_keys("a", machine="node1"), wall_keys("b", machine="node2"), wall_keys("c", machine="node2"))


def test_a_rig_of_several_machines_is_refused_with_advice():
    with pytest.raises(RigError) as caught:
        rig_on_machine(rig_of(*CLUSTER))
    for word in ("2 machines", "node1 (a)", "node2 (b, c)", "--machine node1", "all"):
        assert word in str(caught.value)


def test_one_machine_shows_its_own_walls():
    assert [wall.name for wall in rig_on_machine(rig_of(*CLUSTER), "node2").walls] == ["b", "c"]
    everywhere = rig_of(*CLUSTER, wall_keys("d"))
    assert [wall.name for wall in rig_on_machine(everywhere, "node1").walls] == ["a"]


def test_a_machine_that_is_none_of_the_rigs():
    with pytest.raises(RigError, match=r"'nod1'.*did you mean node1\?"):
        rig_on_machine(rig_of(*CLUSTER), "nod1")


def test_all_walls_on_one_machine_when_asked():
    assert len(rig_on_machine(rig_of(*CLUSTER), "all").walls) == 3


@pytest.mark.parametrize("machine", ["", "node1", ":0.0"])
def test_a_rig_of_one_machine_is_shown_whole(machine):
    rig = rig_of(wall_keys("a", machine=machine), wall_keys("b", machine=machine))
    assert rig_on_machine(rig) is rig


def test_this_machines_own_name_chooses_its_walls(monkeypatch):
    monkeypatch.setattr("platform.node", lambda: "Node2.example.org")
    assert [wall.name for wall in rig_on_machine(rig_of(*CLUSTER)).walls] == ["b", "c"]


def test_two_windows_on_one_monitor_cannot_be_shown():
    full = {"fullscreen": True, "monitor": 0}
    rig = rig_of(wall_keys("a", window=full), wall_keys("b", window=full))
    with pytest.raises(RigError, match="both fill monitor 0"):
        rig_on_machine(rig)
    assert rig_on_machine(rig, offscreen=True) is rig
