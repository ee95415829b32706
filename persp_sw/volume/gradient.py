"""The gradient in the world: how long it can be, and what makes it of differences along the voxel axes."""

from __future__ import annotations

from itertools import product

import numpy as np

from ..arrays import Matrix
from .grid import Volume

FAINTEST = 1e-4  # of the largest magnitude: below it normals fade, instead of turning with the last bit


def world_from_differences(volume: Volume) -> Matrix:
    """(3, 3): the gradient per world unit of (∂s/∂x, ∂s/∂y, ∂s/∂z) per voxel; A⁻ᵀ, A the pose's linear part.

    Differences along skew or unequal axes are no components of a vector: only this map makes them one.
    """
    return np.linalg.inv(volume.world_from_object[:3, :3]).T


def largest_magnitude(volume: Volume, distance: float = 1.0) -> float:
    """No central difference of this volume makes a longer gradient, per world unit.

    ½·range·√(1/dx² + 1/dy² + 1/dz²) for axes at right angles and neighbours one voxel away (Yuan et al.
    2011); of skew axes the longest of the eight corners. `distance`: voxels to the neighbours; below 1
    the whole range of a cell lies between them.
    """
    low, high = volume.value_range
    corners = np.array(list(product((-1.0, 1.0), repeat=3))) @ world_from_differences(volume).T
    return float((high - low) / (2 * distance) * np.linalg.norm(corners, axis=1).max())
