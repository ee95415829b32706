"""What a value and a gradient's magnitude look like before lights: extinction and colour."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._jit import kernel
from ..optics.look import Look
from ..optics.transfer import MAX_OPACITY, TransferFunction
from ..optics.transfer2d import Box, TransferFunction2D
from ..volume.gradient import largest_magnitude
from ..volume.grid import Volume
from ._plain import CLEAR, RGB, RGB_SLOPE, SLOPE, VALUE, extinction_of, pieces_of

# Columns of the table of shapes; a triangle's values are its middle and its half-width.
_IS_BOX, _V0, _V1, _M0, _M1, _SOFT, _OPACITY, _SHAPE_RGB, _SHAPE_COLUMNS = 0, 1, 2, 3, 4, 5, 6, 7, 10


class Material(NamedTuple):
    """A transfer function and what modulates it.

    Attributes
    ----------
    breaks
        (n,) values at which the function may step or bend, whatever the magnitude.
    pieces, visible_before
        As `_plain.pieces_of`, of a one-dimensional function.
    shapes
        (n, 10) of a two-dimensional one; no rows: it is one-dimensional.
    unit
        World length over which opacities hold.
    asks_gradient
        Whether the extinction depends on it.
    modulation
        (4,) magnitudes of weight 0 and 1, opacity, colour; the latter two 0: none.
    """

    breaks: NDArray[np.float64]
    pieces: NDArray[np.float64]
    visible_before: NDArray[np.int64]
    shapes: NDArray[np.float64]
    unit: float
    asks_gradient: bool
    modulation: NDArray[np.float64]


def material_of(volume: Volume, transfer: TransferFunction | TransferFunction2D, look: Look) -> Material:
    """Of a transfer function that has its unit."""
    if isinstance(transfer, TransferFunction):
        table, shapes = pieces_of(transfer), np.empty((0, _SHAPE_COLUMNS))
    else:
        shapes = np.array([_row_of(shape) for shape in transfer.shapes])
        table = (
            np.unique([_breaks_of(shape) for shape in transfer.shapes]),
            np.empty((0, 9)),
            np.zeros(1, int),
        )
    modulation = np.array([0.0, 1.0, 0.0, 0.0])
    if m := look.modulation:
        largest = largest_magnitude(volume, look.gradient_distance)
        modulation[:] = m.low * largest, m.high * largest, m.opacity, m.colour
    asks = len(shapes) > 0 or modulation[2] > 0
    return Material(*table, shapes, float(transfer.opacity_unit), asks, modulation)


def _row_of(shape):
    box = isinstance(shape, Box)
    values = shape.values if box else (shape.value, shape.width)
    return [box, *values, *shape.magnitudes, shape.soft, shape.opacity, *shape.colour]


def _breaks_of(shape):
    low, high = shape.values
    if isinstance(shape, Box):
        inward = shape.soft * 0.5 * (high - low)
        return [low, low + inward, high - inward, high]
    return [low, shape.value, shape.value, high]


@kernel
def may_show(material, lowest, highest):
    """Whether some value between two can be visible."""
    if len(material.shapes) == 0:
        first = np.searchsorted(material.breaks, lowest, side="right")
        last = np.searchsorted(material.breaks, highest, side="right")
        return material.visible_before[first] != material.visible_before[last + 1]
    for shape in material.shapes:
        box = shape[_IS_BOX] != 0
        low = shape[_V0] if box else shape[_V0] - shape[_V1]
        high = shape[_V1] if box else shape[_V0] + shape[_V1]
        if low <= highest and lowest <= high and shape[_OPACITY] > 0:
            return True
    return False


@kernel
def _depths_inside(shape, value, magnitude):
    """How deep in a shape, towards its sides and its ends: 1 in the middle, below 0 outside."""
    low, high = shape[_M0], shape[_M1]
    half_height = 0.5 * (high - low)
    ends = (high - magnitude) / half_height
    if shape[_IS_BOX] != 0:
        left, right = shape[_V0], shape[_V1]
        sides = min(value - left, right - value) / (0.5 * (right - left))
        if low > 0:
            ends = min(ends, (magnitude - low) / half_height)
        return sides, ends
    half = shape[_V1] * (magnitude - low) / (high - low)
    return (1 - abs(value - shape[_V0]) / half if half > 0 else -1.0), ends


@kernel
def _fall(depth, soft):
    if depth < 0:
        return 0.0
    return min(depth / soft, 1.0) if soft > 1e-300 else 1.0


@kernel
def _weight(material, magnitude):
    low, high = material.modulation[0], material.modulation[1]
    return min(max((magnitude - low) / (high - low), 0.0), 1.0) if high > low else 0.0


@kernel
def look_up(material, piece, value, magnitude):
    """Extinction per opacity unit and colour r, g, b, of a value on a piece of the function."""
    red, green, blue = 0.0, 0.0, 0.0
    if len(material.shapes) == 0:
        row = material.pieces[piece]
        value -= row[VALUE]
        depth = extinction_of(row, value) if row[SLOPE] != 0 or row[CLEAR] != 1 else 0.0
        red = row[RGB] + row[RGB_SLOPE] * value
        green = row[RGB + 1] + row[RGB_SLOPE + 1] * value
        blue = row[RGB + 2] + row[RGB_SLOPE + 2] * value
    else:
        depth = 0.0
        for shape in material.shapes:
            sides, ends = _depths_inside(shape, value, magnitude)
            opacity = shape[_OPACITY] * _fall(sides, shape[_SOFT]) * _fall(ends, shape[_SOFT])
            if opacity > 0:
                part = -np.log1p(-min(opacity, MAX_OPACITY))
                depth += part
                red += part * shape[_SHAPE_RGB]
                green += part * shape[_SHAPE_RGB + 1]
                blue += part * shape[_SHAPE_RGB + 2]
        if depth > 0:
            red, green, blue = red / depth, green / depth, blue / depth
    weight = _weight(material, magnitude)
    depth *= 1 - material.modulation[2] + material.modulation[2] * weight
    tint = 1 - material.modulation[3] + material.modulation[3] * weight
    return depth, tint * red, tint * green, tint * blue


@kernel
def material_zones(material, value, magnitude):
    """Two numbers that differ wherever a step, or only a bend, lies between two places."""
    steps, bends = 0, 0
    for shape in material.shapes:
        sides, ends = _depths_inside(shape, value, magnitude)
        soft = shape[_SOFT]
        inside = sides >= 0 and ends >= 0
        if soft > 0:
            bends = bends * 5 + (
                0 if not inside else 1 + (2 if sides > soft else 0) + (1 if ends > soft else 0)
            )
        else:
            steps = steps * 2 + (1 if inside else 0)
    if material.modulation[2] > 0 or material.modulation[3] > 0:
        low, high = material.modulation[0], material.modulation[1]
        bends = bends * 3 + (0 if magnitude < low else 1 if magnitude < high else 2)
    return steps, bends
