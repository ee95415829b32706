"""A rig as a reader found it: in the file's unit, in our axes (x right, y up, viewers look along −z)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..rig import WindowPlace


@dataclass(eq=False)
class DraftWall:
    """One wall.

    Attributes
    ----------
    lower_left, lower_right, upper_left
        (3,) corners.
    pixels
        Of one eye's picture; None: the file does not say.
    where
        Its place in the file, for messages.
    viewer
        (3,) eyes that this wall alone is drawn for, whatever tracks; None: those of the rig.
    """

    name: str
    lower_left: np.ndarray
    lower_right: np.ndarray
    upper_left: np.ndarray
    where: str
    pixels: tuple[int, int] | None = None
    stereo: str = "mono"
    window: WindowPlace = field(default_factory=WindowPlace)
    machine: str = ""
    fixed_to: str = "room"
    viewer: np.ndarray | None = None

    @property
    def edges(self) -> tuple[float, float]:
        """Lengths of the lower and the left edge."""
        across, up = self.lower_right - self.lower_left, self.upper_left - self.lower_left
        return float(np.linalg.norm(across)), float(np.linalg.norm(up))


@dataclass(eq=False)
class DraftTracker:
    """What tracks the head; its positions come in metres.

    Attributes
    ----------
    room_turn, room_offset
        (3, 3) rotation and (3,) shift, in the file's unit: room_from_tracker.
    head_turn, head_offset
        (3, 3) rotation and (3,) shift, in the file's unit: sensor_from_head.
    """

    kind: str
    address: str
    head: int = 0
    wand: int | None = None
    room_turn: np.ndarray = field(default_factory=lambda: np.eye(3))
    room_offset: np.ndarray = field(default_factory=lambda: np.zeros(3))
    head_turn: np.ndarray = field(default_factory=lambda: np.eye(3))
    head_offset: np.ndarray = field(default_factory=lambda: np.zeros(3))


@dataclass(eq=False)
class Draft:
    """What a file says.

    Attributes
    ----------
    system
        The program whose file it is.
    unit
        In which it counts; None: the format does not state one.
    eye_separation
        None: the file does not say.
    rest
        (3,) where the viewer's eyes are before anything tracks; None: the file does not say.
    default_rest
        (3,) where that program puts them then; None: it has no such place.
    """

    system: str
    unit: str | None
    walls: list[DraftWall] = field(default_factory=list)
    eye_separation: float | None = None
    rest: np.ndarray | None = None
    default_rest: np.ndarray | None = None
    tracker: DraftTracker | None = None
