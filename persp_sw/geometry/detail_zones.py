"""Which levels of detail serve which distances of a face.

Where neighbouring pixels are 2.4 voxels apart, the next coarser level begins to take over, and at 3.4 it has;
at 4.8 the next begins. Where one takes over both are composited, each with its share of the extinction, so
that nothing pops: the share changes with the distance only, and linearly. That costs 1.5 times the finer
level, which is why it is short: from 2 to 4 voxels, so that two levels were composited everywhere beyond 2,
it took 1 to 2.4 times the samples at qualities up to 0.6, for pictures within 0.5 dB, and a lower quality was
often slower than a higher one. (Beginning at one voxel costs 3 to 6 dB.)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

BEGIN, END = 2**1.25, 2**1.75  # voxels a pixel: where a coarser level begins, and where it rules


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
    alone, far = 0.0, BEGIN / tangent_pitch
    for fine in range(levels - 1):
        if far >= farthest:
            break
        yield Zone(fine, (0.0, 0.0), alone, far)
        near, alone = far, END * 2.0**fine / tangent_pitch
        slope = 1 / (alone - near)
        last = alone >= farthest
        yield Zone(fine, (-near * slope, slope), near, np.inf if last else alone)
        if last:
            return
        far = BEGIN * 2.0 ** (fine + 1) / tangent_pitch
    else:
        fine = levels - 1
    yield Zone(fine, (0.0, 0.0), alone, np.inf)


def _parallel_zone(apart: float, levels: int) -> Zone:
    """For parallel rays, pixels are equally far apart at all distances."""
    fine = int(np.clip(np.floor(np.log2(apart / BEGIN)), 0, levels - 1))
    share = float(np.clip((apart / 2.0**fine - BEGIN) / (END - BEGIN), 0, 1))
    if fine == levels - 1 or share == 0:
        return Zone(fine, (0.0, 0.0), 0.0, np.inf)
    return Zone(fine + 1, (0.0, 0.0), 0.0, np.inf) if share == 1 else Zone(fine, (share, 0.0), 0.0, np.inf)
