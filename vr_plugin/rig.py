"""A rig: the walls of one installation, whose eyes look at them and what tracks those. All in room space.

Room space is in metres, right-handed, y up. A viewer at rest mostly looks along −z.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

import persp_sw as psw
from persp_sw.errors import PerspSWError

from .pose import Pose, multiply, quaternion_of

STEREO_MODES = (
    "mono", "left", "right", "quad", "side_by_side", "top_bottom", "interlaced", "anaglyph",
)  # fmt: skip
TRACKER_KINDS = ("none", "vrpn", "dtrack", "path", "mouse")
FIXED_TO = ("room", "head")


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
        Three corners in metres, of the room or the head, and the pixels of one eye's picture.
    stereo
        One of `STEREO_MODES`: how its window shows two eyes.
    machine
        The host or display that shows it; empty for this machine.
    fixed_to
        One of `FIXED_TO`. A head-mounted display's walls go with the head: their corners are in its axes (x
        right, y up, z backwards), from the tracked point.
    """

    wall: psw.Wall
    stereo: str = "mono"
    window: WindowPlace = WindowPlace()
    machine: str = ""
    fixed_to: str = "room"

    @property
    def name(self) -> str:
        """The wall's name."""
        return self.wall.name

    def in_room(self, room_from_head: Pose) -> psw.Wall:
        """The wall in room metres, for a head that is there."""
        w = self.wall
        if self.fixed_to == "room":
            return w
        corners = (room_from_head.apply(c) for c in (w.lower_left, w.lower_right, w.upper_left))
        return psw.Wall(*corners, pixels=w.pixels, name=w.name)

    def widened(self, share: float) -> RigWall:
        """The wall with a margin all around, `share` of its width and height, its pixels as large as before.

        What eye images are composited for that will be shown to a head that has moved since.
        """
        if share == 0:
            return self
        w = self.wall
        across, up = share * (w.lower_right - w.lower_left), share * (w.upper_left - w.lower_left)
        corners = w.lower_left - across - up, w.lower_right + across - up, w.upper_left - across + up
        pixels = tuple(round((1 + 2 * share) * n) for n in w.pixels)
        return replace(self, wall=psw.Wall(*corners, pixels=pixels, name=w.name))


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
    sensor_from_head
        How the head lies in the axes of the body that is tracked: a body of markers has whatever axes it got
        when it was taught in. Metres.
    latency
        Seconds from a measurement to its time stamp, which are taken off the stamp.
    """

    kind: str = "none"
    address: str = ""
    head: int = 0
    wand: int | None = None
    room_from_tracker: np.ndarray = field(default_factory=lambda: np.eye(4))
    latency: float = 0.0
    sensor_from_head: Pose = field(default_factory=Pose)

    def room_from_sensor(self, tracker_from_sensor: Pose) -> Pose:
        """Where a sensor or body is in the room, metres, from its pose as tracked."""
        matrix = np.asarray(self.room_from_tracker, np.float64)
        scale = np.cbrt(np.linalg.det(matrix[:3, :3]))
        position = matrix[:3, :3] @ tracker_from_sensor.position + matrix[:3, 3]
        turn = multiply(quaternion_of(matrix[:3, :3] / scale), tracker_from_sensor.orientation)
        return Pose(position, turn)

    def room_from_head(self, tracker_from_sensor: Pose) -> Pose:
        """Where the head is in the room, from the pose of its sensor as tracked."""
        return self.room_from_sensor(tracker_from_sensor) @ self.sensor_from_head


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

    Attributes
    ----------
    recordings
        Recorded head paths that the rig knows how to place, besides its tracker: `tracker_for` finds them.

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
    recordings: Sequence[TrackerPlace] = ()

    def __post_init__(self):
        object.__setattr__(self, "walls", tuple(self.walls))
        object.__setattr__(self, "recordings", tuple(self.recordings))
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

    def tracker_for(self, recording: str | Path) -> TrackerPlace:
        """How a recorded path is placed: as the rig says for a file of that name, else as its tracker is."""
        known = [place for place in (self.tracker, *self.recordings) if place.kind == "path"]
        same = (place for place in known if Path(place.address).name == Path(recording).name)
        return replace(next(same, self.tracker), kind="path", address=str(recording))

    @property
    def corners(self) -> np.ndarray:
        """(walls, 4, 3) room corners: lower left, lower right, upper right, upper left.

        Of walls that go with the head: where they are when it rests.
        """
        walls = [wall.in_room(self.eyes.rest_pose) for wall in self.walls]
        return np.array(
            [
                [w.lower_left, w.lower_right, w.lower_right + w.upper_left - w.lower_left, w.upper_left]
                for w in walls
            ]
        )

    @property
    def middle(self) -> np.ndarray:
        """Room position of the middle of the box around all walls."""
        corners = self.corners.reshape(-1, 3)
        return (corners.min(0) + corners.max(0)) / 2
