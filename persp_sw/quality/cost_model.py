"""What compositing will cost, learnt frame by frame: milliseconds against samples and pixels."""

from __future__ import annotations

from collections import deque
from math import exp, log, sqrt
from statistics import median

import numpy as np

from .features import FrameCost, SceneFeatures
from .ladder import Rung
from .load_watch import LoadWatch

# Of a first frame: fixed cost, faces, samples, pixels; how uncertain each is, relative.
_SHARES = np.array([0.1, 0.2, 0.5, 0.2])
_UNCERTAIN = 0.5
_LEAST_SHARE = 1e-3
# What a step in faces, samples or pixels may add to the error of the model's form, as a part of it (logs).
_FORM_ERROR = 0.5
# Residuals count up to this many deviations.
_CLIP = 3.0
# Frames that the estimate remembers: few after a change, many when nothing changes.
_MEMORY = 30, 600
# How fast counted ratios, which have no noise but the planner's rounding, are followed.
_RATIO_GAIN, _RATIO_JUMP = 0.7, 0.3
# How samples grow where they do not grow as the rung says, as a power of its cost less 1: with coarser levels
# of detail they grow more slowly. Learnt from moves of at least so much in log(cost).
_POWERS, _POWER_GAIN, _LEAST_MOVE = (-0.6, 0.5), 0.4, 0.04
# A rung's own speed is learnt in its first frames.
_RUNG_FRAMES = 4
# Frames whose planning is judged by its median.
_PLANNINGS = 9
_TINY = 1e-9


class CostModel:
    """ms = planning + fixed + c · faces + a · samples + b · pixels; all but the first follow from the plan.

    Samples are those of the plan times the rung's cost at the quality times a ratio that skipping and
    termination leave, which is counted, not timed, and so followed at once. The four coefficients are a
    Kalman filter's state with the log of the time as its measurement; they drift together, as a machine
    gets slower or faster, and a `LoadWatch` finds where they jump.
    """

    def __init__(self):
        self.watch = LoadWatch()
        self._state: np.ndarray | None = None  # ms; ms a face, a sample, a pixel
        self._covariance = np.eye(4)
        self._quiet = 0  # frames since the load changed
        self._plannings: deque[float] = deque(maxlen=_PLANNINGS)
        self._pixel_ratio = 0.0  # logs
        self._sample_ratios: dict[str, float] = {}
        self._places: dict[str, float] = {}  # log cost where the ratio was counted
        self._power = 0.0
        self._counted: tuple[str, float, float] | None = None  # rung, logs of cost and ratio
        self._speeds: dict[str, tuple[float, int]] = {}
        self._rung = ""
        self._at = "", 0.0
        self._last = np.full(4, _TINY)  # regressors
        self._new_scene = True

    @property
    def knows(self) -> bool:
        """Whether it has seen a frame."""
        return self._state is not None

    @property
    def uncertainty(self) -> float:
        """Standard deviation of the log of a prediction, a frame's noise left out."""
        if self._state is None:
            return 1.0
        slope = self._last / float(self._last @ self._state)
        return sqrt(max(float(slope @ self._covariance @ slope), 0.0))

    def predict(self, features: SceneFeatures, rung: Rung, quality: float) -> float:
        """Milliseconds of compositing, planning included; the model must know a frame."""
        regressors = self._regressors(features, rung, quality)
        planning = median(self._plannings) if self._plannings else 0.0
        return planning + float(regressors @ self._state)

    def new_scene(self) -> None:
        """What was learnt of samples and pixels counts no more; the machine's speed does."""
        self._new_scene = True
        self._sample_ratios.clear()
        self.watch.restart()
        self._quiet = 0
        if self._state is not None:
            self._covariance += np.outer(self._state, self._state) * _UNCERTAIN**2

    def learn(self, features: SceneFeatures, rung: Rung, quality: float, cost: FrameCost) -> float:
        """A frame's cost; returns by how much (log) the load has jumped, 0 where it has not."""
        if features.shows_nothing or cost.ms <= 0:
            return 0.0
        self._plannings.append(cost.planning_ms)
        moved = self._count(features, rung, quality, cost)
        # The planner rounds pixels: what jumps as quality changes is no change of load.
        moved = moved if (rung.name, quality) == self._at else 0.0
        self._at = rung.name, quality
        regressors = self._regressors(features, rung, quality)
        away = float(np.abs(np.log(regressors / self._last)).max()) if self.knows else 0.0
        self._last = regressors
        self._rung = rung.name
        if self._state is None:
            self._state = cost.ms * _SHARES / regressors
            self._covariance = np.diag((_UNCERTAIN * self._state) ** 2)
            self._speeds[rung.name] = (0.0, _RUNG_FRAMES)
            return 0.0
        self._covariance += np.outer(self._state, self._state) * (_FORM_ERROR * away) ** 2
        return self._time(rung, regressors, cost.ms) or moved

    def _time(self, rung: Rung, regressors: np.ndarray, ms: float) -> float:
        """Kalman update with one time."""
        predicted = float(regressors @ self._state)
        residual = log(ms / predicted)
        speed, seen = self._speeds.get(rung.name, (self._speed(rung), 0))
        if seen < _RUNG_FRAMES:
            # A rung that is new: what differs is its own speed, not the machine's.
            self._speeds[rung.name] = (speed + residual / (seen + 1), seen + 1)
            return 0.0
        noise = self.watch.noise
        slope = regressors / predicted
        self._quiet += 1
        memory = min(max(self._quiet, _MEMORY[0]), _MEMORY[1])
        scale = np.outer(self._state, self._state)
        self._covariance += scale * (noise / memory) ** 2
        spread = sqrt(float(slope @ self._covariance @ slope) + noise**2)
        shift = self.watch.see(residual, spread)
        if shift is not None:
            self._state = self._state * exp(shift.size)
            self._covariance *= exp(2 * shift.size)
            known = noise**2 / shift.frames + (0.25 * shift.size) ** 2
            self._covariance += np.outer(self._state, self._state) * known
            self._quiet = 0
            return shift.size
        gain = self._covariance @ slope / spread**2
        floor = _LEAST_SHARE * predicted / np.maximum(regressors, _TINY)
        self._state = np.maximum(
            self._state + gain * np.clip(residual, -_CLIP * spread, _CLIP * spread), floor
        )
        self._covariance -= np.outer(gain, gain) * spread**2
        return 0.0

    def _count(self, features: SceneFeatures, rung: Rung, quality: float, cost: FrameCost) -> float:
        """Follow what is counted; returns by how much samples jumped."""
        jumped = 0.0
        if cost.samples > 0:
            planned = features.samples * rung.cost_at(quality)
            before = self._sample_ratios.get(rung.name)
            now, place = log(cost.samples / planned), log(rung.cost_at(quality))
            self._learn_power(rung, place, now)
            if before is not None:  # as it would be here
                before += self._power * (place - self._places[rung.name])
            ratio, jumped = _follow(before, now)
            self._places[rung.name] = place
            if before is None and not self._new_scene and rung.name not in self._speeds:
                # What the ladder says of its time holds, whatever part of it are samples.
                self._speeds[rung.name] = (self._speed(rung) + self._known_ratio() - ratio, 0)
            self._sample_ratios[rung.name] = ratio
        if cost.pixels > 0:
            before = None if self._new_scene else self._pixel_ratio
            self._pixel_ratio, _ = _follow(before, log(cost.pixels / (features.pixels * quality**2)))
        self._new_scene = False
        return jumped

    def _learn_power(self, rung: Rung, place: float, ratio: float) -> None:
        last, self._counted = self._counted, (rung.name, place, ratio)
        if last is None or last[0] != rung.name or self._new_scene or abs(place - last[1]) < _LEAST_MOVE:
            return
        seen = (ratio - last[2]) / (place - last[1])
        self._power += _POWER_GAIN * (min(max(seen, _POWERS[0]), _POWERS[1]) - self._power)

    def _regressors(self, features: SceneFeatures, rung: Rung, quality: float) -> np.ndarray:
        ratio, cost = self._sample_ratios.get(rung.name, self._known_ratio()), rung.cost_at(quality)
        if rung.name in self._places:
            ratio += self._power * (log(cost) - self._places[rung.name])
        samples = features.samples * cost * exp(ratio + self._speed(rung))
        pixels = features.pixels * quality**2 * exp(self._pixel_ratio)
        return np.array([1.0, max(features.faces, 1), max(samples, _TINY), max(pixels, _TINY)])

    def _known_ratio(self) -> float:
        return self._sample_ratios.get(self._rung, 0.0)

    def _speed(self, rung: Rung) -> float:
        known = self._speeds.get(rung.name) or self._speeds.get(self._rung)
        return known[0] if known else 0.0


def _follow(before: float | None, now: float) -> tuple[float, float]:
    """A log ratio followed, at once where it jumps, and by how much it did."""
    if before is None:
        return now, 0.0
    if abs(now - before) > _RATIO_JUMP:
        return now, now - before
    return before + _RATIO_GAIN * (now - before), 0.0
