"""Scenes whose picture is known exactly: a volume, a transfer function, and the picture in closed form.

A renderer that is handed `scene.volume` and `scene.transfer` should come close to `scene.image(view)`; how
close, the ball says rigorously (`bounds`), the others to rounding.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..arrays import Matrix, Vector
from ..geometry.regions import Regions
from ..geometry.view import View
from ..optics.transfer import TransferFunction
from ..volume import phantoms
from ..volume.grid import Volume

Array = NDArray[np.float64]


def shown_part(volume: Volume, view: View, regions: Regions | None = None) -> tuple[Array, Array]:
    """Where each pixel's ray enters and leaves what `regions` shows of a volume's box.

    Returns
    -------
    Two (height, width) arrays of world distances from the eye, not below its near distance, or from the wall
    where the eye is at infinity; equal where the ray misses. ValueError where `regions` are not convex, for
    then one interval cannot tell.
    """
    regions = regions or Regions()
    if not regions.convex:
        raise ValueError("what these regions show is not convex: a ray may meet it several times")
    object_from_world = np.linalg.inv(volume.world_from_object)
    starts = view.starts() @ object_from_world[:3, :3].T + object_from_world[:3, 3]
    directions = _unit_directions(view) @ object_from_world[:3, :3].T
    entry = np.full(directions.shape[:2], -np.inf if view.eye.is_at_infinity else view.eye.near)
    leave = np.full(directions.shape[:2], np.inf)
    for plane in regions.half_spaces(volume):
        offset, slope = starts @ plane[:3] + plane[3], directions @ plane[:3]
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = -offset / slope
        entry = np.where(slope > 0, np.maximum(entry, crossing), entry)
        leave = np.where(slope < 0, np.minimum(leave, crossing), leave)
        leave = np.where((slope == 0) & (offset < 0), -np.inf, leave)
    return entry, np.maximum(entry, leave)


@dataclass(frozen=True)
class Slab:
    """A homogeneous box: alpha = 1 − exp(−extinction · path length in the box).

    Parameters
    ----------
    size
        Voxels along x, y and z.
    pose
        (4, 4) world from voxel index; None: identity.
    opacity
        Per world unit, 0 … 1.
    colour
        Linear, not premultiplied.
    """

    size: tuple[int, int, int] = (9, 9, 9)
    pose: Matrix | None = None
    opacity: float = 0.1
    colour: tuple[float, float, float] = (0.9, 0.6, 0.3)
    volume: Volume = field(init=False, repr=False)
    transfer: TransferFunction = field(init=False, repr=False)

    def __post_init__(self):
        _set(self, "volume", phantoms.constant(self.size, 100.0, self.pose))
        _set(self, "transfer", TransferFunction([(100.0, self.colour, self.opacity)], 1.0))

    def image(self, view: View, regions: Regions | None = None) -> Array:
        """Exact (height, width, 4) linear premultiplied RGBA, to rounding."""
        entry, leave = shown_part(self.volume, view, regions)
        return _coloured(self.colour, self.transfer.extinction(100.0) * (leave - entry))


@dataclass(frozen=True)
class Ramp:
    """A box whose value runs linearly from 0 to 1 and not zero at the faces; two functions have closed forms.

    With one opacity and two colours the colour is tested: it tells end-point from midpoint sampling, first
    order from second. With two opacities and one colour the optical depth is: an integral of a logarithm.

    Parameters
    ----------
    size, pose
        As for a slab; an edge of 2^n + 1 voxels makes the float32 values exact.
    axis
        0, 1, 2: value grows along x, y or z.
    colours, opacities
        At value 0 and 1; opacities per world unit, below 1 − 1e-6. Two of one kind must be equal.
    """

    size: tuple[int, int, int] = (17, 17, 17)
    pose: Matrix | None = None
    axis: int = 2
    colours: tuple[Vector, Vector] = ((0.2, 0.9, 0.4), (1.0, 0.3, 0.5))
    opacities: tuple[float, float] = (0.1, 0.1)
    volume: Volume = field(init=False, repr=False)
    transfer: TransferFunction = field(init=False, repr=False)

    def __post_init__(self):
        if self.opacities[0] != self.opacities[1] and tuple(self.colours[0]) != tuple(self.colours[1]):
            raise ValueError("a ramp has one opacity or one colour; with two of both there is no closed form")
        gradient = np.zeros(3)
        gradient[self.axis] = 1 / (self.size[self.axis] - 1)
        _set(self, "volume", phantoms.linear(self.size, 0.0, gradient, self.pose))
        rows = zip((0.0, 1.0), map(tuple, self.colours), self.opacities, strict=True)
        _set(self, "transfer", TransferFunction(rows, 1.0))

    def image(self, view: View, regions: Regions | None = None) -> Array:
        """Exact (height, width, 4) linear premultiplied RGBA, to 1e-12."""
        entry, leave = shown_part(self.volume, view, regions)
        start, end = self._value_at(view, entry), self._value_at(view, leave)
        if self.opacities[0] != self.opacities[1]:
            clear_0, clear_1 = (
                1 - (self.opacities[0] * (1 - v) + self.opacities[1] * v) for v in (start, end)
            )
            return _coloured(self.colours[0], -_mean_logarithm(clear_0, clear_1) * (leave - entry))
        depth = self.transfer.extinction(0.5) * (leave - entry)
        alpha = -np.expm1(-depth)
        # ∫ s·exp(−depth·s)·depth ds, s = 0 … 1 along the ray: how far along the light comes from, on average.
        series = depth / 2 - depth**2 / 3 + depth**3 / 8
        with np.errstate(divide="ignore", invalid="ignore"):
            along = np.where(depth > 1e-3, alpha / depth - np.exp(-depth), series)
        first, last = np.array(self.colours, np.float64)
        value = start * alpha + (end - start) * along
        rgb = first * alpha[..., None] + (last - first) * value[..., None]
        return np.concatenate([rgb, alpha[..., None]], -1)

    def _value_at(self, view, distance):
        object_from_world = np.linalg.inv(self.volume.world_from_object)
        row = object_from_world[self.axis] / (self.size[self.axis] - 1)
        value = (row[:3] @ view.eye.position + row[3]) + _unit_directions(view) @ row[:3] * distance
        return np.clip(value, 0, 1)  # beyond only by rounding, or where the ray misses


@dataclass(frozen=True)
class Ball:
    """A homogeneous ball in the middle of an empty box: alpha = 1 − exp(−extinction · chord length).

    The ball is where radius² − |p|² ≥ 0, sampled, with a step of the transfer function at 0. What trilinear
    interpolation makes of it lies between two balls, so its exact picture lies between two pictures.

    Parameters
    ----------
    n
        Voxels a side. The box's edge is 2 world units; the ball's centre is (0, 0, 0).
    radius
        World units, below 1.
    """

    n: int = 33
    radius: float = 0.8
    opacity: float = 0.6
    colour: tuple[float, float, float] = (0.3, 0.6, 0.9)
    volume: Volume = field(init=False, repr=False)
    transfer: TransferFunction = field(init=False, repr=False)

    def __post_init__(self):
        spacing = 2 / (self.n - 1)
        pose = np.diag([spacing, spacing, spacing, 1.0])
        pose[:3, 3] = -1
        _set(self, "volume", phantoms.paraboloid((self.n,) * 3, self.radius, pose))
        step = [(0.0, self.colour, 0.0), (0.0, self.colour, self.opacity)]
        edges = [(-4.0, self.colour, 0.0), *step, (1.0, self.colour, self.opacity)]
        _set(self, "transfer", TransferFunction(edges, 1.0))

    def image(self, view: View) -> Array:
        """Exact picture of the true ball, which a sampled one approaches with the square of the spacing."""
        return self._image_of_radius(view, self.radius**2)

    def bounds(self, view: View) -> tuple[Array, Array]:
        """Pictures below and above (per channel) the exact picture of the interpolated voxels.

        On a cell of edge h the interpolant of x² exceeds it by at most h²/4, and so for y and z; float32
        voxels add 1e-7.
        """
        sag = 3 / 4 * (2 / (self.n - 1)) ** 2
        return (
            self._image_of_radius(view, self.radius**2 - sag - 1e-6),
            self._image_of_radius(view, self.radius**2 + 1e-6),
        )

    def _image_of_radius(self, view, radius_squared):
        directions, eye = _unit_directions(view), view.eye.position
        middle = -directions @ eye
        half_squared = radius_squared - (eye @ eye - middle**2)
        half = np.sqrt(np.maximum(half_squared, 0))
        near = view.eye.near
        chord = np.where(
            half_squared > 0, np.maximum(middle + half, near) - np.maximum(middle - half, near), 0
        )
        return _coloured(self.colour, self.transfer.extinction(0.5) * chord)


@dataclass(frozen=True)
class Markers:
    """Single bright voxels, far apart: each must show where `view.project` puts its centre.

    Parameters
    ----------
    size
        Voxels along x, y and z.
    voxels
        (n, 3) whole voxel indices, xyz, not on a face of the box.
    """

    size: tuple[int, int, int] = (33, 33, 33)
    voxels: tuple[tuple[int, int, int], ...] = (
        (8, 8, 8),
        (24, 9, 16),
        (16, 24, 24),
        (7, 24, 15),
        (16, 16, 16),
    )
    pose: Matrix | None = None
    volume: Volume = field(init=False, repr=False)
    transfer: TransferFunction = field(init=False, repr=False)

    def __post_init__(self):
        _set(self, "volume", phantoms.points(self.size, np.array(self.voxels), 255, self.pose))
        rows = [(0.0, (1, 1, 1), 0.0), (255.0, (1, 1, 1), 0.02)]  # thin: alpha is nearly the ray's integral
        _set(self, "transfer", TransferFunction(rows, min(self.volume.spacing)))

    def centres(self, view: View) -> Array:
        """(n, 2) exact pixel coordinates of the markers' centres."""
        pose = self.volume.world_from_object
        return view.project(np.array(self.voxels) @ pose[:3, :3].T + pose[:3, 3])

    def centroids(self, image: NDArray[np.floating], view: View, reach: float) -> Array:
        """(n, 2) alpha-weighted centroids of a picture within `reach` pixels of the exact centres.

        NaN where nothing shows. Accuracy: perspective shifts a blob's centroid by about
        f·tan θ·(size / distance)², see `tests/tolerances.py`.
        """
        width, height = view.size
        column, row = np.arange(width) + 0.5, np.arange(height)[:, None] + 0.5
        found = []
        for x, y in self.centres(view):
            weight = np.where((column - x) ** 2 + (row - y) ** 2 <= reach**2, image[..., 3], 0)
            total = weight.sum(dtype=np.float64)
            found.append(
                ((weight * column).sum() / total, (weight * row).sum() / total) if total else (np.nan,) * 2
            )
        return np.array(found)


def _set(scene, name, value) -> None:
    object.__setattr__(scene, name, value)


def _unit_directions(view: View) -> Array:
    directions = view.directions()
    return directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def _coloured(colour: Vector, depth: Array) -> Array:
    alpha = -np.expm1(-depth)[..., None]
    return np.concatenate([alpha * np.asarray(colour, np.float64), alpha], -1)


def _mean_logarithm(a: Array, b: Array) -> Array:
    """Mean of ln over the interval from a to b, both > 0; a series where they are nearly equal."""
    middle = (a + b) / 2
    r = (b - a) / (2 * middle)
    series = np.log(middle) - r**2 / 6 - r**4 / 20 - r**6 / 42 - r**8 / 72
    with np.errstate(divide="ignore", invalid="ignore"):
        closed = (b * np.log(b) - a * np.log(a)) / (b - a) - 1
    return np.where(np.abs(r) < 0.05, series, closed)
