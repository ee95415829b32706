"""A gallery of real volumes under light, with what each look costs and how far it is from the truth.

    python benchmarks/gallery.py [-o FOLDER] [--data FOLDER] [--size 400] [--only NAME ...] [--truth]

Rows are volumes; columns: unlit, a headlight, a key light with shadows, boundaries brought out by the
gradient's magnitude, and a two-dimensional transfer function. Writes gallery.png and gallery.json, and prints
a table: milliseconds to composite (median of 7) and their ratio to the unlit ones, milliseconds to encode
(shadows included), megabytes of runs and, with `--truth`, the PSNR of a 96 × 96 picture at quality 2 against
the float64 reference (kept in FOLDER; not of shadows, whose rays take minutes).

Data are looked for in `--data`, in `PERSP_SW_DATA` and in ../shared/data; a volume that is not there is left
out and said.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from rich.console import Console
from rich.table import Table

import persp_sw as psw
from persp_sw.measure.metrics import compare
from persp_sw.measure.truth import Truths

REPEATS = 7
TRUTH = 96  # pixels
NUMBERS = ("ms", "of_unlit", "encode_ms", "runs_mb", "psnr")


@dataclass(frozen=True)
class Subject:
    """One volume and how it is looked at.

    `tf`: rows or a preset's name; `eye`: in longest edges from the middle; `shapes`: of the two-dimensional
    function; `high`: part of the largest magnitude from which a boundary counts wholly.
    """

    name: str
    tf: str | list
    eye: tuple[float, float, float]
    shapes: list[psw.Box | psw.Triangle]
    high: float = 0.12
    up: tuple[float, float, float] = (0, 0, 1)


SUBJECTS = [
    Subject(
        "engine",
        [[90, 0.25, 0.45, 0.65, 0], [140, 0.4, 0.6, 0.8, 0.012], [175, 0.6, 0.65, 0.7, 0.02],
         [195, 0.95, 0.6, 0.25, 0.25], [255, 1, 0.85, 0.6, 0.7]],
        (0.75, -1.15, 0.8),
        [psw.Box((60, 190), (14, 130), (0.35, 0.55, 0.85), 0.06, 0.6),
         psw.Box((185, 256), (0, 140), (1, 0.7, 0.3), 0.5, 0.3)],
    ),
    Subject(
        "mni152_nilearn",
        [[60, 0.35, 0.1, 0.08, 0], [95, 0.75, 0.4, 0.32, 0.25], [150, 0.95, 0.75, 0.62, 0.6],
         [255, 1, 1, 1, 0.8]],
        (-1.05, -1.15, 0.65),
        [psw.Box((45, 165), (14, 90), (0.95, 0.68, 0.55), 0.6, 0.5)],
    ),
    Subject(
        "stent",
        [[60, 0.5, 0.1, 0.08, 0], [160, 0.65, 0.2, 0.12, 0.03], [330, 0.9, 0.7, 0.55, 0.3],
         [700, 1, 0.95, 0.9, 0.7], [1400, 1, 1, 1, 0.9]],
        (0.2, -1.7, 0.25),
        [psw.Triangle(180, (40, 500), 160, (0.8, 0.3, 0.2), 0.25, 0.5),
         psw.Box((350, 3000), (60, 3000), (1, 0.95, 0.85), 0.8, 0.2)],
    ),
    Subject(
        "bonsai",
        [[38, 0.2, 0.35, 0.12, 0], [55, 0.35, 0.6, 0.2, 0.12], [85, 0.45, 0.3, 0.15, 0.35],
         [130, 0.65, 0.5, 0.35, 0.5], [255, 0.8, 0.75, 0.7, 0.6]],
        (0.95, 0.35, 0.95),
        [psw.Box((30, 90), (6, 60), (0.35, 0.65, 0.2), 0.35, 0.5),
         psw.Box((90, 256), (8, 130), (0.75, 0.55, 0.35), 0.7, 0.3)],
        up=(0, 1, 0),
    ),
    Subject(
        "heptane",
        [[12, 0.1, 0.15, 0.5, 0], [40, 0.15, 0.4, 0.75, 0.02], [90, 0.2, 0.75, 0.6, 0.08],
         [150, 0.95, 0.75, 0.2, 0.3], [220, 0.95, 0.35, 0.1, 0.7]],
        (0.35, -1.05, 0.95),
        [psw.Box((20, 120), (6, 90), (0.25, 0.55, 0.9), 0.12, 0.6),
         psw.Box((110, 256), (5, 130), (1, 0.55, 0.15), 0.5, 0.4)],
        up=(-1, 0, 0),
    ),
    Subject(
        "nuclei_confocal",
        "microscopy",
        (0.35, -0.6, 0.95),
        [psw.Box((12000, 65535), (600, 20000), (0.3, 0.9, 0.55), 0.4, 0.5)],
    ),
]  # fmt: skip


def looks_from(view: psw.View) -> dict[str, psw.Look]:
    """By name; the key light comes from above the viewer's left shoulder."""
    wall = view.wall
    right, up = wall.lower_right - wall.lower_left, wall.upper_left - wall.lower_left
    back = view.eye.position - (wall.lower_right + wall.upper_left) / 2
    right, up, back = (v / np.linalg.norm(v) for v in (right, up, back))
    key = psw.Light(tuple(0.55 * back + 0.7 * up - 0.6 * right), (0.95, 0.92, 0.85), shadows=True)
    return {
        "unlit": psw.Look(),
        "headlight": psw.Look(psw.Lighting()),
        "key light, shadows": psw.Look(psw.Lighting(headlight=0.35, lights=(key,))),
        "boundaries": psw.Look(psw.Lighting(), psw.Modulation(0.0, 0.12, 0.9, 0.0)),
        "value and gradient": psw.Look(psw.Lighting()),
    }


def scene_of(subject: Subject, path: Path, size: int) -> psw.Scene:
    """The scene that looks at it."""
    scene = psw.Scene.of_file(path, tf=subject.tf, size=(size, size))
    volume = scene.volume
    eye = volume.centre + 1.15 * max(volume.extent) * np.array(subject.eye)
    centre, smallest = volume.centre, min(volume.spacing)
    return scene.with_keys(
        eye=eye.tolist(), centre=centre.tolist(), up=list(subject.up), fovy=36, opacity_unit=float(smallest)
    )


def pictures(
    subject: Subject, scene: psw.Scene, truths: Truths | None
) -> Iterator[tuple[str, np.ndarray, dict]]:
    """Name, linear picture and figures of each look."""
    view = scene.view(0)
    looks = looks_from(view)
    looks["boundaries"] = replace(
        looks["boundaries"], modulation=replace(looks["boundaries"].modulation, high=subject.high)
    )
    unlit = None
    for name, look in looks.items():
        transfer = scene.transfer
        if name == "value and gradient":
            transfer = psw.TransferFunction2D(subject.shapes, min(scene.volume.spacing))
        renderer = psw.Renderer(scene.volume, transfer, look=look)
        renderer.render(view)
        encode_ms, spent = renderer.last["encode_ms"], []
        for _ in range(REPEATS):
            renderer.composite(view.eye, [view.wall])
            spent.append(renderer.last["composite_ms"])
        unlit = unlit or median(spent)
        figures = {
            "ms": median(spent),
            "of_unlit": median(spent) / unlit,
            "encode_ms": encode_ms,
            "runs_mb": renderer.last["runs_bytes"] / 1e6,
            "psnr": None,
        }
        renderer.settings = psw.Settings(quality=2)
        if truths is not None and not (look.lighting and look.lighting.lights):
            small = scene.with_keys(size=[TRUTH, TRUTH]).view(0)
            truth = truths.of(scene.volume, transfer, small, psw.Regions(), look=look)
            figures["psnr"] = compare(renderer.render(small), truth)["psnr"]
        yield name, renderer.render(view), figures


def sheet(rows: dict[str, dict[str, np.ndarray]]) -> Image.Image:
    """All pictures with captions."""
    first = next(iter(rows.values()))
    edge, margin, font = next(iter(first.values())).shape[0], 22, ImageFont.load_default(15)
    page = Image.new("RGB", (edge * len(first), len(rows) * edge + margin), "black")
    pen = ImageDraw.Draw(page)
    for column, name in enumerate(first):
        pen.text((column * edge + 8, 2), name, "white", font)
    for row, (volume, found) in enumerate(rows.items()):
        for column, image in enumerate(found.values()):
            page.paste(Image.fromarray(psw.images.presented(image)), (column * edge, margin + row * edge))
        pen.text((8, margin + row * edge + 4), volume, "#bbbbbb", font)
    return page


def main() -> None:
    """Make it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    default = os.environ.get("PERSP_SW_DATA", "../shared/data")
    parser.add_argument("-o", "--out", type=Path, default=Path("gallery"))
    parser.add_argument("--data", type=Path, default=Path(default) / "volumes")
    parser.add_argument("--size", type=int, default=400)
    parser.add_argument("--only", nargs="*")
    parser.add_argument("--truth", action="store_true")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    truths = Truths(given.out / "references") if given.truth else None
    rows: dict[str, dict[str, np.ndarray]] = {}
    figures: dict[str, dict[str, dict]] = {}
    table = Table("volume", "look", *NUMBERS)
    for subject in SUBJECTS:
        if given.only and subject.name not in given.only:
            continue
        path = given.data / f"{subject.name}.nrrd"
        if not path.exists():
            print(f"{path} is not there: left out")
            continue
        scene = scene_of(subject, path, given.size)
        rows[subject.name], figures[subject.name] = {}, {}
        for name, image, found in pictures(subject, scene, truths):
            rows[subject.name][name], figures[subject.name][name] = image, found
            cells = ("–" if found[key] is None else f"{found[key]:.1f}" for key in NUMBERS)
            table.add_row(subject.name, name, *cells)
    if not rows:
        raise SystemExit(f"none of the volumes is in {given.data}: say where with --data")
    sheet(rows).save(given.out / "gallery.png")
    (given.out / "gallery.json").write_text(json.dumps(figures, indent=1) + "\n")
    Console().print(table)


if __name__ == "__main__":
    main()
