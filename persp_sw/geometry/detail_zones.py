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


@dataclass(frozen=True)
class Zone:
    """Distances along the principal axis that one level serves, or two.

    Attributes
    ----------
    fine
        Number of the finer level; the coarser one is the next.
    share
        (s_0, s_1): the coarser level's share of the extinction at distance D is s_0 + s_1·D; (0, 0): it has
        none.
    near, far
        Limits of the zone.
    """

    fine: int
    share: tuple[float, float]
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
    near, far = 0.0, _BEGIN / tangent_pitch
    if far >= farthest or levels == 1:
        yield Zone(0, (0.0, 0.0), 0.0, np.inf)
        return
    yield Zone(0, (0.0, 0.0), 0.0, far)
    for fine in range(levels - 1):
        near, far = (limit * 2.0**fine / tangent_pitch for limit in (_BEGIN, _END))
        slope = 1 / (far - near)
        last = far >= farthest
        yield Zone(fine, (-near * slope, slope), near, np.inf if last else far)
        if last:
            return
    yield Zone(levels - 1, (0.0, 0.0), far, np.inf)


def _parallel_zone(apart: float, levels: int) -> Zone:
    """For parallel rays, pixels are equally far apart at all distances."""
    fine = int(np.clip(np.floor(np.log2(apart / _BEGIN)), 0, levels - 1))
    share = (apart / 2.0**fine - _BEGIN) / (_END - _BEGIN)
    return Zone(fine, (float(np.clip(share, 0, 1)) if fine < levels - 1 else 0.0, 0.0), 0.0, np.inf)
