"""Stereo modes: which eyes a window needs, how large their pictures are, and how they share its pixels.

Plain numpy: this is what the OpenGL pass of `present` is tested against, and it serves pictures on disk.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from persp_sw.errors import PerspSWError

# What a window or wall can show, and how it is called before people.
MODES = {
    "mono": "mono",
    "left": "left eye",
    "right": "right eye",
    "quad": "quad-buffered",
    "side_by_side": "side by side",
    "top_bottom": "top–bottom",
    "interlaced": "row-interleaved",
    "anaglyph": "red–cyan anaglyph",
    "two_windows": "two windows",
}

# Red–cyan glasses before an LCD: linear light of the screen from linear light of the left and the right eye's
# picture; a negative result is shown as black. White and greys stay so, to the third decimal.
# Source: E. Dubois, *Conversion of a stereo pair to anaglyph with the least-squares projection method*, 2009;
# the method: *A projection method to generate anaglyph stereo images*, ICASSP 2001. It minimises differences
# in CIE XYZ, which is linear in light: programs that apply the matrices to sRGB values do something else.
DUBOIS_LEFT = np.array([[0.437, 0.449, 0.164], [-0.062, -0.062, -0.024], [-0.048, -0.050, -0.017]])
DUBOIS_RIGHT = np.array([[-0.011, -0.032, -0.007], [0.377, 0.761, 0.009], [-0.026, -0.093, 1.234]])


class StereoError(PerspSWError):
    """A stereo mode that there is not, or pictures that do not fit one."""


class Rectangle(NamedTuple):
    """Part of a window, in pixels from its upper left corner."""

    x: int
    y: int
    width: int
    height: int


def eyes_of(mode: str) -> tuple[str, ...]:
    """Names of the eyes whose pictures a mode shows: "middle", "left", "right"."""
    _check(mode)
    return {"mono": ("middle",), "left": ("left",), "right": ("right",)}.get(mode, ("left", "right"))


def modes_of_windows(mode: str) -> tuple[str, ...]:
    """The mode of each window that a mode opens: two of them for two windows, which show one eye each."""
    _check(mode)
    return ("left", "right") if mode == "two_windows" else (mode,)


def without_quad_buffers(mode: str) -> str:
    """What is shown instead where the screen has no quad buffers: of these, mono; others need none."""
    _check(mode)
    return "mono" if mode == "quad" else mode


def rectangles(mode: str, size: Sequence[int]) -> tuple[Rectangle | None, Rectangle | None]:
    """Where a window of (width, height) pixels shows the left and the right eye's picture; None: nowhere.

    Side by side and top–bottom halve a picture's pixels along one edge, as displays for them expect, which
    stretch it again; the odd pixel of an odd edge is left to the background, in the middle.
    """
    _check(mode)
    width, height = size
    whole = Rectangle(0, 0, width, height)
    if mode == "side_by_side":
        half = max(width // 2, 1)
        return Rectangle(0, 0, half, height), Rectangle(width - half, 0, half, height)
    if mode == "top_bottom":
        half = max(height // 2, 1)
        return Rectangle(0, 0, width, half), Rectangle(0, height - half, width, half)
    if mode in ("mono", "left"):
        return whole, None
    return (None, whole) if mode == "right" else (whole, whole)


def eye_size(mode: str, size: Sequence[int]) -> tuple[int, int]:
    """Width and height in pixels of each eye's picture, of a window of (width, height) pixels."""
    place = next(rectangle for rectangle in rectangles(mode, size) if rectangle)
    return place.width, place.height


def in_eyes_picture(mode: str, size: Sequence[int], place: tuple[float, float]) -> tuple[float, float]:
    """Where a place of a window (width, height) lies in the picture shown there, of the window's size.

    Side by side and top–bottom show two, which the display stretches over all of itself.
    """
    across, down = (n / part for n, part in zip(size, eye_size(mode, size), strict=True))
    x, y = place
    return x * across % size[0] if across > 1 else x, y * down % size[1] if down > 1 else y


def window_size(mode: str, eye_pixels: Sequence[int]) -> tuple[int, int]:
    """The smallest window that shows eyes' pictures of (width, height) pixels as they are."""
    _check(mode)
    width, height = eye_pixels
    return width * (1 + (mode == "side_by_side")), height * (1 + (mode == "top_bottom"))


def shows_left(row: ArrayLike, first_row: int = 0) -> NDArray[np.bool_]:
    """Whether a row-interleaved display shows the left eye in this row of a window.

    Parameters
    ----------
    row
        Rows of the window, counted from its top.
    first_row
        The screen's row, counted from its top, that the window's top row lies on. The display's filters stay
        with the screen: its even rows are the left eye's, wherever the window moves.
    """
    return (np.asarray(row) + first_row) % 2 == 0


def combine(
    left: ArrayLike,
    right: ArrayLike,
    mode: str,
    size: Sequence[int] | None = None,
    *,
    background: ArrayLike = (0, 0, 0),
    first_row: int = 0,
) -> NDArray[np.float32]:
    """What a window shows of the two eyes' pictures.

    Parameters
    ----------
    left, right
        (h, w, 4) linear, premultiplied, of `eye_size` pixels. Mono and left show the left one alone.
    mode
        One of `MODES` that has one picture: not quad or two_windows, where each eye has its own.
    size
        Width and height of the window; None: the smallest whose eyes' pictures are that large.
    background
        (3,) linear, behind both.
    first_row
        See `shows_left`; for interlaced.

    Returns
    -------
    (height, width, 4) float32, linear, opaque. Anaglyph clips what the screen cannot show to 0 … 1.

    Raises
    ------
    StereoError
        Another mode, or pictures of another size.
    """
    left, right = _checked(left), _checked(right)
    if mode in ("quad", "two_windows"):
        raise StereoError(f"{MODES[mode]} has a picture for each eye: there is nothing to combine")
    if size is None:
        size = window_size(mode, left.shape[1::-1])
    needed = eye_size(mode, size)
    places = rectangles(mode, size)
    for name, picture, place in (("left", left, places[0]), ("right", right, places[1])):
        if place and picture.shape[1::-1] != needed:
            raise StereoError(
                f"{MODES[mode]} in a window of {size[0]} × {size[1]} pixels needs eye pictures of "
                f"{needed[0]} × {needed[1]}; given a {name} one of {picture.shape[1]} × {picture.shape[0]}"
            )
    background = np.asarray(background, np.float64)
    left, right = (picture[..., :3] + (1 - picture[..., 3:]) * background for picture in (left, right))
    window = np.ones((size[1], size[0], 4), np.float32)
    rgb = window[..., :3]
    if mode == "interlaced":
        rgb[:] = np.where(shows_left(np.arange(size[1]), first_row)[:, None, None], left, right)
    elif mode == "anaglyph":
        rgb[:] = np.clip(left @ DUBOIS_LEFT.T + right @ DUBOIS_RIGHT.T, 0, 1)
    else:
        rgb[:] = background
        for picture, place in zip((left, right), places, strict=True):
            if place:
                x, y, width, height = place
                rgb[y : y + height, x : x + width] = picture
    return window


@dataclass(frozen=True)
class Stereo:
    """How a window shows the eyes at this moment; keys change it while the program runs.

    Attributes
    ----------
    mode
        As the rig or the user chose.
    swapped
        Left and right change places: for glasses or a screen that have them the other way round.
    flat
        Mono for now, whatever the mode.
    """

    mode: str = "mono"
    swapped: bool = False
    flat: bool = False

    def __post_init__(self):
        _check(self.mode)

    @property
    def shown_mode(self) -> str:
        """What is shown: the mode whose eyes are to be composited."""
        if self.flat:
            return "mono"
        return {"left": "right", "right": "left"}.get(self.mode, self.mode) if self.swapped else self.mode

    @property
    def channels(self) -> tuple[str, str]:
        """Names of the eyes whose pictures take the places of left and right."""
        names = eyes_of(self.shown_mode)
        if len(names) == 1:
            return names * 2
        return names[::-1] if self.swapped else names

    def swap(self) -> Stereo:
        """With the eyes exchanged."""
        return replace(self, swapped=not self.swapped)

    def flatten(self) -> Stereo:
        """Mono, or back to stereo."""
        return replace(self, flat=not self.flat)

    def next_mode(self, modes: Sequence[str] = tuple(MODES)) -> Stereo:
        """The mode that follows in `modes`, in stereo."""
        place = modes.index(self.mode) + 1 if self.mode in modes else 0
        return replace(self, mode=modes[place % len(modes)], flat=False)


def _check(mode: str) -> None:
    if mode not in MODES:
        raise StereoError(f"there is no stereo mode {mode!r}; choose one of {', '.join(MODES)}")


def _checked(picture: ArrayLike) -> NDArray[np.float64]:
    picture = np.asarray(picture, np.float64)
    if picture.ndim != 3 or picture.shape[2] != 4:
        raise StereoError(f"an eye's picture is (height, width, 4); given an array of shape {picture.shape}")
    return picture
