"""The room from outside, as geometry: walls, a head and its eyes, the volume's box. In room space, metres."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import Protocol

import numpy as np

import persp_sw as psw

from ..cameras import Camera
from ..eyes import EyePair, before_wall
from ..pose import Pose
from ..rig import Rig

Colour = tuple[int, int, int]  # sRGB, 0 … 255

GRID, FRAME, BLIND, BOX, SKIN = (58, 62, 70), (190, 196, 206), (214, 84, 66), (226, 180, 76), (228, 222, 214)
AXES: tuple[Colour, ...] = ((226, 80, 72), (96, 196, 96), (88, 136, 236))  # x, y, z
LEFT_EYE, RIGHT_EYE = (255, 72, 60), (60, 216, 232)  # as the glasses of an anaglyph
SEEN_THROUGH = 0.22  # opacity of a wall whose back is seen, so that it does not hide the room
AXIS_LENGTH = 0.25  # metres
HEAD_RADIUS = 0.11
LABEL = (222, 226, 232)


@dataclass(frozen=True, eq=False)
class Line:
    """A line through points (n, 3); `width` in pixels."""

    points: np.ndarray
    colour: Colour
    width: float = 1.5


@dataclass(frozen=True, eq=False)
class Dot:
    """A disc at a point, `radius` in pixels."""

    point: np.ndarray
    colour: Colour
    radius: float = 4.0


@dataclass(frozen=True, eq=False)
class Label:
    """A word, its middle at a point."""

    point: np.ndarray
    text: str
    colour: Colour = LABEL


@dataclass(frozen=True, eq=False)
class Sheet:
    """A wall's face: corners (4, 3), lower left, lower right, upper right, upper left as seen from before."""

    name: str
    corners: np.ndarray

    def faces(self, point: np.ndarray) -> bool:
        """Whether its front is seen from a point."""
        return before_wall(point, self.corners)

    @property
    def middle(self) -> np.ndarray:
        """Room position."""
        return self.corners.mean(0)


def sheets(walls: Sequence[psw.Wall]) -> list[Sheet]:
    """The faces of walls that stand in the room."""
    return [Sheet(w.name, wall_corners(w)) for w in walls]


def wall_corners(wall: psw.Wall) -> np.ndarray:
    """(4, 3): lower left, lower right, upper right, upper left."""
    upper_right = wall.lower_right + wall.upper_left - wall.lower_left
    return np.array([wall.lower_left, wall.lower_right, upper_right, wall.upper_left])


def frame_of(sheet: Sheet, eyes: Sequence[np.ndarray]) -> tuple[Line, Label]:
    """A wall's outline and name; red, and said, where one of the eyes is behind it."""
    blind = not all(sheet.faces(eye) for eye in eyes)
    colour = BLIND if blind else FRAME
    corners = np.concatenate([sheet.corners, sheet.corners[:1]])
    # The name stands inside, near the upper edge.
    place = sheet.middle + 0.82 * (sheet.corners[2:].mean(0) - sheet.middle)
    text = f"{sheet.name} (seen from behind)" if blind else sheet.name
    return Line(corners, colour, 2.0), Label(place, text, BLIND if blind else LABEL)


def floor_grid(corners: np.ndarray, step: float = 0.5) -> list[Line]:
    """Lines `step` metres apart on the floor below everything, reaching a step beyond the walls."""
    low = np.floor(corners.min(0) / step - 1) * step
    high = np.ceil(corners.max(0) / step + 1) * step
    y = corners[:, 1].min()
    lines = [
        Line(np.array([[x, y, low[2]], [x, y, high[2]]]), GRID, 1.0) for x in _steps(low[0], high[0], step)
    ]
    lines += [
        Line(np.array([[low[0], y, z], [high[0], y, z]]), GRID, 1.0) for z in _steps(low[2], high[2], step)
    ]
    return lines


def _steps(low: float, high: float, step: float) -> np.ndarray:
    return np.linspace(low, high, round((high - low) / step) + 1)


def head_lines(room_from_head: Pose) -> list[Line]:
    """A head: its axes (red right, green up, blue backwards), three circles, a nose."""
    turn = np.linspace(0, 2 * np.pi, 33)
    circle = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], -1) * HEAD_RADIUS
    centre = np.array([0.0, 0.0, 0.6 * HEAD_RADIUS])  # the tracked point is between the eyes, roughly
    shapes = [circle + centre, circle[:, [2, 0, 1]] + centre, circle[:, [0, 2, 1]] + centre]
    nose = np.array([[-0.02, -0.02, -0.04], [0.0, -0.03, -0.08], [0.02, -0.02, -0.04]])
    lines = [Line(room_from_head.apply(points), SKIN, 1.0) for points in (*shapes, nose)]
    for axis, colour in zip(np.eye(3), AXES, strict=True):
        lines.append(Line(room_from_head.apply(np.array([0 * axis, AXIS_LENGTH * axis])), colour, 2.5))
    return lines


def eye_dots(eyes: EyePair) -> list[Dot]:
    """Both eyes, in the colours of their glasses."""
    return [Dot(eyes.left, LEFT_EYE), Dot(eyes.right, RIGHT_EYE)]


def box_edges(corners: np.ndarray, eye: np.ndarray) -> tuple[list[Line], list[Line]]:
    """The twelve edges of a box as seen from a point: those behind its inside, and those before it.

    corners: (2, 2, 2, 3), by z, y, x.
    """
    middle = corners.reshape(-1, 3).mean(0)
    hidden: dict[tuple[int, int], bool] = {}
    for axis, side in product(range(3), range(2)):
        face = np.take(corners, side, axis).reshape(-1, 3)
        normal = np.cross(face[1] - face[0], face[2] - face[0])
        outwards = normal * np.sign(normal @ (face.mean(0) - middle))
        hidden[axis, side] = outwards @ (np.asarray(eye) - face[0]) <= 0
    behind, before = [], []
    for one, two in combinations(product((0, 1), repeat=3), 2):
        shared = [(axis, a) for axis, (a, b) in enumerate(zip(one, two, strict=True)) if a == b]
        if len(shared) == 2:
            line = Line(np.array([corners[one], corners[two]]), BOX, 1.5)
            (behind if all(hidden[face] for face in shared) else before).append(line)
    return behind, before


def room_camera(rig: Rig, size: tuple[int, int], fovy: float = np.radians(38)) -> Camera:
    """A camera that sees all walls and the head at rest, from behind the viewer, above and to the right."""
    points = np.concatenate([rig.corners.reshape(-1, 3), [rig.eyes.rest_pose.position]])
    pivot = (points.min(0) + points.max(0)) / 2
    radius = np.linalg.norm(points - pivot, axis=1).max() * 1.08
    half = np.arctan(np.tan(fovy / 2) * min(1.0, size[0] / size[1]))
    towards = np.array([0.16, 0.5, 1.0])
    eye = pivot + towards / np.linalg.norm(towards) * radius / np.sin(half)
    return Camera.look_at(eye, pivot, (0, 1, 0), fovy)


class Painter(Protocol):
    """Paints in order: what comes later covers what came before."""

    def sheet(self, sheet: Sheet, opacity: float = 1.0) -> None:
        """A wall with its picture."""

    def volume(self) -> None:
        """The volume as the camera sees it, if it is to be shown."""

    def lines(self, lines: Iterable[Line]) -> None:
        """Lines, what is behind the camera cut off."""

    def dots(self, dots: Iterable[Dot]) -> None:
        """Discs, each with a dark rim."""

    def labels(self, labels: Iterable[Label]) -> None:
        """Words."""


def paint_room(
    painter: Painter,
    camera: np.ndarray,
    walls: Sequence[psw.Wall],
    box: np.ndarray,
    head: Pose,
    eyes: EyePair,
    used: Sequence[np.ndarray],
) -> None:
    """Paint a room, back to front as seen from the point `camera`.

    Walls do not cut each other or the volume here, as in a real room. One whose back is seen is nearer than
    all that is before it, and is painted last, as if it were of tinted glass.

    Parameters
    ----------
    walls
        In room space.
    box
        (8, 3): the volume's `placement.corners_in_room`.
    used
        Positions of the eyes that see the walls' pictures.
    """
    faces, box = sheets(walls), np.reshape(box, (2, 2, 2, 3))
    faces.sort(key=lambda sheet: -np.linalg.norm(sheet.middle - camera))
    frames = {sheet.name: frame_of(sheet, used) for sheet in faces}
    behind, before = box_edges(box, camera)
    head_is_nearer = np.linalg.norm(head.position - camera) < np.linalg.norm(box.mean((0, 1, 2)) - camera)

    painter.lines(floor_grid(np.concatenate([sheet.corners for sheet in faces])))
    for sheet in faces:
        if sheet.faces(camera):
            painter.sheet(sheet)
    painter.lines(frames[sheet.name][0] for sheet in faces if sheet.faces(camera))
    if not head_is_nearer:
        painter.lines(head_lines(head))
        painter.dots(eye_dots(eyes))
    painter.lines(behind)
    painter.volume()
    painter.lines(before)
    if head_is_nearer:
        painter.lines(head_lines(head))
        painter.dots(eye_dots(eyes))
    for sheet in faces:
        if not sheet.faces(camera):
            painter.sheet(sheet, SEEN_THROUGH)
            painter.lines([frames[sheet.name][0]])
    painter.labels(label for _, label in frames.values())
