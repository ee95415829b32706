"""Seams: where two faces meet, the rays of a narrow zone belong to both, and their pixels are mixed.

A ray of direction d is its face's whose axis k has the largest |d_k|. Two faces sample a ray on different
planes, so that their pixels differ by the error of either: a seam from one pixel to the next shows as a step.
So each face counts, with q_k = |d_k| / max_m |d_m|, for

    w_k = max(q_k − c, 0),    c = 1 / (1 + δ),

over the sum of all faces' w: half and half on the seam itself, one face alone where the others' q are below
c. None of it jumps as the eye moves, and no face needs a pixel just on the seam.

Measured, smooth, where seams show most, from inside: their contrast (the error's steps across them over those
between neighbours nearby) is 2.7 with δ = 0, and 1.2 with 1, 2 or 4 pixels, in 64³ voxels; in 128³ 3.1, and
0.8, 0.7, 0.7; a plain ray caster, which has none, shows 1.4 and 1.0 there. Surfaces: 1.5 at most, with any δ.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# δ is so many pixels, and at most so much.
_PIXELS = 2.0
_WIDEST = 1 / 16

# Up to which tangents a face may have to show rays, whatever its pitch.
REACH = 1 + _WIDEST


def reach_of(pitch: float) -> float:
    """1 + δ: up to which tangents a face of this pitch shows rays."""
    return 1 + min(_PIXELS * pitch, _WIDEST)


def shares(directions: NDArray[np.float64], pitch: float) -> NDArray[np.float64]:
    """How much each face, −x, +x, −y … +z, shows of rays along object-space directions.

    Parameters
    ----------
    directions
        (n, 3), not zero, of any length.
    pitch
        Of the faces.

    Returns
    -------
    (n, 6), rows of sum 1. The warps compute the same from tangents.
    """
    parts = np.stack([-directions, directions], -1).reshape(-1, 6)
    counts = np.maximum(parts / parts.max(1, keepdims=True) - 1 / reach_of(pitch), 0)
    return counts / counts.sum(1, keepdims=True)
