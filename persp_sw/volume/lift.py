"""Values so small or so large that float32 cannot tell them apart in a table, brought nearer to 1."""

from __future__ import annotations

import numpy as np

from .grid import Volume

# Exponents of the largest value beyond which squares of gradients, per unit of a millionth, come near
# float32's ends, 2^-126 and 2^128; what scales differences to a table's 4096 entries is far from them.
_SMALL, _LARGE = -40, 40


def lift_exponent(volume: Volume) -> int:
    """The power of two, as its exponent, by which `lifted` multiplies; 0 but for extreme float32 volumes.

    It brings the largest value to 1, or, where that is very large and may be a stray one, just so far down.
    """
    exponent = int(np.frexp(max(map(abs, volume.value_range)))[1])
    if volume.data.dtype.kind != "f" or _SMALL <= exponent <= _LARGE:
        return 0
    return -exponent if exponent < _SMALL else _LARGE - exponent


def lifted(volume: Volume) -> Volume:
    """The volume with all values times 2^`lift_exponent`: exact, denormal numbers too, but for values 1e-60
    of the largest and less; itself where that is 0.
    """
    exponent = lift_exponent(volume)
    if not exponent:
        return volume
    data = np.ldexp(volume.data, exponent)
    return Volume(
        data, world_from_object=volume.world_from_object, orientation=volume.orientation, name=volume.name
    )
