"""Where a volume stands in the room."""

from __future__ import annotations

import numpy as np

import persp_sw as psw

from .rig import Rig

# A patient stands upright and faces the viewer: room x = L, y = S, z = −P, of the files' L, P, S (left,
# posterior, superior).
ROOM_FROM_LPS = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def room_from_world(rig: Rig, volume: psw.Volume) -> np.ndarray:
    """(4, 4) similarity: metres of the room from the volume's world.

    As the rig says; by default the longest edge is 1 m long and the volume's middle is in the middle of the
    walls at the height of the eyes at rest. A volume that carries no pose of its own, only a spacing, stands
    the same way: its z up, its y away from the viewer.
    """
    placement = rig.placement
    if placement.room_from_world is not None:
        return np.array(placement.room_from_world, np.float64)
    longest = max(volume.extent) or max(volume.spacing)  # a single voxel has no edges
    middle = placement.centre
    if middle is None:
        middle = rig.middle
        middle[1] = rig.eyes.rest_pose.position[1]
    matrix = np.eye(4)
    matrix[:3, :3] = placement.size / longest * ROOM_FROM_LPS
    matrix[:3, 3] = np.asarray(middle) - matrix[:3, :3] @ volume.centre
    return matrix


def corners_in_room(room_from_world: np.ndarray, volume: psw.Volume) -> np.ndarray:
    """(8, 3) room corners of the box of voxel centres; of corner n, bits 0, 1, 2 are its x, y, z."""
    ends = np.array([[n & 1, n >> 1 & 1, n >> 2 & 1] for n in range(8)]) * (np.array(volume.size) - 1.0)
    pose = np.asarray(room_from_world) @ volume.world_from_object
    return ends @ pose[:3, :3].T + pose[:3, 3]
