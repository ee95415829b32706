"""Standard-space layouts of a volume and the smallest and largest values of its blocks."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..arrays import Voxels
from ..kernels import encode
from .grid import Volume

# Object axes (x = 0, y = 1, z = 2) that become standard i, j, k for each principal axis. Cyclic, so that
# the permutation keeps handedness; k is the principal axis.
STANDARD_AXES = {0: (1, 2, 0), 1: (2, 0, 1), 2: (0, 1, 2)}


def standard_rows(volume: Volume, axis: int) -> Voxels:
    """[j, k, i] view of the voxels for principal axis 0 (x), 1 (y) or 2 (z); nothing is copied."""
    i, j, k = STANDARD_AXES[axis]
    return volume.data.transpose(2 - j, 2 - k, 2 - i)


@dataclass
class BlockBounds:
    """Smallest and largest value of every block, per axis, computed once per volume when first asked for.

    A block is `encode.BLOCK` cells of one slice; see `kernels/encode.py`.
    """

    volume: Volume
    _bounds: dict[int, tuple[NDArray, NDArray]] = field(default_factory=dict)

    def of(self, axis: int) -> tuple[NDArray, NDArray]:
        """(low, high), each [n_j − 1, n_k, blocks] of the volume's type."""
        if axis not in self._bounds:
            rows = standard_rows(self.volume, axis)
            n_j, n_k, n_i = rows.shape
            shape = (max(n_j - 1, 0), n_k, -(-(n_i - 1) // encode.BLOCK))
            limits = np.finfo(rows.dtype) if rows.dtype.kind == "f" else np.iinfo(rows.dtype)
            low, high = np.full(shape, limits.max, rows.dtype), np.full(shape, limits.min, rows.dtype)
            encode.block_bounds(rows, low, high)
            self._bounds[axis] = low, high
        return self._bounds[axis]
