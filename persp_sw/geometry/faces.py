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
from .seams import REACH, reach_of
from .sight import EyeGeometry, Sight, Sights, seen_volume

# Rays this far (pixels) beyond the last pixel's centre are still found.
_GUARD = 1e-6
# A rectangle of n pitches takes up to n + 3 pixels, whatever its position against the pixels.
_EXTRA = 3
# The axis of parallel rays, once chosen, stays while no other is better by this factor.
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

    Each ray is shown by the face whose own it is, see `seams`, and near one by both. So as an eye moves rays
    change faces one after the other, and the picture never does all at once. With a `single_face_tangent`
    above 1, one face shows all rays while none has a tangent beyond that in it. The eye may be anywhere:
    outside, on a side, inside.

    `previous`, the faces of the frame before, matters to parallel rays only: all of them change their axis at
    once, and an eye at rest between two should not make the picture flicker.
    """
    if not geometry.views:
        return []
    if geometry.at_infinity:
        return _parallel_needs(geometry, previous)
    sights = Sights.of(geometry, REACH)
    single = _single_face(sights, single_face_tangent) if single_face_tangent > 1 else None
    return _needs_of_sights(geometry, sights, single)


def faces_for(
    needs: Sequence[Need], *, quality: float, max_size: int, intermediate_size: int | None = None
) -> list[Face]:
    """The faces that cover the needs, of one pitch, which changes no faster than the view does.

    Pixel centres lie at odd multiples of half the pitch. So a picture keeps its rays when its rectangle grows
    by a pixel, and none of them lies in a slice or a side, where nobody can decide.

    `intermediate_size` replaces `quality`: the largest face gets so many pixels on its longer side, or up to
    four less, its width rounded up to a packet's 16.
    """
    if not needs:
        return []
    most = max_size // TILE * TILE
    if intermediate_size:
        most = min(most, -(-intermediate_size // TILE) * TILE)
        pitch = _pitch_of_size(needs, intermediate_size - _EXTRA)
    else:
        # The width is a multiple of a packet's 16 pixels anyway: use it, so that a small picture is not made
        # of its own margins.
        pitch = _common_pitch(needs) / quality
        pitch = min(pitch, _pitch_of_size(needs, TILE - _EXTRA) or pitch)
    pitch = max(pitch, _pitch_of_size(needs, most - _EXTRA)) or 1.0
    faces = [need.face(pitch, most) for need in needs]
    return [face for face in faces if face is not None]


@dataclass(frozen=True, eq=False)
class Need:
    """What one face must cover: a rectangle of tangents (of voxels, for an eye at infinity).

    One of `own_rays` alone shows what is near its seams, too; how near, depends on the pitch.
    """

    axis: int
    sign: int
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    work: float  # samples, if all is seen, times pitch²
    pitch: float  # that the volume and the walls ask for
    own_rays: bool = False
    parallel: tuple[float, float] | None = None

    def longest(self, reach: float) -> float:
        """The longer side of what there is up to tangents of `reach`; 0 where there is nothing."""
        low, high = self._within(reach)
        return float(max((high - low).max(), 0.0))

    def face(self, pitch: float, most: int) -> Face | None:
        """The pixels that the warp's bilinear look-up needs, in whole packets, at most `most` in a row.

        None where all lies beyond the zone of the seam in which another face shows it, too.

        Where rays may be steep, packets begin at multiples of 16 pixels from 0, if there is room, so that a
        pixel stays in its packet, whose steepest ray decides how many samples it takes, when the rectangle
        grows. Where none is, spare pixels lie where the box ends rather than behind a seam: there they are
        empty and cost nothing. (Faces of 30 pixels, from a corner: 62,000 samples instead of 81,000.)
        """
        low, high = self._within(reach_of(pitch))
        if (low > high).any():
            return None
        first = np.floor(low / pitch - 0.5 - _GUARD)
        end = np.ceil(high / pitch + 0.5 + _GUARD)
        begin = first[0] // TILE * TILE
        width = -(-end[0] // TILE) * TILE - begin
        if self.own_rays or width > most:
            width = -(-(end[0] - first[0]) // TILE) * TILE
            begin = end[0] - width if high[0] < self.high[0] else first[0]
        origin = float(begin * pitch), float(first[1] * pitch)
        size = int(width), int(end[1] - first[1])
        return Face(self.axis, self.sign, origin, float(pitch), size, self.parallel)

    def _within(self, reach: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        if not self.own_rays:
            return self.low, self.high
        return np.maximum(self.low, -reach), np.minimum(self.high, reach)


def _parallel_needs(geometry: EyeGeometry, previous: Sequence[Face]) -> list[Need]:
    """The one need that serves an eye at infinity; none where no wall shows the box."""
    before = previous[0] if len(previous) == 1 else None
    shear = Shear.along(-geometry.eye, _STAY, before and (before.axis, before.sign))
    sight = shear.sight(geometry)
    if sight is None:
        return []
    pitch = max(1.0, min(shear.pixel_size(geometry, view) for view in geometry.views))  # a pixel a voxel
    return [Need(shear.axis, shear.sign, sight.low, sight.high, 1.0, pitch, parallel=shear.tangents)]


def _needs_of_sights(geometry: EyeGeometry, sights: Sights, only: int | None) -> list[Need]:
    """A need for each direction that sees something: `only` one, for all rays, or each for its own."""
    pixels = sights.pixel_sizes(geometry, only)
    if only is None:
        shown = {direction: sights.own(direction) for direction in range(6)}
    else:
        shown = {only: sights.whole(only)}
    return [
        _need(geometry, direction, sight, only is None, pixels[direction])
        for direction, sight in shown.items()
        if sight is not None
    ]


def _need(geometry: EyeGeometry, direction: int, sight: Sight, own_rays: bool, pixel: float) -> Need:
    """What a face must cover that holds the rays of a sight."""
    pitch = max(_volume_pitch(geometry, sight), pixel)
    axis, sign = direction // 2, 1 if direction % 2 else -1
    _, shown = seen_volume(geometry, axis, sign, sight.low, sight.high)
    return Need(axis, sign, sight.low, sight.high, float(shown.sum()), pitch, own_rays)


def _volume_pitch(geometry: EyeGeometry, sight: Sight) -> float:
    """One pixel a voxel on the nearest slice, but no finer than half a pixel a voxel on the farthest.

    The nearest is where the box begins; from inside it is the eye's own, or where the near distance lets it.
    """
    front = 0.0 if geometry.inside else max(sight.nearest, 0.0)
    return float(1 / max(front, geometry.near / sight.steepest, sight.farthest / 2))


def _single_face(sights: Sights, limit: float) -> int | None:
    """The direction in which all is before the eye with the smallest largest tangent, if below `limit`."""
    best, least = None, limit
    for direction in range(6):
        sight = sights.whole(direction)
        if sight is not None and sight.nearest > 0:
            steepest = max(np.abs(sight.low).max(), np.abs(sight.high).max())
            if steepest <= least:
                best, least = direction, steepest
    return best


def _common_pitch(needs: Sequence[Need]) -> float:
    """One pitch for all faces with the samples of each face's own: Σ work / pitch² is the same.

    So a face that comes into view changes it from nothing on, as the eye moves.
    """
    work = np.array([need.work for need in needs])
    if len(needs) == 1 or not work.any():
        return min(need.pitch for need in needs)
    return float(np.sqrt(work.sum() / (work / np.square([need.pitch for need in needs])).sum()))


def _pitch_of_size(needs: Sequence[Need], pixels: int) -> float:
    """At which the longest face has so many pixels; what it shows depends on it. 0 if it has no length."""
    reach = REACH
    for _ in range(4):  # each step leaves a part of the error: the zones' of the whole
        pitch = max(need.longest(reach) for need in needs) / pixels
        reach = reach_of(pitch)
    return pitch
