"""Gradients on the fly or precomputed: their error in degrees on fields that are known, and bytes a voxel.

    python benchmarks/gradient_choice.py [--size N …] [--points N]

On the fly: central differences of the interpolated field, r voxels to each side. Precomputed: those of
r = 1 at voxels, quantised, then interpolated; without quantising that is the same as on the fly, for both are
linear in the voxels. Fields: a ball with a smooth ramp, Marschner and Lobb's, a product of sines, each stored
in 8 and 16 bits and float32. Errors are where the true gradient is above 2 % of the largest possible one.
"""

from __future__ import annotations

import argparse

import numpy as np
from rich.console import Console
from rich.table import Table

import persp_sw as psw
from persp_sw.reference import gradients
from persp_sw.volume.gradient import largest_magnitude

STEP = 1e-5  # of the unit cube's half: the true gradient, by differences of the formula


def ball(x, y, z):
    """1 inside, 0 outside, half at radius 0.6."""
    t = np.clip(0.5 - (np.sqrt(x * x + y * y + z * z) - 0.6) / 0.3, 0, 1)
    return t * t * (3 - 2 * t)


def marschner_lobb(x, y, z):
    """The test signal of Marschner and Lobb 1994, f = 6, α = 0.25."""
    rings = np.cos(2 * np.pi * 6 * np.cos(np.pi * np.hypot(x, y) / 2))
    return (1 - np.sin(np.pi * z / 2) + 0.25 * (1 + rings)) / 2.5


def sines(x, y, z):
    """Three waves, each 1.5 periods in the cube."""
    return 0.5 + 0.5 * np.sin(4.5 * x) * np.sin(4.5 * y + 1) * np.sin(4.5 * z + 2)


FIELDS = {"ball": ball, "Marschner-Lobb": marschner_lobb, "sines": sines}
SCALES = {"uint8": 255, "uint16": 65535, "float32": 1}


def octahedral(normals: np.ndarray, bits: int) -> np.ndarray:
    """Unit vectors after a trip through an octahedron's square, `bits` a coordinate."""
    flat = normals / np.abs(normals).sum(-1, keepdims=True)
    x, y, z = np.moveaxis(flat, -1, 0)
    u = np.where(z < 0, (1 - abs(y)) * np.where(x < 0, -1, 1), x)
    v = np.where(z < 0, (1 - abs(x)) * np.where(y < 0, -1, 1), y)
    most = 2 ** (bits - 1) - 1
    u, v = np.rint(u * most) / most, np.rint(v * most) / most
    z = 1 - abs(u) - abs(v)
    fold = np.maximum(-z, 0)
    found = np.stack([u - np.copysign(fold, u), v - np.copysign(fold, v), z], -1)
    return found / np.linalg.norm(found, axis=-1, keepdims=True)


def quantised(at_voxels: np.ndarray, kind: str, most: float) -> np.ndarray:
    """Gradients as a store would keep them; `most`: the longest possible."""
    if kind != "octahedral":
        steps = 2 ** (int(kind) - 1) - 1
        return np.rint(at_voxels / most * steps) / steps * most
    length = np.linalg.norm(at_voxels, axis=-1, keepdims=True)
    safe = np.where(length > 0, at_voxels / np.where(length > 0, length, 1), [0.0, 0.0, 1.0])
    return octahedral(safe, 8) * np.rint(length / most * 255) / 255 * most


METHODS = {
    "on the fly, r = 1": (1.0, None, 0), "on the fly, r = 1.25": (1.25, None, 0),
    "on the fly, r = 2": (2.0, None, 0), "precomputed, 3 × 8 bits": (1.0, "8", 3),
    "precomputed, octahedral 16 + 8": (1.0, "octahedral", 3), "precomputed, 3 × 16 bits": (1.0, "16", 6),
}  # fmt: skip


def interpolated(at_voxels: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(n, 3) of [z, y, x, 3] at voxel coordinates xyz."""
    low = np.floor(points).astype(int)
    part, total = points - low, 0.0
    for corner in np.ndindex(2, 2, 2):
        weight = np.prod(np.where(corner, part, 1 - part), -1)
        x, y, z = (low + corner).T
        total = total + weight[:, None] * at_voxels[z, y, x]
    return total


def main() -> None:
    """Measure, and print a table."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("--size", type=int, nargs="+", default=[32, 64])
    options.add_argument("--points", type=int, default=20000)
    given = options.parse_args()
    table = Table("field", "voxels", "type", "gradient", title="error of the gradient")
    for head in ("median °", "p95 °", "most °", "magnitude, median %", "bytes a voxel more"):
        table.add_column(head, justify="right")
    for name, field in FIELDS.items():
        for size in given.size:
            half = (size - 1) / 2
            z, y, x = np.indices((size,) * 3) / half - 1
            points = np.random.default_rng(7).uniform(4, size - 5, (given.points, 3))
            place, unit = points / half - 1, np.eye(3) * STEP
            true = np.stack([field(*(place + d).T) - field(*(place - d).T) for d in unit], -1) / (
                2 * STEP * half
            )
            for dtype, scale in SCALES.items():
                values = field(x, y, z) * scale
                volume = psw.Volume((np.rint(values) if scale > 1 else values).astype(dtype))
                most = largest_magnitude(volume)
                clear = np.linalg.norm(true * scale, axis=-1) > 0.02 * most
                at_voxels = np.stack(np.gradient(volume.data.astype(float))[::-1], -1)
                for method, (reach, kind, more) in METHODS.items():
                    found = (
                        gradients(volume, points[clear], reach)
                        if kind is None
                        else interpolated(quantised(at_voxels, kind, most), points[clear])
                    )
                    wanted = true[clear] * scale
                    a, b = np.linalg.norm(found, axis=-1), np.linalg.norm(wanted, axis=-1)
                    cosine = (found * wanted).sum(-1) / np.maximum(a * b, 1e-300)
                    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
                    errors = [*np.quantile(angle, [0.5, 0.95, 1]), 100 * np.median(abs(a - b) / b)]
                    table.add_row(name, str(size), dtype, method, *(f"{e:.2f}" for e in errors), str(more))
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
