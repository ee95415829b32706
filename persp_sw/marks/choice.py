"""Which marks a picture shows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Image, Vector
from ..geometry.view import View
from ..optics.transfer import TransferFunction
from ..probe import Probe
from ..volume.grid import Volume
from .geometry import (
    axes,
    bounding_box,
    cursor,
    orientation_letters,
    ruler,
    scale_bar,
    unit_of,
)
from .legend import Legend, legend
from .paint import lay_over, painted
from .shapes import Marks, Palette

if TYPE_CHECKING:
    from ..renderer import Renderer

_LEGEND = 0.42  # of the picture's height
_LETTERS = (9, 13)  # heights of a legend's


@dataclass(frozen=True)
class MarkChoice:
    """Which marks are shown.

    Attributes
    ----------
    box, axes, scale_bar, legend
        Whether. Axes come with a patient's letters. The legend, see `legend`, is no mark in the world; there
        is none of two-dimensional functions.
    cursor
        World xyz of the 3D cursor; None: there is none.
    planes
        Whether it has planes.
    ruler
        Both ends of a measured distance, world xyz; None: there is none.
    """

    box: bool = False
    axes: bool = False
    scale_bar: bool = False
    legend: bool = False
    cursor: tuple[float, float, float] | None = None
    planes: bool = False
    ruler: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None

    def __bool__(self) -> bool:
        return bool(self.box or self.axes or self.scale_bar or self.legend or self.cursor or self.ruler)

    def in_world(self, volume: Volume, palette: Palette | None = None) -> Marks:
        """What stands in the world, whoever looks at it."""
        palette = palette or Palette.over()
        marks = Marks()
        if self.box:
            marks += bounding_box(volume, palette)
        if self.axes:
            marks += axes(volume, palette) + orientation_letters(volume, palette)
        if self.cursor is not None:
            marks += cursor(volume, self.cursor, self.planes, palette)
        if self.ruler is not None:
            marks += ruler(*self.ruler, unit_of(volume), palette)
        return marks

    def of_view(
        self, volume: Volume, view: View, pivot: Vector | None = None, palette: Palette | None = None
    ) -> Marks:
        """All but the legend, as a view shows them; the scale bar as deep as `pivot` or the wall's middle."""
        palette = palette or Palette.over()
        marks = self.in_world(volume, palette)
        if self.scale_bar:
            wall = view.wall
            middle = (np.asarray(wall.lower_right) + wall.upper_left) / 2
            marks += scale_bar(view, middle if pivot is None else pivot, unit_of(volume), palette)
        return marks


def legend_for(
    size: tuple[int, int], transfer: TransferFunction, volume: Volume, palette: Palette
) -> tuple[Legend, tuple[int, int]]:
    """The legend of a picture of (width, height) pixels, and where its upper left corner belongs in it."""
    width, height = size
    letter = int(np.clip(height // 40, *_LETTERS))
    made = legend(transfer, volume.value_range, max(round(_LEGEND * height), 16), letter, palette)
    return made, (width - made.picture.shape[1] - letter, height - made.picture.shape[0] - letter)


def with_marks(
    image: Image,
    renderer: Renderer,
    view: View,
    choice: MarkChoice,
    *,
    background: Vector = (0.0, 0.0, 0.0),
    pivot: Vector | None = None,
) -> Image:
    """A renderer's picture of a view with the marks of a choice in it.

    Parameters
    ----------
    image
        What `renderer.render(view)` gave; it is not changed.
    background
        (3,) linear, that it will lie over: marks are light over a dark one, dark over a light one.
    pivot
        World: as deep as the scale bar; None: the middle of the view's wall.
    """
    palette, volume = Palette.over(background), renderer.volume
    marks = choice.of_view(volume, view, pivot, palette)
    image = painted(image, view, marks, Probe.of(renderer))
    if choice.legend and isinstance(renderer.transfer, TransferFunction):
        made, (x, y) = legend_for(view.size, renderer.transfer, volume, palette)
        lay_over(image, made.picture, x, y)
    return image
