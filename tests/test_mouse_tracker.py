"""Keyboard and mouse as a tracker, from a window's events and from a terminal's bytes."""

from __future__ import annotations

import numpy as np
import pytest
from tracker_samples import assert_pose, random_pose

from vr_plugin.pose import Pose, multiply, rotation_of, turn_about
from vr_plugin.trackers import MouseTracker
from vr_plugin.trackers.mouse import FAST, HAND_AT, METRES_PER_PIXEL, RADIANS_PER_PIXEL, SPEED_M_S
from vr_plugin.trackers.terminal import HELD_S, TerminalEvents


def head_of(tracker: MouseTracker, now: float = 0.0) -> Pose:
    return tracker.poll(now)[0].pose


def forward(pose: Pose) -> np.ndarray:
    return -rotation_of(pose.orientation)[:, 2]


def test_it_begins_at_rest(rng):
    for rest in (Pose((1, 2, 3)), *(random_pose(rng) for _ in range(20))):
        assert_pose(head_of(MouseTracker(rest)), rest)


def test_dragging_looks_where_the_mouse_goes():
    tracker = MouseTracker()
    tracker.move(500, 300)  # no button: nothing
    assert_pose(head_of(tracker), tracker.rest_pose)
    tracker.button(0, True)
    tracker.move(100, -50)
    yaw, pitch = -100 * RADIANS_PER_PIXEL, 50 * RADIANS_PER_PIXEL
    expected = multiply(turn_about((0, 1, 0), yaw), turn_about((1, 0, 0), pitch))
    assert_pose(head_of(tracker), Pose(tracker.rest_pose.position, expected))
    looking = forward(head_of(tracker))
    assert looking[0] > 0  # to the right
    assert looking[1] > 0  # and up
    tracker.move(0, -(10**6))
    assert forward(head_of(tracker))[1] < 1  # never over
    tracker.button(0, False)
    tracker.move(100, 100)
    assert forward(head_of(tracker))[1] == pytest.approx(np.sin(np.deg2rad(89)))


def test_walking_goes_where_it_looks_at_a_steady_speed():
    for rate in (30, 200):
        tracker = MouseTracker(Pose((0, 1.7, 0), turn_about((0, 1, 0), np.pi / 2)))  # looks along −x
        tracker.poll(0.0)
        tracker.key("w", True)
        for i in range(1, rate + 1):
            pose = head_of(tracker, i / rate)
        np.testing.assert_allclose(pose.position, (-SPEED_M_S, 1.7, 0), atol=1e-12)
        tracker.key("w", False)
        tracker.key("e", True)
        tracker.key("shift", True)
        for i in range(rate + 1, 2 * rate + 1):
            pose = head_of(tracker, i / rate)
        np.testing.assert_allclose(pose.position, (-SPEED_M_S, 1.7 + FAST * SPEED_M_S, 0), atol=1e-12)


def test_a_pause_is_no_leap_and_diagonals_are_not_faster():
    tracker = MouseTracker()
    tracker.poll(0.0)
    tracker.key("w", True)
    tracker.key("d", True)
    way = head_of(tracker, 1000.0).position - tracker.rest_pose.position
    assert np.linalg.norm(way) == pytest.approx(0.1 * SPEED_M_S)


def test_the_right_button_shifts_and_r_goes_back():
    tracker = MouseTracker()
    tracker.button(1, True)
    tracker.move(10, -20)
    tracker.scroll(2)
    moved = head_of(tracker).position - tracker.rest_pose.position
    np.testing.assert_allclose(moved, (10 * METRES_PER_PIXEL, 20 * METRES_PER_PIXEL, -0.2))
    tracker.key("r", True)
    assert_pose(head_of(tracker), tracker.rest_pose)


def test_ctrl_moves_the_wand_and_the_mouse_presses_its_buttons():
    tracker = MouseTracker(wand=3)
    rest = tracker.poll(0.0)
    assert [(s.sensor, s.kind) for s in rest] == [(0, "pose"), (3, "pose")]
    np.testing.assert_allclose(rest[1].pose.position, tracker.rest_pose.apply(HAND_AT))
    tracker.key("ctrl", True)
    tracker.button(0, True)
    tracker.move(100, 0)
    tracker.button(2, True)
    tracker.button(0, False)
    head, wand, *pressed = tracker.poll(0.1)
    assert_pose(head.pose, tracker.rest_pose)
    shift = wand.pose.position - rest[1].pose.position
    np.testing.assert_allclose(shift, (100 * METRES_PER_PIXEL, 0, 0), atol=1e-12)
    assert [s.buttons for s in pressed] == [(True, False, False), (True, False, True), (False, False, True)]
    tracker.key("ctrl", False)
    tracker.button(2, False)  # a release counts without Ctrl, or the button would stick
    assert [s.buttons for s in tracker.poll(0.2)[2:]] == [(False, False, False)]
    tracker.button(0, True)
    assert len(tracker.poll(0.3)) == 2


def test_the_same_events_give_the_same_poses():
    def run() -> np.ndarray:
        tracker, rng = MouseTracker(), np.random.default_rng(5)
        found = []
        for i in range(200):
            tracker.button(int(rng.integers(0, 2)), bool(rng.integers(0, 2)))
            tracker.key(str(rng.choice(list("wasdeq"))), bool(rng.integers(0, 2)))
            tracker.move(*rng.normal(0, 20, 2))
            found.append(head_of(tracker, i / 60).matrix)
        return np.array(found)

    np.testing.assert_array_equal(run(), run())


# --- from a terminal ---------------------------------------------------------------------------------------


def test_keys_of_a_terminal_are_held_a_moment():
    tracker = MouseTracker()
    terminal = TerminalEvents(tracker)
    terminal.feed(b"w\x1b[A", 0.0)
    tracker.poll(0.0)
    tracker.poll(0.1)
    there = head_of(tracker, 0.15).position
    assert there[2] == pytest.approx(-0.15 * SPEED_M_S)
    terminal.feed(b"", HELD_S + 0.01)
    assert head_of(tracker, 1.0).position[2] == there[2]


def test_the_mouse_of_a_terminal_drags_in_whatever_pieces():
    def position(pieces: list[bytes]) -> Pose:
        tracker = MouseTracker()
        terminal = TerminalEvents(tracker)
        for piece in pieces:
            terminal.feed(piece, 0.0)
        return head_of(tracker)

    drag = b"\x1b[<0;10;10M\x1b[<32;15;8M\x1b[<0;15;8m\x1b[<35;30;30M\x1b[<64;15;8Mx"
    whole = position([drag])
    assert forward(whole)[0] == pytest.approx(np.sin(40 * RADIANS_PER_PIXEL) * np.cos(32 * RADIANS_PER_PIXEL))
    assert whole.position[2] < 0  # the wheel goes forward
    assert_pose(position([bytes([b]) for b in drag]), whole)


def test_ctrl_in_a_terminal_is_the_wands():
    tracker = MouseTracker(wand=1)
    TerminalEvents(tracker).feed(b"\x1b[<16;10;10M\x1b[<18;10;10M\x1b[<16;10;10m", 0.0)
    states = [s.buttons for s in tracker.poll(0.0) if s.kind == "buttons"]
    assert states == [(True, False, False), (True, True, False), (False, True, False)]


def test_a_terminal_can_say_anything(rng):
    tracker = MouseTracker(wand=1)
    terminal = TerminalEvents(tracker)
    alphabet = np.frombuffer(b"\x1b[<0123456789;Mmwasdq\xff\x00ABZO", np.uint8)
    for i in range(2000):
        terminal.feed(rng.choice(alphabet, rng.integers(0, 40)).tobytes(), i / 60)
        assert np.isfinite(head_of(tracker, i / 60).position).all()
