"""Dots in the view that move clip planes and the crop box's sides. Geometry alone: no window, no widgets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..cameras import Camera

if TYPE_CHECKING:
    from .desk import Desk

REACH = 9.0  # pixels from a dot's middle at which it can still be taken


@dataclass(frozen=True, eq=False)
class Handle:
    """A dot that moves on a line.

    Attributes
    ----------
    kind, number
        "crop" and the side, 0 … 5 for x0, x1, y0, y1, z0, z1; "clip" and the plane.
    point, direction
        Where it is, and where to for a step of 1: world.
    """

    kind: str
    number: int
    point: NDArray[np.float64]
    direction: NDArray[np.float64]


def pixels_from_world(camera: Camera, size: tuple[int, int]) -> NDArray[np.float64]:
    """(3, 4): pixels from the window's upper left corner, times the distance before the eye, and that."""
    width, height = size
    right, up, back = camera.axes
    scale = height / 2 / np.tan(camera.fovy / 2)
    rows = np.stack([scale * right - width / 2 * back, -scale * up - height / 2 * back, -back])
    return np.column_stack([rows, -rows @ camera.position])


def pixel(matrix: NDArray[np.float64], point: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """(x, y) of a world point; None behind the eye."""
    x, y, w = matrix[:, :3] @ point + matrix[:, 3]
    return np.array([x / w, y / w]) if w > 0 else None


def handles_of(desk: Desk) -> list[Handle]:
    """The dots of all sides and planes: in a side's middle, and where a plane is nearest to the box."""
    pose, crop = desk.volume.world_from_object, np.array(desk.crop)
    low, high = crop[0::2], crop[1::2]
    middle = (low + high) / 2
    found = []
    for side in range(6):
        axis = side // 2
        place = middle.copy()
        place[axis] = crop[side]
        found.append(Handle("crop", side, pose[:3, :3] @ place + pose[:3, 3], pose[:3, axis]))
    centre = pose[:3, :3] @ middle + pose[:3, 3]
    for number, plane in enumerate(desk.regions.clip):
        normal, offset = np.array(plane[:3]), plane[3]
        length = np.linalg.norm(normal)
        normal, offset = normal / length, offset / length
        found.append(Handle("clip", number, centre - (normal @ centre + offset) * normal, normal))
    return found


def handle_at(
    handles: list[Handle], matrix: NDArray[np.float64], pointer: tuple[float, float]
) -> Handle | None:
    """The dot under the pointer, the nearest one within `REACH` pixels."""
    nearest, least = None, REACH
    for handle in handles:
        at = pixel(matrix, handle.point)
        if at is not None and (away := float(np.hypot(*(at - pointer)))) <= least:
            nearest, least = handle, away
    return nearest


def steps_to(handle: Handle, matrix: NDArray[np.float64], pointer: tuple[float, float]) -> float | None:
    """How many steps of its direction bring a dot nearest to the pointer in the picture.

    On its line through the picture, that is the foot of the perpendicular from the pointer: dragged along the
    line, the dot stays under the pointer. None where the line is seen end on, or that place is not before
    the eye.
    """
    a, b = matrix[:, :3] @ handle.point + matrix[:, 3], matrix[:, :3] @ handle.direction
    at = pixel(matrix, handle.point)
    if at is None:
        return None
    # The dot's picture moves by this for a first small step: the direction of its line.
    along = b[:2] - at * b[2]
    length = np.linalg.norm(along)
    if length < 1e-9 * np.linalg.norm(b):
        return None
    along /= length
    # (a + t·b)'s picture, measured along the line, is where the pointer is.
    where = along @ np.asarray(pointer, np.float64)
    below = along @ b[:2] - where * b[2]
    if below == 0:
        return None
    steps = (where * a[2] - along @ a[:2]) / below
    return float(steps) if a[2] + steps * b[2] > 0 else None


def move(desk: Desk, handle: Handle, steps: float) -> None:
    """Move a side or a plane by so many steps from where the handle was taken."""
    if handle.kind == "crop":
        object_from_world = np.linalg.inv(desk.volume.world_from_object)
        start = object_from_world @ (*handle.point, 1.0)
        desk.set_crop(handle.number, float(start[handle.number // 2]) + steps)
        return
    plane = np.array(desk.regions.clip[handle.number])
    point = handle.point + steps * handle.direction
    plane[3] = -plane[:3] @ point
    desk.set_clip(handle.number, plane.tolist())


def box_edges(desk: Desk) -> NDArray[np.float64]:
    """(12, 2, 3): the crop box's edges, world."""
    crop, pose = np.array(desk.crop), desk.volume.world_from_object
    corners = np.array([[crop[x], crop[2 + y], crop[4 + z]] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    corners = corners @ pose[:3, :3].T + pose[:3, 3]
    pairs = [(n, n | bit) for n in range(8) for bit in (1, 2, 4) if not n & bit]
    return corners[np.array(pairs)]
