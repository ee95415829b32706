"""The ladder of settings from the fastest to the most accurate: measured points as data, no measuring."""

from __future__ import annotations

import json
import os
import re
from bisect import bisect_left
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from math import exp, isfinite, log
from pathlib import Path
from typing import Any
from zlib import crc32

from ..errors import SettingsError
from ..settings import Settings

FORMAT = 2


@dataclass(frozen=True)
class Point:
    """One measured setting: its PSNR and `cost`, compositing time in a unit all points of a ladder share."""

    quality: float
    cost: float
    psnr: float | None = None


@dataclass(frozen=True)
class Rung:
    """One way to sample, at any quality between its first and its last point.

    Attributes
    ----------
    changes
        What it sets in `Settings`, besides the quality.
    points
        At least two, quality and cost both ascending.
    """

    name: str
    changes: Mapping[str, Any]
    points: tuple[Point, ...]

    @property
    def lowest(self) -> float:
        """Least quality."""
        return self.points[0].quality

    @property
    def highest(self) -> float:
        """Largest quality."""
        return self.points[-1].quality

    def cost_at(self, quality: float) -> float:
        """log(cost) linear in log(quality) between points, and on beyond them."""
        return _interpolate(quality, [p.quality for p in self.points], [p.cost for p in self.points])

    def quality_at(self, cost: float) -> float:
        """Inverse of `cost_at`, within the rung's own qualities."""
        quality = _interpolate(cost, [p.cost for p in self.points], [p.quality for p in self.points])
        return min(max(quality, self.lowest), self.highest)

    def settings(self, base: Settings, quality: float) -> Settings:
        """The settings at a quality of this rung, all else as in `base`."""
        return replace(base, quality=quality, intermediate_size=None, **self.changes)

    def limited(self, lowest: float, highest: float) -> Rung | None:
        """The part between two qualities; None if there is none."""
        low, high = max(lowest, self.lowest), min(highest, self.highest)
        if low >= high:
            return None
        inner = [p for p in self.points if low < p.quality < high]
        ends = [Point(q, self.cost_at(q)) for q in (low, high)]
        return replace(self, points=(ends[0], *inner, ends[1]))


@dataclass(frozen=True)
class Ladder:
    """Rungs in the order in which they are climbed.

    Neighbours should overlap in cost, so that one can stay on either about the place where one would change.

    Attributes
    ----------
    machine, volume
        What it was measured on; empty for the built-in ladder, which fits all.
    program
        Which version of the program was measured.

    Raises
    ------
    SettingsError
        No rung, points or rungs that do not ascend, settings that do not exist.
    """

    rungs: tuple[Rung, ...]
    machine: str = ""
    volume: str = ""
    program: str = ""

    def __post_init__(self):
        problems = [problem for rung in self.rungs for problem in _problems_of(rung)]
        if not self.rungs:
            problems = ["it has no rung"]
        if len({rung.name for rung in self.rungs}) < len(self.rungs):
            problems.append("two rungs have one name")
        if not problems:
            for one, other in pairwise(self.rungs):
                (low, high), (next_low, next_high) = (
                    (r.points[0].cost, r.points[-1].cost) for r in (one, other)
                )
                if not (low < next_low and high < next_high):
                    problems.append(f"rungs {one.name!r} and {other.name!r} do not ascend in cost")
        if problems:
            raise SettingsError(f"this is no ladder of settings: {'; '.join(problems)}")

    @classmethod
    def default(cls) -> Ladder:
        """Quality alone, all else as the user set it: good anywhere, best nowhere.

        Cost is taken for the square of quality, as pixels are; how far from it a scene is, is learnt.
        """
        return cls((Rung("as set", {}, tuple(Point(q, c) for q, c in _DEFAULT)),))

    def limited(self, lowest: float, highest: float) -> Ladder:
        """The rungs' parts between two qualities; what then goes beyond no other rung is left out.

        Raises
        ------
        SettingsError
            Nothing is left.
        """
        kept = [rung for r in self.rungs if (rung := r.limited(lowest, highest)) is not None]
        if not kept:
            raise SettingsError(f"no rung has qualities between {lowest:g} and {highest:g}: widen the limits")
        return replace(self, rungs=ascending(kept))

    def extended(self, lowest: float, highest: float) -> Ladder:
        """The same rungs, the first down to a quality and the last up to one, as their costs go on there."""
        first, *rest = self.rungs
        if lowest < first.lowest:
            first = replace(first, points=(Point(lowest, first.cost_at(lowest)), *first.points))
        *before, last = first, *rest
        if highest > last.highest:
            last = replace(last, points=(*last.points, Point(highest, last.cost_at(highest))))
        return replace(self, rungs=(*before, last))

    def fits(self, machine: str, volume: str) -> bool:
        """Whether it was measured on this machine and volume."""
        return (self.machine, self.volume) == (machine, volume)

    def save(self, folder: Path) -> Path:
        """Write it where `load` looks for it; returns the file's path."""
        path = _path(folder, self.machine, self.volume)
        path.parent.mkdir(parents=True, exist_ok=True)
        contents: dict[str, Any] = {"format": FORMAT}
        contents |= {name: getattr(self, name) for name in ("machine", "volume", "program")}
        contents["rungs"] = [asdict(replace(rung, changes=dict(rung.changes))) for rung in self.rungs]
        part = path.with_name(f"{path.stem}-{os.getpid()}.part")
        part.write_text(json.dumps(contents, indent=1) + "\n", encoding="utf-8")
        part.replace(path)  # whole or not at all
        return path

    @classmethod
    def load(cls, folder: Path, machine: str, volume: str) -> Ladder:
        """The ladder saved for this machine and volume, or the built-in one where there is none.

        Raises
        ------
        SettingsError
            The file is there and is no ladder.
        """
        path = _path(folder, machine, volume)
        if not path.is_file():
            return cls.default()
        try:
            contents = json.loads(path.read_text(encoding="utf-8"))
            if contents["format"] != FORMAT:
                return cls.default()  # of another version: to be measured anew
            rungs = [
                Rung(r["name"], dict(r["changes"]), tuple(Point(**point) for point in r["points"]))
                for r in contents["rungs"]
            ]
            names = (str(contents[name]) for name in ("machine", "volume", "program"))
            ladder = cls(tuple(rungs), *names)
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
            raise SettingsError(f"{path} is no ladder of settings ({error}); delete it") from None
        return ladder if ladder.fits(machine, volume) else cls.default()


def ascending(rungs: Iterable[Rung]) -> tuple[Rung, ...]:
    """Those that begin and end at a higher cost than the one kept before them."""
    kept: list[Rung] = []
    for rung in rungs:
        if not kept or all(kept[-1].points[end].cost < rung.points[end].cost for end in (0, -1)):
            kept.append(rung)
    return tuple(kept)


# (quality, cost relative to quality 1)
_DEFAULT = ((0.05, 0.0025), (1.0, 1.0), (8.0, 64.0))


def _problems_of(rung: Rung) -> list[str]:
    """What is wrong with a rung by itself."""
    where = f"rung {rung.name!r}"
    if len(rung.points) < 2:
        return [f"{where} has fewer than two points"]
    problems = []
    for name in ("quality", "cost"):
        values = [getattr(point, name) for point in rung.points]
        if not all(isinstance(v, int | float) and isfinite(v) and v > 0 for v in values):
            return [f"{where}: {name} is a positive number everywhere; given {values}"]
        if any(b <= a for a, b in pairwise(values)):
            problems.append(f"{where}: {name} must ascend; given {values}")
    try:
        for point in rung.points:
            rung.settings(Settings(), point.quality)
    except (TypeError, SettingsError) as error:
        problems.append(f"{where}: {error}")
    return problems


def _path(folder: Path, machine: str, volume: str) -> Path:
    """A name that people can read, told apart by what it is a ladder of."""
    clean = (re.sub(r"[^A-Za-z0-9.]+", "-", text).strip("-")[:60] or "any" for text in (machine, volume))
    return Path(folder) / f"ladder_{'_'.join(clean)}_{crc32(f'{machine}|{volume}'.encode()):08x}.json"


def _interpolate(x: float, xs: Sequence[float], ys: Sequence[float]) -> float:
    """Piecewise linear in logarithms, beyond the ends as in the first and last piece."""
    n = min(max(bisect_left(xs, x), 1), len(xs) - 1)
    x0, x1, y0, y1 = (log(v) for v in (xs[n - 1], xs[n], ys[n - 1], ys[n]))
    return exp(y0 + (y1 - y0) * (log(x) - x0) / (x1 - x0))
