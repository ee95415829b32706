"""`hit_point` on a processor with AVX-512, as LLVM vectors."""

import numpy as np

from .._jit import inlined_kernel, intrinsic, types
from . import lanes as simd
from .hit_point import rows_around
from .packet_preintegrated_portable import STEPS
from .packet_preintegrated_vector import Piece, edges
from .packet_vector import NARROW, Tile, pick, pointer, section_at
from .state import MINUS_LN2, MINUS_LOG2E, RAY_FAR, RAY_NEAR, TILE, VALUE, VALUE_END

_F = np.float32
_END = VALUE_END - VALUE


@intrinsic
def _find_hits(
    _context, sums, beyond, places, end, unit, steps, slot, plane, lanes, at, section, to
):  # fmt: skip
    def build(context, builder, signature, arguments):
        entries = pointer(context, builder, signature.args[0], arguments[0])
        table = pointer(context, builder, signature.args[2], arguments[2])
        end, unit, steps = (simd.everywhere(builder, scalar) for scalar in arguments[3:6])
        slot = [simd.everywhere(builder, builder.extract_value(arguments[6], n)) for n in range(4)]
        plane = simd.everywhere(builder, arguments[7])
        state = pointer(context, builder, signature.args[8], arguments[8])
        tile, sample = (Tile(builder, state, at) for at in (arguments[9], builder.add(*arguments[9:11])))
        outside = edges(context, builder, signature.args[1], arguments[1])
        piece = Piece(builder, sample, entries, outside, end, (0, _END))
        depth = tile.depth(piece.total * unit / piece.count, *slot) * float(MINUS_LN2)
        seen = (depth + 6.0) / (12.0 + depth * (depth + 4.0))
        wanted = seen * piece.total
        within = wanted - piece.ahead
        place = ((piece.start + piece.sign * within) * steps).at_least(0.0).at_most(float(STEPS))
        step = place.floor()
        low, high = (simd.look_up_float(builder, table, (step + n).to_integers()) for n in (0.0, 1.0))
        first = sample.read(0)
        part = (low + (place - step) * (high - low) - first) * piece.sign / piece.count
        part = simd.where(within < 0.0, wanted / (piece.before[3] * piece.count), part)
        left = (piece.total - wanted) / (piece.behind[3] * piece.count)
        part = simd.where(within >= piece.inside, 1.0 - left, part)
        part = simd.where(piece.total > 0.0, part, seen).at_least(0.0).at_most(1.0)
        begins, ends = tile.read(RAY_NEAR).at_least(slot[0]), tile.read(RAY_FAR).at_most(slot[1])
        length = (ends - begins).at_least(0.0)
        Tile(builder, state, arguments[11]).write(begins + part * length - plane, 0)
        return context.get_dummy_value()

    arguments = (
        sums, beyond, places, *[types.float32] * 3, types.UniTuple(types.float32, 4), types.float32, lanes,
        *[types.int64] * 3,
    )  # fmt: skip
    return types.void(*arguments), build


@inlined_kernel
def find_hit_points(n, path, share, table, lanes, at, section, to):
    """See `hit_point.find_hit_points`."""
    slot = path[5], path[6], share[0] * MINUS_LOG2E, share[1] * (_F(0.5) * MINUS_LOG2E)
    _find_hits(
        table.sums, table.beyond, table.places, table.end, table.unit, table.steps, slot, path[4], lanes,
        np.int64(at), np.int64(section), np.int64(to),
    )  # fmt: skip


def _finder(registers):
    """Finds slopes in windows of 16·registers voxels."""

    @intrinsic
    def find(_context, voxels, rows, path, numbers, lanes, hits, slopes):
        signed = getattr(voxels.dtype, "signed", True)

        def build(context, builder, signature, arguments):
            data = pointer(context, builder, signature.args[0], arguments[0])
            t_i, t_step, t_j, towards = (
                simd.everywhere(builder, builder.extract_value(arguments[2], n)) for n in range(4)
            )
            (x, step, low, high, last_cell, first, w_j, w_k, per_i, per_j, per_k, *borders) = (
                simd.everywhere(builder, builder.extract_value(arguments[3], n)) for n in range(17)
            )
            state = pointer(context, builder, signature.args[4], arguments[4])
            ahead = Tile(builder, state, arguments[5]).read(0)
            lane = simd.constant(builder, list(range(TILE)))
            place = x + lane * step
            cell = place.at_least(low).at_most(high).floor().at_most(last_cell)
            x = (place + (t_i + lane * t_step) * ahead - cell).at_least(0.0).at_most(1.0)
            y = (w_j + t_j * ahead).at_least(0.0).at_most(1.0)
            z = (w_k + towards * ahead).at_least(0.0).at_most(1.0)

            def between(one, other, weight):
                return one + weight * (other - one)

            def apart(place, least, most):
                return (place + 1.0).at_most(most) - (place - 1.0).at_least(least)

            def voxels_of(number, places):
                start = builder.extract_value(arguments[1], number)
                line = [
                    simd.load(builder, data, section_at(builder, start, TILE * register), signed=signed)
                    for register in range(registers)
                ]
                return [pick(builder, line, place - first) for place in places]

            least, most = borders[:2]
            cell_ends = cell, cell + 1.0
            neighbours = (cell - 1.0).at_least(least), *cell_ends, (cell + 2.0).at_most(most)
            own, along_i = [], []
            for number in range(4):
                before, here, after, behind = voxels_of(number, neighbours)
                own.append(between(here, after, x))
                along_i.append(between(after - before, behind - here, x))
            others = [between(*voxels_of(number, cell_ends), x) for number in range(4, 12)]
            found = Tile(builder, state, arguments[6])
            near, far = between(*along_i[:2], y), between(*along_i[2:], y)
            found.write(between(near, far, z) * per_i / apart(cell + x, least, most), 0)
            near = between(own[1] - others[0], others[1] - own[0], y)
            far = between(own[3] - others[2], others[3] - own[2], y)
            found.write(between(near, far, z) * per_j / apart(y, *borders[2:4]), TILE)
            low_j = between(own[2] - others[4], others[6] - own[0], z)
            high_j = between(own[3] - others[5], others[7] - own[1], z)
            found.write(between(low_j, high_j, y) * per_k / apart(z, *borders[4:]), 2 * TILE)
            return context.get_dummy_value()

        arguments = (
            voxels, types.UniTuple(types.int64, 12), types.UniTuple(types.float32, 7),
            types.UniTuple(types.float32, 17), lanes, types.int64, types.int64,
        )  # fmt: skip
        return types.void(*arguments), build

    return find


_narrow, _wide = _finder(2), _finder(4)


@inlined_kernel
def find_slopes_at(
    n, start, begin, end, cell, y, z, x, step, low, high, path, level, lanes, hits, slopes
):  # fmt: skip
    """See `hit_point.find_slopes_at`."""
    rows = rows_around(level, cell[0], cell[1], begin)
    numbers = (
        _F(x - start),
        _F(step),
        _F(max(low, np.float64(begin)) - start),
        _F(min(high, np.float64(end)) - start),
        _F(np.float64(end) - 1.0 - start),
        _F(np.float64(begin) - 1.0 - start),
        _F(y - np.float64(cell[0])),
        _F(z - np.float64(cell[1])),
        _F(level.per_voxel[0]),
        _F(level.per_voxel[1]),
        _F(level.per_voxel[2]),
        _F(-start),
        _F(level.columns - 1.0 - start),
        -_F(cell[0]),
        _F(level.needed.shape[0] - 1 - cell[0]),
        -_F(cell[1]),
        _F(level.needed.shape[1] - 1 - cell[1]),
    )
    if end - begin + np.uint64(3) <= np.uint64(NARROW):
        _narrow(level.voxels, rows, path, numbers, lanes, np.int64(hits), np.int64(slopes))
    else:
        _wide(level.voxels, rows, path, numbers, lanes, np.int64(hits), np.int64(slopes))
