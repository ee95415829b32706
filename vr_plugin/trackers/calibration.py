"""From a tracker's space to the room."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..pose import Pose, multiply, quaternion_of
from .sample import Sample, Tracker, TrackerError


class Calibrated:
    """A tracker whose samples lie in the room, in metres.

    Parameters
    ----------
    source
        The tracker, closed with this.
    room_from_tracker
        (4, 4) similarity. Positions go through all of it, orientations through its turn.
    latency
        Seconds from measurement to time stamp, taken off the stamps.

    Raises
    ------
    TrackerError
        The matrix shears, scales unevenly (by more than 1e-3), mirrors or is singular.
    """

    def __init__(self, source: Tracker, room_from_tracker: np.ndarray, latency: float = 0.0):
        self.source = source
        self.latency = latency
        self._matrix = np.array(room_from_tracker, np.float64)
        self._turn = _turn_of(self._matrix)

    @property
    def status(self) -> str:
        """The source's."""
        return self.source.status

    def poll(self, now: float) -> list[Sample]:
        """The source's samples, in the room."""
        return [self.in_room(sample) for sample in self.source.poll(now)]

    def close(self) -> None:
        """Close the source."""
        self.source.close()

    def in_room(self, sample: Sample) -> Sample:
        """One sample, calibrated."""
        pose = None
        if sample.pose is not None:
            position = self._matrix[:3, :3] @ sample.pose.position + self._matrix[:3, 3]
            pose = Pose(position, multiply(self._turn, sample.pose.orientation))
        return replace(sample, stamp=sample.stamp - self.latency, pose=pose)


def _turn_of(matrix: np.ndarray) -> np.ndarray:
    """Quaternion of a similarity's turn."""
    if (
        matrix.shape == (4, 4)
        and np.isfinite(matrix).all()
        and np.allclose(matrix[3], (0, 0, 0, 1), atol=1e-9)
    ):
        scale = np.cbrt(np.linalg.det(matrix[:3, :3]))
        rotation = matrix[:3, :3] / scale if scale > 1e-9 else np.zeros((3, 3))
        if np.abs(rotation.T @ rotation - np.eye(3)).max() <= 1e-3:
            return quaternion_of(rotation)
    raise TrackerError(
        "room_from_tracker is a (4, 4) similarity: a turn, one scale above 0 for all axes, a shift. "
        f"Given {matrix.tolist()}"
    )
