"""Gradients of a packet, plain numba: six more samples; `packet_lit_vector` has the same as LLVM vectors."""

import numpy as np

from .._jit import inlined_kernel
from .encode import packed_position
from .packet_portable import sample
from .state import ALPHA, ENOUGH, TILE, VALUE, VALUE_END

_F = np.float32
_NONE, _ONE, _THREE = np.uint64(0), np.uint64(1), np.uint64(3)
_LINE = np.uint64(TILE)
_END = VALUE_END - VALUE


@inlined_kernel
def shows_classified(n, table, cells, lanes, at, section):
    """Whether any of a packet's scalars shows anything, to a ray that goes on; `table`: `LitTable`."""
    seen = table.seen
    last = _F(seen.shape[0] - 1)
    for l in range(np.uint64(n)):  # noqa: E741
        value = lanes[at + section + l]
        entry = (value - table.origin) * table.scale + _F(1.5)
        entry = entry if entry > _F(1.0) else _F(1.0)
        entry = entry if entry < last else last
        goes_on = value == value and lanes[at + ALPHA + l] < lanes[at + ENOUGH + l]
        cells[l] = np.int32(entry if goes_on else _F(0.0))
    shows = np.uint8(0)
    for l in range(np.uint64(n)):  # noqa: E741
        shows |= seen[np.uint64(np.uint32(cells[l]))]
    return shows != np.uint8(0)


@inlined_kernel
def shows_integrated(n, table, cells, lanes, at, section):
    """As `shows_classified`, of pieces; `table`: `LitIntegralTable`."""
    sums, beyond, end = table.sums, table.beyond, table.end
    before, after = beyond[_NONE, _THREE] > _F(0.0), beyond[_ONE, _THREE] > _F(0.0)
    shows = False
    for l in range(np.uint64(n)):  # noqa: E741
        one, other = lanes[at + section + l], lanes[at + section + _END + l]
        if one == one and lanes[at + ALPHA + l] < lanes[at + ENOUGH + l]:
            low, high = min(one, other), max(one, other)
            shows |= (low < _F(1.0) and before) or (high > end and after)
            low, high = np.uint64(min(max(low, _F(1.0)), end)), np.uint64(min(max(high, _F(1.0)), end))
            shows |= sums[low, _THREE] != sums[high, _THREE]
    return shows


@inlined_kernel
def rows_at(level, y, z, begin, ahead):
    """Where four rows around scanline y and slice z are stored, and their weights.

    Positions are those of voxel `begin`, less `ahead`: voxels before are there in the rows of the samples
    themselves, and in the others need not be.
    """
    row, slice_ = min(np.floor(y), level.needed.shape[0] - 2.0), np.floor(z)
    j, k = np.uint64(np.int64(row)), np.uint64(np.int64(slice_))
    at_00 = packed_position(level.needed, level.offsets, j, k, begin) - ahead
    at_10 = packed_position(level.needed, level.offsets, j + _ONE, k, begin) - ahead
    at_01, at_11 = at_00, at_10
    if z != slice_:
        at_01 = packed_position(level.needed, level.offsets, j, k + _ONE, begin) - ahead
        at_11 = packed_position(level.needed, level.offsets, j + _ONE, k + _ONE, begin) - ahead
    return at_00, at_10, at_01, at_11, _F(y - row), _F(z - slice_)


@inlined_kernel
def find_slopes(
    n, start, begin, first, last, y, z, reach, sides, x, step, low, high, level, scratch, cells, lanes, slopes
):  # fmt: skip
    """Differences per voxel of the volume along i, j and k, in three lines of `lanes` from `slopes` on.

    Parameters
    ----------
    start
        The voxel from which places along i are counted in float32: the same for all windows of a packet.
    begin, first, last
        The first cell that shows anything, and the cells of a row around all neighbours.
    sides
        (y and z of the neighbours along j and k): two scanlines, two slices.
    others
        See `packet_lit.light_up`.

    Six lines of `lanes` from `slopes` on are overwritten.
    """
    y_low, y_high, z_low, z_high = sides
    columns, ahead = np.float64(level.columns), np.int64(begin - first)
    for number in range(6):
        x_n, y_n, z_n = 0.0, y, z
        if number < 2:
            x_n = reach if number == 1 else -reach
        elif number < 4:
            y_n = y_high if number == 3 else y_low
        else:
            z_n = z_high if number == 5 else z_low
        at_00, at_10, at_01, at_11, weight_j, weight_k = rows_at(level, y_n, z_n, begin, ahead)
        sample(
            n, np.int64(last - first) + 1, level.voxels, at_00, at_10, at_01, at_11, weight_j, weight_k,
            _F(x + x_n - start), _F(step), _F(max(low + x_n, 0.0) - start),
            _F(min(max(high + x_n, 0.0), columns - 1.0) - start), _F(columns - 2.0 - start),
            _F(np.float64(first) - start), _F(np.float64(last) - start), scratch, cells,
            lanes, np.int64(slopes) + TILE * number,
        )  # fmt: skip
    per_y, per_z = _F(level.per_voxel[1] / (y_high - y_low)), _F(level.per_voxel[2] / (z_high - z_low))
    per_voxel, lowest, highest = _F(level.per_voxel[0]), _F(low - start), _F(high - start)
    least, most = _F(-start), _F(columns - 1.0 - start)
    x_0, x_step, r = _F(x - start), _F(step), _F(reach)
    for l in range(np.uint64(n)):  # noqa: E741
        place = x_0 + _F(l) * x_step
        place = place if place > lowest else lowest
        place = place if place < highest else highest
        far, near = place + r, place - r
        far = far if far < most else most
        near = near if near > least else least
        one, other = lanes[slopes + l], lanes[slopes + _LINE + l]
        along_i = (other - one) * per_voxel / (far - near)
        one, other = lanes[slopes + np.uint64(2) * _LINE + l], lanes[slopes + _THREE * _LINE + l]
        along_j = (other - one) * per_y
        one, other = lanes[slopes + np.uint64(4) * _LINE + l], lanes[slopes + np.uint64(5) * _LINE + l]
        lanes[slopes + l] = along_i
        lanes[slopes + _LINE + l] = along_j
        lanes[slopes + np.uint64(2) * _LINE + l] = (other - one) * per_z
