"""Packets: 16 neighbouring pixels on one sample plane, sampled, classified and blended; plain numba.

These two functions are all that is worth writing for one kind of processor; `packet_vector` does. The loops
over lanes become vectors where the compiler can. Their length `n` is always 16, but must not be known to the
compiler: a known 16 is unrolled before it can be vectorised (blending: 22 instead of 12 ns a packet).
Integers stay out of the vector loops, for numba widens them to 64 bits and the vectors get half as long.
"""

import numpy as np

from .._jit import inlined_kernel, power_of_two
from .state import (
    ALPHA,
    BLUE,
    ENOUGH,
    EXP2_COEFFICIENTS,
    GREEN,
    LENGTH,
    LIGHT_OF_SECOND,
    LIT_BLUE,
    LIT_GREEN,
    LIT_RED,
    MINUS_LOG2E,
    RAY_FAR,
    RAY_NEAR,
    RED,
    ROUNDER,
    SECOND,
    SHINE_BLUE,
    SHINE_GREEN,
    SHINE_RED,
    SKIPPED,
    THICKER,
    VALUE,
)

WINDOW = 64  # most voxels of a row that one packet may span
CHUNK = 32  # rows are interpolated so many voxels at a time, beyond their ends
SCRATCH = WINDOW + CHUNK  # floats

_F = np.float32
_ONE = np.uint64(1)
_NAN = _F(np.nan)
_C1, _C2, _C3, _C4, _C5, _C6, _C7 = EXP2_COEFFICIENTS


@inlined_kernel
def sample(
    n, width, voxels, at_00, at_10, at_01, at_11, weight_j, weight_k, x, step, low, high, last_cell,
    begin, end, scratch, cells, lanes, at,
):  # fmt: skip
    """Scalars at x + l·step, clamped to [low, high], between the rows; NaN outside cells begin … end − 1.

    Positions along i count from any voxel; the rows' voxels from `begin` on, `width` ≤ WINDOW of them, start
    at `at_00` (scanline j, k), `at_10` (j + 1, k), `at_01` (j, k + 1) and `at_11`, the last two not used
    where `weight_k` is 0. `last_cell`: the box's last, to which x at the box's end belongs. `scratch`
    (SCRATCH floats) and `cells` (16 int32) hold nothing. Result in lanes[at …].
    """
    length = (width + CHUNK - 1) // CHUNK * CHUNK  # whole vectors: what is read beyond the run is not used
    if weight_k == _F(0.0):
        for i in range(length):
            above, below = _F(voxels[np.uint64(at_00 + i)]), _F(voxels[np.uint64(at_10 + i)])
            scratch[np.uint64(i)] = above + weight_j * (below - above)
    else:
        for i in range(length):
            above, below = _F(voxels[np.uint64(at_00 + i)]), _F(voxels[np.uint64(at_10 + i)])
            near = above + weight_j * (below - above)
            above, below = _F(voxels[np.uint64(at_01 + i)]), _F(voxels[np.uint64(at_11 + i)])
            far = above + weight_j * (below - above)
            scratch[np.uint64(i)] = near + weight_k * (far - near)
    values = np.uint64(at)
    for l in range(np.uint64(n)):  # noqa: E741
        place = x + _F(l) * step
        place = place if place > low else low
        place = place if place < high else high
        cell = np.floor(place)
        cell = cell if cell < last_cell else last_cell
        lanes[values + l] = place - cell if cell >= begin and cell < end else _NAN
        cell = cell if cell > begin else begin
        cell = cell if cell < end else begin
        cells[l] = np.int32(cell - begin)
    for l in range(np.uint64(n)):  # noqa: E741
        cell = np.uint64(np.uint32(cells[l]))
        left = scratch[cell]
        lanes[values + l] = left + lanes[values + l] * (scratch[cell + _ONE] - left)


@inlined_kernel
def light_colours(n, scratch, lanes, light):
    """The colours in scratch[0 …], n a channel, as light makes them."""
    red, green, blue = np.uint64(0), np.uint64(n), np.uint64(2 * n)
    for l in range(np.uint64(n)):  # noqa: E741
        scratch[red + l] = scratch[red + l] * lanes[light + LIT_RED + l] + lanes[light + SHINE_RED + l]
        scratch[green + l] = (
            scratch[green + l] * lanes[light + LIT_GREEN + l] + lanes[light + SHINE_GREEN + l]
        )
        scratch[blue + l] = scratch[blue + l] * lanes[light + LIT_BLUE + l] + lanes[light + SHINE_BLUE + l]


@inlined_kernel
def _blend_one(n, table, origin, scale, last_row, values, slot, scratch, cells, lanes, at, light):
    """One of the two samples of `blend`; `light`: where its sections begin, or None."""
    pixel = np.uint64(at)
    near, far = slot[0], slot[1]
    share_0, slope = slot[2] * MINUS_LOG2E, slot[3] * (_F(0.5) * MINUS_LOG2E)
    last = _F(last_row)
    for l in range(np.uint64(n)):  # noqa: E741
        value = lanes[pixel + values + l]
        entry = (value - origin) * scale + _F(1.5)
        entry = entry if entry > _F(1.0) else _F(1.0)
        entry = entry if entry < last else last
        if light is not None:
            entry += lanes[light + SKIPPED + l]
        entry = entry if value == value else _F(0.0)  # NaN: nothing
        cells[l] = np.int32(entry)
    red, green, blue, extinctions = np.uint64(0), np.uint64(n), np.uint64(2 * n), np.uint64(3 * n)
    for l in range(np.uint64(n)):  # noqa: E741
        row = np.uint64(np.uint32(cells[l]))
        scratch[red + l] = table[row, 0]
        scratch[green + l] = table[row, 1]
        scratch[blue + l] = table[row, 2]
        scratch[extinctions + l] = table[row, 3]
    if light is not None:
        for l in range(np.uint64(n)):  # noqa: E741
            scratch[extinctions + l] *= lanes[light + THICKER + l]
        light_colours(n, scratch, lanes, light)
    going = False
    for l in range(np.uint64(n)):  # noqa: E741
        begin = lanes[pixel + RAY_NEAR + l]
        end = lanes[pixel + RAY_FAR + l]
        begin = begin if begin > near else near
        end = end if end < far else far
        length = end - begin
        length = length if length > _F(0.0) else _F(0.0)
        share = share_0 + slope * (begin + end)
        y = scratch[extinctions + l] * (lanes[pixel + LENGTH + l] * length) * share
        y = y if y > _F(-126.0) else _F(-126.0)
        shifted = y + ROUNDER
        f = y - (shifted - ROUNDER)
        q = f * (_C1 + f * (_C2 + f * (_C3 + f * (_C4 + f * (_C5 + f * (_C6 + f * _C7))))))
        power = power_of_two(shifted)
        alpha = (_F(1.0) - power) - power * q
        accumulated = lanes[pixel + ALPHA + l]
        covered = (_F(1.0) - accumulated) * alpha
        lanes[pixel + RED + l] += covered * scratch[red + l]
        lanes[pixel + GREEN + l] += covered * scratch[green + l]
        lanes[pixel + BLUE + l] += covered * scratch[blue + l]
        accumulated += covered
        lanes[pixel + ALPHA + l] = accumulated
        going |= accumulated < lanes[pixel + ENOUGH + l]
    return not going


@inlined_kernel
def blend(n, table, origin, scale, slots, scratch, cells, lanes, at):
    """Classify two samples of each pixel, front to back, and lay them under what is there.

    `slots` float32 [2, 4]: [near, far] of the rays that each stands for, counted from `base` as the rays'
    ranges are; the share of the extinction at `base`, and how it grows with the distance. True if no pixel
    lets enough light through to go on.
    """
    last = table.shape[0] - 1
    _blend_one(n, table, origin, scale, last, VALUE, slots[0], scratch, cells, lanes, at, None)
    return _blend_one(n, table, origin, scale, last, SECOND, slots[1], scratch, cells, lanes, at, None)


@inlined_kernel
def blend_lit(n, table, origin, scale, last, slots, scratch, cells, lanes, at, light):
    """As `blend`, with what `phong.shade` left in the light's sections; `last`: row of a magnitude's last."""
    second = light + LIGHT_OF_SECOND
    _blend_one(n, table, origin, scale, last, VALUE, slots[0], scratch, cells, lanes, at, light)
    return _blend_one(n, table, origin, scale, last, SECOND, slots[1], scratch, cells, lanes, at, second)
