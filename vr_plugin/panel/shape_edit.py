"""A two-dimensional transfer function under the user's hand: what is held, and what a drag does to it.

No widgets and no pixels: places are (value, gradient magnitude), as the shapes have them.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

import persp_sw as psw

from .function_edit import FunctionEdit

_LEAST = 1e-6  # of the limits: the least size of a shape


class Grip(NamedTuple):
    """A place where a shape can be taken, and what is moved there: "middle", or a side of `Grips`."""

    part: str
    value: float
    magnitude: float


def grips_of(shape: psw.Box | psw.Triangle) -> list[Grip]:
    """Where a shape can be taken: its sides' middles, a triangle's apex and upper corner, and its middle."""
    (low, high), middle = shape.magnitudes, sum(shape.magnitudes) / 2
    if isinstance(shape, psw.Box):
        left, right = shape.values
        centre = (left + right) / 2
        sides = [Grip("left", left, middle), Grip("right", right, middle)]
    else:
        centre = shape.value
        sides = [Grip("width", shape.value + shape.width, high)]
    return [Grip("low", centre, low), Grip("high", centre, high), *sides, Grip("middle", centre, middle)]


def reshaped(
    shape: psw.Box | psw.Triangle, part: str, by: tuple[float, float], limits: tuple[float, float, float]
) -> psw.Box | psw.Triangle:
    """A shape of which a part was moved by so many values and magnitudes.

    Sides stay on their side, nothing goes below magnitude 0, and what is moved as a whole keeps its size.

    Parameters
    ----------
    limits
        Lowest and highest value, highest magnitude: a shape's middle stays within, and sizes are at least a
        millionth of them.
    """
    first, last, top = limits
    (low, high), (across, up) = shape.magnitudes, by
    thin, flat = _LEAST * (last - first), _LEAST * top
    if part == "middle":
        up = float(np.clip(up, -low, max(top - low, 0.0)))
        magnitudes = low + up, high + up
        if isinstance(shape, psw.Triangle):
            return replace(
                shape, value=float(np.clip(shape.value + across, first, last)), magnitudes=magnitudes
            )
        left, right = shape.values
        centre = (left + right) / 2
        across = float(np.clip(centre + across, first, last)) - centre
        return replace(shape, values=(left + across, right + across), magnitudes=magnitudes)
    if part == "low":
        return replace(shape, magnitudes=(float(np.clip(low + up, 0.0, max(high - flat, 0.0))), high))
    if part == "high":
        return replace(shape, magnitudes=(low, max(high + up, low + flat)))
    if part == "width":
        return replace(shape, width=max(shape.width + across, thin))
    left, right = shape.values
    if part == "left":
        return replace(shape, values=(min(left + across, right - thin), right))
    return replace(shape, values=(left, max(right + across, left + thin)))


def shape_like(
    shape: psw.Box | psw.Triangle,
    limits: tuple[float, float, float],
    kind: type[psw.Box] | type[psw.Triangle],
) -> psw.Box | psw.Triangle:
    """A new shape as large as another, a little beside it, in its colours: what `ShapeEdit.add` is given."""
    left, right = shape.values
    by = 0.05 * (limits[1] - limits[0]), 0.0
    rest = shape.magnitudes, shape.colour, shape.opacity, shape.soft
    if kind is psw.Box:
        return reshaped(psw.Box((left, right), *rest), "middle", by, limits)
    value, width = (left + right) / 2, (right - left) / 2
    return reshaped(psw.Triangle(value, rest[0], width, *rest[1:]), "middle", by, limits)


class ShapeEdit(FunctionEdit[psw.TransferFunction2D]):
    """An editor's state.

    Parameters
    ----------
    transfer
        To start with.
    limits
        Lowest and highest value, and the highest gradient magnitude, of the volume.

    Attributes
    ----------
    selected
        Number of the shape that colour, opacity and keys are about; None for none.
    """

    def __init__(self, transfer: psw.TransferFunction2D, limits: tuple[float, float, float]):
        super().__init__(transfer)
        self.limits = limits
        self._held: tuple[str, tuple[float, float], psw.Box | psw.Triangle] | None

    def grip_at(self, value: float, magnitude: float, reach: tuple[float, float]) -> tuple[int, str] | None:
        """Shape and part nearest to a place, within `reach` (values, magnitudes: radii of an ellipse)."""
        nearest, least = None, 1.0
        for number, shape in enumerate(self.transfer.shapes):
            for grip in grips_of(shape):
                away = np.hypot((grip.value - value) / reach[0], (grip.magnitude - magnitude) / reach[1])
                if away <= least:
                    nearest, least = (number, grip.part), float(away)
        return nearest

    def press(self, value: float, magnitude: float, reach: tuple[float, float]) -> bool:
        """The hand takes what is at a place, and selects it; whether there is anything."""
        found = self.grip_at(value, magnitude, reach)
        self._held, self.selected = None, None
        if found is not None:
            self.selected, part = found
            self._held = part, (value, magnitude), self.transfer.shapes[self.selected]
            self._gestures += 1
        return found is not None

    def drag(self, value: float, magnitude: float) -> None:
        """The hand is there now; at the place where it took the shape no bit of it changes."""
        if self._held is None or self.selected is None:
            return
        part, (from_value, from_magnitude), shape = self._held
        by = value - from_value, magnitude - from_magnitude
        self.set_shape(self.selected, reshaped(shape, part, by, self.limits), ("drag", self._gestures))

    def release(self) -> None:
        """The hand lets go."""
        self._held = None
        self._gestures += 1
        self._history.end_gesture()

    def set_shape(self, number: int, shape: psw.Box | psw.Triangle, gesture: Hashable = None) -> None:
        """Another shape in the place of one; the same one is no edit."""
        shapes = list(self.transfer.shapes)
        if shapes[number] != shape:
            shapes[number] = shape
            self._do(shapes, gesture)

    def recolour(self, number: int, colour: tuple[float, float, float]) -> None:
        """Linear; the colours that a shape gets until `release` are one step."""
        shape = replace(self.transfer.shapes[number], colour=colour)
        self.set_shape(number, shape, ("colour", number, self._gestures))

    def weigh(self, number: int, opacity: float, soft: float) -> None:
        """Opacity and softness of a shape; those until `release` are one step."""
        shape = replace(self.transfer.shapes[number], opacity=opacity, soft=soft)
        self.set_shape(number, shape, ("opacity", number, self._gestures))

    def add(self, shape: psw.Box | psw.Triangle) -> None:
        """One more shape, selected."""
        self._do([*self.transfer.shapes, shape])
        self.selected = len(self.transfer.shapes) - 1

    def delete(self, number: int) -> bool:
        """Without that shape; the last one stays. Whether it went."""
        if len(self.transfer.shapes) == 1:
            return False
        self._do([shape for n, shape in enumerate(self.transfer.shapes) if n != number])
        self.selected = None
        return True

    def apply(self, transfer: psw.TransferFunction2D, gesture: Hashable = None) -> None:
        """Another function altogether."""
        self.selected = self._held = None
        self._history.do(transfer, gesture)

    def undo(self) -> None:
        """One step back."""
        self.selected = self._held = None
        self._history.undo()

    def redo(self) -> None:
        """One step forward again."""
        self.selected = self._held = None
        self._history.redo()

    def load(self, path: str | Path) -> None:
        """`TransferFunction2D.load`, as a step that can be undone; TransferFunctionError where it is none."""
        self.apply(psw.TransferFunction2D.load(path))

    def _do(self, shapes: list[psw.Box | psw.Triangle], gesture: Hashable = None) -> None:
        transfer = psw.TransferFunction2D(shapes, self.transfer.opacity_unit)
        self._history.do(transfer, gesture)
