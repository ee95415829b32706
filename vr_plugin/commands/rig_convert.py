"""`persp-sw rig convert`: another system's wall file as a rig file of ours."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from persp_sw.commands.options import json_option
from persp_sw.commands.output import print_json

from ..formats import UNITS, Reading, import_rig
from ..rig import RigError

_EPILOG = """\b
Examples:
  persp-sw rig convert kitware.pvx --unit m -o wall.toml
  persp-sw rig convert config.cave.xml -o cave.toml
  persp-sw rig convert config.cave.xml --host viscluster51 --host viscluster53
  persp-sw rig convert C4.jconf --json | jq .notes

\b
COVISE counts in millimetres, VR Juggler in metres; ParaView and CalVR do not
say: give --unit. What a file says beyond walls, eyes and what tracks the
head is listed on stderr, and so is all that had to be assumed.
"""


@click.command(epilog=_EPILOG)
@click.argument("file", type=click.Path())
@click.option("-o", "--output", metavar="RIG.toml", help="Rig file to write; stdout by default.")
@click.option("--unit", type=click.Choice(UNITS), help="The file's unit of length.")
@click.option(
    "--host", "hosts", multiple=True, metavar="NAME", help="Walls of this machine; may be repeated."
)
@click.option("--skip-broken", is_flag=True, help="Leave out walls that cannot be read.")
@click.option("--pixels", type=int, nargs=2, metavar="W H", help="Of walls whose file states none.")
@json_option
def convert(
    file: str,
    output: str | None,
    unit: str | None,
    hosts: tuple[str, ...],
    skip_broken: bool,
    pixels: tuple[int, int] | None,
    as_json: bool,
) -> None:
    """Write FILE, walls of another system, as a rig file.

    FILE is a ParaView .pvx, a COVISE/OpenCOVER or CalVR .xml or a VR Juggler .jconf; its content decides.
    """
    from ..rigs.file import rig_to_toml

    reading = import_rig(file, unit, hosts=hosts, skip_broken=skip_broken, pixels=pixels)
    text = _headed(rig_to_toml(reading.rig), Path(file).name, reading)
    if output:
        _write(Path(output), text)
    if as_json:
        print_json(_values(reading, output))
        return
    if not output:
        click.echo(text, nl=False)
    for note in reading.notes:
        click.echo(f"{Path(file).name}: {note}", err=True)
    if output:
        count = len(reading.rig.walls)
        click.echo(f"{output}: {count} wall{'s' * (count != 1)} of {reading.system}'s {Path(file).name}")


def _headed(text: str, source: str, reading: Reading) -> str:
    """The rig file with its origin and the notes on top, as comments."""
    lines = [f"Converted from {reading.system}'s {source}.", *reading.notes]
    return "".join(f"# {' '.join(line.split())}\n" for line in lines) + "\n" + text


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise RigError(f"{path}: {error.strerror or error}; choose another name with -o") from None


def _values(reading: Reading, output: str | None) -> dict[str, Any]:
    rig = reading.rig
    return {
        "system": reading.system,
        "output": output,
        "walls": [
            {
                "name": wall.name,
                "machine": wall.machine,
                "stereo": wall.stereo,
                "pixels": wall.wall.pixels,
                "lower_left": wall.wall.lower_left,
                "lower_right": wall.wall.lower_right,
                "upper_left": wall.wall.upper_left,
            }
            for wall in rig.walls
        ],
        "separation": rig.eyes.separation,
        "rest": rig.eyes.rest_pose.position,
        "tracker": {"kind": rig.tracker.kind, "address": rig.tracker.address},
        "notes": list(reading.notes),
    }
