"""Turntables: the volume turns before a camera that stays."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

import persp_sw as psw

from ..cameras import Camera
from ..pose import Vector
from .flight import FlightError

_STEP_BACK = 1.02
_MARGIN = 0.04  # of a frame's shorter side: more than a pixel of the eye image, which smooths the corners


def turntable(
    home: Camera, axis: Vector, count: int, degrees: float = 360.0, tilt: float = 0.0
) -> list[Camera]:
    """The cameras of so many frames around the home's pivot.

    Parameters
    ----------
    home
        Of the first frame, but for the tilt.
    axis
        World direction to turn around; by the right hand for positive degrees.
    degrees
        Of the whole way. Whole turns do not show their first view again at the end, so that a player can
        repeat them without a halt; others end with it.
    tilt
        Degrees to go up, towards the axis, before the way begins; never over the top.

    Raises
    ------
    FlightError
        An axis of length 0, or numbers that are not finite.
    """
    axis = np.asarray(axis, np.float64)
    if not np.isfinite([*axis, degrees, tilt]).all() or not np.linalg.norm(axis) > 0:
        raise FlightError(
            f"a turntable has an axis of three numbers, not all 0, and finite angles; given {axis.tolist()}, "
            f"{degrees} and {tilt}"
        )
    start = home.on_turntable(0.0, np.radians(tilt), axis) if tilt else home
    steps = count if degrees % 360 == 0 else max(count - 1, 1)
    return [start.turned(axis, np.radians(degrees) * number / steps) for number in range(count)]


def far_enough(
    home: Camera, way: Callable[[Camera], Sequence[Camera]], corners: np.ndarray, size: tuple[int, int]
) -> list[Camera]:
    """The cameras of a way, begun so far away from the home's pivot that all of them show all corners.

    Parameters
    ----------
    way
        The cameras, of the first one.
    corners
        (n, 3) world; they do not surround a camera however far away.
    size
        Width and height of the frames, pixels.
    """
    cameras = list(way(home))
    while not all(_shows(camera, corners, size) for camera in cameras):
        home = home.zoomed(_STEP_BACK)
        cameras = list(way(home))
    return cameras


def _shows(camera: Camera, corners: np.ndarray, size: tuple[int, int]) -> bool:
    pixels = psw.View.through_wall(camera.position, camera.wall(size)).project(corners)
    margin = _MARGIN * min(size)
    return bool(
        ((pixels >= margin) & (pixels <= np.array(size) - margin)).all()
    )  # not NaN, behind the camera
