"""Rays through a volume that a one-dimensional transfer function shows, without lights."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from .._jit import kernel, parallel_kernel, prange
from ..optics.transfer import MAX_OPACITY, TransferFunction
from ._cubic import crossing_of, extrema, piece_at, value_at
from ._rays import CHANGE, DEPTH, OPAQUE_DEPTH, cut_ray, first_plane, is_shown, reach_of

MAX_HALVINGS = 30  # a smooth piece is halved at most so often
ATTEMPTS = 3  # a pixel whose changes add up to more than the tolerance is cast again, 16 times finer

# Columns of the table of pieces: on one piece 1 − opacity and colour are linear in value − reference value.
VALUE, CLEAR, SLOPE, RGB, RGB_SLOPE, _COLUMNS = 0, 1, 2, 3, 6, 9

_MIN_CLEAR = 1 - MAX_OPACITY
_ROOT15 = np.sqrt(15.0)


def pieces_of(transfer: TransferFunction):
    """The table of a transfer function's pieces, on which opacity and colour are linear: three arrays.

    Returns
    -------
    breaks
        (n,) distinct ascending values. Piece i holds from breaks[i - 1] (included) to breaks[i].
    pieces
        (n + 1, 9): reference value; 1 − opacity there; its slope; colour there; its slope.
    visible_before
        (n + 2,): how many of the pieces 0 … i - 1 are not wholly transparent.
    """
    nodes = np.column_stack([transfer.values, transfer.colours, transfer.opacities])
    rows = [(-np.inf, nodes[0], nodes[0])]  # (from value, node at the piece's start, node at its end)
    for start, end in pairwise(nodes):
        if start[0] == end[0]:
            continue  # a step: its two pieces meet at one break
        rows.append((start[0], start, end))
        if min(start[4], end[4]) < MAX_OPACITY < max(start[4], end[4]):
            # Opacity is held at MAX_OPACITY, which bends it where it crosses that.
            bend = start + (end - start) * ((MAX_OPACITY - start[4]) / (end[4] - start[4]))
            if start[0] < bend[0] < end[0]:
                rows[-1:] = [(start[0], start, bend), (bend[0], bend, end)]
    rows.append((nodes[-1, 0], nodes[-1], nodes[-1]))

    pieces = np.zeros((len(rows), _COLUMNS))
    for piece, (_, start, end) in zip(pieces, rows, strict=True):
        width = end[0] - start[0]
        clear = 1 - np.minimum([start[4], end[4]], MAX_OPACITY)
        piece[VALUE], piece[CLEAR], piece[RGB : RGB + 3] = start[0], clear[0], start[1:4]
        if width > 0:
            piece[SLOPE] = (clear[1] - clear[0]) / width
            piece[RGB_SLOPE : RGB_SLOPE + 3] = (end[1:4] - start[1:4]) / width
    breaks = np.array([row[0] for row in rows[1:]])
    visible = (pieces[:, CLEAR] < 1) | (pieces[:, SLOPE] != 0)
    return breaks, pieces, np.append(0, np.cumsum(visible))


@parallel_kernel
def cast_band(data, rays, shown, table, unit, tolerance, states):
    for pixel in prange(len(states)):
        eye, direction, state = rays.starts[pixel], rays.directions[pixel], states[pixel]
        ends = np.empty(len(shown.planes) + 2)
        count = cut_ray(eye, direction, rays.near, shown.planes, shown.kinds, ends)
        piece_tolerance = tolerance / 32
        for _ in range(ATTEMPTS):
            state[:] = 0.0
            for n in range(count - 1):
                middle = 0.5 * (ends[n] + ends[n + 1])
                if ends[n] < ends[n + 1] and is_shown(
                    eye, direction, middle, shown.planes, shown.kinds, shown.crop_flags
                ):
                    _cast_ray(data, eye, direction, ends[n], ends[n + 1], table, unit, piece_tolerance, state)
            if state[CHANGE] <= tolerance:
                break
            piece_tolerance /= 16


@kernel
def _cast_ray(data, eye, direction, entry, leave, table, unit, tolerance, state):
    """Front to back through the cells between two distances; adds to `state`."""
    nz, ny, nx = data.shape
    ex, ey, ez = eye[0], eye[1], eye[2]
    dx, dy, dz = direction[0], direction[1], direction[2]
    i, plane_i = first_plane(ex + entry * dx, dx, nx)
    j, plane_j = first_plane(ey + entry * dy, dy, ny)
    k, plane_k = first_plane(ez + entry * dz, dz, nz)
    forth_i, forth_j, forth_k = 1 if dx > 0 else -1, 1 if dy > 0 else -1, 1 if dz > 0 else -1
    # Each crossing is computed afresh from its plane, so that nothing adds up along the ray.
    reach_i, reach_j, reach_k = (
        reach_of(plane_i, ex, dx),
        reach_of(plane_j, ey, dy),
        reach_of(plane_k, ez, dz),
    )
    here = entry
    while here < leave and state[DEPTH] < OPAQUE_DEPTH:
        there = min(min(reach_i, reach_j), min(reach_k, leave))
        if there > here:
            # The axes' steps may have left the grid by a rounding; the interpolant goes on smoothly.
            ci, cj, ck = min(max(i, 0), nx - 2), min(max(j, 0), ny - 2), min(max(k, 0), nz - 2)
            start = (ex + here * dx - ci, ey + here * dy - cj, ez + here * dz - ck)
            length = there - here
            way = (length * dx, length * dy, length * dz)
            _cast_cell(data, (ci, cj, ck), start, way, table, length / unit, tolerance, state)
            here = there
        if reach_i <= there:
            i += forth_i
            plane_i += forth_i
            reach_i = reach_of(plane_i, ex, dx)
        if reach_j <= there:
            j += forth_j
            plane_j += forth_j
            reach_j = reach_of(plane_j, ey, dy)
        if reach_k <= there:
            k += forth_k
            plane_k += forth_k
            reach_k = reach_of(plane_k, ez, dz)


@kernel
def _cast_cell(data, cell, start, way, table, length, tolerance, state):
    """The part of a ray inside one cell: from `start`, in the cell's own coordinates, on by `way`.

    `length` is the part's length in opacity units.
    """
    breaks, pieces, visible_before = table
    i, j, k = cell
    x, y, z = start
    dx, dy, dz = way
    v000, v100 = np.float64(data[k, j, i]), np.float64(data[k, j, i + 1])
    v010, v110 = np.float64(data[k, j + 1, i]), np.float64(data[k, j + 1, i + 1])
    v001, v101 = np.float64(data[k + 1, j, i]), np.float64(data[k + 1, j, i + 1])
    v011, v111 = np.float64(data[k + 1, j + 1, i]), np.float64(data[k + 1, j + 1, i + 1])
    total = v000 + v100 + v010 + v110 + v001 + v101 + v011 + v111
    if total != total:
        return  # a NaN corner
    lowest = min(min(min(v000, v100), min(v010, v110)), min(min(v001, v101), min(v011, v111)))
    highest = max(max(max(v000, v100), max(v010, v110)), max(max(v001, v101), max(v011, v111)))
    first, last = piece_at(breaks, lowest), piece_at(breaks, highest)
    if visible_before[first] == visible_before[last + 1]:
        return  # no value in the cell is visible

    # The trilinear interpolant as a sum of products of x, y and z; the differences of equal corners are 0
    # exactly, so that a constant cell stays constant and a value on a step stays on its side.
    ax, ay, az = v100 - v000, v010 - v000, v001 - v000
    bxy, bxz, byz = (v110 - v100) - ay, (v101 - v100) - az, (v011 - v010) - az
    g = (v111 - v101) - (v110 - v100) - byz
    # On the ray, a cubic in s = 0 … 1.
    k0 = v000 + x * (ax + y * (bxy + z * g) + z * bxz) + y * (ay + z * byz) + z * az
    k1 = (
        dx * (ax + y * bxy + z * (bxz + y * g))
        + dy * (ay + x * bxy + z * (byz + x * g))
        + dz * (az + x * bxz + y * (byz + x * g))
    )
    k2 = dx * dy * (bxy + z * g) + dx * dz * (bxz + y * g) + dy * dz * (byz + x * g)
    cubic = (k0, k1, k2, dx * dy * dz * g)

    if first == last:
        _integrate(cubic, 0.0, 1.0, pieces[first], length, tolerance, state)
        return
    # Between its extrema the cubic is monotonic and crosses the breaks one after the other.
    turn, other_turn = extrema(cubic)
    here = 0.0
    for part in range(3):
        there = turn if part == 0 else other_turn if part == 1 else 1.0
        if there > here:
            _cast_monotonic(cubic, here, there, breaks, pieces, length, tolerance, state)
            here = there


@kernel
def _cast_monotonic(cubic, start, end, breaks, pieces, length, tolerance, state):
    """Cut a monotonic part where the value crosses the breaks, and integrate between."""
    from_value, to_value = value_at(cubic, start), value_at(cubic, end)
    piece, last = piece_at(breaks, from_value), piece_at(breaks, to_value)
    here = start
    while piece != last:
        crossed = piece if piece < last else piece - 1
        there = crossing_of(cubic, here, end, breaks[crossed], to_value > from_value)
        _integrate(cubic, here, there, pieces[piece], length, tolerance, state)
        piece += 1 if piece < last else -1
        here = there
    _integrate(cubic, here, end, pieces[piece], length, tolerance, state)


@kernel
def _integrate(cubic, start, end, piece, length, tolerance, state):
    """Add the light of one smooth piece, halving until one halving more changes the pixel by ≤ tolerance."""
    if not end > start or (piece[SLOPE] == 0 and piece[CLEAR] == 1):
        return
    colour_varies = piece[RGB_SLOPE] != 0 or piece[RGB_SLOPE + 1] != 0 or piece[RGB_SLOPE + 2] != 0
    # Panel number `index` of 2^level; after the second half of a panel its whole is done.
    level, index, width = 0, 0, end - start
    while not (level == 0 and index == 1):
        here, half = start + index * width, 0.5 * width
        depth, moment = _panel(cubic, here, width, piece, length, colour_varies)
        depth_1, moment_1 = _panel(cubic, here, half, piece, length, colour_varies)
        depth_2, moment_2 = _panel(cubic, here + half, half, piece, length, colour_varies)
        depth_12 = depth_1 + depth_2
        moment_12 = moment_1 + np.exp(-depth_1) * moment_2
        opacity = -np.expm1(-depth_12)
        opacity_change = opacity + np.expm1(-depth)
        change = abs(opacity_change)
        for c in range(3):
            colour_change = piece[RGB + c] * opacity_change + piece[RGB_SLOPE + c] * (moment_12 - moment)
            change = max(change, abs(colour_change))
        transmittance = np.exp(-state[DEPTH])
        if change * transmittance > tolerance and level < MAX_HALVINGS:
            level += 1
            index *= 2
            width = half
            continue
        for c in range(3):
            state[c] += transmittance * (piece[RGB + c] * opacity + piece[RGB_SLOPE + c] * moment_12)
        state[DEPTH] += depth_12
        state[CHANGE] += change * transmittance
        if state[DEPTH] > OPAQUE_DEPTH:
            return
        index += 1
        while level > 0 and index % 2 == 0:
            level -= 1
            index //= 2
            width *= 2


@kernel
def _panel(cubic, start, width, piece, length, colour_varies):
    """One panel by the three-stage Gauss rule.

    Returns its optical depth D and ∫ (value − reference value) dα over it, α = 1 − exp(−depth so far). The
    colour is linear in the value, so these two give it: colour · (1 − exp(−D)) + slope · integral.
    """
    inward = _ROOT15 / 10
    v1 = value_at(cubic, start + (0.5 - inward) * width) - piece[VALUE]
    v2 = value_at(cubic, start + 0.5 * width) - piece[VALUE]
    v3 = value_at(cubic, start + (0.5 + inward) * width) - piece[VALUE]
    t1 = extinction_of(piece, v1) * (length * width)
    t2 = extinction_of(piece, v2) * (length * width)
    t3 = extinction_of(piece, v3) * (length * width)
    depth = (5 * t1 + 8 * t2 + 5 * t3) / 18
    if not colour_varies or not depth > 0:
        return depth, 0.0
    # Depths up to the three nodes.
    d1 = t1 * (5 / 36) + t2 * (2 / 9 - _ROOT15 / 15) + t3 * (5 / 36 - _ROOT15 / 30)
    d2 = t1 * (5 / 36 + _ROOT15 / 24) + t2 * (2 / 9) + t3 * (5 / 36 - _ROOT15 / 24)
    d3 = t1 * (5 / 36 + _ROOT15 / 30) + t2 * (2 / 9 + _ROOT15 / 15) + t3 * (5 / 36)
    # About the mean value, so that a constant value is exact at any depth.
    mean = (5 * t1 * v1 + 8 * t2 * v2 + 5 * t3 * v3) / (18 * depth)
    e1, e2, e3 = 5 * t1 * np.exp(-d1), 8 * t2 * np.exp(-d2), 5 * t3 * np.exp(-d3)
    spread = (e1 * (v1 - mean) + e2 * (v2 - mean) + e3 * (v3 - mean)) / 18
    return depth, spread - mean * np.expm1(-depth)


@kernel
def extinction_of(piece, value):
    """Per opacity unit, at a value relative to the piece's reference."""
    clear = piece[CLEAR] + piece[SLOPE] * value
    return -np.log(min(max(clear, _MIN_CLEAR), 1.0))
