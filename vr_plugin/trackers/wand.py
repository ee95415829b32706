"""A wand: grabs, turns, scales and resets the volume, and moves a clip plane. Pure logic on samples."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..pose import Pose, rotation_of, turn_about
from .sample import Sample

# A hand that was not seen for longer takes hold anew: what it did meanwhile is not done to the volume.
_GAP_S = 0.3
_LONGEST_STEP_S = 0.1
_UP = (0.0, 1.0, 0.0)


@dataclass(frozen=True)
class Bindings:
    """Which button and axis does what (counted from 0; None: nothing), and how fast.

    Attributes
    ----------
    grab
        While held the volume moves and turns with the hand.
    clip
        While held the clip plane follows the hand: what is on the hand's side of it goes, what lies in the
        direction that it points to (its −z) stays.
    reset
        Puts the volume back and takes the clip plane away.
    pick
        Asks for what the hand points at.
    scale_axis, scale_rate
        Grows and shrinks about the hand, by exp(rate · axis) a second.
    turn_axis, turn_rate
        Turns about the vertical through the volume's middle, radians a second.
    dead_zone
        Axes nearer to 0 do nothing.
    smallest, largest
        Limits of the scale, beside the one at the start.
    """

    grab: int | None = 0
    clip: int | None = 1
    reset: int | None = 2
    pick: int | None = 3
    scale_axis: int | None = 1
    turn_axis: int | None = 0
    scale_rate: float = 1.0
    turn_rate: float = 1.0
    dead_zone: float = 0.15
    smallest: float = 0.02
    largest: float = 50.0


class Wand:
    """What a hand does to a volume.

    Parameters
    ----------
    room_from_world
        (4, 4) similarity: where the volume stands at first, and after a reset.
    sensor
        The wand's number; samples of others are ignored.
    centre_world
        World point that the turning axis goes through: the volume's middle.

    Attributes
    ----------
    room_from_world
        (4, 4) float64: where the volume stands now.
    clip_plane
        (4,) a, b, c, d in world, (a, b, c) of length 1: shown where a x + b y + c z + d ≥ 0; None: no plane.
    hand
        room_from_hand, or None before it was seen.
    grabbed
        Whether the volume hangs on the hand.
    picks
        How often a pick has been asked for.
    """

    def __init__(
        self,
        room_from_world: np.ndarray,
        sensor: int = 0,
        centre_world: Iterable[float] = (0.0, 0.0, 0.0),
        bindings: Bindings | None = None,
    ):
        self.start = np.array(room_from_world, np.float64)
        self.room_from_world = self.start.copy()
        self.sensor, self.bindings = sensor, bindings or Bindings()
        self.centre_world = np.array(tuple(centre_world), np.float64)
        self.clip_plane: np.ndarray | None = None
        self.hand: Pose | None = None
        self.picks = 0
        self._hand_seen = -math.inf
        self._hand_from_world: np.ndarray | None = None
        self._pressed: tuple[bool, ...] = ()
        self._axes: tuple[float, ...] = ()
        self._time: float | None = None

    @property
    def grabbed(self) -> bool:
        """Whether the volume hangs on the hand."""
        return self._hand_from_world is not None

    @property
    def clip_planes(self) -> tuple[np.ndarray, ...]:
        """The planes to clip with, in world: none or one."""
        return () if self.clip_plane is None else (self.clip_plane,)

    @property
    def ray_in_world(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Where the hand is and where it points to, its −z, in world; None before it was seen."""
        if self.hand is None:
            return None
        world_from_room = np.linalg.inv(self.room_from_world)
        direction = -rotation_of(self.hand.orientation)[:, 2]
        origin = world_from_room[:3, :3] @ self.hand.position + world_from_room[:3, 3]
        return origin, world_from_room[:3, :3] @ direction

    def update(self, samples: Iterable[Sample], now: float) -> bool:
        """Take samples in room space, in their order, and let time go on.

        Returns whether the volume or the plane has moved. The same samples and times move them the same way.
        """
        before = self.room_from_world, self.clip_plane
        for sample in samples:
            if sample.sensor != self.sensor:
                continue
            if sample.kind == "buttons":
                self._press(sample.buttons)
            elif sample.kind == "axes":
                self._axes = sample.axes
            elif sample.pose is not None:
                self._move(sample.pose, sample.stamp)
        self._drive(now)
        return self.room_from_world is not before[0] or self.clip_plane is not before[1]

    def reset(self) -> None:
        """The volume to where it stood at first, out of the hand, and without a clip plane."""
        self.room_from_world, self.clip_plane = self.start.copy(), None
        self._hand_from_world = None

    def _down(self, button: int | None, pressed: tuple[bool, ...]) -> bool:
        return button is not None and button < len(pressed) and pressed[button]

    def _press(self, pressed: tuple[bool, ...]) -> None:
        before, self._pressed = self._pressed, pressed
        keys = self.bindings
        if self._down(keys.reset, pressed) and not self._down(keys.reset, before):
            self.reset()
            return
        if self.hand is None:
            return
        self.picks += self._down(keys.pick, pressed) and not self._down(keys.pick, before)
        if not self._down(keys.grab, pressed):
            self._hand_from_world = None
        elif not self._down(keys.grab, before):
            self._take_hold()
        if self._down(keys.clip, pressed):
            self._place_plane()

    def _move(self, hand: Pose, stamp: float) -> None:
        gone = stamp - self._hand_seen > _GAP_S
        self.hand, self._hand_seen = hand, stamp
        if self.grabbed and gone:
            self._take_hold()
        elif self.grabbed:
            self.room_from_world = hand.matrix @ self._hand_from_world
        if self._down(self.bindings.clip, self._pressed):
            self._place_plane()

    def _take_hold(self) -> None:
        self._hand_from_world = self.hand.inverse().matrix @ self.room_from_world

    def _place_plane(self) -> None:
        normal = -rotation_of(self.hand.orientation)[:, 2]
        room_plane = np.array([*normal, -(normal @ self.hand.position)])
        plane = room_plane @ self.room_from_world  # planes go the other way than points
        self.clip_plane = plane / np.linalg.norm(plane[:3])

    def _drive(self, now: float) -> None:
        step = 0.0 if self._time is None else min(max(now - self._time, 0.0), _LONGEST_STEP_S)
        self._time = now
        keys = self.bindings
        growth, turn = self._axis(keys.scale_axis) * step, self._axis(keys.turn_axis) * step
        if growth and self.hand is not None:
            ratio = _scale(self.room_from_world) / _scale(self.start)
            factor = math.exp(keys.scale_rate * growth)
            factor = min(max(ratio * factor, keys.smallest), keys.largest) / ratio
            self._change(np.eye(3) * factor, self.hand.position)
        if turn:
            middle = self.room_from_world[:3, :3] @ self.centre_world + self.room_from_world[:3, 3]
            self._change(rotation_of(turn_about(_UP, keys.turn_rate * turn)), middle)

    def _change(self, linear: np.ndarray, fixed: np.ndarray) -> None:
        """Apply a linear map about a room point."""
        change = np.eye(4)
        change[:3, :3] = linear
        change[:3, 3] = fixed - linear @ fixed
        self.room_from_world = change @ self.room_from_world
        if self.grabbed:
            self._take_hold()

    def _axis(self, number: int | None) -> float:
        """An axis without its dead zone, −1 … 1."""
        if number is None or number >= len(self._axes):
            return 0.0
        value, dead = min(max(self._axes[number], -1.0), 1.0), self.bindings.dead_zone
        return math.copysign(max(abs(value) - dead, 0.0) / (1 - dead), value)


def _scale(matrix: np.ndarray) -> float:
    return float(np.cbrt(abs(np.linalg.det(matrix[:3, :3]))))
