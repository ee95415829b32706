"""Which ways to sample make the rungs of a ladder, and from which cost to which, by measured points."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby, pairwise
from math import log
from typing import Any

import numpy as np

from ..errors import SettingsError
from .ladder import Ladder, Point, Rung, ascending

# What another rung must be worth: so many dB more, on average over a doubling of the cost. A time that is 5 %
# wrong moves a way's curve by up to 0.4 dB (6 dB a doubling): less than this may be noise.
_WORTH = 0.5
# A rung goes on to so many times the cost where the next one becomes better, and begins as far before.
_OVERLAP = 1.25
# dB an octave before a way's first point: it will not do there, but a few per cent make no rung of their own.
_STEEP = 20.0
_CELLS = 400  # costs at which ways are compared
_PERFECT = 150.0  # dB; a picture may be equal to the truth


def ladder_from_points(
    points: Sequence[tuple[str, Mapping[str, Any], Point]],
    machine: str = "",
    volume: str = "",
    program: str = "",
) -> Ladder:
    """The ladder of measured points: (way's name, its changes, point), in any order, off the front, too.

    At each cost the rung is the way of the highest PSNR there: between measured points a straight line over
    log(cost), beyond a way's last point as at that point. A way that is better by less than 0.5 dB · octaves
    of cost makes no rung; one that is best in two stretches makes two, the second named "NAME (2)".
    Neighbours overlap by half an octave and more, as far as they were measured: so points off the front
    count, too. Where the next way begins only beyond the last one's end there is a gap, in which one stays on
    the lower rung.

    Raises
    ------
    SettingsError
        No way has two points, each slower, of higher quality and more accurate than the one before.
    """
    curves = [curve for curve in map(_curve, _ways(points)) if len(curve.rung.points) > 1]
    if not curves:
        raise SettingsError(
            "no ladder can be made: no way to sample has two points, the slower one the more accurate; "
            "measure more qualities"
        )
    ends = [cost for curve in curves for cost in (curve.costs[0], curve.costs[-1])]
    costs = np.linspace(min(ends), max(ends), _CELLS)
    rungs = []
    path = _best_path(curves, costs)
    for place, (index, first, last) in enumerate(path):
        curve = curves[index]
        low = max(curve.costs[0], costs[first] - log(_OVERLAP))
        high = min(curve.costs[-1], costs[last] + log(_OVERLAP))
        if low < high:
            rung = _between(curve, low, high)
            again = sum(other == index for other, _, _ in path[:place])
            rungs.append(replace(rung, name=f"{rung.name} ({again + 1})") if again else rung)
    return Ladder(ascending(rungs), machine, volume, program)


@dataclass(frozen=True)
class _Curve:
    """A way's own front: log(cost) and PSNR ascend."""

    rung: Rung
    costs: np.ndarray
    accuracies: np.ndarray

    def at(self, costs: np.ndarray) -> np.ndarray:
        """PSNR at log costs; before the first point it falls steeply."""
        before = np.maximum(self.costs[0] - costs, 0) / log(2)
        return np.interp(costs, self.costs, self.accuracies) - _STEEP * before


def _ways(points: Sequence[tuple[str, Mapping[str, Any], Point]]) -> list[Rung]:
    ordered = sorted(points, key=lambda item: item[0])
    ways = []
    for name, group in groupby(ordered, key=lambda item: item[0]):
        items = list(group)
        if any(point.psnr is None for _, _, point in items):
            raise SettingsError(f"points of {name!r} have no PSNR: they cannot be compared")
        ways.append(Rung(name, items[0][1], tuple(point for _, _, point in items)))
    return ways


def _curve(way: Rung) -> _Curve:
    """What of a way's points is slower, of higher quality and more accurate than all before."""
    kept: list[Point] = []
    for point in sorted(way.points, key=lambda p: (p.cost, -p.quality)):
        before = kept[-1] if kept else None
        if before is None or (
            point.cost > before.cost and point.quality > before.quality and point.psnr > before.psnr
        ):
            kept.append(replace(point, psnr=min(float(point.psnr), _PERFECT)))
    return _Curve(
        replace(way, points=tuple(kept)),
        np.log([point.cost for point in kept]),
        np.array([point.psnr for point in kept]),
    )


def _best_path(curves: Sequence[_Curve], costs: np.ndarray) -> list[tuple[int, int, int]]:
    """(way, first, last cell): the way at each cost, of the largest sum of PSNR less the changes' price.

    Dynamic programming (Viterbi), cell by cell.
    """
    values = np.array([curve.at(costs) for curve in curves])
    octaves = (costs[1] - costs[0]) / log(2)
    price = _WORTH / octaves
    total, came_from = values[:, 0], []
    for cell in range(1, len(costs)):
        best = int(np.argmax(total))
        stays = total >= total[best] - price
        came_from.append(np.where(stays, np.arange(len(curves)), best))
        total = np.where(stays, total, total[best] - price) + values[:, cell]
    path = [int(np.argmax(total))]
    for previous in reversed(came_from):
        path.append(int(previous[path[-1]]))
    path.reverse()
    changes = [0, *(n for n in range(1, len(path)) if path[n] != path[n - 1]), len(path)]
    return [(path[first], first, end - 1) for first, end in pairwise(changes)]


def _between(curve: _Curve, low: float, high: float) -> Rung:
    """The part of a way between two log costs, with its measured points inside."""
    inner = slice(bisect_right(curve.costs, low + 0.01), int(np.searchsorted(curve.costs, high - 0.01)))
    ends = []
    for cost, end in ((low, 0), (high, -1)):
        if cost == curve.costs[end]:
            ends.append(curve.rung.points[end])
            continue
        quality = curve.rung.quality_at(float(np.exp(cost)))
        ends.append(Point(quality, float(np.exp(cost)), float(curve.at(np.array(cost)))))
    return replace(curve.rung, points=(ends[0], *curve.rung.points[inner], ends[1]))
