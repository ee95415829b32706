"""The shear of an eye at infinity: all rays have one direction, and one principal axis serves them all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Matrix
from ..volume.levels import STANDARD_AXES
from .sight import EyeGeometry, Sight, Sights, box_sides
from .view import View


@dataclass(frozen=True)
class Shear:
    """Parallel rays in object space, told apart by where they meet slice k = 0 of the principal axis.

    Attributes
    ----------
    axis, sign
        Principal axis k and the rays' direction along it.
    tangents
        (t_i, t_j) = (d_i, d_j) / |d_k| of all rays.
    """

    axis: int
    sign: int
    tangents: tuple[float, float]

    @classmethod
    def along(
        cls, direction: NDArray[np.float64], stay: float = 1.0, before: tuple[int, int] | None = None
    ) -> Shear:
        """Rays along an object-space direction; the axis `before` stays up to tangents of `stay`."""
        weight = np.abs(direction)
        axis = int(np.argmax(weight))
        if before and before[1] * direction[before[0]] * stay >= weight[axis]:
            axis = before[0]
        i, j, k = STANDARD_AXES[axis]
        tangents = float(direction[i] / weight[k]), float(direction[j] / weight[k])
        return cls(axis, 1 if direction[k] > 0 else -1, tangents)

    @property
    def plane_from_object(self) -> Matrix:
        """(3, 4): object xyz1 to (i, j, 1), where that point's ray meets slice k = 0."""
        i, j, k = STANDARD_AXES[self.axis]
        matrix = np.zeros((3, 4))
        matrix[0, i] = matrix[1, j] = matrix[2, 3] = 1
        matrix[:2, k] = -self.sign * np.array(self.tangents)
        return matrix

    def plane_from_pixel(self, object_from_world: Matrix, view: View) -> Matrix:
        """(3, 3): pixel point (column, row, 1) of a view to (i, j, 1), where its ray meets slice k = 0."""
        world_from_pixel = np.vstack([view.wall.world_from_pixel, (0, 0, 1)])
        return self.plane_from_object @ object_from_world @ world_from_pixel

    def sight(self, geometry: EyeGeometry) -> Sight | None:
        """Bounds (i, j), on slice k = 0, of what the walls show of the box."""
        sides = box_sides(geometry.low, geometry.high)
        points = np.concatenate([sides, np.ones((6, 4, 1))], -1) @ self.plane_from_object.T
        matrices = [self.plane_from_pixel(geometry.object_from_world, view) for view in geometry.views]
        sizes = [view.size for view in geometry.views]
        # (i, j, 1) are tangents in direction +z, whose axes i, j, k are x, y, z.
        return Sights(points, matrices, sizes, np.eye(3)).whole(5)

    def pixel_size(self, geometry: EyeGeometry, view: View) -> float:
        """The finest that a wall can show, in voxels: the smaller singular value of ∂(i, j)/∂pixel."""
        jacobian = self.plane_from_pixel(geometry.object_from_world, view)[:2, :2]
        return float(np.linalg.svd(jacobian, compute_uv=False)[-1])
