"""A picture that is drawn again and again."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Image


class Canvas:
    """A picture's memory, and which of it holds something: only that is cleared for the next picture.

    Clearing is most of a software warp's time where the volume covers little of the wall: for the eight 1024²
    pictures of a stereo CAVE frame 134 MB.

    Attributes
    ----------
    pixels
        (height, width, 4) float32, linear, premultiplied, row 0 on top. To be written by the warp only.
    written
        (height, 2) int64: the columns [begin, end) of each row that may not be 0.
    """

    pixels: Image
    written: NDArray[np.int64]

    def __init__(self, width: int, height: int):
        self.pixels = np.zeros((height, width, 4), np.float32)
        self.written = np.zeros((height, 2), np.int64)

    @classmethod
    def over(cls, pixels: Image) -> Canvas:
        """A canvas of memory that may hold anything."""
        canvas = cls.__new__(cls)
        canvas.pixels = pixels
        canvas.written = np.tile(np.array([0, pixels.shape[1]]), (pixels.shape[0], 1))
        return canvas
