"""One frame's eye images: a compositing for each eye, shared by all walls that show it."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

import persp_sw as psw
from persp_sw.errors import ViewError

from .eyes import EyePair
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
class Frame:
    """All pictures of one moment: of one head pose, and of no other.

    Attributes
    ----------
    images
        Eye images by the eye's name, those of eyes that see nothing of the volume, without faces, included.
    compositings
        How many eye images show anything: those that cost something.
    statistics
        `Renderer.last` of each eye image.
    edge_on
        Names of walls in whose plane an eye lies, which can show it nothing.
    """

    head: Pose
    eyes: EyePair
    pictures: Sequence[Picture]
    images: Mapping[str, psw.EyeImage]
    compositings: int
    statistics: Mapping[str, Mapping[str, object]]
    edge_on: Sequence[str] = ()


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
        self.walls = tuple(walls)
        self.room_from_world = room_from_world
        self._previous: dict[str, psw.EyeImage] = {}
        self._said: set[str] = set()

    @property
    def room_from_world(self) -> np.ndarray:
        """(4, 4) similarity."""
        return self._room_from_world

    @room_from_world.setter
    def room_from_world(self, matrix: np.ndarray) -> None:
        self._room_from_world = np.array(matrix, np.float64)
        self._world_from_room = np.linalg.inv(self._room_from_world)
        self._metres = float(np.cbrt(abs(np.linalg.det(self._room_from_world[:3, :3]))))  # a world unit

    def make(self, head: Pose, eyes: EyePair, near: float = 0.0, modes: Mapping[str, str] = _NONE) -> Frame:
        """Composite every eye once, for all the walls that show it.

        Parameters
        ----------
        near
            Metres before each eye in which nothing is shown.
        modes
            Stereo modes by wall name, where not the rig's own.
        """
        pictures, images, statistics, edge_on = [], {}, {}, []
        shown = {wall.name: eyes_of(modes.get(wall.name, wall.stereo)) for wall in self.walls}
        for name in dict.fromkeys(name for names in shown.values() for name in names):
            eye = psw.Eye(self._point(getattr(eyes, name)), near / self._metres)
            views = []
            for wall in self.walls:
                if name in shown[wall.name]:
                    try:
                        views.append((wall, psw.View(eye, self._in_world(wall.in_room(head)))))
                    except ViewError as error:
                        edge_on.append(wall.name)
                        self._say(wall.name, error)
            image = self.renderer.composite(eye, [view.wall for _, view in views], self._previous.get(name))
            images[name] = self._previous[name] = image
            statistics[name] = dict(self.renderer.last)
            pictures += [Picture(wall, name, view, image) for wall, view in views]
        count = sum(bool(image.faces) for image in images.values())
        return Frame(head, eyes, tuple(pictures), images, count, statistics, tuple(edge_on))

    def _in_world(self, wall: psw.Wall) -> psw.Wall:
        corners = (self._point(c) for c in (wall.lower_left, wall.lower_right, wall.upper_left))
        return psw.Wall(*corners, pixels=wall.pixels, name=wall.name)

    def _point(self, point: np.ndarray) -> np.ndarray:
        return self._world_from_room[:3, :3] @ point + self._world_from_room[:3, 3]

    def _say(self, wall: str, error: ViewError) -> None:
        if wall not in self._said:
            self._said.add(wall)
            _log.warning("wall %r shows nothing while an eye is in its plane: %s", wall, error)
