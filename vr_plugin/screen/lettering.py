"""Text as pictures: light monospaced letters on a dark translucent panel."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

# Monospaced fonts of the usual systems, the best known first; without any, Pillow's own in fixed columns.
FONTS = (
    "DejaVuSansMono.ttf",
    "LiberationMono-Regular.ttf",
    "NotoSansMono-Regular.ttf",
    "Menlo.ttc",
    "consola.ttf",
)
INK = (0.9, 0.93, 0.9)
PANEL = (0.0, 0.0, 0.0, 0.85)  # of light: a bright picture behind it still shows as a dark grey


def lettered(text: str, letter: int = 16) -> NDArray[np.float32]:
    """How much of each pixel the letters of a text cover, (h, w) float32, 0 … 1; half a letter of margin."""
    font = _font(letter)
    column, row = font.getlength("M"), round(1.3 * letter)
    lines = text.expandtabs(4).splitlines() or [""]
    margin = max(round(0.5 * letter), 1)
    width = int(np.ceil(column * max(map(len, lines)))) + 2 * margin
    mask = Image.new("L", (width, row * len(lines) + 2 * margin))
    draw = ImageDraw.Draw(mask)
    even = abs(font.getlength("i") - column) < 1e-6
    for number, line in enumerate(lines):
        baseline = margin + number * row + round(0.95 * letter)
        if even:
            draw.text((margin, baseline), line, fill=255, font=font, anchor="ls")
        else:
            for place, character in enumerate(line):
                middle = margin + (place + 0.5) * column
                draw.text((middle, baseline), character, fill=255, font=font, anchor="ms")
    return np.asarray(mask, np.float32) / 255


def text_panel(text: str, letter: int = 16) -> NDArray[np.float32]:
    """A picture of a text.

    Parameters
    ----------
    text
        Any number of lines.
    letter
        Height of the letters in pixels.

    Returns
    -------
    (h, w, 4) float32, linear, premultiplied.
    """
    coverage = lettered(text, letter)[..., None]
    panel = np.array([*(c * PANEL[3] for c in PANEL[:3]), PANEL[3]], np.float32)
    return coverage * np.array([*INK, 1], np.float32) + (1 - coverage) * panel


def squeezed(panel: NDArray[np.float32], across: int, down: int) -> NDArray[np.float32]:
    """A picture whose pixels are means of so many, for an eye's picture that the display stretches again."""
    height, width = (n // by * by for n, by in zip(panel.shape[:2], (down, across), strict=True))
    blocks = panel[:height, :width].reshape(height // down, down, width // across, across, 4)
    return blocks.mean((1, 3), dtype=np.float32)


def lay_over(picture: NDArray[np.float32], panel: NDArray[np.float32], x: int, y: int) -> None:
    """Lay a picture over another, in place, its upper left corner at pixel (x, y); what sticks out is cut.

    Both (h, w, 4) linear, premultiplied.
    """
    part = picture[max(y, 0) :, max(x, 0) :]
    panel = panel[max(-y, 0) :, max(-x, 0) :][: part.shape[0], : part.shape[1]]
    part = part[: panel.shape[0], : panel.shape[1]]
    part *= 1 - panel[..., 3:]
    part += panel


@lru_cache(maxsize=8)
def _font(letter: int) -> Any:
    for name in FONTS:
        try:
            return ImageFont.truetype(name, letter)
        except OSError:
            continue
    return ImageFont.load_default(letter)
