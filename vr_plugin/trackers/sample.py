"""What every tracker delivers: samples, all on one clock."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from persp_sw.errors import PerspSWError

from ..pose import Pose

KINDS = ("pose", "lost", "buttons", "axes")


class TrackerError(PerspSWError):
    """A tracker that cannot be opened, or a recording or address that cannot be read."""


@dataclass(frozen=True, eq=False)
class Sample:
    """One report of one sensor.

    Attributes
    ----------
    stamp
        Seconds of the clock that is handed to `poll` (`time.monotonic` when live): when it was measured.
    sensor
        Number of the sensor or body; buttons and axes carry the number of the wand they sit on.
    pose
        room_from_sensor, or tracker_from_sensor before calibration; None unless `kind` is "pose".
    kind
        "pose"; "lost": the tracker says that it does not see the sensor; "buttons"; "axes".
    buttons
        State of all buttons, True where pressed.
    axes
        Joysticks and the like, mostly −1 … 1.
    """

    stamp: float
    sensor: int
    pose: Pose | None = None
    kind: str = "pose"
    buttons: tuple[bool, ...] = ()
    axes: tuple[float, ...] = ()


class Tracker(Protocol):
    """Where samples come from. Nothing here ever blocks or raises because of what a network sends."""

    @property
    def status(self) -> str:
        """What it is doing, for people: "connected to host:3883", "waiting for data on …"."""
        ...

    def poll(self, now: float) -> list[Sample]:
        """Samples that came since the last poll, in their order; `now` is the time on the common clock."""
        ...

    def close(self) -> None:
        """Let go of sockets and files; may be called twice."""
        ...


class NoTracker:
    """Tracks nothing."""

    status = "no tracker"

    def poll(self, now: float) -> list[Sample]:
        """Nothing."""
        return []

    def close(self) -> None:
        """Nothing to let go."""
