"""Another machine's clock, mapped to ours."""

from __future__ import annotations

import math
from collections.abc import Sequence

WINDOW_S = 10.0
JUMP_S = 0.5
PERSIST = 5
STALL_S = 10.0
LARGEST_S = 1e11  # some 3000 years; beyond, float64 has no microseconds left


class ClockMap:
    """Maps foreign time stamps to our clock by the least delay seen: what came fastest tells the offset best.

    Parameters
    ----------
    window
        Seconds after which a least delay is forgotten, at most twice that: clocks drift against each other by
        up to 1e-4, which is 2 ms in this time.
    jump
        A stamp that disagrees with the offset by more than this, in seconds, is not believed at once. Where
        `persist` polls in a row agree that it is so, the foreign clock has been set (at midnight, say), and a
        new offset begins. Until then it is taken as measured on arrival, or, where it is only late by up to
        10 s, as what it says: a network that stalls brings old messages in one heap.

    Accuracy: a mapped stamp is late by the least delay of the last `window` … 2 · `window` seconds, and never
    after its arrival.
    """

    def __init__(self, window: float = WINDOW_S, jump: float = JUMP_S, persist: int = PERSIST):
        self.window, self.jump, self.persist = window, jump, persist
        self.jumps = 0
        self._least = self._previous = math.inf  # in this window, and in the one before
        self._window_start = -math.inf
        self._strange: list[float] = []
        self._strange_arrival = -math.inf

    @property
    def offset(self) -> float | None:
        """Seconds of ours minus foreign seconds; None before the first stamp."""
        least = min(self._least, self._previous)
        return least if math.isfinite(least) else None

    def all_ours(self, stamps: Sequence[float], arrival: float) -> list[float]:
        """`ours` of what came together, in its order; the last, which came fastest, tells of the others."""
        return [self.ours(stamp, arrival) for stamp in reversed(stamps)][::-1]

    def ours(self, stamp: float, arrival: float) -> float:
        """When something happened, on our clock.

        Parameters
        ----------
        stamp
            Foreign seconds; NaN, infinity or more than 1e11 count as no stamp: measured on arrival.
        arrival
            Our seconds when it came.
        """
        if not -LARGEST_S < stamp < LARGEST_S:  # NaN, too
            return arrival
        offset = arrival - stamp
        known = self.offset
        if known is not None and abs(offset - known) > self.jump:
            if self._strange and abs(offset - self._strange[-1]) > self.jump:
                self._strange.clear()
            if not self._strange or arrival > self._strange_arrival:
                self._strange.append(offset)
                self._strange_arrival = arrival
            if len(self._strange) < self.persist:
                return stamp + known if 0 < offset - known < STALL_S else arrival
            self.jumps += 1
            self._previous, self._least = math.inf, min(self._strange)
            self._window_start = arrival
        elif arrival - self._window_start > self.window:
            # A long silence makes both windows old.
            old = arrival - self._window_start > 2 * self.window
            self._previous, self._least = math.inf if old else self._least, offset
            self._window_start = arrival
        self._strange.clear()
        self._least = min(self._least, offset)
        return min(stamp + min(self._least, self._previous), arrival)
