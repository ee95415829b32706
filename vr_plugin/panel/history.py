"""Undo and redo of whatever is edited, as a line of states. Knows nothing of what they are."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Generic, TypeVar

State = TypeVar("State")


class History(Generic[State]):
    """The states that something has had; the states themselves are kept, so undoing restores every bit.

    Parameters
    ----------
    start
        The first of them.
    most
        How many are kept; the oldest go first.
    """

    def __init__(self, start: State, most: int = 200):
        self._states, self._at = [start], 0
        self._most = most
        self._gesture: Hashable = None

    @property
    def now(self) -> State:
        """The present state."""
        return self._states[self._at]

    @property
    def can_undo(self) -> bool:
        """Whether there is a state before."""
        return self._at > 0

    @property
    def can_redo(self) -> bool:
        """Whether something undone can come again."""
        return self._at + 1 < len(self._states)

    def do(self, state: State, gesture: Hashable = None) -> None:
        """Another state; what was undone is forgotten. States of one `gesture`, such as a drag, are one step.

        Nothing happens if it is the present state itself.
        """
        if state is self.now:
            return
        del self._states[self._at + 1 :]
        if gesture is not None and gesture == self._gesture:
            self._states[self._at] = state
        else:
            self._states.append(state)
            del self._states[: -self._most]
            self._at = len(self._states) - 1
        self._gesture = gesture

    def end_gesture(self) -> None:
        """The hand lets go: what comes next is a step of its own, whatever it is called."""
        self._gesture = None

    def undo(self) -> State:
        """The state before, which is the present one now; the first one stays."""
        self.end_gesture()
        self._at = max(self._at - 1, 0)
        return self.now

    def redo(self) -> State:
        """What was undone last, which is the present state now."""
        self.end_gesture()
        self._at = min(self._at + 1, len(self._states) - 1)
        return self.now
