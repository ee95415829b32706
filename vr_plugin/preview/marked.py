"""Marks in the preview's pictures, whoever draws them: what each eye sees of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import persp_sw as psw

from ..frame import Picture
from ..marks.shown import ShownMarks
from ..screen.lettering import lay_over, squeezed
from .wanted import Wanted


class PictureMarks(ShownMarks):
    """What the preview's pictures show of marks."""

    def __init__(self, renderer: psw.Renderer, palette: psw.marks.Palette):
        super().__init__(renderer, palette)
        self._legend: tuple[object, ...] | None = None

    def veiled(self, wanted: Wanted, picture: Picture) -> psw.marks.Veiled | None:
        """The marks in an eye's picture; None if there are none.

        A scale bar is for the window alone: it is as deep as the camera's pivot, for all eyes in one place.
        """
        bar, camera = None, wanted.camera
        if wanted.marks.scale_bar and not wanted.outside:
            view = psw.View.through_wall(camera.position, camera.wall(wanted.size))
            unit = psw.marks.unit_of(self.renderer.volume)
            bar = psw.marks.scale_bar(view, camera.pivot, unit, self.palette)
        return self.seen(wanted.marks, picture.view, bar)

    def legend(self, wanted: Wanted) -> tuple[psw.marks.Legend, tuple[int, int]] | None:
        """The legend and its place in the window, the same object while it is the same; None without."""
        one_dimensional = isinstance(self.renderer.transfer, psw.TransferFunction)
        if not wanted.marks.legend or wanted.outside or not one_dimensional:
            return None
        key = self.renderer.transfer, wanted.size
        if self._legend is None or self._legend[0] != key:
            made = psw.marks.legend_for(wanted.size, key[0], self.renderer.volume, self.palette)
            self._legend = key, made
        return self._legend[1]

    def painted(self, image: NDArray[np.float32], wanted: Wanted, picture: Picture) -> NDArray[np.float32]:
        """An eye's picture with its marks, in a copy of it, for its canvas knows what was drawn there.

        The picture itself where there are no marks.
        """
        veiled = self.veiled(wanted, picture)
        if veiled is None:
            return image
        image = image.copy()
        size = picture.view.size if wanted.outside else wanted.size
        across, down = (max(n // part, 1) for n, part in zip(size, picture.view.size, strict=True))
        psw.marks.paint(image, picture.view, veiled, (across, down))
        if (made := self.legend(wanted)) is not None:
            legend, (x, y) = made
            lay_over(image, squeezed(legend.picture, across, down), x // across, y // down)
        return image
