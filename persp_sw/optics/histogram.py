"""What a volume's values tell about it: where the background ends and what stands out of it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..volume.grid import Volume

_BINS = 256
_MOST_VOXELS = 2_000_000  # a regular subset of larger volumes is enough for quantiles


@dataclass(frozen=True)
class Histogram:
    """Landmarks among a volume's finite values.

    Attributes
    ----------
    low, high
        Smallest value, and the largest but for 0.05 % stray ones.
    background
        The most frequent value: air, or nothing.
    threshold
        Above it lies material: the valley before the foremost peak, or where the tail of the background ends.
    main
        The foremost peak above the background; the threshold where there is none.
    split
        What parts the material best into a light and a dense half (Otsu 1979).
    peak_width
        Width of the main peak at half its height, relative to its distance from the background.
    falling
        Above the background values only get rarer: there is no peak.
    noise_floor
        The background itself is spread to both sides, as a camera's or a detector's is.
    hounsfield
        The values look like Hounsfield units: air near −1000 and tissue near 0, or signed whole numbers from
        0 to the thousands that fall off, as in a scan clipped at 0.
    dense_fraction
        Part of the voxels above 300.
    """

    low: float
    high: float
    background: float
    threshold: float
    main: float
    split: float
    peak_width: float
    falling: bool
    noise_floor: bool
    hounsfield: bool
    dense_fraction: float
    material: NDArray[np.float64] = field(repr=False)

    @classmethod
    def of(cls, volume: Volume) -> Histogram:
        """The landmarks of `volume`, from a regular subset of at most two million voxels."""
        data = volume.data
        stride = max(1, int(np.ceil((data.size / _MOST_VOXELS) ** (1 / 3))))
        values = data[::stride, ::stride, ::stride].ravel()
        values = values[np.isfinite(values)] if volume.nonfinite else values
        values = np.sort(values.astype(np.float64))
        if values.size == 0:  # the subset met only NaN
            values = np.array(volume.value_range)
        low, high = float(values[0]), float(np.quantile(values, 0.9995))
        if high <= low:
            high = float(values[-1])
        if high <= low:
            half = 0.5 * max(abs(low), 1.0)  # one value: all of it counts as material
            return cls(
                low, low, low - 2 * half, low - half, low, low, 0.0, True, False, False, 0.0, values[:1]
            )
        counts, centres = _bins(values, low, high)
        mode = int(np.argmax(counts))
        background = low if mode == 0 else float(centres[mode])
        top, valley, width = _peak(counts, mode)
        falling = top is None
        if falling:
            threshold = main = background + 0.06 * (high - background)
            if (noise := _spread_below(values, background)) > 0:
                above_noise = min(background + 4 * noise, background + 0.5 * (high - background))
                threshold = main = max(threshold, above_noise)  # a field that swings is no noise all the way
        else:
            main = float(centres[top])
            threshold = float(centres[valley]) + 0.1 * (main - float(centres[valley]))
        material = values[values > threshold]
        clipped = data.dtype.kind == "i" and falling and low >= 0 and high > 1000
        return cls(
            low=low,
            high=high,
            background=background,
            threshold=threshold,
            main=main,
            split=_otsu(counts, centres, int(np.searchsorted(centres, threshold))),
            peak_width=width * float(centres[1] - centres[0]) / max(main - background, 1e-300),
            falling=falling,
            noise_floor=_spread_below(values, background) > 0.005 * (high - low),
            hounsfield=clipped or _is_hounsfield(values),
            dense_fraction=float(np.mean(values > 300)),
            material=material if material.size else np.array([threshold, high]),
        )

    def level(self, part: float) -> float:
        """The value that `part` (0 … 1) of the material lies below."""
        return float(np.quantile(self.material, part))

    def between(self, part: float) -> float:
        """The value `part` of the way from the threshold to the main peak, beyond it for `part` > 1."""
        return min(self.threshold + part * (self.main - self.threshold), self.high)

    def span(self, part: float) -> float:
        """The value `part` of the way from the background to the highest."""
        return self.background + part * (self.high - self.background)


def _bins(
    values: NDArray[np.float64], low: float, high: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Counts and centres: 256 bins, or as many as there are levels where a scan has fewer."""
    levels = np.unique(values[:: max(1, values.size // 200_000)])
    levels = levels[levels <= high]
    step = np.diff(levels).min(initial=np.inf)
    bins = int(np.clip(round((high - low) / step) + 1, 8, _BINS)) if np.isfinite(step) else _BINS
    half = 0.5 * (high - low) / (bins - 1)
    counts, edges = np.histogram(values, bins, (low - half, high + half))
    return counts.astype(np.float64), 0.5 * (edges[1:] + edges[:-1])


def _peak(counts: NDArray[np.float64], mode: int) -> tuple[int | None, int, int]:
    """The highest peak after a valley beyond the mode, that valley, and the peak's width, in bins.

    A peak must be 1.3 times as high as the valley, and what lies beyond the valley an eighth of all that
    is not background; the uppermost bins, where a scan saturates, make none.
    """
    reach = max(1, len(counts) // 64)
    smooth = np.convolve(np.pad(counts, reach, "edge"), np.full(2 * reach + 1, 1 / (2 * reach + 1)), "valid")
    smooth += counts.sum() * 2e-5  # valleys of next to nothing make no peaks
    first, last = mode + 1, max(mode + 2, int(0.97 * len(counts)))
    tail = smooth[first:last]
    if tail.size < 3:
        return None, mode, 0
    skip = min(int(0.03 * len(counts)), tail.size - 1)  # the background's own foot
    beyond = np.cumsum(counts[:mode:-1])[::-1][: last - first]
    ends = np.maximum.accumulate(np.where(tail <= np.minimum.accumulate(tail), np.arange(tail.size), 0))
    rises = (tail >= 1.3 * np.minimum.accumulate(tail)) & (beyond[ends] >= 0.12 * beyond[skip])
    if not rises.any():
        return None, mode, 0
    top = int(np.argmax(np.where(rises, tail, -1)))
    lowest = tail[: top + 1].min()
    valley = int(np.flatnonzero(tail[: top + 1] <= lowest * 1.05)[-1])
    half = tail[top] / 2
    left = top - int(np.argmax(tail[top::-1] < half)) if (tail[:top] < half).any() else 0
    right = top + int(np.argmax(tail[top:] < half)) if (tail[top:] < half).any() else len(tail) - 1
    return first + top, first + valley, right - left


def _spread_below(values: NDArray[np.float64], background: float) -> float:
    """Standard deviation of the background, from the values under it; 0 where there are hardly any."""
    below = values[: int(np.searchsorted(values, background))]
    if below.size < 0.02 * values.size:
        return 0.0
    return float(np.sqrt(np.mean((below - background) ** 2)))


def _otsu(counts: NDArray[np.float64], centres: NDArray[np.float64], first: int) -> float:
    """The value from bin `first` on that parts the voxels into the two classes farthest apart (Otsu 1979)."""
    weights, centres = counts[first:], centres[first:]
    if np.count_nonzero(weights) < 2:
        return float(centres[-1] if centres.size else 0.0)
    below, moment = np.cumsum(weights)[:-1], np.cumsum(weights * centres)[:-1]
    above, rest = weights.sum() - below, (weights * centres).sum() - moment
    with np.errstate(divide="ignore", invalid="ignore"):
        spread = below * above * (moment / below - rest / above) ** 2
    best = int(np.nanargmax(np.where((below > 0) & (above > 0), spread, -1)))
    return float(0.5 * (centres[best] + centres[best + 1]))


def _is_hounsfield(values: NDArray[np.float64]) -> bool:
    """Air (below −700) and tissue (−200 … 300) both well filled, nothing absurdly low."""
    air, tissue = np.mean(values < -700), np.mean((values > -200) & (values < 300))
    return bool(air > 0.02 and tissue > 0.02 and np.quantile(values, 0.01) >= -4096)


def value_counts(volume: Volume, bins: int = 256) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """How often values occur, for pictures of a histogram: from a subset, as `Histogram`'s landmarks are.

    Returns
    -------
    counts
        (bins,): of the subset's voxels.
    edges
        (bins + 1,): the bins' borders, from the smallest to the largest value.
    """
    data = volume.data
    stride = max(1, int(np.ceil((data.size / _MOST_VOXELS) ** (1 / 3))))
    values = data[::stride, ::stride, ::stride]
    low, high = volume.value_range
    if high <= low:
        low, high = low - 0.5, low + 0.5
    return np.histogram(values[np.isfinite(values)], bins, (low, high))
