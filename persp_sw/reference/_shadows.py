"""How much of a light reaches a point: a ray towards it through all that is shown."""

from __future__ import annotations

import numpy as np

from .._jit import kernel
from ._material import look_up, material_zones, may_show
from ._plain import MAX_HALVINGS
from ._rays import OPAQUE_DEPTH, at_plane, cut_ray, is_shown
from ._stretch import (
    cut_at_breaks,
    gradient_on,
    lay_gradient,
    lay_value,
    next_cut,
    set_out,
    value_on,
)

_LOOKS, _LOOKED_HALVINGS = 8, 3  # as `_lit`
_INWARD = np.sqrt(15.0) / 10  # of Gauss' three places, from the middle


@kernel
def transmittance_to(field, material, shown, point, along, tolerance, stretch, ends):
    """Part of the light from `along` that reaches a point, object space; what is cut away casts no shadow."""
    count = cut_ray(point, along, 0.0, shown.planes, shown.kinds, ends)
    depth = 0.0
    for n in range(count - 1):
        middle = 0.5 * (ends[n] + ends[n + 1])
        if ends[n] < ends[n + 1] and is_shown(
            point, along, middle, shown.planes, shown.kinds, shown.crop_flags
        ):
            depth = _depth_along(
                field, material, point, along, ends[n], ends[n + 1], tolerance, stretch, depth
            )
            if depth > OPAQUE_DEPTH:
                return 0.0
    return np.exp(-depth)


@kernel
def way_out(point, along, shown):
    """Number of the first plane on the way from a point to the light; where it changes, shadows bend."""
    best, nearest = 0, np.inf
    for k in range(len(shown.planes)):
        plane = shown.planes[k]
        slope = plane[0] * along[0] + plane[1] * along[1] + plane[2] * along[2]
        if slope != 0:
            reach = -at_plane(point, along, 0.0, plane) / slope
            if 0 < reach < nearest:
                best, nearest = k, reach
    return best


@kernel
def _depth_along(field, material, point, along, entry, leave, tolerance, stretch, depth):
    set_out(field, point, along, entry, stretch.planes)
    here = entry
    while here < leave and depth <= OPAQUE_DEPTH:
        there = next_cut(point, along, here, leave, stretch.planes)
        lowest, highest = lay_value(field, point, along, here, there, stretch)
        if lowest == lowest and may_show(material, lowest, highest):
            if material.asks_gradient:
                lay_gradient(field, point, along, here, there, stretch)
            length = (there - here) / material.unit
            count = cut_at_breaks(stretch, material.breaks)
            for n in range(count):
                start, end = stretch.cuts[n, 0], stretch.cuts[n + 1, 0]
                piece = int(stretch.cuts[n, 1])
                depth = _depth_of(field, material, stretch, piece, start, end, length, tolerance, depth)
        here = there
    return depth


@kernel
def _depth_at(field, material, stretch, piece, u):
    magnitude = _magnitude_at(field, material, stretch, u)
    return look_up(material, piece, value_on(stretch, u), magnitude)[0]


@kernel
def _magnitude_at(field, material, stretch, u):
    if not material.asks_gradient:
        return 0.0
    x, y, z = gradient_on(field, stretch, u)
    return np.sqrt(x * x + y * y + z * z)


@kernel
def _steps_at(field, material, stretch, u):
    magnitude = _magnitude_at(field, material, stretch, u)
    return material_zones(material, value_on(stretch, u), magnitude)[0] if material.asks_gradient else 0


@kernel
def _gauss(field, material, stretch, piece, start, width):
    middle, inward = start + 0.5 * width, _INWARD * width
    first = _depth_at(field, material, stretch, piece, middle - inward)
    last = _depth_at(field, material, stretch, piece, middle + inward)
    return (5 * (first + last) + 8 * _depth_at(field, material, stretch, piece, middle)) / 18 * width


@kernel
def _depth_of(field, material, stretch, piece, start, end, length, tolerance, depth):
    """`depth` and that of one piece, halved until one halving more changes the transmittance ≤ tolerance."""
    # Panel number `index` of 2^level; after the second half of a panel its whole is done.
    level, index, width = 0, 0, end - start
    before = _steps_at(field, material, stretch, start)
    least = 0
    for n in range(1, _LOOKS):
        if _steps_at(field, material, stretch, start + n / _LOOKS * width) != before:
            least = _LOOKED_HALVINGS
    while not (level == 0 and index == 1):
        here, half = start + index * width, 0.5 * width
        whole = length * _gauss(field, material, stretch, piece, here, width)
        halves = length * (
            _gauss(field, material, stretch, piece, here, half)
            + _gauss(field, material, stretch, piece, here + half, half)
        )
        between = _steps_at(field, material, stretch, here + half)
        after = _steps_at(field, material, stretch, here + width)
        change = abs(np.exp(-whole) - np.exp(-halves))
        if before != between or between != after:
            change = max(change, -np.expm1(-max(whole, halves)))  # a step may hide between the places
        if (level < least or change * np.exp(-depth) > tolerance) and level < MAX_HALVINGS:
            level += 1
            index *= 2
            width = half
            continue
        depth += halves
        if depth > OPAQUE_DEPTH:
            return depth
        before = after
        index += 1
        while level > 0 and index % 2 == 0:
            level -= 1
            index //= 2
            width *= 2
    return depth
