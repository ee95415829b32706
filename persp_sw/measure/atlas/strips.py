"""Pictures of the atlas: ours, the reference and their difference, side by side."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ... import images
from .case import Strip

_LEAST_HEIGHT = 192  # pixels; smaller pictures are shown with whole multiples of their pixels
_MOST_WIDTH = 1600
_GAP, _CAPTION = 8, 22
_PAPER, _INK = (24, 24, 24), (225, 225, 225)
_BEHIND = (0.02, 0.02, 0.02)  # linear; so that what is black and opaque shows
_NOT_A_NUMBER = (1.0, 0.0, 1.0, 1.0)  # no picture of ours is magenta

Panel = tuple[str, NDArray[np.uint8]]


def write_strip(strip: Strip, path: Path) -> Path:
    """Write a strip as PNG; FileError where the disk refuses."""
    return images.write_rgb(path, strip_rgb(strip))


def strip_rgb(strip: Strip) -> NDArray[np.uint8]:
    """(h, w, 3) sRGB: ours | reference | difference with its scale, each with a caption; then that of 2001.

    Pixels that are no numbers are magenta. In the difference, what is 1 / gain or more is brightest.
    """
    height, width = strip.ours.shape[:2]
    columns = 3 if strip.single_axis is None else 5
    factor = max(1, min(-(-_LEAST_HEIGHT // height), _MOST_WIDTH // (columns * width)))

    def large(image: ArrayLike) -> NDArray[np.float64]:
        return np.asarray(image, np.float64).repeat(factor, 0).repeat(factor, 1)

    def difference(one: ArrayLike, other: ArrayLike, caption: str) -> Panel:
        return f"{caption} times {strip.gain:g}", images.error_map(large(one), large(other), 1 / strip.gain)[
            0
        ]

    panels = [("ours", _shown(large(strip.ours)))]
    if strip.reference is not None:
        panels.append(("reference", _shown(large(strip.reference))))
    if strip.error is not None:
        panels.append(difference(strip.error, np.zeros_like(strip.error), "difference"))
    elif strip.reference is not None:
        panels.append(difference(strip.ours, strip.reference, "difference"))
    if strip.single_axis is not None:
        panels.append(("single axis, 2001", _shown(large(strip.single_axis))))
        if strip.reference is not None:
            panels.append(difference(strip.single_axis, strip.reference, "its difference"))
    return _side_by_side(panels)


def _shown(image: NDArray[np.float64]) -> NDArray[np.uint8]:
    finite = np.isfinite(image).all(-1, keepdims=True)
    return images.presented(np.where(finite, image, _NOT_A_NUMBER), _BEHIND)


def _side_by_side(panels: list[Panel]) -> NDArray[np.uint8]:
    from PIL import Image, ImageDraw

    height = _CAPTION + max(panel.shape[0] for _, panel in panels) + _GAP
    width = _GAP + sum(panel.shape[1] + _GAP for _, panel in panels)
    sheet = Image.new("RGB", (width, height), _PAPER)
    draw = ImageDraw.Draw(sheet)
    left = _GAP
    for caption, panel in panels:
        draw.text((left, _CAPTION - 6), caption, fill=_INK, font=_font(), anchor="ls")
        sheet.paste(Image.fromarray(panel), (left, _CAPTION))
        left += panel.shape[1] + _GAP
    return np.asarray(sheet)


@cache
def _font():
    from PIL import ImageFont

    return ImageFont.load_default(13)
