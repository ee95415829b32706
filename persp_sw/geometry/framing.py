"""A camera that sees the whole volume, for whoever has not said where to look from."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ..arrays import Vector
from ..volume.grid import Volume
from .regions import Regions
from .view import View

FRONT_RIGHT_ABOVE = (0.5, -1.0, 0.4)  # towards the eye; for a patient (x = L, y = P, z = S) before the face
UP = (0.0, 0.0, 1.0)
FOVY = 30.0  # degrees
MARGIN = 1.02  # the picture is this much larger than what must fit


def framed_view(
    volume: Volume,
    regions: Regions | None = None,
    *,
    direction: Vector = FRONT_RIGHT_ABOVE,
    eye: Vector | None = None,
    centre: Vector | None = None,
    up: Vector | None = None,
    fovy: float | None = None,
    parallel_height: float | None = None,
    size: Sequence[int] = (512, 512),
    eye_offset: Vector = (0.0, 0.0, 0.0),
) -> View:
    """A view of `volume`; whatever is not given is chosen so that the whole shown box is in the picture.

    Parameters
    ----------
    regions
        What of the volume is shown; its crop box is what has to fit. None: all.
    direction
        From the centre towards the eye, world; only where `eye` is not given.
    eye, centre, up
        World xyz. By default: far enough along `direction`, the middle of the shown box, and z (y where the
        line of sight is along z).
    fovy
        Full vertical angle, degrees. By default 30, or what shows the whole box (5 … 100) where `eye` is
        given.
    parallel_height
        World length that the picture's height shows in a parallel projection; it takes the place of `fovy`.
    size
        Width and height, pixels.
    eye_offset
        Added to the eye after all has been chosen: the frames of an animation keep the first one's choices.

    Raises
    ------
    ViewError
        Numbers that make no view; see `View.look_at`.
    """
    corners = _corners(volume, regions)
    centre = corners.mean(0) if centre is None else np.asarray(centre, np.float64)
    back = np.asarray(direction, np.float64) if eye is None else np.asarray(eye, np.float64) - centre
    distance = float(np.linalg.norm(back))
    if distance == 0:  # View.look_at says what is wrong
        return View.look_at(centre, centre, UP, FOVY, size)
    back = back / distance
    if up is None:
        up = UP if abs(back[2]) < 0.99 else (0.0, 1.0, 0.0)
    right = np.cross(np.asarray(up, np.float64), back)
    right /= max(np.linalg.norm(right), 1e-300)
    offsets = corners - centre
    x, y, z = np.abs(offsets @ right), np.abs(offsets @ np.cross(back, right)), offsets @ back
    half = np.maximum(y, x * size[1] / size[0]) * MARGIN  # half heights the picture needs, corner by corner
    if eye is None:
        fovy = FOVY if fovy is None else fovy
        tangent = np.tan(np.radians(min(max(fovy, 1e-3), 179.0)) / 2)
        distance = max(float(np.max(z + half / tangent)), 2 * max(volume.spacing))
        eye = centre + back * distance
    elif fovy is None:
        depth = distance - z
        fovy = 100.0 if (depth <= 0).any() else float(2 * np.degrees(np.arctan(np.max(half / depth))))
        fovy = min(max(fovy, 5.0), 100.0)
    eye = np.asarray(eye, np.float64) + eye_offset
    if parallel_height is not None:
        return View.parallel(eye, centre, up, parallel_height, size)
    return View.look_at(eye, centre, up, fovy, size)


def _corners(volume: Volume, regions: Regions | None) -> NDArray[np.float64]:
    """(8, 3) world corners of the shown box; of the whole one where the crop leaves nothing."""
    low, high = (regions or Regions()).box(volume)
    if (low > high).any():
        low, high = Regions().box(volume)
    points = np.array([[*corner, 1.0] for corner in product(*zip(low, high, strict=True))])
    return points @ volume.world_from_object[:3].T
