"""Whether a viewer rests: the head stays within a small ball, and the scene is what it was."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .moment import Moment
from .pose import Pose


@dataclass(frozen=True)
class RestSettings:
    """Metres, radians, seconds: how far a head at rest may stray, and how long until it counts as resting.

    A millimetre or two is what trackers' noise and a standing body do.
    """

    stray: float = 0.002
    turn: float = 0.005
    seconds: float = 0.3


class RestWatch:
    """Looks at moments one after another.

    Attributes
    ----------
    anchor
        The moment since which nothing has moved; eye images of a head at rest are refined for it.
    """

    def __init__(self, settings: RestSettings | None = None):
        self.settings = settings or RestSettings()
        self.anchor: Moment | None = None
        self._since = 0.0

    def look(self, moment: Moment, time: float) -> bool:
        """Whether the viewer has rested for long enough at `time`, seconds of the loop's clock."""
        if self.anchor is None or not self._stays(moment):
            self.anchor, self._since = moment, time
        return time - self._since >= self.settings.seconds

    def _stays(self, moment: Moment) -> bool:
        anchor = self.anchor
        same_scene = anchor.regions is moment.regions and np.array_equal(
            anchor.room_from_world, moment.room_from_world
        )
        return same_scene and self._near(anchor.head, moment.head)

    def _near(self, one: Pose, other: Pose) -> bool:
        way = np.linalg.norm(one.position - other.position)
        turn = 2 * np.arccos(min(abs(float(one.orientation @ other.orientation)), 1.0))
        return bool(way <= self.settings.stray and turn <= self.settings.turn)
