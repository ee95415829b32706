"""Eyes on slices, voxels, sides, edges and corners of the box, inside, in a hollow, and on the way through.

Every place is where some method divides by a distance that becomes zero, or takes another branch: the slice
that the eye is in, the side that it is in the plane of, the slices that change from before to behind it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ... import reference
from ...arrays import Image
from ...geometry.view import View
from ...optics.classification import Classification
from ...optics.transfer import TransferFunction
from ...renderer import Renderer
from ...settings import Settings
from ...volume.grid import Volume
from ..metrics import psnr
from . import single_axis
from .case import Case, Finding, Progress, Scale, Strip
from .face_views import judged_faces, rms_errors
from .plain import cast

STEP = 1e-6  # voxels
FOVY = 75.0  # degrees; several faces show from within

# From inside, quality 1, smooth transfer functions: as INSIDE_SMOOTH_DB of the tests, the goal of such views.
INSIDE_DB = 40.0

FUNCTION = TransferFunction(
    [(40, (0.1, 0.3, 0.9), 0), (110, (0.95, 0.6, 0.25), 0.05), (255, (1, 0.95, 0.85), 0.3)], 1.0
)
_SHOWN = ("a side of the box", "a corner", "a voxel", "a hollow")


@dataclass(frozen=True)
class Place:
    """Where an eye stands in a volume, which way it goes and what it looks at, all in voxels, xyz."""

    name: str
    eye: tuple[float, float, float]
    way: tuple[float, float, float]
    target: tuple[float, float, float]

    def view(self, step: float, pixels: int) -> View:
        """The view from `step` · way beyond the place; what it looks at goes along."""
        moved = step * np.array(self.way)
        return View.look_at(
            np.array(self.eye) + moved, np.array(self.target) + moved, (0, 0.1, 1), FOVY, (pixels, pixels)
        )


@dataclass(frozen=True, eq=False)
class Crossing:
    """What an eye saw on its way through a place: pictures a step apart, the middle one at the place."""

    place: Place
    ours: list[Image]
    to_the_end: list[Image]  # ours where no ray stops early
    truth: list[NDArray[np.float64]]
    caster: list[Image]
    published: list[Image]  # of the shear-warp of 2001
    rms: tuple[float, float]  # on the faces at the place, of ours and of the plain ray caster

    def jump(self, pictures: list[Image]) -> float:
        """Largest change of a pixel in one step beyond the largest that the reference makes."""
        change, true_change = (
            float(np.abs(np.diff(np.asarray(p, np.float64), axis=0)).max()) for p in (pictures, self.truth)
        )
        return change - true_change

    @property
    def middle(self) -> int:
        """Number of the picture at the place itself."""
        return len(self.ours) // 2


def hollow_waves(n: int) -> Volume:
    """n³ bytes, visible everywhere but in a ball-shaped hollow: the volume's box is that of what is seen."""
    z, y, x = np.indices((n, n, n)) / (n - 1.0)
    waves = np.sin(9 * x + 4 * y) + np.sin(8 * y - 5 * z + 1) + np.sin(7 * z + 6 * x * y + 2)
    distance = np.sqrt((x - 0.6) ** 2 + (y - 0.55) ** 2 + (z - 0.42) ** 2)
    filled = np.clip((distance - 0.17) / 0.1, 0, 1)
    return Volume(np.rint((150 + 30 * waves) * filled * filled * (3 - 2 * filled)).astype(np.uint8))


def places(n: int) -> list[Place]:
    """Places in `hollow_waves(n)`."""
    last = n - 1.0
    i, j, k = (float(round(part * last)) for part in (0.3, 0.44, 0.37))
    hollow = (0.6 * last, 0.55 * last, 0.42 * last)
    inwards = (0.7 * last, 0.4 * last, 0.55 * last)
    return [
        Place("a slice", (i, j + 0.3, k + 0.7), (1, 0, 0), inwards),
        Place("along a slice", (i, j + 0.3, k), (1, 0.3, 0), (inwards[0], inwards[1], k)),
        Place("a voxel", (i, j, k), (1, 0.3, 0.2), inwards),
        Place("a side of the box", (0, j + 0.3, k + 0.7), (1, 0, 0), inwards),
        Place("the far side, on the way out", (last, j + 0.3, k + 0.7), (1, 0, 0), (0.2 * last, j, k)),
        Place("a side, looking along it", (0, j + 0.3, k + 0.7), (1, 0, 0), (0.5, 1.2 * last, k)),
        Place("an edge", (0, 0, k + 0.3), (1, 0.7, 0), inwards),
        Place("a corner", (0, 0, 0), (1, 0.7, 0.4), inwards),
        Place("inside", (i + 0.31, j + 0.62, k + 0.4), (1, 0.2, 0.1), inwards),
        Place("a hollow", hollow, (1, 0.3, 0.2), (0.1 * last, 0.2 * last, 0.8 * last)),
    ]


def jump_bound(volume: Volume) -> float:
    """How far a pixel may jump in a step so small that nothing else changes.

    A look-up may fall on the neighbouring entry of the table, which differs by Δτ at most: Δτ · √3 of optical
    depth, as an interval is up to √3 long. Two samples of one ray that do so in one step are allowed for.
    """
    extinction = Classification.of(FUNCTION, volume).table[1:, 3]
    return float(2 * np.sqrt(3) * np.abs(np.diff(extinction)).max())


def crossings(scale: Scale, progress: Progress) -> list[Crossing]:
    """Pictures on the way through all places."""
    n, pixels, beside = scale.pick(48, 64), scale.pick(32, 128), scale.pick(1, 3)
    volume = hollow_waves(n)
    renderer, to_the_end = (Renderer(volume, FUNCTION, settings) for settings in (None, Settings(residual=0)))
    found = []
    every = places(n)
    for number, place in enumerate(every):
        progress(number, len(every), CASE.name)
        views = [place.view(steps * STEP, pixels) for steps in range(-beside, beside + 1)]
        found.append(
            Crossing(
                place,
                [renderer.render(view) for view in views],
                [to_the_end.render(view) for view in views],
                [reference.render(volume, FUNCTION, view, tolerance=1e-7) for view in views],
                [cast(volume, FUNCTION, view) for view in views],
                [single_axis.render(volume, FUNCTION, view) for view in views],
                rms_errors(judged_faces(renderer, views[beside])),
            )
        )
    progress(len(every), len(every), CASE.name)
    return found


def run(scale: Scale, progress: Progress) -> list[Finding]:
    """The case."""
    found = crossings(scale, progress)
    pairs = [(ours, truth) for c in found for ours, truth in zip(c.ours, c.truth, strict=True)]
    lost = sum(int(np.count_nonzero(~np.isfinite(ours))) for ours, _ in pairs)
    empty = sum(bool(not ours[..., 3].mean() >= 0.5 * truth[..., 3].mean()) for ours, truth in pairs)
    quantum = jump_bound(hollow_waves(8))
    residual = Settings().residual
    decibels, casters = -20 * np.log10([c.rms for c in found]).T
    worst = int(np.argmin(np.nan_to_num(decibels)))
    sharpest = max(found, key=lambda c: np.nan_to_num(c.jump(c.to_the_end), nan=np.inf))
    caster_jump, jump_of_2001 = (
        float(np.max([c.jump(getattr(c, name)) for c in found])) for name in ("caster", "published")
    )
    return [
        Finding("numbers that are NaN or infinite", lost, 0, "none is to be"),
        Finding(
            "frames with less than half of the reference's mean alpha", empty, 0, "no frame is to be empty"
        ),
        Finding(
            "jump in a step of 1e-6 voxel beyond the reference's, rays to their end",
            sharpest.jump(sharpest.to_the_end),
            quantum,
            "2 √3 Δτ: two samples of a ray that fall on the next entry of the table, Δτ its largest step",
            ray_caster=caster_jump,
            single_axis=jump_of_2001,
            strips=[_change_strip(sharpest)],
        ),
        Finding(
            "the same where rays stop early, as by default",
            float(np.max([c.jump(c.ours) for c in found])),
            quantum + residual,
            f"as above + {residual:g}, the transparency at which a ray stops and may do so a sample earlier",
            ray_caster=caster_jump,
            single_axis=jump_of_2001,
        ),
        Finding(
            "lowest PSNR of the faces at a place",
            float(decibels[worst]),
            INSIDE_DB,
            f"the goal for smooth functions from inside; lowest at {found[worst].place.name}",
            unit="dB",
            at_least=True,
            ray_caster=float(casters[worst]),
            single_axis=float(np.min([psnr(c.published[c.middle], c.truth[c.middle]) for c in found])),
            strips=[
                Strip(_label(c.place), c.ours[c.middle], c.truth[c.middle].astype(np.float32), gain=20)
                for c in found
                if c.place.name in _SHOWN
            ],
        ),
    ]


def _label(place: Place) -> str:
    soft = "corner" in place.name or "side" in place.name
    return f"From {place.name}" + ("; the box's own sides are as sharp as a pixel of the eye image" * soft)


def _change_strip(crossing: Crossing) -> Strip:
    changes = np.abs(np.diff(np.asarray(crossing.to_the_end, np.float64), axis=0))
    step = int(np.argmax(changes.max((1, 2, 3))))
    return Strip(
        f"Where a pixel jumps most, at {crossing.place.name}; right: its change in one step of 1e-6 voxel",
        crossing.to_the_end[step],
        crossing.truth[step].astype(np.float32),
        changes[step].astype(np.float32),
        gain=5000,
    )


CASE = Case(
    "eye-positions",
    "Eyes on slices, sides, edges and corners, inside, and on the way through",
    "Methods that order slices from the eye, scale them by 1/distance or clip them by the box's sides have a "
    "special case wherever the eye lies in one of these planes: pictures go blank there, fill with NaN, or "
    "jump as a slice changes from before the eye to behind it. Here a ray's place on slice k is eye + "
    "tangent · distance, which nothing divides by, and what a slice stands for shrinks to nothing as the "
    "eye nears it.",
    run,
)
