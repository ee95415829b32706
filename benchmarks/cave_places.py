"""What a stereo frame on four walls takes, from in front of a volume, near it, diagonally and inside.

    python benchmarks/cave_places.py FOLDER [NAME …]

FOLDER holds volumes (`engine.nrrd`, `mni152_nilearn.nrrd`, `heptane.nrrd`, or NAMEs). Medians of 25 frames;
to compare two versions run both in turn.
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter

import numpy as np

import persp_sw as psw
from persp_sw.measure.cave import SEPARATION, four_walls, placed

PLACES = {
    "front": (0, 1.6, 1.3),
    "near": (0.3, 1.5, 0.7),
    "diagonal": (1, 1.7, 1),
    "inside": (0.05, 1.5, -0.1),
}
NAMES = ("engine.nrrd", "mni152_nilearn.nrrd", "heptane.nrrd")
PIXELS, WARM, FRAMES = 512, 3, 25
ROW = "{:20} {:9} {:>7} {:>9} {:>7} {:>7} {:>9} {}"


def frame(renderer: psw.Renderer, eyes, walls, canvases):
    """Seconds of planning, compositing and warping, and the eye images."""
    times = [perf_counter()]
    plans = [renderer.plan(eye, walls) for eye in eyes]
    times.append(perf_counter())
    images = [renderer.composite_plan(plan) for plan in plans]
    times.append(perf_counter())
    for eye, image in zip(eyes, images, strict=True):
        for wall, canvas in zip(walls, canvases, strict=True):
            renderer.warp(image, psw.View(eye, wall), canvas)
    times.append(perf_counter())
    return np.diff(times), images


def main(folder: str, *names: str) -> None:
    walls = four_walls(PIXELS)
    canvases = [psw.Canvas(PIXELS, PIXELS) for _ in walls]
    print(ROW.format("volume", "place", "plan", "composite", "warp", "ms", "samples", "faces"))
    for name in names or NAMES:
        renderer = psw.Renderer(placed(psw.load(Path(folder) / name)))
        for place, head in PLACES.items():
            eyes = [psw.Eye(np.add(head, (side * SEPARATION / 2, 0, 0))) for side in (-1, 1)]
            for _ in range(WARM):
                frame(renderer, eyes, walls, canvases)
            measured = [frame(renderer, eyes, walls, canvases) for _ in range(FRAMES)]
            plan, composite, warp = 1e3 * np.median([times for times, _ in measured], axis=0)
            images = measured[-1][1]
            samples, faces = sum(i.samples for i in images), [len(i.faces) for i in images]
            numbers = (f"{ms:.2f}" for ms in (plan, composite, warp, plan + composite + warp))
            print(ROW.format(name, place, *numbers, samples, str(faces)))


if __name__ == "__main__":
    main(*sys.argv[1:])
