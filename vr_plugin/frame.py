"""One frame's eye images: a compositing for each eye, shared by all walls that show it."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np

import persp_sw as psw
from persp_sw.errors import ViewError

from .depths import KeptDepths
from .eyes import EyePair
from .moment import Moment, Sight
from .pose import Pose
from .rig import RigWall
from .stereo import eyes_of

_log = logging.getLogger("persp_sw")
_NONE: Mapping[str, str] = MappingProxyType({})


@dataclass(frozen=True, eq=False)
class Picture:
    """What one wall shows to one eye.

    Attributes
    ----------
    view
        In world space, for `Renderer.warp` or a texture warp.
    image
        The eye image that all walls of this eye share.
    """

    wall: RigWall
    eye: str
    view: psw.View
    image: psw.EyeImage


@dataclass(frozen=True, eq=False)
class Made:
    """How a frame came about.

    Attributes
    ----------
    quality
        That it was composited with.
    choice
        The frame-time controller's; None where settings are fixed.
    cost
        Of compositing and planning.
    begun_s
        When that began, seconds of `time.monotonic`.
    """

    quality: float
    choice: psw.Choice | None
    cost: psw.FrameCost
    begun_s: float

    @property
    def refined(self) -> bool:
        """Whether it took more time than a frame has: at rest, or on the way back."""
        return self.choice is not None and self.choice.why in ("refined", "falling")


@dataclass(frozen=True, eq=False)
class Frame:
    """All pictures of one moment: of one head pose, and of no other.

    Attributes
    ----------
    moment
        What it was composited for.
    pictures
        Of the walls; `seen_at` gives those of another moment.
    images
        Eye images by the eye's name, those of eyes that see nothing of the volume, without faces, included.
    statistics
        `Renderer.last` of each eye image.
    made
        None where nobody asked.
    """

    moment: Moment
    pictures: Sequence[Picture]
    images: Mapping[str, psw.EyeImage]
    statistics: Mapping[str, Mapping[str, object]]
    made: Made | None = None

    @property
    def head(self) -> Pose:
        """Whose moment it is of, in the room."""
        return self.moment.head

    @property
    def eyes(self) -> EyePair:
        """In the room."""
        return self.moment.eyes

    @property
    def edge_on(self) -> Sequence[str]:
        """Names of walls in whose plane an eye lies, which can show it nothing."""
        return self.moment.edge_on

    @property
    def compositings(self) -> int:
        """How many eye images show anything: those that cost something."""
        return sum(bool(image.faces) for image in self.images.values())

    def cost(self, planning_ms: float = 0.0) -> psw.FrameCost:
        """What compositing took, all eyes together."""
        each = self.statistics.values()
        return psw.FrameCost(
            sum(s["composite_ms"] for s in each),
            sum(s["samples"] for s in each),
            sum(len(image.pixels) for image in self.images.values()),
            planning_ms,
        )

    def seen_at(self, moment: Moment) -> Sequence[Picture]:
        """What walls show of these eye images at a later moment, when head or volume have moved."""
        return pictures_of(moment, self.images)


class FrameMaker:
    """Makes frames of one scene for the walls of a rig.

    Parameters
    ----------
    renderer
        What is shown. Its settings may change between frames.
    walls
        In room space.
    room_from_world
        (4, 4) similarity: where the volume stands. May be assigned between frames.
    """

    def __init__(self, renderer: psw.Renderer, walls: Sequence[RigWall], room_from_world: np.ndarray):
        self.renderer = renderer
        self._walls = tuple(walls)
        self.room_from_world = room_from_world
        self._depths = KeptDepths(renderer)
        self._said: set[str] = set()

    @property
    def walls(self) -> tuple[RigWall, ...]:
        """In room space; may be assigned between frames."""
        return self._walls

    @walls.setter
    def walls(self, walls: Sequence[RigWall]) -> None:
        self._walls = tuple(walls)
        self._room_walls.clear()

    @property
    def room_from_world(self) -> np.ndarray:
        """(4, 4) similarity."""
        return self._room_from_world

    @room_from_world.setter
    def room_from_world(self, matrix: np.ndarray) -> None:
        self._room_from_world = np.array(matrix, np.float64)
        self._world_from_room = np.linalg.inv(self._room_from_world)
        self._room_walls: dict[tuple[RigWall, float], psw.Wall] = {}  # they move with the volume only
        self._metres = float(np.cbrt(abs(np.linalg.det(self._room_from_world[:3, :3]))))  # a world unit

    def make(self, head: Pose, eyes: EyePair, near: float = 0.0, modes: Mapping[str, str] = _NONE) -> Frame:
        """The frame of `moment`, composited."""
        return self.composite(self.moment(head, eyes, near, modes))

    def moment(
        self,
        head: Pose,
        eyes: EyePair,
        near: float = 0.0,
        modes: Mapping[str, str] = _NONE,
        margins: Mapping[str, float] = MappingProxyType({}),
        **more: Any,
    ) -> Moment:
        """What each eye sees on which wall; no pixel yet.

        Parameters
        ----------
        near
            Metres before each eye in which nothing is shown.
        modes
            Stereo modes by wall name, where not the rig's own.
        margins
            By which walls are widened (`RigWall.widened`), by what they are fixed to.
        more
            What else the moment knows: its regions, its stamp.
        """
        shown = {wall.name: eyes_of(modes.get(wall.name, wall.stereo)) for wall in self.walls}
        walls = [(wall, self._in_world(wall, margins.get(wall.fixed_to, 0.0), head)) for wall in self.walls]
        sights, edge_on = {}, []
        for name in dict.fromkeys(name for names in shown.values() for name in names):
            eye = psw.Eye(self._point(getattr(eyes, name)), near / self._metres)
            views = []
            for wall, in_world in walls:
                if name in shown[wall.name]:
                    try:
                        views.append((wall, psw.View(eye, in_world)))
                    except ViewError as error:
                        edge_on.append(wall.name)
                        self._say(wall.name, error)
            sights[name] = Sight(eye, tuple(views))
        return Moment(
            head, eyes, sights, edge_on=tuple(edge_on), room_from_world=self._room_from_world, **more
        )

    def plan(self, moment: Moment) -> dict[str, psw.EyePlan]:
        """What compositing a moment will ask for, by the eye's name."""
        return {name: self.renderer.plan(sight.eye, sight.walls) for name, sight in moment.sights.items()}

    def composite(
        self, moment: Moment, cancel: psw.Cancel | None = None, plans: Mapping[str, psw.EyePlan] | None = None
    ) -> Frame:
        """Composite every eye once, for all the walls that show it.

        Raises
        ------
        Cancelled
            `cancel` was, meanwhile.
        """
        images, statistics = {}, {}
        for name, sight in moment.sights.items():
            if plans is None:
                make = partial(self.renderer.composite, sight.eye, sight.walls, cancel=cancel)
            else:
                make = partial(self.renderer.composite_plan, plans[name], cancel)
            images[name] = self._depths.composite(name, sight.eye, make)
            statistics[name] = dict(self.renderer.last)
        return Frame(moment, pictures_of(moment, images), images, statistics)

    def _in_world(self, wall: RigWall, margin: float, head: Pose) -> psw.Wall:
        key = wall, margin
        if wall.fixed_to == "room" and key in self._room_walls:
            return self._room_walls[key]
        at = wall.widened(margin).in_room(head)
        corners = (self._point(c) for c in (at.lower_left, at.lower_right, at.upper_left))
        in_world = psw.Wall(*corners, pixels=at.pixels, name=at.name)
        if wall.fixed_to == "room":
            self._room_walls[key] = in_world
        return in_world

    def _point(self, point: np.ndarray) -> np.ndarray:
        return self._world_from_room[:3, :3] @ point + self._world_from_room[:3, 3]

    def _say(self, wall: str, error: ViewError) -> None:
        if wall not in self._said:
            self._said.add(wall)
            _log.warning("wall %r shows nothing while an eye is in its plane: %s", wall, error)


def pictures_of(moment: Moment, images: Mapping[str, psw.EyeImage]) -> tuple[Picture, ...]:
    """The pictures that the walls show of eye images; of eyes without one none."""
    return tuple(
        Picture(wall, name, view, images[name])
        for name, sight in moment.sights.items()
        if name in images
        for wall, view in sight.views
    )
