"""Frame-time control: the quality that a frame can afford, chosen before it is drawn. No clock inside.

The law, its reasons and what was measured are in `docs/steady-frames.md`.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import exp, log
from statistics import median
from types import MappingProxyType
from typing import Any

from ..arrays import number
from ..errors import SettingsError
from ..settings import Settings
from .cost_model import CostModel
from .features import FrameCost, SceneFeatures
from .ladder import Ladder, Rung

# Predicted time over the budget: where quality aims, and between which it stays as it is. Wider by a part
# of the prediction's own uncertainty.
_AIM, _LEAST, _MOST = 0.975, 0.935, 1.02
_WIDER = 0.7
# While it moves it goes on to this near the aim.
_ARRIVED = 0.01
# From so far off (log of the cost) it moves by whole steps, nearer by parts of them.
_FAR = 0.4
# After a rise that had to be taken back: frames until the next one, doubled each time.
_FIRST_WAIT = 8
# Features that change so much are another load: the waits begin anew.
_OTHER_LOAD = 0.10
# So do jumps of the load itself (log), small ones where quality was at rest for so many frames: else it may
# be the move that the model has misjudged.
_JUMP, _JUMP_WHILE_MOVING, _STILL = 0.05, 0.3, 30
# Frames whose upload, warp and swap are judged by their median; what is left for compositing at least.
_OTHERS = 15
_LEAST_BUDGET = 0.1


@dataclass(frozen=True)
class Choice:
    """What to draw a frame with.

    Attributes
    ----------
    quality, rung, changes
        The quality, on which rung of the ladder, and what this sets besides.
    expected_ms
        Of compositing; None while nothing is known.
    budget_ms
        What compositing may take.
    why
        "first", "steady", "raised", "lowered", "least" (over budget even so), "most" (time to spare), "held",
        "waiting" (a rise was taken back lately), "nothing" (no eye sees anything).
    """

    quality: float
    rung: str
    changes: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))
    expected_ms: float | None = None
    budget_ms: float = 0.0
    why: str = "first"
    features: SceneFeatures | None = field(default=None, repr=False)

    def apply(self, base: Settings) -> Settings:
        """The settings of this frame, all else as in `base`, the user's own (not another choice's)."""
        return replace(base, quality=self.quality, intermediate_size=None, **self.changes)


class FrameTimeController:
    """Holds the time of compositing at what a frame leaves for it, by its quality.

    Parameters
    ----------
    target_ms
        Of a whole frame: compositing, upload, warp and swap.
    ladder
        The settings to walk; None: quality alone.
    quality
        To begin with.
    min_quality, max_quality
        Limits, both within 0.05 … 8.
    max_step
        Largest change of log(quality) from frame to frame, so that nobody sees a step. Only where the load is
        far from the budget is it that large; small corrections take small steps.

    Raises
    ------
    SettingsError
        A number outside its range, or limits that leave nothing of the ladder.
    """

    def __init__(
        self,
        target_ms: float,
        ladder: Ladder | None = None,
        *,
        quality: float = 1.0,
        min_quality: float = 0.25,
        max_quality: float = 2.0,
        max_step: float = 0.25,
    ):
        number(min_quality, "min_quality", SettingsError, 0.05, 8)
        number(max_quality, "max_quality", SettingsError, min_quality, 8)
        self.max_step = number(max_step, "max_step", SettingsError, 0.001, 1)
        self.target_ms = target_ms
        if min_quality == max_quality:
            raise SettingsError(f"both limits of quality are {min_quality:g}: hold that quality instead")
        self.ladder = (ladder or Ladder.default()).limited(min_quality, max_quality)
        self._model = CostModel()
        self._others: deque[float] = deque(maxlen=_OTHERS)
        self._index, self._quality = self._nearest(number(quality, "quality", SettingsError, 0.05, 8))
        self._held: float | None = None
        self._last: Choice | None = None
        self._still = 0  # frames since quality moved
        self._forget_waits()

    @property
    def target_ms(self) -> float:
        """Of a whole frame; may be assigned at any time."""
        return self._target_ms

    @target_ms.setter
    def target_ms(self, target_ms: float) -> None:
        self._target_ms = number(target_ms, "target_ms", SettingsError, 0.1, 60_000)
        self._forget_waits()

    @property
    def budget_ms(self) -> float:
        """What the target leaves for compositing, upload, warp and swap taken off as measured."""
        others = median(self._others) if self._others else 0.0
        return max(self._target_ms - others, _LEAST_BUDGET * self._target_ms)

    @property
    def held(self) -> bool:
        """Whether quality is held by hand."""
        return self._held is not None

    def hold(self, quality: float | None = None) -> None:
        """Lock quality where it is, or at a value of the user's own, at once and whatever the limits."""
        if quality is not None:
            number(quality, "quality", SettingsError, 0.05, 8)
        self._held = self._quality if quality is None else quality

    def release(self) -> None:
        """Control again, from where quality was held (or from the limit next to it)."""
        if self._held is not None:
            self._index, self._quality = self._nearest(self._held)
        self._held = None
        self._forget_waits()

    def reset(self) -> None:
        """Another scene: forget what was learnt of the old one; quality stays for a frame."""
        self._model.new_scene()
        self._forget_waits()

    def next(
        self, features: SceneFeatures, measured: FrameCost | None = None, of: Choice | None = None
    ) -> Choice:
        """What to draw the next frame with.

        Parameters
        ----------
        features
            Of the frame to be drawn.
        measured
            What a frame took since the last call; None where none was finished.
        of
            The choice that frame was drawn with, where it is not the last one.
        """
        drawn = of or self._last
        if measured is not None and drawn is not None and drawn.features is not None:
            self._learn(drawn, measured)
        if self._last is not None and self._last.features.scene != features.scene:
            self.reset()
        self._see(features)
        why = self._decide(features)
        rung = self.ladder.rungs[self._index]
        quality = self._quality if self._held is None else self._held
        known = self._model.knows and not features.shows_nothing
        expected = self._model.predict(features, rung, quality) if known else None
        self._last = Choice(quality, rung.name, rung.changes, expected, self.budget_ms, why, features)
        return self._last

    def _learn(self, drawn: Choice, measured: FrameCost) -> None:
        self._others.append(measured.other_ms)
        rung = next((r for r in self.ladder.rungs if r.name == drawn.rung), None)
        jump = 0.0 if rung is None else self._model.learn(drawn.features, rung, drawn.quality, measured)
        if abs(jump) > (_JUMP if self._still >= _STILL else _JUMP_WHILE_MOVING):
            self._forget_waits()

    def _see(self, features: SceneFeatures) -> None:
        """Another load is another matter: what was tried and taken back may do now."""
        seen = features.samples, features.pixels
        known = self._tried_with
        if known is None or any(abs(a - b) > _OTHER_LOAD * b for a, b in zip(seen, known, strict=True)):
            self._forget_waits()
            self._tried_with = seen

    def _forget_waits(self) -> None:
        self._moving, self._rose = 0, False
        self._wait, self._waited = _FIRST_WAIT, None
        self._tried_with: tuple[float, float] | None = None

    def _decide(self, features: SceneFeatures) -> str:
        """Set index and quality for this frame; why."""
        self._still += 1
        if self._waited is not None:
            self._waited += 1
        if self._held is not None:
            return "held"
        if features.shows_nothing:
            return "nothing"
        if not self._model.knows:
            return "first"
        rung = self.ladder.rungs[self._index]
        budget = self.budget_ms
        load = self._model.predict(features, rung, self._quality) / budget
        wider = 1 + _WIDER * self._model.uncertainty
        wanted = log(_AIM / load)  # of the cost
        inside = _LEAST / wider <= load <= _MOST * wider
        if inside and (self._moving == 0 or abs(wanted) < _ARRIVED or (wanted > 0) != (self._moving > 0)):
            self._moving = 0
            return "steady"
        return self._raise(features, rung, budget) if wanted > 0 else self._lower(features, rung, budget)

    def _raise(self, features: SceneFeatures, rung: Rung, budget: float) -> str:
        if self._waited is not None and self._waited < self._wait:
            self._moving = 0
            return "waiting"
        if self._quality >= rung.highest and not self._climb(features, rung, budget):
            self._moving = 0
            return "most"
        rung = self.ladder.rungs[self._index]
        self._move(features, rung, budget)
        self._moving, self._rose = 1, True
        return "raised"

    def _lower(self, features: SceneFeatures, rung: Rung, budget: float) -> str:
        if self._rose:  # taken back: the next rise has to wait, and twice as long each time
            self._wait = _FIRST_WAIT if self._waited is None else 2 * self._wait
            self._waited, self._rose = 0, False
        self._moving = -1
        if self._quality <= rung.lowest:
            if self._index == 0:
                self._moving = 0
                return "least"
            self._step_to(self._index - 1, rung)
            return "lowered"
        self._move(features, rung, budget)
        return "lowered"

    def _move(self, features: SceneFeatures, rung: Rung, budget: float) -> None:
        """Towards the quality at which the model predicts the aim, no further than a step."""
        self._still = 0
        aim = _AIM * budget
        away = abs(log(aim / self._model.predict(features, rung, self._quality)))
        step = self.max_step * min(1.0, away / _FAR)
        low = max(rung.lowest, self._quality * exp(-step))
        high = min(rung.highest, self._quality * exp(step))
        if self._model.predict(features, rung, low) >= aim:
            self._quality = low
            return
        if self._model.predict(features, rung, high) <= aim:
            self._quality = high
            return
        for _ in range(24):  # bisection: predictions grow with quality
            middle = (low * high) ** 0.5
            if self._model.predict(features, rung, middle) < aim:
                low = middle
            else:
                high = middle
        self._quality = low

    def _climb(self, features: SceneFeatures, rung: Rung, budget: float) -> bool:
        """On to the next rung at the cost of this one's end, if the time allows it there."""
        if self._index + 1 == len(self.ladder.rungs):
            return False
        above = self.ladder.rungs[self._index + 1]
        entry = above.quality_at(rung.cost_at(self._quality))
        if self._model.predict(features, above, entry) > _MOST * budget:
            return False
        self._step_to(self._index + 1, rung)
        return True

    def _step_to(self, index: int, rung: Rung) -> None:
        cost = rung.cost_at(self._quality)
        self._index = index
        self._quality = self.ladder.rungs[index].quality_at(cost)

    def _nearest(self, quality: float) -> tuple[int, float]:
        """The first rung that has a quality, or the one next to it."""
        gaps = [max(r.lowest / quality, quality / r.highest, 1.0) for r in self.ladder.rungs]
        index = gaps.index(min(gaps))
        rung = self.ladder.rungs[index]
        return index, min(max(quality, rung.lowest), rung.highest)
