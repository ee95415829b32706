"""The rig as data: walls that go with the head, trackers' axes, recordings."""

from __future__ import annotations

import numpy as np
import pytest
from rigs import rig_of, wall_keys
from tolerances import MATRIX
from views import random_pose, random_rotation

import persp_sw as psw
from vr_plugin.eyes import eyes_of_head
from vr_plugin.pose import Pose, quaternion_of
from vr_plugin.rig import RigWall, TrackerPlace
from vr_plugin.rigs.similarity import flaw_of, parts_of, similarity


def test_a_wall_of_the_room_stays_and_one_of_the_head_goes_with_it(rng):
    head = Pose((0.3, 1.5, -0.2), quaternion_of(random_rotation(rng)))
    rig = rig_of(wall_keys("room"), wall_keys("head", fixed_to="head"))
    stays, goes = (wall.in_room(head) for wall in rig.walls)
    given = rig.walls[0].wall
    for corner in ("lower_left", "lower_right", "upper_left"):
        assert np.array_equal(getattr(stays, corner), getattr(given, corner))
        expected = head.matrix @ [*getattr(given, corner), 1]
        np.testing.assert_allclose(getattr(goes, corner), expected[:3], atol=MATRIX)
    assert goes.pixels == given.pixels and goes.name == "head"
    np.testing.assert_allclose(rig.corners[1] - rig.corners[0], np.tile([0, 1.7, 0], (4, 1)), atol=MATRIX)


def test_a_sensors_pose_becomes_the_heads(rng):
    """The matrices say it: room_from_head is room_from_tracker · tracker_from_sensor · sensor_from_head."""
    for _ in range(20):
        scale = rng.uniform(0.001, 2)
        tracker = np.eye(4)
        tracker[:3, :3], tracker[:3, 3] = scale * random_rotation(rng), rng.normal(size=3)
        sensor = Pose.from_matrix(random_pose(rng))
        head = Pose.from_matrix(random_pose(rng))
        place = TrackerPlace("vrpn", "x@y", room_from_tracker=tracker, sensor_from_head=head)
        rigid = tracker @ sensor.matrix
        rigid[:3, :3] /= scale
        np.testing.assert_allclose(place.room_from_sensor(sensor).matrix, rigid, atol=1e-8)
        np.testing.assert_allclose(place.room_from_head(sensor).matrix, rigid @ head.matrix, atol=1e-7)


def test_a_body_taught_in_backwards_keeps_the_eyes_apart_the_right_way():
    """Its x axis points to the left ear; the right eye is on the right all the same."""
    place = TrackerPlace("vrpn", "x@y", sensor_from_head=Pose.from_matrix(similarity(turn=180)))
    backwards = Pose((0, 1.7, 0), (0, 1, 0, 0))
    eyes = eyes_of_head(place.room_from_head(backwards), rig_of().eyes)
    assert eyes.right[0] - eyes.left[0] == pytest.approx(0.064)


def test_a_recording_is_placed_as_its_name_says():
    rows = similarity((1, 2, 3), turn=90).tolist()
    rig = rig_of(
        tracker={"kind": "path", "address": "a.csv", "latency": 0.1},
        recording=[{"address": "b.csv.gz", "room_from_tracker": rows}],
    )
    named = rig.tracker_for("elsewhere/b.csv.gz")
    assert (named.kind, named.address) == ("path", "elsewhere/b.csv.gz")
    assert named.room_from_tracker.tolist() == rows
    assert rig.tracker_for("elsewhere/a.csv").latency == 0.1
    other = rig.tracker_for("c.csv")
    assert (other.kind, other.address, other.latency) == ("path", "c.csv", 0.1)


def test_axes_turn_scale_and_shift():
    """A tracker in millimetres with z up, turned to the left by 90°."""
    matrix = similarity((1, 2, 3), ("x", "z", "-y"), 90, 0.001)
    for point, expected in (((0, 0, 0), (1, 2, 3)), ((0, 0, 1000), (1, 3, 3)), ((1000, 0, 0), (1, 2, 2))):
        np.testing.assert_allclose((matrix @ [*point, 1])[:3], expected, atol=MATRIX)
    assert flaw_of(matrix) is None
    assert parts_of(matrix) == {
        "position": [1, 2, 3], "axes": ["x", "z", "-y"], "turn": 90, "scale": 0.001,
    }  # fmt: skip


@pytest.mark.parametrize("axes", [("x", "y", "y"), ("x", "y", "up"), ("x", "y")])
def test_axes_that_are_none(axes):
    with pytest.raises(ValueError, match=r"axis|axes"):
        similarity(axes=axes)


@pytest.mark.parametrize(
    ("matrix", "word"),
    [
        (np.diag([1.0, 1, -1, 1]), "mirrors"),
        (np.diag([1.0, 1, 1.1, 1]), "stretches"),
        (np.array([[1, 0.1, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]]), "shears"),
        (np.diag([1.0, 0, 1, 1]), "singular"),
        (np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [1, 2, 3, 1.0]]), "row by row"),
    ],
)
def test_what_is_no_similarity(matrix, word):
    assert word in flaw_of(matrix)


def test_measured_numbers_may_be_rounded(rng):
    matrix = np.eye(4)
    matrix[:3, :3] = 0.5 * random_rotation(rng)
    assert flaw_of(np.round(matrix, 3)) is None


def test_a_wall_is_widened_all_around():
    wall = psw.Wall((-1, -2, -3), (3, -2, -3), (-1, 4, -3), pixels=(400, 300), name="lens")
    head = RigWall(wall, fixed_to="head")
    wide = head.widened(0.1).wall
    np.testing.assert_allclose(wide.lower_left, (-1.4, -2.6, -3))
    np.testing.assert_allclose(wide.lower_right, (3.4, -2.6, -3))
    np.testing.assert_allclose(wide.upper_left, (-1.4, 4.6, -3))
    assert wide.pixels == (480, 360) and wide.name == "lens"
    assert head.widened(0.0) is head
