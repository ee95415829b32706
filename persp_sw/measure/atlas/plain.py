"""A plain ray caster at equal cost: what a method's errors are held against.

Equal steps along each ray, one trilinear look-up in the middle of each, classified there, summed in float32:
what every textbook has. It is numpy and slow; pictures of up to 256 × 256 are what it is for.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...arrays import Image
from ...geometry.regions import Regions
from ...geometry.view import View
from ...optics.transfer import TransferFunction
from ...volume.grid import Volume
from ..exact import shown_part

Array = NDArray[np.float64]


def cast(
    volume: Volume,
    transfer: TransferFunction,
    view: View,
    regions: Regions | None = None,
    *,
    per_interval: float = 1.0,
    samples: int | None = None,
) -> Image:
    """The picture of a plain, post-classified ray caster.

    Parameters
    ----------
    volume, transfer, view, regions
        As for `persp_sw.reference.render`; regions must be convex (ValueError).
    per_interval
        Samples between two voxel planes of the axis along which a ray runs most: a ray takes as many as our
        faces take of it, rounded up to whole ones.
    samples
        Of every ray, however long it is; instead of `per_interval`.

    Returns
    -------
    (height, width, 4) float32 linear, premultiplied, row 0 on top.

    Accuracy: midpoints of N pieces of a ray: second order in the step where classified values are smooth.
    """
    width, height = view.size
    image = np.zeros((height * width, 4), np.float32)
    if min(volume.size) == 1:
        return image.reshape(height, width, 4)
    transfer = transfer.with_unit(min(volume.spacing))
    starts, directions = _rays(volume, view)
    entry, leave = (end.ravel() for end in shown_part(volume, view, regions))
    with np.errstate(invalid="ignore"):
        pixels = np.flatnonzero(leave - entry > 0)
    starts, directions, entry, leave = (rows[pixels] for rows in (starts, directions, entry, leave))
    counts = _counts(np.abs(directions).max(-1) * (leave - entry), per_interval, samples)
    step = (leave - entry) / counts
    clear = np.ones(len(pixels), np.float32)
    for n in range(counts.max(initial=0)):
        going = np.flatnonzero(n < counts)
        places = starts[going] + directions[going] * (entry[going] + (n + 0.5) * step[going])[:, None]
        values = interpolated(volume, places)
        known = ~np.isnan(values)
        going, values = going[known], values[known]
        alpha = -np.expm1(-transfer.extinction(values) * step[going]).astype(np.float32)
        light = (clear[going] * alpha)[:, None]
        image[pixels[going], :3] += light * transfer.colour(values).astype(np.float32)
        image[pixels[going], 3:] += light
        clear[going] *= 1 - alpha
    return image.reshape(height, width, 4)


def interpolated(volume: Volume, places: Array) -> Array:
    """Trilinear values at (n, 3) object-space xyz in the box of voxel centres; NaN in cells with a NaN."""
    size = np.array(volume.size)
    places = np.clip(places, 0, size - 1)
    low = np.minimum(places.astype(np.intp), size - 2)
    x, y, z = (places - low).T
    i, j, k = low.T
    value = np.zeros(len(places))
    for dz, dy, dx in np.ndindex(2, 2, 2):
        weight = (x if dx else 1 - x) * (y if dy else 1 - y) * (z if dz else 1 - z)
        value += weight * volume.data[k + dz, j + dy, i + dx]
    return value


def _rays(volume: Volume, view: View) -> tuple[Array, Array]:
    """Starts and directions in object space, (pixels, 3) each; a direction is one world unit long."""
    object_from_world = np.linalg.inv(volume.world_from_object)
    starts = view.starts().reshape(-1, 3) @ object_from_world[:3, :3].T + object_from_world[:3, 3]
    directions = view.directions().reshape(-1, 3)
    directions = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    return starts, directions @ object_from_world[:3, :3].T


def _counts(intervals: Array, per_interval: float, samples: int | None) -> NDArray[np.intp]:
    if samples is not None:
        return np.full(len(intervals), samples)
    # A ray from voxel plane to voxel plane is not to take one more for a rounding.
    return np.maximum(np.ceil(per_interval * intervals * (1 - 1e-12)), 1).astype(np.intp)
