"""Regions: which part of the volume is shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import vector
from ..errors import ViewError
from ..volume.grid import Volume


@dataclass(frozen=True)
class Regions:
    """Crop box and clip planes; what they hide is as if it were not there.

    Parameters
    ----------
    crop
        x0, x1, y0, y1, z0, z1 in voxel index coordinates, fractions allowed; clamped to the box of voxel
        centres. None: the whole box.
    clip
        Planes (nx, ny, nz, d) in world: kept where n·p + d ≥ 0. The normal need not be a unit vector.

    Raises
    ------
    ViewError
        Numbers missing or not finite, a crop with x0 > x1, or a plane whose normal is zero.
    """

    crop: Sequence[float] | None = None
    clip: Sequence[Sequence[float]] = ()

    def __post_init__(self):
        if self.crop is not None:
            crop = vector(self.crop, "crop", ViewError, 6)
            if (crop[0::2] > crop[1::2]).any():
                raise ViewError(f"crop is [x0, x1, y0, y1, z0, z1] with x0 ≤ x1 …; given {crop.tolist()}")
            object.__setattr__(self, "crop", tuple(crop.tolist()))
        if not isinstance(self.clip, (Sequence, np.ndarray)) or isinstance(self.clip, str):
            raise ViewError(f"clip is a list of planes [nx, ny, nz, d]; given {self.clip!r}")
        planes = tuple(tuple(vector(plane, "a clip plane", ViewError, 4).tolist()) for plane in self.clip)
        if any(not np.any(plane[:3]) for plane in planes):
            raise ViewError("a clip plane [nx, ny, nz, d] needs a normal that is not zero")
        object.__setattr__(self, "clip", planes)

    def box(self, volume: Volume) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest shown corner, object space xyz; low > high where the crop misses the volume."""
        low, high = np.zeros(3), np.array(volume.size) - 1.0
        if self.crop is not None:
            crop = np.array(self.crop)
            low, high = np.maximum(low, crop[0::2]), np.minimum(high, crop[1::2])
        return low, high

    def half_spaces(self, volume: Volume) -> np.ndarray:
        """(6 + planes, 4) rows (a_x, a_y, a_z, a_0) in object space: shown where a·p + a_0 ≥ 0 for all."""
        low, high = self.box(volume)
        box = [*np.column_stack([np.eye(3), -low]), *np.column_stack([-np.eye(3), high])]
        clip = [np.array(plane) @ volume.world_from_object for plane in self.clip]
        return np.array([*box, *clip])
