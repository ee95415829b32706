"""A stereo frame of a four-wall CAVE: eight pictures from two compositings, all on the processor.

    python benchmarks/cave_frame.py [--volume N] [--size 1024] [--threads 2]

Room, viewer and placement are those of `persp_sw.measure.cave`; the volume is a synthetic CT. Eyes move
along a short path, so that every frame is new.
"""

from __future__ import annotations

import argparse
from time import perf_counter

import numpy as np

from persp_sw import Canvas, Renderer, Settings, TransferFunction, View
from persp_sw.measure.cave import eye_pair, four_walls, placed
from persp_sw.volume.phantoms import synthetic_ct

FUNCTIONS = {  # opacities a voxel
    "surface": [(0, (0, 0, 0), 0), (100, (0.9, 0.7, 0.5), 0), (125, (0.9, 0.7, 0.5), 1), (255, (1, 1, 1), 1)],
    "ramp": [(0, (0.2, 0.3, 0.8), 0), (128, (0.9, 0.6, 0.3), 0.5), (255, (1, 1, 1), 1)],
    "fog": [
        (0, (0.2, 0.3, 0.8), 0),
        (6, (0.2, 0.3, 0.8), 0),
        (40, (0.4, 0.6, 0.9), 0.006),
        (255, (1, 0.9, 0.7), 0.020),
    ],
}
CASES = [
    ("surface", 1, None),
    ("surface", 1, 1),
    ("ramp", 1, None),
    ("ramp", 1, 1),
    ("fog", 1, 1),
    ("fog", 2, 1),
    ("fog", 2, 2),
]


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--volume", type=int, default=256, help="voxels an edge")
    parser.add_argument("--size", type=int, default=1024, help="pixels of a wall's edge")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--frames", type=int, default=40)
    options = parser.parse_args()
    n = options.volume
    volume = placed(synthetic_ct(n))
    walls = four_walls(options.size)
    out = [[Canvas(options.size, options.size) for _ in walls] for _ in range(2)]
    print(f"{'function':8} quality samples   ms   composite  warp   frames/s  front covered  faces")
    for name, quality, samples in CASES:
        transfer = TransferFunction(FUNCTIONS[name], 1 / (n - 1))
        settings = Settings(quality=quality, samples_per_interval=samples, threads=options.threads)
        renderer = Renderer(volume, transfer, settings)
        times = []
        for frame in range(-2, options.frames):
            start = perf_counter()
            composite = 0.0
            for side, eye in enumerate(eye_pair(frame)):
                began = perf_counter()
                image = renderer.composite(eye, walls)
                composite += perf_counter() - began
                for wall, picture in zip(walls, out[side], strict=True):
                    renderer.warp(image, View(eye, wall), picture)
            if frame >= 0:
                times.append((perf_counter() - start, composite))
        whole, composite = np.median(times, axis=0) * 1e3
        covered = (out[0][0].pixels[..., 3] > 0).mean()
        print(
            f"{name:8} {quality:7} {samples or 'auto':>7} {whole:6.1f} {composite:9.1f} "
            f"{whole - composite:6.1f} {1e3 / whole:9.0f} {covered:13.0%} {len(image.faces):6}",
            flush=True,
        )


if __name__ == "__main__":
    main()
