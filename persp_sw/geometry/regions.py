"""Regions: which part of the volume is shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..arrays import number, vector
from ..errors import ViewError
from ..volume.grid import Volume

# Of the 27 regions that the crop's planes make, number x + 3·y + 9·z (0 below, 1 between, 2 above the planes
# of that axis) is shown where that bit is set. Names and bits as VTK's and VolumePro's.
CROP_FLAGS = {
    "subvolume": 0x0002000,  # the box between all the planes
    "fence": 0x2EBFEBA,  # between the planes of at least one axis
    "inverted_fence": 0x5140145,
    "cross": 0x0417410,  # between the planes of at least two axes
    "inverted_cross": 0x7BE8BEF,
}
ALL_REGIONS = (1 << 27) - 1


@dataclass(frozen=True)
class Cut:
    """A slab around a plane: only it is shown, or all but it.

    Parameters
    ----------
    plane
        (nx, ny, nz, d) in world: n·p + d = 0 is the slab's middle. The normal need not be a unit vector.
    thickness
        World units, ≥ 0; half of it on each side of the plane. A slab of thickness 0 shown inside shows
        nothing; shown outside it hides nothing.
    show
        "inside" or "outside".

    Raises
    ------
    ViewError
        Numbers missing, not finite or out of range, a normal that is zero, another word.

    Source: the cut plane of VolumePro (Pfister et al. 1999, section 4.4), which has one.
    """

    plane: Sequence[float]
    thickness: float
    show: Literal["inside", "outside"] = "inside"

    def __post_init__(self):
        object.__setattr__(self, "plane", _plane(self.plane, "a cut's plane"))
        object.__setattr__(self, "thickness", number(self.thickness, "a cut's thickness", ViewError, 0))
        if not isinstance(self.show, str) or self.show not in ("inside", "outside"):
            raise ViewError(f'a cut shows "inside" or "outside"; given {self.show!r}')


@dataclass(frozen=True)
class Regions:
    """Crop box, clip planes and slabs; what one of them hides is as if it were not there.

    Parameters
    ----------
    crop
        x0, x1, y0, y1, z0, z1 in voxel index coordinates, fractions allowed; clamped to the box of voxel
        centres. None: the whole box.
    clip
        Planes (nx, ny, nz, d) in world: kept where n·p + d ≥ 0. The normal need not be a unit vector.
    cut
        Slabs, shown alone or left out: `Cut`, or mappings with its fields.
    crop_flags
        Which of the 27 regions that the crop's planes make are shown: bit x + 3·y + 9·z, each 0 below, 1
        between, 2 above the planes of its axis; or one of VTK's names: subvolume (the box), fence,
        inverted_fence, cross, inverted_cross.

    Raises
    ------
    ViewError
        Numbers missing or not finite, a crop with x0 > x1, a plane whose normal is zero, flags that are no
        flags, or flags without a crop.
    """

    crop: Sequence[float] | None = None
    clip: Sequence[Sequence[float]] = ()
    cut: Sequence[Cut | Mapping[str, Any]] = ()
    crop_flags: int | str = CROP_FLAGS["subvolume"]

    def __post_init__(self):
        set_ = object.__setattr__
        if self.crop is not None:
            crop = vector(self.crop, "crop", ViewError, 6)
            if (crop[0::2] > crop[1::2]).any():
                raise ViewError(f"crop is [x0, x1, y0, y1, z0, z1] with x0 ≤ x1 …; given {crop.tolist()}")
            set_(self, "crop", tuple(crop.tolist()))
        rows = self.clip.ndim > 0 if isinstance(self.clip, np.ndarray) else isinstance(self.clip, Sequence)
        if not rows or isinstance(self.clip, str):
            raise ViewError(f"clip is a list of planes [nx, ny, nz, d]; given {self.clip!r}")
        set_(self, "clip", tuple(_plane(plane, "a clip plane") for plane in self.clip))
        if not isinstance(self.cut, Sequence) or isinstance(self.cut, str):
            raise ViewError(f"cut is a list of slabs {_CUT_FORM}; given {self.cut!r}")
        set_(self, "cut", tuple(_cut(slab) for slab in self.cut))
        set_(self, "crop_flags", _flags(self.crop_flags))
        if self.crop is None and self.crop_flags != CROP_FLAGS["subvolume"]:
            raise ViewError("crop_flags choose among the regions that crop's planes make: give crop, too")

    @property
    def convex(self) -> bool:
        """Whether `half_spaces` alone tell what is shown."""
        outside = any(slab.show == "outside" and slab.thickness > 0 for slab in self.cut)
        return self.crop_flags == CROP_FLAGS["subvolume"] and not outside

    def cells(self, volume: Volume) -> tuple[list[NDArray[np.float64]], NDArray[np.bool_]]:
        """The crop's regions, as far as they lie in the volume's box and have a thickness.

        Returns
        -------
        Their borders along x, y and z, object space, ascending; and which are shown: bool [x, y, z], one
        less along each axis than it has borders. No borders along an axis where the box has no thickness.
        """
        shown = np.array([self.crop_flags >> bit & 1 for bit in range(27)], bool).reshape(3, 3, 3).T
        borders = []
        for axis, count in enumerate(volume.size):
            ends = [0.0, count - 1.0]
            between = ends if self.crop is None else self.crop[2 * axis : 2 * axis + 2]
            edges = np.clip([0.0, *between, count - 1.0], *ends)
            filled = np.diff(edges) > 0
            shown = np.compress(filled, shown, axis)
            borders.append(np.unique(edges) if filled.any() else np.empty(0))
        return borders, shown

    def box(self, volume: Volume) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest corner of what the crop shows, object space xyz; low > high where nothing."""
        if self.crop_flags == CROP_FLAGS["subvolume"]:
            low, high = np.zeros(3), np.array(volume.size) - 1.0
            if self.crop is not None:
                crop = np.array(self.crop)
                low, high = np.maximum(low, crop[0::2]), np.minimum(high, crop[1::2])
            return low, high
        borders, shown = self.cells(volume)
        if not shown.any():
            return np.ones(3), np.zeros(3)
        cells = np.argwhere(shown)
        low = [b[n] for b, n in zip(borders, cells.min(0), strict=True)]
        high = [b[n + 1] for b, n in zip(borders, cells.max(0), strict=True)]
        return np.array(low), np.array(high)

    def planes(self, volume: Volume) -> NDArray[np.float64]:
        """(n, 4) rows (a_x, a_y, a_z, a_0) in object space, of the clip planes and slabs shown inside.

        Shown where a·p + a_0 ≥ 0 for all.
        """
        pose = volume.world_from_object
        rows = [np.array(plane) @ pose for plane in self.clip]
        for middle, half, show in self.slabs(volume):
            if show == "inside":
                rows += [middle + (0, 0, 0, half), (0, 0, 0, half) - middle]
        return np.array(rows).reshape(-1, 4)

    def slabs(self, volume: Volume) -> list[tuple[NDArray[np.float64], float, str]]:
        """Of each cut: row a in object space, half the thickness h, and show; |a·p + a_0| ≤ h in the slab."""
        found = []
        for slab in self.cut:
            plane = np.array(slab.plane) / np.linalg.norm(slab.plane[:3])
            found.append((plane @ volume.world_from_object, slab.thickness / 2, slab.show))
        return found

    def half_spaces(self, volume: Volume) -> np.ndarray:
        """(6 + n, 4) rows in object space: those of `box`, then `planes`.

        Where a·p + a_0 ≥ 0 for all of them is what is shown if `convex`, and holds it if not.
        """
        return np.concatenate([box_rows(*self.box(volume)), self.planes(volume)])


def box_rows(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
    """(6, 4) rows a: p is in the box where a·p + a_0 ≥ 0 for all."""
    return np.concatenate([np.column_stack([np.eye(3), -low]), np.column_stack([-np.eye(3), high])])


_CUT_FORM = "{plane: [nx, ny, nz, d], thickness: t, show: inside or outside}"


def _plane(value: Any, name: str) -> tuple[float, ...]:
    plane = tuple(vector(value, name, ViewError, 4).tolist())
    if not any(plane[:3]):
        raise ViewError(f"{name} [nx, ny, nz, d] needs a normal that is not zero")
    return plane


def _cut(value: Any) -> Cut:
    if isinstance(value, Cut):
        return value
    names = [field.name for field in fields(Cut)]
    if not isinstance(value, Mapping) or not {"plane", "thickness"} <= set(value) <= set(names):
        raise ViewError(f"a cut is {_CUT_FORM}; given {value!r}")
    return Cut(**value)


def _flags(value: Any) -> int:
    if isinstance(value, str) and value.lower() in CROP_FLAGS:
        return CROP_FLAGS[value.lower()]
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not whole or not 0 <= value <= ALL_REGIONS:
        raise ViewError(
            f"crop_flags is a whole number of 27 bits, 0 … {ALL_REGIONS}, or one of {', '.join(CROP_FLAGS)}; "
            f"given {value!r}"
        )
    return int(value)
