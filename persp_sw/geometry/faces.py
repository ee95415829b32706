"""Which faces an eye image needs, and which rectangle of tangents at which pitch each of them covers.

See DESIGN section 3 in `docs/design.md`. Everything is in object (voxel index) space relative to the eye: the
rays do not know about walls, and a wall only bounds the rays that matter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Matrix
from ..kernels.scanline import STEEP
from ..kernels.state import TILE
from ..volume.levels import STANDARD_AXES
from .view import View

# Part of a wall's pixels that may be finer than the pitch asked for: at grazing angles a few are 30× finer.
_QUANTILE = 0.1
# Points a side of the grid on which a wall's pixel size is measured.
_GRID = 24
# An eye so near to the plane of a side (voxels) is in it.
_TOUCHES = 1e-9
# Rays this far (pixels) beyond the last pixel's centre are still found.
_GUARD = 1e-6
# A rectangle of n pitches takes up to n + 3 pixels, whatever its position against the pixels.
_EXTRA = 3
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
        Tangents (t_i, t_j) of the corner of pixel (0, 0). Pixel (u, v) is the ray with tangents
        origin + (u + ½, v + ½)·pitch, whose direction in standard space is (t_i, t_j, sign).
    pitch
        Distance of neighbouring pixels in tangents.
    size
        Width (a multiple of 16) and height in pixels.
    """

    axis: int
    sign: int
    origin: tuple[float, float]
    pitch: float
    size: tuple[int, int]

    @property
    def steepest(self) -> float:
        """Largest |tangent| in the rectangle."""
        ends = [(t, t + n * self.pitch) for t, n in zip(self.origin, self.size, strict=True)]
        return max(abs(t) for pair in ends for t in pair)

    def samples_per_interval(self, least: int) -> int:
        """Samples that the steepest ray takes in a slice interval, a power of two from `least` to 4."""
        return max(least, 4 if self.steepest > 2 * STEEP else 2 if self.steepest > STEEP else 1)


@dataclass(frozen=True, eq=False)
class EyeGeometry:
    """What the choice of faces depends on.

    Attributes
    ----------
    eye
        Object-space position.
    low, high
        Object-space corners of the box that holds all that can be seen.
    views
        The walls through which this eye looks.
    object_from_world
        Linear part, (3, 3).
    near
        World distance from the eye, along each ray, before which nothing is shown.
    """

    eye: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    views: Sequence[View]
    object_from_world: Matrix
    near: float = 0.0

    @property
    def inside(self) -> bool:
        """Whether the eye is in the box, its sides included."""
        return bool((self.eye >= self.low - _TOUCHES).all() and (self.eye <= self.high + _TOUCHES).all())


def plan_faces(
    geometry: EyeGeometry,
    *,
    quality: float,
    single_face_tangent: float,
    max_size: int,
    intermediate_size: int | None = None,
    previous: Sequence[Face] = (),
) -> list[Face]:
    """The faces that hold a ray which meets the box and some wall's frustum; none if no ray does.

    One face serves while no such ray has a tangent beyond `single_face_tangent` in it; else several do, each
    limited to its own rays (largest |component|). The eye may be anywhere: outside, on a side, inside.

    Pixel centres lie at odd multiples of half the pitch. So a picture keeps its rays when its rectangle grows
    by a pixel, none of them lies in a slice or a side, where nobody can decide, and where several faces meet,
    at a tangent of ±1, both have pixels on the same rays: they share one pitch, 2 over an odd number.

    `intermediate_size` replaces `quality`: the largest face gets so many pixels on its longer side, or up to
    four less, its width rounded up to a packet's 16. `previous` are the faces of the frame before, which are
    kept a little beyond the point where others would be chosen, so that an eye at rest on that point does not
    make the picture flicker.
    """
    polygons = [p for view in geometry.views for p in _seen_polygons(geometry, view)]
    if not polygons:
        return []
    single = _single_face(np.concatenate(polygons), single_face_tangent, previous)
    parts = _parts(polygons) if single is None else {single: np.concatenate(polygons)}
    limit = np.inf if single is not None else 1.0
    rectangles = {key: _Rectangle.of(points, *key, limit) for key, points in parts.items()}
    longest = max(rectangle.longest for rectangle in rectangles.values())
    most = max_size // TILE * TILE
    if intermediate_size:
        most = min(most, -(-intermediate_size // TILE) * TILE)
        pitch = longest / (intermediate_size - _EXTRA) or 1.0
    else:
        pitches = [_pitch(geometry, rectangle, *key, limit) for key, rectangle in rectangles.items()]
        pitch = _common_pitch(pitches, list(rectangles.values())) / quality
        # The width is a multiple of a packet's 16 pixels anyway: use it, so that a small picture is not made
        # of its own margins.
        pitch = min(pitch, longest / (TILE - _EXTRA) or pitch)
    pitch = max(pitch, longest / (most - _EXTRA))
    if single is None:
        pitch = _seam_pitch(pitch, longest, most, previous, exact=bool(intermediate_size))
    return [rectangle.face(*key, pitch, most) for key, rectangle in rectangles.items()]


def tangents(points: NDArray[np.float64], axis: int, sign: int) -> NDArray[np.float64]:
    """(..., 3): tangents t_i, t_j and distance D of directions or of points relative to the eye."""
    i, j, k = STANDARD_AXES[axis]
    distance = sign * points[..., k]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.stack([points[..., i] / distance, points[..., j] / distance, distance], -1)


def _seen_polygons(geometry: EyeGeometry, view: View) -> list[NDArray[np.float64]]:
    """The box's sides, relative to the eye, clipped to the view's frustum."""
    width, height = view.size
    matrix = geometry.object_from_world @ view.direction_from_pixel
    corners = (matrix @ np.array([[0, 0, 1], [width, 0, 1], [width, height, 1], [0, height, 1]]).T).T
    normals = np.cross(corners, np.roll(corners, -1, axis=0))
    middle = matrix @ (width / 2, height / 2, 1)
    normals *= np.sign(normals @ middle)[:, None]  # inwards, whatever the pose's handedness
    low, high = geometry.low - geometry.eye, geometry.high - geometry.eye
    sides = [_clip(side, normals) for side in _box_sides(low, high)]
    return [side for side in sides if len(side)]


def _box_sides(low: NDArray[np.float64], high: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Those sides of a box, relative to the eye, that the eye does not see edge-on.

    A ray that is in the box for more than a point crosses two sides, at most one of which holds the eye; so
    every such ray meets one of these, from without or from within.
    """
    sides = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for end in (low, high):
            if abs(end[axis]) <= _TOUCHES:
                continue
            side = np.empty((4, 3))
            side[:, axis] = end[axis]
            side[:, u] = low[u], high[u], high[u], low[u]
            side[:, v] = low[v], low[v], high[v], high[v]
            sides.append(side)
    return sides


def _clip(polygon: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """The part of a convex polygon where n·p ≥ 0 for all normals (Sutherland, Hodgman 1974)."""
    for normal in normals:
        inside = polygon @ normal
        kept = []
        for a, b, da, db in zip(
            polygon, np.roll(polygon, -1, axis=0), inside, np.roll(inside, -1), strict=True
        ):
            if da >= 0:
                kept.append(a)
            if (da >= 0) != (db >= 0):
                kept.append(a + (b - a) * (da / (da - db)))
        if not kept:
            return np.empty((0, 3))
        polygon = np.array(kept)
    return polygon


def _pyramid(axis: int, sign: int) -> NDArray[np.float64]:
    """Inward normals of the rays whose largest component is `sign` along `axis`."""
    normals = np.zeros((4, 3))
    normals[:, axis] = sign
    normals[:2, (axis + 1) % 3] = -1, 1
    normals[2:, (axis + 2) % 3] = -1, 1
    return normals


def _single_face(
    points: NDArray[np.float64], limit: float, previous: Sequence[Face]
) -> tuple[int, int] | None:
    """The direction in which all points lie in front with the smallest largest tangent, if below `limit`.

    After one face, another must be better by a margin; after several, one must be good enough by a margin.
    """
    before = [(face.axis, face.sign) for face in previous]
    if len(before) > 1:
        limit = max(limit / _STAY, 1.0)
    best, best_tangent = None, np.inf
    for axis in range(3):
        for sign in (-1, 1):
            t_i, t_j, distance = tangents(points, axis, sign).T
            if distance.min() > 0:
                steepest = max(np.abs(t_i).max(), np.abs(t_j).max())
                if steepest <= limit:
                    judged = steepest / _STAY if before == [(axis, sign)] else steepest
                    if judged <= best_tangent:
                        best, best_tangent = (axis, sign), judged
    return best


def _parts(polygons: list[NDArray[np.float64]]) -> dict[tuple[int, int], NDArray[np.float64]]:
    """For each (axis, sign) that owns part of the polygons: the corners of that part."""
    parts = {}
    for axis in range(3):
        for sign in (-1, 1):
            own = [_clip(polygon, _pyramid(axis, sign)) for polygon in polygons]
            own = [polygon for polygon in own if len(polygon)]
            if own:
                parts[axis, sign] = np.concatenate(own)
    return parts


@dataclass(frozen=True, eq=False)
class _Rectangle:
    """The rectangle of tangents that a face must cover, and the points on the box that bound it."""

    points: NDArray[np.float64]
    distance: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]

    @classmethod
    def of(cls, points: NDArray[np.float64], axis: int, sign: int, limit: float) -> _Rectangle:
        points = points[points[:, axis] * sign > 0]
        t_i, t_j, distance = tangents(points, axis, sign).T
        low = np.clip([t_i.min(), t_j.min()], -limit, limit)
        high = np.clip([t_i.max(), t_j.max()], -limit, limit)
        return cls(points, distance, low, high)

    @property
    def longest(self) -> float:
        return float((self.high - self.low).max())

    def face(self, axis: int, sign: int, pitch: float, most: int) -> Face:
        """The pixels that the warp's bilinear look-up needs, in whole packets, at most `most` in a row.

        Packets begin at multiples of 16 pixels from the tangent 0, where there is room, so that a pixel stays
        in its packet, whose steepest ray decides how many samples it takes, when the rectangle grows.
        """
        first = np.floor(self.low / pitch - 0.5 - _GUARD)
        end = np.ceil(self.high / pitch + 0.5 + _GUARD)
        begin = first[0] // TILE * TILE
        width = -(-end[0] // TILE) * TILE - begin
        if width > most:
            begin = first[0]
            width = -(-(end[0] - begin) // TILE) * TILE
        return Face(
            axis,
            sign,
            (float(begin * pitch), float(first[1] * pitch)),
            float(pitch),
            (int(width), int(end[1] - first[1])),
        )


def _pitch(geometry: EyeGeometry, rectangle: _Rectangle, axis: int, sign: int, limit: float) -> float:
    """The pitch that the volume and the walls ask of one face."""
    return max(_volume_pitch(geometry, rectangle), _wall_pitch(geometry, axis, sign, limit))


def _common_pitch(pitches: list[float], rectangles: list[_Rectangle]) -> float:
    """One pitch for all faces with the work of each face's own: Σ area · depth / pitch² is the same."""
    if len(pitches) == 1:
        return pitches[0]
    work = np.array([max(np.prod(r.high - r.low), 1e-6) * r.distance.max() for r in rectangles])
    return float(np.sqrt(work.sum() / (work / np.square(pitches)).sum()))


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


def _volume_pitch(geometry: EyeGeometry, rectangle: _Rectangle) -> float:
    """One pixel a voxel on the nearest slice, but no finer than half a pixel a voxel on the farthest.

    The nearest is where the box begins; from inside it is the eye's own, or where the near distance lets it.
    """
    distance = rectangle.distance
    front = 0.0 if geometry.inside else distance.min()
    if geometry.near:
        world = np.linalg.norm(rectangle.points @ np.linalg.inv(geometry.object_from_world).T, axis=-1)
        front = max(front, geometry.near * (distance / world).min())
    return float(1 / max(front, distance.max() / 2))


def _wall_pitch(geometry: EyeGeometry, axis: int, sign: int, limit: float) -> float:
    """The finest that the walls can show of this face, in tangents; 0 where they show nothing of it."""
    finest = [_pixel_tangent(geometry, view, axis, sign, limit) for view in geometry.views]
    return min((size for size in finest if size > 0), default=0.0)


def _pixel_tangent(geometry: EyeGeometry, view: View, axis: int, sign: int, limit: float) -> float:
    """Smaller singular value of ∂t/∂pixel: a low quantile over the pixels that show the box here."""
    width, height = view.size
    matrix = geometry.object_from_world @ view.direction_from_pixel
    column, row = np.meshgrid(
        (np.arange(_GRID) + 0.5) / _GRID * width, (np.arange(_GRID) + 0.5) / _GRID * height
    )
    directions = np.stack([column, row, np.ones_like(row)], -1).reshape(-1, 3) @ matrix.T
    shown = _meets_box(directions, geometry.low - geometry.eye, geometry.high - geometry.eye)
    i, j, k = STANDARD_AXES[axis]
    shown &= directions[:, k] * sign > 0
    if limit < np.inf:
        shown &= np.abs(directions[:, [i, j]]).max(1) <= limit * np.abs(directions[:, k])
    directions = directions[shown]
    if not len(directions):  # nothing, or smaller than the grid: take the middle of what is seen
        seen = np.concatenate([np.empty((0, 3)), *_seen_polygons(geometry, view)])
        seen = seen[seen[:, k] * sign > 0]
        if not len(seen):
            return 0.0
        middle = seen.mean(0, keepdims=True)
        directions = middle / (np.linalg.inv(matrix) @ middle[0])[2]
    along = sign * directions[:, k, None]
    jacobian = np.stack(
        [
            (matrix[[i, j], axis_] - directions[:, [i, j]] * sign * matrix[k, axis_] / along) / along
            for axis_ in (0, 1)
        ],
        -1,
    )
    return float(np.quantile(np.linalg.svd(jacobian, compute_uv=False)[:, -1], _QUANTILE))


def _meets_box(directions: NDArray, low: NDArray, high: NDArray) -> NDArray[np.bool_]:
    """Whether rays from the origin meet the box."""
    with np.errstate(divide="ignore", invalid="ignore"):
        one, other = low / directions, high / directions
    near = np.nanmax(np.minimum(one, other), axis=1)
    far = np.nanmin(np.maximum(one, other), axis=1)
    return (near <= far) & (far > 0)
