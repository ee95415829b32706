"""Values and gradients at any place of a dense volume, one place at a time, in float64."""

import numpy as np

from .._jit import kernel


@kernel
def value_at(voxels, x, y, z):
    """The trilinear value of `voxels` [z, y, x], clamped to the box; NaN where a voxel around it has none."""
    n_z, n_y, n_x = voxels.shape
    x, y, z = min(max(x, 0.0), n_x - 1.0), min(max(y, 0.0), n_y - 1.0), min(max(z, 0.0), n_z - 1.0)
    i, j, k = min(np.int64(x), n_x - 2), min(np.int64(y), n_y - 2), min(np.int64(z), n_z - 2)
    a, b, c = x - i, y - j, z - k
    value = 0.0
    for dk in range(2):
        for dj in range(2):
            weight = (b if dj else 1.0 - b) * (c if dk else 1.0 - c)
            low, high = np.float64(voxels[k + dk, j + dj, i]), np.float64(voxels[k + dk, j + dj, i + 1])
            value += weight * (low * (1.0 - a) + high * a)
    return value


@kernel
def _slope_at(voxels, x, y, z, axis, reach):
    """Difference of the values `reach` to both sides along an axis, both in the box, by what lies between."""
    last = voxels.shape[2 - axis] - 1.0
    here = x if axis == 0 else y if axis == 1 else z
    here = min(max(here, 0.0), last)
    below, above = max(here - reach, 0.0), min(here + reach, last)
    if axis == 0:
        rise = value_at(voxels, above, y, z) - value_at(voxels, below, y, z)
    elif axis == 1:
        rise = value_at(voxels, x, above, z) - value_at(voxels, x, below, z)
    else:
        rise = value_at(voxels, x, y, above) - value_at(voxels, x, y, below)
    return rise / (above - below)


@kernel
def magnitude_at(voxels, x, y, z, matrix, reach):
    """Length of the gradient at a place, per world unit; 0 where a value is missing.

    `matrix`: the gradient in the world of slopes along the voxel axes, its first nine numbers, row by row;
    `reach`: voxels to the neighbours.
    """
    a = _slope_at(voxels, x, y, z, 0, reach)
    b = _slope_at(voxels, x, y, z, 1, reach)
    c = _slope_at(voxels, x, y, z, 2, reach)
    total = 0.0
    for n in range(3):
        part = matrix[3 * n] * a + matrix[3 * n + 1] * b + matrix[3 * n + 2] * c
        total += part * part
    return np.sqrt(total) if total == total else 0.0
