"""The rays of a view in object space, and the parts of them that are shown."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._jit import kernel
from ..geometry.regions import Regions
from ..geometry.view import View
from ..volume.grid import Volume

OPAQUE_DEPTH = -np.log(1e-9)  # a ray stops at transmittance 1e-9
# Columns of a ray's accumulator: RGB, optical depth, and what the last halvings changed.
DEPTH, CHANGE, STATES = 3, 4, 5

# What a plane is for, see `planes_of`.
_KEEP, _INSIDE, _OUTSIDE, _CROP, _SECOND = range(5)


class Rays(NamedTuple):
    """One ray for every pixel, row by row, in object space; distances along them are in world units.

    Attributes
    ----------
    starts
        (n, 3) the eye, or for an eye at infinity points on the wall.
    directions
        (n, 3) object units a world unit.
    sights
        (n, 3) unit vectors towards the eye, world.
    near
        Distance before which nothing is shown.
    """

    starts: NDArray[np.float64]
    directions: NDArray[np.float64]
    sights: NDArray[np.float64]
    near: float

    def part(self, first: int, last: int) -> Rays:
        """The rays number `first` … `last` − 1."""
        return Rays(self.starts[first:last], self.directions[first:last], self.sights[first:last], self.near)


class Shown(NamedTuple):
    """What is shown of the volume: planes in object space, see `planes_of`, and the crop's regions."""

    planes: NDArray[np.float64]
    kinds: NDArray[np.int64]
    crop_flags: int


def rays_of(view: View, volume: Volume) -> Rays:
    """The rays of all pixel centres."""
    object_from_world = np.linalg.inv(volume.world_from_object)
    starts = view.starts() @ object_from_world[:3, :3].T + object_from_world[:3, 3]
    near = -np.inf if view.eye.is_at_infinity else float(view.eye.near)
    world_directions = view.directions()
    world_directions /= np.linalg.norm(world_directions, axis=-1, keepdims=True)
    directions = world_directions @ object_from_world[:3, :3].T
    starts, directions, sights = (a.reshape(-1, 3) for a in (starts, directions, -world_directions))
    return Rays(starts, directions, sights, near)


def planes_of(regions: Regions, volume: Volume):
    """All planes that bound or divide what is shown, and what each is for.

    Returns
    -------
    planes
        (n, 4) rows in object space.
    kinds
        (n,): _KEEP, shown only where a·p + a_0 ≥ 0; _INSIDE and _OUTSIDE, the first of a slab's two rows, of
        which both or not both must be ≥ 0; _CROP, the first of an axis' two rows a·p − x0 and a·p − x1, the
        axes in the order x, y, z; _SECOND, the second of the two.
    """
    pose = volume.world_from_object
    rows, kinds = [], []
    for axis, unit in enumerate(np.eye(3)):
        rows += [(*unit, 0.0), (*-unit, volume.size[axis] - 1.0)]
        kinds += [_KEEP, _KEEP]
    for plane in regions.clip:
        rows.append(np.array(plane) @ pose)
        kinds.append(_KEEP)
    for cut in regions.cut:
        plane, reach = np.array(cut.plane), cut.thickness / 2 * np.linalg.norm(cut.plane[:3])
        rows += [(plane + (0, 0, 0, reach)) @ pose, ((0, 0, 0, reach) - plane) @ pose]
        kinds += [_INSIDE if cut.show == "inside" else _OUTSIDE, _SECOND]
    for axis, unit in enumerate(np.eye(3)):
        if regions.crop is not None:
            rows += [(*unit, -x) for x in regions.crop[2 * axis : 2 * axis + 2]]
            kinds += [_CROP, _SECOND]
    return np.array(rows, np.float64), np.array(kinds)


@kernel
def at_plane(eye, direction, distance, plane):
    """a·p + a_0 on the ray; the eye's where the ray runs along the plane, which no rounding then disturbs."""
    offset = plane[0] * eye[0] + plane[1] * eye[1] + plane[2] * eye[2] + plane[3]
    slope = plane[0] * direction[0] + plane[1] * direction[1] + plane[2] * direction[2]
    return offset + slope * distance if slope != 0 else offset


@kernel
def cut_ray(eye, direction, near, planes, kinds, ends):
    """Fill `ends` with the distances at which the ray may begin or cease to be shown, ascending; how many."""
    entry, leave = near, np.inf
    count = 0
    for k in range(len(planes)):
        plane = planes[k]
        slope = plane[0] * direction[0] + plane[1] * direction[1] + plane[2] * direction[2]
        crossing = -at_plane(eye, direction, 0.0, plane) / slope if slope != 0 else -np.inf
        if kinds[k] != _KEEP:
            ends[count] = crossing
            count += 1
        elif slope > 0:
            entry = max(entry, crossing)
        elif slope < 0:
            leave = min(leave, crossing)
        elif at_plane(eye, direction, 0.0, plane) < 0:
            return 0
    if not entry < leave:
        return 0
    for n in range(count):
        ends[n] = min(max(ends[n], entry), leave)
    ends[count], ends[count + 1] = entry, leave
    count += 2
    for n in range(1, count):  # insertion sort: a handful of numbers
        value, m = ends[n], n - 1
        while m >= 0 and ends[m] > value:
            ends[m + 1] = ends[m]
            m -= 1
        ends[m + 1] = value
    return count


@kernel
def is_shown(eye, direction, distance, planes, kinds, crop_flags):
    """Whether slabs and crop show the ray's point at a distance; what only keeps one side is not asked.

    A ray in a border is in the slab or the box, if that has a thickness.
    """
    region, weight = 0, 1
    for k in range(len(planes)):
        kind = kinds[k]
        if kind in (_KEEP, _SECOND):
            continue
        first = at_plane(eye, direction, distance, planes[k])
        second = at_plane(eye, direction, distance, planes[k + 1])
        if kind == _CROP:
            region += weight * (0 if first < 0 else 1 if second < 0 or second == 0 < first else 2)
            weight *= 3
        elif (first >= 0 and second >= 0 and first + second > 0) != (kind == _INSIDE):
            return False
    return weight == 1 or (crop_flags >> region) & 1 == 1


@kernel
def first_plane(position, step, count):
    """Cell that holds `position`, and the voxel plane through which a ray leaves it."""
    cell = min(max(int(np.floor(position)), 0), count - 2)
    return cell, cell + (1 if step > 0 else 0)


@kernel
def reach_of(plane, eye, step):
    """Distance at which the ray reaches a voxel plane."""
    return (plane - eye) / step if step != 0 else np.inf
