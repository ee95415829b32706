"""How often values and gradient magnitudes meet in a volume: what a 2D transfer function is drawn over."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import number
from ..errors import TransferFunctionError
from ..volume.gradient import largest_magnitude, world_from_differences
from ..volume.grid import Volume

_SLICES = 4  # at a time: a few slices of float32 beside the volume


@dataclass(frozen=True, eq=False)
class JointHistogram:
    """Counts of voxels by value and by gradient magnitude.

    Attributes
    ----------
    counts
        (values, magnitudes) int64, bins of equal width. They add up to the voxels that have a value and a
        gradient: all but those that are NaN or have one beside them along an axis.
    values
        Lowest and highest value of all bins: the volume's range.
    magnitudes
        The same of the magnitudes, in value units per world unit, from 0; the few magnitudes above are in the
        last bin.
    """

    counts: NDArray[np.int64]
    values: tuple[float, float]
    magnitudes: tuple[float, float]

    @classmethod
    def of(
        cls,
        volume: Volume,
        bins: tuple[int, int] = (256, 256),
        largest: float | None = None,
        progress: Callable[[int, int, str], None] | None = None,
    ) -> JointHistogram:
        """Of all voxels of `volume`, gradients by differences of neighbours.

        Parameters
        ----------
        volume
            At least two voxels thick along each axis, else nothing has a gradient and all counts are 0.
        bins
            Of values and of magnitudes, 1 … 4096.
        largest
            Upper end of the magnitudes; None: the largest of the volume, found in a pass of its own.
        progress
            Called as progress(slices done, slices, "joint histogram").

        Raises
        ------
        TransferFunctionError
            Bins or `largest` out of range.

        Cost: two passes over the volume, one where `largest` is given; takes some slices of memory.
        """
        count = [int(number(n, "bins", TransferFunctionError, 1, 4096)) for n in bins]
        depth = volume.data.shape[0]
        passes = 2 if largest is None else 1
        done = 0

        def counted(stop: int, before: int) -> None:
            if progress is not None:
                progress(before + stop, passes * depth, "joint histogram")

        if largest is None:
            largest = 0.0
            for stop, _, lengths in _slabs(volume):
                largest = max(largest, float(lengths.max(initial=0.0)))
                counted(stop, 0)
            largest = largest or largest_magnitude(volume) or 1.0
            done = depth
        else:
            largest = number(largest, "largest", TransferFunctionError, 1e-300, 1e300)
        low, high = volume.value_range
        counts = np.zeros(count[0] * count[1], np.int64)
        for stop, values, lengths in _slabs(volume):
            rows = _bin_of(values - low, high - low, count[0])
            columns = _bin_of(lengths, largest, count[1])
            counts += np.bincount(rows * count[1] + columns, minlength=len(counts))
            counted(stop, done)
        return cls(counts.reshape(count), (low, high), (0.0, largest))


def _bin_of(offsets: NDArray[np.float64], width: float, count: int) -> NDArray[np.intp]:
    scale = count / width if width > 0 else 0.0
    return np.clip((offsets * scale).astype(np.intp), 0, count - 1)


def _slabs(
    volume: Volume,
) -> Iterator[tuple[int, NDArray[np.float64], NDArray[np.float64]]]:
    """Slab by slab: slices done, and values and magnitudes of those of its voxels that have both."""
    data, into_world = volume.data, world_from_differences(volume)
    metric = into_world.T @ into_world  # |g|² = dᵀ · metric · d, d the differences along x, y, z
    depth = data.shape[0]
    if min(volume.size) < 2:
        return
    for first in range(0, depth, _SLICES):
        stop = min(first + _SLICES, depth)
        below, above = max(first - 1, 0), min(stop + 1, depth)
        part = data[below:above].astype(np.float64)
        inner = slice(first - below, stop - below)
        # At the box's sides from the one neighbour there is, over half the distance.
        differences = [np.gradient(part, axis=axis)[inner] for axis in (2, 1, 0)]
        square = np.zeros_like(differences[0])
        for (row, column), weight in np.ndenumerate(np.triu(metric + np.triu(metric, 1))):
            if weight != 0:
                square += weight * differences[row] * differences[column]
        values = part[inner]
        good = np.isfinite(square) & np.isfinite(values)
        yield stop, values[good], np.sqrt(np.maximum(square[good], 0))
