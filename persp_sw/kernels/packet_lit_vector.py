"""`packet_lit_portable` and `phong.shade` on a processor with AVX-512, as LLVM vectors."""

import numpy as np

from .._jit import inlined_kernel, intrinsic, types
from . import lanes as simd
from . import phong
from .packet_lit_portable import rows_at, shows_integrated
from .packet_vector import NARROW, Tile, pick, pointer, section_at, word
from .phong import LIGHT_COLUMNS
from .state import (
    ALPHA,
    COSINE,
    DIRECTION,
    ENOUGH,
    EXP2_COEFFICIENTS,
    LEFT,
    LENGTH,
    LIT_BLUE,
    LIT_GREEN,
    LIT_RED,
    NORMAL,
    ROUNDER,
    SHINE_BLUE,
    SHINE_GREEN,
    SHINE_RED,
    SKIPPED,
    SQUARE,
    THICKER,
    TILE,
    TINT,
)

__all__ = ["add_light", "find_slopes", "shade", "shows_classified", "shows_integrated"]

_F = np.float32


@intrinsic
def _shows(_context, seen, last, origin, scale, lanes, at, section):
    def build(context, builder, signature, arguments):
        flags = pointer(context, builder, signature.args[0], arguments[0])
        last, origin, scale = (simd.everywhere(builder, scalar) for scalar in arguments[1:4])
        tile = Tile(builder, pointer(context, builder, signature.args[4], arguments[4]), arguments[5])
        value = Tile(builder, tile.state, builder.add(arguments[5], arguments[6])).read(0)
        entry = ((value - origin) * scale + 1.5).at_least(1.0).at_most(last)
        goes_on = builder.and_(value.is_number(), tile.read(ALPHA) < tile.read(ENOUGH))
        return simd.any_set(builder, flags, simd.where(goes_on, entry, 0.0).to_integers())

    arguments = (seen, *[types.float32] * 3, lanes, types.int64, types.int64)
    return types.boolean(*arguments), build


@inlined_kernel
def shows_classified(n, table, cells, lanes, at, section):
    """See `packet_lit_portable.shows_classified`."""
    last = _F(table.seen.shape[0] - 1)
    return _shows(table.seen, last, table.origin, table.scale, lanes, np.int64(at), np.int64(section))


def _finder(registers, between):
    """Finds slopes in windows of 16·registers voxels, of rows on slices or between two."""

    @intrinsic
    def find(_context, voxels, rows, numbers, lanes, at):
        signed = getattr(voxels.dtype, "signed", True)

        def build(context, builder, signature, arguments):
            data = pointer(context, builder, signature.args[0], arguments[0])
            tile = Tile(builder, pointer(context, builder, signature.args[3], arguments[3]), arguments[4])
            x, step, low, high, reach, least, most, per_x, per_y, per_z, first = (
                simd.everywhere(builder, builder.extract_value(arguments[2], n)) for n in range(11)
            )

            def line(number):
                """The voxels of a row, interpolated between scanlines and slices."""
                found = builder.extract_value(arguments[1], number)
                starts = [builder.extract_value(found, n) for n in range(4)]
                weight_j, weight_k = (
                    simd.everywhere(builder, builder.extract_value(found, n)) for n in (4, 5)
                )
                result = []
                for register in range(registers):
                    above, below, *others = (
                        simd.load(builder, data, section_at(builder, start, TILE * register), signed=signed)
                        for start in (starts if between else starts[:2])
                    )
                    value = above + weight_j * (below - above)
                    if between:
                        above, below = others
                        value = value + weight_k * (above + weight_j * (below - above) - value)
                    result.append(value)
                return result

            def between_lines(one, other):
                return [b - a for a, b in zip(line(one), line(other), strict=True)]

            def look_up(values, cell, weight):
                left, right = pick(builder, values, cell - first), pick(builder, values, cell - first + 1.0)
                return left + weight * (right - left)

            def place_of(x):
                cell = x.floor().at_most(most - 1.0)
                return cell, x - cell

            x = (simd.constant(builder, list(range(TILE))) * step + x).at_least(low).at_most(high)
            near, far = (x - reach).at_least(least), (x + reach).at_most(most)
            along = line(0)
            difference = look_up(along, *place_of(far)) - look_up(along, *place_of(near))
            tile.write(difference * per_x / (far - near), 0)
            here = place_of(x)
            tile.write(look_up(between_lines(1, 2), *here) * per_y, TILE)
            tile.write(look_up(between_lines(3, 4), *here) * per_z, 2 * TILE)
            return context.get_dummy_value()

        row = types.Tuple([types.int64] * 4 + [types.float32] * 2)
        arguments = (
            voxels, types.UniTuple(row, 5), types.UniTuple(types.float32, 11), lanes, types.int64
        )  # fmt: skip
        return types.void(*arguments), build

    return find


_on_slices, _on_slices_wide = _finder(2, False), _finder(4, False)
_between, _between_wide = _finder(2, True), _finder(4, True)


@inlined_kernel
def find_slopes(
    n, start, begin, first, last, y, z, reach, sides, x, step, low, high, level, scratch, cells, lanes, slopes
):  # fmt: skip
    """See `packet_lit_portable.find_slopes`."""
    y_low, y_high, z_low, z_high = sides
    ahead = np.int64(begin - first)
    rows = (
        rows_at(level, y, z, begin, ahead),
        rows_at(level, y_low, z, begin, ahead),
        rows_at(level, y_high, z, begin, ahead),
        rows_at(level, y, z_low, begin, ahead),
        rows_at(level, y, z_high, begin, ahead),
    )
    numbers = (
        _F(x - start),
        _F(step),
        _F(low - start),
        _F(high - start),
        _F(reach),
        _F(-start),
        _F(level.columns - 1.0 - start),
        _F(level.per_voxel[0]),
        _F(level.per_voxel[1] / (y_high - y_low)),
        _F(level.per_voxel[2] / (z_high - z_low)),
        _F(np.float64(first) - start),
    )
    at = np.int64(slopes)
    narrow = last - first < np.uint64(NARROW)
    if z == np.floor(z) and reach == np.floor(reach):
        if narrow:
            _on_slices(level.voxels, rows, numbers, lanes, at)
        else:
            _on_slices_wide(level.voxels, rows, numbers, lanes, at)
    elif narrow:
        _between(level.voxels, rows, numbers, lanes, at)
    else:
        _between_wide(level.voxels, rows, numbers, lanes, at)


def power_of(builder, x, power):
    """See `phong.power_of`."""
    exponent, mantissa = x.exponent_and_mantissa()
    large = mantissa > float(phong.ROOT2)
    mantissa = simd.where(large, mantissa * 0.5, mantissa)
    exponent = simd.where(large, exponent + 1.0, exponent)
    s = (mantissa - 1.0) / (mantissa + 1.0)
    square = s * s
    l1, l3, l5, l7 = (float(c) for c in phong.LOG2_COEFFICIENTS)
    y = power * (exponent + s * (l1 + square * (l3 + square * (l5 + square * l7))))
    y = y.at_least(-126.0).at_most(126.0)
    shifted = y + float(ROUNDER)
    f = y - (shifted - float(ROUNDER))
    q = f * 0.0
    for coefficient in reversed(EXP2_COEFFICIENTS):
        q = (q + float(coefficient)) * f
    return simd.where(x > 0.0, simd.power_of_two(builder, shifted) * (q + 1.0), 0.0)


def _numbers(context, builder, array_type, array, count):
    """The first numbers of a float32 array, each in all lanes."""
    data = pointer(context, builder, array_type, array)
    return [simd.everywhere(builder, builder.load(builder.gep(data, [word(n)]))) for n in range(count)]


_LIT, _SHINE = (LIT_RED, LIT_GREEN, LIT_BLUE), (SHINE_RED, SHINE_GREEN, SHINE_BLUE)


@intrinsic
def _shade_rays(_context, numbers, ray, slopes, lanes, at, light, sample):
    def build(context, builder, signature, arguments):
        n = _numbers(context, builder, signature.args[0], arguments[0], phong.NUMBERS)
        m, a, colours = (
            n[at:] for at in (phong.NORMAL_FROM_SLOPES, phong.WORLD_FROM_STANDARD, phong.HEADLIGHT)
        )
        t_first, t_step, t_j, sign = (
            simd.everywhere(builder, builder.extract_value(arguments[1], part)) for part in range(4)
        )
        state = pointer(context, builder, signature.args[3], arguments[3])
        at, light = arguments[4], arguments[5]
        gradient = Tile(builder, state, arguments[2])
        g = [gradient.read(TILE * axis) for axis in range(3)]
        there = (g[0] + g[1] + g[2]).is_number()
        g = [simd.where(there, slope, 0.0) for slope in g]
        normal = [m[3 * r] * g[0] + m[3 * r + 1] * g[1] + m[3 * r + 2] * g[2] for r in range(3)]
        square = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]
        per_length = 1.0 / Tile(builder, state, at).read(LENGTH)
        t = [simd.constant(builder, list(range(TILE))) * t_step + t_first, t_j, sign]
        unit = 1.0 / (square + n[phong.FAINT]).square_root()
        cosine = (g[0] * t[0] + g[1] * t[1] + g[2] * t[2]) * per_length * unit
        flipped = builder.and_(cosine < 0.0, n[phong.TWO_SIDED] > 0.0)
        unit = simd.where(flipped, unit * -1.0, unit)
        cosine = simd.where(flipped, cosine * -1.0, cosine)
        room = Tile(builder, state, light)
        room.write(cosine, COSINE)
        fading = square * unit * unit
        room.write(fading, SQUARE)
        for r in range(3):
            along = a[3 * r] * t[0] + a[3 * r + 1] * t[1] + a[3 * r + 2] * t[2]
            room.write(normal[r] * unit, int(NORMAL) + TILE * r)
            room.write(along * per_length, int(DIRECTION) + TILE * r)
        magnitude = square.square_root()
        weight = ((magnitude - n[phong.LOW]) * n[phong.PER_WEIGHT]).at_least(0.0).at_most(1.0)
        mine = Tile(builder, state, builder.add(light, arguments[6]))
        mine.write(1.0 - n[phong.THICKENED] + n[phong.THICKENED] * weight, THICKER)
        skipped = (magnitude * n[phong.PER_MAGNITUDE] + 0.5).floor().at_most(n[phong.MAGNITUDES] - 1.0)
        mine.write(skipped * n[phong.ROWS], SKIPPED)
        tint = 1.0 - n[phong.COLOURED] + n[phong.COLOURED] * weight
        room.write(tint, TINT)
        facing = cosine.at_least(0.0)
        blinn = n[phong.BLINN] > 0.0
        mirrored = simd.where(blinn, facing, 2.0 * facing * facing - fading)
        highlight = power_of(builder, mirrored, n[phong.POWER])
        for channel in range(3):
            mine.write((n[phong.OWN] + facing * colours[channel]) * tint, _LIT[channel])
            mine.write(highlight * colours[3 + channel], _SHINE[channel])
        return context.get_dummy_value()

    arguments = (
        numbers, types.UniTuple(types.float32, 4), types.int64, lanes, *[types.int64] * 3,
    )  # fmt: skip
    return types.void(*arguments), build


@intrinsic
def _add_one(_context, numbers, lights, number, lanes, light, sample):
    def build(context, builder, signature, arguments):
        n = _numbers(context, builder, signature.args[0], arguments[0], phong.NUMBERS)
        data = pointer(context, builder, signature.args[1], arguments[1])
        data = builder.gep(data, [builder.mul(arguments[2], word(LIGHT_COLUMNS))])
        towards, colours = [], []
        for column in range(phong.SHADOW):
            value = simd.everywhere(builder, builder.load(builder.gep(data, [word(column)])))
            (towards if column < phong.DIFFUSE else colours).append(value)
        state = pointer(context, builder, signature.args[3], arguments[3])
        room = Tile(builder, state, arguments[4])
        cosine = room.read(COSINE)

        def along(section):
            x, y, z = (room.read(int(section) + TILE * r) * towards[r] for r in range(3))
            return x + y + z

        facing, away = along(NORMAL), along(DIRECTION)
        half_way = (facing + cosine) / (2.0 - 2.0 * away + float(phong.SMALL)).square_root()
        mirrored = simd.where(
            n[phong.BLINN] > 0.0, half_way, 2.0 * cosine * facing + room.read(SQUARE) * away
        )
        mirrored = simd.where(cosine > 0.0, mirrored, 0.0)
        left = room.read(LEFT)
        highlight = left * power_of(builder, mirrored, n[phong.POWER])
        facing = left * facing.at_least(0.0) * room.read(TINT)
        mine = Tile(builder, state, builder.add(arguments[4], arguments[5]))
        for channel in range(3):
            mine.write(mine.read(_LIT[channel]) + facing * colours[channel], _LIT[channel])
            mine.write(mine.read(_SHINE[channel]) + highlight * colours[3 + channel], _SHINE[channel])
        return context.get_dummy_value()

    arguments = (numbers, lights, types.int64, lanes, types.int64, types.int64)
    return types.void(*arguments), build


@inlined_kernel
def shade(n, ray, slopes, shades, lanes, at, light, sample):
    """See `phong.shade`."""
    _shade_rays(
        shades.numbers, ray, np.int64(slopes), lanes, np.int64(at), np.int64(light), np.int64(sample),
    )  # fmt: skip


@inlined_kernel
def add_light(n, number, shades, lanes, light, sample):
    """See `phong.add_light`."""
    _add_one(shades.numbers, shades.lights, number, lanes, np.int64(light), np.int64(sample))
