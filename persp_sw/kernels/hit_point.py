"""Where in its piece a ray sees what it sees, and gradients there: plain numba.

The first hit of an opaque surface lies anywhere in a piece, and its normal is that of this place, not of the
piece's middle. The scalar is linear along the piece, so what the ray sees of it has its mean place where the
integral functions say: after a share g(T) of the piece's extinction, T its optical depth,
    g(T) = 1/T − 1/(exp(T) − 1) ≈ (6 + T) / (12 + 4·T + T²)
(½ for thin pieces, nearly 1/T for opaque ones; the fraction errs by 0.011 at most). That is one step, as near
as three bisections of the piece in the voxels (`benchmarks/hit_points.py`).

Gradients have neighbours one voxel away, and every ray its own place in the packet's cells.
"""

import numpy as np

from .._jit import inlined_kernel
from .encode import packed_position
from .state import LENGTH, RAY_FAR, RAY_NEAR, TILE, VALUE, VALUE_END

_F = np.float32
_NONE, _ONE, _TWO, _THREE = np.uint64(0), np.uint64(1), np.uint64(2), np.uint64(3)
_LINE = np.uint64(TILE)
_END = VALUE_END - VALUE


@inlined_kernel
def find_hit_points(n, path, share, table, lanes, at, section, to):
    """Mean place of what each ray sees of its piece, as its distance from the plane, into `to`.

    Parameters
    ----------
    path
        See `packet_preintegrated_portable.sample`.
    share
        float32 (s_0, s_1): of the extinction at distance D the piece has s_0 + s_1·D.
    table
        `tables.LitIntegralTable`.
    at, section
        The tile, and the section with the sample's rows; of a ray without any, the middle of what is left of
        the piece.
    """
    plane, near, far = path[4], path[5], path[6]
    sums, beyond, places = table.sums, table.beyond, table.places
    end, steps = table.end, table.steps
    for l in range(np.uint64(n)):  # noqa: E741
        first, last = lanes[at + section + l], lanes[at + section + _END + l]
        first, last = (first, last) if first == first else (_F(1.0), _F(1.0))
        rising = last >= first
        sign, before, behind = (_F(1.0), _NONE, _ONE) if rising else (_F(-1.0), _ONE, _NONE)
        lowest, highest = (first, last) if rising else (last, first)
        below = max(min(highest, _F(1.0)) - lowest, _F(0.0)) * beyond[_NONE, _THREE]
        above = max(highest - max(lowest, end), _F(0.0)) * beyond[_ONE, _THREE]
        start = sums[np.uint64(min(max(first, _F(1.0)), end)), _THREE]
        stop = sums[np.uint64(min(max(last, _F(1.0)), end)), _THREE]
        inside = _F(stop - start) if rising else _F(start - stop)
        ahead, rest = (below, above) if rising else (above, below)
        total = ahead + inside + rest
        begins, ends = lanes[at + RAY_NEAR + l], lanes[at + RAY_FAR + l]
        begins = begins if begins > near else near
        ends = ends if ends < far else far
        length = ends - begins if ends > begins else _F(0.0)
        rows = max(highest - lowest, _F(1.0))
        depth = total * table.unit / rows * (lanes[at + LENGTH + l] * length)
        depth *= share[0] + share[1] * (_F(0.5) * (begins + ends))
        depth = depth if depth < _F(87.0) else _F(87.0)
        seen = (_F(6.0) + depth) / (_F(12.0) + depth * (_F(4.0) + depth))
        wanted = seen * total
        part = seen
        if wanted < ahead:
            part = wanted / (beyond[before, _THREE] * rows)
        elif wanted < ahead + inside:
            place = min(max((_F(start) + sign * (wanted - ahead)) * steps, _F(0.0)), _F(places.shape[0] - 2))
            step = np.uint64(place)
            row = places[step] + (place - np.floor(place)) * (places[step + _ONE] - places[step])
            part = (row - first) * sign / rows
        elif rest > _F(0.0):
            part = _F(1.0) - (total - wanted) / (beyond[behind, _THREE] * rows)
        part = min(max(part, _F(0.0)), _F(1.0))
        lanes[to + l] = begins + part * length - plane


@inlined_kernel
def rows_around(level, j, k, begin):
    """Where the rows around cell (j, k) are stored: its own four, eight beside them along j, then along k.

    Of each pair along j the lower comes first. Where the volume ends, its last row stands for those beyond.
    Positions are those of the voxel before `begin`, as of `packet_lit_portable.rows_at`.
    """
    j_low, j_high = j - min(j, _ONE), min(j + _TWO, np.uint64(level.needed.shape[0] - 1))
    k_low, k_high = k - min(k, _ONE), min(k + _TWO, np.uint64(level.needed.shape[1] - 1))
    return (
        _row(level, j, k, begin),
        _row(level, j + _ONE, k, begin),
        _row(level, j, k + _ONE, begin),
        _row(level, j + _ONE, k + _ONE, begin),
        _row(level, j_low, k, begin),
        _row(level, j_high, k, begin),
        _row(level, j_low, k + _ONE, begin),
        _row(level, j_high, k + _ONE, begin),
        _row(level, j, k_low, begin),
        _row(level, j + _ONE, k_low, begin),
        _row(level, j, k_high, begin),
        _row(level, j + _ONE, k_high, begin),
    )


@inlined_kernel
def _row(level, j, k, begin):
    return packed_position(level.needed, level.offsets, j, k, begin) - 1


@inlined_kernel
def find_slopes_at(
    n, start, begin, end, cell, y, z, x, step, low, high, path, level, lanes, hits, slopes
):  # fmt: skip
    """Differences per voxel of the volume along i, j and k where the packet's rays are at `hits`.

    As `packet_lit_portable.find_slopes` of neighbours one voxel away, but for:

    Parameters
    ----------
    begin, end, cell
        Cells of the window, and (j, k) of theirs. Hits beyond their sample's cell count as on its border:
        what lies beyond may not be stored, and skipping empty space must not change a bit.
    hits, slopes
        Sections of `lanes`: distances ahead of the plane; three lines for the differences.
    """
    t_i, t_step, t_j, towards = path[0], path[1], path[2], path[3]
    rows = rows_around(level, cell[0], cell[1], begin)
    voxels = level.voxels
    w_j, w_k = _F(y - np.float64(cell[0])), _F(z - np.float64(cell[1]))
    first = np.float64(begin) - 1.0
    lowest, highest = _F(max(low, np.float64(begin)) - start), _F(min(high, np.float64(end)) - start)
    last_cell, origin = _F(np.float64(end) - 1.0 - start), _F(first - start)
    least, most = _F(-start), _F(level.columns - 1.0 - start)
    last_j, last_k = _F(level.needed.shape[0] - 1 - cell[0]), _F(level.needed.shape[1] - 1 - cell[1])
    first_j, first_k = -_F(cell[0]), -_F(cell[1])
    x_0, x_step = _F(x - start), _F(step)
    per_i, per_j, per_k = _F(level.per_voxel[0]), _F(level.per_voxel[1]), _F(level.per_voxel[2])
    for l in range(np.uint64(n)):  # noqa: E741
        ahead = lanes[hits + l]
        place = x_0 + _F(l) * x_step
        inside = place if place > lowest else lowest
        inside = inside if inside < highest else highest
        cell_i = np.floor(inside)
        cell_i = cell_i if cell_i < last_cell else last_cell
        x = min(max(place + (t_i + _F(l) * t_step) * ahead - cell_i, _F(0.0)), _F(1.0))
        y = min(max(w_j + t_j * ahead, _F(0.0)), _F(1.0))
        z = min(max(w_k + towards * ahead, _F(0.0)), _F(1.0))
        i = np.int64(cell_i - origin)
        before = np.int64(max(cell_i - _F(1.0), least) - origin)
        behind = np.int64(min(cell_i + _F(2.0), most) - origin)

        e_00 = _along_row(voxels, rows[0], before, i, behind, x)
        e_10 = _along_row(voxels, rows[1], before, i, behind, x)
        e_01 = _along_row(voxels, rows[2], before, i, behind, x)
        e_11 = _along_row(voxels, rows[3], before, i, behind, x)
        along_i = _between(_between(e_00, e_10, y), _between(e_01, e_11, y), z)
        lanes[slopes + l] = along_i * per_i / _apart(cell_i + x, least, most)

        v_00, v_10 = _on_row(voxels, rows[0] + i, x), _on_row(voxels, rows[1] + i, x)
        v_01, v_11 = _on_row(voxels, rows[2] + i, x), _on_row(voxels, rows[3] + i, x)
        near = _between(v_10 - _on_row(voxels, rows[4] + i, x), _on_row(voxels, rows[5] + i, x) - v_00, y)
        far = _between(v_11 - _on_row(voxels, rows[6] + i, x), _on_row(voxels, rows[7] + i, x) - v_01, y)
        lanes[slopes + _LINE + l] = _between(near, far, z) * per_j / _apart(y, first_j, last_j)

        near = _between(v_01 - _on_row(voxels, rows[8] + i, x), _on_row(voxels, rows[10] + i, x) - v_00, z)
        far = _between(v_11 - _on_row(voxels, rows[9] + i, x), _on_row(voxels, rows[11] + i, x) - v_10, z)
        lanes[slopes + _LINE + _LINE + l] = _between(near, far, y) * per_k / _apart(z, first_k, last_k)


@inlined_kernel
def _between(one, other, weight):
    return one + weight * (other - one)


@inlined_kernel
def _apart(place, least, most):
    """How far apart the neighbours of a place are."""
    return min(place + _F(1.0), most) - max(place - _F(1.0), least)


@inlined_kernel
def _on_row(voxels, at, x):
    """The value at x of a row's cell at `at`."""
    return _between(_F(voxels[at]), _F(voxels[at + 1]), x)


@inlined_kernel
def _along_row(voxels, row, before, i, behind, x):
    """How much the value rises from the neighbour before to the one behind."""
    low = _F(voxels[row + i + 1]) - _F(voxels[row + before])
    return _between(low, _F(voxels[row + behind]) - _F(voxels[row + i]), x)
