"""Recorded frame costs, played back to a rule that chooses quality: on a counted clock, the same every time.

`benchmarks/record_costs.py` records. Costs between recorded poses and qualities are interpolated, in time and
in log(quality); nothing here knows of a cost model.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..quality.controller import Choice
from ..quality.features import FrameCost, SceneFeatures

Load = Callable[[int], float]


class Rule(Protocol):
    """What chooses a frame's quality."""

    def next(self, features: SceneFeatures, measured: FrameCost | None = None) -> Choice:
        """The choice for the next frame, given what the last one took."""


class RecordedScene:
    """What frames of one scene cost along its head path.

    Parameters
    ----------
    contents
        Of the recording's file.
    name
        Of the scene in it.

    Attributes
    ----------
    seconds
        How long the path is; it is walked to and fro.
    modes
        Ways to sample that were recorded; a rung of that name costs what it did, others what the first did.
    changes
        Of the settings, by mode.
    noise
        (n,) measured times over their medians.
    """

    def __init__(self, contents: dict, name: str):
        scene = contents["scenes"][name]
        self.name, self.seconds = name, contents["seconds"]
        self.modes, self.changes = tuple(scene["changes"]), scene["changes"]
        self.noise = np.array(scene["noise"])
        self._features = np.array(scene["features"], np.float64)
        self._planning = np.array(scene["planning_ms"])
        self.qualities = np.array(contents["qualities"])
        self._costs = {
            mode: np.log([scene["modes"][key][mode] for key in ("ms", "samples", "pixels")])
            for mode in self.modes
        }

    @classmethod
    def load(cls, path: Path) -> dict[str, RecordedScene]:
        """All scenes of a file by name."""
        contents = json.loads(path.read_text(encoding="utf-8"))
        return {name: cls(contents, name) for name in contents["scenes"]}

    def features(self, time: float) -> SceneFeatures:
        """Known before the frame at `time`, seconds, is drawn."""
        first, share = self._place(time)
        samples, pixels, _ = (1 - share) * self._features[first] + share * self._features[first + 1]
        return SceneFeatures(samples, pixels, int(self._features[first, 2]), self.name)

    def cost(self, time: float, rung: str, quality: float) -> FrameCost:
        """Without noise."""
        first, share = self._place(time)
        costs = self._costs[rung if rung in self._costs else self.modes[0]]
        at = (1 - share) * costs[:, first] + share * costs[:, first + 1]
        ms, samples, pixels = (np.exp(_line(np.log(quality), np.log(self.qualities), row)) for row in at)
        return FrameCost(float(ms), float(samples), float(pixels))

    def _place(self, time: float) -> tuple[int, float]:
        count = len(self._features)
        along = abs((time / self.seconds * count) % (2 * (count - 1)))
        along = min(along, 2 * (count - 1) - along)
        first = min(int(along), count - 2)
        return first, along - first


def _line(x: float, xs: NDArray[np.float64], ys: NDArray[np.float64]) -> float:
    """Piecewise linear, beyond the ends as in the first and last piece."""
    n = int(np.clip(np.searchsorted(xs, x), 1, len(xs) - 1))
    return ys[n - 1] + (ys[n] - ys[n - 1]) * (x - xs[n - 1]) / (xs[n] - xs[n - 1])


@dataclass(frozen=True, eq=False)
class Disturbance:
    """What happens to recorded costs, each a factor by frame number.

    Attributes
    ----------
    machine
        On time alone: other programs, clock rates.
    content
        On time and samples, unannounced: what is seen in the same box.
    extent
        On time, samples, pixels, and on the features beforehand: the viewer's distance.
    noise
        On the measured time.
    """

    machine: Load = lambda frame: 1.0
    content: Load = lambda frame: 1.0
    extent: Load = lambda frame: 1.0
    noise: Load = lambda frame: 1.0


@dataclass(frozen=True, eq=False)
class Trace:
    """What a rule did, an entry a frame: quality, time without and with noise, its rung, why."""

    quality: NDArray[np.float64]
    clean_ms: NDArray[np.float64]
    ms: NDArray[np.float64]
    rung: Sequence[str]
    why: Sequence[str]

    def energy(self, start: int, end: int) -> float:
        """Sum of squared changes of log(quality) in frames start … end."""
        return float(np.square(np.diff(np.log(self.quality[start:end]))).sum())


def replay(
    scene: RecordedScene,
    rule: Rule,
    frames: int,
    *,
    time: Callable[[int], float],
    disturbance: Disturbance | None = None,
    start: int = 0,
) -> Trace:
    """Frames start … start + frames of a scene under a rule.

    Parameters
    ----------
    time
        Seconds on the path, by frame; a constant is a viewer at rest.
    """
    disturbance = disturbance or Disturbance()
    rows, rungs, why = [], [], []
    measured = None
    for frame in range(start, start + frames):
        seen = scene.features(time(frame))
        extent = disturbance.extent(frame)
        seen = replace(seen, samples=seen.samples * extent, pixels=seen.pixels * extent)
        choice = rule.next(seen, measured)
        cost = scene.cost(time(frame), choice.rung, choice.quality)
        content = disturbance.content(frame) * extent
        clean = cost.ms * content * disturbance.machine(frame)
        noisy = clean * disturbance.noise(frame)
        measured = FrameCost(noisy, cost.samples * content, cost.pixels * extent)
        rows.append((choice.quality, clean, noisy))
        rungs.append(choice.rung)
        why.append(choice.why)
    return Trace(*np.array(rows).T, rungs, why)
