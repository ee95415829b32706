"""Two eyes from one head."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .pose import Pose
from .rig import Eyes


class EyePair(NamedTuple):
    """Room positions of both eyes, (3,) metres each."""

    left: np.ndarray
    right: np.ndarray

    @property
    def middle(self) -> np.ndarray:
        """What a picture without stereo is seen from."""
        return (self.left + self.right) / 2


def eyes_of_head(room_from_head: Pose, eyes: Eyes) -> EyePair:
    """Where the eyes of a head are; its x axis points to its right ear."""
    half = np.array([eyes.separation / 2, 0.0, 0.0])
    middle = np.asarray(eyes.offset, np.float64)
    return EyePair(room_from_head.apply(middle - half), room_from_head.apply(middle + half))


def before_wall(eye: np.ndarray, corners: np.ndarray) -> bool:
    """Whether an eye is on the side of a wall from which it is meant to be seen.

    corners: lower left, lower right, upper right, upper left, as seen from there.
    """
    lower_left, lower_right, _, upper_left = corners
    outward = np.cross(lower_right - lower_left, upper_left - lower_left)
    return bool(outward @ (np.asarray(eye) - lower_left) > 0)
