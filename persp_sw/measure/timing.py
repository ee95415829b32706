"""Times of several renderers on one path of the eye, taken in turn so that all meet the same machine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from statistics import median
from time import perf_counter
from typing import Protocol, TypeVar

import numpy as np

ROUNDS = 5  # each contestant has so many turns, and at least a frame in each
Place = TypeVar("Place")  # on the path: a View, or whatever the contestants understand
Taken = TypeVar("Taken", contravariant=True)


class Contestant(Protocol[Taken]):
    """Whoever can be timed."""

    def prepare(self, view: Taken) -> None:
        """Called before each turn; not timed."""

    def draw(self, view: Taken) -> dict[str, float]:
        """Draw one frame; `ms`, its wall time, and other milliseconds by name."""


@dataclass
class Times:
    """Milliseconds of all timed frames of one contestant, by name; `ms` is the whole frame."""

    frames: list[dict[str, float]] = field(default_factory=list)

    def figures(self) -> dict[str, float]:
        """Median, 95th and 99th percentile of each, the fastest whole frame, the number of frames.

        With few frames the upper percentiles come close to the slowest frame: see `frames`.
        """
        result: dict[str, float] = {"frames": len(self.frames)}
        for name in self.frames[0]:
            values = [frame[name] for frame in self.frames]
            result[name] = median(values)
            result[f"{name}_p95"] = float(np.quantile(values, 0.95))
            result[f"{name}_p99"] = float(np.quantile(values, 0.99))
        result["ms_min"] = min(frame["ms"] for frame in self.frames)
        return result


def time_in_turn(
    contestants: Sequence[Contestant[Place]],
    views: Sequence[Place],
    seconds: float,
    rounds: int = ROUNDS,
    after_turn: Callable[[], None] = lambda: None,
) -> list[Times]:
    """Time each contestant along `views[1:]`, over and over, for about `seconds` in all its turns.

    The order of turns is reversed from round to round, so that no contestant always follows the same one.

    Parameters
    ----------
    views
        At least two; the first is only handed to `prepare`.
    """
    path = views[1:]
    times = [Times() for _ in contestants]
    for number in range(rounds):
        order = range(len(contestants))
        for index in order if number % 2 == 0 else reversed(order):
            contestant, taken = contestants[index], times[index].frames
            contestant.prepare(views[0])
            start = perf_counter()
            while True:
                taken.append(contestant.draw(path[len(taken) % len(path)]))
                if perf_counter() - start > seconds / rounds:
                    break
            after_turn()
    return times
