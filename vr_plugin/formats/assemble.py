"""A draft into a rig: one unit, names of their own, a viewer at rest, and what looks odd said."""

from __future__ import annotations

import re
from collections import Counter

import numpy as np

import persp_sw as psw
from persp_sw.errors import PerspSWError

from ..pose import Pose, quaternion_of
from ..rig import Eyes, Rig, RigError, RigWall, TrackerPlace
from ..rigs.check import LARGEST_WALL, findings
from .draft import Draft, DraftTracker, DraftWall
from .report import Report, printable
from .rest import rest_pose
from .units import ask_for_unit, metres_per_unit

# Rows of a wall whose file states no pixels.
_USUAL_ROWS = 1080
_MOST_PIXELS = 16384
# Further apart are no eyes, metres; a rig file refuses it.
_WIDEST_EYES = 0.2


def assemble(
    draft: Draft,
    report: Report,
    *,
    file: str,
    unit: str | None,
    hosts: tuple[str, ...],
    pixels: tuple[int, int] | None,
) -> Rig:
    """The rig of a draft; see `read_rig` for the options.

    Raises
    ------
    RigError
        All problems of the file, no wall, a host that shows none, or no unit where one is needed.
    """
    report.stop_if_broken()
    walls = _chosen(draft, file, hosts, report)
    scale = _scale(draft, report, file, walls, unit)
    sound = []
    for wall in walls:
        with report.part(f"wall '{wall.name}'"):
            _check_shape(wall, scale, report)
            sound.append(wall)
    report.stop_if_broken()
    walls = sound
    if not walls:
        raise RigError(_no_walls(draft, file, report))
    named = _names(walls)
    separation = Eyes.separation
    with report.part("the distance of the eyes"):
        separation = _separation(draft, scale, file, report)
    eyes = Eyes(separation, rest_pose=rest_pose(draft, walls, scale, report))
    rig_walls = []
    for wall, name in zip(walls, named, strict=True):
        size = wall.pixels or pixels or _usual_pixels(wall, name, report)
        with report.part(f"wall '{name}'"):
            rig_walls.append(_rig_wall(wall, name, size, scale, report))
    report.stop_if_broken()
    if not rig_walls:
        raise RigError(_no_walls(draft, file, report))
    tracker = TrackerPlace()
    with report.part("the tracker"):
        tracker = _tracker(draft.tracker, scale, report)
    report.stop_if_broken()
    rig = Rig(tuple(rig_walls), eyes=eyes, tracker=tracker, name=file.rpartition(".")[0] or file)
    own_viewer = {name for wall, name in zip(walls, named, strict=True) if wall.viewer is not None}
    _say_what_looks_odd(rig, own_viewer, report)
    return rig


def _no_walls(draft: Draft, file: str, report: Report) -> str:
    return "; ".join(
        [f"{file}: {draft.system}'s file, without a single wall that can be read", *report.notes]
    )


def _chosen(draft: Draft, file: str, hosts: tuple[str, ...], report: Report) -> list[DraftWall]:
    """The walls of the hosts asked for, or of one of their displays; all without."""
    if not draft.walls:
        raise RigError(_no_walls(draft, file, report))
    if not hosts:
        return draft.walls
    machines = list(dict.fromkeys(wall.machine for wall in draft.walls))
    chosen = {name: [m for m in machines if name in (m, m.partition(":")[0])] for name in hosts}
    unknown = [name for name, found in chosen.items() if not found]
    if unknown:
        known = ", ".join(name or "(no name)" for name in machines)
        raise RigError(f"{file}: no walls of host {', '.join(unknown)}; it has those of {known}")
    return [wall for wall in draft.walls if any(wall.machine in found for found in chosen.values())]


def _scale(draft: Draft, report: Report, file: str, walls: list[DraftWall], unit: str | None) -> float:
    """Metres in the file's unit."""
    if unit is None:
        if draft.unit is None:
            raise RigError(ask_for_unit(file, np.array([max(wall.edges) for wall in walls])))
        return metres_per_unit(draft.unit)
    if draft.unit is not None and unit != draft.unit:
        report.note(f"{draft.system} counts in {draft.unit}; read in {unit}, as asked")
    return metres_per_unit(unit)


def _check_shape(wall: DraftWall, scale: float, report: Report) -> None:
    across, up = wall.lower_right - wall.lower_left, wall.upper_left - wall.lower_left
    if np.linalg.norm(np.cross(across, up)) <= 1e-6 * max(*wall.edges, 1e-12) ** 2:
        raise report.broken(
            wall.where,
            f"wall '{wall.name}' has no area: its corners are on one line; give three that are not",
        )
    longest = max(wall.edges) * scale
    if longest > LARGEST_WALL:
        raise report.broken(
            wall.where, f"wall '{wall.name}' would be {longest:.4g} m long; is the unit (--unit) right?"
        )


def _names(walls: list[DraftWall]) -> list[str]:
    """Names of their own: with the machine, then the eye, then a number where need be."""
    ways = (
        lambda wall: wall.name,
        lambda wall: f"{wall.name} {wall.machine}",
        lambda wall: f"{wall.name} {wall.machine} {wall.stereo}",
    )
    names = [""] * len(walls)
    for way in ways:
        twice = {name for name, count in Counter(names).items() if count > 1 or not name}
        names = [printable(way(w)) if n in twice else n for w, n in zip(walls, names, strict=True)]
    taken: set[str] = set()
    for i, name in enumerate(names):
        names[i] = name = name or "wall"
        number = 2
        while names[i] in taken:
            names[i] = f"{name} {number}"
            number += 1
        taken.add(names[i])
    return names


def _separation(draft: Draft, scale: float, file: str, report: Report) -> float:
    if draft.eye_separation is None:
        return Eyes.separation
    separation = draft.eye_separation * scale
    if abs(separation) > _WIDEST_EYES:
        raise report.broken(file, f"the eyes would be {separation:.3g} m apart; they are 0.05 … 0.08 m")
    return separation


def _usual_pixels(wall: DraftWall, name: str, report: Report) -> tuple[int, int]:
    width, height = wall.edges
    columns = int(min(max(round(_USUAL_ROWS * width / height), 1), _MOST_PIXELS))
    report.note(f"wall '{name}': no pixels are stated; {columns} × {_USUAL_ROWS} taken: see --pixels")
    return columns, _USUAL_ROWS


def _rig_wall(wall: DraftWall, name: str, pixels: tuple[int, int], scale: float, report: Report) -> RigWall:
    corners = (wall.lower_left * scale, wall.lower_right * scale, wall.upper_left * scale)
    try:
        return RigWall(
            psw.Wall(*corners, pixels, name), wall.stereo, wall.window, wall.machine, wall.fixed_to
        )
    except PerspSWError as error:
        raise report.broken(wall.where, f"wall '{name}': {error}") from None


def _tracker(draft: DraftTracker | None, scale: float, report: Report) -> TrackerPlace:
    if draft is None:
        return TrackerPlace()
    if min(draft.head, draft.wand or 0) < 0:
        raise report.broken("tracker", f"bodies are counted from 0; given {draft.head} and {draft.wand}")
    matrix = np.eye(4)
    matrix[:3, :3] = draft.room_turn
    matrix[:3, 3] = draft.room_offset * scale
    head = Pose(draft.head_offset * scale, quaternion_of(draft.head_turn))
    address = printable(draft.address)
    return TrackerPlace(
        draft.kind, address, draft.head, draft.wand, room_from_tracker=matrix, sensor_from_head=head
    )


def _say_what_looks_odd(rig: Rig, own_viewer: set[str], report: Report) -> None:
    """What a rig's own check finds, and names that contradict the corners.

    Walls that are drawn for eyes of their own may well turn their backs on those of the rig.
    """
    own = tuple(f"wall '{name}' " for name in own_viewer)
    for finding in findings(rig):
        if not (finding.startswith(own) and "eye at rest" in finding):
            report.note(finding)
    eye = rig.eyes.rest_pose.position
    for wall, corners in zip(rig.walls, rig.corners, strict=True):
        aside = corners[:, 0].mean() - eye[0]
        words = re.findall(r"[a-z]+", wall.name.lower())
        for word, sign in (("left", -1), ("right", 1)):
            if wall.fixed_to == "room" and word in words and aside * sign < -0.05:
                side = "right" if aside > 0 else "left"
                report.note(
                    f"wall '{wall.name}' is to the viewer's {side}: its name or its corners are wrong"
                )
