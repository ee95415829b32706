"""The room from above, to scale."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .drawing import Sheet, text_width
from .scene import (
    AXES,
    EDGES,
    GRID,
    GRID_METRE,
    HEAD_RADIUS,
    INK,
    LEFT_EYE,
    RIGHT_EYE,
    RoomScene,
    ShownWall,
)

_FLAT = 0.05  # a wall whose plan is narrower than this share of its size is a line
_WORDS = 14

Area = tuple[int, int, int, int]


def draw_plan(sheet: Sheet, area: Area, scene: RoomScene) -> None:
    """Draw the plan into an area (left, top, right, bottom): x to the right, −z up."""
    _Plan(sheet, area, scene).draw()


class _Plan:
    def __init__(self, sheet: Sheet, area: Area, scene: RoomScene):
        self.sheet, self.scene, self.area = sheet, scene, area
        left, top, right, bottom = area
        low, high = scene.points.min(0)[[0, 2]], scene.points.max(0)[[0, 2]]
        room = np.array([right - left - 150, bottom - top - 96])  # names stand beside the walls
        self.scale = float((room / np.maximum(high - low, 0.05 * scene.span)).min())  # pixels a metre
        middle = np.array([(left + right) / 2, (top + bottom) / 2 - 10])
        self.shift = middle - self.scale * (low + high) / 2
        self.names: list[tuple[np.ndarray, np.ndarray]] = []  # centres and half sizes of those written

    def at(self, points: np.ndarray) -> np.ndarray:
        """Pixels of the sheet, of room points (..., 3)."""
        return self.scale * np.asarray(points)[..., [0, 2]] + self.shift

    def draw(self) -> None:
        """All of it."""
        self.draw_grid()
        flat = [wall for wall in self.scene.walls if not self.is_line(wall)]
        lines = [wall for wall in self.scene.walls if self.is_line(wall)]
        for wall in flat:
            self.draw_area(wall)
        for wall in lines:
            self.draw_frustum(wall)
        self.draw_volume()
        for points, colour in self.scene.path_pieces():
            self.sheet.line(self.at(points), colour, 1.5)
        self.draw_viewer()
        for walls in self.same_places(lines):
            self.draw_line(walls)
        self.draw_scale()

    def is_line(self, wall: ShownWall) -> bool:
        """Whether it stands upright."""
        return bool(np.hypot(*wall.front[[0, 2]]) > 1 - _FLAT)

    @staticmethod
    def same_places(walls: list[ShownWall]) -> list[list[ShownWall]]:
        """Walls above one another, together."""
        groups: dict[tuple[float, ...], list[ShownWall]] = {}
        for wall in walls:
            key = tuple(np.round(np.concatenate([wall.corners[0, [0, 2]], wall.corners[1, [0, 2]]]), 3))
            groups.setdefault(key, []).append(wall)
        return list(groups.values())

    def draw_grid(self) -> None:
        """Lines on the floor."""
        x, z = self.scene.grid
        for lines, ends, place in ((x, z, lambda a, b: (a, 0, b)), (z, x, lambda a, b: (b, 0, a))):
            for line in lines:
                whole = abs(line - round(line)) < 1e-6
                points = self.at(np.array([place(line, ends[0]), place(line, ends[-1])]))
                self.sheet.line(points, GRID_METRE if whole else GRID)

    def draw_area(self, wall: ShownWall) -> None:
        """A floor, a ceiling or a wall that leans."""
        corners = self.at(wall.corners)
        self.sheet.area(corners, wall.colour, 0.10)
        self.sheet.line(np.vstack([corners, corners[:1]]), wall.colour, 1.0, 0.6)
        middle, low = corners.mean(0), corners[:, 1].max()
        # Aside: in the middle are the arrows of walls, and a ceiling may lie over a floor.
        aside = (corners[:, 0].max() - middle[0]) * (-0.55 if wall.front[1] > 0 else 0.55)
        self.name((middle[0] + aside, low - 14), wall.name, wall, "mm", (0, -18))

    def draw_frustum(self, wall: ShownWall) -> None:
        """What an eye sees through it."""
        for eye in wall.eyes:
            corners = self.at(np.array([eye, wall.corners[0], wall.corners[1]]))
            self.sheet.area(corners, wall.colour, 0.07)
            for end in corners[1:]:
                self.sheet.line(np.array([corners[0], end]), wall.colour, 1.0, 0.45)

    def draw_line(self, walls: list[ShownWall]) -> None:
        """Walls that stand upright, one above the other, with their front and names."""
        wall = walls[0]
        ends = self.at(wall.corners[:2])
        self.sheet.line(ends, wall.colour, 5)
        front = wall.front[[0, 2]]
        middle = ends.mean(0)
        self.sheet.arrow(middle, middle + 24 * front, wall.colour, 2, 9)
        beside = abs(front[0]) > abs(front[1])
        anchor = ("rm" if front[0] > 0 else "lm") if beside else "mm"
        for one in walls:
            place, step = (middle - 12 * front, (0, 18)) if beside else (middle - 16 * front, -18 * front)
            self.name(place, one.name, one, anchor, step)

    def name(
        self, place: Sequence[float], words: str, wall: ShownWall, anchor: str, step: Sequence[float]
    ) -> None:
        """Write a wall's name at a place, or at the first of the next ones, a step apart, that is free."""
        half = np.array([text_width(words, _WORDS) / 2, 8.0])
        shift = {"r": -half[0], "l": half[0], "m": 0.0}[anchor[0]]
        centre = np.asarray(place) + (shift, 0)
        for _ in range(12):
            if not any((np.abs(centre - other) < half + room).all() for other, room in self.names):
                break
            centre = centre + step
        self.names.append((centre, half))
        self.sheet.text(centre, words, _WORDS, wall.colour, "mm", halo=True)

    def draw_volume(self) -> None:
        """The volume's box and the letters of the ends that are to be seen."""
        box = self.scene.box
        if box is None:
            return
        corners = self.at(box)
        for edge in EDGES:
            self.sheet.line(corners[list(edge)], INK, 1.2)
        for axis, (_, colour) in enumerate(AXES):
            if not self.scene.is_patient:
                self.sheet.arrow(corners[0], corners[1 << axis], colour, 2, 9)
        for word, place, colour, upright in self.scene.letters:
            if not upright:
                self.sheet.text(self.at(place), word, _WORDS, colour, "mm", halo=True)

    def draw_viewer(self) -> None:
        """The head at rest."""
        rest = self.scene.rig.eyes.rest_pose
        radius = max(self.scale * HEAD_RADIUS, 5.0)
        reach = max(0.08 * self.scene.span, 1.8 * HEAD_RADIUS)
        self.sheet.arrow(*self.at(rest.apply([[0, 0, 0], [0, 0, -reach - HEAD_RADIUS]])), INK, 2, 9)
        self.sheet.dot(self.at(rest.position), radius, (225, 215, 205), INK)
        for eye, colour in ((self.scene.eyes.left, LEFT_EYE), (self.scene.eyes.right, RIGHT_EYE)):
            self.sheet.dot(self.at(eye), 3, colour)

    def draw_scale(self) -> None:
        """A ruler, and which way x and z run."""
        left, _, right, bottom = self.area
        length = next(
            (s for s in (100, 50, 10, 5, 2, 1, 0.5, 0.2) if s * self.scale < 0.4 * (right - left)), 0.1
        )
        start = np.array([left + 60.0, bottom - 10.0])
        end = start + (length * self.scale, 0)
        self.sheet.line(np.array([start, end]), INK, 2)
        for place in (start, end):
            self.sheet.line(np.array([place - (0, 4), place + (0, 4)]), INK, 2)
        self.sheet.text(end + (8, 0), f"{length:g} m", _WORDS, INK)
        corner = np.array([left + 6.0, bottom - 40.0])
        for axis, way in ((0, (30, 0)), (2, (0, 30))):
            name, colour = AXES[axis]
            self.sheet.arrow(corner, corner + way, colour, 2, 8)
            self.sheet.text(corner + np.multiply(way, 1.35), name, _WORDS, colour, "mm")
