"""Case 1: another face takes over as the eye moves on, and several meet in one picture."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ... import reference
from ...geometry.view import View
from ...renderer import Renderer
from ...volume.phantoms import synthetic_ct
from . import plain, single_axis
from .case import Case, Finding, Progress, Scale, Strip
from .eye_paths import CORNERS, PAIRS, Arc, across_edge, around, through_corner
from .looks import LOOKS
from .popping import changes, faces_of, owners, popping, seam_contrast, seam_steps, strips_of_pop

_GOAL = "goal: no frame of the path stands out by more than 1.5 ×"
_BOUND = 1.5

# Degrees from frame to frame, from the middle of a volume of 1 m, at 72 frames a second two metres away: a
# head at a metre a second, a brisk walk, turns 1 / 72 / 2 rad = 0.4°; one that sways at 0.25 m/s 0.1°.
_SPEEDS = {"walking": 0.4, "swaying": 0.1}
_FAR = 2.0  # volume widths from the middle
_NEAR = 1.2
_FOVY = 52.0  # degrees; all of the volume at _FAR

# Eyes (in widths of the volume) and what they look at, so that several faces are in one picture: inside,
# inside near a corner, on a side, close before an edge.
_AMID = (
    ((0.31, 0.62, 0.40), (0.80, 0.35, 0.60)),
    ((0.15, 0.20, 0.85), (0.60, 0.55, 0.40)),
    ((0.50, 0.00, 0.45), (0.30, 0.60, 0.70)),
    ((1.12, 1.08, 0.55), (0.50, 0.50, 0.50)),
)


@dataclass(frozen=True, eq=False)
class _Path:
    """A piece of an arc at a distance, about an angle."""

    arc: Arc
    distance: float
    at: float

    def degrees(self, step: float, margin: int) -> NDArray[np.float64]:
        """As many frames before the angle as after it; none is just on it."""
        return self.at + step * (np.arange(-margin, margin) + 0.5)


class _Stage:
    """A volume in a look, and pictures of it along paths."""

    def __init__(self, look: str, edge: int, pixels: int):
        self.look, self.volume, self.transfer = look, synthetic_ct(edge), LOOKS[look]
        self.renderer = Renderer(self.volume, self.transfer)
        self.size = pixels, pixels

    def view(self, arc: Arc, degrees: float, distance: float) -> View:
        return arc.view(self.volume, degrees, distance, _FOVY * _FAR / distance, self.size)

    def seen(self, arc: Arc, degrees: float, distance: float) -> frozenset[tuple[int, int]]:
        """The faces that a view takes, without a pixel composited."""
        view = self.view(arc, degrees, distance)
        return faces_of(self.renderer.plan(view.eye, [view.wall]).faces(self.renderer.settings))

    def paths(self, arc: Arc, distance: float) -> list[_Path]:
        """One for each angle of the arc at which a face comes or goes, and one for its middle."""
        degrees = np.arange(-45.0, 45.0)
        sets = [self.seen(arc, d, distance) for d in degrees]
        found = [_Path(arc, distance, 0.0)]
        for start, one, other in zip(degrees, sets, sets[1:], strict=False):
            if one != other:
                at = _bisected(lambda d, one=one: self.seen(arc, d, distance) == one, start, start + 1.0)
                found.append(_Path(arc, distance, at))
        return found

    def pairs(self, arc: Arc, distance: float) -> set[frozenset[tuple[int, int]]]:
        """The pairs of faces that share a picture somewhere on an arc."""
        sets = [self.seen(arc, d, distance) for d in np.arange(-45.0, 45.0, 3.0)]
        return {frozenset(pair) for faces in sets for pair in combinations(faces, 2)}

    def frames(self, arc: Arc, degrees: NDArray[np.float64], distance: float) -> _Frames:
        """Pictures from places along an arc."""
        views = [self.view(arc, d, distance) for d in degrees]
        truths = [reference.render(self.volume, self.transfer, view) for view in views]
        return _Frames(views, truths, [self.renderer.render(view) for view in views])


@dataclass(frozen=True, eq=False)
class _Frames:
    """Pictures along a path: the truth, and ours."""

    views: list[View]
    truths: list[NDArray[np.float64]]
    ours: list[NDArray[np.float32]]

    @property
    def errors(self) -> list[NDArray[np.float64]]:
        return _errors(self.ours, self.truths)


def _bisected(before: Callable[[float], bool], low: float, high: float) -> float:
    """Where `before` ceases to be true between two angles, to 1e-4 degree."""
    while high - low > 1e-4:
        middle = (low + high) / 2
        low, high = (middle, high) if before(middle) else (low, middle)
    return (low + high) / 2


def _groups(stage: _Stage, scale: Scale) -> Iterator[tuple[str, str, list[_Path]]]:
    """Name, speed and paths of what is measured together."""
    pairs, corners = PAIRS[:: scale.pick(7, 1)], CORNERS[:: scale.pick(8, 1)]
    across = [path for pair in pairs for path in stage.paths(across_edge(*pair), _FAR)]
    at_corners = [path for corner in corners for path in stage.paths(through_corner(corner), _FAR)]
    close = [path for pair in pairs[::4] for path in stage.paths(across_edge(*pair), _NEAR)]
    yield "across edges", "walking", across
    yield "through corners", "walking", at_corners
    yield "close by, several faces", "walking", close[: scale.pick(2, 8)]
    yield "across edges", "swaying", across[:: scale.pick(5, 4)]
    yield "through corners", "swaying", at_corners[:: scale.pick(5, 4)]


def _pops(stage: _Stage, scale: Scale, progress: Progress) -> list[Finding]:
    """How much the worst frame of all paths stands out, for each group."""
    groups = list(_groups(stage, scale))
    total = sum(len(paths) for _, _, paths in groups)
    done, found = 0, []
    for name, speed, paths in groups:
        worst, strips, derived, rival, published = -1.0, [], _GOAL, None, None
        for path in paths:
            frames = stage.frames(path.arc, path.degrees(_SPEEDS[speed], scale.pick(5, 9)), path.distance)
            errors = frames.errors
            value, change = popping(errors), changes(errors)
            if not value <= worst:
                label = f"{name}, {stage.look}, {path.at:.1f}°"
                worst, strips = value, strips_of_pop(label, frames.ours, frames.truths)
                derived = f"{_GOAL}; rms {change.max():.2g}, median {np.median(change):.2g}"
            if rival is None:
                rival = popping(_errors(_cast(stage, frames.views), frames.truths))
                published = popping(_errors(_published(stage, frames.views), frames.truths))
            done += 1
            progress(done, total, f"axis switch, {stage.look}")
        found.append(
            Finding(
                f"popping {name}, {speed}, {stage.look}",
                worst if paths else float("nan"),
                _BOUND,
                derived,
                "× the median frame",
                strips=strips,
                ray_caster=rival,
                single_axis=published,
            )
        )
    tried = PAIRS[:: scale.pick(7, 1)]
    shared = set().union(*(stage.pairs(across_edge(*pair), _FAR) for pair in tried))
    found.append(
        Finding(
            f"pairs of faces that share a picture on these paths, {stage.look}",
            len(shared),
            len(tried),
            "one for each edge of a cube that is crossed",
            "pairs",
            at_least=True,
        )
    )
    return found


def _circle(stage: _Stage, scale: Scale, progress: Progress) -> list[Finding]:
    """All the way around, whatever happens on it; the median is of the second of frames about each."""
    degrees = np.arange(-180.0, scale.pick(-168.0, 180.0), _SPEEDS["walking"])
    frames = stage.frames(around(), degrees, _FAR)
    progress(1, 1, f"axis switch, {stage.look}, around")
    label = f"popping around the volume, walking, {stage.look}"
    strips = strips_of_pop(f"around, {stage.look}", frames.ours, frames.truths)
    value = popping(frames.errors, 72)
    published = popping(_errors(_published(stage, frames.views), frames.truths), 72)
    return [Finding(label, value, _BOUND, _GOAL, "× the median frame", strips=strips, single_axis=published)]


def _cast(stage: _Stage, views: Sequence[View]) -> list[NDArray[np.float32]]:
    return [plain.cast(stage.volume, stage.transfer, view) for view in views]


def _published(stage: _Stage, views: Sequence[View]) -> list[NDArray[np.float32]]:
    return [single_axis.render(stage.volume, stage.transfer, view) for view in views]


def _errors(pictures, truths) -> list[NDArray[np.float64]]:
    return [picture - truth for picture, truth in zip(pictures, truths, strict=True)]


def _seams(stage: _Stage) -> Finding:
    """The contrast of seams in pictures of several faces; NaN if they show too little of any."""
    high = np.array(stage.volume.size) - 1.0
    ours, casts, strips = [], [], []
    for eye, centre in _AMID:
        view = View.look_at(high * eye, high * centre, (0.1, 0.2, 1), 95, stage.size)
        picture, truth = stage.renderer.render(view), reference.render(stage.volume, stage.transfer, view)
        owner, seen = owners(view, stage.volume), truth[..., 3] > 0
        (cast,) = _cast(stage, [view])
        ours.append(seam_steps(picture - truth, owner, seen))
        casts.append(seam_steps(cast - truth, owner, seen))
        strips.append(Strip(f"seams, {stage.look}", picture, truth))
    return Finding(
        f"contrast of seams, {stage.look}",
        seam_contrast(ours),
        _BOUND,
        "goal: 1.5 × the error's steps between ordinary neighbours within 6 pixels",
        "× ordinary steps",
        strips=strips,
        ray_caster=seam_contrast(casts),
    )


def run(scale: Scale, progress: Progress) -> list[Finding]:
    """Popping on paths across every pair of faces and through corners, and the contrast of seams."""
    found = []
    for look in LOOKS:
        stage = _Stage(look, scale.pick(32, 64), scale.pick(64, 128))
        found += _pops(stage, scale, progress)
        found += _circle(_Stage(look, 32, 64), scale, progress)
        found.append(_seams(_Stage(look, 64, scale.pick(96, 128))))
    return found


CASE = Case(
    "axis-switch",
    "Axis switch",
    "Shear-warp resamples slices of the axis that faces the eye. Where another axis takes over, its slices "
    "lie elsewhere and so do its errors: the picture pops, and where several axes share a picture a seam "
    "shows. Here every ray is sampled along its own axis: as the eye moves rays change theirs one after the "
    "other, mixed in a narrow zone about each seam, and the image's pixels move no faster than the view.",
    run,
)
