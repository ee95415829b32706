"""Case 11: two eyes, which should see one thing: where it is, how bright, and along which axis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...arrays import Image
from ...eye_image import EyeImage
from ...geometry.seams import shares
from ...geometry.view import View
from ...renderer import Renderer
from ...settings import Settings
from . import single_axis
from .blobs import THIN, Blobs
from .case import Case, Finding, Progress, Scale, Strip
from .eye_paths import CORNERS, PAIRS, Arc, Array, across_edge, around, through_corner
from .popping import faces_of

_SEPARATION = 0.064  # metres between the eyes; the volume's edge is 1 m
_DISTANCE = 1.5  # metres from its middle
_APART = float(np.degrees(_SEPARATION / _DISTANCE))  # degrees between the eyes, seen from there
_FOVY = 55.0

# What people can tell: 20″ of disparity. On a wall of 3 m and 1,920 pixels seen from 3 m a pixel is 1.8′.
_DISPARITY = 20 / 60 / 1.8
_DISPARITY_DERIVED = "stereo acuity, 20″, where a pixel is 1.8′: a wall of 3 m and 1,920 pixels from 3 m"
_BOUND = 1.5


class _Heads:
    """What the two eyes of heads around the blobs see."""

    def __init__(self, scale: Scale):
        self.blobs = Blobs.of(scale.pick(48, 64))
        self.renderer = Renderer(self.blobs.volume, THIN)
        self.size = (scale.pick(96, 160),) * 2

    def views(self, arc: Arc, degrees: float) -> tuple[View, View]:
        """Left and right; both on the arc, so that an edge that the head is before lies between them."""
        volume = self.blobs.volume
        wall = arc.view(volume, degrees, _DISTANCE, _FOVY, self.size).wall
        reach = _DISTANCE * max(volume.extent)
        eyes = (volume.centre + reach * arc.direction(degrees + side * _APART / 2) for side in (-1, 1))
        left, right = (View.through_wall(eye, wall) for eye in eyes)
        return left, right

    def images(self, views: Sequence[View], renderer: Renderer | None = None) -> list[EyeImage]:
        return [(renderer or self.renderer).composite(view.eye, [view.wall]) for view in views]

    def rivalry(self, views: Sequence[View], images: Sequence[EyeImage]) -> Array:
        """(n,): how much brighter a blob is to one eye than to the other, as a part of what it should be."""
        return self.rivalry_of(
            views, [self.renderer.warp(image, view) for view, image in zip(views, images, strict=True)]
        )

    def rivalry_of(self, views: Sequence[View], pictures: Sequence[Image]) -> Array:
        """`rivalry` of pictures."""
        pairs = zip(views, pictures, strict=True)
        left, right = (self.blobs.contrasts(view, picture) for view, picture in pairs)
        return np.abs(left - right)

    def switch_of_2001(self, arc: Arc) -> tuple[View, View] | None:
        """The first heads of an arc between whose eyes the axis of 2001 changes; None: it does not."""
        for degrees in np.arange(-45.0, 45.0):
            views = self.views(arc, degrees)
            axes = {single_axis.principal_axis(self.blobs.volume, view.eye.position) for view in views}
            if len(axes) == 2:
                return views
        return None

    def published(self, views: Sequence[View]) -> list[Image]:
        """What both eyes see of the shear-warp of 2001."""
        return [single_axis.render(self.blobs.volume, THIN, view) for view in views]

    def published_disparity_errors(self, views: Sequence[View]) -> Array:
        """`disparity_errors` of the shear-warp of 2001."""
        pairs = zip(views, self.published(views), strict=True)
        left, right = (self.blobs.displacements(view, picture) for view, picture in pairs)
        return np.linalg.norm(left - right, axis=1)

    def disparity_errors(
        self, views: Sequence[View], images: Sequence[EyeImage]
    ) -> tuple[Array, list[Strip]]:
        """(n,) pixels by which disparities differ from the converged reference's; and what the eyes see."""
        shifts, strips = [], []
        for side, view, image in zip(("left", "right"), views, images, strict=True):
            picture = self.renderer.warp(image, view)
            shifts.append(self.blobs.displacements(view, picture))
            strips.append(Strip(f"{side} eye", picture, self.blobs.truth(view)))
        return np.linalg.norm(shifts[0] - shifts[1], axis=1), strips


def _worst(values: Sequence[float] | NDArray[np.float64]) -> float:
    """The largest; NaN where there is none to measure."""
    known = np.array([v for v in values if np.isfinite(v)])
    return float(known.max()) if known.size else float("nan")


def _disparity_finding(
    metric: str, measured: list[tuple[Array, list[Strip]]], published: list[Array]
) -> Finding:
    worst = [_worst(errors) for errors, _ in measured]
    strips = measured[int(np.nanargmax(worst))][1] if np.isfinite(worst).any() else []
    rival = _worst([_worst(errors) for errors in published])
    return Finding(
        metric, _worst(worst), _DISPARITY, _DISPARITY_DERIVED, "pixels", strips=strips, single_axis=rival
    )


def _at_seams(heads: _Heads, scale: Scale, progress: Progress) -> list[Finding]:
    """Heads before all edges and corners, where eyes see things along several axes."""
    arcs = [across_edge(*pair) for pair in PAIRS[:: scale.pick(4, 1)]]
    arcs += [through_corner(corner) for corner in CORNERS[:: scale.pick(4, 1)]]
    one_axis = Renderer(heads.blobs.volume, THIN, Settings(single_face_tangent=8))
    ours, same, disparity, several = [], [], [], 0
    for at, arc in enumerate(arcs):
        for degrees in np.linspace(-20, 20, scale.pick(3, 5)):
            progress(at, len(arcs), "stereo, seams")
            views = heads.views(arc, float(degrees))
            images = heads.images(views)
            several += all(len(image.faces) > 1 for image in images)
            ours.append(_worst(heads.rivalry(views, images)))
            disparity.append(heads.disparity_errors(views, images))
            images = heads.images(views, one_axis)
            if len({faces_of(image.faces) for image in images}) == 1:
                same.append(_worst(heads.rivalry(views, images)))
    at_its_own = [views for arc in arcs if (views := heads.switch_of_2001(arc))]
    published = [_worst(heads.rivalry_of(views, heads.published(views))) for views in at_its_own]
    published_disparity = [heads.published_disparity_errors(views) for views in at_its_own]
    return [
        Finding(
            "heads whose eyes both see several axes",
            several,
            len(ours) / 2,
            "half of those tried, or there is too little to compare",
            "heads",
            at_least=True,
        ),
        Finding(
            "rivalry of a feature near seams, each ray along its own axis",
            _worst(ours),
            _BOUND * _worst(same),
            f"1.5 × both eyes' whole pictures along one axis, {_worst(same):.3g}",
            "of its contrast",
            single_axis=_worst(published),
        ),
        _disparity_finding("disparity error near seams", disparity, published_disparity),
    ]


def _all_around(heads: _Heads, scale: Scale) -> Finding:
    """Disparity from all sides, at no seam in particular."""
    measured, published = [], []
    for degrees in np.linspace(-170, 170, scale.pick(5, 18)):
        views = heads.views(around(), float(degrees))
        measured.append(heads.disparity_errors(views, heads.images(views)))
        published.append(heads.published_disparity_errors(views))
    return _disparity_finding("disparity error around the volume", measured, published)


def _shares(heads: _Heads, scale: Scale) -> Finding:
    """On the way around, how differently the eyes mix axes for things in the volume, mean."""
    volume, arc = heads.blobs.volume, around()
    places = np.random.default_rng(3).uniform(0, 1, (1000, 3)) * (np.array(volume.size) - 1.0)
    differ = []
    for degrees in np.arange(-180.0, 180.0, scale.pick(10.0, 2.0)):
        seen = []
        for view in heads.views(arc, float(degrees)):
            (pitch,) = {face.pitch for face in heads.images([view])[0].faces}
            seen.append(shares(places - view.eye.position, pitch))
        differ.append(np.abs(seen[0] - seen[1]).max(-1))
    return Finding(
        "part by which the eyes see things along different axes, heads around the volume",
        float(np.mean(differ)),
        2 * _SEPARATION,
        "of each of two seams a stripe as wide as the eyes are apart, of a volume 1 m wide",
        "of a thing",
    )


def run(scale: Scale, progress: Progress) -> list[Finding]:
    """Disparity, and rivalry where the eyes take different faces."""
    heads = _Heads(scale)
    return [
        _all_around(heads, scale),
        *_at_seams(heads, scale, progress),
        _shares(heads, scale),
    ]


CASE = Case(
    "stereo",
    "Stereo",
    "Two eyes see a volume from slightly different places. If a feature lies at other depths in their "
    "pictures than it should, or is fainter to one eye because that eye's slices run along another axis, "
    "the eyes disagree, and the picture strains or flickers. Here each ray is sampled along its own axis: "
    "what differs are stripes no wider than the eyes are apart, softened by seams, not whole pictures.",
    run,
)
