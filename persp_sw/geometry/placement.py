"""At which distance an eye image is to lie, for eyes that have moved since it was made.

Distances D count along a face's axis, in voxels, one number for all faces: so those of several are the sides
of one box about the eye, which join without cracks for any eye inside it. A point at distance z that is shown
at D moves with a head by too much or too little, by the head's shift times |1/z − 1/D|: means are harmonic.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .faces import Face

Array = NDArray[np.float64]

# From inside the nearest depth is 0, and would be the harmonic mean: it counts as this part of the farthest.
_NEAREST = 1 / 8
# A moved eye is never farther from the image's eye than this part of the distance: it stays inside the box.
_INSIDE = 1 / 2


def depth_range(faces: Sequence[Face], eye: Array, box: Array) -> tuple[float, float]:
    """Nearest and farthest distance of what is in `box` (2, 3) from `eye`, object space; nearest > 0."""
    ends = box - eye
    if len(faces) == 1:
        depths = faces[0].sign * ends[:, faces[0].axis]
        nearest, farthest = float(depths.min()), float(depths.max())
    else:
        nearest = float(np.abs(np.clip(0, *ends)).max())
        farthest = float(np.abs(ends).max())
    return max(nearest, _NEAREST * farthest), farthest


def box_between(faces: Sequence[Face], eye: Array, box: Array, nearest: float, farthest: float) -> Array:
    """The part of a box (2, 3) between two distances; of several faces all that is before the second."""
    low, high = -np.full(3, farthest), np.full(3, farthest)
    if len(faces) == 1:
        axis, sign = faces[0].axis, faces[0].sign
        low, high = np.full(3, -np.inf), np.full(3, np.inf)
        low[axis], high[axis] = (nearest, farthest) if sign > 0 else (-farthest, -nearest)
    return np.array([np.maximum(box[0], eye + low), np.minimum(box[1], eye + high)])


def middle_of(nearest: float, farthest: float) -> float:
    """The harmonic mean: a shifted head sees the same error at either end."""
    return 2 * nearest * farthest / (nearest + farthest) or 1.0


def beyond_eye(distance: float, faces: Sequence[Face], shift: Array) -> float:
    """`distance`, or more where an eye that has moved by `shift` (object xyz) would leave or nearly leave it.

    An eye beyond a face's plane could see it from behind only, and one outside the box of several faces would
    see cracks. A single face is a plane, past which the eye may move sideways as far as it likes.
    """
    forward = faces[0].sign * shift[faces[0].axis]
    moved = forward if len(faces) == 1 else np.abs(shift).max()
    return max(distance, float(moved) / _INSIDE)
