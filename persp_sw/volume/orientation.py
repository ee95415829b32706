"""Poses from file headers, and which way a patient lies in them."""

from __future__ import annotations

from itertools import permutations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Matrix, Vector

LPS_FROM_RAS = (-1, -1, 1)  # signs of the rows


def flipped(matrix: Matrix, signs: Vector) -> Matrix:
    """`matrix` into a world whose x, y and z have these signs in the world it was for."""
    return matrix * np.reshape((*signs, 1.0), (4, 1)) + 0.0  # without negative zeros


def pose(axes: ArrayLike, origin: Vector = (0, 0, 0), spacing: Vector = (1, 1, 1)) -> Matrix:
    """(4, 4) world_from_object that steps along `axes` (x, y, z, one a row) times `spacing`; not checked."""
    matrix = np.eye(4)
    with np.errstate(invalid="ignore"):  # a spacing of infinity is refused later, by name
        matrix[:3, :3] = np.asarray(axes, np.float64).T * spacing
    matrix[:3, 3] = origin
    return matrix


def letters(world_from_object: Matrix) -> str:
    """The letters of L R A P S I towards which x, y and z grow, for a pose into LPS.

    Oblique axes get the letter they are nearest to; each of the three directions is given once.
    """
    axes = world_from_object[:3, :3]
    with np.errstate(over="ignore"):  # lengths beyond the numbers, from damaged headers
        cosines = axes / np.linalg.norm(axes, axis=0)
    best = max(permutations(range(3)), key=lambda p: sum(abs(cosines[p[i], i]) for i in range(3)))
    return "".join(("LPS" if cosines[row, i] > 0 else "RAI")[row] for i, row in enumerate(best))
