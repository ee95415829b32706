"""What there is to know of a rig, as a table for people and as values for programs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import click
import numpy as np

from persp_sw.commands.output import numbers, print_facts

from ..rig import Rig, RigWall, TrackerPlace, WindowPlace
from ..rigs.check import WallMeasures, findings


def values_of(opened: Rig) -> dict[str, Any]:
    """All that `check` tells of a rig, ready for JSON."""
    eyes, world, quality = opened.eyes, opened.placement, opened.quality
    return {
        "name": opened.name,
        "walls": [_wall_values(opened, wall) for wall in opened.walls],
        "machines": opened.machines,
        "eyes": {
            "separation": eyes.separation,
            "offset": eyes.offset,
            "rest_position": eyes.rest_pose.position,
            "rest_orientation": eyes.rest_pose.orientation,
            "near": eyes.near,
        },
        "tracker": _tracker_values(opened.tracker),
        "recordings": [_tracker_values(place) for place in opened.recordings],
        "world": {
            "room_from_world": world.room_from_world,
            "centre": world.centre,
            "size": None if world.room_from_world is not None else world.size,
        },
        "quality": {
            "target_hz": quality.target_hz,
            "quality": quality.quality,
            "min": quality.min_quality,
            "max": quality.max_quality,
        },
        "findings": findings(opened),
    }


def _wall_values(opened: Rig, wall: RigWall) -> dict[str, Any]:
    measures = WallMeasures.of(opened, wall)
    w, window = wall.wall, wall.window
    return {
        "name": wall.name,
        "lower_left": w.lower_left,
        "lower_right": w.lower_right,
        "upper_left": w.upper_left,
        "size": measures.size,
        "pixels": w.pixels,
        "pixel_mm": 1e3 * np.array(measures.pixel),
        "degrees": measures.degrees,
        "pixels_a_degree": measures.pixels_a_degree,
        "faces_eye": measures.faces_eye,
        "stereo": wall.stereo,
        "fixed_to": wall.fixed_to,
        "machine": wall.machine,
        "window": {key: getattr(window, key) for key in ("monitor", "position", "size", "fullscreen")},
    }


def _tracker_values(place: TrackerPlace) -> dict[str, Any]:
    keys = ("kind", "address", "head", "wand", "latency", "room_from_tracker")
    return {key: getattr(place, key) for key in keys} | {"sensor_from_head": place.sensor_from_head.matrix}


def print_rig(file: str, opened: Rig) -> None:
    """A table of walls below what else there is to know, for people."""
    print_facts(dict(_facts(file, opened)))
    several = len(opened.machines) > 1 or bool(opened.machines[0])
    rows = [("wall", "metres", "pixels", "mm/pixel", "pixels/°", "stereo", "window", "machine")]
    for wall in opened.walls:
        measures = WallMeasures.of(opened, wall)
        rows.append(
            (
                wall.name,
                "×".join(f"{edge:.4g}" for edge in measures.size),
                "×".join(map(str, wall.wall.pixels)),
                f"{1e3 * measures.pixel[0]:.3g}",
                f"{measures.pixels_a_degree:.3g}",
                wall.stereo,
                _window(wall.window),
                wall.machine or "any",
            )
        )
    rows = rows if several else [row[:-1] for row in rows]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    click.echo()
    for number, row in enumerate(rows):
        # Not rich's: it cuts names where stdout is narrow or no terminal.
        line = "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        click.secho(line, bold=number == 0)
    doubts = findings(opened)
    if doubts:
        click.echo()
    for finding in doubts:
        click.echo(click.style("doubtful  ", fg="yellow") + finding)


def _facts(file: str, opened: Rig) -> Iterator[tuple[str, str]]:
    eyes, world = opened.eyes, opened.placement
    yield "file", file
    if opened.name:
        yield "name", opened.name
    count = len(opened.walls)
    if all(wall.fixed_to == "head" for wall in opened.walls):
        yield "walls", f"{count}, going with the head"
    else:
        size = np.ptp(opened.corners.reshape(-1, 3), axis=0)
        yield "walls", f"{count}, the box around them {numbers(size, 3)} m (x, y, z)"
    look = -eyes.rest_pose.matrix[:3, 2]
    yield (
        "eyes",
        f"{1e3 * eyes.separation:.3g} mm apart; at rest at {_place(eyes.rest_pose.position)}, looking along "
        f"{_place(look)}",
    )
    yield "tracker", _tracker(opened.tracker)
    if opened.recordings:
        yield "recordings", "; ".join(map(_tracker, opened.recordings))
    if world.room_from_world is not None:
        yield "volume", "stands as room_from_world says"
    else:
        at = "the middle of the room, at eye height" if world.centre is None else _place(world.centre)
        yield "volume", f"its longest edge {world.size:g} m, its middle at {at}"
    quality = opened.quality
    yield (
        "quality",
        f"{quality.quality:g}, within {quality.min_quality:g} … {quality.max_quality:g}, aiming at "
        f"{quality.target_hz:g} Hz",
    )


def _tracker(place: TrackerPlace) -> str:
    if place.kind == "none":
        return "none: eyes stay at rest"
    origin = _place(np.asarray(place.room_from_tracker)[:3, 3])
    return f"{place.kind} {place.address}".rstrip() + f", its origin at {origin}"


def _place(point: Any) -> str:
    return "(" + ", ".join(f"{value + 0.0:.3g}" for value in np.round(point, 6)) + ")"


def _window(window: WindowPlace) -> str:
    words = [] if window.monitor is None else [f"monitor {window.monitor}"]
    if window.fullscreen:
        words = ["all of " + (words[0] if words else "a monitor")]
    if window.position is not None:
        words.append(f"at {window.position[0]}, {window.position[1]}")
    if window.size is not None:
        words.append(numbers(window.size, 5))
    return ", ".join(words) or "anywhere"
