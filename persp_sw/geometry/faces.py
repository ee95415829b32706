"""Which faces an eye image needs, and which rectangle of tangents at which pitch each of them covers.

See DESIGN section 3 in `docs/design.md`. Everything is in object (voxel index) space relative to the eye: the
rays do not know about walls, and a wall only bounds the rays that matter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.scanline import STEEP
from ..kernels.state import TILE
from .parallel import Shear
from .sight import EyeGeometry, Sight, Sights

# Rays this far (pixels) beyond the last pixel's centre are still found.
_GUARD = 1e-6
# A rectangle of n pitches takes up to n + 3 pixels, whatever its position against the pixels.
_EXTRA = 3
# Where the box begins nearer than this part of the distance at which it ends, one face, which has no seam,
# may take so many times the work of several. (At a tangent of 2 it takes 15.2 instead of 8.4 M samples.)
_CLOSE = 1 / 8
_WORTH = 1.5
# What a previous frame chose stays while nothing is better by this factor.
_STAY = 1.1


@dataclass(frozen=True)
class Face:
    """A rectangle of rays of one principal direction.

    Attributes
    ----------
    axis, sign
        Principal axis k (0 x, 1 y, 2 z) and the direction along it, −1 or +1.
    origin
        Tangents (t_i, t_j) of the corner of pixel (0, 0). Pixel (u, v) is the ray from the eye with tangents
        origin + (u + ½, v + ½)·pitch, whose direction in standard space is (t_i, t_j, sign).
    pitch
        Distance of neighbouring pixels in tangents.
    size
        Width (a multiple of 16) and height in pixels.
    parallel
        None for an eye at a point. For one at infinity the tangents (t_i, t_j) of all rays; `origin` and
        `pitch` then are voxels: pixel (u, v) is the ray that meets slice k = 0 at (i, j) =
        origin + (u + ½, v + ½)·pitch.
    """

    axis: int
    sign: int
    origin: tuple[float, float]
    pitch: float
    size: tuple[int, int]
    parallel: tuple[float, float] | None = None

    def rays(
        self, eye: NDArray[np.float64]
    ) -> tuple[tuple[float, float], float, tuple[float, float], float, float]:
        """The face's rays in standard space, for an eye at standard-space position `eye`.

        Returns
        -------
        (o_i, o_j), offset pitch, (t_i, t_j), tangent pitch, k_0: on slice k, at D = sign·(k − k_0), the ray
        of pixel (u, v) is at i = o_i + (u + ½)·offset pitch + (t_i + (u + ½)·tangent pitch)·D; j so with v.
        """
        if self.parallel is not None:
            return self.origin, self.pitch, self.parallel, 0.0, 0.0
        return (float(eye[0]), float(eye[1])), 0.0, self.origin, self.pitch, float(eye[2])

    @property
    def steepest(self) -> float:
        """Largest |tangent| in the rectangle."""
        if self.parallel is not None:
            return max(abs(t) for t in self.parallel)
        ends = [(t, t + n * self.pitch) for t, n in zip(self.origin, self.size, strict=True)]
        return max(abs(t) for pair in ends for t in pair)

    def samples_per_interval(self, least: int) -> int:
        """Samples that the steepest ray takes in a slice interval, a power of two from `least` to 4."""
        return max(least, 4 if self.steepest > 2 * STEEP else 2 if self.steepest > STEEP else 1)


def needs_of(geometry: EyeGeometry, single_face_tangent: float, previous: Sequence[Face] = ()) -> list[Need]:
    """What the faces must cover that hold a ray which meets the box and some wall's frustum.

    One face serves while no such ray has a tangent beyond `single_face_tangent` in it, and while it takes not
    much more work, if the eye is close or inside, than several would; else several do, each limited to its
    own rays (largest |component|). The eye may be anywhere: outside, on a side, inside.

    `previous` are the faces of the frame before, which are kept a little beyond the point where others would
    be chosen, so that an eye at rest on that point does not make the picture flicker.
    """
    if not geometry.views:
        return []
    if geometry.at_infinity:
        return _parallel_needs(geometry, previous)
    return _needs(geometry, single_face_tangent, previous)


def faces_for(
    needs: Sequence[Need],
    *,
    quality: float,
    max_size: int,
    intermediate_size: int | None = None,
    previous: Sequence[Face] = (),
) -> list[Face]:
    """The faces that cover the needs.

    Pixel centres lie at odd multiples of half the pitch. So a picture keeps its rays when its rectangle grows
    by a pixel, none of them lies in a slice or a side, where nobody can decide, and where several faces meet,
    at a tangent of ±1, both have pixels on the same rays: they share one pitch, 2 over an odd number.

    `intermediate_size` replaces `quality`: the largest face gets so many pixels on its longer side, or up to
    four less, its width rounded up to a packet's 16. `previous`: as `needs_of`'s; their pitch is kept, too.
    """
    if not needs:
        return []
    longest = max(need.longest for need in needs)
    most = max_size // TILE * TILE
    if intermediate_size:
        most = min(most, -(-intermediate_size // TILE) * TILE)
        pitch = longest / (intermediate_size - _EXTRA) or 1.0
    else:
        # The width is a multiple of a packet's 16 pixels anyway: use it, so that a small picture is not made
        # of its own margins.
        pitch = _common_pitch(needs) / quality
        pitch = min(pitch, longest / (TILE - _EXTRA) or pitch)
    pitch = max(pitch, longest / (most - _EXTRA))
    if len(needs) > 1:
        pitch = _seam_pitch(pitch, longest, most, previous, exact=bool(intermediate_size))
    return [need.face(pitch, most) for need in needs]


@dataclass(frozen=True, eq=False)
class Need:
    """What one face must cover: a rectangle of tangents (of voxels, for an eye at infinity)."""

    axis: int
    sign: int
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    depth: float  # slices, at most
    pitch: float  # that the volume and the walls ask for
    parallel: tuple[float, float] | None = None

    @property
    def longest(self) -> float:
        """The rectangle's longer side."""
        return float((self.high - self.low).max())

    @property
    def work(self) -> float:
        """Samples that its own pitch takes, if all is seen."""
        return float(max(np.prod(self.high - self.low), 1e-6) * self.depth / self.pitch**2)

    def face(self, pitch: float, most: int) -> Face:
        """The pixels that the warp's bilinear look-up needs, in whole packets, at most `most` in a row.

        Packets begin at multiples of 16 pixels from 0, where there is room, so that a pixel stays in its
        packet, whose steepest ray decides how many samples it takes, when the rectangle grows.
        """
        first = np.floor(self.low / pitch - 0.5 - _GUARD)
        end = np.ceil(self.high / pitch + 0.5 + _GUARD)
        begin = first[0] // TILE * TILE
        width = -(-end[0] // TILE) * TILE - begin
        if width > most:
            begin = first[0]
            width = -(-(end[0] - begin) // TILE) * TILE
        origin = float(begin * pitch), float(first[1] * pitch)
        size = int(width), int(end[1] - first[1])
        return Face(self.axis, self.sign, origin, float(pitch), size, self.parallel)


def _parallel_needs(geometry: EyeGeometry, previous: Sequence[Face]) -> list[Need]:
    """The one need that serves an eye at infinity; none where no wall shows the box."""
    before = previous[0] if len(previous) == 1 else None
    shear = Shear.along(-geometry.eye, _STAY, before and (before.axis, before.sign))
    sight = shear.sight(geometry)
    if sight is None:
        return []
    pitch = max(1.0, min(shear.pixel_size(geometry, view) for view in geometry.views))  # a pixel a voxel
    depth = geometry.high[shear.axis] - geometry.low[shear.axis]
    return [Need(shear.axis, shear.sign, sight.low, sight.high, depth, pitch, shear.tangents)]


def _needs(geometry: EyeGeometry, limit: float, previous: Sequence[Face]) -> list[Need]:
    """One need if one face can serve, else one for every pyramid that sees something.

    Close by and inside, where a rectangle is filled with what is seen, one face must not take much more work.
    """
    sights = Sights.of(geometry)
    single = _single_face(sights, limit, previous)
    one = [] if single is None else _needs_of_sights(geometry, sights, single)
    if one and not (geometry.inside or sights.whole(single).nearest < _CLOSE * one[0].depth):
        return one
    several = _needs_of_sights(geometry, sights, None)
    worth = _WORTH * (_STAY if len(previous) == 1 else 1 / _STAY if previous else 1)
    if one and one[0].work <= worth * sum(need.work for need in several):
        return one
    return several


def _needs_of_sights(geometry: EyeGeometry, sights: Sights, only: int | None) -> list[Need]:
    """A need for each direction that sees something: `only` one, for all rays, or each for its own."""
    pixels = sights.pixel_sizes(geometry, only)
    if only is None:
        shown = {direction: sights.own(direction) for direction in range(6)}
    else:
        shown = {only: sights.whole(only)}
    return [
        _need(geometry, direction, sight, 1.0 if only is None else np.inf, pixels[direction])
        for direction, sight in shown.items()
        if sight is not None
    ]


def _need(geometry: EyeGeometry, direction: int, sight: Sight, limit: float, pixel: float) -> Need:
    """What a face must cover that holds the rays of a sight, as far as their tangents are below `limit`."""
    low, high = np.clip(sight.low, -limit, limit), np.clip(sight.high, -limit, limit)
    pitch = max(_volume_pitch(geometry, sight), pixel)
    return Need(direction // 2, 1 if direction % 2 else -1, low, high, sight.farthest, pitch)


def _volume_pitch(geometry: EyeGeometry, sight: Sight) -> float:
    """One pixel a voxel on the nearest slice, but no finer than half a pixel a voxel on the farthest.

    The nearest is where the box begins; from inside it is the eye's own, or where the near distance lets it.
    """
    front = 0.0 if geometry.inside else max(sight.nearest, 0.0)
    return float(1 / max(front, geometry.near / sight.steepest, sight.farthest / 2))


def _single_face(sights: Sights, limit: float, previous: Sequence[Face]) -> int | None:
    """The direction in which all is in front of the eye with the smallest largest tangent, if below `limit`.

    After one face, another must be better by a margin; after several, one must be good enough by a margin.
    """
    before = [2 * face.axis + (face.sign > 0) for face in previous]
    if len(before) > 1:
        limit = max(limit / _STAY, 1.0)
    best, best_tangent = None, np.inf
    for direction in range(6):
        sight = sights.whole(direction)
        if sight is not None and sight.nearest > 0:
            steepest = max(np.abs(sight.low).max(), np.abs(sight.high).max())
            if steepest <= limit:
                judged = steepest / _STAY if before == [direction] else steepest
                if judged <= best_tangent:
                    best, best_tangent = direction, judged
    return best


def _common_pitch(needs: Sequence[Need]) -> float:
    """One pitch for all faces with the work of each face's own: Σ area · depth / pitch² is the same."""
    if len(needs) == 1:
        return needs[0].pitch
    work = np.array([need.work for need in needs])
    return float(np.sqrt((work * np.square([need.pitch for need in needs])).sum() / work.sum()))


def _seam_pitch(pitch: float, longest: float, most: int, previous: Sequence[Face], *, exact: bool) -> float:
    """A pitch near `pitch` with pixel centres at tangents of ±1: 1 / (n + ½), n = 14, 30, 46 … by choice.

    Then a whole face, |t| ≤ 1 and an apron, fills its packets. Such steps, and the previous frame's pitch if
    it will do, because another pitch changes all of a picture a little, and an eye that moves slowly should
    seldom meet one.
    """
    if exact:
        return 1 / (int(1 / pitch - 0.5) + 0.5)
    if len(previous) > 1 and 1 / _STAY < previous[0].pitch / pitch < _STAY:
        pitch = previous[0].pitch
    packets = max(round((1 / pitch + 1.5) / TILE), 1)
    largest = (most - _EXTRA) / longest - 0.5 if longest else np.inf
    return 1 / (min(TILE * packets - 2, int(largest)) + 0.5)
