"""What several tests of trackers need: poses, loops that wait for sockets, and a VRPN server's stream."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from vr_plugin.pose import Pose
from vr_plugin.trackers import Sample
from vr_plugin.trackers import vrpn_wire as wire

TYPES = (wire.POSE, "vrpn_Tracker Velocity", wire.BUTTON, wire.BUTTONS, wire.AXES, wire.PONG)


class Script:
    """A tracker that says what a test wrote down."""

    status = "scripted"

    def __init__(self, *batches):
        self.batches = list(batches)

    def poll(self, now):
        return self.batches.pop(0) if self.batches else []

    def close(self):
        pass


def random_pose(rng: np.random.Generator) -> Pose:
    """Within a few metres, turned at random."""
    return Pose(rng.normal(size=3), rng.normal(size=4))


def assert_pose(actual: Pose, expected: Pose, atol: float = 1e-12) -> None:
    """Same place and same turn; a quaternion and its negative are one."""
    np.testing.assert_allclose(actual.matrix, expected.matrix, atol=atol)


def pose_sample(stamp: float, position: object = (0, 0, 0), sensor: int = 0, turn: object = None) -> Sample:
    """A pose at a time."""
    return Sample(stamp, sensor, Pose(position) if turn is None else Pose(position, turn))


def until(step: Callable[[], bool], seconds: float = 20.0) -> None:
    """Repeat a step that takes no time until it returns true; whatever is awaited comes from this machine."""
    end = time.monotonic() + seconds
    while not step():
        assert time.monotonic() < end, "what was waited for did not come"
        time.sleep(0.001)


def server_stream(poses: list[Pose], device: str = "Tracker0", start: float = 1000.0) -> bytes:
    """What a server says that has poses for two sensors, buttons and axes, and another device besides."""
    parts = [wire.greeting(["VRPN Control", "Other", device], TYPES)]

    def add(kind: str, payload: bytes, seconds: float, sender: int = 2) -> None:
        parts.append(wire.message(sender, TYPES.index(kind), payload, seconds))

    for i, pose in enumerate(poses):
        seconds = start + i / 64
        add(wire.POSE, wire.pose_payload(i % 2, pose), seconds)
        add("vrpn_Tracker Velocity", bytes(72), seconds)
        add(wire.POSE, wire.pose_payload(0, pose), seconds, sender=1)
        if i % 3 == 0:
            add(wire.BUTTON, wire.button_payload(i % 4, i % 2 == 0), seconds)
        if i % 5 == 0:
            add(wire.BUTTONS, wire.buttons_payload([True, False, True]), seconds)
            add(wire.AXES, wire.axes_payload([0.25, -0.5]), seconds)
    return b"".join(parts)
