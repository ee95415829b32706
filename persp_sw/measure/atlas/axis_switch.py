"""Case 1: another face takes over as the eye moves on, and several meet in one picture."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ... import reference
from ...geometry.faces import Face
from ...geometry.view import View
from ...planning import plan_eye
from ...renderer import Renderer
from ...volume.phantoms import synthetic_ct
from . import plain
from .case import Case, Finding, Progress, Scale, Strip
from .eye_paths import CORNERS, PAIRS, Arc, across_edge, around, through_corner
from .looks import LOOKS
from .popping import changes, faces_of, owners, popping, seam_contrast, strips_of_pop

_GOAL = "goal: no frame of the path stands out by more than 1.5 ×"
_BOUND = 1.5

# Degrees from frame to frame, from the middle of a volume of 1 m, at 72 frames a second two metres away: a
# head at a metre a second, a brisk walk, turns 1 / 72 / 2 rad = 0.4°; one that sways at 0.25 m/s 0.1°.
_SPEEDS = {"walking": 0.4, "swaying": 0.1}
_FAR = 2.0  # volume widths from the middle: one face serves
_NEAR = 1.2  # several do, before an edge
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
    """An arc at a distance, and where on it other faces take over: without memory, and with."""

    arc: Arc
    distance: float
    at: float
    kept: float

    def degrees(self, step: float, margin: int) -> NDArray[np.float64]:
        """Frames from `margin` before the first change to as many after the last; none is just on it."""
        low, high = min(self.at, self.kept), max(self.at, self.kept)
        return np.arange(low - (margin - 0.5) * step, high + margin * step, step)


class _Stage:
    """A volume in a look, and pictures of it along paths."""

    def __init__(self, look: str, edge: int, pixels: int):
        self.look, self.volume, self.transfer = look, synthetic_ct(edge), LOOKS[look]
        self.renderer = Renderer(self.volume, self.transfer)
        self.size = pixels, pixels

    def view(self, arc: Arc, degrees: float, distance: float) -> View:
        return arc.view(self.volume, degrees, distance, _FOVY * _FAR / distance, self.size)

    def planned(self, view: View, previous: Sequence[Face] = ()) -> list[Face]:
        """The faces that a view takes, without a pixel composited."""
        renderer = self.renderer
        plan = plan_eye(renderer.runs, renderer.regions, renderer.settings, view.eye, [view.wall], previous)
        return plan.faces(renderer.settings)

    def paths(self, arc: Arc, distance: float, low: float = -45.0, high: float = 45.0) -> list[_Path]:
        """One for each angle of the arc at which other faces take over."""

        def seen(degrees: float) -> frozenset[tuple[int, int]]:
            return faces_of(self.planned(self.view(arc, degrees, distance)))

        degrees = np.arange(low, high, 1.0)
        sets = [seen(d) for d in degrees]
        found = []
        for start, one, other in zip(degrees, sets, sets[1:], strict=False):
            if one != other:
                at = _bisected(lambda d, one=one: seen(d) == one, start, start + 1.0)
                found.append(_Path(arc, distance, at, self._kept(arc, distance, at)))
        return found

    def _kept(self, arc: Arc, distance: float, at: float, most: float = 12.0) -> float:
        """The angle beyond `at` at which the faces before it are given up by an eye that comes slowly."""
        faces = self.planned(self.view(arc, at - 0.05, distance))
        first = faces_of(faces)
        for degrees in np.arange(at - 0.05, at + most, 0.05):
            faces = self.planned(self.view(arc, degrees, distance), faces)
            if faces_of(faces) != first:
                return float(degrees)
        return at

    def frames(self, arc: Arc, degrees: NDArray[np.float64], distance: float) -> _Frames:
        """Pictures from places along an arc."""
        views = [self.view(arc, d, distance) for d in degrees]
        fresh = [self.renderer.render(view) for view in views]
        kept, before = [], None
        for view in views:
            before = self.renderer.composite(view.eye, [view.wall], before)
            kept.append(self.renderer.warp(before, view))
        truths = [reference.render(self.volume, self.transfer, view) for view in views]
        return _Frames(views, truths, {"": fresh, ", last frame's faces kept": kept})


@dataclass(frozen=True, eq=False)
class _Frames:
    """Pictures along a path: the truth, and ours by how the faces were chosen."""

    views: list[View]
    truths: list[NDArray[np.float64]]
    ours: dict[str, list[NDArray[np.float32]]]


def _bisected(before: Callable[[float], bool], low: float, high: float) -> float:
    """Where `before` ceases to be true between two angles, to 1e-4 degree."""
    while high - low > 1e-4:
        middle = (low + high) / 2
        low, high = (middle, high) if before(middle) else (low, middle)
    return (low + high) / 2


def _groups(stage: _Stage, scale: Scale) -> Iterator[tuple[str, str, list[_Path]]]:
    """Name, speed and paths of what is measured together."""
    pairs = PAIRS[:: scale.pick(7, 1)]
    corners = CORNERS[:: scale.pick(8, 1)]
    across = [path for one, other in pairs for path in stage.paths(across_edge(one, other), _FAR)]
    yield "across edges", "walking", across
    at_corners = [path for c in corners for path in stage.paths(through_corner(c), _FAR)]
    yield "through corners", "walking", at_corners
    several = [path for one, other in pairs[::4] for path in stage.paths(across_edge(one, other), _NEAR)]
    yield "one face to several", "walking", several[: scale.pick(1, 6)]
    yield "across edges", "swaying", across[:: scale.pick(9, 4)]


def _pops(stage: _Stage, scale: Scale, progress: Progress) -> list[Finding]:
    """How much the worst frame of all paths stands out, for each group."""
    groups = list(_groups(stage, scale))
    total = sum(len(paths) for _, _, paths in groups)
    done, found = 0, []
    for name, speed, paths in groups:
        worst: dict[str, tuple[float, list[Strip], str]] = {}
        rival = 0.0
        for path in paths:
            degrees = path.degrees(_SPEEDS[speed], scale.pick(5, 9))
            frames = stage.frames(path.arc, degrees, path.distance)
            for choice, pictures in frames.ours.items():
                errors = _errors(pictures, frames.truths)
                value, change = popping(errors), changes(errors)
                if not value <= worst.get(choice, (-1.0, [], ""))[0]:
                    label = f"{name}, {stage.look}, {path.at:.1f}°"
                    rms = f"; rms {change.max():.2g}, median {np.median(change):.2g}"
                    worst[choice] = value, strips_of_pop(label, pictures, frames.truths), _GOAL + rms
            if path is paths[0]:
                rival = popping(_errors(_cast(stage, frames.views), frames.truths))
            done += 1
            progress(done, total, f"axis switch, {stage.look}")
        found += [
            Finding(
                f"popping {name}, {speed}, {stage.look}{choice}",
                value,
                _BOUND,
                derived,
                "× the median frame",
                strips=() if choice else strips,
                ray_caster=rival,
            )
            for choice, (value, strips, derived) in worst.items()
        ]
        if name == "across edges" and speed == "walking":
            crossed = len({frozenset(pair) for pair in _crossed(stage, paths)})
            wanted = len(PAIRS[:: scale.pick(7, 1)])
            found.append(
                Finding(
                    f"pairs of faces crossed, {stage.look}",
                    crossed,
                    wanted,
                    "a cube has 12 edges" if not scale.quick else "every seventh of a cube's 12 edges",
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
    found = []
    for choice, pictures in frames.ours.items():
        label = f"popping around the volume, walking, {stage.look}{choice}"
        value = popping(_errors(pictures, frames.truths), 72)
        strips = strips_of_pop(f"around, {stage.look}", pictures, frames.truths)
        found.append(
            Finding(label, value, _BOUND, _GOAL, "× the median frame", strips=() if choice else strips)
        )
    return found


def _crossed(stage: _Stage, paths: Sequence[_Path]) -> Iterator[list[frozenset[tuple[int, int]]]]:
    """The faces before and after each path's change."""
    for path in paths:
        yield [
            faces_of(stage.planned(stage.view(path.arc, path.at + beside, path.distance)))
            for beside in (-0.01, 0.01)
        ]


def _cast(stage: _Stage, views: Sequence[View]) -> list[NDArray[np.float32]]:
    return [plain.cast(stage.volume, stage.transfer, view) for view in views]


def _errors(pictures, truths) -> list[NDArray[np.float64]]:
    return [picture - truth for picture, truth in zip(pictures, truths, strict=True)]


def _seams(stage: _Stage) -> Finding:
    """The worst contrast of a seam in pictures of several faces; NaN if fewer than two show any."""
    high = np.array(stage.volume.size) - 1.0
    measured = []
    for eye, centre in _AMID:
        view = View.look_at(high * eye, high * centre, (0.1, 0.2, 1), 95, stage.size)
        ours, truth = stage.renderer.render(view), reference.render(stage.volume, stage.transfer, view)
        owner, seen = owners(view, stage.volume), truth[..., 3] > 0
        value = seam_contrast(ours - truth, owner, seen)
        if stage.renderer.last["faces"] > 1 and np.isfinite(value):
            (cast,) = _cast(stage, [view])
            strip = Strip(f"seams, {stage.look}", ours, truth)
            measured.append((value, seam_contrast(cast - truth, owner, seen), strip))
    value, rival, *strips = max(measured, key=lambda one: one[0], default=(np.nan, np.nan))
    return Finding(
        f"contrast of seams, {stage.look}",
        value if len(measured) > 1 else float("nan"),
        _BOUND,
        "goal: 1.5 × the error's steps between ordinary neighbours within 6 pixels",
        "× ordinary steps",
        strips=strips,
        ray_caster=rival,
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
    "shows. Here rays have their own lengths, faces that meet share the pixels of their seam, and what a "
    "frame before had chosen is kept while it serves about as well.",
    run,
)
