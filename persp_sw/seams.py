"""Seams: where faces of an eye image meet, they have pixels on the same rays; those get one value.

Two faces sample a ray on different planes, so their pixels differ by the error of either. Without alignment a
seam shows as a step. With the mean on the seam itself, any bilinear look-up that changes faces there is
continuous, the software warp's and a texture unit's alike, and no face has to be composited beyond its rays.

Measured (step of the picture's error across the seam, rms, before → after; in brackets that between ordinary
neighbours nearby): engine, surface, inside 0.0050 → 0.0014 (0.0013); mni152, smooth, inside 0.0010 → 0.0002
(0.0001); engine, surface, from a corner 0.028 → 0.024 (0.030). Spreading the change over 2 … 8 pixels gains
nothing more on surfaces, which it smears, and 1e-4 on smooth functions.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, product

import numpy as np

from .arrays import Image
from .geometry.faces import Face
from .volume.levels import STANDARD_AXES


def close_seams(faces: Sequence[Face], images: Sequence[Image]) -> None:
    """Give pixels of different faces that are the same ray the mean of their values, in place.

    The faces share one pitch and have pixel centres at tangents of ±1, as `faces_for` makes them.
    """
    corners = list(_corners(faces, images))
    for one, other in combinations(range(len(faces)), 2):
        if faces[one].axis != faces[other].axis:
            a, b = _shared_line(faces[one], images[one], faces[other], images[other])
            a[:] = b[:] = (a + b) / 2
    for pixels, mean in corners:
        for pixel in pixels:
            pixel[:] = mean


def _first(face: Face) -> tuple[int, int]:
    """(n_i, n_j) of the first pixel: pixel centres have the tangents (n + ½)·pitch."""
    return round(face.origin[0] / face.pitch), round(face.origin[1] / face.pitch)


def _on_seam(face: Face, side: int) -> int:
    """n of the pixels with a tangent of `side`."""
    return round(side / face.pitch - 0.5)


def _seam(face: Face, image: Image, towards: Face) -> tuple[Image, int]:
    """The face's pixels, (n, 4) view, where it meets another (none if it does not), and n of the first."""
    dimension = STANDARD_AXES[face.axis].index(towards.axis)
    first = _first(face)
    at = _on_seam(face, towards.sign) - first[dimension]
    rows = image.swapaxes(0, 1) if dimension == 0 else image
    return (rows[at] if 0 <= at < len(rows) else rows[0, :0]), first[1 - dimension]


def _shared_line(one: Face, its_image: Image, other: Face, image: Image) -> tuple[Image, Image]:
    """The pixels of both faces, (n, 4) views, that are the same rays."""
    (a, first_a), (b, first_b) = _seam(one, its_image, other), _seam(other, image, one)
    low, high = max(first_a, first_b), min(first_a + len(a), first_b + len(b))
    return a[low - first_a : max(high, low) - first_a], b[low - first_b : max(high, low) - first_b]


def _corners(faces: Sequence[Face], images: Sequence[Image]):
    """For each (±1, ±1, ±1) that several faces look along: their pixels and the mean of those."""
    for signs in product((-1, 1), repeat=3):
        pixels = []
        for face, image in zip(faces, images, strict=True):
            i, j, k = STANDARD_AXES[face.axis]
            first_i, first_j = _first(face)
            u, v = _on_seam(face, signs[i]) - first_i, _on_seam(face, signs[j]) - first_j
            if face.sign == signs[k] and 0 <= u < face.size[0] and 0 <= v < face.size[1]:
                pixels.append(image[v, u])
        if pixels:
            yield pixels, np.mean(pixels, axis=0)
