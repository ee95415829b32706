"""The perspective shear-warp as it was published in 2001: one principal axis, no correction per ray.

Only the geometry differs from ours: scalars are classified after interpolation and summed in float32, without
early termination. It is numpy and slow; pictures of up to 256 × 256 are what it is for.

- One principal axis serves the whole picture. The paper determines it from the eye (section 2.3) and leaves
  open how; its authors' program, Virvo, takes the axis along which most of the box's corners are seen.
- The intermediate image has one pixel a voxel on the first slice (section 3.1), whatever the screen needs.
- A slice gives each of these pixels one sample: bilinear, or, where the pixel covers more than a voxel, by a
  footprint as wide as it (section 3.1: no original data values are ignored).
- Each slice's opacity is that of its distance to the next one along the axis, for every ray; a slice counts
  whole or not at all, the first and the last, and where a plane clips (section 3.3), too.
- The intermediate image is warped to the picture with bilinear look-ups (sections 3.2 and 4).

With the eye inside the slab of slices the method has no picture: its matrices are singular as the eye meets
the base plane, its scale refers to a first slice that is behind the eye, and the clip plane of section 3.5,
which is to let users look around inside, mends neither. There pictures are NaN.

Source: Schulze, Niemeier, Lang (2001). Their intermediate image lies on the slice k = 0, ours on the first,
which is a change of scale; `tests/test_single_axis.py` compares it with the paper's matrices
(`geometry/factorization.py`). What is better here: they had 8 bits a channel.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...arrays import Image, Vector
from ...geometry.regions import Regions
from ...geometry.view import View, Wall
from ...optics.transfer import TransferFunction
from ...volume.grid import Volume

Array = NDArray[np.float64]

_ROUNDING = 1e-9  # voxels


@dataclass(frozen=True, eq=False)
class Intermediate:
    """An intermediate image.

    Attributes
    ----------
    axis
        The principal axis, 0 (x), 1 (y) or 2 (z).
    pixels
        (h, w, 4) float32 linear, premultiplied.
    rays
        The view whose pixels they are: the same eye through the first slice.
    """

    axis: int
    pixels: Image
    rays: View


def principal_axis(volume: Volume, eye: Vector) -> int:
    """The axis along which most corners of the box are seen from `eye` (world); of equals z, then y.

    Source: `findPrincipalAxis` of Virvo (DeskVOX), by the paper's first author.
    """
    lengths = np.array(volume.spacing)
    corners = np.indices((2, 2, 2)).reshape(3, -1).T * (np.array(volume.size) - 1)
    farthest = np.abs((corners - _in_object(volume, eye)) * lengths)[:, ::-1].argmax(1)
    return 2 - int(np.bincount(farthest, minlength=3).argmax())


def render(
    volume: Volume,
    transfer: TransferFunction,
    view: View,
    regions: Regions | None = None,
    *,
    quality: float = 1.0,
) -> Image:
    """The picture of the perspective shear-warp as published.

    Parameters
    ----------
    volume, transfer, view, regions
        As for `persp_sw.reference.render`; the eye is at a point, regions are convex (ValueError).
    quality
        Pixels of the intermediate image for each voxel of the first slice, along each axis.

    Returns
    -------
    (height, width, 4) float32 linear, premultiplied, row 0 on top. NaN where the eye is in the slab of
    slices: between the first and the last along the principal axis, inside the volume or beside it.
    """
    width, height = view.size
    found = composite(volume, transfer, view, regions, quality=quality)
    if found is None:
        return np.full((height, width, 4), np.nan, np.float32)
    points = view.eye.position + view.directions()
    return _looked_up(found.pixels, found.rays.project(points))


def faces_of(
    volume: Volume,
    transfer: TransferFunction,
    view: View,
    regions: Regions | None = None,
    *,
    quality: float = 1.0,
) -> Iterator[tuple[Image, View]]:
    """The intermediate image and the view it is of, as `compositing.faces_of` has it of ours.

    Nothing where the method has no picture.
    """
    found = composite(volume, transfer, view, regions, quality=quality)
    if found is not None:
        yield found.pixels, found.rays


def composite(
    volume: Volume,
    transfer: TransferFunction,
    view: View,
    regions: Regions | None = None,
    *,
    quality: float = 1.0,
) -> Intermediate | None:
    """The intermediate image of what a view shows; None where the eye is in the slab of slices.

    Parameters as of `render`.
    """
    regions = regions or Regions()
    if view.eye.is_at_infinity:
        raise ValueError("the published method is built here for an eye at a point")
    if not regions.convex:
        raise ValueError("what these regions show is not convex: half-spaces cannot tell")
    axis = principal_axis(volume, view.eye.position)
    order = [(axis + 1) % 3, (axis + 2) % 3, axis]
    eye, size = _in_object(volume, view.eye.position)[order], np.array(volume.size)[order]
    if -_ROUNDING <= eye[2] <= size[2] - 1 + _ROUNDING:
        return None
    slices = np.arange(size[2]) if eye[2] < 0 else np.arange(size[2])[::-1]
    grow = np.abs(slices - eye[2]) / abs(slices[0] - eye[2])
    low, high = _shown(volume, view, order, eye, int(slices[0]), size, grow[-1])
    low, count = np.floor(low * quality) / quality - 1 / quality, np.ceil((high - low) * quality) + 3
    rays = _through(volume, view, order, int(slices[0]), low, count, quality)
    across = tuple(start + np.arange(n) / quality for start, n in zip(low, count, strict=True))

    transfer = transfer.with_unit(min(volume.spacing))
    standard = volume.data.transpose([2 - n for n in reversed(order)])
    planes = [np.append(plane[order], plane[3]) for plane in regions.half_spaces(volume)]
    thickness = float(volume.spacing[axis])
    pixels = np.zeros((len(across[1]), len(across[0]), 4), np.float32)
    clear = np.ones(pixels.shape[:2], np.float32)
    for k, larger in zip(slices, grow, strict=True):
        i, j = (e + (places - e) * larger for e, places in zip(eye, across, strict=False))
        values = _resampled(standard[k], i, j, max(1.0, larger / quality))
        for plane in planes:
            side = plane[0] * i + plane[1] * j[:, None] + plane[2] * k + plane[3]
            values[side < -_ROUNDING * np.linalg.norm(plane[:3])] = np.nan
        seen = np.nonzero(~np.isnan(values))
        alpha = -np.expm1(-transfer.extinction(values[seen]) * thickness).astype(np.float32)
        light = (clear[seen] * alpha)[:, None]
        pixels[seen] += light * np.append(transfer.colour(values[seen]), np.ones((len(light), 1)), 1).astype(
            np.float32
        )
        clear[seen] *= 1 - alpha
    return Intermediate(axis, pixels, rays)


def _in_object(volume: Volume, point: Vector) -> Array:
    return np.linalg.solve(volume.world_from_object, np.append(point, 1.0))[:3]


def _shown(
    volume: Volume, view: View, order: list[int], eye: Array, first: int, size: NDArray[np.intp], grow: float
) -> tuple[Array, Array]:
    """Lowest and highest (i, j) on the first slice of what the box and the view both cover; never empty."""
    ends = np.array([-eye[:2], size[:2] - 1 - eye[:2]])
    box = np.concatenate([ends, ends / grow])
    low, high = eye[:2] + box.min(0), eye[:2] + box.max(0)
    width, height = view.size
    corners = np.array([(x, y, 1) for x in (0, width) for y in (0, height)]) @ view.direction_from_pixel.T
    object_from_world = np.linalg.inv(volume.world_from_object[:3, :3])
    directions = (corners @ object_from_world.T)[:, order]
    along = directions[:, 2] * np.sign(first - eye[2])
    if (along > 1e-6 * np.linalg.norm(directions, axis=1)).all():
        met = eye[:2] + directions[:, :2] / along[:, None] * abs(first - eye[2])
        low, high = np.clip(met.min(0), low, high), np.clip(met.max(0), low, high)
    return low, high


def _through(
    volume: Volume, view: View, order: list[int], first: int, low: Array, count: Array, quality: float
) -> View:
    """The view of the eye through pixels on the first slice, the middle of the first of them at `low`."""

    def world(i: float, j: float) -> Array:
        place = np.ones(4)
        place[order] = i, j, first
        return (volume.world_from_object @ place)[:3]

    (left, top), (right, bottom) = low - 0.5 / quality, low + (count - 0.5) / quality
    pixels = int(count[0]), int(count[1])
    wall = Wall(world(left, bottom), world(right, bottom), world(left, top), pixels=pixels)
    return View.through_wall(view.eye, wall)


def _resampled(data: NDArray[np.generic], i: Array, j: Array, width: float) -> Array:
    """(len(j), len(i)) values of a slice [j, i]; NaN beyond it and beside a voxel without a value."""
    rows, columns = (_taps(places, n, width) for places, n in zip((j, i), data.shape, strict=True))
    known = np.isfinite(data)
    values = _blended(np.where(known, data, 0).astype(np.float64), rows, columns)
    if not known.all():
        values[_blended((~known).astype(np.float64), rows, columns) > 0] = np.nan
    beyond_j, beyond_i = (
        (places < -_ROUNDING) | (places > n - 1 + _ROUNDING)
        for places, n in zip((j, i), data.shape, strict=True)
    )
    values[beyond_j[:, None] | beyond_i] = np.nan
    return values


def _taps(places: Array, n: int, width: float) -> tuple[NDArray[np.intp], Array]:
    """(places, taps) voxels and weights of sum 1: a tent `width` voxels to either side, bilinear where 1."""
    width = min(width, n)
    places = np.clip(places, 0, n - 1)[:, None]
    voxels = np.floor(places - width).astype(np.intp) + 1 + np.arange(int(np.ceil(2 * width)))
    weights = np.maximum(1 - np.abs(places - voxels) / width, 0) * ((voxels >= 0) & (voxels < n))
    return np.clip(voxels, 0, n - 1), weights / weights.sum(1, keepdims=True)


def _blended(data: Array, rows: tuple, columns: tuple) -> Array:
    """Rows, then columns; not as products of matrices, whose threads would get in each other's way."""
    (row, row_weight), (column, column_weight) = rows, columns
    return np.einsum("it,jit->ji", column_weight, np.einsum("jt,jti->ji", row_weight, data[row])[:, column])


def _looked_up(pixels: Image, places: Array) -> Image:
    """Bilinear look-ups of an image at (…, 2) pixel coordinates; nothing is beyond it, or where NaN."""
    height, width = pixels.shape[:2]
    framed = np.pad(pixels, ((1, 1), (1, 1), (0, 0)))
    places = (
        np.where(np.isnan(places), -1, places) + 0.5
    )  # pixel (u, v) has its middle at u + ½, now at u + 1
    column, row = (np.clip(places[..., n], 0, end + 1) for n, end in enumerate((width, height)))
    left, top = np.minimum(column.astype(int), width), np.minimum(row.astype(int), height)
    x, y = (column - left)[..., None], (row - top)[..., None]
    upper = (1 - x) * framed[top, left] + x * framed[top, left + 1]
    lower = (1 - x) * framed[top + 1, left] + x * framed[top + 1, left + 1]
    return ((1 - y) * upper + y * lower).astype(np.float32)
