"""Refinement while nothing moves: quality climbs the ladder to its end, and comes down again with motion."""

from __future__ import annotations

from dataclasses import replace
from math import exp

from .controller import Choice
from .ladder import Ladder

# Largest change of log(quality) from image to image; going down it may be this much larger, for a head that
# moves sees less, and waits.
_STEP, _FASTER = 0.25, 3.0


class Refinement:
    """What to composite while the viewer rests, and on the way back to what the frame time allows.

    Parameters
    ----------
    ladder
        Its last rung's end is full quality.
    step
        Largest change of log(quality) from image to image at rest; in motion three times that.

    Cost: the images of a climb from q to full quality Q number at most ln(Q/q)/step, and one for each rung;
    if the cost grows as q^e they take together at most 1 + 1 / (1 − exp(−e·step)) times as long as the last:
    with the pixels' e = 2 and a step of 0.25, 3.5 times.
    """

    def __init__(self, ladder: Ladder, step: float = _STEP):
        self.ladder, self.step = ladder, step
        self._made: tuple[int, float] | None = None  # rung and quality of the last image
        self._above = False  # whether that is more than the controller would have drawn

    @property
    def is_full(self) -> bool:
        """Whether the image made last is at full quality: nothing is left to refine."""
        return self._made == (len(self.ladder.rungs) - 1, self.ladder.rungs[-1].highest)

    def next(self, choice: Choice, resting: bool) -> Choice:
        """What to composite next, where the controller would draw `choice`; `made` tells that it was."""
        chosen = self._place(choice)
        if chosen is None or choice.why == "held":  # by hand: as it is wanted, at rest, too
            return choice
        if resting:
            place, why = self._up(self._higher(self._made or chosen, chosen)), "refined"
        elif self._above:
            place, why = self._down(self._made, chosen), "falling"
        else:
            return choice
        if place == chosen:
            return choice
        rung = self.ladder.rungs[place[0]]
        return replace(
            choice, quality=place[1], rung=rung.name, changes=rung.changes, expected_ms=None, why=why
        )

    def made(self, choice: Choice) -> None:
        """The image of a choice of `next` is finished."""
        self._above = choice.why in ("refined", "falling")
        self._made = None if choice.why == "held" else self._place(choice)

    def _place(self, choice: Choice) -> tuple[int, float] | None:
        for index, rung in enumerate(self.ladder.rungs):
            if rung.name == choice.rung:
                inside = rung.lowest <= choice.quality <= rung.highest
                return (index, choice.quality) if inside else None
        return None

    def _cost(self, place: tuple[int, float]) -> float:
        return self.ladder.rungs[place[0]].cost_at(place[1])

    def _higher(self, one: tuple[int, float], other: tuple[int, float]) -> tuple[int, float]:
        """`one`, but where `other` costs more. A rung's end and the next one's entry differ by rounding."""
        return other if self._cost(other) > (1 + 1e-9) * self._cost(one) else one

    def _up(self, place: tuple[int, float]) -> tuple[int, float]:
        index, quality = place
        rung = self.ladder.rungs[index]
        if quality < rung.highest:
            return index, min(quality * exp(self.step), rung.highest)
        if index + 1 == len(self.ladder.rungs):
            return place
        return index + 1, self.ladder.rungs[index + 1].quality_at(self._cost(place))

    def _down(self, place: tuple[int, float], chosen: tuple[int, float]) -> tuple[int, float]:
        """On the chosen rung, a larger step lower than what costs as much as `place`."""
        index, quality = chosen
        lower = self.ladder.rungs[index].quality_at(self._cost(place)) * exp(-_FASTER * self.step)
        return index, max(lower, quality)
