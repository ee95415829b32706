"""Other rules for a frame's quality, to compare the frame-time controller with: same calls, no clock."""

from __future__ import annotations

from ..quality.controller import Choice
from ..quality.features import FrameCost, SceneFeatures


class Fixed:
    """One quality always."""

    def __init__(self, quality: float):
        self.quality = quality

    def next(
        self, features: SceneFeatures, measured: FrameCost | None = None, of: Choice | None = None
    ) -> Choice:
        """That quality."""
        return Choice(self.quality, "", why="held")


class OpenCover:
    """OpenCOVER's: after two frames in a row outside ±10 %, q += 0.3 · q · (fps − wanted) / wanted.

    Parameters
    ----------
    target_ms
        Of a whole frame.
    quality
        To begin with.
    limits
        Least and largest quality.

    Source: the volume plug-in of OpenCOVER, as its authors describe it.
    """

    def __init__(self, target_ms: float, quality: float = 1.0, limits: tuple[float, float] = (0.25, 2.0)):
        self.target_ms, self.quality, self.limits = target_ms, quality, limits
        self._misses = 0

    def next(
        self, features: SceneFeatures, measured: FrameCost | None = None, of: Choice | None = None
    ) -> Choice:
        """The rule, on the time of the whole frame."""
        if measured is not None:
            rate = self.target_ms / (measured.ms + measured.planning_ms + measured.other_ms)
            self._misses = self._misses + 1 if abs(rate - 1) > 0.1 else 0
            if self._misses >= 2:
                low, high = self.limits
                self.quality = min(max(self.quality * (1 + 0.3 * (rate - 1)), low), high)
                self._misses = 0
        return Choice(self.quality, "", why="")
