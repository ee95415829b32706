"""`packet_preintegrated_portable` on a processor with AVX-512, as LLVM vectors."""

import numpy as np

from .._jit import inlined_kernel, intrinsic, types
from . import lanes as simd
from .packet_vector import NARROW, Tile, pick, pointer, section_at, slot_of, word
from .state import FAR_ROW, RAY_FAR, RAY_NEAR, SECOND, SECOND_END, TILE, VALUE, VALUE_END

_NONE, _ONE = np.uint64(0), np.uint64(1)
_END = VALUE_END - VALUE


def _sampler(registers):
    """The sampler for windows of 16·registers voxels."""

    @intrinsic
    def sample_window(
        _context, voxels, at_00, at_10, at_01, at_11, weight_j, weight_k, x, step, low, high, last_cell,
        begin, end, path, origin, scale, lanes, at, section,
    ):  # fmt: skip
        signed = getattr(voxels.dtype, "signed", True)

        def build(context, builder, signature, arguments):
            data = pointer(context, builder, signature.args[0], arguments[0])
            starts, scalars = arguments[1:5], arguments[5:14]
            tile = Tile(builder, pointer(context, builder, signature.args[17], arguments[17]), arguments[18])
            weight_j, weight_k, x, step, low, high, last_cell, begin, end = (
                simd.everywhere(builder, scalar) for scalar in scalars
            )
            t_first, t_step, t_j, towards, plane, near, far = (
                simd.everywhere(builder, builder.extract_value(arguments[14], n)) for n in range(7)
            )
            origin, scale = (simd.everywhere(builder, scalar) for scalar in arguments[15:17])
            values, slopes, smallest, largest = [], [], [], []
            for register in range(registers):
                a, b, c, d = (
                    simd.load(builder, data, section_at(builder, start, TILE * register), signed=signed)
                    for start in starts
                )
                b_a, d_c = b - a, d - c
                front = a + weight_j * b_a
                along_k = c + weight_j * d_c - front
                values.append(front + weight_k * along_k)
                slopes.append(t_j * (b_a + weight_k * (d_c - b_a)) + towards * along_k)
                smallest.append(a.at_most(b).at_most(c.at_most(d)))
                largest.append(a.at_least(b).at_least(c.at_least(d)))
            lane = simd.constant(builder, list(range(TILE)))
            place = lane * step + x
            cell = place.at_least(low).at_most(high).floor().at_most(last_cell)
            shown = builder.and_(cell >= begin, cell < end)
            weight = place - cell

            def both(line):
                return pick(builder, line, cell - begin), pick(builder, line, cell - begin + 1.0)

            left, right = both(values)
            along_i = right - left
            value = left + weight * along_i
            left, right = both(slopes)
            slope = left + weight * (right - left) + (t_first + lane * t_step) * along_i
            left, right = both(smallest)
            least = left.at_most(right)
            left, right = both(largest)
            most = left.at_least(right)
            begins, ends = tile.read(RAY_NEAR).at_least(near), tile.read(RAY_FAR).at_most(far)
            one, two = value + slope * (begins - plane), value + slope * (ends - plane)

            def row(scalar):
                scalar = scalar.at_least(least).at_most(most)
                return (
                    ((scalar - origin) * scale + 1.5)
                    .at_least(float(-FAR_ROW))
                    .at_most(float(FAR_ROW))
                    .floor()
                )

            shown = builder.and_(shown, value.is_number())
            first = simd.where(shown, row(one.at_most(two)), np.nan)
            sample_at = Tile(builder, tile.state, builder.add(tile.at, arguments[19]))
            sample_at.write(first, 0)
            sample_at.write(row(one.at_least(two)) + 1.0, _END)
            return context.get_dummy_value()

        arguments = (
            voxels, *[types.int64] * 4, *[types.float32] * 9, types.UniTuple(types.float32, 7),
            *[types.float32] * 2, lanes, types.int64, types.int64,
        )  # fmt: skip
        return types.void(*arguments), build

    return sample_window


_narrow, _wide = _sampler(2), _sampler(4)


@inlined_kernel
def sample(
    n, width, voxels, at_00, at_10, at_01, at_11, weight_j, weight_k, x, step, low, high, last_cell,
    begin, end, path, table, scratch, cells, lanes, at, section,
):  # fmt: skip
    """See `packet_preintegrated_portable.sample`."""
    if width <= NARROW:
        _narrow(
            voxels, at_00, at_10, at_01, at_11, weight_j, weight_k, x, step, low, high, last_cell, begin, end,
            path, table.origin, table.scale, lanes, at, section,
        )  # fmt: skip
    else:
        _wide(
            voxels, at_00, at_10, at_01, at_11, weight_j, weight_k, x, step, low, high, last_cell, begin, end,
            path, table.origin, table.scale, lanes, at, section,
        )  # fmt: skip


@intrinsic
def _blend(_context, sums, beyond, end, unit, one, other, lanes, at):
    def build(context, builder, signature, arguments):
        entries = pointer(context, builder, signature.args[0], arguments[0])
        tile = Tile(builder, pointer(context, builder, signature.args[6], arguments[6]), arguments[7])
        rest = pointer(context, builder, signature.args[1], arguments[1])
        end, unit = (simd.everywhere(builder, scalar) for scalar in arguments[2:4])
        slots = [
            [simd.everywhere(builder, builder.extract_value(slot, n)) for n in range(4)]
            for slot in arguments[4:6]
        ]
        lower, upper = (
            [
                simd.everywhere(builder, builder.load(builder.gep(rest, [word(4 * side + n)])))
                for n in range(4)
            ]
            for side in range(2)
        )
        colours = []
        for section, end_section in ((VALUE, VALUE_END), (SECOND, SECOND_END)):
            first, after = tile.read(section), tile.read(end_section)
            there = first.is_number()
            first, after = simd.where(there, first, 1.0), simd.where(there, after, 1.0)
            rows = [row.at_least(1.0).at_most(end).to_integers() for row in (first, after)]
            below = (after.at_most(1.0) - first).at_least(0.0)
            above = (after - first.at_least(end)).at_least(0.0)
            *colour, sum_ = (
                inside + below * lower[n] + above * upper[n]
                for n, inside in enumerate(simd.look_up_differences(builder, entries, *rows))
            )
            count, extinction = (after - first).at_least(1.0), sum_.at_least(1.0)
            reciprocal = 1.0 / (extinction * count)  # one division for both quotients
            weight = count * reciprocal
            mean = sum_ * (extinction * reciprocal)
            colours.append([*(channel * weight for channel in colour), mean * unit])
        return tile.blend(colours, slots)

    slot = types.UniTuple(types.float32, 4)
    return types.boolean(sums, beyond, types.float32, types.float32, slot, slot, lanes, types.int64), build


@inlined_kernel
def blend(n, table, slots, scratch, cells, lanes, at):
    """See `packet_preintegrated_portable.blend`."""
    end = np.float32(table.sums.shape[0] - 1)
    return _blend(
        table.sums, table.beyond, end, table.unit, slot_of(slots, _NONE), slot_of(slots, _ONE), lanes, at
    )
