"""Stretches: parts of a ray on which the value and its differences are smooth, and what they are there."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._jit import kernel
from ..volume.gradient import world_from_differences
from ..volume.grid import Volume
from ._cubic import crossing_of, extrema, piece_at, value_at


class Field(NamedTuple):
    """The volume as a ray meets it.

    Attributes
    ----------
    data
        float32 [z, y, x].
    world_from_differences
        (3, 3), see `volume.gradient`.
    reach
        Voxels to the two neighbours whose difference is the gradient.
    offsets
        (m,): on each axis value and gradient are smooth between the planes at whole numbers + these.
    """

    data: NDArray[np.float32]
    world_from_differences: NDArray[np.float64]
    reach: float
    offsets: NDArray[np.float64]


def field_of(volume: Volume, data: NDArray[np.float32], reach: float) -> Field:
    """Of a volume, its voxels as float32, and the gradient's reach."""
    part = reach % 1.0
    return Field(data, world_from_differences(volume), reach, np.unique([0.0, part, (1 - part) % 1.0]))


class Stretch(NamedTuple):
    """Room for one stretch, u = 0 … 1, and for the walk along the ray; made anew for every ray.

    Attributes
    ----------
    cubics
        (4, 4): coefficients, ascending, of the value and of the differences along x, y and z.
    gaps
        (3, 2): the voxels between the two places of each difference at u = 0, and how many more at 1.
    planes
        (3 · offsets,): the next plane of each kind.
    cuts
        (n, 2): where pieces of the transfer function begin, and their numbers.
    """

    cubics: NDArray[np.float64]
    gaps: NDArray[np.float64]
    planes: NDArray[np.float64]
    cuts: NDArray[np.float64]


@kernel
def room_for(field, breaks):
    """An empty `Stretch`."""
    planes = np.empty(3 * len(field.offsets))
    return Stretch(np.empty((4, 4)), np.empty((3, 2)), planes, np.empty((3 * len(breaks) + 4, 2)))


@kernel
def set_out(field, eye, direction, entry, planes):
    """Fill `planes` with those that the ray meets next."""
    kinds = len(field.offsets)
    for axis in range(3):
        for n in range(kinds):
            place = eye[axis] + entry * direction[axis] - field.offsets[n]
            index = np.floor(place) + 1 if direction[axis] > 0 else np.ceil(place) - 1
            planes[axis * kinds + n] = index + field.offsets[n]


@kernel
def next_cut(eye, direction, here, leave, planes):
    """Distance at which the stretch that begins at `here` ends; passes the planes before it."""
    kinds = len(planes) // 3
    there = leave
    for n in range(len(planes)):
        step = direction[n // kinds]
        if step != 0:
            # Computed afresh from the plane, so that nothing adds up along the ray.
            reach = (planes[n] - eye[n // kinds]) / step
            while reach <= here:
                planes[n] += 1 if step > 0 else -1
                reach = (planes[n] - eye[n // kinds]) / step
            there = min(there, reach)
    return there


@kernel
def _fill_cubic(data, low, high, start, way, cubic):
    """The trilinear interpolant between the voxels `low` and `high` along start + u·way; NaN if one is NaN.

    Where an axis' low and high are one voxel, the face there.
    """
    i, j, k = low
    i1, j1, k1 = high
    x, y, z = start[0] - i, start[1] - j, start[2] - k
    dx, dy, dz = way
    v000, v100 = np.float64(data[k, j, i]), np.float64(data[k, j, i1])
    v010, v110 = np.float64(data[k, j1, i]), np.float64(data[k, j1, i1])
    v001, v101 = np.float64(data[k1, j, i]), np.float64(data[k1, j, i1])
    v011, v111 = np.float64(data[k1, j1, i]), np.float64(data[k1, j1, i1])
    ax, ay, az = v100 - v000, v010 - v000, v001 - v000
    bxy, bxz, byz = (v110 - v100) - ay, (v101 - v100) - az, (v011 - v010) - az
    g = (v111 - v101) - (v110 - v100) - byz
    cubic[0] = v000 + x * (ax + y * (bxy + z * g) + z * bxz) + y * (ay + z * byz) + z * az
    cubic[1] = (
        dx * (ax + y * bxy + z * (bxz + y * g))
        + dy * (ay + x * bxy + z * (byz + x * g))
        + dz * (az + x * bxz + y * (byz + x * g))
    )
    cubic[2] = dx * dy * (bxy + z * g) + dx * dz * (bxz + y * g) + dy * dz * (byz + x * g)
    cubic[3] = dx * dy * dz * g
    lowest = min(min(min(v000, v100), min(v010, v110)), min(min(v001, v101), min(v011, v111)))
    highest = max(max(max(v000, v100), max(v010, v110)), max(max(v001, v101), max(v011, v111)))
    total = v000 + v100 + v010 + v110 + v001 + v101 + v011 + v111
    return (lowest, highest) if total == total else (np.nan, np.nan)


@kernel
def _cell(place, count):
    return min(max(int(np.floor(place)), 0), count - 2)


@kernel
def lay_value(field, eye, direction, here, there, stretch):
    """Fill the value's cubic; returns the lowest and the highest value of the cell, NaN if one is NaN."""
    nz, ny, nx = field.data.shape
    length, middle = there - here, 0.5 * (here + there)
    i = _cell(eye[0] + middle * direction[0], nx)
    j = _cell(eye[1] + middle * direction[1], ny)
    k = _cell(eye[2] + middle * direction[2], nz)
    start = (eye[0] + here * direction[0], eye[1] + here * direction[1], eye[2] + here * direction[2])
    way = (length * direction[0], length * direction[1], length * direction[2])
    return _fill_cubic(field.data, (i, j, k), (i + 1, j + 1, k + 1), start, way, stretch.cubics[0])


@kernel
def lay_gradient(field, eye, direction, here, there, stretch):
    """Fill the differences' cubics and gaps; zero where a NaN takes part in one of them."""
    nz, ny, nx = field.data.shape
    counts = (nx, ny, nz)
    length, middle = there - here, 0.5 * (here + there)
    scratch = np.empty(4)
    whole = True
    for axis in range(3):
        stretch.cubics[1 + axis] = 0.0
        stretch.gaps[axis] = 0.0
        for side in (-1, 1):
            shift = (
                side * field.reach if axis == 0 else 0.0,
                side * field.reach if axis == 1 else 0.0,
                side * field.reach if axis == 2 else 0.0,
            )
            x = eye[0] + middle * direction[0] + shift[0]
            y = eye[1] + middle * direction[1] + shift[1]
            z = eye[2] + middle * direction[2] + shift[2]
            i, j, k = _cell(x, nx), _cell(y, ny), _cell(z, nz)
            i1, j1, k1 = i + 1, j + 1, k + 1
            beyond = (x, y, z)[axis]
            last = counts[axis] - 1
            start = (
                eye[0] + here * direction[0] + shift[0],
                eye[1] + here * direction[1] + shift[1],
                eye[2] + here * direction[2] + shift[2],
            )
            way = (length * direction[0], length * direction[1], length * direction[2])
            if beyond < 0 or beyond > last:
                face = 0 if beyond < 0 else last  # clamped: the values of the box's face
                if axis == 0:
                    i, i1 = face, face
                elif axis == 1:
                    j, j1 = face, face
                else:
                    k, k1 = face, face
                stretch.gaps[axis, 0] += side * float(face)
            else:
                stretch.gaps[axis, 0] += side * start[axis]
                stretch.gaps[axis, 1] += side * way[axis]
            lowest, _ = _fill_cubic(field.data, (i, j, k), (i1, j1, k1), start, way, scratch)
            whole = whole and lowest == lowest
            for n in range(4):
                stretch.cubics[1 + axis, n] += side * scratch[n]
    if not whole:
        stretch.cubics[1:] = 0.0


@kernel
def value_on(stretch, u):
    """The value at u."""
    c = stretch.cubics
    return ((c[0, 3] * u + c[0, 2]) * u + c[0, 1]) * u + c[0, 0]


@kernel
def gradient_on(field, stretch, u):
    """The gradient at u, in values per world unit."""
    c, gaps, w = stretch.cubics, stretch.gaps, field.world_from_differences
    x = (((c[1, 3] * u + c[1, 2]) * u + c[1, 1]) * u + c[1, 0]) / (gaps[0, 0] + gaps[0, 1] * u)
    y = (((c[2, 3] * u + c[2, 2]) * u + c[2, 1]) * u + c[2, 0]) / (gaps[1, 0] + gaps[1, 1] * u)
    z = (((c[3, 3] * u + c[3, 2]) * u + c[3, 1]) * u + c[3, 0]) / (gaps[2, 0] + gaps[2, 1] * u)
    return (
        w[0, 0] * x + w[0, 1] * y + w[0, 2] * z,
        w[1, 0] * x + w[1, 1] * y + w[1, 2] * z,
        w[2, 0] * x + w[2, 1] * y + w[2, 2] * z,
    )


@kernel
def cut_at_breaks(stretch, breaks):
    """Fill `cuts` with the pieces of the transfer function that the stretch passes; how many."""
    c, cuts = stretch.cubics, stretch.cuts
    cubic = (c[0, 0], c[0, 1], c[0, 2], c[0, 3])
    turn, other_turn = extrema(cubic)
    count, here = 0, 0.0
    for part in range(3):
        there = turn if part == 0 else other_turn if part == 1 else 1.0
        if not there > here:
            continue
        from_value, to_value = value_at(cubic, here), value_at(cubic, there)
        piece, last = piece_at(breaks, from_value), piece_at(breaks, to_value)
        while piece != last:
            crossed = piece if piece < last else piece - 1
            crossing = crossing_of(cubic, here, there, breaks[crossed], to_value > from_value)
            if crossing > here:
                cuts[count, 0], cuts[count, 1] = here, piece
                count += 1
                here = crossing
            piece += 1 if piece < last else -1
        if there > here:
            cuts[count, 0], cuts[count, 1] = here, piece
            count += 1
            here = there
    cuts[count, 0] = 1.0
    return count
