"""Screens, windows and viewports as OpenCOVER and CalVR describe them, which have one ancestor.

Their room has x to the right, y into the screen and z up; ours has y up and −z into the screen. A screen is
a rectangle in the x-z plane around its origin, turned by r about y, then p about x, then h about z, degrees.
Source: MAKE_EULER_MAT and VRViewer of OpenCOVER, ScreenConfig and ScreenBase of CalVR.
"""

from __future__ import annotations

from math import cos, radians, sin

import numpy as np

from ..rig import WindowPlace
from .report import Report, quoted

# ours from theirs: x, z, −y
ROOM_FROM_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
MOST_PIXELS = 16384
_STEREO = {
    "": "mono",
    "MONO": "mono",
    "MIDDLE": "mono",
    "NONE": "mono",
    "LEFT": "left",
    "LEFT_EYE": "left",
    "RIGHT": "right",
    "RIGHT_EYE": "right",
    "QUAD_BUFFER": "quad",
    "ANAGLYPHIC": "anaglyph",
    "HORIZONTAL_SPLIT": "side_by_side",
    "VERTICAL_SPLIT": "top_bottom",
    "HORIZONTAL_INTERLACE": "interlaced",
}


def turn(h: float, p: float, r: float) -> np.ndarray:
    """(3, 3) rotation of heading, pitch and roll in degrees, in their axes; exact for right angles."""
    (ch, sh), (cp, sp), (cr, sr) = (_cosine_and_sine(angle) for angle in (h, p, r))
    about_z = np.array([[ch, -sh, 0], [sh, ch, 0], [0, 0, 1.0]])
    about_x = np.array([[1.0, 0, 0], [0, cp, -sp], [0, sp, cp]])
    about_y = np.array([[cr, 0, sr], [0, 1.0, 0], [-sr, 0, cr]])
    return about_z @ about_x @ about_y


def _cosine_and_sine(degrees: float) -> tuple[float, float]:
    quarters = degrees / 90
    if quarters == int(quarters):
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(quarters) % 4]
    return cos(radians(degrees)), sin(radians(degrees))


def screen_corners(
    origin: np.ndarray, width: float, height: float, rotation: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lower left, lower right and upper left of a screen, in our axes."""
    across = rotation @ np.array([width / 2, 0.0, 0.0])
    up = rotation @ np.array([0.0, 0.0, height / 2])
    lower_left, lower_right, upper_left = (
        ROOM_FROM_Z_UP @ (origin + a * across + b * up) for a, b in ((-1, -1), (1, -1), (-1, 1))
    )
    return lower_left, lower_right, upper_left


def stereo_mode(given: str, where: str, report: Report) -> str:
    """Our stereo mode of theirs (osg::DisplaySettings); one that we lack is noted and becomes mono."""
    mode = _STEREO.get(given.strip().upper())
    if mode is None:
        report.note(f"{where}: stereo mode {quoted(given)} is not one of ours; mono")
    return mode or "mono"


def viewport_place(
    window: tuple[int, int, int, int],
    box: tuple[float, float, float, float],
    stereo: str,
    where: str,
    report: Report,
) -> tuple[tuple[int, int], WindowPlace]:
    """Pixels of one eye's picture, and a window of ours that lies where a viewport of theirs does.

    Parameters
    ----------
    window
        Left, top, width and height on the desktop.
    box
        Left, bottom, right and top of the viewport in its window, pixels.
    """
    left, bottom, right, top = (round(value) for value in box)
    width, height = right - left, top - bottom
    for name, value in (("width", width), ("height", height)):
        if not 1 <= value <= MOST_PIXELS:
            raise report.broken(where, f"the viewport's {name} is 1 … {MOST_PIXELS} pixels; given {value}")
    position = (window[0] + left, window[1] + window[3] - top)
    pixels = (width, height)
    if stereo == "side_by_side":
        pixels = (max(width // 2, 1), height)
    elif stereo == "top_bottom":
        pixels = (width, max(height // 2, 1))
    return pixels, WindowPlace(position=position, size=(width, height))


def passed_over(names: list[str], read: set[str]) -> str:
    """The names that are not read, each once, for a note; empty if there are none."""
    return ", ".join(name for name in dict.fromkeys(names) if name not in read)
