"""Far slices: fine structure far behind a volume's front, in strong perspective, while the eye moves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ... import reference
from ...geometry.view import View
from ...optics.transfer import TransferFunction
from ...renderer import Renderer
from ...settings import Settings
from ...volume.grid import Volume
from . import plain, single_axis
from .case import Case, Finding, Progress, Scale, Strip, in_parts

Array = NDArray[np.float64]

# Where neither is stated: what a plain ray caster with as many samples shows, and half as much again.
PLAIN = 1.5
# How noise changes with the eye follows from the weights of voxels (tents) and of levels (1-2-1). Pixels are
# 2.8 to 5.2 voxels apart in a full run (2.9 to 5.4 in a quick one): level 1 is 0.39 blended in at the nearest
# slices and rules from 3.4 on, level 2 begins at 4.8. Over what the mean of 4 × 4 rays changes by, that makes
# 2.1 if slices count equally, as in alpha, and 3.0 if by what the haze lets through, squared. A third more is
# allowed.
NOISE = 4.0
# By the same weights the nearest slices keep 0.41 of the finer noise's changes, and (1 − 0.39)² = 0.37 of a
# checkerboard's, of which level 1 has nothing; all others keep less.
LESS = 0.5

_FOV_DEG = 75.0  # so that the view lies inside the volume's silhouette, which moves, too
_HAZE = TransferFunction([(0, (0.2, 0.4, 0.9), 0.0), (255, (1.0, 0.7, 0.4), 0.05)], 1.0)


def noise(n: int) -> Volume:
    """Far slices of random bytes that know nothing of their neighbours: the finest structure there is."""
    data = np.random.default_rng(3).integers(0, 256, (2 * n,) * 3) * _far(n)
    return Volume(data.astype(np.uint8), name="noise")


def checkerboard(n: int) -> Volume:
    """Far slices with 0 and 255 in turn along every axis: all structure is at the highest frequency."""
    data = 255 * (np.indices((2 * n,) * 3).sum(0) % 2) * _far(n)
    return Volume(data.astype(np.uint8), name="checkerboard")


def _far(n: int) -> NDArray[np.bool_]:
    """Slices that are not empty: the half behind, so that nothing near outshines them."""
    return (np.arange(2 * n) < n)[:, None, None]


def path(volume: Volume, frames: int, size: int) -> list[View]:
    """Views along z from near the volume's front, the eye going sideways by a fifth of a voxel."""
    front = volume.centre + np.array((0.0, 0.0, volume.extent[2] / 2 + volume.extent[2] / 16))
    eyes = [front + (0.2 * step, 0.03 * step, 0.0) for step in range(frames)]
    return [View.look_at(eye, eye - (0, 0, 1), (0, 1, 0), _FOV_DEG, (size, size)) for eye in eyes]


def supersampled(volume: Volume, transfer: TransferFunction, view: View, times: int) -> Array:
    """The reference's mean over times × times rays in each pixel."""
    width, height = view.size
    wall = view.wall
    fine = View.through_wall(
        view.eye,
        type(wall)(wall.lower_left, wall.lower_right, wall.upper_left, (times * width, times * height)),
    )
    picture = reference.render(volume, transfer, fine, tolerance=1e-3)
    return picture.reshape(height, times, width, times, 4).mean((1, 3))


def flicker(pictures: Sequence[NDArray[np.floating]]) -> float:
    """Temporal energy: mean square of the change from one picture to the next."""
    return float(np.mean(np.square(np.diff(np.asarray(pictures, np.float64), axis=0))))


def findings(volume: Volume, views: list[View], times: int) -> list[Finding]:
    """What flickers of one volume along a path."""
    truths = [supersampled(volume, _HAZE, view, times) for view in views]
    pictures = {}
    for name, levels in (("with levels of detail", True), ("without", False)):
        renderer = Renderer(volume, _HAZE, Settings(residual=0, level_of_detail=levels))
        pictures[name] = [renderer.render(view) for view in views]
    casts = [plain.cast(volume, _HAZE, view) for view in views]
    published = [single_axis.render(volume, _HAZE, view) for view in views]
    steady = flicker(truths)
    ours, without, cast, single = (
        flicker(frames) / steady for frames in (*pictures.values(), casts, published)
    )
    truth = truths[0].astype(np.float32)
    strips = [Strip(f"{volume.name}, {name}", frames[0], truth) for name, frames in pictures.items()]
    strips.append(Strip(f"{volume.name}, plain ray caster", casts[0], truth))
    unit = "× the supersampled reference's"
    return [
        Finding(
            f"{volume.name}: temporal energy with levels of detail",
            ours,
            NOISE if volume.name == "noise" else PLAIN * cast,
            "4/3 of the 3.0 that the weights of voxels (tents) and levels (1-2-1) make of noise"
            if volume.name == "noise"
            else "1.5 × a plain ray caster",
            unit,
            strips=strips,
            ray_caster=cast,
            single_axis=single,
        ),
        Finding(
            f"{volume.name}: temporal energy with levels of detail over that without",
            ours / without,
            LESS,
            "the nearest slices, with level 1 at 0.39, keep 0.41 of noise and 0.37 of a checkerboard",
        ),
    ]


def _findings_of(make: Callable[[int], Volume], scale: Scale) -> list[Finding]:
    volume = make(scale.pick(40, 64))
    return findings(volume, path(volume, scale.pick(4, 6), scale.pick(24, 40)), scale.pick(3, 4))


def run(scale: Scale, progress: Progress) -> list[Finding]:
    """Noise and a checkerboard."""
    parts = {make.__name__: partial(_findings_of, make) for make in (noise, checkerboard)}
    return in_parts(parts, scale, progress)


CASE = Case(
    "far-slices",
    "Far slices",
    "In strong perspective one pixel covers many voxels of the far slices; point samples of fine structure "
    "there alias, and flicker as soon as the eye moves. Where pixels are more than 2.4 voxels apart coarser "
    "levels of the volume take over, blended so that none of them pops.",
    run,
)
