"""What a picture of a room shows, in room space: walls with their fronts and colours, eyes, volume, path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

import persp_sw as psw

from ..eyes import EyePair, eyes_of_head
from ..placement import corners_in_room, room_from_world
from ..rig import Rig
from ..stereo import eyes_of
from .drawing import Colour

# Colours that most colour-blind people tell apart (Okabe and Ito), without the two that eyes have.
WALL_COLOURS = ((0, 114, 178), (0, 158, 115), (204, 121, 167), (230, 159, 0), (86, 180, 233), (140, 110, 60))
LEFT_EYE, RIGHT_EYE = (40, 90, 200), (200, 40, 40)
INK, PALE, GRID, GRID_METRE = (30, 30, 30), (130, 130, 130), (232, 232, 232), (200, 200, 200)
PATH_START, PATH_END, PATH_OUTSIDE = np.array([250, 180, 90]), np.array([120, 20, 90]), (220, 0, 0)
AXES: tuple[tuple[str, Colour], ...] = (("x", (190, 40, 40)), ("y", (30, 140, 50)), ("z", (40, 80, 200)))

EDGES = tuple((a, a | bit) for a in range(8) for bit in (1, 2, 4) if not a & bit)  # of a box, by corners
_OPPOSITE = dict(zip("LRAPSI", "RLPAIS", strict=True))
_PATH_POINTS = 1500
HEAD_RADIUS = 0.09


@dataclass(frozen=True, eq=False)
class ShownWall:
    """A wall as it is drawn, or several in one place; corners (4, 3) begin lower left, lower right."""

    names: Sequence[str]
    corners: np.ndarray
    colour: Colour
    eyes: Sequence[np.ndarray]  # whose frusta are drawn

    @property
    def name(self) -> str:
        """What is written on it."""
        others = len(self.names) - 1
        return f"{self.names[0]} +{others}" if others else self.names[0]

    @property
    def centre(self) -> np.ndarray:
        """Its middle."""
        return self.corners.mean(0)

    @property
    def front(self) -> np.ndarray:
        """Unit vector out of its front."""
        normal = np.cross(self.corners[1] - self.corners[0], self.corners[3] - self.corners[0])
        return normal / np.linalg.norm(normal)

    @property
    def size(self) -> float:
        """Of its shorter edge, metres."""
        return float(min(np.linalg.norm(self.corners[n] - self.corners[0]) for n in (1, 3)))


@dataclass(frozen=True, eq=False)
class RoomScene:
    """What a picture of a room shows.

    Attributes
    ----------
    box
        (8, 3) corners of the volume, or None.
    letters
        Words at places (3,), in room space, that tell the volume's ends apart.
    heads
        (n, 3) positions of a path, thinned out, or None.
    """

    rig: Rig
    walls: Sequence[ShownWall]
    eyes: EyePair
    volume: psw.Volume | None
    room_from_world: np.ndarray | None
    heads: np.ndarray | None
    path_inside: float | None

    @classmethod
    def of(cls, rig: Rig, volume: psw.Volume | None, heads: np.ndarray | None) -> RoomScene:
        """A rig's."""
        eyes = eyes_of_head(rig.eyes.rest_pose, rig.eyes)
        groups: dict[bytes, list[int]] = {}
        for number, corners in enumerate(rig.corners):
            groups.setdefault((np.round(corners, 4) + 0.0).tobytes(), []).append(number)
        walls = []
        for count, numbers in enumerate(groups.values()):
            shown = dict.fromkeys(_shown_eye(rig.walls[n].stereo) for n in numbers)
            walls.append(
                ShownWall(
                    [rig.walls[n].name for n in numbers],
                    rig.corners[numbers[0]],
                    WALL_COLOURS[count % len(WALL_COLOURS)],
                    [getattr(eyes, name) for name in shown],
                )
            )
        inside = None
        if heads is not None:
            heads = np.asarray(heads, np.float64).reshape(-1, 3)
            inside = float(between_walls(heads, rig).mean())
            heads = heads[:: max(1, len(heads) // _PATH_POINTS)]
        matrix = None if volume is None else room_from_world(rig, volume)
        return cls(rig, walls, eyes, volume, matrix, heads, inside)

    @cached_property
    def box(self) -> np.ndarray | None:
        """(8, 3) room corners of the volume."""
        return None if self.volume is None else corners_in_room(self.room_from_world, self.volume)

    @cached_property
    def letters(self) -> list[tuple[str, np.ndarray, Colour, bool]]:
        """Words for the volume's ends, where they go, their colour, whether that is up or down."""
        if self.box is None:
            return []
        centre, towards = self.box.mean(0), self.volume.orientation
        words = []
        for axis, (name, colour) in enumerate(AXES):
            half = (self.box[1 << axis] - self.box[0]) / 2
            along = half / max(np.linalg.norm(half), 1e-9)
            reach, upright = half + 0.045 * self.span * along, bool(abs(along[1]) > 0.7)
            if self.is_patient:
                words.append((towards[axis], centre + reach, INK, upright))
                words.append((_OPPOSITE.get(towards[axis], ""), centre - reach, INK, upright))
            else:
                words.append((name, self.box[0] + half + reach, colour, upright))
        return words

    @property
    def is_patient(self) -> bool:
        """Whether the volume's letters L R A P S I are known."""
        return self.volume is not None and len(self.volume.orientation) == 3

    @cached_property
    def points(self) -> np.ndarray:
        """(n, 3): all that the picture must hold."""
        parts = [wall.corners for wall in self.walls]
        around = HEAD_RADIUS * np.array([[1, 0, 0], [-1, 0, 0], [0, 0, 1], [0, 0, -1]])
        parts += [self.rig.eyes.rest_pose.position + around, *([self.box] if self.box is not None else [])]
        return np.concatenate(parts + ([self.heads] if self.heads is not None else []))

    @cached_property
    def span(self) -> float:
        """Metres from one end of it all to the other."""
        return float(np.ptp(self.points, axis=0).max())

    @cached_property
    def ground(self) -> float:
        """Height of the grid: the floor, or below what hangs high above it."""
        low = float(self.points[:, 1].min())
        return min(0.0, low) if low < 0.6 * self.span else np.floor(low * 10) / 10

    @cached_property
    def grid_step(self) -> float:
        """Metres between lines of the grid: as many as one can count."""
        return next(step for step in (0.1, 0.25, 0.5, 1, 2, 5, 10, 50, 100) if self.span / step < 13)

    @cached_property
    def grid(self) -> tuple[np.ndarray, np.ndarray]:
        """Places of the grid's lines along x and z."""
        x, z = self.points[:, 0], self.points[:, 2]
        step = self.grid_step
        return tuple(
            step * np.arange(np.floor(v.min() / step + 0.01), np.ceil(v.max() / step - 0.01) + 1)
            for v in (x, z)
        )

    def path_pieces(self) -> list[tuple[np.ndarray, Colour]]:
        """The path as short lines, each in the colour of its time, or red where outside the walls."""
        if self.heads is None or len(self.heads) < 2:
            return []
        outside = ~between_walls(self.heads, self.rig)
        count = min(60, len(self.heads) - 1)
        ends = np.linspace(0, len(self.heads) - 1, count + 1).astype(int)
        pieces = []
        for n, (start, end) in enumerate(pairwise(ends)):
            share = n / max(count - 1, 1)
            colour = tuple(int(c) for c in PATH_START + share * (PATH_END - PATH_START))
            if outside[start : end + 1].any():
                colour = PATH_OUTSIDE
            pieces.append((self.heads[start : end + 1], colour))
        return pieces


def _shown_eye(mode: str) -> str:
    """The eye whose frustum is drawn: of two, what lies between them."""
    names = eyes_of(mode)
    return names[0] if len(names) == 1 else "middle"


def between_walls(points: np.ndarray, rig: Rig) -> np.ndarray:
    """Which points (n, 3) are before all walls; where these make a room, inside the box around them, too.

    Walls that go with the head have no outside.
    """
    corners = np.array(
        [c for wall, c in zip(rig.walls, rig.corners, strict=True) if wall.fixed_to == "room"]
    ).reshape(-1, 4, 3)
    inside = np.ones(len(points), bool)
    for lower_left, lower_right, _, upper_left in corners:
        inside &= (points - lower_left) @ np.cross(lower_right - lower_left, upper_left - lower_left) > 0
    if len(corners):
        low, high = corners.reshape(-1, 3).min(0), corners.reshape(-1, 3).max(0)
        if (high - low).min() > 0.5 * (high - low).max():
            inside &= ((points > low) & (points < high)).all(1)
    return inside
