"""A made-up four-wall CAVE: its walls, a volume in it, and the eyes of a viewer who moves a little.

The room is 3 m wide with walls in front, left, right and a floor; its centre is 1.5 m above the floor. The
viewer's eyes, 6.5 cm apart, are 1.7 m above the floor and 1.0 m behind the centre; a volume stands
with its centre 0.3 m before the room's. Room space is the volume's world here: metres, y up.
"""

from __future__ import annotations

import numpy as np

from ..geometry.view import Eye, Wall
from ..volume.grid import Volume

CENTRE = (0.0, 1.5, -0.3)  # of the volume
HALF, HEIGHT = 1.5, 3.0
SEPARATION = 0.065
_HEAD, _STEP = np.array((0.0, 1.7, 1.0)), np.array((0.002, 0.001, 0.0))  # at first; from frame to frame


def four_walls(size: int) -> list[Wall]:
    """Front, left, right and floor, each of size × size pixels."""
    a, h = HALF, HEIGHT
    corners = {
        "front": ((-a, 0, -a), (a, 0, -a), (-a, h, -a)),
        "left": ((-a, 0, a), (-a, 0, -a), (-a, h, a)),
        "right": ((a, 0, -a), (a, 0, a), (a, h, -a)),
        "floor": ((-a, 0, a), (a, 0, a), (-a, 0, -a)),
    }
    return [Wall(*map(np.array, wall), (size, size), name) for name, wall in corners.items()]


def eye_pair(frame: int) -> tuple[Eye, Eye]:
    """Left and right eye in frame `frame` of a short path; every frame is new."""
    left, right = (_HEAD + frame * _STEP + ((side - 0.5) * SEPARATION, 0, 0) for side in (0, 1))
    return Eye(left), Eye(right)


def placed(volume: Volume, longest: float = 1.0) -> Volume:
    """The voxels in the room, axes along the room's, the longest edge `longest` metres."""
    spacing = np.array(volume.spacing) * longest / max(volume.extent)
    pose = np.diag([*spacing, 1.0])
    pose[:3, 3] = CENTRE - spacing * (np.array(volume.size) - 1) / 2
    return Volume(volume.data, world_from_object=pose, name=volume.name)
