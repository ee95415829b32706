"""Where a volume stands in the room."""

from __future__ import annotations

import numpy as np

import persp_sw as psw

from .rig import Rig

# A patient stands upright: room x = L, y = S, z = −P, of the files' L, P, S (left, posterior, superior).
ROOM_FROM_LPS = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def room_from_world(rig: Rig, volume: psw.Volume) -> np.ndarray:
    """(4, 4) similarity: metres of the room from the volume's world.

    As the rig says; by default the longest edge is 1 m long and the volume's middle is in the middle of the
    walls at eye height. A volume that carries no pose of its own, only a spacing, stands the same way.
    """
    placement = rig.placement
    if placement.room_from_world is not None:
        return np.array(placement.room_from_world, np.float64)
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], np.float64)
    corners *= np.array(volume.size) - 1.0
    pose = volume.world_from_object
    centre = (corners @ pose[:3, :3].T + pose[:3, 3]).mean(0)
    edges = np.linalg.norm(pose[:3, :3], axis=0) * (np.array(volume.size) - 1.0)
    scale = placement.size / max(edges.max(), np.finfo(float).tiny)
    middle = placement.centre
    if middle is None:
        middle = rig.middle
        middle[1] = rig.eyes.rest_pose.position[1]
    matrix = np.eye(4)
    matrix[:3, :3] = scale * ROOM_FROM_LPS
    matrix[:3, 3] = np.asarray(middle) - matrix[:3, :3] @ centre
    return matrix
