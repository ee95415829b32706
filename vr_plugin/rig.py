"""A rig: the walls of one installation, whose eyes look at them and what tracks those. All in room space.

Room space is in metres, right-handed, y up. A viewer at rest mostly looks along −z.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

import persp_sw as psw
from persp_sw.errors import PerspSWError

from .pose import Pose

STEREO_MODES = (
    "mono", "left", "right", "quad", "side_by_side", "top_bottom", "interlaced", "anaglyph",
)  # fmt: skip
TRACKER_KINDS = ("none", "vrpn", "dtrack", "path", "mouse")


class RigError(PerspSWError):
    """A rig that cannot be; the message lists every problem found."""


@dataclass(frozen=True)
class WindowPlace:
    """Where a wall's window goes: fullscreen on a monitor (counted from 0), or at a place on the desktop.

    position and size are screen coordinates; None leaves them to the window system and the wall's pixels.
    """

    monitor: int | None = None
    position: tuple[int, int] | None = None
    size: tuple[int, int] | None = None
    fullscreen: bool = False


@dataclass(frozen=True, eq=False)
class RigWall:
    """One flat display.

    Attributes
    ----------
    wall
        Three corners in room metres and the pixels of one eye's picture.
    stereo
        One of `STEREO_MODES`: how its window shows two eyes.
    machine
        The host or display that shows it; empty for this machine.
    """

    wall: psw.Wall
    stereo: str = "mono"
    window: WindowPlace = WindowPlace()
    machine: str = ""

    @property
    def name(self) -> str:
        """The wall's name."""
        return self.wall.name


@dataclass(frozen=True, eq=False)
class Eyes:
    """Where eyes are on a tracked head.

    Attributes
    ----------
    separation
        Distance of the eyes, metres; negative swaps them.
    offset
        From the tracked point to the middle between the eyes, metres, in the head's own axes (x right, y up,
        z backwards).
    rest_pose
        room_from_head where nothing tracks, or what does is lost.
    near
        Nothing nearer to an eye is shown, metres.
    """

    separation: float = 0.064
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rest_pose: Pose = field(default_factory=lambda: Pose((0.0, 1.7, 0.0)))
    near: float = 0.0


@dataclass(frozen=True, eq=False)
class TrackerPlace:
    """What tracks the head, and how its space lies in the room.

    Attributes
    ----------
    kind
        One of `TRACKER_KINDS`.
    address
        VRPN: "Tracker0@host[:3883]"; DTrack: "udp://[address:]5000"; path: the recording's file name.
    head, wand
        Numbers of the sensors or bodies; wand None: there is none.
    room_from_tracker
        (4, 4) similarity: the tracker's unit to metres, its axes to the room's.
    latency
        Seconds from a sample's time stamp to its arrival that prediction adds on top of the display's.
    """

    kind: str = "none"
    address: str = ""
    head: int = 0
    wand: int | None = None
    room_from_tracker: np.ndarray = field(default_factory=lambda: np.eye(4))
    latency: float = 0.0


@dataclass(frozen=True, eq=False)
class Placement:
    """Where and how large the volume stands in the room; see `placement.room_from_world`.

    Attributes
    ----------
    room_from_world
        (4, 4) similarity, or None: then centre, size and up decide.
    centre
        Room position of the volume's middle; None: the middle of the room at eye height.
    size
        Length of the volume's longest edge in the room, metres.
    """

    room_from_world: np.ndarray | None = None
    centre: tuple[float, float, float] | None = None
    size: float = 1.0


@dataclass(frozen=True)
class QualityAim:
    """What the pictures should be like: `quality` as in `Settings`, and its limits for steady frames."""

    target_hz: float = 60.0
    quality: float = 1.0
    min_quality: float = 0.25
    max_quality: float = 2.0


@dataclass(frozen=True, eq=False)
class Rig:
    """One installation.

    Raises
    ------
    RigError
        No walls, or two of one name.
    """

    walls: Sequence[RigWall]
    eyes: Eyes = field(default_factory=Eyes)
    tracker: TrackerPlace = field(default_factory=TrackerPlace)
    placement: Placement = field(default_factory=Placement)
    quality: QualityAim = QualityAim()
    name: str = ""

    def __post_init__(self):
        object.__setattr__(self, "walls", tuple(self.walls))
        names = [wall.name for wall in self.walls]
        if not names:
            raise RigError("a rig has at least one wall")
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise RigError(f"walls need names of their own; given twice: {', '.join(twice)}")

    @property
    def machines(self) -> tuple[str, ...]:
        """The machines that show walls, in their first wall's order."""
        return tuple(dict.fromkeys(wall.machine for wall in self.walls))

    @property
    def corners(self) -> np.ndarray:
        """(walls, 4, 3) room corners: lower left, lower right, upper right, upper left."""
        return np.array(
            [
                [
                    w.wall.lower_left,
                    w.wall.lower_right,
                    w.wall.lower_right + w.wall.upper_left - w.wall.lower_left,
                    w.wall.upper_left,
                ]
                for w in self.walls
            ]
        )

    @property
    def middle(self) -> np.ndarray:
        """Room position of the middle of the box around all walls."""
        corners = self.corners.reshape(-1, 3)
        return (corners.min(0) + corners.max(0)) / 2
