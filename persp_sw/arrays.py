"""Array aliases and the checks made once, at the public door."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .errors import PerspSWError

Image: TypeAlias = NDArray[np.float32]  # (height, width, 4) linear premultiplied RGBA, row 0 on top
Matrix: TypeAlias = NDArray[np.float64]  # (3, 3) or (4, 4), target_from_source, column vectors
Points: TypeAlias = NDArray[np.float64]  # (..., 3) xyz
Voxels: TypeAlias = NDArray[np.generic]  # [z, y, x]
Vector: TypeAlias = Sequence[float] | NDArray[np.floating]  # 3 numbers, xyz

VOXEL_DTYPES = tuple(np.dtype(t) for t in (np.uint8, np.int16, np.uint16, np.float32))


def number(
    value: float, name: str, error: type[PerspSWError], low: float = -np.inf, high: float = np.inf
) -> float:
    """`value` as a finite float in [low, high], or `error` naming it; no text, truth value or array."""
    good = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    if not (good and np.isfinite(value) and low <= value <= high):
        least = "" if np.isinf(low) else f" ≥ {low:g}"
        wanted = f"must be a number{least}" if np.isinf(high) else f"lies between {low:g} and {high:g}"
        raise error(f"{name} {wanted}; given {value!r}")
    return float(value)


def vector(value: Vector, name: str, error: type[PerspSWError], length: int = 3) -> NDArray[np.float64]:
    """`value` as a finite float64 array of `length` numbers, or `error` naming it."""
    try:
        array = np.asarray(value, np.float64)
    except (TypeError, ValueError):
        raise error(f"{name} must be {length} numbers; given {value!r}") from None
    if array.shape != (length,) or not np.isfinite(array).all():
        raise error(f"{name} must be {length} finite numbers; given {value!r}")
    return array
