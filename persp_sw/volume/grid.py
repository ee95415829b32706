"""A volume: voxels on a regular grid with a pose in the world."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..arrays import FARTHEST, VOXEL_DTYPES, Matrix, Vector, Voxels, shown, vector
from ..errors import VolumeError

_WIDENED = {"bool": np.uint8, "int8": np.int16}  # everything else that is a real number becomes float32


@dataclass(frozen=True, eq=False, init=False)
class Volume:
    """Scalar voxels, their pose, and what is known of their origin.

    Parameters
    ----------
    data
        [z, y, x] real numbers. uint8, int16, uint16 and float32 are kept as they are; bool and int8 widen to
        uint8 and int16; other types become float32 (24 significant bits).
    spacing
        Distance of neighbouring voxel centres along x, y and z in world units. Not with `world_from_object`.
    world_from_object
        (4, 4) affine pose, world from voxel index (x, y, z); voxel [z, y, x] has its centre at the integer
        point. Any invertible affine map, mirrored and sheared ones too.
    orientation
        For patients: the letters of L R A P S I towards which x, y and z grow, such as "LPS"; else "".

    Attributes
    ----------
    value_range
        Smallest and largest finite value.
    nonfinite
        Number of NaN and infinite voxels. They are stored as NaN and are transparent, and so is every cell
        (8 voxels) that has one of them as a corner.

    Raises
    ------
    VolumeError
        Not three-dimensional, empty, complex, no finite value, or a pose that is singular or not finite.
    """

    data: Voxels
    world_from_object: Matrix
    orientation: str = ""
    name: str = ""
    value_range: tuple[float, float] = field(default=(0.0, 0.0))
    nonfinite: int = 0

    def __init__(
        self,
        data: Voxels,
        spacing: Vector | None = None,
        *,
        world_from_object: Matrix | None = None,
        orientation: str = "",
        name: str = "",
    ):
        data, nonfinite = _checked_voxels(data)
        finite = data[np.isfinite(data)] if nonfinite else data
        set_ = object.__setattr__
        set_(self, "data", data)
        set_(self, "world_from_object", _checked_pose(spacing, world_from_object))
        set_(self, "orientation", orientation)
        set_(self, "name", name)
        set_(self, "value_range", (float(finite.min()), float(finite.max())))
        set_(self, "nonfinite", nonfinite)

    @property
    def size(self) -> tuple[int, int, int]:
        """Number of voxels along x, y and z."""
        z, y, x = self.data.shape
        return x, y, z

    @property
    def spacing(self) -> tuple[float, float, float]:
        """Distance of neighbouring voxel centres along x, y and z, in world units."""
        x, y, z = np.linalg.norm(self.world_from_object[:3, :3], axis=0)
        return float(x), float(y), float(z)

    @property
    def centre(self) -> np.ndarray:
        """World position of the middle of the box of voxel centres."""
        middle = (np.array(self.size) - 1) / 2
        return self.world_from_object[:3, :3] @ middle + self.world_from_object[:3, 3]

    @property
    def extent(self) -> tuple[float, float, float]:
        """Edges of the box of voxel centres along x, y and z, in world units."""
        x, y, z = (np.array(self.size) - 1) * self.spacing
        return float(x), float(y), float(z)

    def with_spacing(self, spacing: Vector) -> Volume:
        """The same voxels at world = index · spacing; the pose is dropped."""
        return Volume(self.data, spacing, name=self.name)

    def __repr__(self) -> str:
        size = "×".join(map(str, self.size))
        return f"<Volume {self.name or 'unnamed'} {size} {self.data.dtype} spacing {self.spacing}>"


def _checked_voxels(data: Voxels) -> tuple[Voxels, int]:
    try:
        data = np.asarray(data)
    except ValueError:
        raise VolumeError(
            "a volume's voxels are an array [z, y, x]; given lists of unequal lengths"
        ) from None
    if data.ndim != 3:
        raise VolumeError(f"a volume has three axes [z, y, x]; given an array of shape {data.shape}")
    if data.size == 0:
        raise VolumeError(f"a volume needs at least one voxel; given shape {data.shape}")
    if data.dtype.kind not in "buif":
        raise VolumeError(f"voxels must be real numbers; given dtype {data.dtype}")
    native = data.dtype.newbyteorder("=")
    if native not in VOXEL_DTYPES:
        native = np.dtype(_WIDENED.get(native.name, np.float32))
    with np.errstate(over="ignore"):  # a float64 beyond float32 becomes infinite, which is counted below
        data = np.ascontiguousarray(data, dtype=native)
    if native.kind != "f":
        return data, 0
    finite = np.isfinite(data)
    nonfinite = data.size - int(np.count_nonzero(finite))
    if nonfinite == data.size:
        raise VolumeError(f"all {data.size} voxels are NaN or infinite; there is nothing to show")
    if nonfinite:
        data = np.where(finite, data, np.float32(np.nan))
    return data, nonfinite


def _checked_pose(spacing: Vector | None, world_from_object: Matrix | None) -> Matrix:
    if world_from_object is None:
        spacing = vector((1, 1, 1) if spacing is None else spacing, "spacing", VolumeError)
        if (spacing <= 0).any():
            raise VolumeError(f"spacing must be three positive numbers; given {spacing.tolist()}")
        return np.diag([*spacing, 1.0])
    if spacing is not None:
        raise VolumeError("give spacing or world_from_object, not both: the pose contains the spacing")
    try:
        pose = np.stack([vector(row, "a row of it", VolumeError, 4) for row in world_from_object])
        if pose.shape != (4, 4) or not np.array_equal(pose[3], (0, 0, 0, 1)):
            raise VolumeError("its last row is not 0, 0, 0, 1")
    except (TypeError, ValueError, VolumeError):
        raise VolumeError(
            f"world_from_object must be an affine (4, 4) matrix of finite numbers within ±{FARTHEST:g}; "
            f"given {shown(world_from_object)}"
        ) from None
    lengths = np.linalg.norm(pose[:3, :3], axis=0)
    if (lengths == 0).any() or abs(np.linalg.det(pose[:3, :3] / lengths)) < 1e-9:
        raise VolumeError(f"world_from_object is singular: its axes are {pose[:3, :3].T.tolist()}")
    return pose.copy()
