"""Where eyes go in the atlas: around a volume, across the borders between its faces, through its corners."""

from __future__ import annotations

from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from ...geometry.view import View
from ...volume.grid import Volume

Array = NDArray[np.float64]

# From the middle of a box towards its six faces, its twelve edges (a pair of faces each), its eight corners.
FACES: tuple[Array, ...] = tuple(sign * row for row in np.eye(3) for sign in (1, -1))
PAIRS: tuple[tuple[Array, Array], ...] = tuple((a, b) for a, b in combinations(FACES, 2) if a @ b == 0)
CORNERS: tuple[Array, ...] = tuple(np.array(signs, np.float64) for signs in product((1, -1), repeat=3))

# A path across an edge leans a little towards the third axis, as nobody walks in a plane of symmetry.
_LEAN = 0.15
# Through a corner a path goes as obliquely as this against the three faces there.
_ASKEW = np.array([0.3, 0.8, -1.1])


class Arc:
    """Directions towards an eye that turns about the middle of a volume.

    Parameters
    ----------
    middle
        Where the angle is 0; any length.
    axis
        What it turns about, not parallel to `middle`; also the upward direction of views, which therefore
        do not roll.
    """

    def __init__(self, middle: Array, axis: Array):
        self.middle = middle / np.linalg.norm(middle)
        axis = axis - (axis @ self.middle) * self.middle  # a great circle
        self.axis = axis / np.linalg.norm(axis)
        self._ahead = np.cross(self.axis, self.middle)

    def direction(self, degrees: float) -> Array:
        """(3,) unit vector from the middle of the volume towards the eye."""
        angle = np.radians(degrees)
        return np.cos(angle) * self.middle + np.sin(angle) * self._ahead

    def view(
        self, volume: Volume, degrees: float, distance: float, fovy: float, size: tuple[int, int]
    ) -> View:
        """The view of a volume's middle from `distance` of its longest edges away."""
        eye = volume.centre + distance * max(volume.extent) * self.direction(degrees)
        return View.look_at(eye, volume.centre, self.axis, fovy, size)


def across_edge(one: Array, other: Array) -> Arc:
    """From before one face, at −45°, to before its neighbour, at 45°."""
    third = np.cross(one, other)
    return Arc(one + other + _LEAN * third, third)


def through_corner(corner: Array) -> Arc:
    """From before one of a corner's faces to before another, by the corner itself at 0°."""
    return Arc(corner, np.cross(corner, _ASKEW * corner))


def around() -> Arc:
    """Once around a volume: before all six faces and across six of the edges."""
    return Arc(np.array([1.0, -1.0, 0.04]), np.array([1.0, 1.0, 1.0]))
