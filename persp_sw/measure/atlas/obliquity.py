"""Case 2: slices seen at a slant, from an axis to a corner and out to the rim of a wide frustum."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ... import reference
from ...geometry.view import View
from ...renderer import Renderer
from ...settings import Settings
from ...volume.phantoms import synthetic_ct
from ..exact import Slab
from ..metrics import rms_error
from . import plain, single_axis
from .case import Case, Finding, Progress, Scale, Strip
from .eye_paths import CORNERS, FACES, PAIRS, Array
from .face_views import face_view
from .looks import LOOKS

_DISTANCE, _FOVY = 2.0, 50.0
_SLANTS = {
    "along axes, interval 1": FACES,
    "along edges, interval √2": tuple(one + other for one, other in PAIRS),
    "along corners, interval √3": CORNERS,
}
_WIDE = (90.0, 120.0, 150.0)  # degrees
_BEFORE = 0.15  # widths before a side: a frustum of 150° is nearly filled, and one face can still serve
_ONE, _SEVERAL = 8.0, 1.0  # single_face_tangent
# Our samples lie on voxel planes, where trilinear values have their kinks: the trapezoidal rule, whose error
# is twice that of midpoints, −h²/12 · f″ against h²/24 · f″. So 1.5 × a ray caster that samples as we do is:
TRAPEZOID = 1.5 * 2.0
# Pixels so fine that what differs from the truth is how rays are sampled.
_FINE = 4.0
_SWEEP = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
_WORTH = 1.5  # of the sweep's best: what other cases allow against a plain ray caster

_OPACITY, _COLOUR = 0.05, (0.9, 0.6, 0.3)


def _closed_form_bound(edge: int) -> float:
    """Of opacity in float32: each plane adds half a unit in the last place of 1, 3e-8, of up to 4 planes in
    each of `edge` slices; six roundings of 6e-8 for a ray's own length, 5 for its ends; and those ends err by
    1.2e-7 of the way through the volume, which is edge·√3 intervals long."""
    extinction = -np.log1p(-_OPACITY)
    return float(2e-6 + 3e-8 * 4 * edge + 1.2e-7 * edge * np.sqrt(3) * extinction)


def _homogeneous(edge: int, views: Sequence[View], settings: Settings) -> tuple[float, list[Strip], set[int]]:
    """Largest error of a homogeneous box over all faces' pixels, where, and how many faces there were."""
    slab = Slab((edge,) * 3, opacity=_OPACITY, colour=_COLOUR)
    renderer = Renderer(slab.volume, slab.transfer, settings)
    worst, strips, counts = -1.0, [], set()
    for view in views:
        image = renderer.composite(view.eye, [view.wall])
        counts.add(len(image.faces))
        for number in range(len(image.faces)):
            ours, exact = image.face_pixels(number), slab.image(face_view(image, number))
            error = float(np.abs(ours - exact).max())
            if not error <= worst:
                worst, strips = error, [Strip("a face's pixels, homogeneous", ours, exact, gain=1e4)]
    return (worst if counts else float("nan")), strips, counts


def _homogeneous_2001(edge: int, views: Sequence[View]) -> float:
    """The same of the shear-warp of 2001: its intermediate images' pixels."""
    slab = Slab((edge,) * 3, opacity=_OPACITY, colour=_COLOUR)
    faces = (face for view in views for face in single_axis.faces_of(slab.volume, slab.transfer, view))
    return max(float(np.abs(pixels - slab.image(rays)).max()) for pixels, rays in faces)


def _opacity(scale: Scale) -> list[Finding]:
    """Opacity of a homogeneous box against 1 − exp(−extinction · length)."""
    edge = scale.pick(17, 33)
    bound = _closed_form_bound(edge)
    derived = "float32: 2e-6 + 3e-8 a plane + 1.2e-7 of the way through, times the extinction"
    volume = Slab((edge,) * 3).volume
    found = []
    for slant, directions in _SLANTS.items():
        views = [_looking(volume, towards, 64) for towards in directions]
        value, strips, _ = _homogeneous(edge, views, Settings(residual=0))
        found.append(
            Finding(
                f"opacity against the closed form, {slant}",
                value,
                bound,
                derived,
                strips=strips,
                single_axis=_homogeneous_2001(edge, views),
            )
        )
    for faces, limit in (("one face", _ONE), ("several faces", _SEVERAL)):
        views = [_wide_view(volume, fovy, 64) for fovy in _WIDE]
        settings = Settings(residual=0, single_face_tangent=limit)
        value, strips, counts = _homogeneous(edge, views, settings)
        if (counts == {1}) != (limit == _ONE):
            value = float("nan")  # not what is to be measured
        metric = f"opacity against the closed form, frusta of 90° … 150°, {faces}"
        published = _homogeneous_2001(edge, views)
        found.append(Finding(metric, value, bound, derived, strips=strips, single_axis=published))
    return found


def _looking(volume, towards: Array, pixels: int, distance: float = _DISTANCE, fovy: float = _FOVY) -> View:
    towards = towards / np.linalg.norm(towards)
    up = (0, 1, 0) if abs(towards[1]) < 0.9 else (0, 0, 1)
    eye = volume.centre + distance * max(volume.extent) * towards
    return View.look_at(eye, volume.centre, up, fovy, (pixels, pixels))


def _wide_view(volume, fovy: float, pixels: int) -> View:
    """From close before a side, off its middle, straight at it."""
    width = max(volume.extent)
    eye = volume.centre + width * np.array([0.04, -0.03, 0.5 + _BEFORE])
    return View.look_at(eye, eye - (0, 0, width), (0, 1, 0), fovy, (pixels, pixels))


def _sharp(scale: Scale, progress: Progress) -> list[Finding]:
    """Rms errors of a smooth and of a sharp transfer function beside a plain ray caster's."""
    volume, pixels = synthetic_ct(scale.pick(32, 64)), scale.pick(64, 128)
    found = []
    for at, look in enumerate(LOOKS):
        progress(at, len(LOOKS), "obliquity, slants and frusta")
        for slant, directions in _SLANTS.items():
            views = [_looking(volume, towards, pixels) for towards in directions[:: scale.pick(4, 1)]]
            found.append(
                _against_ray_caster(f"{look}, {slant}", volume, look, views, Settings(quality=_FINE))
            )
        for faces, limit in (("one face", _ONE), ("several faces", _SEVERAL)):
            for fovy in _WIDE[-1:] if scale.quick else _WIDE:
                view = _wide_view(volume, fovy, pixels)
                label = f"{look}, a frustum of {fovy:g}°, {faces}"
                settings = Settings(quality=_FINE, single_face_tangent=limit)
                found.append(_against_ray_caster(label, volume, look, [view], settings))
    return found


def _against_ray_caster(label: str, volume, look: str, views: Sequence[View], settings: Settings) -> Finding:
    """Rms error over several views: ours, and a plain ray caster's of a sample an interval."""
    renderer = Renderer(volume, LOOKS[look], settings)
    ours, rivals, published, strips, worst = [], [], [], [], -1.0
    for view in views:
        picture, truth = renderer.render(view), reference.render(volume, LOOKS[look], view)
        ours.append(rms_error(picture, truth))
        cast = plain.cast(volume, LOOKS[look], view)
        rivals.append(rms_error(cast, truth))
        of_2001 = single_axis.render(volume, LOOKS[look], view, quality=settings.quality)
        published.append(rms_error(of_2001, truth))
        if not ours[-1] <= worst:
            worst = ours[-1]
            shown = Strip(label, picture, truth, single_axis=of_2001)
            strips = [shown, Strip("plain ray caster", cast, truth)]
    value, rival, of_2001 = (_root_mean(errors) for errors in (ours, rivals, published))
    return Finding(
        f"rms error at quality {_FINE:g}, {label}",
        value,
        TRAPEZOID * rival,
        "1.5 × a ray caster that samples on voxel planes, 2 × the errors of midpoints",
        strips=strips,
        ray_caster=rival,
        single_axis=of_2001,
    )


def _sweep(scale: Scale, progress: Progress) -> list[Finding]:
    """What the tangent up to which one face serves costs, and how well it was chosen."""
    volume, pixels = synthetic_ct(scale.pick(32, 64)), scale.pick(48, 96)
    directions = np.random.default_rng(2).normal(size=(scale.pick(3, 12), 3))
    views = [
        _looking(volume, towards, pixels, distance, 75)
        for towards, distance in zip(directions, np.linspace(0.8, 1.6, len(directions)), strict=True)
    ]
    found = []
    for at, look in enumerate(LOOKS):
        progress(at, len(LOOKS), "obliquity, single_face_tangent")
        truths = [reference.render(volume, LOOKS[look], view) for view in views]
        errors, samples = {}, {}
        for limit in _SWEEP:
            renderer = Renderer(volume, LOOKS[look], Settings(single_face_tangent=limit))
            errors[limit] = _root_mean(
                rms_error(renderer.render(v), t) for v, t in zip(views, truths, strict=True)
            )
            samples[limit] = sum(renderer.composite(view.eye, [view.wall]).samples for view in views)
        published = _root_mean(
            rms_error(single_axis.render(volume, LOOKS[look], v), t)
            for v, t in zip(views, truths, strict=True)
        )
        ours = Settings().single_face_tangent
        for what, figures, unit in (("rms error", errors, ""), ("cost", samples, "samples")):
            swept = ", ".join(f"{limit:g}: {figures[limit]:.3g}" for limit in _SWEEP)
            metric = f"{what} at single_face_tangent {ours:g}, {look}"
            derived = f"{_WORTH} × the best of {swept}"
            bound, rival = _WORTH * min(figures.values()), None if unit else published
            found.append(Finding(metric, figures[ours], bound, derived, unit, single_axis=rival))
    return found


def _root_mean(errors) -> float:
    return float(np.sqrt(np.mean(np.square(list(errors)))))


def run(scale: Scale, progress: Progress) -> list[Finding]:
    """Opacity against the closed form; errors against a plain ray caster; `single_face_tangent` swept."""
    return [*_opacity(scale), *_sharp(scale, progress), *_sweep(scale, progress)]


CASE = Case(
    "obliquity",
    "Obliquity",
    "A ray at a slant is longer between two slices than one along the axis: √3 times towards a corner, and "
    "4 times at the rim of a frustum of 150°. With one opacity correction for the whole picture, media grow "
    "thinner towards its rim, and sharp transfer functions are missed between samples. Here each ray has its "
    "own length and its own ends, steep rays take more samples, and several faces share the steepest views.",
    run,
)
