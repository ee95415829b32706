"""Clipping: planes where slices are, planes nearly along them, slivers, and nothing at all."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...geometry.regions import Cut, Regions
from ...optics.transfer import TransferFunction
from ...renderer import Renderer
from ...settings import Settings
from ...volume import phantoms
from ...volume.grid import Volume
from . import single_axis
from .case import Case, Finding, Part, Progress, Scale, Strip, in_parts
from .compositing import DIRECTIONS, composite, faces_of, homogeneous, view_towards
from .moving_plane import moving_findings

# Alpha errs by float32 rounding, 6e-8 a slice, and depths, counted from the volume's front, by 6e-8 of the
# interval they are in: a dozen slices give 1e-6.
HOMOGENEOUS = 2e-6
# Where a ray enters and leaves is known in float32, 10 voxels from the front to 5e-7: of a thin sliver, at
# most so much is missing or too much.
THIN = 1e-4
THIN_BRIGHTNESS = 2 * 5e-7 / THIN

MEDIUM = TransferFunction([(100.0, (0.9, 0.6, 0.3), 0.3)], 1.0)
SIZE = (11, 9, 10)


def box() -> Volume:
    """A homogeneous box, 10 × 8 × 9 voxel intervals."""
    return phantoms.constant(SIZE, 100.0)


def through_centres() -> list[Regions]:
    """Planes on slices of each axis, and diagonal ones through voxel centres."""
    planes = [(*sign * np.eye(3)[axis], -sign * 4.0) for axis in range(3) for sign in (1, -1)]
    diagonal = [(1, 1, 0, -9.0), (1, -1, 0, 0.0), (1, 1, 1, -14.0), (0, 2, -1, 0.0)]
    return [Regions(clip=[plane]) for plane in (*planes, *diagonal)]


def along_slices() -> list[Regions]:
    """Planes that make angles of 1e-12 … 0.01 with slices of each axis."""
    tilts = [10.0**power for power in (-12, -9, -7, -5, -3, -2)]
    return [
        Regions(clip=[plane])
        for a in tilts
        for plane in ((a, 2 * a, 1, -4), (-a, a, -1, 4), (1, a, -a, -5), (a, -1, 2 * a, 4))
    ]


def slivers() -> list[Regions]:
    """Pairs of planes 0.01 … 1e-6 voxels apart, slabs as thin, and a corner cut off."""
    found = []
    normal = np.array((0.3, -0.5, 0.8))
    for thickness in (1e-2, 1e-4, 1e-6):
        plane = np.append(normal, -2.1)
        length = float(np.linalg.norm(normal))
        found.append(Regions(clip=[plane, (*-normal, 2.1 + thickness * length)]))
        found.append(Regions(cut=[Cut((0.0, 0.0, 1.0, -4.0), thickness)]))
        found.append(Regions(crop=(3, 3 + thickness, 0, 8, 0, 9)))
        found.append(Regions(clip=[(-1, -1, -1, thickness)]))  # the corner at the origin
    return found


def nothing() -> list[Regions]:
    """Regions of which nothing is left."""
    return [
        Regions(clip=[(0, 0, 1, -6), (0, 0, -1, 3)]),
        Regions(clip=[(1, 1, 1, -1000)]),
        Regions(clip=[(1, 0, 0, -5), (-1, 0, 0, 5)]),
        Regions(clip=[(1, 2, 3, -7), (-1, -2, -3, 7)]),
        Regions(crop=(4, 4, 0, 8, 0, 9)),
        Regions(crop=(2.5, 2.5, 3.5, 3.5, 4.5, 4.5)),
        Regions(crop=(0, 10, 0, 8, 9, 9)),
        Regions(cut=[Cut((0.1, 0.2, 1, -4.5), 0)]),
        Regions(cut=[Cut((0, 0, 1, -3), 1), Cut((0, 0, 1, -6), 1)]),
    ]


def closed_form_finding(name: str, cases: list[Regions], scale: Scale) -> Finding:
    """The largest error of a homogeneous box of which these regions show a part."""
    volume, worst, strips = box(), 0.0, []
    published: list[float] = []
    for number, regions in enumerate(cases):
        for towards in DIRECTIONS[: scale.pick(3, None)]:
            view = view_towards(volume, towards, scale.pick((40, 30), (96, 72)))
            for picture, rays in faces_of(composite(volume, MEDIUM, view, regions)):
                exact = homogeneous(volume, MEDIUM, rays, regions)
                error = float(np.abs(picture - exact).max())
                if not strips or error > worst:
                    strips = [Strip(f"{name}, {number}", picture, exact.astype(np.float32), gain=1e4)]
                worst = max(worst, error)
            for picture, rays in single_axis.faces_of(volume, MEDIUM, view, regions):
                published.append(float(np.abs(picture - homogeneous(volume, MEDIUM, rays, regions)).max()))
    return Finding(
        f"{name}: largest error of a homogeneous box",
        worst,
        HOMOGENEOUS,
        "a dozen float32 roundings of 6e-8, and depths to 6e-8 of their interval",
        strips=strips,
        single_axis=max(published),
    )


def sliver_brightness(scale: Scale) -> Finding:
    """How much of a thin sliver's opacity is there, over whole pictures."""
    volume, worst, published = box(), 0.0, 0.0
    normal = np.array((0.3, -0.5, 0.8)) / np.linalg.norm((0.3, -0.5, 0.8))
    for regions in (
        Regions(clip=[(*normal, -2.1), (*-normal, 2.1 + THIN)]),
        Regions(crop=(3, 3 + THIN, 0, 8, 0, 9)),
    ):
        for towards in DIRECTIONS[: scale.pick(3, None)]:
            view = view_towards(volume, towards, scale.pick((40, 30), (96, 72)))
            for picture, rays in faces_of(composite(volume, MEDIUM, view, regions)):
                worst = max(worst, _brightness_error(picture, homogeneous(volume, MEDIUM, rays, regions)))
            for picture, rays in single_axis.faces_of(volume, MEDIUM, view, regions):
                exact = homogeneous(volume, MEDIUM, rays, regions)
                if exact.any():  # or none of its few pixels meets the sliver, edge on
                    published = max(published, _brightness_error(picture, exact))
    return Finding(
        f"slivers {THIN:g} voxels thick: relative error of the summed opacity",
        worst,
        THIN_BRIGHTNESS,
        "both ends of a ray's interval to 5e-7 voxels, over its length",
        single_axis=published,
    )


def _brightness_error(picture: NDArray[np.floating], exact: NDArray[np.floating]) -> float:
    return abs(float(picture[..., 3].sum(dtype=np.float64) / exact[..., 3].sum()) - 1)


def nothing_finding() -> Finding:
    """Pixels that show anything where nothing is left."""
    volume, shown = box(), 0
    for regions in nothing():
        renderer = Renderer(volume, MEDIUM, Settings(), regions)
        for towards in DIRECTIONS:
            picture = renderer.render(view_towards(volume, towards, (32, 24)))
            shown += int(np.count_nonzero(picture)) + int(np.count_nonzero(~np.isfinite(picture)))
    return Finding(
        "nothing left (planes that contradict, boxes and slabs of no thickness): numbers that are not 0",
        shown,
        0,
        "what has no volume has no opacity",
    )


def _closed_form(name: str, cases: list[Regions]) -> Part:
    return lambda scale: [closed_form_finding(name, cases, scale)]


def run(scale: Scale, progress: Progress) -> list[Finding]:
    """Planes at rest, then planes that move."""
    closed_form = {
        "planes through voxel centres": through_centres(),
        "planes nearly along slices": along_slices(),
        "slivers": slivers(),
    }
    parts: dict[str, Part] = {name: _closed_form(name, cases) for name, cases in closed_form.items()}
    parts["nothing left"] = lambda scale: [sliver_brightness(scale), nothing_finding()]
    parts["moving planes"] = moving_findings
    return in_parts(parts, scale, progress)


CASE = Case(
    "clipping",
    "Clipping",
    "Clipping by whole slices or samples makes a moving plane jump from slice to slice, frays planes that "
    "are nearly parallel to slices, and divides by zero where planes meet voxels or nothing is left. Here "
    "every ray has its own exact interval, and a slice stands for the part of it that is shown.",
    run,
)
