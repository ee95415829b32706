"""A transfer function under the user's hand: which point is held, what a drag does, and the way back.

No widgets and no pixels: places are (value, position) on the editor's two axes, positions 0 … 1 upwards as
the opacity axis has them. Whoever draws it says how large a pixel is there.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from pathlib import Path

import numpy as np

import persp_sw as psw

from .function_edit import FunctionEdit

Axis = psw.editing.OpacityAxis


class TransferEdit(FunctionEdit[psw.TransferFunction]):
    """An editor's state.

    Parameters
    ----------
    transfer
        To start with.
    limits
        Values between which points may be moved: the volume's, mostly. A point beyond them may stay there.
    axis
        Of opacities.

    Attributes
    ----------
    axis
        May be assigned at any time.
    selected
        Index of the point that colour and keys are about; None for none.
    """

    def __init__(
        self,
        transfer: psw.TransferFunction,
        limits: tuple[float, float],
        axis: Axis = psw.editing.LOGARITHMIC,
    ):
        super().__init__(transfer)
        self.axis, self.limits = axis, limits
        self._held: tuple[float, float] | None  # from the pointer to the point that it drags

    def place(self, index: int) -> tuple[float, float]:
        """Value and position of a point."""
        return float(self.transfer.values[index]), float(self.axis.position(self.transfer.opacities[index]))

    def point_at(self, value: float, position: float, reach: tuple[float, float]) -> int | None:
        """The point nearest to a place, within `reach` (values, positions: the radii of an ellipse)."""
        values, positions = self.transfer.values, self.axis.position(self.transfer.opacities)
        away = np.hypot((values - value) / reach[0], (positions - position) / reach[1])
        # Of points at one place the one on top, which was drawn last.
        nearest = len(away) - 1 - int(np.argmin(away[::-1]))
        return nearest if away[nearest] <= 1 else None

    def press(self, value: float, position: float, reach: tuple[float, float]) -> int | None:
        """The hand takes the point at a place, if there is one; its index."""
        index = self.point_at(value, position, reach)
        self.selected = index
        self._held = None
        if index is not None:
            at, height = self.place(index)
            self._held = at - value, height - position
            self._gestures += 1
        return index

    def drag(self, value: float, position: float) -> None:
        """The hand that holds a point is there now; the point is where it was taken, relative to the hand.

        From the same place no bit of the point changes.
        """
        if self._held is None or self.selected is None:
            return
        to_value, to_position = value + self._held[0], position + self._held[1]
        at, height = self.place(self.selected)
        if (to_value, to_position) == (at, height):
            return
        opacity = float(self.transfer.opacities[self.selected])
        if to_position != height:
            opacity = self.axis.opacity(to_position)
        self._do(self._moved(self.selected, to_value, opacity), ("drag", self._gestures))

    def release(self) -> None:
        """The hand lets go."""
        self._held = None
        self._history.end_gesture()

    def move(self, index: int, value: float, opacity: float) -> None:
        """A point to a value and an opacity, as typed."""
        self._do(self._moved(index, value, opacity))

    def add(self, value: float) -> int:
        """A point on the curve, selected; its index."""
        transfer, self.selected = psw.editing.added(self.transfer, float(np.clip(value, *self.limits)))
        self._do(transfer)
        return self.selected

    def delete(self, index: int) -> bool:
        """Without that point; the last one stays. Whether it went."""
        if len(self.transfer.values) == 1:
            return False
        self._do(psw.editing.deleted(self.transfer, index))
        self.selected = None
        return True

    def set_colour(self, index: int, colour: tuple[float, float, float]) -> None:
        """Linear; the colours that a point gets until `release` are one step."""
        if tuple(self.transfer.colours[index].tolist()) != tuple(colour):
            self._do(psw.editing.coloured(self.transfer, index, colour), ("colour", index, self._gestures))

    def set_logarithmic(self, logarithmic: bool) -> None:
        """Show opacities on a logarithmic axis, or on a linear one."""
        self.axis = psw.editing.LOGARITHMIC if logarithmic else psw.editing.LINEAR

    def apply(self, transfer: psw.TransferFunction, gesture: Hashable = None) -> None:
        """Another function altogether: a preset's, or a file's; those of one gesture are one step."""
        self.selected = None
        self._do(transfer, gesture)

    def undo(self) -> None:
        """One step back."""
        self._step(self._history.undo)

    def redo(self) -> None:
        """One step forward again."""
        self._step(self._history.redo)

    def load(self, path: str | Path) -> None:
        """`TransferFunction.load`, as a step that can be undone; TransferFunctionError where it is none."""
        self.apply(psw.TransferFunction.load(path))

    def _moved(self, index: int, value: float, opacity: float) -> psw.TransferFunction:
        at = float(self.transfer.values[index])
        within = min(self.limits[0], at), max(self.limits[1], at)
        return psw.editing.moved(self.transfer, index, value, opacity, within)

    def _do(self, transfer: psw.TransferFunction, gesture: Hashable = None) -> None:
        self._history.do(transfer, gesture)

    def _step(self, step: Callable[[], object]) -> None:
        self._held = None
        before = len(self.transfer.values)
        step()
        if len(self.transfer.values) != before:
            self.selected = None
