"""The interpolated scalar on a ray inside a cell, a cubic polynomial, and where it crosses values."""

from __future__ import annotations

import numpy as np

from .._jit import kernel


@kernel
def piece_at(breaks, value):
    """Number of breaks at or below `value`: the piece that holds there."""
    low, high = 0, len(breaks)
    while low < high:
        middle = (low + high) // 2
        if breaks[middle] <= value:
            low = middle + 1
        else:
            high = middle
    return low


@kernel
def extrema(cubic):
    """The two places in 0 … 1, ascending, where the cubic's derivative is zero; 0 stands for none."""
    _, k1, k2, k3 = cubic
    a, b, c = 3 * k3, 2 * k2, k1
    discriminant = b * b - 4 * a * c
    if not discriminant > 0:
        return 0.0, 0.0
    # The form that does not cancel; a quotient by zero is infinite or NaN and fails the test below.
    q = -0.5 * (b + np.copysign(np.sqrt(discriminant), b))
    one, two = q / a, c / q
    one = one if 0 < one < 1 else 0.0
    two = two if 0 < two < 1 else 0.0
    return min(one, two), max(one, two)


@kernel
def value_at(cubic, s):
    k0, k1, k2, k3 = cubic
    return ((k3 * s + k2) * s + k1) * s + k0


@kernel
def crossing_of(cubic, low, high, target, rising):
    """Where the cubic, monotonic between low and high, takes the value: Newton's method kept in a bracket."""
    s = 0.5 * (low + high)
    for _ in range(100):
        excess = value_at(cubic, s) - target
        if excess == 0:
            return s
        if (excess > 0) == rising:
            high = s
        else:
            low = s
        better = s - excess / ((3 * cubic[3] * s + 2 * cubic[2]) * s + cubic[1])
        if not low < better < high:
            better = 0.5 * (low + high)
        if abs(better - s) <= 1e-16 or high - low <= 1e-16:
            return better
        s = better
    return s
