"""Which marks a picture shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Vector
from ..geometry.view import View
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
from .shapes import Marks, Palette


@dataclass(frozen=True)
class MarkChoice:
    """Which marks are shown.

    Attributes
    ----------
    box, axes, scale_bar, legend
        Whether. Axes come with a patient's letters; the legend is no mark in the world, see `legend`.
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
