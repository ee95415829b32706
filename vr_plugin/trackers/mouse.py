"""Keyboard and mouse as a tracker: a head that walks and looks about, and a wand in front of it."""

from __future__ import annotations

import numpy as np

from ..pose import Pose, multiply, rotation_of, turn_about
from .sample import Sample

# Key -> direction in the head's own axes, of which only the turn about the vertical counts.
WALK = {
    "w": (0, 0, -1), "s": (0, 0, 1), "a": (-1, 0, 0), "d": (1, 0, 0), "e": (0, 1, 0), "q": (0, -1, 0),
    "up": (0, 0, -1), "down": (0, 0, 1), "left": (-1, 0, 0), "right": (1, 0, 0),
}  # fmt: skip
RESET_KEY = "r"
FAST_KEY = "shift"
WAND_KEY = "ctrl"
SPEED_M_S = 0.8
FAST = 3.0
RADIANS_PER_PIXEL = 0.004
METRES_PER_PIXEL = 0.003
METRES_PER_NOTCH = 0.1
STEEPEST = np.deg2rad(89.0)
# In the head's axes, where a hand rests: half an arm ahead, to the right and below.
HAND_AT = (0.2, -0.25, -0.5)
_LONGEST_STEP_S = 0.1


class MouseTracker:
    """A tracker fed with a window's events. In room space already; poses at every poll.

    Dragging turns the head; with the right button it shifts the head sideways and up. The wheel and W, S go
    forward and back, A, D sideways, Q, E down and up; Shift is faster; R goes back to the rest pose. While
    Ctrl is held the mouse moves the wand instead (the wheel: away and towards the head), and its buttons
    left, right, middle are the wand's 0, 1, 2.

    Parameters
    ----------
    rest_pose
        room_from_head at first.
    head, wand
        Sensor numbers; wand None: there is none.
    """

    status = "keyboard and mouse"

    def __init__(self, rest_pose: Pose | None = None, head: int = 0, wand: int | None = None):
        self.rest_pose = rest_pose if rest_pose is not None else Pose((0.0, 1.7, 0.0))
        self.head, self.wand = head, wand
        self._keys: set[str] = set()
        self._buttons: set[int] = set()
        self._pressed: list[tuple[bool, ...]] = []  # changes of the wand's buttons since the last poll
        self._time: float | None = None
        self._reset()

    def key(self, name: str, down: bool) -> None:
        """A key went down or up: a letter or digit in lower case, or "up", "shift", "ctrl" and so on."""
        if down:
            self._keys.add(name)
            if name == RESET_KEY:
                self._reset()
        else:
            self._keys.discard(name)

    def button(self, number: int, down: bool) -> None:
        """A mouse button went down or up; 0 left, 1 right, 2 middle. Ctrl and it are the wand's."""
        if down:
            self._buttons.add(number)
        else:
            self._buttons.discard(number)
        if self.wand is not None and 0 <= number < 3 and (self._for_wand or not down):
            states = list(self._wand_states)
            states[number] = down
            if tuple(states) != self._wand_states:
                self._wand_states = tuple(states)
                self._pressed.append(self._wand_states)

    def move(self, right: float, down: float) -> None:
        """The mouse moved, in pixels."""
        if self._for_wand:
            self._hand += METRES_PER_PIXEL * np.array([right, -down, 0.0])
        elif 0 in self._buttons:
            self._yaw -= RADIANS_PER_PIXEL * right
            self._pitch = float(np.clip(self._pitch - RADIANS_PER_PIXEL * down, -STEEPEST, STEEPEST))
        elif 1 in self._buttons:
            self._walk(METRES_PER_PIXEL * np.array([right, -down, 0.0]))

    def scroll(self, notches: float) -> None:
        """The wheel turned; away from the user is above 0."""
        way = np.array([0.0, 0.0, -METRES_PER_NOTCH * notches])
        if self._for_wand:
            self._hand += way
        else:
            self._walk(way)

    def poll(self, now: float) -> list[Sample]:
        """Where head and wand are now, and what the wand's buttons did."""
        step = 0.0 if self._time is None else min(max(now - self._time, 0.0), _LONGEST_STEP_S)
        self._time = now
        way = sum((np.array(WALK[key], float) for key in sorted(self._keys & WALK.keys())), np.zeros(3))
        if step and way.any():
            self._walk(way / np.linalg.norm(way) * step * SPEED_M_S * (FAST if FAST_KEY in self._keys else 1))
        head = self._pose
        samples = [Sample(now, self.head, head)]
        if self.wand is not None:
            samples.append(Sample(now, self.wand, Pose(head.apply(self._hand), head.orientation)))
            samples += [Sample(now, self.wand, kind="buttons", buttons=states) for states in self._pressed]
        self._pressed.clear()
        return samples

    def close(self) -> None:
        """Nothing to let go."""

    @property
    def _for_wand(self) -> bool:
        return self.wand is not None and WAND_KEY in self._keys

    @property
    def _pose(self) -> Pose:
        turn = multiply(turn_about((0, 1, 0), self._yaw), turn_about((1, 0, 0), self._pitch))
        return Pose(self._position, multiply(turn, self._base))

    def _reset(self) -> None:
        # Yaw and pitch of the rest pose are taken on; a tilted head stays tilted.
        forward = -rotation_of(self.rest_pose.orientation)[:, 2]
        self._yaw = float(np.arctan2(-forward[0], -forward[2]))
        self._pitch = float(np.arcsin(np.clip(forward[1], -1.0, 1.0)))
        looking = multiply(turn_about((0, 1, 0), self._yaw), turn_about((1, 0, 0), self._pitch))
        self._base = multiply(looking * (-1, -1, -1, 1), self.rest_pose.orientation)
        self._position = self.rest_pose.position.copy()
        self._hand = np.array(HAND_AT)
        self._wand_states = (False, False, False)

    def _walk(self, way: np.ndarray) -> None:
        self._position = self._position + rotation_of(turn_about((0, 1, 0), self._yaw)) @ way
