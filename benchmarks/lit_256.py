"""Lit pictures of 256³ voxels a second, and samples, beside VolumePro's 30 pictures and 533 million.

    python benchmarks/lit_256.py [--size 512] [--threads N] [--data FOLDER]

VolumePro (Pfister et al. 1999) takes every voxel of 256³ at 30 Hz, of the 533 million trilinear, lit samples
a second of which its card is able. Here runs and early termination leave most of them out, so both are told:
samples really taken and lit, and the voxels that a picture stands for. Volumes: made up, and bonsai where
`--data`, `PERSP_SW_DATA` or ../shared/data/volumes has it. Three functions from see-through to opaque, all
from a corner of the volume; composited and warped by the processor, medians of `--frames`.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from statistics import median
from time import perf_counter

from rich.console import Console
from rich.table import Table

import persp_sw as psw
from persp_sw.measure.cases import eye_path, transfer_for
from persp_sw.volume.phantoms import synthetic_ct

EDGE = 256
LOOKS = {
    "unlit": psw.Look(),
    "headlight": psw.Look(psw.Lighting()),
    "three lights": psw.Look(
        psw.Lighting(headlight=0.4, lights=(psw.Light((1, 1, 2)), psw.Light((-2, 1, 0), (0.3, 0.3, 0.5))))
    ),
}


def volumes(folder: Path) -> dict[str, psw.Volume]:
    """Of 256³ voxels."""
    found = {"synthetic CT": synthetic_ct(EDGE)}
    if (folder / "bonsai.nrrd").exists():
        found["bonsai"] = psw.load(folder / "bonsai.nrrd")
    return found


def measured(renderer: psw.Renderer, view: psw.View, frames: int) -> tuple[float, int]:
    """Median seconds of a picture, and its samples."""
    canvas = psw.Canvas(*view.size)
    seconds = []
    for _ in range(frames + 1):  # the first encodes, and compiles
        start = perf_counter()
        renderer.render(view, canvas)
        seconds.append(perf_counter() - start)
    return median(seconds[1:]), renderer.last["samples"]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--frames", type=int, default=15)
    parser.add_argument("--threads", type=int)
    default = os.environ.get("PERSP_SW_DATA", "../shared/data")
    parser.add_argument("--data", type=Path, default=Path(default) / "volumes")
    given = parser.parse_args()
    table = Table("volume", "function", "light", "pictures/s", "of unlit time", "samples M/s", "voxels M/s")
    for name, volume in volumes(given.data).items():
        for function in ("fog", "ramp", "surface"):
            transfer = transfer_for("ct", function, volume)
            renderer = psw.Renderer(volume, transfer, psw.Settings(threads=given.threads))
            view = eye_path(volume, "corner", (given.size, given.size), frames=0)[0]
            unlit = None
            for label, look in LOOKS.items():
                renderer.look = look
                seconds, samples = measured(renderer, view, given.frames)
                unlit = unlit or seconds
                table.add_row(
                    name, function, label, f"{1 / seconds:.1f}", f"{seconds / unlit:.2f}",
                    f"{samples / seconds / 1e6:.0f}", f"{EDGE**3 / seconds / 1e6:.0f}",
                )  # fmt: skip
    Console().print(table)


if __name__ == "__main__":
    main()
