"""How noisy frames are, and whether their load has changed: of a series of residuals."""

from __future__ import annotations

from collections import deque
from math import log
from statistics import median
from typing import NamedTuple

# Frames whose noise is judged: their median hears nothing of a spike or a step.
_MEMORY = 45
# As if so many had been seen before.
_FIRST_NOISE, _PRIOR, _LEAST_NOISE = 0.10, 9, 0.03
# median |a − b| of two normal numbers of deviation 1 is 0.954; a tenth more, for noise is rarely normal.
_DEVIATION = 1.1 / 0.954
# Two-sided cumulative sum (Page 1954): drift ½ finds a shift of one deviation soonest; at 8 normal noise
# raises a false alarm once in some 9500 frames (Siegmund's approximation), and one deviation is found in 16.
# While nothing changes the threshold grows with the logarithm of time, so that the rate of false alarms,
# which falls with its exponential, has a finite sum.
_DRIFT, _ALARM, _PATIENCE, _GROWTH = 0.5, 8.0, 60, 2.0
# A single residual counts up to this many deviations, so that a few spikes are no alarm.
_CLIP = 2.5
# Some in a row beyond this, and not small, are a step, found at once: two, or more where single ones are
# frequent, so that noise makes such a run less often than this.
_STEP, _LEAST_STEP, _RARE = 3.5, 0.15, 1e-4
_RARITY, _RARITY_GAIN = 0.01, 0.01


class Shift(NamedTuple):
    """A change of load: by how much, log, and from how many residuals that is known."""

    size: float
    frames: int


class LoadWatch:
    """Watches residuals log(measured / predicted) of a model that follows slow changes by itself."""

    def __init__(self):
        self._differences = deque([_FIRST_NOISE / _DEVIATION] * _PRIOR, maxlen=_MEMORY)
        self._spikes = _RARITY  # part of the frames that are beyond a step without being one
        self.restart()

    @property
    def noise(self) -> float:
        """Standard deviation of a frame's log cost."""
        return max(_LEAST_NOISE, _DEVIATION * median(self._differences))

    def restart(self) -> None:
        """What comes belongs to another load; the noise stays."""
        self._last: float | None = None
        self._run: list[float] = []  # residuals beyond a step, all of one sign
        self._sums = {1: (0.0, 0.0, 0), -1: (0.0, 0.0, 0)}  # cumulative sum, sum of residuals, their number
        self._quiet = 0

    def see(self, residual: float, spread: float) -> Shift | None:
        """The next residual; spread: its standard deviation, noise and the model's uncertainty together."""
        if self._last is not None:
            self._differences.append(abs(residual - self._last))
        self._last = residual
        self._quiet += 1
        shift = self._step(residual, abs(residual) > max(_STEP * spread, _LEAST_STEP))
        alarm = _ALARM + _GROWTH * max(log(self._quiet / _PATIENCE), 0.0)
        for sign, (total, residuals, count) in self._sums.items():
            total += min(max(sign * residual / spread, -_CLIP), _CLIP) - _DRIFT
            if total <= 0:
                self._sums[sign] = (0.0, 0.0, 0)
                continue
            residuals, count = residuals + residual, count + 1
            self._sums[sign] = (total, residuals, count)
            if total > alarm and shift is None:
                shift = Shift(residuals / count, count)
        if shift is not None:
            self.restart()
        return shift

    def _step(self, residual: float, beyond: bool) -> Shift | None:
        """Whether residuals so far off have come in a row that noise does not make."""
        if self._run and not (beyond and residual * self._run[0] > 0):
            self._spikes += _RARITY_GAIN * len(self._run)
            self._run = []
        self._spikes *= 1 - _RARITY_GAIN
        if not beyond:
            return None
        self._run.append(residual)
        rarity = min(max(self._spikes, _RARITY), 0.2)
        if len(self._run) < log(_RARE) / log(rarity) - 1e-9:
            return None
        return Shift(sum(self._run) / len(self._run), len(self._run))
