"""What lies in front of points, and what a ray meets first: for marks in the volume, and for picking."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _jit
from .arrays import Points, Vector, number, vector
from .errors import SettingsError, ViewError
from .geometry.parts import shown_parts
from .geometry.regions import Regions
from .geometry.view import Eye, View
from .kernels import march
from .kernels.march import composite_rays, hit_rays
from .optics.classification2d import classify
from .optics.look import Look
from .optics.shading import weights_of
from .optics.transfer import TransferFunction
from .optics.transfer2d import TransferFunction2D
from .volume.gradient import largest_magnitude, world_from_differences
from .volume.grid import Volume
from .volume.lift import lift_exponent

if TYPE_CHECKING:
    from .renderer import Renderer

THRESHOLD = 0.5
_STEP = 0.5  # of the smallest spacing
_RESIDUAL = 1e-3


@dataclass(frozen=True, eq=False)
class Pick:
    """What a ray meets first.

    Attributes
    ----------
    position_world, position_object
        Where: world xyz, and voxel index coordinates xyz.
    value
        The volume's, interpolated, there.
    distance
        World units from the ray's origin; of a parallel view from its wall's plane, negative before it.
    opacity
        What the ray has met up to there: the threshold.
    """

    position_world: Points
    position_object: Points
    value: float
    distance: float
    opacity: float


class Probe:
    """Rays through one volume as it is shown, a few thousand at a time.

    A mark of colour c that covers a of what it is drawn over, at a distance D along a ray, makes a pixel

        (1 − a)·V + a·(F + T·c)

    of V, the finished pixel of the whole volume; F and T are the premultiplied colour and the transparency of
    what lies in front of D, which `in_front` tells. So marks are at their right depth in every finished
    picture, without any depth of its pixels: painted over it with colour F + T·c and opacity a, in whatever
    way, for any wall and eye.

    Parameters
    ----------
    volume, transfer, regions, look
        What is shown; of the look, modulation by the gradient counts, light does not. A transfer function
        without a unit has that of the volume's smallest spacing.
    step
        Longest piece that rays are cut into, world units, > 0; None: half the smallest spacing.
    residual
        Rays end where no more than this transparency is left, 0 … 0.5: `in_front` errs by no more.
    threads
        1 … the processor's cores; None: all. Results do not depend on it.

    Raises
    ------
    SettingsError
        A number out of range.

    Accuracy: a medium of one value is exact, to rounding and `residual`. Else opacity and colour err by
    O(step²) in smooth volumes, and hits of a surface, where the value is linear, by 1/16 of a step at most.
    Cells with a voxel that has no value are transparent to within a step. Light is not considered: colours
    are those of the transfer function.
    """

    def __init__(
        self,
        volume: Volume,
        transfer: TransferFunction | TransferFunction2D,
        regions: Regions | None = None,
        look: Look | None = None,
        *,
        step: float | None = None,
        residual: float = _RESIDUAL,
        threads: int | None = None,
    ):
        self.volume, self.transfer, self.regions = volume, transfer, regions or Regions()
        self.look = look or Look()
        self.step = _STEP * min(volume.spacing)
        if step is not None:
            self.step = number(step, "a probe's step", SettingsError, 1e-6 * self.step)
        self.residual = number(residual, "residual", SettingsError, 0, 0.5)
        self.threads = int(
            number(threads or _jit.max_threads(), "threads", SettingsError, 1, _jit.max_threads())
        )
        classification, lift = classify(transfer, volume), lift_exponent(volume)
        rows = classification.rows.astype(np.float64).reshape(classification.magnitudes, -1, 4)[:, 1:]
        rows[..., :3] *= rows[..., 3:]
        sums = np.concatenate([np.zeros((len(rows), 1, 4)), np.cumsum(rows, 1)], 1)
        gradient = _gradient_of(volume, self.look)
        gradient[march.PER_MAGNITUDE] = np.ldexp(classification.per_magnitude, lift)
        if classification.magnitudes > 1:
            gradient[march.REACH] = self.look.gradient_distance
        origin, scale = np.ldexp(classification.origin, -lift), np.ldexp(classification.scale, lift)
        self._field = volume.data, sums, float(origin), float(scale), gradient  # as `march` takes it
        self._object_from_world = np.linalg.inv(volume.world_from_object)

    @classmethod
    def of(cls, renderer: Renderer, **options: float | None) -> Probe:
        """That of what a renderer shows now; `options` as for the class."""
        return cls(renderer.volume, renderer.transfer, renderer.regions, renderer.look, **options)

    def in_front(self, eye: Eye, points: ArrayLike) -> NDArray[np.float64]:
        """What an eye sees in front of points.

        Parameters
        ----------
        eye
            Anywhere, at infinity too; nothing nearer than its near distance counts.
        points
            (..., 3) world.

        Returns
        -------
        (..., 4) float64: linear premultiplied colour and opacity; 0 where nothing lies between.

        Raises
        ------
        ViewError
            Points that are no points.
        """
        points = np.asarray(points, np.float64)
        if points.shape[-1:] != (3,) or not np.isfinite(points).all():
            raise ViewError(f"points are finite numbers (..., 3); given an array of shape {points.shape}")
        flat = points.reshape(-1, 3)
        out = np.zeros((len(flat), 4))
        if eye.is_at_infinity:
            rays = self._rays(flat, np.broadcast_to(-eye.position, flat.shape), -np.inf, np.zeros(len(flat)))
            source = (*(self._object_from_world[:3, :3] @ eye.position), 0.0)
        else:
            way = flat - eye.position
            far = np.linalg.norm(way, axis=1)
            way = np.divide(way, far[:, None], out=np.zeros_like(way), where=far[:, None] > 0)
            rays = self._rays(np.broadcast_to(eye.position, flat.shape), way, eye.near, far)
            source = self._object_from_world @ (*eye.position, 1.0)
        rows, ends = self._parts(source)
        _jit.set_threads(self.threads)
        composite_rays(
            *self._field,
            rows,
            ends,
            rays,
            self.step,
            self.residual,
            out,
        )
        return out.reshape(*points.shape[:-1], 4)

    def first_hit(
        self,
        origin: Vector,
        direction: Vector,
        *,
        near: float = 0.0,
        far: float = np.inf,
        threshold: float = THRESHOLD,
    ) -> Pick | None:
        """What a ray meets first, as a wand's: where its opacity reaches a threshold.

        Parameters
        ----------
        origin, direction
            World; any length of the direction. The origin may lie inside the volume.
        near, far
            Distances from the origin between which something may be met, world units.
        threshold
            Above 0, below 1.

        Returns
        -------
        None where it never does.

        Raises
        ------
        ViewError, SettingsError
            Numbers out of range, a direction of length 0.
        """
        origin = vector(origin, "a ray's origin", ViewError)
        direction = vector(direction, "a ray's direction", ViewError)
        near = number(near, "a ray's near distance", ViewError)
        source = self._object_from_world @ (*origin, 1.0)
        return self._hit(origin, direction, source, near, float(far), threshold)

    def pick(self, view: View, pixel: tuple[float, float], threshold: float = THRESHOLD) -> Pick | None:
        """What is seen at a place of a picture: `first_hit` of its ray.

        Parameters
        ----------
        pixel
            (column, row) from the picture's upper left corner, as `View.project` tells: the centre of the
            first pixel is (0.5, 0.5).
        """
        column, row = vector((*pixel, 1.0), "a pixel (column, row)", ViewError)[:2]
        direction = view.direction_from_pixel @ (column, row, 1.0)
        if view.eye.is_at_infinity:
            origin = view.wall.world_from_pixel @ (column, row, 1.0)
            source = (*(self._object_from_world[:3, :3] @ view.eye.position), 0.0)
            return self._hit(origin, direction, source, -np.inf, np.inf, threshold)
        return self.first_hit(view.eye.position, direction, near=view.eye.near, threshold=threshold)

    def _hit(self, origin, direction, source, near, far, threshold) -> Pick | None:
        length = np.linalg.norm(direction)
        if length == 0:
            raise ViewError("a ray's direction is not zero")
        threshold = number(threshold, "threshold", SettingsError, 1e-6, 1 - 1e-6)
        rays = self._rays(origin[None], direction[None] / length, near, np.array([far]))
        rows, ends = self._parts(source)
        out = np.empty((1, 3))
        _jit.set_threads(1)
        hit_rays(
            *self._field,
            rows,
            ends,
            rays,
            self.step,
            threshold,
            out,
        )
        distance, value, opacity = out[0].tolist()
        if np.isnan(distance):
            return None
        ray = rays[0]
        position_object = ray[:3] + distance * ray[3:6]
        return Pick(origin + distance / length * direction, position_object, value, distance, opacity)

    def _parts(self, source: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Half-spaces of the shown parts, front to back from a source (x, y, z, w), and their ends."""
        parts = [part.half_spaces for part in shown_parts(self.regions, self.volume, np.asarray(source))]
        return np.concatenate([np.zeros((0, 4)), *parts]), np.cumsum(
            [len(rows) for rows in parts], dtype=np.int64
        )

    def _rays(
        self, starts: Points, directions: Points, near: float, far: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Rays of world starts and unit directions as the kernels want them."""
        rays = np.empty((len(starts), 8))
        rays[:, :3] = starts @ self._object_from_world[:3, :3].T + self._object_from_world[:3, 3]
        rays[:, 3:6] = directions @ self._object_from_world[:3, :3].T
        rays[:, 6], rays[:, 7] = near, far
        return rays


def _gradient_of(volume: Volume, look: Look) -> NDArray[np.float64]:
    """What kernels need of gradients; no reach where the look does not ask for any."""
    numbers = np.zeros(march.GRADIENT)
    numbers[:9] = world_from_differences(volume).ravel()
    weights = march.LOW, march.PER_WEIGHT, march.THICKENED, march.COLOURED
    numbers[list(weights)] = weights_of(look.modulation, largest_magnitude(volume, look.gradient_distance))
    numbers[march.REACH] = 0.0 if look.modulation is None else look.gradient_distance
    return numbers
