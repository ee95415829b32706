"""From a rig's [tracker] to samples in the room; eyes outside the walls."""

from __future__ import annotations

import logging
from types import SimpleNamespace

import numpy as np
import pytest
from tracker_samples import assert_pose, random_pose, until

import persp_sw as psw
from vr_plugin.pose import Pose
from vr_plugin.rig import Rig, RigWall, TrackerPlace
from vr_plugin.trackers import (
    Calibrated,
    HeadFilter,
    MouseTracker,
    NoTracker,
    OutsideWatch,
    Sample,
    TrackerError,
    is_outside,
    open_tracker,
    place_of,
    vrpn_server,
    wand_sensor,
)
from vr_plugin.trackers.addresses import dtrack_address, vrpn_address
from vr_plugin.trackers.dtrack_samples import FLYSTICK
from vr_plugin.trackers.vrpn_server import VrpnServer

PATH = "t,x,y,z,qx,qy,qz,qw\n0,1,2,3,0,0,0,1\n0.5,2,2,3,0,0,0,1\n"


class Replay:
    """Says the same at every poll."""

    status = "here"

    def __init__(self, *samples: Sample):
        self.samples, self.closed = list(samples), False

    def poll(self, now: float) -> list[Sample]:
        return self.samples

    def close(self) -> None:
        self.closed = True


# --- calibration -------------------------------------------------------------------------------------------


def test_positions_go_through_the_similarity_and_turns_through_its_turn(rng):
    for _ in range(20):
        turn, sensor, scale = random_pose(rng), random_pose(rng), rng.uniform(0.001, 10)
        matrix = turn.matrix
        matrix[:3, :3] *= scale
        (sample,) = Calibrated(Replay(Sample(5.0, 2, sensor)), matrix, latency=0.03).poll(9.0)
        expected = turn.matrix[:3, :3] @ (scale * sensor.position) + turn.position
        np.testing.assert_allclose(sample.pose.position, expected, atol=1e-12)
        both = turn.matrix[:3, :3] @ sensor.matrix[:3, :3]
        np.testing.assert_allclose(sample.pose.matrix[:3, :3], both, atol=1e-12)
        assert (sample.stamp, sample.sensor) == (4.97, 2)


def test_buttons_pass_through_and_the_source_is_closed():
    replay = Replay(Sample(5.0, 2, kind="buttons", buttons=(True,)))
    tracker = Calibrated(replay, np.eye(4))
    assert tracker.poll(6.0)[0].buttons == (True,)
    assert tracker.status == "here"
    tracker.close()
    assert replay.closed


@pytest.mark.parametrize(
    "matrix",
    [
        np.diag([1.0, 1, 2, 1]),
        np.diag([1.0, 1, -1, 1]),
        np.zeros((4, 4)),
        np.full((4, 4), np.nan),
        np.eye(3),
        np.eye(4)[:, ::-1],
    ],
)
def test_what_is_no_similarity_is_refused(matrix):
    with pytest.raises(TrackerError, match=r"similarity.* Given"):
        Calibrated(Replay(), matrix)


# --- addresses ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "devices", "host", "port"),
    [
        ("Tracker0@cave", ("Tracker0",), "cave", 3883),
        ("Tracker0@cave:3884", ("Tracker0",), "cave", 3884),
        ("Head, Wand0@tcp://10.0.0.7:4000", ("Head", "Wand0"), "10.0.0.7", 4000),
        ("A,A@:5", ("A",), "127.0.0.1", 5),
        ("T@[::1]:3883", ("T",), "::1", 3883),
        ("T@[::1]", ("T",), "::1", 3883),
    ],
)
def test_vrpn_addresses(text, devices, host, port):
    assert vrpn_address(text) == (devices, host, port)
    assert place_of(text).kind == "vrpn"


@pytest.mark.parametrize(
    ("text", "address", "port"),
    [
        ("dtrack", "127.0.0.1", 5000),
        ("dtrack:5001", "127.0.0.1", 5001),
        ("dtrack:0.0.0.0:5000", "0.0.0.0", 5000),
        ("udp://5000", "127.0.0.1", 5000),
        ("udp://192.168.0.3:5002", "192.168.0.3", 5002),
    ],
)
def test_dtrack_addresses(text, address, port):
    assert dtrack_address(text) == (address, port)
    assert place_of(text).kind == "dtrack"


@pytest.mark.parametrize(
    "text",
    ["", "cave:3883", "@cave", "T@", "T@cave:x", "T@cave:99999", "dtrack:5:x", "x" * 100 + "@c", "path.txt"],
)
def test_addresses_that_are_none_are_said(text):
    with pytest.raises(TrackerError, match=r"written|write|no port"):
        place_of(text)


# --- opening -----------------------------------------------------------------------------------------------


def test_a_path_is_found_beside_the_rig_and_calibrated(tmp_path):
    (tmp_path / "walk.csv").write_text(PATH)
    matrix = np.diag([2.0, 2, 2, 1])
    place = TrackerPlace("path", "walk.csv", head=3, room_from_tracker=matrix)
    tracker = open_tracker(place, folder=tmp_path, end="hold")
    first = tracker.poll(10.0)
    assert [(s.sensor, s.pose.position.tolist()) for s in first] == [(3, [2, 4, 6])]
    assert "hold" in tracker.status
    with pytest.raises(TrackerError, match="similarity"):
        open_tracker(TrackerPlace("path", "walk.csv", room_from_tracker=np.zeros((4, 4))), folder=tmp_path)


def test_every_kind_opens(tmp_path):
    assert isinstance(open_tracker(TrackerPlace()), NoTracker)
    assert open_tracker(TrackerPlace()).poll(0.0) == []
    rest = Pose((5, 5, 5))
    mouse = open_tracker(TrackerPlace("mouse", head=2, wand=4), rest_pose=rest)
    assert isinstance(mouse, MouseTracker)
    assert [s.sensor for s in mouse.poll(0.0)] == [2, 4]
    assert_pose(mouse.poll(0.0)[0].pose, rest)
    listening = open_tracker(TrackerPlace("dtrack", "udp://127.0.0.1:0"))
    assert "127.0.0.1" in listening.status
    listening.close()
    with pytest.raises(TrackerError, match="kind 'magic'"):
        open_tracker(TrackerPlace("magic"))


def test_a_vrpn_tracker_of_a_rig_hands_on_room_poses():
    server = VrpnServer("Wand", port=0)
    matrix = Pose((0, 1, 0)).matrix
    place = TrackerPlace("vrpn", f"Wand@127.0.0.1:{server.port}", 0, 1, matrix)
    tracker = open_tracker(place)
    found: list[Sample] = []

    def step() -> bool:
        server.send([Sample(0.0, 1, Pose((1, 1, 1))), Sample(0.0, 1, None, "buttons", (True,))], 0.0)
        found.extend(tracker.poll(0.0))
        return len(found) >= 2

    until(step)
    assert found[0].pose.position.tolist() == [1, 2, 1]
    assert (found[1].sensor, found[1].buttons) == (wand_sensor(place), (True,))
    tracker.close()
    server.close()


def test_a_tracker_that_dies_in_mid_run_is_outlived_and_found_again(caplog, monkeypatch):
    # Frames are counted, not timed: the server's time of day goes with them.
    monkeypatch.setattr(vrpn_server, "time", SimpleNamespace(time=lambda: 1.7e9 + now))
    server = VrpnServer("Head", port=0)
    port, there, rest = server.port, Pose((0.4, 1.6, 0.3)), Pose((0, 1.7, 1))
    tracker = open_tracker(TrackerPlace("vrpn", f"Head@127.0.0.1:{port}"))
    head, shown, now = HeadFilter(rest), [], 0.0

    def frame(server: VrpnServer | None) -> None:
        """One frame of 1/60 s; with a server, one in which its sample has come."""
        nonlocal now
        now += 1 / 60

        def step() -> bool:
            if server is None:
                head.add(tracker.poll(now))
                return True
            server.send([Sample(now, 0, there)], now)
            samples = tracker.poll(now)
            head.add(samples)
            return bool(samples) or not tracker.status.startswith("connected")

        until(step)
        shown.append(head.pose_at(now))

    for _ in range(600):
        frame(server)
    assert_pose(shown[-1], there)
    server.close()
    for _ in range(300):
        frame(None)
    assert_pose(shown[-1], rest)
    server = VrpnServer("Head", port=port)
    for _ in range(900):  # the next attempt to connect may be 8 s away
        frame(server)
    assert_pose(shown[-1], there)
    # From the first real pose on the eyes never jump: a way of 0.81 m takes 1.5 or 0.3 s.
    first = next(i for i, pose in enumerate(shown) if pose.position[0] == 0.4)
    steps = np.linalg.norm(np.diff([pose.position for pose in shown[first:]], axis=0), axis=1)
    assert steps.max() < 1.6 * 0.82 / 0.3 / 60
    said = [record.getMessage() for record in caplog.records]
    assert len(said) == 4
    assert [any(word in line for line in said) for word in ("trying again", "rest pose")] == [True, True]
    assert sum(line.endswith("back") for line in said) == 2
    tracker.close()
    server.close()


def test_flysticks_are_wands_of_their_own():
    assert wand_sensor(TrackerPlace("dtrack", "", 0, 2)) == FLYSTICK + 2
    assert wand_sensor(TrackerPlace("vrpn", "", 0, 2)) == 2
    assert wand_sensor(TrackerPlace("vrpn")) is None


# --- walls -------------------------------------------------------------------------------------------------


def wall(name: str, *corners: object) -> RigWall:
    return RigWall(psw.Wall(*corners, pixels=(64, 64), name=name))


FRONT = wall("front", (-1.5, 0, -1.5), (1.5, 0, -1.5), (-1.5, 2.5, -1.5))
LEFT = wall("left", (-1.5, 0, 1.5), (-1.5, 0, -1.5), (-1.5, 2.5, 1.5))
RIGHT = wall("right", (1.5, 0, -1.5), (1.5, 0, 1.5), (1.5, 2.5, -1.5))
FLOOR = wall("floor", (-1.5, 0, 1.5), (1.5, 0, 1.5), (-1.5, 0, -1.5))


def test_an_eye_is_outside_a_cave_behind_walls_above_and_through_the_open_back():
    corners = Rig([LEFT, FRONT, RIGHT, FLOOR]).corners
    for eye in ((0, 1.7, 0), (1.49, 0.01, -1.49), (-1.4, 2.4, 1.4)):
        assert not is_outside(np.array(eye), corners)
    for eye in ((0, -0.1, 0), (0, 2.6, 0), (0, 1.7, -1.6), (1.6, 1, 0), (-1.6, 1, 0), (0, 1.7, 1.6)):
        assert is_outside(np.array(eye), corners)


def test_before_a_single_screen_nobody_is_outside_but_behind_it():
    corners = Rig([FRONT]).corners
    assert not is_outside(np.array((4.0, 1.0, 3.0)), corners)
    assert is_outside(np.array((0.0, 1.0, -1.51)), corners)


def test_frames_outside_are_counted_and_said_when_they_begin(caplog):
    watch = OutsideWatch(Rig([LEFT, FRONT, RIGHT, FLOOR]).corners)
    inside, outside = np.array((0, 1.7, 0)), np.array((0, -0.5, 0))
    with caplog.at_level(logging.WARNING, "persp_sw"):
        answers = [
            watch.look(eyes) for eyes in [(inside, inside), (inside, outside)] * 2 + [(outside, outside)]
        ]
    assert answers == [False, True, False, True, True]
    assert watch.frames == 3
    assert len(caplog.records) == 2
    assert "(0.00, -0.50, 0.00)" in caplog.text
    assert "room_from_tracker" in caplog.text
