"""Record what frames really cost along a head path at several qualities, for tests of the frame-time control.

    python benchmarks/record_costs.py [-o benchmarks/recorded_costs.json] [--threads 1] [--repeats 7]

A viewer in the CAVE of `persp_sw.measure.cave` sways before a synthetic CT of 128³ voxels, 1 m wide, comes
close, puts the head into it and steps back, in 12 s. At each of 96 poses both eyes are composited in every
way and at every quality, `repeats` times, the rounds of all qualities one after the other, so that what else
the machine does falls on all alike. Kept: the median ms, samples and pixels of each, how far each round was
from its median (the noise; a thousand draws), the features known before drawing, and their own time.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np

import persp_sw as psw
from persp_sw.measure.cave import SEPARATION, four_walls, placed
from persp_sw.measure.machine import describe_machine
from persp_sw.volume.phantoms import synthetic_ct

QUALITIES = (0.25, 0.35, 0.5, 0.71, 1.0, 1.41, 2.0)
SECONDS, POSES, VOXELS, PIXELS = 12.0, 96, 128, 1024
# Opacity a voxel; and the ways to sample that are recorded of it.
FOG = [
    (0, (0.2, 0.3, 0.8), 0),
    (6, (0.2, 0.3, 0.8), 0),
    (40, (0.4, 0.6, 0.9), 0.012),
    (255, (1, 0.9, 0.7), 0.04),
]
BONE = [(0, (0.9, 0.7, 0.5), 0), (100, (0.9, 0.7, 0.5), 0), (125, (0.9, 0.7, 0.5), 1), (255, (1, 1, 1), 1)]
SCENES = {
    "fog": (FOG, {"1 sample": {"samples_per_interval": 1}, "2 samples": {"samples_per_interval": 2}}),
    "bone": (BONE, {"pre-integrated": {"samples_per_interval": 1, "preintegrated": True}}),
}


def head(time: float) -> np.ndarray:
    """Room position in metres: sways, leans in (3 … 7 s), is inside (7 … 8.5 s), steps back."""
    z = np.interp(time, [0, 3, 6, 7, 7.5, 8, 8.5, 10, 12], [1.3, 1.1, 0.45, 0.3, 0.0, 0.0, 0.3, 0.9, 1.4])
    sway = 0.10 * np.sin(1.9 * time) + 0.02 * np.sin(7.1 * time)
    return np.array([sway, 1.6 + 0.05 * np.sin(1.1 * time + 1), z + 0.01 * np.sin(5.3 * time)])


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path(__file__).with_name("recorded_costs.json"))
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--repeats", type=int, default=7)
    options = parser.parse_args()
    volume, walls = placed(synthetic_ct(VOXELS)), four_walls(PIXELS)
    scenes = {}
    for name, (points, modes) in SCENES.items():
        transfer = psw.TransferFunction(points, 1 / (VOXELS - 1))
        renderer = psw.Renderer(volume, transfer, psw.Settings(threads=options.threads))
        scenes[name] = record(renderer, modes, walls, options)
        print(name, "done", flush=True)
    made = f"python benchmarks/record_costs.py --threads {options.threads} --repeats {options.repeats}"
    contents = {
        "made_by": made,
        "machine": describe_machine(),
        "seconds": SECONDS,
        "qualities": QUALITIES,
        "scenes": scenes,
    }
    options.output.write_text(
        json.dumps(contents, separators=(",", ":")).replace('"modes"', '\n"modes"') + "\n"
    )
    print(f"{options.output}: {options.output.stat().st_size / 1e3:.0f} kB")


def record(
    renderer: psw.Renderer, modes: dict[str, dict], walls: list[psw.Wall], options: argparse.Namespace
) -> dict:
    """One scene's costs along the path."""
    ways = [(mode, quality) for mode in modes for quality in QUALITIES]
    base = renderer.settings
    counted = {key: {mode: [] for mode in modes} for key in ("ms", "samples", "pixels")}
    features, planning, noise = [], [], []
    for pose in range(-1, POSES):  # the first warms up
        position = head(max(pose, 0) * SECONDS / POSES)
        eyes = [psw.Eye(position + (side * SEPARATION / 2, 0, 0)) for side in (-1, 1)]
        renderer.settings = base
        start = perf_counter()
        seen = renderer.features(eyes, walls)
        spent = 1e3 * (perf_counter() - start)
        rounds = np.array(
            [[costs_of(renderer, base, modes[mode], quality, eyes, walls) for mode, quality in ways]]
            + [
                [costs_of(renderer, base, modes[mode], quality, eyes, walls) for mode, quality in ways]
                for _ in range(options.repeats - 1 if pose >= 0 else 0)
            ]
        )
        if pose < 0:
            continue
        median = np.median(rounds, axis=0)
        noise.append((rounds[..., 0] / median[:, 0]).ravel())
        features.append([int(seen.samples), int(seen.pixels), seen.faces])
        planning.append(round(spent, 3))
        for number, key in enumerate(counted):
            for mode, row in zip(modes, median[:, number].reshape(len(modes), -1), strict=True):
                counted[key][mode].append([float(f"{value:.4g}") for value in row])
    draws = np.random.default_rng(0).choice(np.concatenate(noise), 1000)
    return {
        "changes": modes,
        "features": features,
        "planning_ms": planning,
        "noise": [round(float(value), 3) for value in draws],
        "modes": counted,
    }


def costs_of(renderer, base, changes, quality, eyes, walls) -> tuple[float, int, int]:
    """Milliseconds, samples and pixels of a frame of both eyes."""
    renderer.settings = replace(base, quality=quality, **changes)
    ms = samples = pixels = 0
    for eye in eyes:
        image = renderer.composite(eye, walls)
        ms += renderer.last["composite_ms"]
        samples += image.samples
        pixels += len(image.pixels)
    return ms, samples, pixels


if __name__ == "__main__":
    main()
