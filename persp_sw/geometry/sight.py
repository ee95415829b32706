"""What an eye sees of a box through its walls: the box's sides, clipped to each wall's frustum.

Everything is in object (voxel index) space relative to the eye. The six directions are −x, +x, −y … +z.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Matrix
from ..kernels import sight
from ..volume.levels import STANDARD_AXES
from .seams import REACH
from .view import View

# Part of a wall's pixels that may be finer than the pitch asked for: at grazing angles a few are 30× finer.
_QUANTILE = 0.1
# Pieces of the integral over slices.
_PIECES = 64
# Points a side of the grid on which a wall's pixel size is measured.
_GRID = 24
# An eye so near to the plane of a side (voxels) is in it.
_TOUCHES = 1e-9
# Which end of each axis, 0 or 1, the four corners of a box's six sides have.
_SIDES = np.array(
    [
        [np.roll((end, u, v), axis).tolist() for u, v in ((0, 0), (1, 0), (1, 1), (0, 1))]
        for axis in range(3)
        for end in (0, 1)
    ]
)


@dataclass(frozen=True, eq=False)
class EyeGeometry:
    """What the choice of faces depends on.

    Attributes
    ----------
    eye
        Object-space position; for an eye at infinity the direction towards it.
    low, high
        Object-space corners of the box that holds all that can be seen.
    views
        The walls through which this eye looks.
    object_from_world
        (4, 4).
    near
        World distance from the eye, along each ray, before which nothing is shown.
    at_infinity
        Whether the rays are parallel.
    """

    eye: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    views: Sequence[View]
    object_from_world: Matrix
    near: float = 0.0
    at_infinity: bool = False

    @property
    def inside(self) -> bool:
        """Whether the eye is in the box, its sides included."""
        return bool((self.eye >= self.low - _TOUCHES).all() and (self.eye <= self.high + _TOUCHES).all())


def seen_volume(
    geometry: EyeGeometry, axis: int, sign: int, low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """How much of the box a rectangle of tangents shows, slice by slice, for an eye at a point.

    Returns
    -------
    Distances D, (n,), and the rectangle's part, tangents², that shows the box there, times their spacing: the
    sum is the integral. It has no steps, wherever the eye and whatever the rectangle.
    """
    order = list(STANDARD_AXES[axis])
    nearest, farthest = geometry.low[order] - geometry.eye[order], geometry.high[order] - geometry.eye[order]
    ends = sorted((sign * nearest[2], sign * farthest[2]))
    front, back = max(ends[0], 0.0), max(ends[1], 0.0)
    width = max(back - front, 0.0) / _PIECES
    distances = front + width * (np.arange(_PIECES) + 0.5)
    with np.errstate(divide="ignore", invalid="ignore"):
        begin = np.maximum(nearest[:2] / distances[:, None], low)
        end = np.minimum(farthest[:2] / distances[:, None], high)
    return distances, width * np.prod(np.maximum(end - begin, 0.0), axis=1) if width else np.zeros(_PIECES)


def tangents(points: NDArray[np.float64], axis: int, sign: int) -> NDArray[np.float64]:
    """(..., 3): tangents t_i, t_j and distance D of directions or of points relative to the eye."""
    i, j, k = STANDARD_AXES[axis]
    distance = sign * points[..., k]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.stack([points[..., i] / distance, points[..., j] / distance, distance], -1)


@dataclass(frozen=True, eq=False)
class Sight:
    """Bounds of what all walls together show of the box in one direction.

    Attributes
    ----------
    low, high
        Tangents (t_i, t_j).
    nearest, farthest
        Distances D of the shown parts of the box's sides; `nearest` ≤ 0 where some lie beside the eye.
    steepest
        Largest world length of a ray to them, in units of D.
    """

    low: NDArray[np.float64]
    high: NDArray[np.float64]
    nearest: float
    farthest: float
    steepest: float


class Sights:
    """What is seen in each of the six directions, and how finely.

    Parameters
    ----------
    sides
        (n, 4, 3) polygons relative to the eye.
    matrices
        (views, 3, 3): direction of the ray through each view's pixel point (column, row, 1).
    sizes
        (views, 2) pixels.
    metric
        (3, 3), AᵀA of the linear part A of world_from_object.
    reach
        Up to which tangents rays are a direction's own, ≥ 1.
    """

    def __init__(self, sides, matrices, sizes, metric, reach=1.0):
        self.matrices, self.sizes = np.ascontiguousarray(matrices), np.asarray(sizes, np.float64)
        self.bounds = np.empty((len(matrices), 6, 2, sight.BOUND_COLUMNS))
        polygon, spare = np.empty((2, sight.MAX_CORNERS, 3))
        windows = _window_normals(self.matrices, self.sizes)
        sides = np.ascontiguousarray(sides)
        sight.bound_sight(sides, windows, metric, reach, polygon, spare, self.bounds)

    @classmethod
    def of(cls, geometry: EyeGeometry, reach: float = 1.0) -> Sights:
        """What an eye at a point sees through its walls."""
        linear = geometry.object_from_world[:3, :3]
        world_from_object = np.linalg.inv(linear)
        sides = box_sides(geometry.low - geometry.eye, geometry.high - geometry.eye)
        return cls(
            sides[~_seen_edge_on(sides)],
            linear @ np.stack([view.direction_from_pixel for view in geometry.views]),
            [view.size for view in geometry.views],
            world_from_object.T @ world_from_object,
            reach,
        )

    def whole(self, direction: int) -> Sight | None:
        """All that lies before the eye, as far as a direction can show it; None if nothing does."""
        return self._sight(direction, sight.WHOLE)

    def own(self, direction: int) -> Sight | None:
        """What is seen along the rays that are a direction's own, or nearly; None if nothing is."""
        return self._sight(direction, sight.OWN)

    def _sight(self, direction: int, which: int) -> Sight | None:
        bounds = self.bounds[:, direction, which]
        if not bounds[:, sight.COUNT].any():
            return None
        low, high = bounds.min(0), bounds.max(0)
        return Sight(
            low[[sight.LOW_I, sight.LOW_J]],
            high[[sight.HIGH_I, sight.HIGH_J]],
            low[sight.NEAREST],
            high[sight.FARTHEST],
            high[sight.STEEPEST],
        )

    def pixel_sizes(self, geometry: EyeGeometry, only: int | None) -> NDArray[np.float64]:
        """(6,) the finest that a wall shows in each direction, in tangents; 0 where none shows anything.

        `only`: the direction that shows all rays; None where each shows its own.
        """
        which = sight.OWN if only is None else sight.WHOLE
        middles = self.bounds[:, :, which, sight.SUM_X : sight.SUM_Z + 1]
        # The pixel of a ray is (column, row, 1): scale the ray so that the last is 1.
        last = np.linalg.inv(self.matrices)[:, 2]
        scale = np.einsum("vc,vdc->vd", last, middles)
        middles = middles / np.where(scale > 0, scale, np.inf)[..., None]
        sizes = np.empty((len(self.matrices), 6))
        sight.measure_pixels(
            self.matrices,
            self.sizes,
            geometry.low - geometry.eye,
            geometry.high - geometry.eye,
            -1 if only is None else only,
            REACH,
            _QUANTILE,
            middles,
            *np.empty((2, 6, _GRID * _GRID)),
            np.empty(6, np.int64),
            sizes,
        )
        sizes[sizes == 0] = np.inf
        finest = sizes.min(0)
        return np.where(np.isfinite(finest), finest, 0.0)


def _window_normals(matrices: NDArray[np.float64], sizes: NDArray[np.float64]) -> NDArray[np.float64]:
    """(views, 4, 3) inward normals of the planes through the eye and the edges of each view's window."""
    corners = np.zeros((len(matrices), 3, 5))
    corners[:, 2] = 1
    corners[:, 0, 1:3] = sizes[:, :1]
    corners[:, 1, 2:4] = sizes[:, 1:]
    corners[:, :2, 4] = sizes / 2  # the middle
    rays = (matrices @ corners).swapaxes(1, 2)
    normals = np.cross(rays[:, :4], rays[:, [1, 2, 3, 0]])
    return normals * np.sign(normals @ rays[:, 4, :, None])  # inwards, whatever the pose's handedness


def box_sides(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
    """(6, 4, 3): the corners of a box's sides −x, +x, −y …"""
    ends = np.stack([low, high])
    return np.stack([ends[_SIDES[..., axis], axis] for axis in range(3)], -1)


def _seen_edge_on(sides: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which sides of a box hold the eye, the origin, in their plane: such sides are not needed.

    A ray that is in the box for more than a point crosses two sides, at most one of which holds the eye; so
    every such ray meets another, from without or from within.
    """
    axes = np.arange(6) // 2
    return np.abs(sides[np.arange(6), 0, axes]) <= _TOUCHES
