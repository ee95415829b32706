"""Marks painted on a finished picture, on the processor."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..arrays import Image, Points
from ..geometry.view import View
from .lettering import lettered
from .shapes import Colour, Label, Marks
from .veil import NEAREST, Veiled, VeiledLabel, VeiledLine, VeiledSheet, veil

if TYPE_CHECKING:
    from ..probe import Probe

_HALO = 0.8  # opacity of the rim around words
_LEAST = 1e-6  # opacity: what rounding alone makes of nothing


def painted(image: Image, view: View, marks: Marks, probe: Probe | None) -> Image:
    """A picture with marks in it, each at its depth.

    Parameters
    ----------
    image
        (h, w, 4) float32, linear, premultiplied: of the view, finished. It is not changed.
    probe
        Of the volume that it shows: `Probe.of(renderer)`. None: marks lie over everything.

    Returns
    -------
    Another such picture, bit for bit the same where there are no marks.

    Accuracy: a mark is exact where the probe is; along lines and on sheets its colour is linear between
    places some 3 to 12 pixels, or a tenth of the sheet, apart.
    """
    image = np.array(image, np.float32)
    paint(image, view, veil(marks, view, probe))
    return image


def paint(image: Image, view: View, veiled: Veiled, squeeze: tuple[int, int] = (1, 1)) -> None:
    """Paint what `veil` made for a view over its picture, in place.

    Parameters
    ----------
    squeeze
        How many pixels across and down a display will make of each: words are so much narrower and lower.
    """
    for sheet in veiled.sheets:
        _paint_sheet(image, view, sheet)
    for line in veiled.lines:
        _paint_line(image, view, line)
    for label in veiled.labels:
        _paint_label(image, view, label, squeeze)


def label_picture(label: Label) -> NDArray[np.float32]:
    """A word with its rim: (h, w, 4) float32, linear, premultiplied; of even size, to be halved."""
    return _word(label.text, label.letter, tuple(label.colour), tuple(label.halo))


@lru_cache(maxsize=64)
def _word(text: str, letter: int, colour: Colour, halo: Colour) -> NDArray[np.float32]:
    ink = lettered(text, letter)
    ink = np.pad(ink, [(1, 1 + n % 2) for n in ink.shape])
    rim = np.max([np.roll(ink, (m, n), (0, 1)) for m in (-1, 0, 1) for n in (-1, 0, 1)], 0)
    rim = (1 - ink) * rim * np.float32(_HALO)
    rgb = ink[..., None] * np.array(colour, np.float32) + rim[..., None] * np.array(halo, np.float32)
    picture = np.concatenate([rgb, (ink + rim)[..., None]], -1).astype(np.float32)
    picture.setflags(write=False)
    return picture


def lay_over(picture: Image, panel: Image, x: int, y: int) -> None:
    """Lay a picture over another, in place, its upper left corner at pixel (x, y); what sticks out is cut.

    Both (h, w, 4) linear, premultiplied.
    """
    part = picture[max(y, 0) :, max(x, 0) :]
    panel = panel[max(-y, 0) :, max(-x, 0) :][: part.shape[0], : part.shape[1]]
    part = part[: panel.shape[0], : panel.shape[1]]
    part *= 1 - panel[..., 3:]
    part += panel


def _lay(pixels: NDArray, tones: NDArray, opacity: NDArray) -> NDArray:
    """Colours (n, 3) over pixels (n, 4), each with its opacity (n,)."""
    over = np.column_stack([tones, np.ones(len(tones))]) * opacity[:, None]
    return (pixels * (1 - opacity[:, None]) + over).astype(np.float32)


def _paint_line(image: Image, view: View, line: VeiledLine) -> None:
    """A band with soft rims, a pixel wide, about half its width from its middle."""
    matrix = view.viewport_from_world
    start, end = (matrix @ (*line.points[n], 1.0) for n in (0, -1))
    a, b = start[:2] / start[2], end[:2] / end[2]
    length = float(np.linalg.norm(b - a))
    if length < 1e-6:
        return
    along = (b - a) / length
    # Column by column, or row by row, whichever the line crosses more of: a few pixels around it in each.
    major = int(abs(along[1]) > abs(along[0]))
    minor, size = 1 - major, image.shape[1::-1]
    low, high = sorted((a[major], b[major]))
    reach = line.width / 2 + 1
    first, last = max(int(np.floor(low - reach)), 0), min(int(np.ceil(high + reach)), size[major])
    if first >= last:
        return
    centres = np.arange(first, last) + 0.5
    middle = a[minor] + (centres - a[major]) * along[minor] / along[major]
    spread = int(np.ceil(reach / abs(along[major]))) + 1
    offsets = np.arange(-spread, spread + 1)
    at = np.empty((len(centres), len(offsets), 2))
    at[..., major] = centres[:, None]
    at[..., minor] = np.floor(middle)[:, None] + offsets + 0.5
    way = at - a
    share = way @ along / length
    off = way @ (-along[1], along[0])
    cover = np.clip(line.width / 2 + 0.5 - np.abs(off), 0, 1) * line.opacity
    inside = (at[..., minor] > 0) & (at[..., minor] < size[minor])
    drawn = (share >= 0) & (share < 1) & (cover > _LEAST) & inside
    column, row = (np.floor(at[drawn][:, n]).astype(int) for n in (0, 1))
    # Places on the line are perspective in pixels: of equal parts of it, farther ones look shorter.
    share = share[drawn] / end[2] / ((1 - share[drawn]) / start[2] + share[drawn] / end[2])
    tones = np.stack([np.interp(share, line.shares, tone) for tone in line.tones.T], -1)
    image[row, column] = _lay(image[row, column], tones, cover[drawn])


def _paint_sheet(image: Image, view: View, shown: VeiledSheet) -> None:
    """Pixels whose centre lies on it."""
    matrix, sheet = view.viewport_from_world, shown.sheet
    pixel_from_sheet = np.column_stack(
        [matrix[:, :3] @ sheet.edges[0], matrix[:, :3] @ sheet.edges[1], matrix @ (*sheet.corner, 1.0)]
    )
    if abs(np.linalg.det(pixel_from_sheet)) <= 1e-12 * np.prod(np.linalg.norm(pixel_from_sheet, axis=0)):
        return  # seen edge-on
    low, high = _extent(pixel_from_sheet @ _UNIT_SQUARE, image.shape[1::-1])
    if (low >= high).any():
        return
    columns, rows = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
    columns, rows = columns.ravel(), rows.ravel()
    pixels = np.stack([columns + 0.5, rows + 0.5, np.ones(len(rows))])
    u, v, inverse_w = np.linalg.inv(pixel_from_sheet) @ pixels
    with np.errstate(divide="ignore", invalid="ignore"):
        u, v, w = u / inverse_w, v / inverse_w, 1 / inverse_w
    drawn = (u >= 0) & (u < 1) & (v >= 0) & (v < 1) & (w > NEAREST)
    columns, rows = columns[drawn], rows[drawn]
    tones = _on_triangles(shown.tones, u[drawn], v[drawn])
    image[rows, columns] = _lay(image[rows, columns], tones, np.full(len(rows), sheet.opacity))


_UNIT_SQUARE = np.array([[0, 1, 1, 0], [0, 0, 1, 1], [1, 1, 1, 1.0]])


def _extent(corners: Points, size: tuple[int, int]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First and last pixels, within the picture, of homogeneous corners (3, n); of all if some are behind."""
    if (corners[2] <= NEAREST).any():
        return np.zeros(2, int), np.array(size)
    places = corners[:2] / corners[2]
    low, high = np.floor(places.min(1)), np.ceil(places.max(1))
    return np.clip(low, 0, size).astype(int), np.clip(high, 0, size).astype(int)


def _on_triangles(tones: Points, u: NDArray, v: NDArray) -> Points:
    """Tones (n, n, 3) at places of the unit square, linear on both halves of each cell."""
    cells = len(tones) - 1
    i, j = (np.minimum((t * cells).astype(int), cells - 1) for t in (u, v))
    x, y = (u * cells - i)[:, None], (v * cells - j)[:, None]
    origin, across = tones[j, i], tones[j + 1, i + 1]
    lower = origin + x * (tones[j, i + 1] - origin) + y * (across - tones[j, i + 1])
    upper = origin + y * (tones[j + 1, i] - origin) + x * (across - tones[j + 1, i])
    return np.where(x >= y, lower, upper)


def _paint_label(image: Image, view: View, shown: VeiledLabel, squeeze: tuple[int, int]) -> None:
    label, (across, down) = shown.label, squeeze
    picture = veiled_picture(label_picture(label), shown.veil)
    height, width = (n // by for n, by in zip(picture.shape[:2], (down, across), strict=True))
    picture = picture[: height * down, : width * across].reshape(height, down, width, across, 4).mean((1, 3))
    homogeneous = view.viewport_from_world @ (*label.point, 1.0)
    place = homogeneous[:2] / homogeneous[2] + np.array(label.shift) / squeeze
    x, y = np.rint(place - np.array(picture.shape[1::-1]) / 2).astype(int)
    lay_over(image, picture, int(x), int(y))


def veiled_picture(picture: NDArray[np.float32], veil: Points) -> NDArray[np.float32]:
    """A premultiplied picture seen through what `VeiledLabel.veil` tells."""
    rgb = picture[..., :3] * veil[3] + picture[..., 3:] * veil[:3]
    return np.concatenate([rgb, picture[..., 3:]], -1).astype(np.float32)
