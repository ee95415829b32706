"""Text as pictures: light monospaced letters on a dark translucent panel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import persp_sw as psw

lay_over, lettered = psw.marks.lay_over, psw.marks.lettered

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
    coverage = lettered(text, letter)[..., None]
    panel = np.array([*(c * PANEL[3] for c in PANEL[:3]), PANEL[3]], np.float32)
    return coverage * np.array([*INK, 1], np.float32) + (1 - coverage) * panel


def squeezed(panel: NDArray[np.float32], across: int, down: int) -> NDArray[np.float32]:
    """A picture whose pixels are means of so many, for an eye's picture that the display stretches again."""
    height, width = (n // by * by for n, by in zip(panel.shape[:2], (down, across), strict=True))
    blocks = panel[:height, :width].reshape(height // down, down, width // across, across, 4)
    return blocks.mean((1, 3), dtype=np.float32)
