"""Sharp classification: transfer functions with steps, spikes and combs, finer than the slices tell apart."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ... import reference
from ...geometry.view import View
from ...optics.transfer import TransferFunction
from ...volume.grid import Volume
from ..exact import Ball
from . import plain, single_axis
from .case import Case, Finding, Part, Progress, Scale, Strip, in_parts
from .colour_exposure import exposure_findings
from .compositing import composite, rms, view_towards
from .face_views import face_view

Array = NDArray[np.float64]

TOLERANCE = 1e-6  # of the reference, far below the errors looked for

# A field of 8 world units, seen roughly along z. Its slope along a ray and its second derivatives, below.
EDGE = 8.0
# Least slope: 0.06 − 0.02 · 0.9 along z, less slants of 0.2 times 0.03 · 0.7 and of 0.15 times 0.03 · 0.5.
SLOPE = 0.035
# Most curvature: 0.02 · 0.9² along z, 0.03 · 0.7² along x, and mixed terms where a ray changes cells.
CURVATURE = 0.05

# Point samples miss where a value is crossed by up to half a slice, evenly: h / √12. Pieces on which the
# scalar is linear miss by h² / 8 · curvature / slope. Twice that for rays that are not the mean.
PREINTEGRATED_SHARE = 2 * np.sqrt(12) / 8 * CURVATURE / SLOPE  # of the error of point samples, times h
# A value's crossing is displaced by O(h²), less regularly where a ray changes cells sideways within a piece:
# second order, of which few rays show three quarters. A spike weighs by the slope where it is crossed, and a
# ray that changes cells keeps the first cell's, off by O(h): first order, of which few show half.
STEP_ORDER, SPIKE_ORDER = 1.5, 0.5
# On finer grids other errors are larger: sums of a hundred slices in float32, and ends of pieces rounded to
# whole rows of the table, of which a comb's piece passes some fifty.
GRIDS = (9, 17, 33, 65)
# Where neither is stated: what a plain ray caster with as many samples shows, and half as much again.
PLAIN = 1.5
# Rings, above, on a ball whose half chord z is half its radius at least: h² / 4 of sag over a slope of 2·z
# misses by h² / (8·z), against h / √12: 0.43·h / z.
RING_SHARE = 2 * np.sqrt(12) / 8


@dataclass(frozen=True)
class _Grid:
    """What was measured on one grid, rms over the pixels of a face."""

    spacing: float
    point_samples: float
    preintegrated: float
    ray_caster: float
    single_axis: float
    strips: tuple[Strip, ...]


def functions() -> dict[str, TransferFunction]:
    """A step, a spike thinner than a slice on coarse grids, and eight such spikes."""
    sky, sun = (0.1, 0.5, 1.0), (1.0, 0.7, 0.2)
    comb = []
    for number, value in enumerate(np.linspace(0.36, 0.64, 8)):
        colour = sun if number % 2 else sky
        comb += [(value - 0.004, colour, 0.0), (value, colour, 0.8), (value + 0.004, colour, 0.0)]
    return {
        "step": TransferFunction([(0.51, sky, 0.0), (0.51, sky, 0.5)], 1.0),
        "spike": TransferFunction([(0.505, sun, 0.0), (0.51, sun, 0.9), (0.515, sun, 0.0)], 1.0),
        "comb": TransferFunction(comb, 1.0),
    }


def field(n: int) -> Volume:
    """The same smooth field on a grid of n voxels a side."""
    spacing = EDGE / (n - 1)
    z, y, x = np.indices((n, n, n)) * spacing
    data = 0.5 + 0.06 * (z - EDGE / 2) + 0.03 * np.sin(0.7 * x + 0.3) * np.cos(0.5 * y)
    data += 0.02 * np.sin(0.9 * z)
    return Volume(data.astype(np.float32), (spacing,) * 3, name=f"field-{n}")


def _on_grids(transfer: TransferFunction, grids: tuple[int, ...], size: int) -> Iterator[_Grid]:
    for n in grids:
        volume = field(n)
        view = view_towards(volume, (0.2, 0.15, 1.0), (size, size), 1.2, 15.0)
        # One face for all rays, so that there are slanted ones among them.
        points, pieces = (
            composite(volume, transfer, view, samples_per_interval=1, preintegrated=on, single_face_tangent=8)
            for on in (False, True)
        )
        rays = face_view(points, 0)
        truth = reference.render(volume, transfer, rays, tolerance=TOLERANCE)
        cast = plain.cast(volume, transfer, rays)
        ((published, its_rays),) = single_axis.faces_of(volume, transfer, view)
        its_truth = reference.render(volume, transfer, its_rays, tolerance=TOLERANCE)
        pictures = {"point samples": points.face_pixels(0), "pre-integrated": pieces.face_pixels(0)}
        yield _Grid(
            EDGE / (n - 1),
            *(rms(picture - truth) for picture in (*pictures.values(), cast)),
            rms(published - its_truth),
            tuple(
                Strip(f"{label}, {n}³", picture, truth.astype(np.float32))
                for label, picture in pictures.items()
            ),
        )


def order_findings(name: str, transfer: TransferFunction, scale: Scale) -> list[Finding]:
    """Errors of one function on finer and finer grids."""
    grids = list(_on_grids(transfer, GRIDS, scale.pick(16, 48)))
    spacings, errors, casts, published = (
        np.log([getattr(grid, what) for grid in grids])
        for what in ("spacing", "preintegrated", "ray_caster", "single_axis")
    )
    last = grids[-1]
    return [
        Finding(
            f"{name}: order of the pre-integrated error in the slice spacing",
            float(np.polyfit(spacings, errors, 1)[0]),
            STEP_ORDER if name == "step" else SPIKE_ORDER,
            "3/4 of second order: crossings are displaced by O(h²)"
            if name == "step"
            else "half of first order: a spike weighs by the slope where it is crossed, off by O(h)",
            at_least=True,
            ray_caster=float(np.polyfit(spacings, casts, 1)[0]),
            single_axis=float(np.polyfit(spacings, published, 1)[0]),
        ),
        Finding(
            f"{name}: pre-integrated error over that of point samples, finest grid",
            last.preintegrated / last.point_samples,
            PREINTEGRATED_SHARE * last.spacing,
            "2 · (h²/8 · curvature / slope) / (h / √12): a linear piece against a sample's half slice",
            strips=last.strips,
        ),
        Finding(
            f"{name}: rms error of point samples, finest grid",
            last.point_samples,
            PLAIN * last.ray_caster,
            "1.5 × a plain ray caster",
            ray_caster=last.ray_caster,
            single_axis=last.single_axis,
        ),
    ]


def ring_amplitude(error: Array, view: View, reach: float) -> float:
    """Amplitude of concentric rings in an error: rms over radii of its mean over each radius.

    The eye is on the z axis and looks at the origin; rays that pass it at more than `reach` do not count.
    """
    directions = view.directions()
    slope = np.hypot(directions[..., 0], directions[..., 1]) / np.abs(directions[..., 2])
    passes = np.linalg.norm(view.eye.position) * slope / np.hypot(1, slope)
    pixel = np.abs(np.diff(slope, axis=1)).max()
    rings, inside = (slope / pixel).astype(int), passes < reach
    counts = np.bincount(rings[inside])
    means = np.bincount(rings[inside], error[inside]) / np.maximum(counts, 1)
    means = means[counts > 0]
    return float(np.std(means))


def ring_findings(scale: Scale) -> list[Finding]:
    """Rings on a ball whose slices are circles, seen along the axis through them."""
    ball = Ball(scale.pick(33, 65))
    colour = ball.colour
    shell = TransferFunction([(0.0, colour, 0.0), (0.0, colour, ball.opacity)], 1.0)
    size, spacing = scale.pick(64, 160), 2 / (ball.n - 1)
    view = View.look_at((0, 0, 4.0), (0, 0, 0), (0, 1, 0), 26.0, (size, size))
    pictures = {
        name: composite(ball.volume, shell, view, samples_per_interval=1, preintegrated=on)
        for name, on in (("point samples", False), ("pre-integrated", True))
    }
    rays = face_view(pictures["point samples"], 0)
    truth = reference.render(ball.volume, shell, rays, tolerance=TOLERANCE)
    faces = {name: image.face_pixels(0) for name, image in pictures.items()}
    faces["plain ray caster"] = plain.cast(ball.volume, shell, rays)
    strips = tuple(
        Strip(f"rings: {name}", picture, truth.astype(np.float32), gain=32.0)
        for name, picture in faces.items()
    )
    ((published, its_rays),) = single_axis.faces_of(ball.volume, shell, view)
    its_truth = reference.render(ball.volume, shell, its_rays, tolerance=TOLERANCE)
    least = ball.radius / 2  # half chord
    reach = float(np.sqrt(ball.radius**2 - least**2))
    points, pieces, cast = (ring_amplitude((face - truth)[..., 3], rays, reach) for face in faces.values())
    return [
        Finding(
            "rings: energy of point samples",
            points**2,
            PLAIN * cast**2,
            "1.5 × a plain ray caster; variance over radii of the error's mean over each",
            strips=strips,
            ray_caster=cast**2,
            single_axis=ring_amplitude((published - its_truth)[..., 3], its_rays, reach) ** 2,
        ),
        Finding(
            "rings: pre-integrated amplitude over that of point samples",
            pieces / points,
            RING_SHARE * spacing / least,
            "2 · (h² / (8·z)) / (h / √12), z the least half chord looked at",
        ),
    ]


def run(scale: Scale, progress: Progress) -> list[Finding]:
    """All of it: orders of three functions, rings, and hidden colours."""
    parts: dict[str, Part] = {
        name: partial(order_findings, name, transfer) for name, transfer in functions().items()
    }
    parts["rings"] = ring_findings
    parts["colour exposure"] = exposure_findings
    return in_parts(parts, scale, progress)


CASE = Case(
    "sharp-classification",
    "Sharp classification",
    "A transfer function with a step or a spike makes extinction change faster than samples a slice apart "
    "can follow: surfaces show rings where slices cut them, thin shells vanish between slices, and colours "
    "that lie behind a surface show through it (colour exposure, Yuan 2011). Samples that stand for all "
    "scalars of their piece of the ray (pre-integration) mend it, and are chosen where one slice hides what "
    "follows.",
    run,
)
