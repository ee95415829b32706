"""A two-dimensional transfer function as a table that kernels look up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..volume.gradient import largest_magnitude
from ..volume.grid import Volume
from ..volume.lift import lift_exponent
from .classification import Classification
from .transfer import TransferFunction
from .transfer2d import TransferFunction2D

# 1 MB of rows: with more, look-ups leave the second-level cache.
_VALUES = 511
_MAGNITUDES = 128
_LARGEST = float(np.finfo(np.float32).max)


@dataclass(frozen=True, eq=False)
class Classification2D(Classification):
    """A `TransferFunction2D` sampled for one volume.

    Attributes
    ----------
    table
        Of each value the row of the magnitude at which it is seen best: what is transparent here is so at
        every magnitude, which is all that runs ask.
    rows
        (magnitudes · (n + 1), 4) float32: magnitude m has the rows m·(n + 1) … as `Classification.table` has
        them, m = round(magnitude · per_magnitude), the last row of magnitudes for all beyond.
    per_magnitude
        Of magnitudes a world unit, of values as `volume.lift` brings them near 1.

    Accuracy: nearest entry; the error is at most a quarter of a grey level of 8-bit values, 1/1016 of the
    shapes' extent of others, and 1/252 of their largest magnitude.
    """

    all_rows: NDArray[np.float32]
    magnitudes: int
    per_magnitude: float

    @property
    def rows(self) -> NDArray[np.float32]:
        """See above."""
        return self.all_rows

    @classmethod
    def of_shapes(cls, transfer: TransferFunction2D, volume: Volume) -> Classification2D:
        """Sample `transfer`; its opacity unit is the volume's smallest spacing where it has none."""
        transfer, lift = transfer.with_unit(min(volume.spacing)), lift_exponent(volume)
        if volume.data.dtype == np.uint8:
            origin, scale = 0.0, 2.0
        else:
            low = max(min(shape.values[0] for shape in transfer.shapes), volume.value_range[0])
            high = min(max(shape.values[1] for shape in transfer.shapes), volume.value_range[1])
            # An entry beyond each end, where there is nothing: values further out have the last one.
            step = max((high - low) / (_VALUES - 3), np.spacing(max(abs(low), abs(high), 1e-300)) * 4)
            origin, scale = low - step, 1 / step
        top = max(shape.magnitudes[1] for shape in transfer.shapes)
        top = min(top, largest_magnitude(volume, 0.5)) or 1.0
        per_magnitude = (_MAGNITUDES - 2) / top
        values = origin + np.arange(_VALUES) / scale
        magnitudes = np.arange(_MAGNITUDES)[:, None] / per_magnitude
        rows = np.zeros((_MAGNITUDES, _VALUES + 1, 4), np.float32)
        rows[:, 1:, :3] = transfer.colour(values, magnitudes)
        rows[:, 1:, 3] = np.minimum(transfer.extinction(values, magnitudes), _LARGEST)
        best = rows[..., 3].argmax(0)
        table = rows[best, np.arange(_VALUES + 1)]
        seen = np.concatenate([[0], np.cumsum(table[:, 3] > 0)]).astype(np.int64)
        return cls(
            table,
            seen,
            float(np.ldexp(origin, lift)),
            float(np.ldexp(scale, -lift)),
            rows.reshape(-1, 4),
            _MAGNITUDES,
            float(np.ldexp(per_magnitude, -lift)),
        )


def classify(transfer: TransferFunction | TransferFunction2D, volume: Volume) -> Classification:
    """Either kind of transfer function as a table."""
    if isinstance(transfer, TransferFunction2D):
        return Classification2D.of_shapes(transfer, volume)
    return Classification.of(transfer, volume)
