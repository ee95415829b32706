"""`persp-sw demo`: pictures of a real CT, the truth beside them, and how far the two are apart."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.box import SIMPLE
from rich.table import Table

from .. import images
from ..geometry.framing import framed_view
from ..geometry.regions import Regions
from ..geometry.view import View
from ..optics.presets import srgb_points
from ..optics.transfer import TransferFunction
from ..volume.examples import stent
from ..volume.grid import Volume
from .options import json_option, open_scene
from .output import console, print_json, progress_bars

# A scan of an aorta with a stent graft, contrast agent in the vessels; close to Hounsfield units.
_STENT = [
    (90, "3a0a06", 0.0),  # faint soft tissue begins
    (180, "7a1c10", 0.012),
    (260, "c8442a", 0.05),  # vessels
    (360, "e88a58", 0.14),
    (520, "f4d8b0", 0.3),  # bone
    (800, "fff4e0", 0.5),
    (1300, "e8f2ff", 0.8),  # metal
    (2000, "ffffff", 0.9),
]
_ERROR_SCALE = 0.2  # one for all views, so that their maps compare
_BACKGROUND = (0.0006, 0.0009, 0.0015)
# Towards the eye; x = left, y = back, z = head. The third is along a diagonal of the voxel grid, where
# shear-warp has its largest steps along a ray.
_DIRECTIONS = {
    "front": (0.12, -1.0, 0.08),
    "side": (1.0, -0.35, 0.15),
    "diagonal": (1.0, -1.0, 1.0),
    "top": (0.1, -0.45, 1.0),
}
_CLOSE_EYE, _CLOSE_CENTRE = np.array((60, -170, 55)), np.array((-5, 0, 30))  # from the middle
_EPILOG = """\b
Examples:
  persp-sw demo
  persp-sw demo -o pictures --size 1024 --quality 4
  persp-sw demo --volume head.nrrd
"""


@click.command(epilog=_EPILOG)
@click.option(
    "-o", "--out", type=click.Path(), default="persp-sw-demo", show_default=True, help="Folder to write to."
)
@click.option(
    "--size", type=click.IntRange(16, 4096), default=512, show_default=True, help="Pictures' edge, pixels."
)
@click.option("--quality", type=float, default=2.0, show_default=True, help="Sharpness of the eye image.")
@click.option(
    "--samples",
    type=click.Choice(["1", "2", "4"]),
    default="2",
    show_default=True,
    help="From slice to slice.",
)
@click.option("--threads", type=int, metavar="N", help="Threads; all cores by default.")
@click.option(
    "--volume", "volume_file", type=click.Path(), help="Show this volume instead of the one that comes along."
)
@json_option
def demo(
    out: str,
    size: int,
    quality: float,
    samples: str,
    threads: int | None,
    volume_file: str | None,
    as_json: bool,
) -> None:
    """Render a real CT scan from several sides, and measure each picture's error.

    For each view it writes VIEW.png, VIEW-reference.png (a converged float64 ray caster's picture) and
    VIEW-error.png. The scan, a stent in an aorta, comes in the package visvis: pip install 'persp-sw[demo]'.
    No window is opened and nothing is downloaded.
    """
    from ..settings import Settings

    settings = Settings(quality=quality, samples_per_interval=int(samples), threads=threads)
    folder = images.output_folder(out)
    images.check_output(folder / "front.png")
    with progress_bars() as progress:
        if volume_file:
            scene = open_scene(volume_file, progress)
            volume, transfer, background = scene.volume, scene.transfer, scene.background
        else:
            volume, background = stent(), np.array(_BACKGROUND)
            transfer = TransferFunction(srgb_points(_STENT), opacity_unit=1.0)
        rows = run(
            volume,
            transfer,
            background,
            demo_views(volume, size, close=not volume_file),
            folder,
            settings,
            progress,
        )
    if as_json:
        print_json({"volume": volume.name, "folder": str(folder), "size": [size, size], "views": rows})
    else:
        _print(rows, folder, volume)


def demo_views(volume: Volume, size: int, *, close: bool) -> dict[str, View]:
    """Views of the whole volume from several sides and, if `close`, one near the middle of the stent."""
    views = {name: framed_view(volume, direction=way, size=(size, size)) for name, way in _DIRECTIONS.items()}
    if close:
        eye, centre = volume.centre + _CLOSE_EYE, volume.centre + _CLOSE_CENTRE
        views["close"] = View.look_at(eye, centre, (0, 0, 1), 28, (size, size))
    return views


def run(
    volume: Volume,
    transfer: TransferFunction,
    background: np.ndarray,
    views: dict[str, View],
    folder: Path,
    settings: Any,
    progress: Any,
) -> list[dict[str, Any]]:
    """Render, judge and write each view; one row of figures for each."""
    from ..renderer import Renderer
    from .shots import Judgement, time_frames, write_judgement

    renderer = Renderer(volume, transfer, settings)
    rows = []
    for number, (name, view) in enumerate(views.items()):
        progress(number, len(views), "views")
        timing = time_frames(renderer, [view] * 6)
        path = images.write(folder / f"{name}.png", timing.image, background)
        judgement = Judgement.of(
            timing.image,
            renderer,
            view,
            regions=Regions(),
            tolerance=1e-4,
            threads=settings.threads,
            progress=lambda done, total, _, name=name: progress(done, total, f"reference of {name}"),
        )
        rows.append(
            {
                "view": name,
                **timing.report(),
                **judgement.figures,
                "picture": str(path),
                **write_judgement(path, timing.image, judgement, background, scale=_ERROR_SCALE),
            }
        )
    progress(len(views), len(views), "views")
    return rows


def _print(rows: list[dict[str, Any]], folder: Path, volume: Volume) -> None:
    size = " × ".join(map(str, volume.size))
    table = Table(
        box=SIMPLE,
        title=f"{volume.name or 'volume'}, {size} voxels",
        title_justify="left",
        title_style="bold",
    )
    for heading in ("view", "faces", "samples", "ms", "PSNR dB", "covered", "mean error"):
        table.add_column(heading, justify="left" if heading == "view" else "right")
    for row in rows:
        table.add_row(
            row["view"],
            str(row["faces"]),
            f"{row['samples'] / 1e6:.1f} M",
            f"{row['ms']:.1f}",
            f"{row['psnr']:.1f}",
            f"{row['psnr_covered']:.1f}",
            f"{row['mean_signed_error']:+.1e}",
        )
    console().print(table)
    click.echo(f"pictures, references and error maps (brightest: {_ERROR_SCALE:g}) are in {folder}/")
