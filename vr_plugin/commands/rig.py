"""`persp-sw rig`: what there is to know of an installation, as a table and as a picture."""

from __future__ import annotations

import importlib
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from persp_sw.commands.options import json_option, open_scene, say_missing_voxels, tf_option, volume_options
from persp_sw.commands.output import print_facts, print_json, progress_bars

from ..formats.opening import open_rig
from .rig_report import print_rig, values_of

if TYPE_CHECKING:
    from ..rig import Rig, TrackerPlace

_EPILOG = """\b
Examples:
  persp-sw rig check configs/cave4.toml
  persp-sw rig show configs/cave4.toml -o room.png --volume head.nrrd
  persp-sw rig show configs/cave4.toml --path optitrack-120hz.csv.gz
  persp-sw rig show kitware.pvx --unit m
"""
_SHOW_EPILOG = """\b
Examples:
  persp-sw rig show configs/cave4.toml
  persp-sw rig show configs/cave4.toml --volume head.nrrd --path walk.csv -o room.png
  persp-sw rig show kitware.pvx --unit m

\b
The picture shows every wall with its name, written as one reads it from the wall's
front, the dot in its lower left corner, an arrow out of its front; the eyes at rest
and what they see through the walls; the volume's box with its letters (L R A P S I)
or axes; and the path a recorded head takes, red where it is outside.
"""
# Commands that lie in modules of their own, which need not be there.
_OTHERS = {"convert": "vr_plugin.commands.rig_convert"}


class _Group(click.Group):
    """This group's commands, and those of `_OTHERS` that are there; these are imported when they run."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return [*super().list_commands(ctx), *(name for name, home in _OTHERS.items() if find_spec(home))]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name in _OTHERS and find_spec(_OTHERS[cmd_name]):
            return getattr(importlib.import_module(_OTHERS[cmd_name]), cmd_name)
        return super().get_command(ctx, cmd_name)


unit_option = click.option(
    "--unit", metavar="mm|cm|m|in|ft", help="Of lengths in another system's file that does not say."
)


@click.group(cls=_Group, epilog=_EPILOG)
def rig() -> None:
    """Check and show the walls, eyes and tracker of an installation."""


@rig.command()
@click.argument("file", type=click.Path())
@unit_option
@json_option
def check(file: str, unit: str | None, as_json: bool) -> None:
    """Tell what is in FILE, a rig file or another system's wall file, and what is doubtful in it.

    Every problem of a file that cannot be read is listed at once. What is doubtful but can be shown, such as
    a wall that turns its back on the viewer, is listed below the table.
    """
    opened = open_rig(file, unit, warn=False)
    if as_json:
        print_json({"file": file, **values_of(opened)})
        return
    print_rig(file, opened)


@rig.command(epilog=_SHOW_EPILOG)
@click.argument("file", type=click.Path())
@click.option("-o", "--out", type=click.Path(), help="Picture to write, .png. [default: NAME-room.png]")
@click.option(
    "--volume", "volume_file", type=click.Path(), metavar="FILE|SCENE", help="A volume to stand in the room."
)
@tf_option
@click.option(
    "--path", "path_file", type=click.Path(), metavar="CSV", help="A recorded head path, .csv or .csv.gz."
)
@unit_option
@volume_options
@json_option
def show(
    file: str,
    out: str | None,
    volume_file: str | None,
    tf: str | None,
    path_file: str | None,
    unit: str | None,
    as_json: bool,
    **keys: Any,
) -> None:
    """Draw the room of FILE, a rig file or another system's wall file, as a picture."""
    import persp_sw as psw

    from ..room.picture import draw_room

    target = psw.images.check_output(out or f"{Path(file).name.split('.')[0]}-room.png")
    if target.suffix.lower() != ".png":
        raise click.UsageError(f"the picture is a .png; given {target}")
    opened = open_rig(file, unit, warn=False)
    values: dict[str, Any] = {"file": file, "out": str(target), **values_of(opened)}
    heads = None
    if path_file:
        heads = _heads(opened.tracker_for(path_file), path_file)
        values["path"] = _path_values(opened, heads)
    renderer = None
    with progress_bars() as progress:
        if volume_file:
            scene = open_scene(volume_file, progress, tf=tf, **keys)
            renderer = psw.Renderer(
                scene.volume, scene.transfer, psw.Settings(quality=2), scene.regions, progress, scene.look
            )
            values["room_from_world"] = _room_from_world(opened, scene.volume)
        picture = draw_room(opened, renderer=renderer, heads=heads)
    try:
        picture.save(target)
    except OSError as error:
        raise click.UsageError(f"cannot write {target}: {error.strerror or error}") from None
    if as_json:
        print_json(values)
        return
    if renderer is not None:
        say_missing_voxels(renderer.volume)
    print_rig(file, opened)
    rows = {"picture": str(target)}
    if heads is not None:
        path = values["path"]
        rows["head path"] = (
            f"{path['poses']} poses, {100 * path['inside']:.1f} % inside the walls, "
            f"{path['low'][1]:.2f} … {path['high'][1]:.2f} m high"
        )
    print_facts(rows)


def _heads(place: TrackerPlace, path_file: str) -> np.ndarray:
    """(n, 3) room positions of a recorded path."""
    from ..trackers.recording import Recording

    return np.array([place.room_from_head(pose).position for pose in Recording.load(path_file).poses])


def _path_values(opened: Rig, heads: np.ndarray) -> dict[str, Any]:
    from ..room.scene import between_walls

    inside = float(between_walls(heads, opened).mean())
    return {"poses": len(heads), "inside": inside, "low": heads.min(0), "high": heads.max(0)}


def _room_from_world(opened: Rig, volume: Any) -> np.ndarray:
    from ..placement import room_from_world

    return room_from_world(opened, volume)
