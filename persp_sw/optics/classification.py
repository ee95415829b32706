"""The transfer function as a table that kernels look up."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..volume.grid import Volume
from ..volume.lift import lift_exponent
from .preintegration import Preintegration
from .transfer import TransferFunction

# Entries per grey level of 8-bit data; 2,041 entries of 16 bytes stay in the first-level cache.
_PER_LEVEL = 8
# Entries for other data, over the values the function tells apart: 12 bits.
_ENTRIES = 4096
_LARGEST = float(np.finfo(np.float32).max)


@dataclass(frozen=True, eq=False)
class Classification:
    """A transfer function sampled for one volume.

    Attributes
    ----------
    table
        (n + 1, 4) float32: linear r, g, b (not premultiplied) and extinction per world unit. Row 0 is
        transparent and stands for "no value" (NaN); value v has row round((v − origin)·scale) + 1, clamped
        to 1 … n.
    seen
        (n + 2,) int64: number of rows with extinction > 0 before each row.
    origin, scale
        Of values as `volume.lift` brings them near 1, where kernels can scale them in float32.

    Accuracy: nearest entry; the error in value is at most 1 / (2·scale), which is 1/16 of a grey level for
    8-bit volumes and 1/8192 of the interval that the function tells apart for others. Integer values of 8-bit
    volumes hit their entries exactly.
    """

    table: NDArray[np.float32]
    seen: NDArray[np.int64]
    origin: float
    scale: float

    @classmethod
    def of(cls, transfer: TransferFunction, volume: Volume) -> Classification:
        """Sample `transfer`; its opacity unit is the volume's smallest spacing where it has none."""
        transfer, lift = transfer.with_unit(min(volume.spacing)), lift_exponent(volume)
        if volume.data.dtype == np.uint8:
            origin, scale, entries = 0.0, float(_PER_LEVEL), 255 * _PER_LEVEL + 1
        else:
            low, high = _told_apart(transfer, volume)
            origin, entries = low, _ENTRIES
            scale = (entries - 1) / (high - low) if high > low else 0.0
            most = np.ldexp(_LARGEST, lift)
            if scale > most:  # float32 cannot tell so many of these values apart
                scale, entries = most, int(np.ceil((high - low) * most)) + 1
        values = origin + np.arange(entries) / scale if scale else np.full(1, origin)
        table = np.zeros((len(values) + 1, 4), np.float32)
        table[1:, :3] = transfer.colour(values)
        table[1:, 3] = np.minimum(transfer.extinction(values), _LARGEST)
        seen = np.concatenate([[0], np.cumsum(table[:, 3] > 0)]).astype(np.int64)
        return cls(table, seen, float(np.ldexp(origin, lift)), float(np.ldexp(scale, -lift)))

    @property
    def rows(self) -> NDArray[np.float32]:
        """`table` for each magnitude that is told apart, one after the other: here for one, which is any."""
        return self.table

    magnitudes = 1
    per_magnitude = 0.0

    def hides_like(self, other: Classification) -> bool:
        """Whether both have the same extinction for every value and magnitude: colours alone may differ."""
        same = (self.origin, self.scale, self.magnitudes, self.per_magnitude) == (
            other.origin, other.scale, other.magnitudes, other.per_magnitude
        )  # fmt: skip
        return same and np.array_equal(self.rows[:, 3], other.rows[:, 3])

    @cached_property
    def integrals(self) -> Preintegration:
        """The table's integrals, made when they are first asked for."""
        return Preintegration.of(self.table)

    @cached_property
    def largest_extinction(self) -> float:
        """Largest extinction of any entry, per world unit."""
        return float(self.table[:, 3].max())


def _told_apart(transfer: TransferFunction, volume: Volume) -> tuple[float, float]:
    """The part of the volume's value range in which the function is not constant."""
    low, high = volume.value_range
    first, last = transfer.values[0], transfer.values[-1]
    if len(transfer.values) > 1 and transfer.values[1] == first:
        first -= ((last - first) or (high - low)) / 256  # a step at the first point: what is below it counts
    first, last = max(low, first), min(high, last)
    if last <= first:  # constant over all of the volume's values
        middle = float(np.clip(first, low, high))
        return middle, middle
    return float(first), float(last)
