"""Opacity extremes: nearly nothing, nearly everything, units of any size, and very many slices."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from ...arrays import Image, Vector
from ...geometry.view import View
from ...optics.transfer import MAX_OPACITY, TransferFunction
from ...settings import Settings
from ...volume import phantoms
from ...volume.grid import Volume
from ..exact import shown_part
from . import plain, single_axis
from .case import Case, Finding, Part, Progress, Scale, Strip, in_parts
from .compositing import DIRECTIONS, composite, faces_of, homogeneous, view_towards
from .thin_sheets import sheet_findings

Array = NDArray[np.float64]

# Alpha errs by float32 rounding, 6e-8 a slice, and depths, counted from the volume's front, by 6e-8 of the
# interval they are in: some twenty slices give 2e-6. Relative to the picture's largest where it is faint.
HOMOGENEOUS = 2e-6
# In a dense medium what counts is where a ray enters and leaves, up to 32 voxels from the front in float32:
# half a unit in the last place each, times the extinction per voxel.
ENDS = 2 * 2.0**-20
# A sum of n faint slices: n roundings by half a unit in the last place, 2^-24 of the sum, all one way.
ROUNDINGS = 2.0**-24
# The polynomial and the factors of one slice's alpha, the same in all: relative.
ONE_SLICE = 8e-7
# Bytes' entries are 8 a value, floats' 4095 over all values: look-ups differ by 1/16 + 255/8190 of a value at
# most, evenly spread, so by 1/√3 of it rms.
ENTRIES = (1 / 16 + 255 / 8190) / np.sqrt(3)
# Rounding a field to bytes: 1/√12 of a value, rms.
ROUNDED = 1 / np.sqrt(12)
# Standard deviations allowed for, of some ten thousand pixels.
DEVIATIONS = 5

COLOUR = (0.9, 0.6, 0.3)
SLICES = 2048


Faces = Callable[[Volume, TransferFunction, View], Iterable[tuple[Image, View]]]


def our_faces(volume: Volume, transfer: TransferFunction, view: View) -> Iterable[tuple[Image, View]]:
    """The pixels of each face that a view needs, and the view that they are of."""
    return faces_of(composite(volume, transfer, view))


def medium(opacity: float, unit: float = 1.0) -> TransferFunction:
    """One opacity, whatever the value."""
    return TransferFunction([(100.0, COLOUR, opacity)], unit)


def slab(spacing: float = 1.0) -> Volume:
    """A homogeneous box."""
    return phantoms.constant((17, 13, 15), 100.0, np.diag([spacing, spacing, spacing, 1.0]))


def slab_error(
    volume: Volume, transfer: TransferFunction, directions: tuple[Vector, ...], faces: Faces = our_faces
) -> float:
    """Largest error of alpha over the faces of several views, relative to the largest alpha."""
    worst = 0.0
    for towards in directions:
        for picture, rays in faces(volume, transfer, view_towards(volume, towards, (48, 36))):
            exact = homogeneous(volume, transfer, rays)[..., 3]
            worst = max(worst, float(np.abs(picture[..., 3] - exact).max() / exact.max()))
    return worst


def both_errors(
    volumes: list[tuple[Volume, TransferFunction, float]], directions: tuple[Vector, ...]
) -> tuple[float, float]:
    """Worst `slab_error`, each over its scale: ours, and of the shear-warp of 2001."""
    return tuple(
        max(slab_error(volume, transfer, directions, faces) / scale for volume, transfer, scale in volumes)
        for faces in (our_faces, single_axis.faces_of)
    )


def slab_findings(scale: Scale) -> list[Finding]:
    """A homogeneous box at opacities from 1e-6 to 1 − 1e-7 per unit, and in units from 1e-6 to 1e6."""
    directions = DIRECTIONS[: scale.pick(3, None)]
    faint, dense = (1e-6, 1e-4, 0.01, 0.5), (0.99, 1 - 1e-4, 1 - 1e-6, 1 - 1e-7)
    units = [10.0**power for power in scale.pick((-6, -3, 3, 6), range(-6, 7))]
    derived = "some twenty float32 roundings of 6e-8, and depths to 6e-8 of their interval"
    thin, thick, scaled, told = (
        both_errors(volumes, directions)
        for volumes in (
            [(slab(), medium(opacity), 1.0) for opacity in faint],
            [(slab(), medium(opacity), 1.0) for opacity in dense],
            [(slab(unit), medium(0.1, unit), 1.0) for unit in units],
            [(slab(), medium(0.1, unit), max(0.1 / unit, 1)) for unit in units],
        )
    )
    return [
        Finding(
            "opacity 1e-6 … 0.5 per unit: largest error of a homogeneous box",
            thin[0],
            HOMOGENEOUS,
            derived + "; relative to the largest alpha",
            single_axis=thin[1],
        ),
        Finding(
            "opacity 0.99 … 1 − 1e-7 per unit: largest error of a homogeneous box",
            thick[0],
            HOMOGENEOUS - ENDS * float(np.log1p(-MAX_OPACITY)),
            "and a ray's ends to 2^-21 voxels each, times the extinction 13.8",
            single_axis=thick[1],
        ),
        Finding(
            "all lengths times 1e-6 … 1e6: largest error of a homogeneous box",
            scaled[0],
            HOMOGENEOUS,
            derived,
            single_axis=scaled[1],
        ),
        Finding(
            "opacity unit 1e-6 … 1e6: largest error of a homogeneous box",
            told[0],
            HOMOGENEOUS + ENDS,
            "relative to the largest alpha, and to the extinction per voxel where it is above 1",
            single_axis=told[1],
        ),
        _held_finding(directions),
    ]


def _held_finding(directions: tuple[Vector, ...]) -> Finding:
    """What it changes that no opacity is above `MAX_OPACITY`: only very short paths tell."""
    opacity, volume, worst = 1 - 1e-7, slab(), 0.0
    given, held = -np.log1p(-opacity), -np.log1p(-MAX_OPACITY)
    for towards in directions:
        image = composite(volume, medium(opacity), view_towards(volume, towards, (48, 36)))
        for picture, rays in faces_of(image):
            entry, leave = shown_part(volume, rays)
            worst = max(worst, float(np.abs(picture[..., 3] + np.expm1(-given * (leave - entry))).max()))
    length = np.log(given / held) / (given - held)
    return Finding(
        "opacity 1 − 1e-7 held at 1 − 1e-6: largest change of a homogeneous box",
        worst,
        float(np.exp(-held * length) - np.exp(-given * length)) + HOMOGENEOUS,
        "most that exp(−13.8·L) and exp(−16.1·L) differ, at L = 0.07 units; nothing beyond one unit",
    )


def fog_findings(scale: Scale) -> list[Finding]:
    """Very many very faint slices, seen along them all."""
    volume = phantoms.constant((5, 5, SLICES), 100.0)
    ours, casts, published, strips = [], [], [], []
    for opacity in scale.pick((1e-6, 1e-3), (1e-6, 1e-5, 1e-4, 1e-3)):
        # From so far that all rays that meet the front leave by the back.
        view = view_towards(volume, (0, 0, 1), (24, 24), 40.0, np.degrees(3 / (40 * SLICES)))
        transfer = medium(opacity)
        image = composite(volume, transfer, view, level_of_detail=False, samples_per_interval=1)
        for picture, rays in faces_of(image):
            exact = homogeneous(volume, transfer, rays)
            whole = exact[..., 3] > 0.999 * exact[..., 3].max()
            cast = plain.cast(volume, transfer, rays)
            ours.append(_relative(picture, exact, whole))
            casts.append(_relative(cast, exact, whole))
            strips.append(Strip(f"{opacity:g} a slice", picture, exact.astype(np.float32), gain=1e4))
        for picture, rays in single_axis.faces_of(volume, transfer, view):
            exact = homogeneous(volume, transfer, rays)
            whole = exact[..., 3] > 0.999 * exact[..., 3].max()
            published.append(_relative(picture, exact, whole))
    return [
        Finding(
            "2,048 slices of faint fog: largest relative error",
            max(ours),
            SLICES * ROUNDINGS + ONE_SLICE,
            "2,048 float32 roundings of 2^-24 of the sum, all one way",
            strips=strips,
            ray_caster=max(casts),
            single_axis=max(published),
        )
    ]


def _relative(picture: NDArray[np.floating], exact: Array, where: NDArray[np.bool_]) -> float:
    return float(np.abs(picture[where, 3] / exact[where, 3] - 1).max())


def byte_findings(scale: Scale) -> list[Finding]:
    """The same picture from 8-bit voxels and from floats."""
    n = scale.pick(25, 49)
    z, y, x = np.indices((n, n, n))
    smooth = (120 + 100 * np.sin(0.5 * x) * np.cos(0.4 * y) * np.sin(0.3 * z + 0.7)).astype(np.float32)
    bytes_ = np.rint(smooth).astype(np.uint8)
    haze = TransferFunction([(0, (0.2, 0.4, 0.9), 0.0), (255, (1.0, 0.7, 0.4), 0.3)], 1.0)
    size = scale.pick((48, 36), (128, 96))

    def pictures(data: NDArray[np.generic]) -> list[Array]:
        volume = Volume(data)
        views = [view_towards(volume, towards, size) for towards in DIRECTIONS[:2]]
        return [composite(volume, haze, view).pixels for view in views]

    same, floats, rounded = pictures(bytes_.astype(np.float32)), pictures(smooth), pictures(bytes_)
    # Steepest slope of extinction in the value; colours differ by less. A sample counts by the light that
    # gets there: the squares of that sum up to 1 / (2 · extinction), which is 0.16 a voxel at the mean value.
    slope = 0.3 / 255 / (1 - 0.3)
    sum_of_samples = DEVIATIONS * slope * np.sqrt(1 / (2 * 0.16))
    return [
        Finding(
            "the same voxels as bytes and as floats: largest change of a pixel",
            _largest_change(same, rounded),
            float(ENTRIES * sum_of_samples),
            "5 σ: look-ups to the nearest of 8 entries a value, and of 4096, errors independent along a ray",
        ),
        Finding(
            "a smooth field rounded to bytes: largest change of a pixel",
            _largest_change(floats, rounded),
            float((ROUNDED + ENTRIES) * sum_of_samples),
            "5 σ: voxels off by 1/√12, and look-ups, errors independent along a ray",
        ),
    ]


def _largest_change(some: list[Array], others: list[Array]) -> float:
    return max(float(np.abs(one - other).max()) for one, other in zip(some, others, strict=True))


def termination_findings(scale: Scale) -> list[Finding]:
    """What stopping a ray early costs where nearly all is opaque."""
    worst, residual = 0.0, Settings().residual
    for opacity in (0.2, 0.6, 0.99, 1 - 1e-6):
        volume, transfer = slab(), medium(opacity)
        for towards in DIRECTIONS[: scale.pick(3, None)]:
            view = view_towards(volume, towards, (48, 36))
            for picture, rays in faces_of(composite(volume, transfer, view, residual=residual)):
                worst = max(worst, float(np.abs(picture - homogeneous(volume, transfer, rays)).max()))
    return [
        Finding(
            "rays that stop at the usual residual transparency: largest error",
            worst,
            residual + HOMOGENEOUS,
            "what is left behind a ray that stops: the residual itself",
        )
    ]


PARTS: dict[str, Part] = {
    "homogeneous boxes": slab_findings,
    "thin sheets": sheet_findings,
    "bytes and floats": byte_findings,
    "faint fog": fog_findings,
    "termination": termination_findings,
}


def run(scale: Scale, progress: Progress) -> list[Finding]:
    """All parts, one after the other."""
    return in_parts(PARTS, scale, progress)


CASE = Case(
    "opacity-extremes",
    "Opacity extremes",
    "Opacity per slice that is corrected by a power, kept in 8 bits, or summed over thousands of slices goes "
    "wrong where it is very small or very near 1: fog vanishes or bands, thin sheets change with the angle, "
    "and the look depends on the unit. Here opacity is an extinction per length, summed in float32, and one "
    "voxel of anything is weighed by the length of the ray that it stands for.",
    run,
)
