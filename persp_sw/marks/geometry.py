"""Marks of a volume: its box, its axes, a patient's letters, a cursor, distances, and a view's scale bar."""

from __future__ import annotations

from itertools import combinations, product

import numpy as np

from ..arrays import Points, Vector, vector
from ..errors import ViewError
from ..geometry.view import View
from ..volume.grid import Volume
from .numbers import length_text, round_length, short
from .shapes import Colour, Label, Line, Marks, Palette, Sheet

_LIGHT = Palette.over()
_BEYOND = 0.06  # of the longest edge: how far letters stand off the box
_GAP = 0.03  # of the longest edge: half of what is left open around a cursor's point
_OPPOSITE = dict(zip("LRAPSI", "RLPAIS", strict=True))
_BAR = 0.2  # of the picture's width: how long a scale bar is at most
_MARGIN = 0.035  # of the picture's height, beside a scale bar
_BELOW = 0.09  # and below it, where words may stand
_TICK = 0.008
_SHINE = 0.7  # opacity of a ruler through what hides it


def unit_of(volume: Volume) -> str:
    """How lengths of a volume's world are called: a patient's are millimetres, others' are not known."""
    return "mm" if len(volume.orientation) == 3 else "units"


def position_text(volume: Volume, point: Vector) -> str:
    """A world position for people: a patient's by its directions, as "L 12.5 P 3 S 40.2 mm", else x, y, z."""
    if len(volume.orientation) != 3:
        return f"{' '.join(map(short, point))} {unit_of(volume)}"
    letters = (pair[0 if at >= 0 else 1] for pair, at in zip(("LR", "PA", "SI"), point, strict=True))
    return f"{' '.join(f'{a} {short(abs(at))}' for a, at in zip(letters, point, strict=True))} mm"


def corners_of(volume: Volume) -> Points:
    """(2, 2, 2, 3) world corners of the box of voxel centres, by x, y, z."""
    ends = np.stack(np.meshgrid(*([0.0, n - 1.0] for n in volume.size), indexing="ij"), -1)
    return _world(volume, ends)


def bounding_box(volume: Volume, palette: Palette = _LIGHT) -> Marks:
    """The twelve edges of the box of voxel centres; what the volume shows in front of them dims them."""
    corners = corners_of(volume)
    pairs = combinations(product((0, 1), repeat=3), 2)
    edges = [(a, b) for a, b in pairs if sum(m != n for m, n in zip(a, b, strict=True)) == 1]
    return Marks(lines=[Line(corners[a], corners[b], palette.faint) for a, b in edges])


def axes(volume: Volume, palette: Palette = _LIGHT) -> Marks:
    """The directions in which voxel indices grow, from the first voxel to a little beyond the box."""
    corners, beyond = corners_of(volume), _BEYOND * _longest(volume)
    lines, labels = [], []
    for axis, (name, colour) in enumerate(zip("xyz", palette.axes, strict=True)):
        start, end = corners[0, 0, 0], corners[tuple(np.eye(3, dtype=int)[axis])]
        along = _direction(volume, axis)
        lines.append(Line(start, end + beyond * along, colour, 2.5))
        labels.append(Label(end + 1.6 * beyond * along, name, colour, palette.halo))
    return Marks(lines=lines, labels=labels)


def orientation_letters(volume: Volume, palette: Palette = _LIGHT) -> Marks:
    """L R A P S I outside the middles of the box's sides, for a patient; nothing for other volumes."""
    if len(volume.orientation) != 3:
        return Marks()
    corners, beyond = corners_of(volume), 1.2 * _BEYOND * _longest(volume)
    labels = []
    for axis, letter in enumerate(volume.orientation):
        for side, text in ((1, letter), (0, _OPPOSITE[letter])):
            middle = np.take(corners, side, axis).mean((0, 1))
            place = middle + (2 * side - 1) * beyond * _direction(volume, axis)
            labels.append(Label(place, text, palette.ink, palette.halo, letter=19))
    return Marks(labels=labels)


def cursor(volume: Volume, point: Vector, planes: bool = False, palette: Palette = _LIGHT) -> Marks:
    """A 3D cursor: lines through a point along the volume's axes, open around it; planes through it, too.

    Parameters
    ----------
    point
        World; what lies outside the volume's box is moved to its nearest voxel coordinates.
    planes
        Translucent ones across the box, each in the colour of the axis it cuts.

    Raises
    ------
    ViewError
        No point.
    """
    point = vector(point, "a cursor", ViewError)
    last = np.array(volume.size) - 1.0
    inverse = np.linalg.inv(volume.world_from_object)
    at = np.clip(inverse[:3, :3] @ point + inverse[:3, 3], 0, last)
    middle, gap = _world(volume, at), _GAP * _longest(volume)
    lines, sheets = [], []
    for axis, colour in enumerate(palette.axes):
        along = _direction(volume, axis)
        for side in (0.0, last[axis]):
            end = at.copy()
            end[axis] = side
            end = _world(volume, end)
            length = np.linalg.norm(end - middle)
            if length > gap:
                lines.append(Line(middle + np.sign(side - at[axis]) * gap * along, end, colour, 2.0))
        if planes:
            sheets += _quarters(volume, at, axis, colour, palette.sheet)
            lines += _frame(volume, at, axis, colour)
    return Marks(sheets, lines)


def ruler(start: Vector, end: Vector, unit: str, palette: Palette = _LIGHT) -> Marks:
    """A line between two points and its length; it shines through what hides it, for it often lies inside."""
    start, end = vector(start, "a ruler's start", ViewError), vector(end, "a ruler's end", ViewError)
    text = length_text(float(np.linalg.norm(end - start)), unit)
    lines = [Line(start, end, palette.ruler, 2.0, _SHINE, veiled=False), Line(start, end, palette.ruler, 2.0)]
    label = Label((start + end) / 2, text, palette.ruler, palette.halo, (0, -14), veiled=False)
    return Marks(lines=lines, labels=[label])


def scale_bar(view: View, at: Vector, unit: str, palette: Palette = _LIGHT) -> Marks:
    """A bar of a round length in the lower left corner of a picture, as deep as a point; over everything.

    Parameters
    ----------
    at
        World: what is as deep as it, along the wall's normal, is shown in the bar's scale; mostly the pivot.
        It lies before the eye.

    Returns
    -------
    A line of 1, 2 or 5 times a power of ten of world units, at most a fifth of the picture's width long, its
    ends, and its length with the `unit`. Seen by another eye it is where its depth is.

    Raises
    ------
    ViewError
        The point is not before the eye.
    """
    at = vector(at, "a scale bar's depth", ViewError)
    width, height = view.size
    w = float(view.viewport_from_world[2] @ (*at, 1.0))
    if w <= 0:
        raise ViewError(f"a scale bar lies before the eye; given the depth of {at.tolist()}, behind it")

    def place(column: float, row: float) -> Points:
        if view.eye.is_at_infinity:
            return view.wall.world_from_pixel @ (column, row, 1.0)
        return view.eye.position + w * (view.direction_from_pixel @ (column, row, 1.0))

    left, row = _MARGIN * height, (1 - _BELOW) * height
    pixel = float(np.linalg.norm(place(left + 1, row) - place(left, row)))
    length = round_length(_BAR * width * pixel)
    right = left + length / pixel
    tick = max(_TICK * height, 3.0)
    ends = [((left, row), (right, row)), *(((x, row - tick), (x, row + tick)) for x in (left, right))]
    lines = [Line(place(*a), place(*b), palette.ink, 2.5, veiled=False) for a, b in ends]
    text = length_text(length, unit)
    middle = place((left + right) / 2, row)
    return Marks(
        lines=lines,
        labels=[Label(middle, text, palette.ink, palette.halo, (0, -tick - 12), veiled=False)],
    )


def _world(volume: Volume, points: Points) -> Points:
    matrix = volume.world_from_object
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def _direction(volume: Volume, axis: int) -> Points:
    """Unit vector along an axis, world."""
    return volume.world_from_object[:3, axis] / volume.spacing[axis]


def _longest(volume: Volume) -> float:
    return max(volume.extent) or max(volume.spacing)


def _quarters(volume: Volume, at: Points, axis: int, colour: Colour, opacity: float) -> list[Sheet]:
    """The plane across an axis in the four pieces that the other planes cut it into."""
    others = [other for other in range(3) if other != axis]
    middle = _world(volume, at)
    sheets = []
    for sides in product((0.0, 1.0), repeat=2):
        reaches = [side * (volume.size[o] - 1) - at[o] for o, side in zip(others, sides, strict=True)]
        if all(reaches):
            edges = [r * volume.world_from_object[:3, o] for r, o in zip(reaches, others, strict=True)]
            sheets.append(Sheet(middle, np.array(edges), colour, opacity))
    return sheets


def _frame(volume: Volume, at: Points, axis: int, colour: Colour) -> list[Line]:
    """The edges of the plane across an axis."""
    others = [other for other in range(3) if other != axis]
    corners = np.tile(at, (2, 2, 1))
    for (m, n), corner in zip(product((0, 1), repeat=2), corners.reshape(4, 3), strict=True):
        corner[others] = [m * (volume.size[others[0]] - 1), n * (volume.size[others[1]] - 1)]
    ring = _world(volume, corners)[[0, 0, 1, 1], [0, 1, 1, 0]]
    return [Line(ring[n - 1], ring[n], colour, 1.0, 0.6) for n in range(4)]
