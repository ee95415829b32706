"""Volumes of odd shapes and poses: tiny, thin, long, stretched, sheared, mirrored, far from the origin."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...arrays import Image, Matrix
from ...geometry.view import View
from ...optics.transfer import TransferFunction
from ...renderer import Renderer
from ...settings import Settings
from ...volume import phantoms
from ...volume.grid import Volume
from ..exact import shown_part
from ..metrics import max_error
from . import single_axis
from .case import Case, Finding, Progress, Scale, Strip
from .face_views import (
    TIMES_MIDPOINTS,
    WHY_TIMES_MIDPOINTS,
    face_view,
    judged_faces,
    rms_errors,
    rms_ratio,
    single_axis_ratio,
)

FAR = 1e6  # world units from the origin
MILLIMETRE = 1e-3  # the spacing there: the unit is the metre

# One picture told in two ways: another order of float32 roundings and, in few samples, the neighbouring
# entry of 4,096; as FLOAT32_IMAGE of the tests.
TOLD_TWICE = 3e-4

# Finer than a pixel of the picture, for how a magnified picture looks is another case.
_SETTINGS = Settings(quality=4, max_intermediate=512)
_COLOUR = np.array([0.9, 0.6, 0.3])
_SHOWN = ("2 × 2 × 2", "spacing 1 : 1 : 20", "mirrored and sheared")

Rows = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class Shape:
    """A volume's size (x, y, z) and pose; `linear` is (3, 3), world from voxel steps."""

    name: str
    size: tuple[int, int, int]
    linear: Rows = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    origin: tuple[float, float, float] = (0, 0, 0)

    @property
    def pose(self) -> Matrix:
        """(4, 4) world from object."""
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = self.linear, self.origin
        return pose


def _stretched(x: float, y: float, z: float) -> Rows:
    return (x, 0, 0), (0, y, 0), (0, 0, z)


_SHEARED: Rows = ((1.0, 0.5, -0.3), (0.0, 0.9, 0.4), (0.2, 0.0, 1.1))
_MIRRORED_AND_SHEARED: Rows = tuple((-x, y, z) for x, y, z in _SHEARED)


def shapes(scale: Scale) -> list[Shape]:
    """Volumes with something in their box; every one must come out right."""
    n, long = scale.pick(12, 40), scale.pick(512, 2048)
    return [
        Shape("2 × 2 × 2", (2, 2, 2)),
        Shape(f"{long} × 4 × 4", (long, 4, 4)),
        Shape(f"4 × {long} × 4", (4, long, 4)),
        Shape(f"4 × 4 × {long}", (4, 4, long)),
        Shape("spacing 1 : 1 : 20", (n, n, n // 2), _stretched(1, 1, 20)),
        Shape("spacing 20 : 1 : 1", (n // 2, n, n), _stretched(20, 1, 1)),
        Shape("spacing 1 : 1 : 1000", (n, n, 5), _stretched(1, 1, 1000)),
        Shape("sheared", (n, n, n), _SHEARED),
        Shape("mirrored and sheared", (n, n, n), _MIRRORED_AND_SHEARED),
        Shape("1e6 from the origin", (n, n, n), _stretched(*(MILLIMETRE,) * 3), (FAR, -FAR, FAR)),
    ]


def flat_sizes() -> list[tuple[int, int, int]]:
    """Sizes (x, y, z) of volumes one voxel thick, whose box holds nothing."""
    return [(1, 1, 1), (1, 9, 7), (9, 1, 7), (9, 7, 1), (1, 1, 7)]


def waves(shape: Shape) -> Volume:
    """Smooth float32 values in 0 … 1 of a shape's size and pose."""
    z, y, x = np.indices(shape.size[::-1]) + 0.5
    data = 0.5 + 0.17 * (np.sin(0.6 * x + 0.3 * y) + np.sin(0.5 * y - 0.4 * z + 1) + np.sin(0.7 * z + 2))
    return Volume(data.astype(np.float32), world_from_object=shape.pose)


def thickness(volume: Volume) -> float:
    """The box's shortest edge, world units."""
    return float(min(volume.extent))


def waves_function(volume: Volume) -> TransferFunction:
    """Transparent below 0.2, then denser and warmer; half of the light gets through where it is thin."""
    rows = [(0.2, (0.1, 0.3, 0.9), 0.0), (0.6, (0.95, 0.6, 0.2), 0.4), (1.0, (1, 1, 0.9), 0.8)]
    return TransferFunction(rows, thickness(volume))


def views_of(volume: Volume, pixels: int) -> list[View]:
    """The whole box from beyond a corner; and its middle from close to its broad side."""
    half = np.array(volume.extent) / 2
    axes = volume.world_from_object[:3, :3] / np.array(volume.spacing)
    corners = volume.centre + (np.indices((2, 2, 2)).reshape(3, -1).T * 2 - 1) * half @ axes.T

    away = axes @ (half * (0.7, 0.45, 1.0))
    away /= np.linalg.norm(away)
    whole = volume.centre + 2.2 * np.linalg.norm(half) * away
    rays = corners - whole
    angle = np.arccos(np.clip(-rays @ away / np.linalg.norm(rays, axis=1), -1, 1)).max()
    thin, middle, long = np.argsort(half, kind="stable")
    broad = axes @ np.array([1.0, 0.6, 0.3])[np.argsort([thin, middle, long])]
    close = volume.centre + 3 * (half[thin] + half[middle]) * broad / np.linalg.norm(broad)
    up = axes[:, thin] + 0.1 * axes[:, middle]
    return [
        View.look_at(whole, volume.centre, up, np.degrees(2.1 * angle), (pixels, pixels)),
        View.look_at(close, volume.centre, axes[:, long], 60, (pixels, pixels)),
    ]


def homogeneous_excess(shape: Shape) -> tuple[float, float]:
    """Largest error of any pixel of any face of a homogeneous box of that shape, over its bound.

    Ours, and of the shear-warp of 2001, NaN where it has no picture of a view.

    2e-6 for a few float32 roundings; half a unit in the last place of 1, 3e-8, for each slice, four times
    over for sub-slices; and the ends of a ray, counted from the volume's front, are known to 1.2e-7 of the
    way through it, of which opacity takes its share where the ray ends.
    """
    volume = phantoms.constant(shape.size, 100.0, shape.pose)
    transfer = TransferFunction([(100.0, tuple(_COLOUR), 0.6)], thickness(volume))
    extinction = float(transfer.extinction(100.0))
    renderer = Renderer(volume, transfer, Settings(residual=0))
    way_through = extinction * float(np.linalg.norm(volume.extent))

    def excess(pixels: Image, rays: View) -> float:
        entry, leave = shown_part(volume, rays)
        clear = np.exp(-extinction * (leave - entry))
        error = np.abs(pixels - (1 - clear)[..., None] * [*_COLOUR, 1]).max(-1)
        bound = 2e-6 + 1.2e-7 * max(shape.size) + clear * way_through * 1.2e-7
        return float(np.nan_to_num(error / bound, nan=np.inf).max())

    worst, published = 0.0, []
    for view in views_of(volume, 32):
        image = renderer.composite(view.eye, [view.wall])
        for number in range(len(image.faces)):
            worst = max(worst, excess(image.face_pixels(number), face_view(image, number)))
        published += [excess(*face) for face in single_axis.faces_of(volume, transfer, view)]
    return worst, max(published, default=float("nan"))


@dataclass(frozen=True, eq=False)
class Seen:
    """Waves in a shape from one view: RMS errors of a face's rays, of ours and of a plain ray caster."""

    shape: Shape
    ours_rms: float
    plain_rms: float
    strips: tuple[Strip, ...]
    published_ratio: float  # of the shear-warp of 2001, over a ray caster's on its rays

    @property
    def ratio(self) -> float:
        """Ours over the ray caster's; infinite where that one makes no error at all."""
        return rms_ratio(self.ours_rms, self.plain_rms)


def seen_waves(shape: Shape, pixels: int) -> list[Seen]:
    """Waves in a shape, from all of its views."""
    volume = waves(shape)
    renderer = Renderer(volume, waves_function(volume), Settings(intermediate_size=pixels))
    found = []
    for view in views_of(volume, pixels):
        faces = judged_faces(renderer, view)
        strips = [Strip(f"{shape.name}: rays of a face", face.ours, face.truth, gain=20) for face in faces]
        found.append(Seen(shape, *rms_errors(faces), tuple(strips), single_axis_ratio(renderer, view)))
    return found


def stored_otherwise(volume: Volume) -> dict[str, Volume]:
    """The same body in the world, its voxels stored along other axes: left-handed, in another order."""
    data, pose = volume.data, volume.world_from_object
    mirrored = pose.copy()
    mirrored[:3, 3] += pose[:3, 0] * (volume.size[0] - 1)
    mirrored[:3, 0] *= -1
    return {
        "mirrored": Volume(data[:, :, ::-1], world_from_object=mirrored),
        "axes in another order": Volume(data.transpose(2, 0, 1), world_from_object=pose[:, [1, 2, 0, 3]]),
    }


def moved(volume: Volume, view: View, offset: NDArray[np.float64]) -> tuple[Volume, View]:
    """A volume and a view, `offset` further in the world."""
    pose = volume.world_from_object.copy()
    pose[:3, 3] += offset
    wall, eye = view.wall, view.eye
    corners = {name: getattr(wall, name) + offset for name in ("lower_left", "lower_right", "upper_left")}
    return (
        Volume(volume.data, world_from_object=pose),
        View(replace(eye, position=eye.position + offset), replace(wall, **corners)),
    )


def change_when_stored_otherwise(shape: Shape, pixels: int) -> float:
    """Largest change of a picture when the same body is stored along other axes."""
    volume = waves(shape)
    transfer, (view, _) = waves_function(volume), views_of(volume, pixels)
    settings = replace(_SETTINGS, residual=0)
    picture = Renderer(volume, transfer, settings).render(view)
    return max(
        max_error(Renderer(other, transfer, settings).render(view), picture)
        for other in stored_otherwise(volume).values()
    )


def change_when_far(shape: Shape, pixels: int) -> float:
    """Largest change of the pictures of a shape when all is moved by 1e6."""
    volume = waves(replace(shape, origin=(0, 0, 0)))
    transfer, settings = waves_function(volume), replace(_SETTINGS, residual=0)
    changes = []
    for view in views_of(volume, pixels):
        there, seen_there = moved(volume, view, np.array(shape.origin))
        here = Renderer(volume, transfer, settings).render(view)
        changes.append(max_error(Renderer(there, transfer, settings).render(seen_there), here))
    return max(changes)


def far_bound(shape: Shape) -> float:
    """How much a picture may change 1e6 away.

    A float64 place there is known to half a unit in its last place, 1e6 · 1.1e-16; eye, wall and pose are
    four of them: 4.7e-10 metres, 5e-7 voxel of 1 mm. Values change by 0.3 and less a voxel, extinction by no
    more than its largest times that, and a ray is no longer than the volume's diagonal; then `TOLD_TWICE`.
    """
    volume = waves(shape)
    transfer = waves_function(volume)
    depth = float(transfer.extinction(1.0)) * float(np.linalg.norm(volume.extent))
    return TOLD_TWICE + 4 * FAR * 1.1e-16 / MILLIMETRE * 0.3 * depth


def flat_volumes() -> tuple[float, int]:
    """Of volumes one voxel thick: the largest number in any picture, and how many came without a warning."""
    largest, silent = 0.0, 0
    for size in flat_sizes():
        volume = Volume(np.full(size[::-1], 200, np.uint8))
        with _caught_warnings() as said:
            renderer = Renderer(volume, TransferFunction([(100, (1, 1, 1), 0.9)], 1.0))
        silent += len(said) != 1
        for towards in ((14, 9, 20), (0, 0.1, 20)):
            view = View.look_at(volume.centre + np.array(towards), volume.centre, (0, 1, 0), 40, (32, 32))
            largest = max(largest, float(np.abs(renderer.render(view)).max()))
    return largest, silent


@contextmanager
def _caught_warnings() -> Iterator[list[str]]:
    """What the renderer logs meanwhile, kept from the log."""
    said: list[str] = []

    def keep(record: logging.LogRecord) -> bool:
        said.append(record.getMessage())
        return False

    log = logging.getLogger("persp_sw")
    log.addFilter(keep)
    try:
        yield said
    finally:
        log.removeFilter(keep)


def run(scale: Scale, progress: Progress) -> list[Finding]:
    """The case."""
    every, pixels = shapes(scale), scale.pick(32, 128)
    excesses, seen, otherwise = {}, [], {}
    for number, shape in enumerate(every):
        progress(number, len(every), CASE.name)
        excesses[shape.name] = homogeneous_excess(shape)
        seen += seen_waves(shape, pixels)
        otherwise[shape.name] = change_when_stored_otherwise(shape, pixels)
    progress(len(every), len(every), CASE.name)
    largest, silent = flat_volumes()
    worst = max(seen, key=lambda one: np.nan_to_num(one.ratio, nan=np.inf))
    far = every[-1]
    excess = {name: ours for name, (ours, _) in excesses.items()}
    return [
        Finding(
            "largest number in pictures of volumes one voxel thick",
            largest,
            0,
            "their box holds nothing: nothing lies outside the voxels' centres",
        ),
        Finding("such volumes without one warning", silent, 0, "what is empty is said, once"),
        Finding(
            "homogeneous box: largest error of a face's pixel over its bound",
            max(excess.values()),
            1,
            f"closed form; float32 in every slice and at a ray's ends. Largest: {_largest(excess)}",
            single_axis=float(np.nanmax([of_2001 for _, of_2001 in excesses.values()])),
        ),
        Finding(
            "waves: RMS error of faces over a plain ray caster's, worst view of all shapes",
            worst.ratio,
            TIMES_MIDPOINTS,
            f"{WHY_TIMES_MIDPOINTS}. Worst: {worst.shape.name}, RMS {worst.ours_rms:.2g}",
            ray_caster=1,
            single_axis=float(np.nanmax([one.published_ratio for one in seen])),
            strips=[
                *worst.strips[:1],
                *(s.strips[0] for s in seen[::2] if s.shape.name in _SHOWN and s.strips),
            ],
        ),
        Finding(
            "the same body stored mirrored or along other axes: largest change",
            max(otherwise.values()),
            TOLD_TWICE,
            f"float32 in another order and the neighbouring entry. Largest: {_largest(otherwise)}",
        ),
        Finding(
            "1e6 metres from the origin, voxels of 1 mm: largest change",
            change_when_far(far, pixels),
            far_bound(far),
            "places known to 5e-7 voxel · slope of the extinction · way through, and the one before",
        ),
    ]


def _largest(values: dict[str, float]) -> str:
    return max(values, key=lambda name: np.nan_to_num(values[name], nan=np.inf))


CASE = Case(
    "shapes",
    "Shapes and poses: tiny, thin, long, stretched, sheared, mirrored, far away",
    "Shear-warp is mostly written for cubes of equal spacing: thick slices then get the opacity of thin "
    "ones, left-handed files come out mirrored, and a volume far from the origin trembles in float32. Here "
    "the whole affine pose enters the length of a slice interval along each ray, everything is taken to the "
    "volume's own axes in float64, and what holds nothing (one voxel thick) is empty and said so.",
    run,
)
