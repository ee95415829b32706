"""Packets: 16 neighbouring pixels on one sample plane, sampled, classified and blended.

All that is worth writing for one kind of processor is here; the loops over lanes become vectors. Their length
`n` is always 16, but must not be known to the compiler: a known 16 is unrolled before it can be vectorised
(blending: 22 instead of 12 ns a packet). Integers stay out of the vector loops, for numba widens them to 64
bits and the vectors get half as long.
"""

import numpy as np

from .._jit import kernel, power_of_two
from .scanline import AT_00, AT_01, AT_10, AT_11, BEGIN, END, PLANE, TILE

CHUNK = 32  # voxel rows are interpolated so many at a time, beyond their ends

# Sections of 16 in `lanes`, the state of a packet's pixels.
_SECTIONS = 15
RED, GREEN, BLUE, ALPHA, RAY_NEAR, RAY_FAR, LENGTH, ENOUGH = (np.uint64(TILE * n) for n in range(8))
_SAMPLE_R, _SAMPLE_G, _SAMPLE_B, _SAMPLE_TAU, _LEFT, _RIGHT, _WEIGHT = (
    np.uint64(TILE * n) for n in range(8, _SECTIONS)
)
LANES = TILE * _SECTIONS

_F = np.float32
_ONE = np.uint64(1)
_NAN = _F(np.nan)
_ROUNDER = _F(12582912.0)  # 1.5·2^23: adding it leaves the nearest integer in the low bits
_MINUS_LOG2E = _F(-1.4426950408889634)
# 2^f − 1 = f·(c1 + f·(c2 + …)), |f| ≤ ½, the Taylor series of exp(f·ln 2); remainder below 6e-9.
_C1, _C2, _C3, _C4 = (
    _F(0.6931471805599453),
    _F(0.2402265069591007),
    _F(0.0555041086648216),
    _F(0.009618129107628),
)
_C5, _C6, _C7 = _F(0.0013333558146428), _F(0.000154035303933816), _F(1.5252733804059841e-05)


@kernel
def fill_line(r, count, runs, weight_j, weight_k, voxels, first, last, line):
    """Interpolate voxels first … last at (j + weight_j, k + weight_k) to `line`; NaN where not visible.

    r: the plane's first run that may matter; `count`: number of runs. Returns False if none of its runs
    reaches the voxels; `line` is then undefined.
    """
    plane = runs[r, PLANE]
    filled = first
    while r < count and runs[r, PLANE] == plane and runs[r, BEGIN] <= last:
        begin = max(runs[r, BEGIN], first)
        end = min(runs[r, END], last)
        if begin <= end:
            for i in range(filled - first, begin - first):
                line[np.uint64(i)] = _NAN
            skipped = begin - runs[r, BEGIN]
            p00, p10 = runs[r, AT_00] + skipped, runs[r, AT_10] + skipped
            to = begin - first
            # Whole vectors: what is read beyond the run is overwritten below or not used.
            length = (end - begin + CHUNK) // CHUNK * CHUNK
            if weight_k == _F(0.0):
                for i in range(length):
                    a, b = _F(voxels[np.uint64(p00 + i)]), _F(voxels[np.uint64(p10 + i)])
                    line[np.uint64(to + i)] = a + weight_j * (b - a)
            else:
                p01, p11 = runs[r, AT_01] + skipped, runs[r, AT_11] + skipped
                for i in range(length):
                    a, b = _F(voxels[np.uint64(p00 + i)]), _F(voxels[np.uint64(p10 + i)])
                    near = a + weight_j * (b - a)
                    a, b = _F(voxels[np.uint64(p01 + i)]), _F(voxels[np.uint64(p11 + i)])
                    far = a + weight_j * (b - a)
                    line[np.uint64(to + i)] = near + weight_k * (far - near)
            filled = end + 1
        r += 1
    for i in range(filled - first, last + 1 - first):
        line[np.uint64(i)] = _NAN
    return filled > first


@kernel
def sample(n, line, x_0, step, x_low, x_high, last_cell, cells, lanes):
    """Voxels on both sides of x_0 + l·step along the line, clamped to [x_low, x_high], and the weight."""
    for l in range(np.uint64(n)):  # noqa: E741
        x = x_0 + _F(l) * step
        x = x if x > x_low else x_low
        x = x if x < x_high else x_high
        cell = np.floor(x)
        cell = cell if cell < last_cell else last_cell
        cells[l] = np.int32(cell)
        lanes[_WEIGHT + l] = x - cell
    for l in range(np.uint64(n)):  # noqa: E741
        cell = np.uint64(np.uint32(cells[l]))
        lanes[_LEFT + l] = line[cell]
        lanes[_RIGHT + l] = line[cell + _ONE]


@kernel
def classify(n, table, origin, scale, cells, lanes):
    """Colour and extinction of the lanes' values; returns whether any has extinction."""
    last = _F(table.shape[0] - 1)
    for l in range(np.uint64(n)):  # noqa: E741
        left = lanes[_LEFT + l]
        value = left + lanes[_WEIGHT + l] * (lanes[_RIGHT + l] - left)
        entry = (value - origin) * scale + _F(1.5)
        entry = entry if entry > _F(1.0) else _F(1.0)
        entry = entry if entry < last else last
        entry = entry if value == value else _F(0.0)  # NaN: nothing
        cells[l] = np.int32(entry)
    opaque = False
    for l in range(np.uint64(n)):  # noqa: E741
        row = np.uint64(np.uint32(cells[l]))
        lanes[_SAMPLE_R + l] = table[row, 0]
        lanes[_SAMPLE_G + l] = table[row, 1]
        lanes[_SAMPLE_B + l] = table[row, 2]
        extinction = table[row, 3]
        lanes[_SAMPLE_TAU + l] = extinction
        opaque |= extinction > _F(0.0)
    return opaque


@kernel
def blend(n, near, far, lanes):
    """Front-to-back OVER of the samples, which stand for [near, far] of each ray; True if all are opaque."""
    going = False
    for l in range(np.uint64(n)):  # noqa: E741
        begin = lanes[RAY_NEAR + l]
        end = lanes[RAY_FAR + l]
        begin = begin if begin > near else near
        end = end if end < far else far
        length = end - begin
        length = length if length > _F(0.0) else _F(0.0)
        # α = 1 − 2^y without cancellation: 2^y = 2^n·(1 + q), |q| small.
        y = lanes[_SAMPLE_TAU + l] * (lanes[LENGTH + l] * length) * _MINUS_LOG2E
        y = y if y > _F(-126.0) else _F(-126.0)
        shifted = y + _ROUNDER
        f = y - (shifted - _ROUNDER)
        q = f * (_C1 + f * (_C2 + f * (_C3 + f * (_C4 + f * (_C5 + f * (_C6 + f * _C7))))))
        power = power_of_two(shifted)
        alpha = (_F(1.0) - power) - power * q
        accumulated = lanes[ALPHA + l]
        share = (_F(1.0) - accumulated) * alpha
        lanes[RED + l] += share * lanes[_SAMPLE_R + l]
        lanes[GREEN + l] += share * lanes[_SAMPLE_G + l]
        lanes[BLUE + l] += share * lanes[_SAMPLE_B + l]
        accumulated += share
        lanes[ALPHA + l] = accumulated
        going |= accumulated < lanes[ENOUGH + l]
    return not going
