"""Waste: samples a compositor took over samples it could not do without.

A sample counts if its ray meets some wall, it lies in the shown part of the volume, its extinction is above
0, and what lies before it lets more light through than the residual at which rays stop. The count is made in
float64, ray by ray on the same pixels, with as many samples in an interval, on slices and between, at the
finest level, with no store, no mask, no packet and no skipping.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .. import _jit
from ..eye_image import EyeImage
from ..geometry.regions import Regions
from ..geometry.view import View, Wall
from ..kernels.count import count_samples
from ..kernels.scanline import STEEP
from ..optics.classification import Classification
from ..optics.transfer import MAX_OPACITY, TransferFunction
from ..sampling import choose_sampling
from ..settings import Settings
from ..volume.grid import Volume
from ..volume.levels import STANDARD_AXES, standard_rows

RAYS = 1 << 16  # of larger faces about so many are looked at, evenly spread


def samples_that_count(
    eye_image: EyeImage,
    walls: Sequence[Wall],
    volume: Volume,
    transfer: TransferFunction,
    settings: Settings,
    regions: Regions | None = None,
) -> float:
    """Samples that an ideal compositor would take for this eye image.

    Parameters
    ----------
    walls
        Those the eye image was composited for.

    Returns
    -------
    A whole number for faces of up to `RAYS` pixels; of larger ones a part of the rays is counted and
    extrapolated.
    """
    regions = regions or Regions()
    transfer = transfer.with_unit(min(volume.spacing))
    if min(volume.size) < 2:
        return 0.0
    least = choose_sampling(settings, Classification.of(transfer, volume), volume).samples_per_interval
    points = np.column_stack([transfer.values, transfer.opacities])
    half_spaces = regions.half_spaces(volume)
    object_from_world = np.linalg.inv(volume.world_from_object)
    eye = object_from_world[:3, :3] @ eye_image.eye.position + object_from_world[:3, 3]
    views = [View(eye_image.eye, wall) for wall in walls]
    _jit.set_threads(settings.threads or _jit.max_threads())
    total = 0.0
    for number, face in enumerate(eye_image.faces):
        axes = list(STANDARD_AXES[face.axis])
        stride = max(1, round(np.sqrt(face.size[0] * face.size[1] / RAYS)))
        tangents, directions = _rays(eye_image, number, stride)
        shown = _shown(directions, views)
        if len(eye_image.faces) > 1:  # each ray belongs to one of them; aprons show nothing
            shown &= np.abs(tangents).max(-1) <= 1
        kept, lengths = tangents[shown], np.linalg.norm(directions[shown], axis=-1)
        steepest = np.abs(kept).max(-1, initial=0.0)
        steps = np.where(steepest > 2 * STEEP, 4, np.where(steepest > STEEP, 2, 1))
        counts = np.zeros(len(kept), np.int64)
        count_samples(
            kept,
            np.maximum(steps, least),
            lengths,
            np.array(
                [
                    *eye[axes],
                    face.sign,
                    eye_image.eye.near,
                    settings.residual,
                    transfer.opacity_unit,
                    MAX_OPACITY,
                ]
            ),
            np.ascontiguousarray(half_spaces[:, [*axes, 3]]),
            points,
            standard_rows(volume, face.axis),
            counts,
        )
        total += float(counts.sum()) * face.size[0] * face.size[1] / len(tangents)
    return total


def _rays(eye_image: EyeImage, number: int, stride: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Tangents (n, 2) and world directions a slice interval (n, 3) of every `stride`-th pixel each way."""
    face = eye_image.faces[number]
    start = stride // 2
    u, v = np.meshgrid(np.arange(start, face.size[0], stride), np.arange(start, face.size[1], stride))
    tangents = np.stack([u.ravel() + 0.5, v.ravel() + 0.5], -1) * face.pitch + face.origin
    ones = np.ones((len(tangents), 1))
    return tangents, np.hstack([tangents, ones]) @ eye_image.world_from_tangents(number).T


def _shown(directions: NDArray[np.float64], views: Sequence[View]) -> NDArray[np.bool_]:
    shown = np.zeros(len(directions), bool)
    for view in views:
        at = view.project(directions + view.eye.position)
        with np.errstate(invalid="ignore"):
            shown |= ((at >= 0) & (at <= view.size)).all(-1)
    return shown
