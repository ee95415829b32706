"""What an eye sees of a box through its walls: the box's sides, clipped to each wall's frustum.

Everything is in object (voxel index) space relative to the eye.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Matrix
from ..volume.levels import STANDARD_AXES
from .view import View

# An eye so near to the plane of a side (voxels) is in it.
_TOUCHES = 1e-9


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


def tangents(points: NDArray[np.float64], axis: int, sign: int) -> NDArray[np.float64]:
    """(..., 3): tangents t_i, t_j and distance D of directions or of points relative to the eye."""
    i, j, k = STANDARD_AXES[axis]
    distance = sign * points[..., k]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.stack([points[..., i] / distance, points[..., j] / distance, distance], -1)


def seen_polygons(geometry: EyeGeometry, view: View) -> list[NDArray[np.float64]]:
    """The box's sides, relative to the eye, clipped to the view's frustum."""
    low, high = geometry.low - geometry.eye, geometry.high - geometry.eye
    sides = [side for side in box_sides(low, high) if not _seen_edge_on(side)]
    return clip_to_window(sides, geometry.object_from_world[:3, :3] @ view.direction_from_pixel, view.size)


def clip_to_window(
    polygons: list[NDArray[np.float64]], matrix: Matrix, size: tuple[int, int]
) -> list[NDArray[np.float64]]:
    """The parts of polygons that a window shows whose pixel (column, row, 1) looks along `matrix` · it."""
    width, height = size
    corners = (matrix @ np.array([[0, 0, 1], [width, 0, 1], [width, height, 1], [0, height, 1]]).T).T
    normals = np.cross(corners, np.roll(corners, -1, axis=0))
    middle = matrix @ (width / 2, height / 2, 1)
    normals *= np.sign(normals @ middle)[:, None]  # inwards, whatever the pose's handedness
    parts = [clip(polygon, normals) for polygon in polygons]
    return [part for part in parts if len(part)]


def box_sides(low: NDArray[np.float64], high: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """The corners, (4, 3), of a box's six sides."""
    sides = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for end in (low, high):
            side = np.empty((4, 3))
            side[:, axis] = end[axis]
            side[:, u] = low[u], high[u], high[u], low[u]
            side[:, v] = low[v], low[v], high[v], high[v]
            sides.append(side)
    return sides


def _seen_edge_on(side: NDArray[np.float64]) -> bool:
    """Whether the eye, at the origin, lies in the plane of a box's side: such sides are not needed.

    A ray that is in the box for more than a point crosses two sides, at most one of which holds the eye; so
    every such ray meets another, from without or from within.
    """
    across = np.ptp(side, axis=0) == 0
    return bool((np.abs(side[0, across]) <= _TOUCHES).any())


def clip(polygon: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """The part of a convex polygon where n·p ≥ 0 for all normals (Sutherland, Hodgman 1974)."""
    for normal in normals:
        inside = polygon @ normal
        kept = []
        for a, b, da, db in zip(
            polygon, np.roll(polygon, -1, axis=0), inside, np.roll(inside, -1), strict=True
        ):
            if da >= 0:
                kept.append(a)
            if (da >= 0) != (db >= 0):
                kept.append(a + (b - a) * (da / (da - db)))
        if not kept:
            return np.empty((0, 3))
        polygon = np.array(kept)
    return polygon


def pyramid(axis: int, sign: int) -> NDArray[np.float64]:
    """Inward normals of the rays whose largest component is `sign` along `axis`."""
    normals = np.zeros((4, 3))
    normals[:, axis] = sign
    normals[:2, (axis + 1) % 3] = -1, 1
    normals[2:, (axis + 2) % 3] = -1, 1
    return normals
