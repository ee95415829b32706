"""Light of many lights at once, from maps over directions; see `optics.reflectance` for what they hold.

A map is the surface of the octahedron |x| + |y| + |z| = 1 unfolded to the square |u| ≤ 1, |v| ≤ 1: (u, v) =
(x, y) where z ≥ 0, else (±(1 − |y|), ±(1 − |x|)) with the signs of x and y. It has 2·half cells along an edge
and a texel at each of their corners, u = −1 … 1 along a row, rows from v = −1 on, four floats each: r, g, b
and nothing. Both diagonals' folds and the lines u = 0 and v = 0 run through texels, so no cell bends but
along the diagonal that cuts it into the two triangles in which we interpolate linearly.

In `Shade.numbers`, from `phong.NUMBERS`: the map of diffuse light, then that of mirrored light.
"""

import numpy as np

from .._jit import inlined_kernel, lean_kernel
from .phong import HALF_DIFFUSE, HALF_MIRRORED, NUMBERS, POWER, power_of
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

_F = np.float32
_LINE = np.uint64(TILE)
# Nothing has no direction, but must not divide by zero; its reciprocal is finite.
LEAST = _F(1e-30)


@inlined_kernel
def _look_up(texels, half, x, y, z):
    """(r, g, b, |x| + |y| + |z|): of a map's point in this direction, of any length."""
    size_x, size_y = abs(x), abs(y)
    total = size_x + size_y + abs(z)
    per = half / (total if total > LEAST else LEAST)
    along_x, along_y = size_x * per, size_y * per
    folded = z < _F(0.0)
    a, b = (half - along_y if folded else along_x), (half - along_x if folded else along_y)
    i, j, last = np.floor(a), np.floor(b), half - _F(1.0)
    i, j = (i if i > _F(0.0) else _F(0.0)), (j if j > _F(0.0) else _F(0.0))
    i, j = (i if i < last else last), (j if j < last else last)
    a, b = a - i, b - j
    # The cell's corners away from and nearest to the middle, of which a triangle has one, and the others.
    width = np.int64(half) * 2 + 1
    right, down = (-1 if x < _F(0.0) else 1), (-width if y < _F(0.0) else width)
    corner = np.int64(half) * (width + 1) + right * np.int64(i) + down * np.int64(j)
    beside, below = 4 * (corner + right), 4 * (corner + down)
    rest = _F(1.0) - a - b
    inner = rest >= _F(0.0)
    corner = 4 * (corner if inner else corner + right + down)
    rest = rest if inner else -rest
    a, b = (a if inner else _F(1.0) - b), (b if inner else _F(1.0) - a)
    return (
        rest * texels[corner] + a * texels[beside] + b * texels[below],
        rest * texels[corner + 1] + a * texels[beside + 1] + b * texels[below + 1],
        rest * texels[corner + 2] + a * texels[beside + 2] + b * texels[below + 2],
        total,
    )


@lean_kernel
def reflect(n, numbers, lanes, light, sample):
    """Add the lights that the maps hold to a sample's sections, which `phong.shade` has begun."""
    half, mirrored = numbers[HALF_DIFFUSE], numbers[HALF_MIRRORED]
    width = 2 * np.int64(half) + 1
    texels = numbers[NUMBERS:]
    more = numbers[NUMBERS + 4 * width * width :]
    normals, directions, mine = light + NORMAL, light + DIRECTION, light + sample
    for l in range(np.uint64(n)):  # noqa: E741
        x, y, z = lanes[normals + l], lanes[normals + _LINE + l], lanes[normals + _LINE + _LINE + l]
        r, g, b, length = _look_up(texels, half, x, y, z)
        length = length * lanes[light + TINT + l]
        lanes[mine + LIT_RED + l] += length * r
        lanes[mine + LIT_GREEN + l] += length * g
        lanes[mine + LIT_BLUE + l] += length * b
        cosine, square = lanes[light + COSINE + l], lanes[light + SQUARE + l]
        if mirrored > _F(0.0) and cosine > _F(0.0):
            twice = cosine + cosine
            x = twice * x + square * lanes[directions + l]
            y = twice * y + square * lanes[directions + _LINE + l]
            z = twice * z + square * lanes[directions + _LINE + _LINE + l]
            r, g, b, _ = _look_up(more, mirrored, x, y, z)
            strength = power_of(square, numbers[POWER])
            lanes[mine + SHINE_RED + l] += strength * r
            lanes[mine + SHINE_GREEN + l] += strength * g
            lanes[mine + SHINE_BLUE + l] += strength * b
