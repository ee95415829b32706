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
        self._spare: Canvas | None = None

    @classmethod
    def over(cls, pixels: Image) -> Canvas:
        """A canvas of memory that may hold anything."""
        canvas = cls.__new__(cls)
        canvas.pixels = pixels
        canvas.written = np.tile(np.array([0, pixels.shape[1]]), (pixels.shape[0], 1))
        canvas._spare = None
        return canvas

    @property
    def spare(self) -> Canvas:
        """Another canvas of this size, made when first wanted: for a part of this one's picture."""
        if self._spare is None:
            self._spare = Canvas(self.pixels.shape[1], self.pixels.shape[0])
        return self._spare

    def lay_over(self, top: Canvas) -> None:
        """Lay another picture over this one (OVER), where it holds something."""
        rows = np.flatnonzero(top.written[:, 0] < top.written[:, 1])
        if not len(rows):
            return
        written = top.written[rows]
        columns = slice(written[:, 0].min(), written[:, 1].max())
        block = slice(rows[0], rows[-1] + 1), columns
        below, above = self.pixels[block], top.pixels[block]
        below *= 1 - above[..., 3:]
        below += above
        empty = self.written[rows, 0] >= self.written[rows, 1]
        mine = self.written[rows]
        merged = np.stack([np.minimum(mine[:, 0], written[:, 0]), np.maximum(mine[:, 1], written[:, 1])], 1)
        self.written[rows] = np.where(empty[:, None], written, merged)
