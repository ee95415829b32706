"""Standard-space layouts of a volume and the smallest and largest values of its blocks."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..arrays import Voxels
from ..kernels import bounds
from ..kernels.encode import BLOCK
from .grid import Volume

# Object axes (x = 0, y = 1, z = 2) that become standard i, j, k for each principal axis. Cyclic, so that
# the permutation keeps handedness; k is the principal axis.
STANDARD_AXES = {0: (1, 2, 0), 1: (2, 0, 1), 2: (0, 1, 2)}

_BOUND_BLOCKS = {
    0: bounds.bound_blocks_along_y,
    1: bounds.bound_blocks_along_z,
    2: bounds.bound_blocks_along_x,
}


def standard_rows(volume: Volume, axis: int) -> Voxels:
    """[j, k, i] view of the voxels for principal axis 0 (x), 1 (y) or 2 (z); nothing is copied."""
    i, j, k = STANDARD_AXES[axis]
    return volume.data.transpose(2 - j, 2 - k, 2 - i)


def _blocks(n: int) -> int:
    return -(-(n - 1) // BLOCK)


@dataclass
class BlockBounds:
    """Smallest and largest value of every block and brick, computed once per volume when first asked for.

    A block is `BLOCK` cells of one slice, a brick `BLOCK`³ cells; see `kernels/bounds.py`. Where all is NaN
    low > high.
    """

    volume: Volume
    _blocks: dict[int, tuple[NDArray, NDArray]] = field(default_factory=dict)
    _bricks: tuple[NDArray, NDArray] | None = None

    def of(self, axis: int) -> tuple[NDArray, NDArray]:
        """(low, high) of the blocks of an axis, each [n_j − 1, n_k, blocks] of the volume's type."""
        if axis not in self._blocks:
            n_j, n_k, n_i = standard_rows(self.volume, axis).shape
            self._blocks[axis] = self._fill(_BOUND_BLOCKS[axis], (max(n_j - 1, 0), n_k, _blocks(n_i)))
        return self._blocks[axis]

    def bricks(self) -> tuple[NDArray, NDArray]:
        """(low, high) of the bricks, each [z, y, x] of the volume's type."""
        if self._bricks is None:
            n_z, n_y, n_x = self.volume.data.shape
            self._bricks = self._fill(bounds.bound_bricks, (_blocks(n_z), _blocks(n_y), _blocks(n_x)))
        return self._bricks

    @property
    def bytes(self) -> int:
        """Memory of all that was computed so far."""
        computed = [*self._blocks.values(), *([self._bricks] if self._bricks else [])]
        return sum(low.nbytes + high.nbytes for low, high in computed)

    def _fill(self, kernel, shape: tuple[int, int, int]) -> tuple[NDArray, NDArray]:
        data = self.volume.data
        if data.dtype.kind == "f":
            none = data.dtype.type(np.inf), data.dtype.type(-np.inf)
        else:
            none = np.iinfo(data.dtype).max, np.iinfo(data.dtype).min
        low, high = np.empty(shape, data.dtype), np.empty(shape, data.dtype)
        if low.size:
            kernel(data, data.dtype.type(none[0]), data.dtype.type(none[1]), low, high)
        return low, high
