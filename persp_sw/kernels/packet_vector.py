"""Packets on a processor with AVX-512: the functions of `packet_portable` as LLVM vectors.

Same arguments, same results but for roundings where operations fuse differently. A packet spans at most
`WINDOW` voxels of a row, so that the neighbours of all 16 pixels are found by permuting registers.
"""

import numpy as np
from llvmlite import ir

from .._jit import inlined_kernel, intrinsic, types
from . import lanes as simd
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
    TILE,
    VALUE,
)

WINDOW = 64  # most voxels of a row that one packet may span: four registers
NARROW = 32  # where two registers do

_NONE, _ONE = np.uint64(0), np.uint64(1)


def pointer(context, builder, array_type, array):
    """An array's first element."""
    return context.make_array(array_type)(context, builder, array).data


def word(number):
    """A 64-bit constant."""
    return ir.Constant(ir.IntType(64), int(number))


def section_at(builder, at, section):
    """Where the tile's `section` begins."""
    return builder.add(at, word(section))


def _sampler(registers, between):
    """The sampler for windows of 16·registers voxels, on a slice or between two."""

    @intrinsic
    def sample_window(
        _context, voxels, at_00, at_10, at_01, at_11, weight_j, weight_k, x, step, low, high, last_cell,
        begin, end, lanes, at,
    ):  # fmt: skip
        signed = getattr(voxels.dtype, "signed", True)

        def build(context, builder, signature, arguments):
            data = pointer(context, builder, signature.args[0], arguments[0])
            starts, scalars = arguments[1:5], arguments[5:14]
            state, at = pointer(context, builder, signature.args[14], arguments[14]), arguments[15]
            weight_j, weight_k, x, step, low, high, last_cell, begin, end = (
                simd.everywhere(builder, scalar) for scalar in scalars
            )

            def row(start, register):
                return simd.load(builder, data, section_at(builder, start, TILE * register), signed=signed)

            line = []
            for register in range(registers):
                above, below = row(starts[0], register), row(starts[1], register)
                value = above + weight_j * (below - above)
                if between:
                    above, below = row(starts[2], register), row(starts[3], register)
                    value = value + weight_k * (above + weight_j * (below - above) - value)
                line.append(value)
            x = (simd.constant(builder, list(range(TILE))) * step + x).at_least(low).at_most(high)
            cell = x.floor().at_most(last_cell)
            shown = builder.and_(cell >= begin, cell < end)
            left = pick(builder, line, cell - begin)
            right = pick(builder, line, cell - begin + 1.0)
            value = left + (x - cell) * (right - left)
            simd.store(builder, simd.where(shown, value, np.nan), state, at)
            return context.get_dummy_value()

        arguments = (voxels, *[types.int64] * 4, *[types.float32] * 9, lanes, types.int64)
        return types.void(*arguments), build

    return sample_window


def pick(builder, line, place):
    """line[place] of a row of 32 or 64 numbers in registers."""
    index = place.to_integers()
    result = simd.permute(builder, line[0], line[1], index)
    if len(line) == 4:
        result = simd.where(place < 32.0, result, simd.permute(builder, line[2], line[3], index))
    return result


_on_slice, _on_slice_wide = _sampler(2, False), _sampler(4, False)
_between, _between_wide = _sampler(2, True), _sampler(4, True)


@inlined_kernel
def sample(
    n, width, voxels, at_00, at_10, at_01, at_11, weight_j, weight_k, x, step, low, high, last_cell,
    begin, end, scratch, cells, lanes, at,
):  # fmt: skip
    """See `packet_portable.sample`."""
    if weight_k == np.float32(0.0):
        if width <= NARROW:
            _on_slice(
                voxels, at_00, at_10, at_01, at_11, weight_j, weight_k, x, step, low, high, last_cell, begin,
                end, lanes, at,
            )  # fmt: skip
        else:
            _on_slice_wide(
                voxels, at_00, at_10, at_01, at_11, weight_j, weight_k, x, step, low, high, last_cell, begin,
                end, lanes, at,
            )  # fmt: skip
    elif width <= NARROW:
        _between(
            voxels, at_00, at_10, at_01, at_11, weight_j, weight_k, x, step, low, high, last_cell, begin,
            end, lanes, at,
        )  # fmt: skip
    else:
        _between_wide(
            voxels, at_00, at_10, at_01, at_11, weight_j, weight_k, x, step, low, high, last_cell, begin,
            end, lanes, at,
        )  # fmt: skip


class Tile:
    """A tile's state in memory, and two samples laid under it."""

    def __init__(self, builder, state, at):
        self.builder, self.state, self.at = builder, state, at

    def read(self, section):
        """16 floats of the tile's `section`."""
        return simd.load(self.builder, self.state, section_at(self.builder, self.at, section))

    def write(self, values, section):
        """16 floats to the tile's `section`."""
        simd.store(self.builder, values, self.state, section_at(self.builder, self.at, section))

    def depth(self, extinction, near, far, share, slope):
        """−log2 e times the optical depth of what is left of [near, far] in the range of each ray, no less
        than −126; see `packet_portable.blend`.
        """
        begin, end = self.read(RAY_NEAR).at_least(near), self.read(RAY_FAR).at_most(far)
        length = (end - begin).at_least(0.0)
        share = share + slope * (begin + end)
        return (extinction * (self.read(LENGTH) * length) * share).at_least(-126.0)

    def opacity(self, y):
        """1 − 2^y."""
        shifted = y + float(ROUNDER)
        f = y - (shifted - float(ROUNDER))
        power = simd.power_of_two(self.builder, shifted)
        c1, c2, c3, c4, c5, c6, c7 = (float(c) for c in EXP2_COEFFICIENTS)
        # Pairs of terms side by side: half as long a chain of operations that wait for one another.
        square = f * f
        low, middle = c1 + c2 * f, c3 + c4 * f
        high = c5 + f * c6 + square * c7
        q = f * (low + square * (middle + square * high))
        return (1.0 - power) - power * q

    def blend(self, colours, alphas):
        """Lay two samples of these colours and opacities under what is there; whether all pixels are done.

        Both side by side, for each alone is one chain of operations that wait for one another.
        """
        accumulated = self.read(ALPHA)
        share = (1.0 - accumulated) * alphas[0]
        accumulated = accumulated + share
        share_2 = (1.0 - accumulated) * alphas[1]
        accumulated = accumulated + share_2
        for channel, section in enumerate((RED, GREEN, BLUE)):
            colour = self.read(section) + share * colours[0][channel] + share_2 * colours[1][channel]
            self.write(colour, section)
        self.write(accumulated, ALPHA)
        return simd.none(self.builder, accumulated < self.read(ENOUGH))


class Light:
    """What gradients change of one of two samples; where its sections begin in the tile's state."""

    def __init__(self, builder, state, at, number):
        self._tile = Tile(builder, state, section_at(builder, at, number * int(LIGHT_OF_SECOND)))

    @property
    def thicker(self):
        """The factor of the extinction."""
        return self._tile.read(THICKER)

    @property
    def skipped(self):
        """Rows of the table before those of the sample's magnitude."""
        return self._tile.read(SKIPPED)

    def on(self, colour):
        """Three channels as light makes them."""
        sections = zip(
            colour, (LIT_RED, LIT_GREEN, LIT_BLUE), (SHINE_RED, SHINE_GREEN, SHINE_BLUE), strict=True
        )
        return [channel * self._tile.read(lit) + self._tile.read(shine) for channel, lit, shine in sections]


def _blender(lit):
    """The blending of two samples, plain or lit."""

    @intrinsic
    def blend_two(_context, table, origin, scale, last, one, other, lanes, at, light):
        def build(context, builder, signature, arguments):
            table_rows = pointer(context, builder, signature.args[0], arguments[0])
            state, at = pointer(context, builder, signature.args[6], arguments[6]), arguments[7]
            origin, scale, last = (simd.everywhere(builder, scalar) for scalar in arguments[1:4])
            slots = [
                [simd.everywhere(builder, builder.extract_value(slot, n)) for n in range(4)]
                for slot in arguments[4:6]
            ]
            lights = [Light(builder, state, arguments[8], n) for n in range(2)]
            tile = Tile(builder, state, at)
            values = [tile.read(section) for section in (VALUE, SECOND)]
            entries = [((value - origin) * scale + 1.5).at_least(1.0).at_most(last) for value in values]
            if lit:
                entries = [e + light.skipped for e, light in zip(entries, lights, strict=True)]
            rows = [
                simd.where(value.is_number(), entry, 0.0).to_integers()
                for value, entry in zip(values, entries, strict=True)
            ]
            looked_up = [simd.look_up(builder, table_rows, row) for row in rows]
            colours = [colour[:3] for colour in looked_up]
            extinctions = [colour[3] for colour in looked_up]
            if lit:
                colours = [light.on(colour) for light, colour in zip(lights, colours, strict=True)]
                extinctions = [e * light.thicker for e, light in zip(extinctions, lights, strict=True)]
            alphas = [tile.opacity(tile.depth(e, *slots[n])) for n, e in enumerate(extinctions)]
            return tile.blend(colours, alphas)

        slot = types.UniTuple(types.float32, 4)
        arguments = (table, *[types.float32] * 3, slot, slot, lanes, types.int64, types.int64)
        return types.boolean(*arguments), build

    return blend_two


_blend, _blend_lit = _blender(False), _blender(True)


@inlined_kernel
def slot_of(slots, n):
    """A row of `slots`; its share scaled to what 2^y needs, and its slope to the sum of both ends."""
    slope = slots[n, 3] * (np.float32(0.5) * MINUS_LOG2E)
    return slots[n, 0], slots[n, 1], slots[n, 2] * MINUS_LOG2E, slope


@inlined_kernel
def blend(n, table, origin, scale, slots, scratch, cells, lanes, at):
    """See `packet_portable.blend`."""
    last = np.float32(table.shape[0] - 1)
    return _blend(table, origin, scale, last, slot_of(slots, _NONE), slot_of(slots, _ONE), lanes, at, 0)


@inlined_kernel
def blend_lit(n, table, origin, scale, last, slots, scratch, cells, lanes, at, light):
    """See `packet_portable.blend_lit`."""
    one, other = slot_of(slots, _NONE), slot_of(slots, _ONE)
    return _blend_lit(table, origin, scale, np.float32(last), one, other, lanes, at, np.int64(light))
