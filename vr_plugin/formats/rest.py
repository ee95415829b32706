"""Where the viewer's eyes rest, which many files do not say."""

from __future__ import annotations

import numpy as np

from ..pose import Pose, turn_about
from .draft import Draft, DraftWall
from .report import Report

# An eye nearer to a wall's plane sees next to nothing of it, metres.
_NEAREST_REST = 0.1
_STANDING_EYES = np.array([0.0, 1.7, 0.0])
# A head outside the walls that would turn by more than this to face their middle is turned to it, radians.
_LOOKS_AWAY = np.pi / 4


def rest_pose(draft: Draft, walls: list[DraftWall], scale: float, report: Report) -> Pose:
    """room_from_head before anything tracks: looking along −z, or at walls that are elsewhere."""
    place = _place(draft, walls, scale, report)
    corners = np.array([_four_corners(wall) for wall in walls if wall.fixed_to == "room"]) * scale
    if not len(corners):
        return Pose(place)
    points = corners.reshape(-1, 3)[:, [0, 2]] - place[[0, 2]]
    if ((points.min(0) <= 0) & (points.max(0) >= 0)).all():  # among them
        return Pose(place)
    x, z = points.mean(0)
    angle = np.arctan2(-x, -z)
    return Pose(place, turn_about((0, 1, 0), angle)) if abs(angle) > _LOOKS_AWAY else Pose(place)


def _place(draft: Draft, walls: list[DraftWall], scale: float, report: Report) -> np.ndarray:
    """Where the viewer's eyes are before anything tracks, metres."""
    fixed = _fixed_viewer(walls, report)
    if fixed is not None:
        return fixed * scale
    if draft.rest is not None:
        return draft.rest * scale
    what, place = _likely_rest(draft, walls, scale)
    x, y, z = place
    report.note(f"no place of the viewer at rest is stated: eyes at {x:.4g}, {y:.4g}, {z:.4g} m ({what})")
    return place


def _likely_rest(draft: Draft, walls: list[DraftWall], scale: float) -> tuple[str, np.ndarray]:
    """The first of the usual places from which all walls are seen from the front."""
    standing = ("standing at the origin", _STANDING_EYES)
    corners = np.array([_four_corners(wall) for wall in walls if wall.fixed_to == "room"]) * scale
    if not len(corners):
        return standing
    points = corners.reshape(-1, 3)
    low, high = points.min(0), points.max(0)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]).sum(0)
    distance = max(1.0, float((high - low).max()) / 2)
    before = (low + high) / 2 + distance * normals / max(np.linalg.norm(normals), 1e-9)
    places = []
    if draft.default_rest is not None:
        places.append((f"where {draft.system} puts them", draft.default_rest * scale))
    if low[1] < _STANDING_EYES[1] < high[1]:
        places.append(standing)
    places += [("the middle of the room", (low + high) / 2), ("before the walls", before)]
    good = ((what, place) for what, place in places if all(_well_before(place, c) for c in corners))
    return next(good, places[0])


def _four_corners(wall: DraftWall) -> list[np.ndarray]:
    lower_left, lower_right, upper_left = wall.lower_left, wall.lower_right, wall.upper_left
    return [lower_left, lower_right, lower_right + upper_left - lower_left, upper_left]


def _fixed_viewer(walls: list[DraftWall], report: Report) -> np.ndarray | None:
    """The one place that all walls are drawn for, if they are; several are said."""
    fixed = [wall for wall in walls if wall.viewer is not None]
    if not fixed:
        return None
    places = {tuple(wall.viewer) for wall in fixed}
    if len(places) == 1 and len(fixed) == len(walls):
        report.note("these walls are drawn for fixed eyes: nothing tracks them in that program")
        return fixed[0].viewer
    names = ", ".join(dict.fromkeys(wall.machine.partition(":")[0] or wall.name for wall in fixed))
    report.note(
        f"walls of {names} are drawn for fixed eyes of their own; a rig has one viewer: "
        "convert them by themselves with --host"
    )
    return None


def _well_before(eye: np.ndarray, corners: np.ndarray) -> bool:
    normal = np.cross(corners[1] - corners[0], corners[3] - corners[0])
    return bool(normal @ (eye - corners[0]) >= _NEAREST_REST * np.linalg.norm(normal))
