"""Letters as pictures: how much of each pixel they cover."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Monospaced fonts of the usual systems, the best known first; without any, Pillow's own in fixed columns.
FONTS = (
    "DejaVuSansMono.ttf",
    "LiberationMono-Regular.ttf",
    "NotoSansMono-Regular.ttf",
    "Menlo.ttc",
    "consola.ttf",
)


def lettered(text: str, letter: int = 16) -> NDArray[np.float32]:
    """How much of each pixel the letters of a text cover, (h, w) float32, 0 … 1; half a letter of margin."""
    from PIL import Image, ImageDraw  # takes 40 ms, which `import persp_sw.marks` need not

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


@lru_cache(maxsize=8)
def _font(letter: int) -> Any:
    from PIL import ImageFont

    for name in FONTS:
        try:
            return ImageFont.truetype(name, letter)
        except OSError:
            continue
    return ImageFont.load_default(letter)
