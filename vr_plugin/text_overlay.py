"""Text over a picture: light monospaced letters on a dark translucent panel."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from .gl_objects import Texture
from .shapes import Shapes, clip_from_pixels

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
    coverage = np.asarray(mask, np.float32)[..., None] / 255
    panel = np.array([*(c * PANEL[3] for c in PANEL[:3]), PANEL[3]], np.float32)
    return coverage * np.array([*INK, 1], np.float32) + (1 - coverage) * panel


class Overlay:
    """One panel of text; made anew only when the text changes. Belongs to the context of its shapes."""

    def __init__(self, shapes: Shapes, letter: int = 16):
        self.letter = letter
        self.redrawn = 0
        self._shapes = shapes
        self._texture: Texture | None = None
        self._shown: tuple[str, int] | None = None

    def draw(self, text: str, size: Sequence[int], corner: str = "upper left") -> None:
        """Draw the text into the bound framebuffer; nothing for an empty one.

        Parameters
        ----------
        size
            Width and height in pixels of the window that is shown in the end: an eye's picture of half its
            width gets letters of half theirs, which the display stretches again.
        corner
            "upper" or "lower", "left" or "right".
        """
        if not text:
            return
        if (text, self.letter) != self._shown:
            panel = text_panel(text, self.letter)
            if self._texture is None or self._texture.size != panel.shape[1::-1]:
                self.close()
                self._texture = Texture(panel.shape[1::-1])
            self._texture.upload(panel)
            self._shown = text, self.letter
            self.redrawn += 1
        width, height = self._texture.size
        margin = self.letter // 2
        left = size[0] - width - margin if "right" in corner else margin
        top = size[1] - height - margin if "lower" in corner else margin
        corners = [
            (left, top + height, 0),
            (left + width, top + height, 0),
            (left + width, top, 0),
            (left, top, 0),
        ]
        self._shapes.picture(clip_from_pixels(size), corners, self._texture.name, hidden=False)

    def close(self) -> None:
        """Delete its texture."""
        if self._texture:
            self._texture.close()
        self._texture = self._shown = None


@lru_cache(maxsize=8)
def _font(letter: int) -> Any:
    for name in FONTS:
        try:
            return ImageFont.truetype(name, letter)
        except OSError:
            continue
    return ImageFont.load_default(letter)
