"""A camera's way, recorded as a flight of few key views, and flown again."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ..cameras import Camera
from ..film.flight import Flight, KeyView
from .navigation import Navigator

SAMPLE_SECONDS = 0.1
# What leaving out key views may change: the eye by this part of its distance from the pivot, angles by so
# many radians: about a pixel of a window.
TOLERANCE = 0.002


class Flights:
    """The flight that a preview's camera follows, and those that its user records.

    Parameters
    ----------
    flight
        To be followed from the start; None: none.

    Attributes
    ----------
    flown
        Recorded and ended.
    """

    def __init__(self, flight: Flight | None = None):
        self.flown: list[Flight] = []
        self._flying = None if flight is None else Flying(flight)
        self._log: FlightLog | None = None
        self._log_seconds = 0.0

    def advance(self, seconds: float, hand: Navigator) -> bool:
        """Move the camera on, unless a hand has taken it, and record it; whether it flies."""
        flying = self._flying is not None and self._flying.is_on
        if flying and not hand.at_rest:
            self._flying.switch()
            flying = False
        if flying:
            hand.camera = self._flying.advance(seconds)
        if self._log is not None:
            self._log_seconds += seconds
            self._log.see(self._log_seconds, hand.camera)
        return flying

    def switch(self) -> None:
        """Halt the flight, or go on with it."""
        if self._flying is not None:
            self._flying.switch()

    @property
    def is_recording(self) -> bool:
        """Whether a flight is being recorded."""
        return self._log is not None

    def record(self) -> str:
        """Begin to record, or end it; what there is to be said."""
        if self._log is None:
            self._log = FlightLog()
            return "recording a flight: F9 ends it"
        flight, self._log = self._log.finished(), None
        if flight is None:
            return "no flight: no time has passed"
        self.flown.append(flight)
        return ""


class FlightLog:
    """Takes a camera at times that ascend, and keeps ten a second."""

    def __init__(self):
        self._keys: list[KeyView] = []
        self._last: KeyView | None = None

    def see(self, seconds: float, camera: Camera) -> None:
        """The camera is here now."""
        self._last = KeyView(seconds, camera)
        if not self._keys or seconds >= self._keys[-1].seconds + SAMPLE_SECONDS * (1 - 1e-6):
            self._keys.append(self._last)

    def finished(self) -> Flight | None:
        """The flight, from second 0; None where no time has passed."""
        if self._last is None:
            return None
        keys = list(self._keys)
        if self._last.seconds > keys[-1].seconds:
            keys.append(self._last)
        if len(keys) < 2:
            return None
        start = keys[0].seconds
        return simplified(Flight([KeyView(key.seconds - start, key.camera) for key in keys]))


def simplified(flight: Flight, tolerance: float = TOLERANCE) -> Flight:
    """A flight with fewer of the key views, which passes all of them within `tolerance`; see `TOLERANCE`."""
    keys = flight.keys
    kept = [0, len(keys) - 1]
    while True:
        fewer = Flight([keys[place] for place in kept], flight.name)
        start = keys[0].seconds
        errors = [_apart(fewer.at(key.seconds - start), key.camera) for key in keys]
        more = []
        for low, high in pairwise(kept):
            between = range(low + 1, high)
            worst = max(between, key=errors.__getitem__, default=None)
            if worst is not None and errors[worst] > tolerance:
                more.append(worst)
        if not more:
            return fewer
        kept = sorted(kept + more)


class Flying:
    """A flight under way; the time it has flown is counted here.

    Attributes
    ----------
    is_on
        Whether it moves.
    """

    def __init__(self, flight: Flight):
        self.flight, self.is_on = flight, True
        self._seconds = 0.0

    def advance(self, seconds: float) -> Camera:
        """The camera after so much more time; at the end it stops."""
        camera = self.flight.at(self._seconds)
        if self._seconds >= self.flight.duration:
            self.is_on = False
        self._seconds = min(self._seconds + seconds, self.flight.duration)
        return camera

    def switch(self) -> None:
        """Off, or on again: where it was, or from the start if it was at the end."""
        if not self.is_on and self._seconds >= self.flight.duration:
            self._seconds = 0.0
        self.is_on = not self.is_on


def _apart(a: Camera, b: Camera) -> float:
    """How far two cameras are from looking the same."""
    shift = np.linalg.norm(a.position - b.position) / b.distance
    turn = 2 * np.arccos(min(abs(float(a.pose.orientation @ b.pose.orientation)), 1.0))
    return max(shift, turn, abs(np.log(a.distance / b.distance)), abs(a.fovy - b.fovy))
