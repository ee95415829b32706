"""Eye + volume + optics → eye image."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from math import ceil

import numpy as np
from numpy.typing import NDArray

from . import _jit
from .arrays import Image
from .cancel import Cancel
from .eye_image import EyeImage
from .geometry.detail_zones import detail_zones
from .geometry.faces import Face
from .geometry.parts import Part
from .geometry.regions import Regions
from .geometry.view import Eye
from .kernels.composite import Rays
from .kernels.composite import composite as composite_face
from .kernels.scanline import Level
from .kernels.tables import AnyTable, IntegralTable, LitIntegralTable, LitTable, Table
from .optics.appearance import Appearance
from .optics.shading import shade_of
from .planning import EyePlan
from .sampling import Sampling, choose_sampling
from .settings import Settings
from .slabs import in_slabs, placed
from .volume.detail import DetailStore
from .volume.grid import Volume
from .volume.levels import STANDARD_AXES

# Voxels. Kernels count places in a row from a tile's first cell, up to some hundred, in float32.
_SAME_VOXEL = 1e-5


def composite_eye(
    detail: DetailStore,
    appearance: Appearance,
    regions: Regions,
    settings: Settings,
    plan: EyePlan,
    cancel: Cancel | None = None,
) -> EyeImage:
    """The eye image that all of the plan's walls need; no faces where no wall shows anything visible.

    `plan` is of these regions and of what `detail` shows now. `cancel` is looked at before every row of
    pixels; what is encoded, is encoded to the end.

    Raises
    ------
    Cancelled
        `cancel` was asked to.
    """
    cancel = cancel or Cancel()
    cancel.check()
    volume = detail.volume
    pose = volume.world_from_object
    eye, geometry, faces = plan.eye, plan.geometry, plan.faces(settings)
    pixels = np.zeros((sum(face.size[0] * face.size[1] for face in faces), 4), np.float32)
    threads = settings.threads or _jit.max_threads()
    box, half_spaces = np.array([geometry.low, geometry.high]), regions.planes(volume)
    image = EyeImage(eye, pose, tuple(faces), pixels, 0, box, half_spaces)
    images = [image.face_pixels(number) for number in range(len(faces))]
    sampling = choose_sampling(settings, appearance.classification, volume)
    reach = ceil(appearance.look.gradient_distance) if appearance.asks_gradients else 0
    # Zones, opposite faces and steps of depth have these in common.
    level = cache(partial(_level, detail, reach))
    table = cache(partial(_table, appearance, sampling.preintegrated, volume))

    def between(faces: Sequence[Face], images: Sequence[Image], nearest: float, farthest: float) -> int:
        limits = nearest, farthest
        return sum(
            _composite(
                detail, level, table, part, settings, sampling, eye, geometry.eye, face,
                plan.own_rays, threads, limits, cancel, out,
            )
            for face, out in zip(faces, images, strict=True)
            for part in plan.parts
        )  # fmt: skip

    if faces and settings.depth_slabs and not eye.is_at_infinity:
        if settings.depth_slabs > 1:
            return in_slabs(image, settings.depth_slabs, settings.residual, between)
        image = placed(image, between)
    samples = between(faces, images, 0.0, np.inf)
    return replace(image, samples=image.samples + samples)


def _composite(
    detail: DetailStore,
    level: Callable[[int, int, Part, bool], Level],
    table: Callable[[int], AnyTable],
    part: Part,
    settings: Settings,
    sampling: Sampling,
    eye: Eye,
    eye_object: NDArray[np.float64],
    face: Face,
    own_rays: bool,
    threads: int,
    distances: tuple[float, float],
    cancel: Cancel,
    out: Image,
) -> int:
    """Composite one part on one face, between two distances, behind what `out` holds; returns the samples."""
    volume = detail.volume
    axes = list(STANDARD_AXES[face.axis])
    linear = volume.world_from_object[:3, axes]
    least, preintegrated = sampling
    # Beyond own rays there are spare pixels only, which fill packets.
    per_interval = least if own_rays else face.samples_per_interval(least)
    low, high = part.low[axes], part.high[axes]
    (o_i, o_j), offset_pitch, (t_i, t_j), pitch, k_0 = face.rays(eye_object[axes])
    if eye.is_at_infinity and face.sign < 0:  # distances count from the last slice, which is in front
        last = volume.size[face.axis] - 1.0
        o_i, o_j, k_0 = o_i - t_i * (last - k_0), o_j - t_j * (last - k_0), last
    front, back = (face.sign * (k - k_0) for k in (low[2], high[2])[:: face.sign])
    base = max(front, 0.0)
    geometry = np.array(
        [
            o_i,
            o_j,
            offset_pitch,
            t_i,
            t_j,
            pitch,
            k_0,
            face.sign,
            base,
            least,
            eye.near,
            preintegrated,
        ]
    )
    half_spaces = part.half_spaces[:, [*axes, 3]]
    pairs = per_interval > 1 or preintegrated
    samples = np.zeros(out.shape[0], np.int64)
    taken = 0
    _jit.set_threads(threads)
    for zone in detail_zones(pitch, offset_pitch, back, len(detail) if settings.level_of_detail else 1):
        near, far = max(zone.near, distances[0]), min(zone.far, distances[1])
        if far <= max(front, near):
            continue
        # Distances along the axis as half-spaces: D ≥ near and D ≤ far.
        limits = [(0, 0, face.sign, -face.sign * k_0 - near)] * (near > 0)
        limits += [(0, 0, -face.sign, face.sign * k_0 + far)] * (far < np.inf)
        levels = [zone.fine, zone.fine + any(zone.share)]
        fine, coarse = (level(number, face.axis, part, pairs) for number in levels)
        composite_face(
            Rays(
                geometry,
                linear.T @ linear,
                np.array([*half_spaces, *limits], np.float64),
                np.array([near, far]),
                np.array(zone.share),
            ),
            per_interval,
            fine,
            coarse,
            table(face.axis),
            np.float32(settings.residual),
            threads,
            cancel.flag,
            samples,
            out,
        )
        cancel.check()
        taken += int(samples.sum())
    return taken


def _table(appearance: Appearance, preintegrated: bool, volume: Volume, axis: int) -> AnyTable:
    """What kernels need of a transfer function and its look, in standard space of principal axis `axis`."""
    classification, look, shadows = appearance
    mapping = np.float32(classification.origin), np.float32(classification.scale)
    table: Table | IntegralTable = Table(classification.rows, *mapping)
    if preintegrated:
        integrals = classification.integrals
        numbers = (np.float32(n) for n in (integrals.end, integrals.unit, integrals.steps))
        table = IntegralTable(integrals.sums, integrals.beyond, *mapping, *numbers)
    if not appearance.asks_gradients:
        return table
    shade = shade_of(look, volume, list(STANDARD_AXES[axis]), classification, shadows)
    if preintegrated:
        return LitIntegralTable(*table, integrals.places, *shade)
    return LitTable(*table, (classification.table[:, 3] > 0).astype(np.uint8), *shade)


def _level(
    detail: DetailStore,
    reach: int,
    number: int,
    axis: int,
    part: Part,
    pairs: bool,
) -> Level:
    """What the kernel needs of a part in level `number`; `reach`: voxels around what is visible."""
    store, axes = detail.store(number), list(STANDARD_AXES[axis])
    runs = store.axis(axis, pairs=pairs, reach=reach)
    factor = detail.levels.factor(number)[axes].astype(np.float64)
    box = np.column_stack([part.low[axes] / factor, part.high[axes] / factor])
    visible = store.visible_box()
    seen = box[1:] if visible is None else _overlap(box[1:], np.column_stack(visible)[axes[1:]])
    return Level(
        runs.visible,
        runs.pairs,
        runs.needed,
        runs.offsets,
        runs.voxels,
        factor,
        1 / factor,
        _on_voxels(box).ravel(),
        seen.ravel(),
        runs.size[2],
        runs.size[0],
    )


def _on_voxels(box: NDArray[np.float64]) -> NDArray[np.float64]:
    """Borders of a box at voxels where they all but lie on them: float32 cannot tell on which side."""
    nearest = np.rint(box)
    return np.where(np.abs(box - nearest) < _SAME_VOXEL, nearest, box)


def _overlap(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """Intervals (n, 2) in which both lie."""
    return np.column_stack([np.maximum(one[:, 0], other[:, 0]), np.minimum(one[:, 1], other[:, 1])])
