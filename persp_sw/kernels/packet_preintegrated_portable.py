"""Pre-integrated packets, plain numba: each sample stands for a piece of its ray, all of whose scalars count.

The plane lies in the middle of the piece. In the sample's cell the scalar s is trilinear; along the ray it is
taken as linear, with its slope in the plane,
    ds/dD = t_i·∂s/∂i + t_j·∂s/∂j + sign·∂s/∂k,
from one end of what the ray's range leaves of the piece to the other, and never beyond the cell's smallest
and largest corner: what a cell cannot show does not show. The piece's extinction is the mean over the table's
rows from one end's to the other's; its colour is their mean colour, weighted by extinction. Integral
functions (Engel, Kraus, Ertl 2001) give both for any length.

The piece's front dims its back. With the extinction passed so far as abscissa, x = 0 … T, the colour counts
by exp(−x), whose mean place is (α − T·(1 − α)) / α, α = 1 − exp(−T). It is taken as the plain mean over
x = 0 … L with the same mean place, L = f·T,
    f = 2·(α − T·(1 − α)) / (T·α):
exact for colours linear in x; the whole piece if it is thin, its first two optical depths if it is opaque.
(Without it colours behind a surface shine through: real CT, opaque, 30.0 instead of 33.5 dB, from inside 29
instead of 52.) Where the sums have grown so far is found in steps of 1 / STEPS of all extinction, the next
step beyond.
"""

import numpy as np

from .._jit import inlined_kernel, power_of_two
from .packet_portable import CHUNK, light_colours
from .packet_portable import SCRATCH as LINE
from .state import (
    ALPHA,
    BLUE,
    ENOUGH,
    EXP2_COEFFICIENTS,
    FAR_ROW,
    GREEN,
    LENGTH,
    LIGHT_OF_SECOND,
    MINUS_LN2,
    MINUS_LOG2E,
    RAY_FAR,
    RAY_NEAR,
    RED,
    ROUNDER,
    SECOND,
    THICKER,
    THIN,
    VALUE,
    VALUE_END,
)

_F = np.float32
STEPS = 1024  # as `optics.preintegration` makes them
EDGE = _F(0.01)  # of a step, which rounding may be off: a step found is beyond by that at least
_NONE, _ONE, _TWO, _THREE = np.uint64(0), np.uint64(1), np.uint64(2), np.uint64(3)
_LINE = np.uint64(LINE)
_NAN = _F(np.nan)
_END = VALUE_END - VALUE  # from a sample's section to the one with its end
_C1, _C2, _C3, _C4, _C5, _C6, _C7 = EXP2_COEFFICIENTS


@inlined_kernel
def sample(
    n, width, voxels, at_00, at_10, at_01, at_11, weight_j, weight_k, x, step, low, high, last_cell,
    begin, end, path, table, scratch, cells, lanes, at, section,
):  # fmt: skip
    """Table rows that the piece of each ray covers, as the borders between rows where it begins and where it
    ends: the one in `section`, NaN outside cells begin … end − 1 and where a voxel is missing; the other in
    the section's end. A border is the number of the row above it.

    As `packet_portable.sample` but for: x + l·step, where the ray meets the plane, picks its cell clamped to
    [low, high] but not its place in it; `path` float32 [t_i of lane 0, its growth a lane, t_j, sign], in the
    level's voxels a distance, [the plane's distance, near, far] of the piece, counted from `base`; `scratch`
    4·SCRATCH floats.
    """
    t_first, t_step, t_j, towards, plane, near, far = path
    values, slopes = np.uint64(0), _LINE
    smallest, largest = _TWO * _LINE, _THREE * _LINE
    length = (width + CHUNK - 1) // CHUNK * CHUNK
    for voxel in range(length):
        i = np.uint64(voxel)
        a, b = _F(voxels[np.uint64(at_00 + voxel)]), _F(voxels[np.uint64(at_10 + voxel)])
        c, d = _F(voxels[np.uint64(at_01 + voxel)]), _F(voxels[np.uint64(at_11 + voxel)])
        front, back = a + weight_j * (b - a), c + weight_j * (d - c)
        along_k = back - front
        along_j = (b - a) + weight_k * ((d - c) - (b - a))
        scratch[values + i] = front + weight_k * along_k
        scratch[slopes + i] = t_j * along_j + towards * along_k
        low_front, low_back = a if a < b else b, c if c < d else d
        high_front, high_back = a if a > b else b, c if c > d else d
        scratch[smallest + i] = low_front if low_front < low_back else low_back
        scratch[largest + i] = high_front if high_front > high_back else high_back
    first, after = np.uint64(at) + section, np.uint64(at) + section + _END
    for l in range(np.uint64(n)):  # noqa: E741
        place = x + _F(l) * step
        inside = place if place > low else low
        inside = inside if inside < high else high
        cell = np.floor(inside)
        cell = cell if cell < last_cell else last_cell
        lanes[first + l] = place - cell if cell >= begin and cell < end else _NAN
        cell = cell if cell > begin else begin
        cell = cell if cell < end else begin
        cells[l] = np.int32(cell - begin)
    origin, scale = table.origin, table.scale
    for l in range(np.uint64(n)):  # noqa: E741
        left = np.uint64(np.uint32(cells[l]))
        right = left + _ONE
        weight = lanes[first + l]
        along_i = scratch[right] - scratch[left]
        value = scratch[left] + weight * along_i
        slope = scratch[slopes + left] + weight * (scratch[slopes + right] - scratch[slopes + left])
        slope += (t_first + _F(l) * t_step) * along_i
        least, other = scratch[smallest + left], scratch[smallest + right]
        least = least if least < other else other
        most, other = scratch[largest + left], scratch[largest + right]
        most = most if most > other else other
        begins, ends = lanes[np.uint64(at) + RAY_NEAR + l], lanes[np.uint64(at) + RAY_FAR + l]
        begins = begins if begins > near else near
        ends = ends if ends < far else far
        one, two = value + slope * (begins - plane), value + slope * (ends - plane)
        lower, upper = one if one < two else two, one if one > two else two
        lower = lower if lower > least else least
        lower = lower if lower < most else most
        upper = upper if upper > least else least
        upper = upper if upper < most else most
        row = (lower - origin) * scale + _F(1.5)
        row = row if row > -FAR_ROW else -FAR_ROW
        row = row if row < FAR_ROW else FAR_ROW
        end_row = (upper - origin) * scale + _F(1.5)
        end_row = end_row if end_row > -FAR_ROW else -FAR_ROW
        end_row = end_row if end_row < FAR_ROW else FAR_ROW
        first_row, last_row = np.floor(row), np.floor(end_row) + _F(1.0)
        rising = two >= one
        near_row = first_row if rising else last_row
        lanes[first + l] = near_row if value == value else _NAN
        lanes[after + l] = last_row if rising else first_row


@inlined_kernel
def _blend_one(n, table, section, slot, scratch, lanes, at, light):
    """One of the two samples of `blend`; `light`: where its sections begin, or None."""
    sums, beyond, end, steps = table.sums, table.beyond, table.end, table.steps
    pixel, size = np.uint64(at), np.uint64(n)
    near, far = slot[0], slot[1]
    share_0, slope = slot[2] * MINUS_LOG2E, slot[3] * (_F(0.5) * MINUS_LOG2E)
    red, green, blue = np.uint64(0), size, _TWO * size
    # Extinction, in `sums`' unit, that the piece passes before the table's rows, in them and after them.
    befores, insides, rests = np.uint64(3) * size, np.uint64(4) * size, np.uint64(5) * size
    starts = np.uint64(6) * size
    for l in range(size):  # noqa: E741
        first, last = lanes[pixel + section + l], lanes[pixel + section + _END + l]
        first, last = (first, last) if first == first else (_F(1.0), _F(1.0))
        rising = last >= first
        lowest, highest = (first, last) if rising else (last, first)
        below = max(min(highest, _F(1.0)) - lowest, _F(0.0)) * beyond[_NONE, _THREE]
        above = max(highest - max(lowest, end), _F(0.0)) * beyond[_ONE, _THREE]
        scratch[befores + l], scratch[rests + l] = (below, above) if rising else (above, below)
        begin = sums[np.uint64(min(max(first, _F(1.0)), end)), _THREE]
        stop = sums[np.uint64(min(max(last, _F(1.0)), end)), _THREE]
        scratch[insides + l] = _F(stop - begin) if rising else _F(begin - stop)
        scratch[starts + l] = _F(begin)
    alphas, withins = np.uint64(7) * size, np.uint64(8) * size
    for l in range(size):  # noqa: E741
        first, last = lanes[pixel + section + l], lanes[pixel + section + _END + l]
        count = abs(last - first) if first == first else _F(1.0)
        total = scratch[befores + l] + scratch[insides + l] + scratch[rests + l]
        begins, ends = lanes[pixel + RAY_NEAR + l], lanes[pixel + RAY_FAR + l]
        begins = begins if begins > near else near
        ends = ends if ends < far else far
        length = ends - begins
        length = length if length > _F(0.0) else _F(0.0)
        share = share_0 + slope * (begins + ends)
        if light is not None:
            share *= lanes[light + THICKER + l]
        y = total * table.unit / count * (lanes[pixel + LENGTH + l] * length) * share
        y = y if y > _F(-126.0) else _F(-126.0)
        shifted = y + ROUNDER
        f = y - (shifted - ROUNDER)
        q = f * (_C1 + f * (_C2 + f * (_C3 + f * (_C4 + f * (_C5 + f * (_C6 + f * _C7))))))
        power = power_of_two(shifted)
        alpha = (_F(1.0) - power) - power * q
        depth = y * MINUS_LN2
        part = _F(1.0) - depth * _F(1.0 / 6.0)
        if depth >= THIN:
            part = _F(2.0) * (alpha - depth * (_F(1.0) - alpha)) / (depth * alpha)
        wanted = part * total
        before = scratch[befores + l]
        before = before if before < wanted else wanted
        scratch[befores + l] = before
        scratch[withins + l] = wanted - before
        scratch[alphas + l] = alpha
    for l in range(size):  # noqa: E741
        first, last = lanes[pixel + section + l], lanes[pixel + section + _END + l]
        first, last = (first, last) if first == first else (_F(1.0), _F(1.0))
        rising = last >= first
        sign = _F(1.0) if rising else _F(-1.0)
        within, inside = scratch[withins + l], scratch[insides + l]
        row = np.uint64(min(max(last, _F(1.0)), end))
        rest = max(within - inside, _F(0.0))
        if within < inside - _F(1.0) / steps:
            place = (scratch[starts + l] + sign * within) * steps
            step = np.floor(place + EDGE) + _F(1.0) if rising else -_F(1.0) - np.floor(EDGE - place)
            row = np.uint64(min(max(step, _F(0.0)), _F(STEPS)) + (end + _F(1.0)))
            rest = _F(0.0)
        begin = np.uint64(min(max(first, _F(1.0)), end))
        before = scratch[befores + l]
        amount = before + sign * _F(sums[row, _THREE] - sums[begin, _THREE]) + rest
        reciprocal = _F(1.0) / (amount if amount > _F(1.0) else _F(1.0))
        side = _NONE if rising else _ONE
        for channel in range(3):
            c = np.uint64(channel)
            colour = before * beyond[side, c] + rest * beyond[_ONE - side, c]
            colour += sign * _F(sums[row, c] - sums[begin, c])
            scratch[np.uint64(channel) * size + l] = colour * reciprocal
    if light is not None:
        light_colours(n, scratch, lanes, light)
    going = False
    for l in range(size):  # noqa: E741
        accumulated = lanes[pixel + ALPHA + l]
        covered = (_F(1.0) - accumulated) * scratch[alphas + l]
        lanes[pixel + RED + l] += covered * scratch[red + l]
        lanes[pixel + GREEN + l] += covered * scratch[green + l]
        lanes[pixel + BLUE + l] += covered * scratch[blue + l]
        accumulated += covered
        lanes[pixel + ALPHA + l] = accumulated
        going |= accumulated < lanes[pixel + ENOUGH + l]
    return not going


@inlined_kernel
def blend(n, table, slots, scratch, cells, lanes, at):
    """As `packet_portable.blend`, of the rows that `sample` left."""
    _blend_one(n, table, VALUE, slots[0], scratch, lanes, at, None)
    return _blend_one(n, table, SECOND, slots[1], scratch, lanes, at, None)


@inlined_kernel
def blend_lit(n, table, slots, scratch, cells, lanes, at, light):
    """As `packet_portable.blend_lit`, of the rows that `sample` left."""
    _blend_one(n, table, VALUE, slots[0], scratch, lanes, at, light)
    return _blend_one(n, table, SECOND, slots[1], scratch, lanes, at, light + LIGHT_OF_SECOND)
