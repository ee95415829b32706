"""`packet_preintegrated_portable` on a processor with AVX-512, as LLVM vectors."""

import numpy as np

from .._jit import inlined_kernel, intrinsic, types
from . import lanes as simd
from .packet_preintegrated_portable import EDGE, STEPS
from .packet_vector import NARROW, Light, Tile, pick, pointer, section_at, slot_of, word
from .state import (
    FAR_ROW,
    MINUS_LN2,
    RAY_FAR,
    RAY_NEAR,
    SECOND,
    SECOND_END,
    THIN,
    TILE,
    VALUE,
    VALUE_END,
)

_NONE, _ONE = np.uint64(0), np.uint64(1)
_END = VALUE_END - VALUE
_EDGE = float(EDGE)


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
            rising = two >= one
            lower, upper = row(one.at_most(two)), row(one.at_least(two)) + 1.0
            sample_at = Tile(builder, tile.state, builder.add(tile.at, arguments[19]))
            sample_at.write(simd.where(shown, simd.where(rising, lower, upper), np.nan), 0)
            sample_at.write(simd.where(rising, upper, lower), _END)
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


class Piece:
    """One pre-integrated sample of a tile, from the rows it left to its extinction."""

    def __init__(self, builder, tile, entries, beyond, end, sections):
        near, far = (tile.read(section) for section in sections)
        there = near.is_number()
        near, far = simd.where(there, near, 1.0), simd.where(there, far, 1.0)
        rising = far >= near
        lowest, highest = near.at_most(far), near.at_least(far)
        below = (highest.at_most(1.0) - lowest).at_least(0.0)
        above = (highest - lowest.at_least(end)).at_least(0.0)
        # What lies beyond the table, where the piece begins and where it ends.
        self.before = [simd.where(rising, low, high) for low, high in zip(*beyond, strict=True)]
        self.behind = [simd.where(rising, high, low) for low, high in zip(*beyond, strict=True)]
        self.ahead = simd.where(rising, below, above) * self.before[3]
        self.rest = simd.where(rising, above, below) * self.behind[3]
        self.rows = [row.at_least(1.0).at_most(end).to_integers() for row in (near, far)]
        first, last = (simd.look_up_column(builder, entries, row, 3) for row in self.rows)
        self.sign = simd.where(rising, simd.constant(builder, [1.0] * TILE), -1.0)
        self.start = simd.to_floats(builder, first)
        self.inside = self.sign * simd.to_floats(builder, builder.sub(last, first))
        self.total = self.ahead + self.inside + self.rest
        self.count = (highest - lowest).at_least(1.0)
        self.rising, self.builder, self.tile, self.entries, self.end = rising, builder, tile, entries, end

    def colour_and_opacity(self, slot, unit, steps, light=None):
        """Three channels, not premultiplied, and α; as `light` makes them."""
        builder, sign, inside = self.builder, self.sign, self.inside
        extinction = self.total * unit / self.count
        y = self.tile.depth(extinction * light.thicker if light else extinction, *slot)
        alpha = self.tile.opacity(y)
        wanted = _seen_part(y * float(MINUS_LN2), alpha) * self.total
        ahead = self.ahead.at_most(wanted)
        within = wanted - ahead
        at = (self.start + sign * within) * steps
        step = simd.where(self.rising, (at + _EDGE).floor() + 1.0, -1.0 - (_EDGE - at).floor())
        step = step.at_least(0.0).at_most(float(STEPS)) + (self.end + 1.0)
        whole = within >= inside - 1.0 / steps
        row = simd.select(builder, whole, self.rows[1], step.to_integers())
        *colour, amount = (
            sign * d for d in simd.look_up_differences(builder, self.entries, self.rows[0], row)
        )
        rest = simd.where(whole, (within - inside).at_least(0.0), 0.0)
        reciprocal = 1.0 / (ahead + amount + rest).at_least(1.0)
        colour = [
            (ahead * self.before[n] + channel + rest * self.behind[n]) * reciprocal
            for n, channel in enumerate(colour)
        ]
        return light.on(colour) if light else colour, alpha


def _seen_part(depth, alpha):
    """See `packet_preintegrated_portable`."""
    thick = 2.0 * (alpha - depth * (1.0 - alpha)) / (depth * alpha)
    return simd.where(depth < float(THIN), 1.0 - depth * (1.0 / 6.0), thick)


def edges(context, builder, beyond_type, beyond):
    """The first and the last row of a table, for what lies beyond: [side][column], in all lanes."""
    data = pointer(context, builder, beyond_type, beyond)
    columns = [
        simd.everywhere(builder, builder.load(builder.gep(data, [word(column)]))) for column in range(8)
    ]
    return columns[:4], columns[4:]


def _blender(lit):
    """The blending of two samples, plain or lit."""

    @intrinsic
    def blend_two(_context, sums, beyond, end, unit, steps, one, other, lanes, at, light):
        def build(context, builder, signature, arguments):
            entries = pointer(context, builder, signature.args[0], arguments[0])
            state = pointer(context, builder, signature.args[7], arguments[7])
            tile = Tile(builder, state, arguments[8])
            lights = [Light(builder, state, arguments[9], n) if lit else None for n in range(2)]
            beyond = edges(context, builder, signature.args[1], arguments[1])
            end, unit, steps = (simd.everywhere(builder, scalar) for scalar in arguments[2:5])
            pieces = [
                Piece(builder, tile, entries, beyond, end, sections)
                for sections in ((VALUE, VALUE_END), (SECOND, SECOND_END))
            ]

            def lay():
                slots = [
                    [simd.everywhere(builder, builder.extract_value(slot, n)) for n in range(4)]
                    for slot in arguments[5:7]
                ]
                both = (
                    piece.colour_and_opacity(slot, unit, steps, light)
                    for piece, slot, light in zip(pieces, slots, lights, strict=True)
                )
                return tile.blend(*zip(*both, strict=True))

            # Packets in cells that may be seen, but see nothing themselves, end here: 0.89 of the time.
            return simd.where_any(builder, (pieces[0].total + pieces[1].total) > 0.0, lay)

        slot = types.UniTuple(types.float32, 4)
        arguments = (sums, beyond, *[types.float32] * 3, slot, slot, lanes, types.int64, types.int64)
        return types.boolean(*arguments), build

    return blend_two


_blend, _blend_lit = _blender(False), _blender(True)


@inlined_kernel
def blend(n, table, slots, scratch, cells, lanes, at):
    """See `packet_preintegrated_portable.blend`."""
    return _blend(
        table.sums, table.beyond, table.end, table.unit, table.steps, slot_of(slots, _NONE),
        slot_of(slots, _ONE), lanes, at, 0,
    )  # fmt: skip


@inlined_kernel
def blend_lit(n, table, slots, scratch, cells, lanes, at, light):
    """See `packet_preintegrated_portable.blend_lit`."""
    return _blend_lit(
        table.sums, table.beyond, table.end, table.unit, table.steps, slot_of(slots, _NONE),
        slot_of(slots, _ONE), lanes, at, np.int64(light),
    )  # fmt: skip
