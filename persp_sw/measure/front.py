"""The front: settings that no other beats in both time and accuracy, and where to look for them."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .modes import Changes

# A trial is a few frames: what it takes for slower by less than this may be on the front.
_SLACK = 1.1


@dataclass(frozen=True)
class Way:
    """A way to make pictures, at any quality: how rays are sampled, and which options are not as usual."""

    sampling: str
    varied: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """For people."""
        return ", ".join((self.sampling, *self.varied))


class Trial(NamedTuple):
    """A first look at one way and quality: milliseconds, PSNR, and what tells its picture from others."""

    ms: float
    psnr: float
    picture: Hashable


@dataclass(frozen=True)
class Space:
    """What is searched.

    Attributes
    ----------
    sampling
        Ways to sample by name, tried at each quality.
    options
        For each option the values, by name, that it may have instead of the usual one.
    qualities
        Ascending.
    """

    sampling: Mapping[str, Changes]
    options: Mapping[str, Mapping[str, Changes]]
    qualities: Sequence[float]

    def changes(self, way: Way) -> Changes:
        """What a way sets in `Settings`."""
        values = {name: changes for option in self.options.values() for name, changes in option.items()}
        merged = dict(self.sampling[way.sampling])
        for name in way.varied:
            merged |= values[name]
        return merged


def front(ms: Sequence[float], psnr: Sequence[float]) -> list[int]:
    """Indices of the points that no other beats in both time and accuracy, fastest first."""
    order = sorted(range(len(ms)), key=lambda n: (ms[n], -psnr[n]))
    kept, best = [], -np.inf
    for index in order:
        if psnr[index] > best:
            kept.append(index)
            best = psnr[index]
    return kept


def near_front(ms: Sequence[float], psnr: Sequence[float], slack: float = _SLACK) -> list[int]:
    """Indices of the points that no other, at least as accurate, is faster than by more than `slack`."""
    return [
        n
        for n in range(len(ms))
        if not any(m * slack < ms[n] and p >= psnr[n] for m, p in zip(ms, psnr, strict=True))
    ]


def search(space: Space, trial: Callable[[Way, float], Trial]) -> list[tuple[Way, float]]:
    """Ways and qualities to measure: the grid of sampling × quality, and what lies on or near the front.

    First the whole grid is tried. Then one option after the other is varied for the points that are near the
    front by then, and for the next quality on either side, so that a way has more than a point. What changes
    no pixel is left out. Options are varied one by one, each for the best of those before: that finds all of
    the front where they do not depend on one another, and most of it where they do a little.

    Parameters
    ----------
    trial
        Tries a way at a quality; called once for each.
    """
    tried = {(Way(name), quality): None for name in space.sampling for quality in space.qualities}
    grid = list(tried)
    for way, quality in grid:
        tried[way, quality] = trial(way, quality)
    for values in space.options.values():
        for way, quality in _beside(_near(tried), space.qualities):
            for name in values:
                new = Way(way.sampling, (*way.varied, name)), quality
                if (way, quality) not in tried:  # a neighbour of a varied way, itself not tried
                    continue
                found = trial(*new)
                if found.picture != tried[way, quality].picture:
                    tried[new] = found
    wanted = dict.fromkeys((*grid, *_beside(_near(tried), space.qualities)))
    return [point for point in wanted if point in tried]


def _near(tried: Mapping[tuple[Way, float], Trial]) -> list[tuple[Way, float]]:
    points = list(tried)
    kept = near_front([tried[p].ms for p in points], [tried[p].psnr for p in points])
    return [points[n] for n in kept]


def _beside(points: Sequence[tuple[Way, float]], qualities: Sequence[float]) -> list[tuple[Way, float]]:
    """Points, and the same ways at the next quality on either side, without repetition."""
    wanted: dict[tuple[Way, float], None] = {}
    for way, quality in points:
        place = list(qualities).index(quality)
        for near in qualities[max(place - 1, 0) : place + 2]:
            wanted[way, near] = None
    return list(wanted)
