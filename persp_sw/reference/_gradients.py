"""The gradient at single points, in plain numpy: what tests and tools ask."""

from __future__ import annotations

from itertools import product

import numpy as np

from ..arrays import Points, number
from ..errors import LookError
from ..volume.gradient import world_from_differences
from ..volume.grid import Volume


def gradients(volume: Volume, points: Points, distance: float = 1.0) -> Points:
    """The gradient of the interpolated scalar at world points.

    Along each voxel axis the difference of the values at `distance` voxels to both sides, by the voxels that
    lie between them; both places are clamped to the box of voxel centres.

    Parameters
    ----------
    volume
        At least two voxels thick along each axis.
    points
        (..., 3) world; those outside the box of voxel centres are clamped to it.
    distance
        Voxels, 0.5 … 4.

    Returns
    -------
    (..., 3) float64, world, values per world unit; 0 where a NaN has part in one of the six values.

    Raises
    ------
    LookError
        The distance is out of range, or the volume is one voxel thick.
    """
    distance = number(distance, "gradient_distance", LookError, 0.5, 4)
    last = np.array(volume.size) - 1.0
    if not (last > 0).all():
        raise LookError(f"gradients need two voxels along each axis; given a volume of {volume.size}")
    object_from_world = np.linalg.inv(volume.world_from_object)
    places = np.asarray(points, np.float64) @ object_from_world[:3, :3].T + object_from_world[:3, 3]
    places = np.clip(places, 0, last)
    differences = np.empty(places.shape)
    for axis in range(3):
        step = distance * np.eye(3)[axis]
        above, below = np.clip(places + step, 0, last), np.clip(places - step, 0, last)
        gap = above[..., axis] - below[..., axis]
        differences[..., axis] = (_interpolated(volume, above) - _interpolated(volume, below)) / gap
    differences[np.isnan(differences).any(-1)] = 0.0
    return differences @ world_from_differences(volume).T


def _interpolated(volume: Volume, places: Points) -> Points:
    """Trilinear, at object places inside the box; voxels without weight are not asked."""
    cell = np.clip(np.floor(places).astype(int), 0, np.array(volume.size) - 2)
    part = places - cell
    total = np.zeros(places.shape[:-1])
    for corner in product((0, 1), repeat=3):
        weight = np.prod(np.where(corner, part, 1 - part), axis=-1)
        x, y, z = np.moveaxis(cell + corner, -1, 0)
        total += np.where(weight == 0, 0.0, weight * volume.data[z, y, x].astype(np.float64))
    return total
