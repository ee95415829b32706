"""Faces of an eye image judged by themselves, without the warp's look-up between their pixels.

A picture's sharpness at the sides of the box, where its opacity jumps, is a matter of pitch; what lies on a
ray is a matter of compositing. Here the rays of a face's own pixels are followed.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ... import reference
from ...arrays import Image
from ...eye_image import EyeImage
from ...geometry.view import View, Wall
from ...renderer import Renderer
from . import single_axis
from .plain import cast

# Of what varies smoothly along a ray, in intervals h with the slope s at each of its two ends: midpoints of
# equal pieces err by s·h²/24 an end (Euler and Maclaurin), slices, which are a trapezoid sum, by s·h²/12.
# Where a ray enters or leaves through a side, up to ½ an interval from a slice, the piece between takes that
# slice's value, which adds up to s·h²/8.
TIMES_MIDPOINTS = (1 / 12 + 1 / 8) / (1 / 24)
WHY_TIMES_MIDPOINTS = "(1/12 + 1/8) / (1/24): slices' trapezoids and half pieces at a side over midpoints"


@dataclass(frozen=True, eq=False)
class JudgedFace:
    """A face's pixels, what the reference and what a plain ray caster say of the same rays."""

    ours: Image
    truth: Image
    plain: Image


def face_view(image: EyeImage, number: int) -> View:
    """The view whose pixels are those of face `number`, of an eye at a point; row v is the face's row v."""
    face = image.faces[number]
    matrix, eye = image.world_from_tangents(number), image.eye.position
    (left, top), (width, height) = face.origin, face.size
    right, bottom = left + width * face.pitch, top + height * face.pitch
    corners = (left, bottom), (right, bottom), (left, top)
    return View.through_wall(image.eye, Wall(*(eye + matrix @ (*c, 1.0) for c in corners), pixels=face.size))


def judged_faces(renderer: Renderer, view: View) -> list[JudgedFace]:
    """All faces that a view needs, judged; regions must be convex."""
    image = renderer.composite(view.eye, [view.wall])
    numbers = range(len(image.faces))
    return _judged(renderer, ((image.face_pixels(number), face_view(image, number)) for number in numbers))


def judged_single_axis(renderer: Renderer, view: View) -> list[JudgedFace]:
    """As `judged_faces`: the shear-warp's of 2001 as `ours`, none where it has no picture of a view."""
    faces = single_axis.faces_of(renderer.volume, renderer.transfer, view, renderer.regions)
    return _judged(renderer, faces)


def _judged(renderer: Renderer, faces: Iterable[tuple[Image, View]]) -> list[JudgedFace]:
    """Pixels and the view that they are of, beside the reference and a plain ray caster."""
    scene = renderer.volume, renderer.transfer
    found = []
    for pixels, rays in faces:
        truth = reference.render(*scene, rays, regions=renderer.regions, tolerance=1e-6).astype(np.float32)
        found.append(JudgedFace(pixels, truth, cast(*scene, rays, renderer.regions)))
    return found


def rms_errors(faces: Sequence[JudgedFace]) -> tuple[float, float]:
    """Root mean square errors over all pixels and channels: ours, and a plain ray caster's.

    Without a face, infinite: where there is nothing to judge, nothing is good.
    """
    if not faces:
        return np.inf, np.inf
    ours, truth, plain = (
        np.concatenate([getattr(face, name).reshape(-1, 4) for face in faces]).astype(np.float64)
        for name in ("ours", "truth", "plain")
    )
    return tuple(float(np.sqrt(np.square(image - truth).mean())) for image in (ours, plain))


def rms_ratio(ours: float, plain: float) -> float:
    """The first of `rms_errors` over the second; infinite where the ray caster makes no error at all."""
    return ours / plain if plain else np.inf


def single_axis_ratio(renderer: Renderer, view: View) -> float:
    """`rms_ratio` of the shear-warp of 2001; NaN where it has no picture of a view."""
    faces = judged_single_axis(renderer, view)
    return rms_ratio(*rms_errors(faces)) if faces else np.nan
