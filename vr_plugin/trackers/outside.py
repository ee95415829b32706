"""Eyes that stand where no wall is meant to be seen from."""

from __future__ import annotations

import logging
from collections.abc import Iterable

import numpy as np

_log = logging.getLogger("persp_sw")

# Walls whose box is at least this deep, beside its longest edge, enclose a room; flatter, they are a screen.
ROOM_DEPTH = 0.5


def is_outside(eye: np.ndarray, corners: np.ndarray) -> bool:
    """Whether an eye is behind a wall, or outside the box around walls that make a room.

    Parameters
    ----------
    eye
        (3,) room metres.
    corners
        (walls, 4, 3) as `Rig.corners`.

    A single screen, flat or slightly bent, has no box to be in: only what is behind it is outside.
    """
    return _Inside(np.asarray(corners, np.float64)).is_outside(np.asarray(eye, np.float64))


class _Inside:
    """Half-spaces before all walls, and the box of a room, found once."""

    def __init__(self, corners: np.ndarray):
        lower_left, lower_right, upper_left = corners[:, 0], corners[:, 1], corners[:, 3]
        self.normals = np.cross(lower_right - lower_left, upper_left - lower_left)
        self.offsets = (self.normals * lower_left).sum(1)
        self.low, self.high = corners.reshape(-1, 3).min(0), corners.reshape(-1, 3).max(0)
        size = self.high - self.low
        self.is_room = size.min() >= ROOM_DEPTH * size.max()

    def is_outside(self, eye: np.ndarray) -> bool:
        if (self.normals @ eye <= self.offsets).any():
            return True
        return bool(self.is_room and ((eye < self.low) | (eye > self.high)).any())


class OutsideWatch:
    """Counts frames with an eye outside the walls, and says so once each time it begins.

    Attributes
    ----------
    frames
        How many frames had an eye outside.
    """

    def __init__(self, corners: np.ndarray):
        self.corners = np.asarray(corners, np.float64)
        self._inside = _Inside(self.corners)
        self.frames = 0
        self._outside = False

    def look(self, eyes: Iterable[np.ndarray]) -> bool:
        """Whether an eye of this frame is outside; counted, and said where none was in the frame before."""
        eyes = list(eyes)
        outside = [eye for eye in eyes if self._inside.is_outside(np.asarray(eye))]
        self.frames += bool(outside)
        if outside and not self._outside:
            _log.warning(
                "an eye is outside the walls, at (%.2f, %.2f, %.2f) m; check room_from_tracker of the rig",
                *outside[0],
            )
        self._outside = bool(outside)
        return self._outside
