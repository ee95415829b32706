"""A room to look into where no rig file has been given."""

from __future__ import annotations

import persp_sw as psw

from ..pose import Pose
from ..rig import Eyes, Placement, Rig, RigWall


def four_walls() -> Rig:
    """Front, left, right and floor of 3 m × 3 m each: the room of `configs/cave4.toml`, without a tracker."""
    half, height = 1.5, 3.0
    corners = {
        "front": ((-half, 0, -half), (half, 0, -half), (-half, height, -half)),
        "left": ((-half, 0, half), (-half, 0, -half), (-half, height, half)),
        "right": ((half, 0, -half), (half, 0, half), (half, height, -half)),
        "floor": ((-half, 0, half), (half, 0, half), (-half, 0, -half)),
    }
    walls = [RigWall(psw.Wall(*three, pixels=(1024, 1024), name=name)) for name, three in corners.items()]
    eyes = Eyes(rest_pose=Pose((0.0, 1.7, 1.0)))
    placement = Placement(size=1.0, centre=(0.0, 1.3, 0.0))
    return Rig(walls, eyes, placement=placement, name="four-wall CAVE")
