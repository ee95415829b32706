"""How finely the volume and the walls ask an eye image to be sampled, in tangents."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..volume.levels import STANDARD_AXES
from .sight import EyeGeometry, seen_polygons
from .view import View

# Part of a wall's pixels that may be finer than the pitch asked for: at grazing angles a few are 30× finer.
_QUANTILE = 0.1
# Points a side of the grid on which a wall's pixel size is measured.
_GRID = 24


def volume_pitch(geometry: EyeGeometry, points: NDArray[np.float64], distance: NDArray[np.float64]) -> float:
    """One pixel a voxel on the nearest slice, but no finer than half a pixel a voxel on the farthest.

    `points` are corners, relative to the eye, of what is seen of the box, at `distance` along the principal
    axis. The nearest slice is where the box begins; from inside it is the eye's own, or the near distance's.
    """
    front = 0.0 if geometry.inside else distance.min()
    if geometry.near:
        world = np.linalg.norm(points @ np.linalg.inv(geometry.object_from_world[:3, :3]).T, axis=-1)
        front = max(front, geometry.near * (distance / world).min())
    return float(1 / max(front, distance.max() / 2))


def wall_pitch(geometry: EyeGeometry, axis: int, sign: int, limit: float) -> float:
    """The finest that the walls can show of this face, in tangents; 0 where they show nothing of it."""
    finest = [_pixel_tangent(geometry, view, axis, sign, limit) for view in geometry.views]
    return min((size for size in finest if size > 0), default=0.0)


def _pixel_tangent(geometry: EyeGeometry, view: View, axis: int, sign: int, limit: float) -> float:
    """Smaller singular value of ∂t/∂pixel: a low quantile over the pixels that show the box here."""
    width, height = view.size
    matrix = geometry.object_from_world[:3, :3] @ view.direction_from_pixel
    column, row = np.meshgrid(
        (np.arange(_GRID) + 0.5) / _GRID * width, (np.arange(_GRID) + 0.5) / _GRID * height
    )
    directions = np.stack([column, row, np.ones_like(row)], -1).reshape(-1, 3) @ matrix.T
    shown = _meets_box(directions, geometry.low - geometry.eye, geometry.high - geometry.eye)
    i, j, k = STANDARD_AXES[axis]
    shown &= directions[:, k] * sign > 0
    if limit < np.inf:
        shown &= np.abs(directions[:, [i, j]]).max(1) <= limit * np.abs(directions[:, k])
    directions = directions[shown]
    if not len(directions):  # nothing, or smaller than the grid: take the middle of what is seen
        seen = np.concatenate([np.empty((0, 3)), *seen_polygons(geometry, view)])
        seen = seen[seen[:, k] * sign > 0]
        if not len(seen):
            return 0.0
        middle = seen.mean(0, keepdims=True)
        directions = middle / (np.linalg.inv(matrix) @ middle[0])[2]
    along = sign * directions[:, k, None]
    jacobian = np.stack(
        [
            (matrix[[i, j], axis_] - directions[:, [i, j]] * sign * matrix[k, axis_] / along) / along
            for axis_ in (0, 1)
        ],
        -1,
    )
    return float(np.quantile(np.linalg.svd(jacobian, compute_uv=False)[:, -1], _QUANTILE))


def _meets_box(directions: NDArray, low: NDArray, high: NDArray) -> NDArray[np.bool_]:
    """Whether rays from the origin meet the box."""
    with np.errstate(divide="ignore", invalid="ignore"):
        one, other = low / directions, high / directions
    near = np.nanmax(np.minimum(one, other), axis=1)
    far = np.nanmin(np.maximum(one, other), axis=1)
    return (near <= far) & (far > 0)
