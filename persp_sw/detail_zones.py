"""Which levels of detail serve which distances of a face.

Where neighbouring pixels are two voxels apart, the next coarser level begins to take over, and at four, two
of its own voxels, it has. (Beginning at one voxel costs 3 to 6 dB.) Between them both levels are composited,
each with its share of the extinction, so that nothing pops: the share changes with the distance only, and
linearly.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

_BEGIN, _END = 2.0, 4.0  # voxels a pixel
_FAR = 1e9  # distance over which the share of an eye at infinity hardly changes


@dataclass(frozen=True)
class Zone:
    """Distances along the principal axis that two levels serve.

    Attributes
    ----------
    fine
        Number of the finer level; the coarser one is the next.
    blend
        Distances from which the coarser level takes over and at which it has; infinite where it is not
        needed.
    near, far
        Limits of the zone.
    """

    fine: int
    blend: tuple[float, float]
    near: float
    far: float


def detail_zones(tangent_pitch: float, offset_pitch: float, farthest: float, levels: int) -> Iterator[Zone]:
    """The zones of a face up to distance `farthest`, front to back.

    tangent_pitch, offset_pitch: how many voxels pixels are apart at distance D is offset_pitch +
    tangent_pitch·D, and one of them is 0. levels: how many there are.
    """
    if tangent_pitch == 0:
        yield _parallel_zone(offset_pitch, levels)
        return
    near = 0.0
    for fine in range(levels):
        begin, end = (limit * 2.0**fine / tangent_pitch for limit in (_BEGIN, _END))
        if fine == levels - 1 or begin >= farthest:
            yield Zone(fine, (np.inf, np.inf), near, np.inf)
            return
        if end >= farthest or fine == levels - 2:
            yield Zone(fine, (begin, end), near, np.inf)
            return
        yield Zone(fine, (begin, end), near, end)
        near = end


def _parallel_zone(apart: float, levels: int) -> Zone:
    """For parallel rays, pixels are equally far apart at all distances."""
    fine = int(np.clip(np.floor(np.log2(apart / _BEGIN)), 0, levels - 1))
    share = (apart / 2.0**fine - _BEGIN) / (_END - _BEGIN)
    if fine == levels - 1 or share <= 0:
        return Zone(fine, (np.inf, np.inf), 0.0, np.inf)
    share = min(share, 1.0)
    return Zone(fine, (-share * _FAR, (1 - share) * _FAR), 0.0, np.inf)
