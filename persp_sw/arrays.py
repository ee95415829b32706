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

# Largest world coordinate: products of four, as of a wall's area squared, stay within float64.
FARTHEST = 1e60

VOXEL_DTYPES = tuple(np.dtype(t) for t in (np.uint8, np.int16, np.uint16, np.float32))

_LONGEST = 200  # characters of a value in an error


def number(
    value: float, name: str, error: type[PerspSWError], low: float = -np.inf, high: float = np.inf
) -> float:
    """`value` as a finite float in [low, high], or `error` naming it; no text, truth value or array."""
    good = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    try:
        good = good and np.isfinite(float(value))
    except OverflowError:  # a whole number beyond float64
        good = False
    if not (good and low <= value <= high):
        least = "" if np.isinf(low) else f" ≥ {low:g}"
        wanted = f"must be a number{least}" if np.isinf(high) else f"lies between {low:g} and {high:g}"
        raise error(f"{name} {wanted}; given {shown(value)}")
    return float(value)


def vector(
    value: Vector, name: str, error: type[PerspSWError], length: int = 3, largest: float = FARTHEST
) -> NDArray[np.float64]:
    """`value` as a float64 array of `length` numbers of −largest … largest, or `error` naming it."""
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "biufO":  # text, times, complex numbers
            raise TypeError
        array = array.astype(np.float64)
    except (TypeError, ValueError, OverflowError):
        raise error(f"{name} must be {length} numbers; given {shown(value)}") from None
    if array.shape != (length,) or not np.isfinite(array).all():
        raise error(f"{name} must be {length} finite numbers; given {shown(value)}")
    if (np.abs(array) > largest).any():
        raise error(f"{name} has numbers beyond ±{largest:g}; given {shown(value)}")
    return array


def shown(value: object) -> str:
    """A value as an error tells it, on one line, however long."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # a whole number of more digits than Python writes
        text = f"a {type(value).__name__} of very many digits"
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} …"
