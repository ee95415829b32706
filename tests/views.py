"""Views, poses and eyes that tests share."""

import numpy as np

from persp_sw import View, Wall


def direction(*components):
    return np.array(components) / np.linalg.norm(components)


# Along axes, edges and corners, and in between, on all sides.
DIRECTIONS = [
    direction(0.42, 0.27, 0.87),
    direction(0.58, 0.55, 0.60),
    direction(-0.9, 0.3, 0.1),
    direction(0.1, -1.0, 0.2),
    direction(-0.5, -0.5, -0.7),
    direction(1, 0, 0),
    direction(0.02, 0.999, -0.03),
]


def random_rotation(rng):
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))


def random_pose(rng, *, spacing=(1.0, 1.0, 1.0), mirrored=False, shear=0.0):
    """An affine pose: rotation, spacing, shift; mirrored and sheared on request."""
    linear = random_rotation(rng) @ np.diag(spacing)
    linear = linear @ (np.eye(3) + shear * np.triu(rng.uniform(-1, 1, (3, 3)), 1))
    if mirrored:
        linear[:, 0] *= -1
    pose = np.eye(4)
    pose[:3, :3] = linear
    pose[:3, 3] = rng.uniform(-50, 50, 3)
    return pose


def view_of(volume, towards, distance=1.7, fovy=45.0, size=(64, 48), up=None):
    """A camera `distance` longest edges away from the middle, in world direction `towards`."""
    towards = np.asarray(towards, float)
    reach = distance * (max(volume.extent) or 1.0)
    if up is None:
        up = (0, 1, 0) if abs(towards[1]) < 0.95 else (0, 0, 1)
    return View.look_at(volume.centre + reach * towards, volume.centre, up, fovy, size)


def face_view(eye_image, number):
    """The view whose pixels are those of a face: what the face should hold, any ray caster can tell."""
    face = eye_image.faces[number]
    matrix = eye_image.world_from_tangents(number)
    eye = eye_image.eye.position
    low = np.array(face.origin)
    high = low + np.array(face.size) * face.pitch
    corners = [(low[0], high[1]), (high[0], high[1]), (low[0], low[1])]
    wall = Wall(*(eye + matrix @ (*corner, 1.0) for corner in corners), pixels=face.size)
    return View.through_wall(eye_image.eye, wall)
