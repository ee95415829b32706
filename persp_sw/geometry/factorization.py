"""The matrices of the perspective shear-warp as published, for reading beside the paper and for tests.

Source: Schulze, Niemeier, Lang (2001), section 2, after Lacroute (1995). Their M^{sd} is our
`deformed_from_standard`, and so on. Compositing does not use these matrices but the tangents of
`geometry/faces.py`: the same rays, without a base plane, regular for every eye. Where we differ:

- Equation (1) is a misprint: the eye is object_from_viewport · (0, 0, −1, 0).
- M^{sd}[0, 2] is −e_x / e_z (the paper prints the index twice alike).
- M^{di} drops the third coordinate and has no inverse; "M^{id}" undoes only its translation. So
  M_ov = M_iv · M_oi holds for the rows x, y and w, not for z.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Matrix
from ..errors import ViewError
from ..volume.levels import STANDARD_AXES
from .view import View


@dataclass(frozen=True, eq=False)
class Factorization:
    """viewport_from_object = viewport_from_intermediate · intermediate_from_object, but for the row z.

    Attributes
    ----------
    eye
        Standard-space eye, homogeneous (x, y, z, w).
    standard_from_object, deformed_from_standard, scale, intermediate_from_deformed
        Permutation, perspective shear onto the base plane k = 0, scale and projection; (4, 4).
    intermediate_from_object
        Their product: the slices, sheared and projected.
    viewport_from_intermediate
        The warp, (4, 4); it uses only x, y and w of what it is given.
    """

    eye: NDArray[np.float64]
    standard_from_object: Matrix
    deformed_from_standard: Matrix
    scale: Matrix
    intermediate_from_deformed: Matrix
    intermediate_from_object: Matrix
    viewport_from_intermediate: Matrix


def viewport_from_world(view: View) -> Matrix:
    """(4, 4) view matrix to pixels; z is the constant 1, so that it is invertible and w the distance."""
    matrix = np.zeros((4, 4))
    matrix[[0, 1, 3]] = view.viewport_from_world
    matrix[2, 3] = 1
    return matrix


def factorize(
    viewport_from_object: Matrix, axis: int, scale: float = 1.0, size: tuple[float, float] = (0.0, 0.0)
) -> Factorization:
    """Factorize a perspective viewing matrix for principal axis 0 (x), 1 (y) or 2 (z).

    Parameters
    ----------
    viewport_from_object
        (4, 4), invertible.
    scale
        Pixels of the intermediate image per voxel on the base plane.
    size
        Width and height of the intermediate image, pixels; the base plane's origin is in its middle.

    Raises
    ------
    ViewError
        The eye lies in the base plane k = 0, where this factorization (not our compositing) is singular.

    Accuracy: products agree to 1e-10 relative (`tests/test_factorization.py`).
    """
    eye_object = np.linalg.solve(viewport_from_object, np.array([0.0, 0.0, -1.0, 0.0]))
    permutation = np.zeros((4, 4))
    permutation[[0, 1, 2], STANDARD_AXES[axis]] = 1
    permutation[3, 3] = 1
    eye = permutation @ eye_object
    if eye[2] == 0:
        raise ViewError("the eye lies in the base plane: its shear is singular there; choose another axis")
    shear = np.eye(4)
    shear[[0, 1, 3], 2] = -eye[[0, 1, 3]] / eye[2]
    scaling = np.diag([scale, scale, 1.0, 1.0])
    project = np.diag([1.0, 1.0, 0.0, 1.0])
    project[:2, 3] = np.array(size) / 2
    unproject = np.eye(4)
    unproject[:2, 3] = -project[:2, 3]
    intermediate_from_object = project @ scaling @ shear @ permutation
    warp = viewport_from_object @ permutation.T @ np.linalg.inv(shear) @ np.linalg.inv(scaling) @ unproject
    return Factorization(eye, permutation, shear, scaling, project, intermediate_from_object, warp)
