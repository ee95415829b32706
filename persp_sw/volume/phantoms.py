"""Made-up volumes: simple ones with known interpolants, and one that looks like a CT of a body.

`persp_sw.measure.exact` pairs the simple ones with transfer functions and their exact pictures.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ..arrays import VOXEL_DTYPES, Matrix, Vector
from ..errors import VolumeError
from .grid import Volume

# Value of "1" in `synthetic_ct`, and of "0": 8-bit, 12-bit, Hounsfield-like and normalised scanners.
_SCALES = {"uint8": (0, 255), "uint16": (0, 4095), "int16": (-1024, 3071), "float32": (0, 1)}


def constant(size: tuple[int, int, int], value: float, pose: Matrix | None = None) -> Volume:
    """A float32 volume of `size` (x, y, z) voxels that all have one value."""
    return Volume(np.full(size[::-1], value, np.float32), world_from_object=pose, name="constant")


def linear(
    size: tuple[int, int, int], at_origin: float, gradient: Vector, pose: Matrix | None = None
) -> Volume:
    """A float32 volume whose value is at_origin + gradient · (x, y, z), voxel index coordinates.

    Trilinear interpolation reproduces it: exactly where the numbers are whole multiples of a power of two,
    else to 1e-7 of the largest value.
    """
    z, y, x = np.indices(size[::-1], np.float64)
    data = at_origin + gradient[0] * x + gradient[1] * y + gradient[2] * z
    return Volume(data.astype(np.float32), world_from_object=pose, name="linear")


def paraboloid(size: tuple[int, int, int], radius: float, pose: Matrix | None = None) -> Volume:
    """A float32 volume: radius² − |p − centre|², p and radius in world units, centre that of the box.

    Positive inside the ball. Trilinear interpolation lowers the value, by at most a quarter of the sum of
    the squared spacings, and to 0 at the voxels.
    """
    z, y, x = np.indices(size[::-1], np.float64)
    matrix = np.eye(3) if pose is None else np.asarray(pose)[:3, :3]
    offset = np.stack([x, y, z], -1) - (np.array(size) - 1) / 2
    data = radius**2 - ((offset @ matrix.T) ** 2).sum(-1)
    return Volume(data.astype(np.float32), world_from_object=pose, name="ball")


def points(
    size: tuple[int, int, int], voxels: NDArray[np.integer], value: int = 255, pose: Matrix | None = None
) -> Volume:
    """A uint8 volume of zeros with single voxels (n, 3), xyz, at `value`."""
    data = np.zeros(size[::-1], np.uint8)
    x, y, z = np.asarray(voxels).T
    data[z, y, x] = value
    return Volume(data, world_from_object=pose, name="points")


def synthetic_ct(n: int, seed: int = 0, dtype: DTypeLike = np.uint8) -> Volume:
    """A body as a CT scanner might see it: skin and flesh, a shell of bone, organs, a tree of bright tubes.

    Parameters
    ----------
    n
        Voxels a side, ≥ 2. The same body is sampled at every n; edges are about 3 % of the volume wide, as a
        scanner of fixed resolution would show them.
    seed
        Chooses organs and tubes. Equal n, seed and dtype give equal voxels.
    dtype
        uint8 (0 … 255), uint16 (0 … 4095), int16 (-1024 … 3071) or float32 (0 … 1). On the scale 0 … 1: air
        0, flesh about 0.25, organs 0.3 … 0.4, bone 0.7, tubes 0.9.

    Raises
    ------
    VolumeError
        Another dtype, or n < 2.
    """
    dtype = np.dtype(dtype)
    if dtype not in VOXEL_DTYPES:
        raise VolumeError(f"dtype is one of {', '.join(_SCALES)}; given {dtype}")
    if n < 2:
        raise VolumeError(f"a synthetic CT has at least 2 voxels a side; given {n}")
    zero, one = _SCALES[dtype.name]
    rng = np.random.default_rng(seed)
    organs = rng.uniform(-0.35, 0.35, (6, 3)), rng.uniform(0.08, 0.2, (6, 3)), rng.uniform(0.3, 0.4, 6)
    waves, phases = rng.uniform(2, 7, (4, 3)), rng.uniform(0, 6, 4)
    tubes = [_tube(rng) for _ in range(7)]

    axis = ((np.arange(n) + 0.5) / n * 2 - 1).astype(np.float32)
    x, y = axis[None, :], axis[:, None]
    data = np.empty((n, n, n), dtype)
    for k, z in enumerate(axis):
        value = _body_slice(x, y, z, organs, waves, phases)
        for tube in tubes:
            _draw_tube(value, axis, z, tube)
        scaled = zero + (one - zero) * np.clip(value, 0, 1)
        data[k] = scaled if dtype.kind == "f" else np.rint(scaled)
    return Volume(data, name=f"synthetic-ct-{n}")


def _inside(excess, width=0.03):
    """1 where `excess` is well below 0, 0 well above, a smooth step of the given width between."""
    t = np.clip(0.5 - excess / width, 0, 1)
    return t * t * (3 - 2 * t)


def _ellipsoid(x, y, z, centre, radii):
    """Roughly the distance outside an ellipsoid, in units of half the volume's edge."""
    q = (
        ((x - centre[0]) / radii[0]) ** 2
        + ((y - centre[1]) / radii[1]) ** 2
        + ((z - centre[2]) / radii[2]) ** 2
    )
    return (np.sqrt(q) - 1) * min(radii)


def _body_slice(x, y, z, organs, waves, phases):
    skin = _ellipsoid(x, y, z, (0, 0, 0), (0.8, 0.66, 0.92))
    grain = sum(
        np.sin(a * x + p) * np.sin(b * y - p) * np.sin(c * z + 2 * p)
        for (a, b, c), p in zip(waves, phases, strict=True)
    )
    value = (0.25 + 0.015 * grain) * _inside(skin)
    for centre, radii, level in zip(*organs, strict=True):
        value += (level - value) * _inside(_ellipsoid(x, y, z, centre, radii))
    # A shell of bone with a window cut through it, so that one can look in.
    shell = np.abs(skin + 0.13) - 0.025
    window = _ellipsoid(x, y, z, (0.25, 0.1, 0.8), (0.35, 0.3, 0.45))
    value += (0.7 - value) * _inside(np.maximum(shell, -window))
    return np.asarray(value, np.float32)


def _tube(rng):
    """Points (m, 3) and radii (m,) along a smooth thinning curve."""
    t = np.linspace(0, 1, 120)[:, None]
    start, end = rng.uniform(-0.45, 0.45, 3), rng.uniform(-0.45, 0.45, 3)
    bend, turns, phase = rng.uniform(-0.18, 0.18, (2, 3)), rng.uniform(3, 9, 2), rng.uniform(0, 6, 2)
    path = start + (end - start) * t
    path = path + bend[0] * np.sin(turns[0] * t + phase[0]) + bend[1] * np.sin(turns[1] * t + phase[1])
    return path, (0.06 - 0.03 * t[:, 0]) * rng.uniform(0.7, 1.0)


def _draw_tube(value, axis, z, tube, width=0.02):
    """Lay the tube's cross-section with the plane z over one slice, as a union of balls."""
    path, radii = tube
    for (cx, cy, cz), radius in zip(path, radii, strict=True):
        reach = radius + width
        if abs(z - cz) >= reach:
            continue
        i = slice(*np.searchsorted(axis, (cx - reach, cx + reach)))
        j = slice(*np.searchsorted(axis, (cy - reach, cy + reach)))
        patch = value[j, i]
        distance = np.sqrt((axis[None, i] - cx) ** 2 + (axis[j, None] - cy) ** 2 + (z - cz) ** 2)
        np.maximum(patch, 0.9 * _inside(distance - radius, width), out=patch)
