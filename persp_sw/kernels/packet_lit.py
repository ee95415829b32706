"""What gradients do to a packet: found where the transfer function shows something, and nowhere else.

The gradient is that of the interpolated field, by central differences of neighbours `REACH` voxels away along
each axis. At a border of the volume the neighbours are where it ends, and their difference is divided by how
far apart they are.
"""

import numpy as np

from .._jit import VECTORS, inlined_kernel, kernel_by_type, lean_kernel
from .encode import PADDING
from .packet_portable import WINDOW
from .phong import HALF_DIFFUSE, PER_SHADOW, REACH, SHADOW, SHADOW_SIZE, START
from .scanline import ROUNDING
from .state import COSINE, LEFT, NEIGHBOURS, TILE
from .tables import LitIntegralTable

if VECTORS:
    from .hit_point_vector import find_hit_points, find_slopes_at
    from .packet_lit_vector import add_light, find_slopes, shade, shows_classified, shows_integrated
    from .packet_vector import sample
    from .reflect_vector import reflect
else:
    from .hit_point import find_hit_points, find_slopes_at
    from .packet_lit_portable import find_slopes, shows_classified, shows_integrated
    from .packet_portable import sample
    from .phong import add_light, shade
    from .reflect import reflect

__all__ = ["light_up", "shows_classified", "shows_integrated"]

_F = np.float32
_NONE = np.uint64(0)
_ALL = _F(1 / 65535)


@inlined_kernel
def _find_left(n, number, y, z, x, step, low, high, level, shades, scratch, cells, lanes, light):
    """How much is left of a light at the packet's samples; see `Shade.shadows`."""
    lefts, room = light + LEFT, light + NEIGHBOURS
    for l in range(np.uint64(n)):  # noqa: E741
        lanes[lefts + l] = _F(1.0)
    one, numbers = shades.lights[number], shades.numbers
    per = np.float64(numbers[PER_SHADOW])
    shadow = np.int64(one[SHADOW])
    if shadow < 0:
        return
    n_i, n_j = np.int64(numbers[SHADOW_SIZE]), np.int64(numbers[SHADOW_SIZE + 1])
    n_k = np.int64(numbers[SHADOW_SIZE + 2])
    x_0 = (x * level.factor[0] + one[START]) * per
    step = step * level.factor[0] * per
    low, high = (low * level.factor[0] + one[START]) * per, (high * level.factor[0] + one[START]) * per
    low, high = max(low, 0.0), min(max(high, 0.0), n_i - 1.0)
    y = min(max((y * level.factor[1] + one[START + 1]) * per, 0.0), n_j - 1.0)
    z = min(max((z * level.factor[2] + one[START + 2]) * per, 0.0), n_k - 1.0)
    j, k = min(np.int64(y), n_j - 2), min(np.int64(z), n_k - 2)
    at_00 = PADDING + ((shadow * n_j + j) * n_k + k) * n_i
    first = np.int64(min(max(x_0, low), high))
    end = min(np.int64(min(max(x_0 + (TILE - 1) * step, low), high) + ROUNDING) + 1, n_i - 1)
    first = min(first, end - 1)
    start = np.float64(first)  # for all windows: float32 must not round a place out of two neighbours
    while first < end:
        last = min(first + WINDOW - 1, end)
        sample(
            n, last - first + 1, shades.shadows, at_00 + first, at_00 + n_k * n_i + first,
            at_00 + n_i + first, at_00 + (n_k + 1) * n_i + first, _F(y - j), _F(z - k), _F(x_0 - start),
            _F(step), _F(low - start), _F(high - start), _F(n_i - 2.0 - start), _F(np.float64(first) - start),
            _F(np.float64(last) - start), scratch, cells, lanes, np.int64(room),
        )  # fmt: skip
        for l in range(np.uint64(n)):  # noqa: E741
            found = lanes[room + l]
            lanes[lefts + l] = found * _ALL if found == found else lanes[lefts + l]
        first = last


@inlined_kernel
def _in_cell(place, cell):
    """Pre-integration looks at places beyond their cell."""
    return min(max(place, np.float64(cell)), np.float64(cell) + 1.0)


@inlined_kernel
def _slopes_on_plane(
    n, start, begin, end, cell, y, z, x, step, low, high, level, table, scratch, cells, lanes, slopes
):  # fmt: skip
    """Slopes where the packet's plane is, see `light_up`."""
    y, z = _in_cell(y, cell[0]), _in_cell(z, cell[1])
    reach = np.float64(table.numbers[REACH])
    pad = np.uint64(np.ceil(reach))
    n_i, n_j, n_k = level.columns, level.needed.shape[0], level.needed.shape[1]
    first = begin - pad if begin > pad else _NONE
    last = min(end + pad, np.uint64(n_i - 1))
    sides = (
        max(y - reach, 0.0),
        min(y + reach, n_j - 1.0),
        max(z - reach, 0.0),
        min(z + reach, n_k - 1.0),
    )
    find_slopes(
        n, start, begin, first, last, y, z, reach, sides, x, step, low, high, level, scratch, cells, lanes,
        slopes,
    )  # fmt: skip


def find_gradients(
    n, start, begin, end, cell, y, z, x, step, low, high, path, share, level, table, scratch, cells, lanes,
    at, section, slopes,
):  # fmt: skip
    """Slopes where a packet's samples have their normals, into three lines from `slopes`. Compiled code only.

    Of samples that is where they are; of pieces where their ray sees them, between those of both ends.
    """
    raise NotImplementedError


@inlined_kernel
def _at_samples(
    n, start, begin, end, cell, y, z, x, step, low, high, path, share, level, table, scratch, cells, lanes,
    at, section, slopes,
):  # fmt: skip
    _slopes_on_plane(
        n, start, begin, end, cell, y, z, x, step, low, high, level, table, scratch, cells, lanes, slopes
    )  # fmt: skip


@inlined_kernel
def _at_hit_points(
    n, start, begin, end, cell, y, z, x, step, low, high, path, share, level, table, scratch, cells, lanes,
    at, section, slopes,
):  # fmt: skip
    if table.numbers[REACH] == _F(1.0):
        hits = slopes + COSINE - NEIGHBOURS
        find_hit_points(n, path, share, table, lanes, at, section, hits)
        find_slopes_at(n, start, begin, end, cell, y, z, x, step, low, high, path, level, lanes, hits, slopes)
    else:
        _slopes_on_plane(
            n, start, begin, end, cell, y, z, x, step, low, high, level, table, scratch, cells, lanes, slopes
        )


@kernel_by_type(find_gradients)
def _choose_gradients(
    n, start, begin, end, cell, y, z, x, step, low, high, path, share, level, table, scratch, cells, lanes,
    at, section, slopes,
):  # fmt: skip
    return _at_hit_points if table.instance_class is LitIntegralTable else _at_samples


@lean_kernel
def light_up(
    n,
    start,
    begin,
    end,
    cell,
    y,
    z,
    x,
    step,
    low,
    high,
    ray,
    path,
    share,
    level,
    shades,
    scratch,
    cells,
    lanes,
    at,
    section,
    light,
    sample_at,
):
    """Light's sections of a packet's samples from their gradients; see `phong.shade`.

    Parameters
    ----------
    start
        The voxel from which places along i are counted in float32: the same for all windows of a packet.
    begin, end
        The cells of a row that show anything.
    cell
        (j, k) of these cells.
    y, z, x, step, low, high
        Where the samples are, in the level's voxels: scanline and slice, clamped to the cell, and x + l·step
        along i, clamped to [low, high].
    ray
        float32 (t_i of lane 0, its growth a lane, t_j, sign), in the volume's voxels.
    path, share
        See `hit_point.find_hit_points`; of no account to a `LitTable`.
    shades
        A lit table of `tables`.
    at, section
        The tile, and its section with the samples.
    light, sample_at
        Where the light's sections begin in `lanes`, and the sample's among them.
    """
    slopes = light + NEIGHBOURS
    find_gradients(
        n, start, begin, end, cell, y, z, x, step, low, high, path, share, level, shades, scratch, cells,
        lanes, at, section, slopes,
    )  # fmt: skip
    shade(n, ray, slopes, shades, lanes, at, light, sample_at)
    y, z = _in_cell(y, cell[0]), _in_cell(z, cell[1])
    for number in range(shades.lights.shape[0]):
        _find_left(n, number, y, z, x, step, low, high, level, shades, scratch, cells, lanes, light)
        add_light(n, number, shades, lanes, light, sample_at)
    if shades.numbers[HALF_DIFFUSE] > _F(0.0):
        reflect(n, shades.numbers, lanes, light, sample_at)
