"""Thousands of frames as some hundred bins of time, each with its least and its most: no spike is lost."""

from __future__ import annotations

import numpy as np


class Bins:
    """Bins of time with frames in them.

    Parameters
    ----------
    times
        (n,) when the frames began, n ≥ 1.
    most
        So many bins at most, of equal length; empty ones are left out, so that m ≤ most remain. Where there
        are at most so many frames, each is a bin.

    Attributes
    ----------
    times
        (m,) the mean time of the frames of each.
    """

    def __init__(self, times: np.ndarray, most: int):
        if len(times) <= most:
            place = np.argsort(np.argsort(times, kind="stable"), kind="stable")
        else:
            span = times.max() - times.min()
            place = np.minimum(((times - times.min()) / (span or 1.0) * most).astype(np.int64), most - 1)
        _, self._bin = np.unique(place, return_inverse=True)
        self._count = int(self._bin.max()) + 1
        self.times = self.mean(times)

    def spread(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(m,) least, median and most of what is known in each bin; NaN where nothing is."""
        known = np.isfinite(values)
        order = np.lexsort((values[known], self._bin[known]))
        sorted_values, count = values[known][order], self._per_bin(known)
        start = np.cumsum(count) - count
        filled = np.flatnonzero(count)
        first, n = start[filled], count[filled]
        middle = (sorted_values[first + (n - 1) // 2] + sorted_values[first + n // 2]) / 2
        found = np.full((3, self._count), np.nan)
        found[:, filled] = sorted_values[first], middle, sorted_values[first + n - 1]
        return found[0], found[1], found[2]

    def median(self, values: np.ndarray) -> np.ndarray:
        """(m,) of what is known in each bin; NaN where nothing is."""
        return self.spread(values)[1]

    def mean(self, values: np.ndarray) -> np.ndarray:
        """(m,) of what is known in each bin; NaN where nothing is."""
        known = np.isfinite(values)
        count = self._per_bin(known)
        total = np.bincount(self._bin[known], values[known], self._count)
        return np.where(count > 0, total / np.maximum(count, 1), np.nan)

    def _per_bin(self, known: np.ndarray) -> np.ndarray:
        return np.bincount(self._bin[known], minlength=self._count)
