"""What editors of transfer functions have in common: a history of functions, a selection, and a hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Generic, TypeVar

import persp_sw as psw
from persp_sw.errors import TransferFunctionError

from .history import History

Function = TypeVar("Function", psw.TransferFunction, psw.TransferFunction2D)


class FunctionEdit(Generic[Function]):
    """A transfer function that a hand changes, step by step.

    Parameters
    ----------
    transfer
        To start with.

    Attributes
    ----------
    selected
        Number of the part of the function that colour, opacity and keys are about; None for none.
    """

    def __init__(self, transfer: Function):
        self.selected: int | None = None
        self._history = History(transfer)
        self._gestures = 0
        self._held: Any = None  # what the hand has taken, and from where

    @property
    def transfer(self) -> Function:
        """As edited so far."""
        return self._history.now

    @property
    def history(self) -> History[Function]:
        """What can be undone."""
        return self._history

    @property
    def is_dragging(self) -> bool:
        """Whether a hand holds a part of it."""
        return self._held is not None

    def save(self, path: str | Path) -> None:
        """The function's own `save`; TransferFunctionError where the disk refuses."""
        try:
            self.transfer.save(path)
        except OSError as error:
            raise TransferFunctionError(
                f"cannot write the transfer function {path}: {error.strerror}"
            ) from None
