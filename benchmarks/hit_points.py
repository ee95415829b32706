"""Where in its piece a ray hits a surface: errors of the place and of the normal there, by method.

    python benchmarks/hit_points.py [VOLUME THRESHOLD] [--rays N]

Rays cross slices of a volume (a made-up CT unless one is given) at all angles their principal axis allows.
Each piece of one slice interval in which the scalar, linear along the ray as pre-integration takes it, passes
the threshold has one hit on that line; the truth is where the interpolated field itself passes the threshold
in this piece. Errors are those of the piece's middle, of the line's hit, which is what persp_sw lights, and
of n bisections of the piece in the field. "look-ups" counts values of the field beside those that
compositing takes anyway.
"""

from __future__ import annotations

import argparse

import numpy as np
from rich.console import Console
from rich.table import Table

import persp_sw as psw
from persp_sw.reference import gradients
from persp_sw.volume.phantoms import synthetic_ct

BISECTIONS = (1, 2, 3, 4, 6, 8)


def interpolated(data: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(n,) values of [z, y, x] at voxel coordinates xyz."""
    low = np.minimum(np.floor(points).astype(int), np.array(data.shape[::-1]) - 2)
    part, total = points - low, 0.0
    for corner in np.ndindex(2, 2, 2):
        x, y, z = (low + corner).T
        total = total + np.prod(np.where(corner, part, 1 - part), -1) * data[z, y, x]
    return total


def bisected(data, begins, rays, threshold, rising, steps):
    """(n,) parts 0 … 1 of pieces begins + part·rays: the middle of what `steps` bisections leave."""
    low, high = np.zeros(len(rays)), np.ones(len(rays))
    for _ in range(steps):
        middle = (low + high) / 2
        beyond = (interpolated(data, begins + middle[:, None] * rays) > threshold) == rising
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return (low + high) / 2


def pieces_of(data: np.ndarray, threshold: float, count: int, rng) -> tuple[np.ndarray, ...]:
    """Pieces in which line and field pass the threshold: begins, rays, the line's part, rising."""
    size = np.array(data.shape[::-1])
    begins = rng.uniform(2, size - 3, (count, 3))
    axis = rng.integers(0, 3, count)
    rays = rng.uniform(-1, 1, (count, 3))
    rays[np.arange(count), axis] = rng.choice([-1.0, 1.0], count)
    begins[np.arange(count), axis] = np.rint(begins[np.arange(count), axis])
    middle, cell = begins + rays / 2, np.floor(begins + rays / 2)
    value, ahead = interpolated(data, middle), 1e-4
    inside = [np.clip(middle + s * ahead * rays, cell, cell + 1) for s in (-1, 1)]
    slope = (interpolated(data, inside[1]) - interpolated(data, inside[0])) / (2 * ahead)
    ends = [interpolated(data, begins), interpolated(data, begins + rays)]
    with np.errstate(divide="ignore", invalid="ignore"):
        part = 0.5 + (threshold - value) / slope
    rising = slope > 0
    passes = (part > 0) & (part < 1) & ((ends[0] < threshold) == rising) & ((ends[1] > threshold) == rising)
    return begins[passes], rays[passes], part[passes], rising[passes]


def main() -> None:
    """Measure, and print a table."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("volume", nargs="?", help="a volume file (default: a made-up CT of 128³ voxels)")
    options.add_argument("threshold", nargs="?", type=float, default=150.0)
    options.add_argument("--rays", type=int, default=2_000_000, metavar="N", help="pieces to try")
    given = options.parse_args()
    volume = psw.load(given.volume) if given.volume else synthetic_ct(128)
    data = volume.data.astype(float)
    rng = np.random.default_rng(5)
    begins, rays, line, rising = pieces_of(data, given.threshold, given.rays, rng)
    if not len(rays):
        raise SystemExit(f"no ray passes {given.threshold:g}: values are {data.min():g} … {data.max():g}")
    true = bisected(data, begins, rays, given.threshold, rising, 40)
    lengths = np.linalg.norm(rays, axis=-1)

    def normals(part):
        found = gradients(volume, begins + part[:, None] * rays, 1.0)
        return found / np.maximum(np.linalg.norm(found, axis=-1, keepdims=True), 1e-300)

    wanted = normals(true)
    methods = {"middle of the piece": (np.full(len(rays), 0.5), 0), "on the line": (line, 0)}
    for steps in BISECTIONS:
        part = bisected(data, begins, rays, given.threshold, rising, steps)
        methods[f"{steps} bisections"] = part, steps
    table = Table("hit", title=f"{len(rays)} hits at {given.threshold:g}")
    for head in ("place, rms voxels", "p95", "normal, rms °", "p95 °", "look-ups"):
        table.add_column(head, justify="right")
    for name, (part, look_ups) in methods.items():
        off = abs(part - true) * lengths
        angle = np.degrees(np.arccos(np.clip((normals(part) * wanted).sum(-1), -1, 1)))
        errors = [e for q in (off, angle) for e in (np.sqrt(np.mean(q * q)), np.quantile(q, 0.95))]
        table.add_row(name, *(f"{e:.3f}" for e in errors), str(look_ups))
    Console(width=110).print(table)


if __name__ == "__main__":
    main()
