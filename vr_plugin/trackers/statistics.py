"""How a tracker does: what each sensor reports, how often and how late."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from statistics import median

from .sample import Sample

WINDOW_S = 2.0
MAX_SENSORS = 64
_LONGEST = 4096


class SensorStatistics:
    """What one sensor said of one kind.

    Attributes
    ----------
    last
        The newest sample.
    count
        How many came.
    """

    def __init__(self):
        self.last: Sample | None = None
        self.count = 0
        self._recent: deque[tuple[float, float]] = deque(maxlen=_LONGEST)  # arrival, delay

    def add(self, sample: Sample, now: float) -> None:
        """Count a sample that came now."""
        self.last, self.count = sample, self.count + 1
        self._recent.append((now, now - sample.stamp))

    def rate_hz(self, now: float) -> float:
        """Samples a second over the last two seconds, or since the first if that is later."""
        self._forget(now)
        if len(self._recent) < 2:
            return 0.0
        span = now - self._recent[0][0]
        return len(self._recent) / span if span > 0 else 0.0

    def latency_s(self, now: float) -> float | None:
        """Median seconds from time stamp to arrival in the last two seconds; None if nothing came.

        Of another machine's stamps only what exceeds the fastest message's is known.
        """
        self._forget(now)
        return median(delay for _, delay in self._recent) if self._recent else None

    def _forget(self, now: float) -> None:
        while self._recent and now - self._recent[0][0] > WINDOW_S:
            self._recent.popleft()


class Statistics:
    """Statistics of all sensors, by number and kind; of more than 64 the rest is only counted."""

    def __init__(self):
        self.sensors: dict[tuple[int, str], SensorStatistics] = {}
        self.samples = 0

    def add(self, samples: Iterable[Sample], now: float) -> None:
        """Count what came now."""
        for sample in samples:
            self.samples += 1
            key = (sample.sensor, "pose" if sample.kind == "lost" else sample.kind)
            if key not in self.sensors and len(self.sensors) >= MAX_SENSORS:
                continue
            self.sensors.setdefault(key, SensorStatistics()).add(sample, now)
