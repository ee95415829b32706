"""The rig file: one installation as TOML, read and written."""

from __future__ import annotations

import logging
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

import persp_sw as psw

from ..rig import Eyes, Placement, QualityAim, Rig, RigError, RigWall, TrackerPlace, WindowPlace
from .check import findings, flaws_of
from .problems import sentences
from .schema import RigKeys, WallKeys
from .schema_types import UNION_TAGS, matrix_of
from .text import rig_to_toml

__all__ = ["load_rig", "rig_of_keys", "rig_to_toml"]

_log = logging.getLogger("persp_sw")


def load_rig(path: str | Path, *, warn: bool = True) -> Rig:
    """Read a rig file.

    A recording's `address` is taken from the file's own folder where it is there. What is doubtful but can be
    shown, such as a wall that turns its back on the viewer, is logged as a warning, unless `warn` is false.

    Raises
    ------
    RigError
        The file cannot be read or parsed, or has problems: all of them are listed.
    """
    path = Path(path)
    rig = rig_of_keys(_read(path), source=f"rig {path}", folder=path.parent)
    for finding in findings(rig) if warn else ():
        _log.warning("rig %s: %s", path, finding)
    return rig


def rig_of_keys(keys: Mapping[str, Any], *, source: str = "the rig", folder: str | Path = ".") -> Rig:
    """The rig that the keys of a rig file describe; RigError, which lists every problem, if they do not."""
    checked, problems = None, []
    try:
        checked = RigKeys.model_validate(dict(keys))
    except ValidationError as error:
        problems = sentences(error.errors(), RigKeys, UNION_TAGS)
    problems = [_with_name(problem, keys) for problem in problems]
    walls, flaws = _walls(checked.wall if checked else keys.get("wall"))
    problems += flaws
    if problems:
        count = f"{len(problems)} problems" if len(problems) > 1 else "a problem"
        raise RigError("\n  - ".join([f"{source} has {count}:", *problems]))
    folder = Path(folder)
    eyes, world, quality = checked.eyes, checked.world, checked.quality
    return Rig(
        walls,
        Eyes(eyes.separation, eyes.offset, eyes.rest_pose.pose, eyes.near),
        _found(checked.tracker.place(**_fields(checked.tracker, "kind", "head", "wand")), folder),
        Placement(world.room_from_world and matrix_of(world.room_from_world), world.centre, world.size),
        QualityAim(quality.target_hz, quality.quality, quality.min, quality.max),
        checked.name,
        [_found(recording.place(kind="path"), folder) for recording in checked.recording],
    )


def _read(path: Path) -> dict[str, Any]:
    try:
        import tomllib
    except ImportError:  # Python 3.10
        import tomli as tomllib
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise RigError(f"there is no rig file {path}; check the name and the folder") from None
    except UnicodeDecodeError:
        raise RigError(f"{path} is not a text file; a rig is written in TOML") from None
    except OSError as error:
        raise RigError(f"cannot read the rig file {path}: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise RigError(f"{path} is not valid TOML: {error}; mend the file there") from None


def _walls(given: Any) -> tuple[list[RigWall], list[str]]:
    """The walls that can be made, and what is wrong with the others' corners and with the names.

    Tables that are wrong otherwise are passed over, so that corners are judged in a file with other problems.
    """
    walls, problems, names = [], [], {}
    for number, one in enumerate(given if isinstance(given, list) else []):
        try:
            keys = WallKeys.model_validate(one)
        except ValidationError:
            continue
        where = f"wall[{number}] '{keys.name}'"
        if keys.name in names:
            problems.append(f"{where}: wall[{names[keys.name]}] has this name, too; give each its own")
        names.setdefault(keys.name, number)
        window = WindowPlace(**_fields(keys.window, "monitor", "position", "size", "fullscreen"))
        try:
            wall = psw.Wall(keys.lower_left, keys.lower_right, keys.upper_left, keys.pixels, keys.name)
        except psw.PerspSWError as error:
            corners = ", ".join(str(list(c)) for c in (keys.lower_left, keys.lower_right, keys.upper_left))
            problems.append(f"{where}: {error}; given {corners}")
            continue
        problems += [f"{where}: {flaw}" for flaw in flaws_of(wall)]
        walls.append(RigWall(wall, keys.stereo, window, keys.machine, keys.fixed_to))
    return walls, problems


def _found(place: TrackerPlace, folder: Path) -> TrackerPlace:
    beside = folder / place.address
    if place.kind == "path" and beside.is_file():
        return replace(place, address=str(beside.absolute()))
    return place


def _fields(keys: Any, *names: str) -> dict[str, Any]:
    return {name: getattr(keys, name) for name in names}


def _with_name(problem: str, keys: Mapping[str, Any]) -> str:
    """A problem of wall[3] with that wall's name, where it has one."""
    found = re.match(r"wall\[(\d+)\]", problem)
    if found:
        wall = keys["wall"][int(found[1])]
        name = wall.get("name") if isinstance(wall, Mapping) else None
        if name:
            return f"{found[0]} '{name}'{problem[found.end() :]}"
    return problem
