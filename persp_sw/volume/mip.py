"""Coarser levels of a volume, for rays that are farther apart than its voxels."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..errors import VolumeError
from ..kernels import mip
from .grid import Volume


class Level(Volume):
    """A volume whose voxels are `factor` times as far apart as those of the finest level.

    Voxel (x, y, z) lies at the finest level's (x, y, z)·factor, in the world too, so coarse slices fall on
    fine ones. The last voxels may lie beyond the finest level's box.

    Attributes
    ----------
    factor
        (3,) int64, for x, y and z: powers of two.
    far_corner
        (3,) float64: where the finest level's box, which begins at 0, ends in this level's voxel index; at
        most size − 1 and more than size − 2, along axes of more than one voxel.
    """

    factor: NDArray[np.int64]
    far_corner: NDArray[np.float64]

    @classmethod
    def finest(cls, volume: Volume) -> Level:
        """Level 0: the volume itself, its voxels shared."""
        level = cls.__new__(cls)
        level._set(**vars(volume), factor=np.ones(3, np.int64), far_corner=np.array(volume.size) - 1.0)
        return level

    def coarser(self, halved: NDArray[np.bool_]) -> Level:
        """The level with the voxels along the `halved` axes (of x, y and z) twice as far apart."""
        strides = np.where(halved, 2, 1)
        weights = [
            _halving_weights(far) if half else _same_weights(n)
            for n, far, half in zip(self.size, self.far_corner, halved, strict=True)
        ]
        data = np.empty(tuple(len(w) for w in weights[::-1]), self.data.dtype)
        whole = data.dtype.kind != "f"
        mip.coarsen(self.data, strides[::-1].copy(), *weights[::-1], self.nonfinite > 0, whole, data)
        level = Level(
            data,
            world_from_object=self.world_from_object @ np.diag([*strides, 1.0]),
            orientation=self.orientation,
            name=self.name,
        )
        level._set(factor=self.factor * strides, far_corner=self.far_corner / strides)
        return level

    def _set(self, **attributes: object) -> None:
        for name, value in attributes.items():
            object.__setattr__(self, name, value)


class Levels:
    """The levels of a volume, each made from the one before when first asked for, and kept.

    A coarse voxel is the mean of the finer level's trilinear interpolant over the box that reaches halfway to
    its neighbours, cut off at the volume's box: weights 1-2-1 along each axis, 1-1 at the near end. A last
    voxel beyond the box is chosen so that the mean of the level's own interpolant over the volume's box is
    that of the finer level, whatever the sizes. So the mean of the values stays, and the mean extinction
    where extinction is linear in the value. (1-2-1 renormalised at the ends would weigh end voxels by a third
    too much.) NaN voxels are left out; a coarse voxel is NaN only where nothing else is near, so what is
    beside NaN may grow by a voxel of the finer level.

    Parameters
    ----------
    volume
        Level 0.
    progress
        Called as progress(0, 1, "level 2") and progress(1, 1, "level 2") before and after a level is made.
    cubic
        False: every level halves all axes of more than two voxels. A pixel of a face covers as many voxels
        along i as along j, whatever their spacing, so this is what keeps a face from aliasing. True: a level
        halves only the axes whose spacing is within √2 of the smallest, so that voxels become cubes before
        the widest spacing grows: for sampling that is even in the world.

    Accuracy: 8- and 16-bit voxels are rounded to integers at every level.
    """

    def __init__(
        self,
        volume: Volume,
        progress: Callable[[int, int, str], None] | None = None,
        *,
        cubic: bool = False,
    ):
        self.progress = progress
        self._levels = [Level.finest(volume)]
        self._factors = _factors(volume, cubic)

    def __len__(self) -> int:
        """Number of levels; the last has no axis left to halve."""
        return len(self._factors)

    def level(self, number: int) -> Level:
        """Level 0 … len − 1, made now if need be; VolumeError for another number."""
        if not 0 <= number < len(self):
            raise VolumeError(f"the volume has levels 0 … {len(self) - 1}; given {number}")
        while len(self._levels) <= number:
            finer, what = self._levels[-1], f"level {len(self._levels)}"
            if self.progress:
                self.progress(0, 1, what)
            self._levels.append(finer.coarser(self._factors[len(self._levels)] > finer.factor))
            if self.progress:
                self.progress(1, 1, what)
        return self._levels[number]

    def factor(self, number: int) -> NDArray[np.int64]:
        """`Level.factor` of a level that need not be made for it."""
        return self._factors[number]

    @property
    def bytes(self) -> int:
        """Memory of the levels made so far, without level 0."""
        return sum(level.data.nbytes for level in self._levels[1:])


def _factors(volume: Volume, cubic: bool) -> list[NDArray[np.int64]]:
    """`Level.factor` of all levels."""
    cells, spacing = np.array(volume.size) - 1, np.array(volume.spacing)
    factors = [np.ones(3, np.int64)]
    while (halved := cells > factors[-1]).any():
        if cubic:
            grown = spacing * factors[-1]
            halved &= grown <= np.sqrt(2) * grown[halved].min()
        factors.append(factors[-1] * np.where(halved, 2, 1))
    return factors


def _same_weights(n: int) -> NDArray[np.float32]:
    """Weights of an axis of n voxels that is not halved."""
    weights = np.zeros((n, mip.TAPS), np.float32)
    weights[:, 0] = 1
    return weights


def _halving_weights(far: float) -> NDArray[np.float32]:
    """Weights of an axis whose box ends at the finer voxel index `far`, for coarse voxels 0 … ⌈far / 2⌉."""
    m = np.arange(int(np.ceil(far / 2)) + 1)
    begin, end = np.maximum(2.0 * m - 1, 0), np.minimum(2.0 * m + 1, far)
    taps = mip.first_tap(m[:, None], 2) + np.arange(mip.TAPS)
    length = np.maximum(end - begin, 0)
    # Integral of each finer voxel's tent over the cell, by its length.
    integrals = _tent_integral(end[:, None] - taps) - _tent_integral(begin[:, None] - taps)
    weights = np.divide(integrals, length[:, None], out=np.zeros(taps.shape), where=length[:, None] > 0)
    # In the mean over the coarse box the last voxel counts θ², θ being what of the last coarse interval lies
    # in the box, and the last but one makes up for what its cell's length has more: both from their cells.
    theta = far / 2 - (m[-1] - 1)
    shifted = np.r_[weights[-2, 2:], 0, 0]  # the taps of the last voxel begin two voxels later
    weights[-1] = (length[-1] * weights[-1] + (theta**2 - length[-1]) * shifted) / theta**2
    return weights.astype(np.float32)


def _tent_integral(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """∫ max(1 − |t|, 0) dt from −∞ to x."""
    x = np.clip(x, -1, 1)
    return np.where(x < 0, (1 + x) ** 2 / 2, 1 - (1 - x) ** 2 / 2)
