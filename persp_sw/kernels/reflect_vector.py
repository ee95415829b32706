"""`reflect` on a processor with AVX-512, as LLVM vectors."""

import numpy as np

from .._jit import intrinsic, lean_kernel, types
from . import lanes as simd
from . import phong
from .packet_lit_vector import power_of
from .packet_vector import Tile, pointer
from .reflect import LEAST
from .state import (
    COSINE,
    DIRECTION,
    LIT_BLUE,
    LIT_GREEN,
    LIT_RED,
    NORMAL,
    SHINE_BLUE,
    SHINE_GREEN,
    SHINE_RED,
    SQUARE,
    TILE,
    TINT,
)

__all__ = ["reflect"]


def _look_up(builder, texels, half, direction):
    """See `reflect._look_up`: ([r, g, b], |x| + |y| + |z|)."""
    x, y, z = direction
    size_x, size_y = x.absolute(), y.absolute()
    total = size_x + size_y + z.absolute()
    per = half / total.at_least(float(LEAST))
    along_x, along_y = size_x * per, size_y * per
    folded = z < 0.0
    a, b = simd.where(folded, half - along_y, along_x), simd.where(folded, half - along_x, along_y)
    i, j = (along.floor().at_least(0.0).at_most(half - 1.0) for along in (a, b))
    a, b = a - i, b - j
    # Whole numbers below 2^24, which float32 holds.
    width = half * 2.0 + 1.0
    unit = simd.constant(builder, [1.0] * TILE)
    right, down = simd.where(x < 0.0, unit * -1.0, unit), simd.where(y < 0.0, width * -1.0, width)
    corner = half * (width + 1.0) + right * i + down * j
    beside, below = corner + right, corner + down
    rest = 1.0 - a - b
    inner = rest >= 0.0
    a, b = simd.where(inner, a, 1.0 - b), simd.where(inner, b, 1.0 - a)
    rest = rest.absolute()
    rows = simd.where(inner, corner, beside + down), beside, below
    one, two, three = (simd.look_up(builder, texels, row.to_integers())[:3] for row in rows)
    return [rest * r + a * s + b * t for r, s, t in zip(one, two, three, strict=True)], total


def _add(tile, sections, colour, strength):
    for section, part in zip(sections, colour, strict=True):
        tile.write(tile.read(section) + strength * part, section)


def _vector(tile, section):
    return [tile.read(int(section) + TILE * axis) for axis in range(3)]


def _arguments(context, builder, signature, arguments):
    """From which texel on a map is, its half, and the tiles of the light and of the sample."""
    numbers, first, half, lanes, light, sample = arguments[:6]
    texels = builder.gep(pointer(context, builder, signature.args[0], numbers), [first])
    state = pointer(context, builder, signature.args[3], lanes)
    room, mine = Tile(builder, state, light), Tile(builder, state, builder.add(light, sample))
    return texels, simd.everywhere(builder, half), room, mine


@intrinsic
def _diffuse(_context, numbers, first, half, lanes, light, sample):
    def build(context, builder, signature, arguments):
        texels, half, room, mine = _arguments(context, builder, signature, arguments)
        colour, length = _look_up(builder, texels, half, _vector(room, NORMAL))
        _add(mine, (LIT_RED, LIT_GREEN, LIT_BLUE), colour, length * room.read(TINT))
        return context.get_dummy_value()

    arguments = numbers, types.int64, types.float32, lanes, types.int64, types.int64
    return types.void(*arguments), build


@intrinsic
def _mirrored(_context, numbers, first, half, lanes, light, sample, power):
    def build(context, builder, signature, arguments):
        texels, half, room, mine = _arguments(context, builder, signature, arguments)
        cosine, square = room.read(COSINE), room.read(SQUARE)
        twice = cosine + cosine
        axes = zip(_vector(room, NORMAL), _vector(room, DIRECTION), strict=True)
        colour, _ = _look_up(builder, texels, half, [twice * n + square * d for n, d in axes])
        strength = power_of(builder, square, simd.everywhere(builder, arguments[6]))
        _add(mine, (SHINE_RED, SHINE_GREEN, SHINE_BLUE), colour, simd.where(cosine > 0.0, strength, 0.0))
        return context.get_dummy_value()

    arguments = numbers, types.int64, types.float32, lanes, types.int64, types.int64, types.float32
    return types.void(*arguments), build


@lean_kernel
def reflect(n, numbers, lanes, light, sample):
    """See `reflect.reflect`."""
    half, mirrored = numbers[phong.HALF_DIFFUSE], numbers[phong.HALF_MIRRORED]
    at, sample = np.int64(light), np.int64(sample)
    first = np.int64(phong.NUMBERS)
    _diffuse(numbers, first, half, lanes, at, sample)
    if mirrored > np.float32(0.0):
        width = 2 * np.int64(half) + 1
        _mirrored(numbers, first + 4 * width * width, mirrored, lanes, at, sample, numbers[phong.POWER])
