"""Poses: where something is and how it is turned."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from persp_sw.errors import PerspSWError

Vector = np.ndarray  # (3,) float64, xyz


class PoseError(PerspSWError):
    """Numbers that are no pose."""


@dataclass(frozen=True, eq=False)
class Pose:
    """A rigid motion: `target_from_source` by a turn, then a shift.

    Parameters
    ----------
    position
        xyz of the source's origin in the target.
    orientation
        Unit quaternion x, y, z, w; kept normalised.

    Raises
    ------
    PoseError
        Not 3 and 4 finite numbers, or a quaternion of length 0.
    """

    position: Vector = field(default_factory=lambda: np.zeros(3))
    orientation: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 0.0, 1.0]))

    def __post_init__(self):
        position, turn = (
            np.array(v, np.float64, copy=True).reshape(-1) for v in (self.position, self.orientation)
        )
        if position.shape != (3,) or turn.shape != (4,) or not np.isfinite([*position, *turn]).all():
            raise PoseError(
                f"a pose is 3 finite numbers and a quaternion of 4; given {self.position}, {self.orientation}"
            )
        length = np.linalg.norm(turn)
        if not length > 1e-9:
            raise PoseError(f"a quaternion has a length above 0; given {self.orientation}")
        object.__setattr__(self, "position", position)
        if abs(length - 1) > 1e-12:  # a unit quaternion keeps its bits
            turn = turn / length
        object.__setattr__(self, "orientation", turn)

    @classmethod
    def from_matrix(cls, matrix: np.ndarray) -> Pose:
        """The pose of a rigid (4, 4) matrix; one that is not rigid to 1e-3 is refused (PoseError)."""
        matrix = np.asarray(matrix, np.float64)
        if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
            raise PoseError(f"a pose's matrix is (4, 4) and finite; given {matrix!r}")
        r = matrix[:3, :3]
        if np.abs(r.T @ r - np.eye(3)).max() > 1e-3 or np.linalg.det(r) < 0:
            raise PoseError("a pose's matrix must turn without scaling, shearing or mirroring")
        return cls(matrix[:3, 3], quaternion_of(r))

    @property
    def matrix(self) -> np.ndarray:
        """(4, 4) float64, column vectors."""
        matrix = np.eye(4)
        matrix[:3, :3] = rotation_of(self.orientation)
        matrix[:3, 3] = self.position
        return matrix

    def __matmul__(self, other: Pose) -> Pose:
        """`a_from_b @ b_from_c` is `a_from_c`."""
        return Pose(self.apply(other.position), multiply(self.orientation, other.orientation))

    def inverse(self) -> Pose:
        """`source_from_target`."""
        turn = self.orientation * (-1, -1, -1, 1)
        return Pose(-rotation_of(turn) @ self.position, turn)

    def apply(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) of the source in the target."""
        return np.asarray(points, np.float64) @ rotation_of(self.orientation).T + self.position


@dataclass(frozen=True, eq=False)
class TimedPose:
    """A pose at a time: seconds of the clock that all trackers share (`time.monotonic` when live)."""

    stamp: float
    pose: Pose


def between(a: Pose, b: Pose, share: float) -> Pose:
    """From a (share 0) to b (share 1) and beyond: position linearly, orientation along the shortest arc."""
    one, two = a.orientation, b.orientation
    cosine = float(one @ two)
    if cosine < 0:
        two, cosine = -two, -cosine
    angle = np.arccos(min(cosine, 1.0))
    if angle < 1e-6:
        turn = one + share * (two - one)
    else:
        turn = (np.sin((1 - share) * angle) * one + np.sin(share * angle) * two) / np.sin(angle)
    return Pose(a.position + share * (b.position - a.position), turn)


def turn_about(axis: Vector, angle: float) -> np.ndarray:
    """Quaternion x, y, z, w that turns by `angle` radians about `axis`, by the right hand."""
    axis = np.asarray(axis, np.float64)
    return np.array([*(np.sin(angle / 2) * axis / np.linalg.norm(axis)), np.cos(angle / 2)])


def multiply(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Quaternion of the turn b, then a."""
    (ax, ay, az, aw), (bx, by, bz, bw) = a, b
    return np.array(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ]
    )


def rotation_of(quaternion: np.ndarray) -> np.ndarray:
    """(3, 3) rotation of a unit quaternion x, y, z, w."""
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_of(rotation: np.ndarray) -> np.ndarray:
    """Quaternion x, y, z, w of a (3, 3) rotation; w ≥ 0."""
    # The eigenvector of the largest eigenvalue of Bar-Itzhack's symmetric matrix: stable for every rotation.
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation
    k = np.array(
        [
            [xx - yy - zz, yx + xy, zx + xz, zy - yz],
            [yx + xy, yy - xx - zz, zy + yz, xz - zx],
            [zx + xz, zy + yz, zz - xx - yy, yx - xy],
            [zy - yz, xz - zx, yx - xy, xx + yy + zz],
        ]
    )
    turn = np.linalg.eigh(k)[1][:, -1]
    return turn if turn[3] >= 0 else -turn
