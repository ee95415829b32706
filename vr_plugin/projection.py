"""Off-axis projection through a wall, as OpenGL wants it."""

from __future__ import annotations

import numpy as np

import persp_sw as psw


def clip_from_view_space(eye: np.ndarray, wall: psw.Wall, near: float, far: float) -> tuple[np.ndarray, ...]:
    """Projection and view matrix of `eye` through `wall`: (4, 4) each, float64, column vectors.

    Parameters
    ----------
    eye
        Position, in the space of the wall's corners.
    near, far
        Distances from the eye, along the wall's normal, that depth 0 and 1 stand for; 0 < near < far.

    Returns
    -------
    projection, view
        projection @ view maps the space of the corners to OpenGL's clip space: the wall's corners to x, y =
        ±1 times w, with y up. In view space the eye is the origin, x runs along the wall's lower edge, y up
        and z towards the viewer. A wall need not be rectangular: a sheared one shears the projection.

    Source: Kooima, *Generalized perspective projection*.
    """
    eye = np.asarray(eye, np.float64)
    across, up = wall.lower_right - wall.lower_left, wall.upper_left - wall.lower_left
    right = across / np.linalg.norm(across)
    normal = np.cross(across, up)
    normal /= np.linalg.norm(normal)
    upward = np.cross(normal, right)
    to_corner = wall.lower_left - eye
    distance = -(to_corner @ normal)
    if distance < 0:  # from behind: the same window, its normal towards the eye
        normal, right, distance = -normal, -right, -distance
    view = np.eye(4)
    view[:3, :3] = right, upward, normal
    view[:3, 3] = -view[:3, :3] @ eye
    # On the wall's plane, (x, y, -distance) = corner + a·across + b·up with a, b in 0 … 1.
    basis = np.array([[across @ right, up @ right], [across @ upward, up @ upward]])
    inverse = np.linalg.inv(basis)
    corner = np.array([to_corner @ right, to_corner @ upward])
    projection = np.zeros((4, 4))
    projection[:2, :2] = 2 * distance * inverse
    projection[:2, 2] = 2 * inverse @ corner + 1
    projection[2, 2], projection[2, 3] = -(far + near) / (far - near), -2 * far * near / (far - near)
    projection[3, 2] = -1
    return projection, view
