"""Eyes that stand where no wall is meant to be seen from."""

from __future__ import annotations

import logging
from collections.abc import Iterable

import numpy as np

from ..eyes import before_wall

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
    eye = np.asarray(eye, np.float64)
    if not all(before_wall(eye, wall) for wall in corners):
        return True
    low, high = corners.reshape(-1, 3).min(0), corners.reshape(-1, 3).max(0)
    if (high - low).min() < ROOM_DEPTH * (high - low).max():
        return False
    return bool((eye < low).any() or (eye > high).any())


class OutsideWatch:
    """Counts frames with an eye outside the walls, and says so once each time it begins.

    Attributes
    ----------
    frames
        How many frames had an eye outside.
    """

    def __init__(self, corners: np.ndarray):
        self.corners = np.asarray(corners, np.float64)
        self.frames = 0
        self._outside = False

    def look(self, eyes: Iterable[np.ndarray]) -> bool:
        """Whether an eye of this frame is outside; counted, and said where none was in the frame before."""
        eyes = list(eyes)
        outside = [eye for eye in eyes if is_outside(eye, self.corners)]
        self.frames += bool(outside)
        if outside and not self._outside:
            _log.warning(
                "an eye is outside the walls, at (%.2f, %.2f, %.2f) m; check room_from_tracker of the rig",
                *outside[0],
            )
        self._outside = bool(outside)
        return self._outside
