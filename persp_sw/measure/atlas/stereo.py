"""Case 11: two eyes, which should see one thing: where it is, how bright, and from which faces."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...eye_image import EyeImage
from ...geometry.view import View
from ...renderer import Renderer
from .blobs import THIN, Blobs
from .case import Case, Finding, Progress, Scale, Strip
from .eye_paths import CORNERS, PAIRS, Arc, Array, across_edge, around, through_corner
from .popping import faces_of

_SEPARATION = 0.064  # metres between the eyes; the volume's edge is 1 m
_DISTANCE = 1.5  # metres from its middle
_APART = float(np.degrees(_SEPARATION / _DISTANCE))  # degrees between the eyes, seen from there
_FOVY = 55.0
_STEP = float(np.degrees(1 / 72 / _DISTANCE))  # degrees a frame: a head at 1 m/s, 72 frames a second

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

    def image(self, view: View, previous: EyeImage | None = None) -> EyeImage:
        return self.renderer.composite(view.eye, [view.wall], previous)

    def switch(self, arc: Arc) -> float | None:
        """The first angle of an arc at which an eye in the head's middle changes faces; None: it does not."""

        def faces(degrees: float) -> frozenset[tuple[int, int]]:
            view = arc.view(self.blobs.volume, degrees, _DISTANCE, _FOVY, self.size)
            return faces_of(self.renderer.plan(view.eye, [view.wall]).faces(self.renderer.settings))

        degrees = np.arange(-45.0, 45.0)
        sets = [faces(d) for d in degrees]
        for start, one, other in zip(degrees, sets, sets[1:], strict=False):
            if one != other:
                low, high = float(start), float(start) + 1.0
                while high - low > 1e-3:
                    middle = (low + high) / 2
                    low, high = (middle, high) if faces(middle) == one else (low, middle)
                return (low + high) / 2
        return None

    def rivalry(self, views: Sequence[View], images: Sequence[EyeImage]) -> Array:
        """(n,): how much brighter a blob is to one eye than to the other, as a part of what it should be."""
        pairs = zip(views, images, strict=True)
        left, right = (self.blobs.contrasts(view, self.renderer.warp(image, view)) for view, image in pairs)
        return np.abs(left - right)

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


def _disparity_finding(metric: str, measured: list[tuple[Array, list[Strip]]]) -> Finding:
    worst = [_worst(errors) for errors, _ in measured]
    strips = measured[int(np.nanargmax(worst))][1] if np.isfinite(worst).any() else []
    return Finding(metric, _worst(worst), _DISPARITY, _DISPARITY_DERIVED, "pixels", strips=strips)


def _at_switches(heads: _Heads, scale: Scale, progress: Progress) -> list[Finding]:
    """Heads at an axis switch, an eye on either side: each with its own faces, and both with one's."""
    arcs = [across_edge(*pair) for pair in PAIRS[:: scale.pick(4, 1)]]
    arcs += [through_corner(corner) for corner in CORNERS[:: scale.pick(4, 1)]]
    own, same, disparity = [], [], []
    for at, arc in enumerate(arcs):
        progress(at, len(arcs), "stereo, axis switches")
        degrees = heads.switch(arc)
        if degrees is None:
            continue
        # One eye a little beyond the switch, so that what the other remembers still serves it.
        views = heads.views(arc, degrees - _APART / 4)
        left, right = (heads.image(view) for view in views)
        shared = heads.image(views[1], left)  # an eye that has the other's memory takes the other's faces
        if faces_of(left.faces) != faces_of(right.faces) and faces_of(left.faces) == faces_of(shared.faces):
            own.append(_worst(heads.rivalry(views, (left, right))))
            same.append(_worst(heads.rivalry(views, (left, shared))))
            disparity.append(heads.disparity_errors(views, (left, right)))
    return [
        Finding(
            "axis switches with an eye on either side",
            len(own),
            len(arcs) / 2,
            "half of the edges and corners tried, or there is too little to compare",
            "switches",
            at_least=True,
        ),
        Finding(
            "rivalry of a feature at axis switches, eyes on different faces",
            _worst(own),
            _BOUND * _worst(same),
            f"1.5 × the same eyes on the same faces, {_worst(same):.3g}",
            "of its contrast",
        ),
        _disparity_finding("disparity error at axis switches", disparity),
    ]


def _all_around(heads: _Heads, scale: Scale) -> Finding:
    """Disparity from all sides, at no switch in particular."""
    measured = []
    for degrees in np.linspace(-170, 170, scale.pick(5, 18)):
        views = heads.views(around(), float(degrees))
        measured.append(heads.disparity_errors(views, [heads.image(view) for view in views]))
    return _disparity_finding("disparity error around the volume", measured)


def _walks(heads: _Heads, scale: Scale, progress: Progress) -> Finding:
    """A head that walks across an edge, each eye with its memory: does rivalry flare up as they switch?"""
    worst = []
    arcs = [across_edge(*pair) for pair in PAIRS[:: scale.pick(12, 4)]]
    for at, arc in enumerate(arcs):
        progress(at, len(arcs), "stereo, walks")
        middle = heads.switch(arc)
        if middle is None:
            continue
        before: list[EyeImage | None] = [None, None]
        rivalry, taken = [], set()
        reach = scale.pick(7, 14) * _STEP
        for degrees in np.arange(middle - reach, middle + reach, _STEP):
            views = heads.views(arc, float(degrees))
            images = [heads.image(view, image) for view, image in zip(views, before, strict=True)]
            before = list(images)
            taken |= {(side, faces_of(image.faces)) for side, image in enumerate(images)}
            rivalry.append(float(np.sqrt(np.nanmean(heads.rivalry(views, images) ** 2))))
        switched = len(taken) == 4  # both eyes, or this was no walk across an edge
        worst.append(max(rivalry) / float(np.median(rivalry)) if switched else np.nan)
    return Finding(
        "rivalry on a walk across an edge, largest",
        _worst(worst),
        _BOUND,
        "goal: no frame of the path stands out by more than 1.5 ×",
        "× the median frame",
    )


def _shares(heads: _Heads, scale: Scale) -> Finding:
    """On the way around: at how many heads the eyes take different faces, each with its memory."""
    step = scale.pick(1.0, 0.25)
    arc, settings = around(), heads.renderer.settings
    pose = heads.blobs.volume.world_from_object
    before: list[EyeImage | None] = [None, None]
    sets = []
    for degrees in np.arange(-180.0, 180.0, step):
        plans = [
            heads.renderer.plan(view.eye, [view.wall], image)
            for view, image in zip(heads.views(arc, float(degrees)), before, strict=True)
        ]
        # Only faces are remembered: nothing has to be composited.
        before = [
            EyeImage(plan.eye, pose, tuple(plan.faces(settings)), np.zeros((0, 4), np.float32), 0)
            for plan in plans
        ]
        sets.append([faces_of(image.faces) for image in before if image])
    differ = sum(left != right for left, right in sets)
    switches = sum(one[0] != other[0] for one, other in pairwise(sets))
    return Finding(
        "heads around the volume whose eyes take different faces",
        differ / len(sets),
        switches * (_APART + step) / 360 if switches else 0.0,
        f"{switches} switches, each {_APART:.2f}° between the eyes and a step of {step:g}°, no longer",
        "of all heads",
    )


def run(scale: Scale, progress: Progress) -> list[Finding]:
    """Disparity, and rivalry where the eyes take different faces."""
    heads = _Heads(scale)
    return [
        _all_around(heads, scale),
        *_at_switches(heads, scale, progress),
        _walks(heads, scale, progress),
        _shares(heads, scale),
    ]


CASE = Case(
    "stereo",
    "Stereo",
    "Two eyes see a volume from slightly different places. If a feature lies at other depths in their "
    "pictures than it should, or is fainter to one eye because that eye's slices run along another axis, "
    "the eyes disagree, and the picture strains or flickers. Here each eye composites with its own faces; "
    "what that costs at every axis switch is compared with the same faces for both.",
    run,
)
