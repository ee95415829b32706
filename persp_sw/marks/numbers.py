"""Round numbers for scales, and how lengths are written."""

from __future__ import annotations

import numpy as np

_STEPS = (1.0, 2.0, 5.0, 10.0)


def round_length(most: float) -> float:
    """The largest 1, 2 or 5 times a power of ten that is not more than `most` > 0."""
    power = 10.0 ** np.floor(np.log10(most))
    return float(max(step * power for step in _STEPS if step * power <= most * (1 + 1e-9)))


def ticks(low: float, high: float, count: int) -> list[float]:
    """Multiples of a 1, 2 or 5 times a power of ten within low … high, at most `count` + 1, 1 or more."""
    if not high > low:
        return [low]
    step = round_length((high - low) / count) / 2.5
    while True:
        step = round_length(step * 2.5)
        first, last = np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9)
        if last - first <= count:
            return (np.arange(first, last + 1) * step + 0.0).tolist()


def short(value: float) -> str:
    """A number for people: three digits and what stands before them, 0.02, 12.5, 1350, 2e+06."""
    if value == 0 or not np.isfinite(value):
        return f"{value:g}"
    if 1e-3 <= abs(value) < 1e5:
        digits = max(2 - int(np.floor(np.log10(abs(value)) + 1e-12)), 0)
        text = f"{value:.{digits}f}"
        return text.rstrip("0").rstrip(".") if "." in text else text
    return f"{value:.3g}"


def length_text(length: float, unit: str) -> str:
    """A length with its unit."""
    return f"{short(length)} {unit}"
