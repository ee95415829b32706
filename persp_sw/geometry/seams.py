"""Seams: where two faces meet, the rays of a narrow zone belong to both, and their pixels are mixed.

A ray of direction d is its face's whose axis k has the largest |d_k|. Two faces sample a ray on different
planes, so that their pixels differ by the error of either: a seam from one pixel to the next shows as a step.
So each face counts, with q_k = |d_k| / max_m |d_m|, for

    w_k = max(q_k − c, 0),    c = 1 / (1 + δ),

over the sum of all faces' w: half and half on the seam itself, one face alone where the others' q are below
c. None of it jumps as the eye moves, and no face needs a pixel just on the seam.

Measured: contrast of seams in `docs/stability.md` (the error's steps across them over those between
neighbours nearby): smooth 1.3, 1.0, 0.96 for δ of ½, 1, 2 pixels, surface 1.42 for each. Seams common to both
eyes of a head, by a cube about the head's middle instead of either eye, made nothing better: a small blob's
contrast to one eye differs from that to the other by 0.014 rms and 0.065 at most, by 0.015 and 0.063 without
(128³ voxels, all edges and corners), and where all rays go along one axis by 0.019 and 0.17.
"""

from __future__ import annotations

# δ is so many pixels, and at most so much.
_PIXELS = 2.0
_WIDEST = 1 / 16

# Up to which tangents a face may have to show rays, whatever its pitch.
REACH = 1 + _WIDEST


def reach_of(pitch: float) -> float:
    """1 + δ: up to which tangents a face of this pitch shows rays."""
    return 1 + min(_PIXELS * pitch, _WIDEST)
