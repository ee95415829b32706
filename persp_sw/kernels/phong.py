"""Phong's model for the 16 pixels of a packet; see `optics.lighting.Lighting` for what it is.

With g the differences per voxel along the standard axes, t = (t_i, t_j, sign) the ray, A the linear part of
world_from_standard and ℓ = ‖A·t‖: the gradient in the world is A⁻ᵀ·g, and its component along the ray
A⁻ᵀ·g · A·t / ℓ = g·t / ℓ. V = −A·t / ℓ leads to the eye, so N·V = g·t / (ℓ·√(|A⁻ᵀ·g|² + ε²)).
"""

from typing import NamedTuple

import numpy as np

from .._jit import exponent_and_mantissa, inlined_kernel, power_of_two
from .state import (
    COSINE,
    DIRECTION,
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

_F = np.float32
_LINE = np.uint64(TILE)
_C1, _C2, _C3, _C4, _C5, _C6, _C7 = EXP2_COEFFICIENTS
SMALL = _F(1e-12)  # a light straight behind has no half-way direction
ROOT2 = _F(1.4142135623730951)
# log2 m = 2 / ln 2 · artanh((m − 1) / (m + 1)), by its series.
LOG2_COEFFICIENTS = tuple(_F(2.8853900817779268 / n) for n in (1, 3, 5, 7))
_L1, _L3, _L5, _L7 = LOG2_COEFFICIENTS

# `Shade.numbers`.
(
    REACH, OWN, POWER, TWO_SIDED, BLINN, FAINT, LOW, PER_WEIGHT, THICKENED, COLOURED, PER_MAGNITUDE, ROWS,
    MAGNITUDES, PER_SHADOW, HALF_DIFFUSE, HALF_MIRRORED,
) = range(16)  # fmt: skip
SHADOW_SIZE, HEADLIGHT, NORMAL_FROM_SLOPES, WORLD_FROM_STANDARD, NUMBERS = 16, 19, 25, 34, 43
# Columns of `Shade.lights`.
DIFFUSE, SPECULAR, SHADOW, START, LIGHT_COLUMNS = 3, 6, 9, 10, 13


class Shade(NamedTuple):
    """What gradients do to a transfer function's colours and extinction.

    numbers
        float32 (NUMBERS …,): voxels to the neighbours; what colours shine with by themselves; the highlights'
        power; whether normals turn towards the eye, whether highlights are Blinn's; ε²; a modulation's lowest
        magnitude, weight a magnitude, and its shares of extinction and colour; a magnitude of the table a
        magnitude, the table's rows for each of them, and how many there are; places of shadows a voxel; half
        the cells along an edge of the maps of diffuse and of mirrored light, 0 where there is none. From
        SHADOW_SIZE: shadows' places along i, j and k. From HEADLIGHT: diffuse and specular colour of the
        light at the eye. From NORMAL_FROM_SLOPES and WORLD_FROM_STANDARD, row by row: −A⁻ᵀ, and A. From
        NUMBERS: the maps' texels, see `reflect`. All in one array, for each that is passed costs every packet
        some nanoseconds.
    lights
        float32 (n, LIGHT_COLUMNS), of the lights that are in no map: direction towards a light, world, its
        diffuse and specular colour, the number of its shadows or −1, and from where they count, voxels along
        i, j and k.
    shadows
        How much is left of lights that cast shadows, 65535 for all: uint16, [light, j, k, i] in one line,
        `encode.PADDING` before and after it.
    """

    numbers: np.ndarray
    lights: np.ndarray
    shadows: np.ndarray


@inlined_kernel
def power_of(x, power):
    """x^power for x ≤ 1, as float32 can; 0 for x ≤ 0."""
    exponent, mantissa = exponent_and_mantissa(x)
    large = mantissa > ROOT2
    mantissa = mantissa * _F(0.5) if large else mantissa
    exponent = exponent + _F(1.0) if large else exponent
    s = (mantissa - _F(1.0)) / (mantissa + _F(1.0))
    square = s * s
    y = power * (exponent + s * (_L1 + square * (_L3 + square * (_L5 + square * _L7))))
    y = y if y > _F(-126.0) else _F(-126.0)
    y = y if y < _F(126.0) else _F(126.0)
    shifted = y + ROUNDER
    f = y - (shifted - ROUNDER)
    q = f * (_C1 + f * (_C2 + f * (_C3 + f * (_C4 + f * (_C5 + f * (_C6 + f * _C7))))))
    result = power_of_two(shifted) * (_F(1.0) + q)
    return result if x > _F(0.0) else _F(0.0)


@inlined_kernel
def shade(n, ray, slopes, shades, lanes, at, light, sample):
    """Light's sections of one sample from its gradient, with the light at the eye.

    Parameters
    ----------
    ray
        float32 (t_first, t_step, t_j, sign): the rays in standard space are (t_first + l·t_step, t_j, sign).
    slopes
        Where in `lanes` the differences per voxel along i, j and k stand; NaN where there is none.
    light, sample
        Where the light's sections begin, and the sample's among them.
    """
    t_first, t_step, t_j, sign = ray
    numbers = shades.numbers
    matrix, frame = numbers[NORMAL_FROM_SLOPES:], numbers[WORLD_FROM_STANDARD:]
    m00, m01, m02 = matrix[0], matrix[1], matrix[2]
    m10, m11, m12 = matrix[3], matrix[4], matrix[5]
    m20, m21, m22 = matrix[6], matrix[7], matrix[8]
    a0, a1, a2 = frame[0], frame[3], frame[6]
    b0 = frame[1] * t_j + frame[2] * sign
    b1 = frame[4] * t_j + frame[5] * sign
    b2 = frame[7] * t_j + frame[8] * sign
    faint, two_sided = numbers[FAINT], numbers[TWO_SIDED] != _F(0.0)
    low, per_weight = numbers[LOW], numbers[PER_WEIGHT]
    thickened, coloured = numbers[THICKENED], numbers[COLOURED]
    per_magnitude, rows, last = numbers[PER_MAGNITUDE], numbers[ROWS], numbers[MAGNITUDES] - _F(1.0)
    own = numbers[OWN]
    normals, directions, cosines = light + NORMAL, light + DIRECTION, light + COSINE
    squares, tints = light + SQUARE, light + TINT
    mine = light + sample
    for l in range(np.uint64(n)):  # noqa: E741
        g_i, g_j, g_k = lanes[slopes + l], lanes[slopes + _LINE + l], lanes[slopes + _LINE + _LINE + l]
        is_number = g_i + g_j + g_k == g_i + g_j + g_k
        g_i, g_j, g_k = (g_i, g_j, g_k) if is_number else (_F(0.0), _F(0.0), _F(0.0))
        n_0 = m00 * g_i + m01 * g_j + m02 * g_k
        n_1 = m10 * g_i + m11 * g_j + m12 * g_k
        n_2 = m20 * g_i + m21 * g_j + m22 * g_k
        square = n_0 * n_0 + n_1 * n_1 + n_2 * n_2
        per_length = _F(1.0) / lanes[at + LENGTH + l]
        t_i = t_first + _F(l) * t_step
        d_0, d_1, d_2 = (
            (a0 * t_i + b0) * per_length,
            (a1 * t_i + b1) * per_length,
            (a2 * t_i + b2) * per_length,
        )
        unit = _F(1.0) / np.sqrt(square + faint)
        lanes[squares + l] = square * unit * unit
        cosine = (g_i * t_i + g_j * t_j + g_k * sign) * per_length * unit
        flipped = two_sided and cosine < _F(0.0)
        unit = -unit if flipped else unit
        lanes[cosines + l] = -cosine if flipped else cosine
        lanes[normals + l] = n_0 * unit
        lanes[normals + _LINE + l] = n_1 * unit
        lanes[normals + _LINE + _LINE + l] = n_2 * unit
        lanes[directions + l] = d_0
        lanes[directions + _LINE + l] = d_1
        lanes[directions + _LINE + _LINE + l] = d_2
        magnitude = np.sqrt(square)
        weight = (magnitude - low) * per_weight
        weight = weight if weight > _F(0.0) else _F(0.0)
        weight = weight if weight < _F(1.0) else _F(1.0)
        lanes[mine + THICKER + l] = _F(1.0) - thickened + thickened * weight
        row = np.floor(magnitude * per_magnitude + _F(0.5))
        lanes[mine + SKIPPED + l] = (row if row < last else last) * rows
        tint = _F(1.0) - coloured + coloured * weight
        lanes[tints + l] = tint
        lit = own * tint
        lanes[mine + LIT_RED + l] = lit
        lanes[mine + LIT_GREEN + l] = lit
        lanes[mine + LIT_BLUE + l] = lit
        lanes[mine + SHINE_RED + l] = _F(0.0)
        lanes[mine + SHINE_GREEN + l] = _F(0.0)
        lanes[mine + SHINE_BLUE + l] = _F(0.0)
    power, blinn = numbers[POWER], numbers[BLINN] != _F(0.0)
    bright, shine = numbers[HEADLIGHT:], numbers[HEADLIGHT + 3 :]
    for l in range(np.uint64(n)):  # noqa: E741
        cosine = lanes[cosines + l]
        cosine = cosine if cosine > _F(0.0) else _F(0.0)
        mirrored = cosine if blinn else _F(2.0) * cosine * cosine - lanes[squares + l]
        _add_light(lanes, mine, l, cosine * lanes[tints + l], power_of(mirrored, power), bright, shine)


@inlined_kernel
def add_light(n, number, shades, lanes, light, sample):
    """Add one of the lights, as much of it as `LEFT` says, to a sample's sections that `shade` has begun."""
    numbers, one = shades.numbers, shades.lights[number]
    power, blinn = numbers[POWER], numbers[BLINN] != _F(0.0)
    normals, directions, cosines = light + NORMAL, light + DIRECTION, light + COSINE
    squares, tints, lefts = light + SQUARE, light + TINT, light + LEFT
    mine = light + sample
    x, y, z = one[0], one[1], one[2]
    bright, shine = one[DIFFUSE:SPECULAR], one[SPECULAR:SHADOW]
    for l in range(np.uint64(n)):  # noqa: E741
        cosine = lanes[cosines + l]
        facing = (
            lanes[normals + l] * x + lanes[normals + _LINE + l] * y + lanes[normals + _LINE + _LINE + l] * z
        )
        away = (
            lanes[directions + l] * x
            + lanes[directions + _LINE + l] * y
            + lanes[directions + _LINE + _LINE + l] * z
        )
        mirrored = _F(2.0) * cosine * facing + lanes[squares + l] * away
        if blinn:
            mirrored = (facing + cosine) / np.sqrt(_F(2.0) - _F(2.0) * away + SMALL)
        mirrored = mirrored if cosine > _F(0.0) else _F(0.0)
        facing = facing if facing > _F(0.0) else _F(0.0)
        left = lanes[lefts + l]
        highlight = left * power_of(mirrored, power)
        _add_light(lanes, mine, l, left * facing * lanes[tints + l], highlight, bright, shine)


@inlined_kernel
def _add_light(lanes, mine, l, cosine, highlight, bright, shine):  # noqa: E741
    lanes[mine + LIT_RED + l] += cosine * bright[0]
    lanes[mine + LIT_GREEN + l] += cosine * bright[1]
    lanes[mine + LIT_BLUE + l] += cosine * bright[2]
    lanes[mine + SHINE_RED + l] += highlight * shine[0]
    lanes[mine + SHINE_GREEN + l] += highlight * shine[1]
    lanes[mine + SHINE_BLUE + l] += highlight * shine[2]
