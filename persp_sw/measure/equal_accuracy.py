"""Our cheapest settings that are as accurate as a given PSNR."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from ..geometry.view import View
from ..renderer import Renderer
from ..settings import Settings
from ..warp.canvas import Canvas
from .metrics import psnr
from .modes import MODES, available

QUALITIES = tuple(0.25 * 2 ** (n / 2) for n in range(11))  # 0.25 … 8
_HALVINGS = 4  # of the ratio √2 of two neighbouring qualities: the quality is found to 2 %
_STALLED = 0.1  # dB that a step of quality must gain at least, or a mode has come to its end
_TOO_SLOW = 3.0  # times the fastest settings found so far


@dataclass(frozen=True)
class Reached:
    """Settings found, or, where none is accurate enough, the most accurate ones tried."""

    settings: Settings
    mode: str
    psnr: float
    reached: bool


def search(renderer: Renderer, base: Settings, view: View, truth: np.ndarray, target: float) -> Reached:
    """The fastest of the cheapest settings of each mode whose PSNR is at least `target`.

    In each mode the quality rises by √2 until the target is reached, then the last step is halved. PSNR is
    taken to rise with quality; where it does not, the first crossing counts.
    """
    found: list[tuple[float, Reached]] = []
    best_missed: Reached | None = None
    for mode, settings in available(MODES, base).items():
        fastest = min((ms for ms, _ in found), default=np.inf)
        trial = _Trial(renderer, settings, view, truth)
        reached = lowest_quality(trial.psnr_of, target, lambda t=trial, f=fastest: t.ms > _TOO_SLOW * f)
        if reached is None:
            quality, value = trial.best
            if best_missed is None or value > best_missed.psnr:
                best_missed = Reached(replace(settings, quality=quality), mode, value, False)
            continue
        quality, value = reached
        found.append((trial.time(quality), Reached(replace(settings, quality=quality), mode, value, True)))
    if found:
        return min(found, key=lambda pair: pair[0])[1]
    assert best_missed is not None  # there is at least one mode
    return best_missed


def lowest_quality(
    psnr_of: Callable[[float], float], target: float, hopeless: Callable[[], bool] = lambda: False
) -> tuple[float, float] | None:
    """The lowest quality whose PSNR is at least `target`, to 2 %, and that PSNR; None if none is found.

    Parameters
    ----------
    hopeless
        Asked after each step whether going on makes sense.
    """
    before, below = -np.inf, None
    for quality in QUALITIES:
        value = psnr_of(quality)
        if value >= target:
            break
        if hopeless() or (below is not None and quality > 1 and value < before + _STALLED):
            return None
        before, below = value, quality
    else:
        return None
    if below is None:
        return quality, value
    high, low = quality, below
    for _ in range(_HALVINGS):
        middle = float(np.sqrt(high * low))
        at_middle = psnr_of(middle)
        if at_middle >= target:
            high, value = middle, at_middle
        else:
            low = middle
    return high, value


class _Trial:
    """Pictures of one mode at any quality: their PSNR, and the time of the last one."""

    def __init__(self, renderer: Renderer, settings: Settings, view: View, truth: np.ndarray):
        self.renderer, self.settings, self.view, self.truth = renderer, settings, view, truth
        self.ms = 0.0
        self.best = (0.0, -np.inf)

    def psnr_of(self, quality: float) -> float:
        self.renderer.settings = replace(self.settings, quality=quality)
        image = self.renderer.render(self.view)
        self.ms = self.renderer.last["composite_ms"] + self.renderer.last["warp_ms"]
        value = psnr(image, self.truth)
        if value > self.best[1]:
            self.best = quality, value
        return value

    def time(self, quality: float) -> float:
        """Fastest of three frames, milliseconds: enough to choose between modes."""
        self.renderer.settings = replace(self.settings, quality=quality)
        spent, canvas = [], Canvas(*self.view.size)
        for _ in range(3):
            start = perf_counter()
            self.renderer.render(self.view, canvas)
            spent.append(1e3 * (perf_counter() - start))
        return min(spent)
