"""One moment of viewer and scene: all that a frame's pictures depend on but how well they are made."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

import persp_sw as psw

from .eyes import EyePair
from .pose import Pose
from .rig import RigWall
from .stereo import Stereo


@dataclass(frozen=True, eq=False)
class Sight:
    """What one eye is shown: its walls, and the view that each has of the volume's world."""

    eye: psw.Eye
    views: Sequence[tuple[RigWall, psw.View]]

    @property
    def walls(self) -> list[psw.Wall]:
        """In the volume's world."""
        return [view.wall for _, view in self.views]


@dataclass(frozen=True, eq=False)
class Moment:
    """Of one head pose, and of no other.

    Attributes
    ----------
    head, eyes
        In the room.
    sights
        By the eye's name, those that any wall shows.
    regions
        What part of the volume is shown; None: what the renderer has.
    edge_on
        Names of walls in whose plane an eye lies, which can show it nothing.
    room_from_world
        (4, 4): where the volume stands.
    stereo
        By wall name: how each wall shows the eyes.
    stamp
        When the tracker saw the head, seconds of the loop's clock; None where nothing tracks.
    """

    head: Pose
    eyes: EyePair
    sights: Mapping[str, Sight]
    regions: psw.Regions | None = None
    edge_on: Sequence[str] = ()
    room_from_world: np.ndarray = field(default_factory=lambda: np.eye(4))
    stereo: Mapping[str, Stereo] = field(default_factory=dict)
    stamp: float | None = None
