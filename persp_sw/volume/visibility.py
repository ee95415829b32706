"""Which values can be seen, as intervals that a block's smallest and largest voxel are compared with."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .grid import Volume

# Marking blocks costs a pass for each interval; where a function has more, the narrowest gaps are closed.
_MOST_INTERVALS = 8

# What float32 arithmetic adds to an entry's number for up to 4096 entries, and to a value, relative to the
# largest that takes part: a few roundings of 6e-8.
_ENTRY_ROUNDING = 0.01
_VALUE_ROUNDING = 1e-6
# Values whose rounding exceeds this part of the table are set apart, or one of them would blur all others.
_MOST_ROUNDING = 0.25


class Visibility(Protocol):
    """What the store must know of a classification; see `optics.classification.Classification`."""

    seen: NDArray[np.int64]
    origin: float
    scale: float


class EverythingVisible:
    """A `Visibility` that skips only blocks of NaN: for measuring what skipping saves."""

    seen = np.array([0, 0, 1], np.int64)
    origin = 0.0
    scale = 0.0


def visible_intervals(visibility: Visibility, volume: Volume) -> tuple[NDArray, NDArray]:
    """Intervals of values that can be seen: (first, last), both included, of the volume's type, ascending.

    Interpolated values between two voxels low ≤ high may fetch a table entry with extinction only if low ≤
    last[n] and high ≥ first[n] for some n. Value v has entry round((v − origin)·scale) + 1, clamped; float32
    rounding, of the entry and of values up to the volume's largest, is allowed for. (A whole entry more on
    each side, the simple rule, would make air visible wherever a ramp begins at its value.)
    """
    dtype = volume.data.dtype
    limits = np.finfo(dtype) if dtype.kind == "f" else np.iinfo(dtype)
    least, most = float(limits.min), float(limits.max)
    opaque = np.concatenate([[0], np.diff(visibility.seen)[1:] > 0, [0]])  # of entries 0 … n + 1
    edges = np.diff(opaque)
    begin, end = np.flatnonzero(edges == 1) + 1, np.flatnonzero(edges == -1)  # entries begin … end are seen
    if begin.size == 0:
        return np.empty(0, dtype), np.empty(0, dtype)
    kept = np.sort(np.argsort(end[:-1] - begin[1:], kind="stable")[: _MOST_INTERVALS - 1])  # gaps, by width
    begin, end = begin[np.r_[0, kept + 1]], end[np.r_[kept, -1]]
    scale, count = visibility.scale, len(visibility.seen) - 2
    if not scale:
        return _of_type(np.full(begin.size, least), np.full(begin.size, most), dtype)
    spanned = abs(visibility.origin) + count / scale
    largest = max(map(abs, volume.value_range))
    trusted = min(largest, max(4 * spanned, _MOST_ROUNDING * count / (_VALUE_ROUNDING * scale)))
    slack = _ENTRY_ROUNDING + _VALUE_ROUNDING * trusted * scale
    first = np.where(begin == 1, least, visibility.origin + (begin - 1.5 - slack) / scale)
    last = np.where(end == count, most, visibility.origin + (end - 0.5 + slack) / scale)
    if largest > trusted:  # values that far off round coarsely: their blocks are all kept
        first, last = np.r_[least, first, trusted], np.r_[-trusted, last, most]
    within = (first <= most) & (last >= least)
    return _of_type(first[within].clip(least, most), last[within].clip(least, most), dtype)


def _of_type(first: NDArray, last: NDArray, dtype: np.dtype) -> tuple[NDArray, NDArray]:
    """The smallest intervals of numbers of `dtype` that hold no fewer of them."""
    if dtype.kind != "f":
        return np.ceil(first).astype(dtype), np.floor(last).astype(dtype)
    with np.errstate(over="ignore"):  # beyond the largest number is infinity, which no voxel is
        first = np.nextafter(first.astype(dtype), dtype.type(-np.inf))
        last = np.nextafter(last.astype(dtype), dtype.type(np.inf))
    largest = np.finfo(dtype).max
    return first.clip(-largest), last.clip(max=largest)
