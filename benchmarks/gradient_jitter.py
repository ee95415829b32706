"""How restless a lit surface is when it turns slowly, by how far apart the gradient's neighbours are.

    python benchmarks/gradient_jitter.py [--data FOLDER] [--frames 24] [--degrees 0.05]

Yuan et al. 2011 report jitter of gradients taken on the fly from neighbours one spacing away, on an electron
density of 68³ voxels (ironprot), and that it goes with a larger distance. Here the same volume, or a made-up
one where it is not there, turns as an opaque lit surface. A frame's change against what it should be is that
of a picture with four times the pixels and samples, of the same gradient: told are the root mean square of
the change of our error from frame to frame, as a part of that of the picture's own change, and the error.
Gradients precomputed at voxels and interpolated are, at a distance of 1, the same ones.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

import persp_sw as psw
from persp_sw.volume.phantoms import synthetic_ct

DISTANCES = (1.0, 1.25, 2.0, 4.0)
SIZE = (256, 256)


def turned(volume: psw.Volume, degrees: float) -> psw.View:
    """From outside, `degrees` around z."""
    angle = np.radians(35 + degrees)
    eye = volume.centre + 1.9 * max(volume.extent) * np.array([np.cos(angle), np.sin(angle), 0.45])
    return psw.View.look_at(eye, volume.centre, (0, 0, 1), 36, SIZE)


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    default = os.environ.get("PERSP_SW_DATA", "../shared/data")
    parser.add_argument("--data", type=Path, default=Path(default) / "volumes")
    parser.add_argument("--frames", type=int, default=24)
    parser.add_argument("--degrees", type=float, default=0.05, help="from frame to frame")
    given = parser.parse_args()
    path = given.data / "ironprot.nrrd"
    volume = psw.load(path) if path.exists() else synthetic_ct(68)
    scene = psw.Scene.of_volume(volume, tf="surface")
    table = Table("light", "distance", "jitter / change", "error, rms")
    for lit in (False, True):
        for distance in DISTANCES if lit else (1.0,):
            look = psw.Look(psw.Lighting() if lit else None, None, distance)
            ours = psw.Renderer(volume, scene.transfer, look=look)
            best = psw.Settings(quality=4, samples_per_interval=4, residual=1e-4)
            fine = psw.Renderer(volume, scene.transfer, best, look=look)
            views = [turned(volume, n * given.degrees) for n in range(given.frames)]
            truth = np.stack([fine.render(view) for view in views])
            error = np.stack([ours.render(view) for view in views]) - truth
            jitter = rms(np.diff(error, axis=0)) / rms(np.diff(truth, axis=0))
            table.add_row(
                "headlight" if lit else "none", f"{distance:g}" if lit else "–",
                f"{jitter:.2f}", f"{rms(error):.4f}",
            )  # fmt: skip
    Console().print(table)


if __name__ == "__main__":
    main()
