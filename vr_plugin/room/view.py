"""The room as seen from behind the viewer's right shoulder."""

from __future__ import annotations

import numpy as np

import persp_sw as psw

from .drawing import Sheet
from .scene import (
    AXES,
    EDGES,
    GRID,
    GRID_METRE,
    HEAD_RADIUS,
    INK,
    LEFT_EYE,
    PALE,
    RIGHT_EYE,
    RoomScene,
    ShownWall,
)

_FOVY = 32.0
_AROUND, _ABOVE = np.radians(33), np.radians(27)  # of the camera, from straight behind the viewer
_EYE_PIXELS = 4.0

Area = tuple[int, int, int, int]


def draw_view(sheet: Sheet, area: Area, scene: RoomScene, renderer: psw.Renderer | None) -> None:
    """Draw the room into an area (left, top, right, bottom) of a sheet."""
    _View(sheet, area, scene).draw(renderer)


class _View:
    def __init__(self, sheet: Sheet, area: Area, scene: RoomScene):
        self.sheet, self.area, self.scene = sheet, area, scene
        self.view = _camera(scene, area)

    def at(self, points: np.ndarray) -> np.ndarray:
        """Pixels of the sheet, of room points (..., 3)."""
        return self.view.project(points) + self.area[:2]

    def draw(self, renderer: psw.Renderer | None) -> None:
        """All of it, what is far first."""
        self.draw_grid()
        camera = self.view.eye.position
        nearer = [wall for wall in self.scene.walls if not self.sees_front(wall)]
        beyond = [wall for wall in self.scene.walls if self.sees_front(wall)]
        for wall in sorted(beyond, key=lambda w: -np.linalg.norm(w.centre - camera)):
            self.draw_wall(wall)
        self.draw_volume(renderer)
        self.draw_viewer()
        for wall in sorted(nearer, key=lambda w: -np.linalg.norm(w.centre - camera)):
            self.draw_wall(wall)
        self.draw_scale()

    def sees_front(self, wall: ShownWall) -> bool:
        """Whether we look at its front."""
        return bool(wall.front @ (self.view.eye.position - wall.centre) > 0)

    def draw_grid(self) -> None:
        """Lines on the ground."""
        x, z = self.scene.grid
        y = self.scene.ground
        for lines, ends, place in ((x, z, lambda a, b: (a, y, b)), (z, x, lambda a, b: (b, y, a))):
            for line in lines:
                whole = abs(line - round(line)) < 1e-6
                points = self.at(np.array([place(line, ends[0]), place(line, ends[-1])]))
                self.sheet.line(points, GRID_METRE if whole else GRID, 1.0)

    def draw_wall(self, wall: ShownWall) -> None:
        """Its area, edges, name and front, and the frustum that ends in it."""
        corners = self.at(wall.corners)
        front = self.sees_front(wall)
        self.sheet.area(corners, wall.colour, 0.17 if front else 0.05)
        for eye in wall.eyes:
            for corner in wall.corners:
                self.sheet.line(self.at(np.array([eye, corner])), wall.colour, 1.0, 0.35)
        self.sheet.line(np.vstack([corners, corners[:1]]), wall.colour, 2.2 if front else 1.3)
        name = wall.name if front else f"{wall.name} (its back)"
        self.sheet.text_on(
            corners if front else _readable_back(corners), name, wall.colour, 0.085, 1.0 if front else 0.75
        )
        self.sheet.dot(corners[0], 3.5, wall.colour)
        tip = self.at(np.array([wall.centre, wall.centre + 0.16 * wall.size * wall.front]))
        self.sheet.arrow(*tip, wall.colour, 2.0, 10)

    def draw_volume(self, renderer: psw.Renderer | None) -> None:
        """The volume's box with its letters, and the volume where it can be rendered."""
        box = self.scene.box
        if box is None:
            return
        corners = self.at(box)
        farthest = int(np.linalg.norm(box - self.view.eye.position, axis=1).argmax())
        hidden = [edge for edge in EDGES if farthest in edge]
        for edge in hidden:
            self.sheet.dashes(*corners[list(edge)], PALE, 1.0)
        # A volume without letters has arrows, along the edges from its first voxel.
        arrows = {} if self.scene.is_patient else {(0, 1 << axis): AXES[axis][1] for axis in range(3)}
        for edge in hidden:
            if edge in arrows:
                self.sheet.arrow(*corners[list(edge)], arrows[edge], 2.5, 11)
        if renderer is not None:
            self.sheet.picture(self.rendered(renderer), self.area[:2])
        for edge in EDGES:
            if edge not in hidden:
                self.sheet.line(corners[list(edge)], INK, 1.3)
                if edge in arrows:
                    self.sheet.arrow(*corners[list(edge)], arrows[edge], 2.5, 11)
        for word, place, colour, _ in self.scene.letters:
            self.sheet.text(self.at(place), word, 17, colour, "mm", halo=True)

    def rendered(self, renderer: psw.Renderer) -> np.ndarray:
        """The volume as it is seen from here."""
        world_from_room = np.linalg.inv(self.scene.room_from_world)
        wall = self.view.wall
        eye, *corners = (
            world_from_room[:3, :3] @ point + world_from_room[:3, 3]
            for point in (self.view.eye.position, wall.lower_left, wall.lower_right, wall.upper_left)
        )
        return renderer.render(psw.View.through_wall(eye, psw.Wall(*corners, pixels=wall.pixels)))

    def draw_viewer(self) -> None:
        """The head at rest, its eyes and where it looks; the path it takes."""
        scene, rest = self.scene, self.scene.rig.eyes.rest_pose
        for points, colour in scene.path_pieces():
            self.sheet.line(self.at(points), colour, 1.8)
        head = rest.position
        foot = np.array([head[0], scene.ground, head[2]])
        self.sheet.dashes(*self.at(np.array([head, foot])), PALE, 1.0)
        self.sheet.dot(self.at(foot), 2.5, PALE)
        reach = max(0.07 * scene.span, 1.8 * HEAD_RADIUS)
        radius = self.pixels_of(HEAD_RADIUS, head)
        self.sheet.arrow(*self.at(rest.apply([[0, 0, 0], [0, 0, -reach - HEAD_RADIUS]])), INK, 2.0, 10)
        self.sheet.dot(self.at(head), max(radius, 5), (225, 215, 205), INK)
        for eye, colour in ((scene.eyes.left, LEFT_EYE), (scene.eyes.right, RIGHT_EYE)):
            self.sheet.dot(self.at(eye), _EYE_PIXELS, colour)

    def pixels_of(self, length: float, place: np.ndarray) -> float:
        """Pixels that a length has at a place, across the line of sight."""
        right = self.view.wall.lower_right - self.view.wall.lower_left
        ends = self.at(np.array([place, place + length * right / np.linalg.norm(right)]))
        return float(np.linalg.norm(ends[1] - ends[0]))

    def draw_scale(self) -> None:
        """The room's axes in a corner, and how wide the grid is."""
        left, _, _, bottom = self.area
        step = self.scene.grid_step
        height = f", at y = {self.scene.ground:g} m" if self.scene.ground else ""
        words = f"lines of the floor: {step:g} m apart{height}"
        self.sheet.text((left + 92, bottom - 14), words, 14, PALE)
        # Axes as directions of this view, at the middle of the scene.
        middle = self.scene.points.mean(0)
        origin = np.array([left + 34.0, bottom - 44.0])
        for axis, (name, colour) in enumerate(AXES):
            ends = self.at(np.array([middle, middle + 0.1 * self.scene.span * np.eye(3)[axis]]))
            along = (ends[1] - ends[0]) / self.pixels_of(0.1 * self.scene.span, middle) * 36
            self.sheet.arrow(origin, origin + along, colour, 2.0, 8)
            self.sheet.text(origin + 1.28 * along, name, 14, colour, "mm")


def _readable_back(corners: np.ndarray) -> np.ndarray:
    """A wall's corners in the order in which words on its back are the right way round and mostly upright."""
    orders = [corners[order] for order in ([1, 0, 3, 2], [3, 2, 1, 0], [0, 3, 2, 1], [2, 1, 0, 3])]
    return max(orders, key=lambda c: (c[0, 1] - c[3, 1]) + (c[1, 0] - c[0, 0]))


def _camera(scene: RoomScene, area: Area) -> psw.View:
    """The view from behind the viewer's right shoulder that just holds everything."""
    size = area[2] - area[0], area[3] - area[1]
    look = -scene.rig.eyes.rest_pose.matrix[:3, 2]
    back = np.arctan2(-look[0], -look[2]) if np.hypot(look[0], look[2]) > 0.1 else 0.0
    around = back + _AROUND
    towards = np.array([np.sin(around) * np.cos(_ABOVE), np.sin(_ABOVE), np.cos(around) * np.cos(_ABOVE)])
    x, z = scene.grid
    ground = [(a, scene.ground, b) for a in (x[0], x[-1]) for b in (z[0], z[-1])]
    points = np.concatenate([scene.points, ground])
    centre = (points.min(0) + points.max(0)) / 2
    radius = max(np.linalg.norm(points - centre, axis=1).max(), 1e-3)
    distance = 1.15 * radius / np.sin(np.radians(_FOVY) / 2)
    wide = psw.View.look_at(centre + distance * towards, centre, (0, 1, 0), _FOVY, size)
    # Of that view's plane, the part that everything falls on, in the area's proportions, with a margin.
    seen = wide.project(points)
    middle = (seen.min(0) + seen.max(0)) / 2
    extent = (np.ptp(seen, axis=0) / (np.array(size) * 0.9)).max() * np.array(size)
    low, high = middle - extent / 2, middle + extent / 2
    plane = wide.wall.world_from_pixel
    corners = [plane @ (*c, 1.0) for c in ((low[0], high[1]), (high[0], high[1]), (low[0], low[1]))]
    return psw.View(wide.eye, psw.Wall(*corners, pixels=size))
