"""Flights: key views in time, and the camera between them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from persp_sw.errors import PerspSWError

from ..cameras import Camera
from ..pose import Pose, multiply, turn_about

_STEPS = 256  # of the way from key to key, where its length is measured
_INVERSE = np.array([-1.0, -1, -1, 1])


class FlightError(PerspSWError):
    """Key views that make no flight, or a file that holds none."""


class KeyView(NamedTuple):
    """A camera at a time, seconds."""

    seconds: float
    camera: Camera


class Flight:
    """A camera that passes through key views, smoothly.

    The eye follows a cubic through the keys' eyes, whose velocity at a key is that of the parabola through
    it and its neighbours; the orientation a cubic on unit quaternions with angular velocities found alike, by
    the shortest arc from key to key; the logarithms of distance and of tan(fovy / 2) go as the eye does. All
    are continuous with their first derivatives. At a key's time the camera is that key's, bit by bit.

    Parameters
    ----------
    keys
        One or more, their times ascending, 180° or less from one to the next.
    name
        For messages.

    Raises
    ------
    FlightError
        No keys, or times that do not ascend.

    Source: Catmull, Rom 1974 (with unequal times); Kim, Kim, Shin, *A general construction scheme for unit
    quaternion curves with simple high order derivatives*, SIGGRAPH 1995 (cumulative Bernstein basis).
    """

    def __init__(self, keys: Sequence[KeyView], name: str = "the flight"):
        if not keys:
            raise FlightError(f"{name} has no key views; give one or more")
        times = np.array([key.seconds for key in keys], np.float64)
        if not np.isfinite(times).all() or not (np.diff(times) > 0).all():
            raise FlightError(f"{name}: the seconds of its key views must ascend; given {times.tolist()}")
        self.keys, self.name = tuple(KeyView(float(s), camera) for s, camera in keys), name
        self._times = times
        cameras = [key.camera for key in self.keys]
        self._places = np.array(
            [[*c.position, np.log(c.distance), np.log(np.tan(c.fovy / 2))] for c in cameras]
        )
        self._turns = [c.pose.orientation for c in cameras]
        intervals = np.diff(times)
        self._velocities = _velocities(np.diff(self._places, axis=0), intervals)
        arcs = [_log(multiply(a * _INVERSE, b)) for a, b in zip(self._turns, self._turns[1:], strict=False)]
        self._spins = _velocities(np.array(arcs).reshape(-1, 3), intervals)  # in the camera's own axes

    @property
    def duration(self) -> float:
        """Seconds from the first key view to the last."""
        return float(self._times[-1] - self._times[0])

    @property
    def eye_way(self) -> float:
        """Length of the eye's way, world units."""
        return float(self._way[1][-1])

    def at(self, seconds: float) -> Camera:
        """The camera so many seconds after the first key view; before it that, after the last the last."""
        now = self._times[0] + seconds
        i = int(np.searchsorted(self._times, now, side="right")) - 1
        if i < 0 or i >= len(self.keys) - 1 or now == self._times[i]:
            return self.keys[max(i, 0)].camera
        interval = self._times[i + 1] - self._times[i]
        share = (now - self._times[i]) / interval
        place = _hermite(*self._places[i : i + 2], *self._velocities[i : i + 2] * interval, share)
        turn = _turned(*self._turns[i : i + 2], *self._spins[i : i + 2] * interval, share)
        fovy = float(2 * np.arctan(np.exp(place[4])))
        return Camera(Pose(place[:3], turn), float(np.exp(place[3])), fovy)

    def times(self, count: int, *, constant_speed: bool = False) -> NDArray[np.float64]:
        """`count` times from the first key view to the last, seconds after the first.

        Evenly in time; at `constant_speed` evenly along the eye's way instead, so that where the eye rests no
        time is spent. A flight whose eye stays at one place has no speed: evenly in time.
        """
        if count == 1:
            return np.zeros(1)
        shares = np.linspace(0, 1, count)
        if not constant_speed or self.eye_way == 0:
            return shares * self.duration
        times, way = self._way
        moves = np.append(True, np.diff(way) > 0)
        return np.interp(shares * way[-1], way[moves], times[moves])

    @cached_property
    def _way(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Seconds after the first key view, and how far the eye has gone by then."""
        pieces = [
            np.linspace(a, b, _STEPS, endpoint=False)
            for a, b in zip(self._times, self._times[1:], strict=False)
        ]
        times = np.concatenate([*pieces, self._times[-1:]]) - self._times[0]
        eyes = np.array([self.at(seconds).position for seconds in times])
        steps = np.linalg.norm(np.diff(eyes, axis=0), axis=-1)
        return times, np.append(0.0, np.cumsum(steps))


def _velocities(steps: np.ndarray, intervals: np.ndarray) -> np.ndarray:
    """(n, k) velocities at n keys, of (n − 1, k) steps in so many seconds.

    Inside, of the parabola through a key and its neighbours; at the ends such that nothing accelerates there.
    """
    if not len(steps):
        return np.zeros((1, steps.shape[1]))
    h, slopes = intervals[:, None], steps / intervals[:, None]
    if len(steps) == 1:
        return np.repeat(slopes, 2, 0)
    inside = (h[1:] * slopes[:-1] + h[:-1] * slopes[1:]) / (h[1:] + h[:-1])
    return np.concatenate([(3 * slopes[:1] - inside[:1]) / 2, inside, (3 * slopes[-1:] - inside[-1:]) / 2], 0)


def _hermite(a: np.ndarray, b: np.ndarray, va: np.ndarray, vb: np.ndarray, t: float) -> np.ndarray:
    """The cubic from a to b with velocities va and vb, in 0 ≤ t ≤ 1."""
    step = b - a
    return a + t * (va + t * (3 * step - 2 * va - vb + t * (va + vb - 2 * step)))


def _turned(a: np.ndarray, b: np.ndarray, va: np.ndarray, vb: np.ndarray, t: float) -> np.ndarray:
    """The unit quaternion on the way from a to b, with angular velocities in its own axes, in 0 ≤ t ≤ 1."""
    first, last = va / 3, vb / 3
    middle = _log(multiply(_exp(-first), multiply(multiply(a * _INVERSE, b), _exp(-last))))
    basis = (1 - (1 - t) ** 3, t * t * (3 - 2 * t), t**3)
    for part, share in zip((first, middle, last), basis, strict=True):
        a = multiply(a, _exp(share * part))
    return a


def _log(turn: np.ndarray) -> np.ndarray:
    """Axis times angle (≤ π) of a unit quaternion."""
    turn = turn if turn[3] >= 0 else -turn
    sine = np.linalg.norm(turn[:3])
    return 2 * turn[:3] if sine < 1e-9 else turn[:3] * (2 * np.arctan2(sine, turn[3]) / sine)


def _exp(vector: np.ndarray) -> np.ndarray:
    """The unit quaternion that turns about a vector by its length."""
    angle = np.linalg.norm(vector)
    return np.array([0.0, 0, 0, 1]) if angle == 0 else turn_about(vector, angle)
