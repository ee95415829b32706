"""What is doubtful in a rig: walls turned away, leaning or in another unit, windows that clash."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

import persp_sw as psw

from ..eyes import before_wall, eyes_of_head
from ..rig import Rig, RigWall

LARGEST_WALL = 100.0  # metres: more is no display
_SMALLEST_WALL = 0.01
_LEAN = 0.5  # degrees that measured corners may be off
_SQUARE = 1.05  # width of a pixel over its height
_FAR = 100.0


@dataclass(frozen=True, eq=False)
class WallMeasures:
    """What a wall is like for the eye at rest.

    Attributes
    ----------
    size
        Width and height, metres.
    pixel
        Width and height of a pixel, metres.
    angle
        Between lower and left edge, degrees.
    faces_eye
        Whether the eye at rest is before it; None in its plane.
    degrees
        Opening angle between its left and right edge's middle, seen from the eye at rest.
    pixels_a_degree
        At the wall's middle, along its width; 0 where that is seen edge-on.
    """

    size: tuple[float, float]
    pixel: tuple[float, float]
    angle: float
    faces_eye: bool | None
    degrees: float
    pixels_a_degree: float

    @classmethod
    def of(cls, rig: Rig, wall: RigWall) -> WallMeasures:
        """Of one of the rig's walls."""
        rest = rig.eyes.rest_pose
        w, eye = wall.in_room(rest), eyes_of_head(rest, rig.eyes).middle
        across, up = w.lower_right - w.lower_left, w.upper_left - w.lower_left
        width, height = float(np.linalg.norm(across)), float(np.linalg.norm(up))
        left, right = w.lower_left + up / 2 - eye, w.lower_left + across + up / 2 - eye
        normal = np.cross(across, up) / np.linalg.norm(np.cross(across, up))
        distance = normal @ (eye - w.lower_left)
        corners = np.array([w.lower_left, w.lower_right, w.lower_right + up, w.upper_left])
        in_plane = abs(distance) <= 1e-9 * max(width, height)
        pixel = width / w.pixels[0], height / w.pixels[1]
        centre = w.lower_left + (across + up) / 2 - eye
        sight = float(np.linalg.norm(centre))
        # The part of a pixel's width that lies across the line of sight; none with the eye in the middle.
        broad = np.linalg.norm(np.cross(across / width, centre)) * pixel[0] / sight if sight else 0.0
        return cls(
            (width, height),
            pixel,
            _angle(across, up),
            None if in_plane else before_wall(eye, corners),
            _angle(left, right),
            float(np.radians(sight / broad)) if broad > 1e-12 * sight else 0.0,
        )


def flaws_of(wall: psw.Wall) -> list[str]:
    """Why a wall cannot be meant so, though it can be drawn."""
    width, height = (
        np.linalg.norm(corner - wall.lower_left) for corner in (wall.lower_right, wall.upper_left)
    )
    if max(width, height) <= LARGEST_WALL:
        return []
    return [
        f"it would be {width:g} × {height:g} m large; corners are in metres: "
        "where they are millimetres, divide them by 1000"
    ]


def findings(rig: Rig) -> list[str]:
    """What is doubtful, one line each, with a remedy; empty for a rig that looks sound."""
    found = [finding for wall in rig.walls for finding in _of_wall(rig, wall)]
    found += [*clashing_windows(rig), *_overlapping(rig)]
    rest = rig.eyes.rest_pose.position
    if np.abs(rest).max() > _FAR:
        found.append(
            f"[eyes] rest_pose: the head rests {np.abs(rest).max():g} m away; is that in millimetres?"
        )
    return found


def _of_wall(rig: Rig, wall: RigWall) -> Iterator[str]:
    is_ = WallMeasures.of(rig, wall)
    name = f"wall '{wall.name}'"
    if abs(is_.angle - 90) > _LEAN:
        yield f"{name} is no rectangle: its lower and left edge meet at {is_.angle:.1f}°; check its corners"
    if is_.faces_eye is None:
        yield f"{name} lies in the plane of the eye at rest, which sees it edge-on; move [eyes] rest_pose"
    elif not is_.faces_eye:
        yield (
            f"{name} turns its back on the eye at rest, which sees its picture mirrored; exchange its "
            "left and right corners, or move [eyes] rest_pose before it"
        )
    w = wall.in_room(rig.eyes.rest_pose)
    across, up = w.lower_right - w.lower_left, w.upper_left - w.lower_left
    if up[1] < -0.5 * np.linalg.norm(up):
        yield f"{name} hangs upside down: upper_left is lower than lower_left; exchange them if it does not"
    elif abs(across[1]) > 0.5 * np.linalg.norm(across):
        yield f"{name} stands on its side: lower_right is not beside lower_left; check its corners"
    if max(is_.size) < _SMALLEST_WALL:
        yield f"{name} is {1e3 * is_.size[0]:g} × {1e3 * is_.size[1]:g} mm small; corners are in metres"
    ratio = is_.pixel[0] / is_.pixel[1]
    if not 1 / _SQUARE <= ratio <= _SQUARE:
        yield (
            f"{name} has pixels of {1e3 * is_.pixel[0]:.3g} × {1e3 * is_.pixel[1]:.3g} mm, which are not "
            "square; check its corners against its pixels"
        )


def clashing_windows(rig: Rig) -> list[str]:
    """Walls of one machine that fill the same monitor, one line each pair: they cannot both be seen."""
    return [
        f"walls '{one.name}' and '{other.name}' both fill "
        f"{'the same monitor' if one.window.monitor is None else f'monitor {one.window.monitor}'}; "
        "give each a monitor of its own, or a position and a size"
        for one, other in _neighbours(rig)
        if one.window.fullscreen and other.window.fullscreen
    ]


def _overlapping(rig: Rig) -> list[str]:
    return [
        f"the windows of walls '{one.name}' and '{other.name}' overlap; move one of them"
        for one, other in _neighbours(rig)
        if one.window.position and other.window.position and _overlap(one, other)
    ]


def _neighbours(rig: Rig) -> Iterator[tuple[RigWall, RigWall]]:
    """Pairs of walls on the same monitor of the same machine."""
    for one, other in combinations(rig.walls, 2):
        if (one.machine, one.window.monitor) == (other.machine, other.window.monitor):
            yield one, other


def _overlap(one: RigWall, other: RigWall) -> bool:
    spans = []
    for wall in (one, other):
        low = np.array(wall.window.position)
        spans.append((low, low + np.array(wall.window.size or wall.wall.pixels)))
    (low_a, high_a), (low_b, high_b) = spans
    return bool((np.maximum(low_a, low_b) < np.minimum(high_a, high_b)).all())


def _angle(a: np.ndarray, b: np.ndarray) -> float:
    """Degrees between two vectors."""
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))
