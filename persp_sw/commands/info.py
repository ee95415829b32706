"""`persp-sw info`: what is in a file, and what the run-length store makes of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
from rich.box import SIMPLE
from rich.table import Table
from rich.text import Text

from ..scene import Scene
from ..volume.dicom_series import Series, list_series
from .options import json_option, open_scene, say_missing_voxels, tf_option, volume_options
from .output import ProgressCall, byte_size, console, numbers, print_facts, print_json, progress_bars

_EPILOG = """\b
Examples:
  persp-sw info head.nrrd
  persp-sw info dicom-folder
  persp-sw info dicom-folder --series 2
  persp-sw info fmri.nii.gz --frame 12
  persp-sw info scan.raw --shape 256 256 128 --dtype uint16 --spacing 1 1 2
  persp-sw info head.nrrd --json | jq .axes

\b
The table of axes: the store keeps one copy of the volume per principal axis,
of the visible voxels only, as runs. `bytes` counts voxels and index.
"""


@click.command(epilog=_EPILOG)
@click.argument("file", type=click.Path())
@tf_option
@volume_options
@json_option
def info(file: str, as_json: bool, **keys: Any) -> None:
    """Tell what is in FILE, and what the run-length store makes of it.

    FILE is any volume (NRRD, NIfTI, MetaImage, TIFF stack, .npy, VTK, raw, a DICOM folder) or a scene file.
    Of a DICOM folder with several series, and none chosen by --series, it lists them.
    """
    with progress_bars() as progress:
        series = list_series(file, progress) if Path(file).is_dir() and keys["series"] is None else []
        if len(series) > 1:
            print_json(_series_values(file, series)) if as_json else _print_series(file, series)
            return
        scene = open_scene(file, progress, **keys)
        values = gather(scene, progress)
    values = {"file": file, **values}
    if as_json:
        print_json(values)
        return
    say_missing_voxels(scene.volume)
    _print(values)


def gather(scene: Scene, progress: ProgressCall | None = None) -> dict[str, Any]:
    """All that `info` tells of a scene, ready for JSON; every axis is encoded on the way."""
    volume = scene.volume
    values: dict[str, Any] = {
        "name": volume.name or Path(scene.keys.volume).name,
        "size": volume.size,
        "dtype": str(volume.data.dtype),
        "bytes": volume.data.nbytes,
        "spacing": volume.spacing,
        "extent": volume.extent,
        "centre": volume.centre,
        "world_from_object": volume.world_from_object,
        "orientation": volume.orientation,
        "value_range": volume.value_range,
        "nonfinite": volume.nonfinite,
        "preset": scene.preset.name if scene.preset else None,
        "preset_why": scene.preset.why if scene.preset else None,
        "axes": [],
    }
    if min(volume.size) > 1:
        from ..renderer import Renderer

        renderer = Renderer(volume, scene.transfer, progress=progress)
        reports = [renderer.runs.report(axis) for axis in range(3)]
        keys = ("axis", "runs", "mean_length", "bytes", "voxels_bytes", "index_bytes", "bounds_bytes")
        keys += ("dense_bytes",)
        values["axes"] = [{key: getattr(report, key) for key in keys} for report in reports]
    return values


def _series_values(file: str, series: list[Series]) -> dict[str, Any]:
    keys = ("number", "uid", "modality", "description", "slices", "size")
    return {"file": file, "series": [{key: getattr(one, key) for key in keys} for one in series]}


def _print_series(file: str, series: list[Series]) -> None:
    click.echo(f"{file} holds {len(series)} series; choose one with --series N")
    table = Table(box=SIMPLE)
    for heading in ("N", "modality", "description", "slices", "columns × rows", "UID"):
        table.add_column(heading, overflow="fold")
    for one in series:
        size = numbers(one.size)
        table.add_row(str(one.number), one.modality, Text(one.description), str(one.slices), size, one.uid)
    console().print(table)


def _print(values: dict[str, Any]) -> None:
    low, high = values["value_range"]
    missing = values["nonfinite"]
    rows = {
        "file": values["file"],
        "size": f"{numbers(values['size'])} voxels (x, y, z), {byte_size(values['bytes'])}",
        "type": values["dtype"],
        "spacing": numbers(values["spacing"]),
        "extent": numbers(values["extent"]),
        "orientation": _orientation(values["orientation"]),
        "values": f"{low:.6g} … {high:.6g}"
        + (f", {missing} NaN or infinite (transparent)" if missing else ""),
    }
    if values["preset"]:
        rows["preset"] = values["preset"] + (f": {values['preset_why']}" if values["preset_why"] else "")
    print_facts(rows)
    if not values["axes"]:
        click.secho("\none voxel thick: its box holds nothing, so pictures of it are empty", fg="yellow")
        return
    axes = Table(box=SIMPLE, title="\nrun-length store", title_justify="left", title_style="bold")
    for heading in ("axis", "runs", "mean length", "bytes", "dense", "part"):
        axes.add_column(heading, justify="left" if heading == "axis" else "right")
    for axis in values["axes"]:
        axes.add_row(
            axis["axis"],
            f"{axis['runs']:,}",
            f"{axis['mean_length']:.1f}",
            byte_size(axis["bytes"]),
            byte_size(axis["dense_bytes"]),
            f"{100 * axis['bytes'] / axis['dense_bytes']:.0f} %",
        )
    console().print(axes)


def _orientation(letters: str) -> str:
    words = {"L": "left", "R": "right", "A": "anterior", "P": "posterior", "S": "superior", "I": "inferior"}
    if len(letters) != 3:
        return "not stated"
    towards = ", ".join(
        f"{axis} to {words.get(letter, letter)}" for axis, letter in zip("xyz", letters, strict=True)
    )
    return f"{letters} ({towards})"
