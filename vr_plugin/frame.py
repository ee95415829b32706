"""One frame's eye images: a compositing for each eye, shared by all walls that show it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

import persp_sw as psw

from .eyes import EyePair
from .pose import Pose
from .rig import RigWall

# Which eyes a stereo mode needs.
EYES_OF = {"mono": ("middle",), "left": ("left",), "right": ("right",)}
BOTH = ("left", "right")


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
        Eye images by the eye's name; none of an eye that sees nothing of the volume.
    compositings
        How many eye images were composited.
    statistics
        `Renderer.last` of each eye image.
    """

    head: Pose
    eyes: EyePair
    pictures: Sequence[Picture]
    images: Mapping[str, psw.EyeImage]
    compositings: int
    statistics: Mapping[str, Mapping[str, object]]


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

    @property
    def room_from_world(self) -> np.ndarray:
        """(4, 4) similarity."""
        return self._room_from_world

    @room_from_world.setter
    def room_from_world(self, matrix: np.ndarray) -> None:
        self._room_from_world = np.array(matrix, np.float64)
        self._world_from_room = np.linalg.inv(self._room_from_world)
        self._scale = float(np.cbrt(abs(np.linalg.det(self._room_from_world[:3, :3]))))  # metres a unit

    def make(self, head: Pose, eyes: EyePair, near: float = 0.0, modes: Mapping[str, str] = {}) -> Frame:
        """Composite every eye once, for all the walls that show it.

        Parameters
        ----------
        near
            Metres before each eye in which nothing is shown.
        modes
            Stereo modes by wall name, where not the rig's own.
        """
        pictures, images, statistics = [], {}, {}
        shown = {wall.name: EYES_OF.get(modes.get(wall.name, wall.stereo), BOTH) for wall in self.walls}
        for name in dict.fromkeys(name for names in shown.values() for name in names):
            eye = psw.Eye(self._world(getattr(eyes, name)), near / self._scale)
            walls = [wall for wall in self.walls if name in shown[wall.name]]
            world_walls = [self.wall_in_world(wall) for wall in walls]
            image = self.renderer.composite(eye, world_walls, self._previous.get(name))
            statistics[name] = dict(self.renderer.last)
            images[name] = self._previous[name] = image
            pictures += [
                Picture(wall, name, psw.View(eye, world), image)
                for wall, world in zip(walls, world_walls, strict=True)
            ]
        drawn = {name: image for name, image in images.items() if image.faces}
        return Frame(head, eyes, tuple(pictures), drawn, len(drawn), statistics)

    def wall_in_world(self, wall: RigWall) -> psw.Wall:
        """A wall where it stands in the volume's world."""
        w = wall.wall
        corners = (self._world(c) for c in (w.lower_left, w.lower_right, w.upper_left))
        return psw.Wall(*corners, pixels=w.pixels, name=w.name)

    def _world(self, point: np.ndarray) -> np.ndarray:
        return self._world_from_room[:3, :3] @ point + self._world_from_room[:3, 3]
