"""What frames of the last few seconds took, for small plots."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

SECONDS = 5.0


class Row(NamedTuple):
    """A frame: when it was shown (seconds of any clock), and its figures."""

    at_s: float
    ms: float
    quality: float
    samples: float


class Recent:
    """The frames of the last `SECONDS`."""

    def __init__(self):
        self._rows: deque[Row] = deque()

    def add(self, at_s: float, figures: Mapping[str, Any], seconds: float) -> None:
        """A frame was shown."""
        self._rows.append(Row(at_s, 1e3 * seconds, float(figures["quality"]), float(figures["samples"])))
        while self._rows[0].at_s < at_s - SECONDS:
            self._rows.popleft()

    def column(self, name: str) -> NDArray[np.float64]:
        """One of `Row`'s fields; of `at_s`, seconds before the newest frame, ≤ 0."""
        values = np.array([getattr(row, name) for row in self._rows], np.float64)
        return values - values[-1] if name == "at_s" and len(values) else values
