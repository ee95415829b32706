"""What a display shows now, and where that comes from: composited in turn with it, or beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from .frame import Frame, Picture
from .loop import Loop
from .moment import Moment


@dataclass(frozen=True, eq=False)
class Shown:
    """What the display shows now.

    Attributes
    ----------
    frame
        The newest that is finished: both eyes of one moment.
    moment
        That of the display: the frame's, or a later one.
    is_new
        Whether the frame was not shown before: its eye images have to be uploaded.
    """

    frame: Frame
    moment: Moment
    is_new: bool = True

    @property
    def pictures(self) -> Sequence[Picture]:
        """What each wall shows to each eye, seen from where the head is now."""
        return self.frame.pictures if self.moment is self.frame.moment else self.frame.seen_at(self.moment)


class Source(Protocol):
    """Where a display's frames come from."""

    def show(self, now: float) -> Shown | None:
        """What to draw for the display's next refresh; None before the first frame is finished."""

    def drawn(self, shown: Shown, upload_ms: float, warp_ms: float) -> None:
        """What drawing it took, without the wait for the display."""

    def __enter__(self) -> Source:
        """Ready; what is not finished at the end is given up."""

    def __exit__(self, *error: object) -> None:
        """The end."""


class InTurn:
    """Each frame composited for the head that it is shown to, while the display waits.

    Parameters
    ----------
    ahead_s
        From now to when a frame will be seen.
    """

    def __init__(self, loop: Loop, ahead_s: float):
        self.loop, self.ahead_s = loop, ahead_s

    def show(self, now: float) -> Shown:
        """A new frame."""
        frame = self.loop.frame(now, now + self.ahead_s)
        return Shown(frame, frame.moment)

    def drawn(self, shown: Shown, upload_ms: float, warp_ms: float) -> None:
        """Compositing has only what drawing leaves."""
        self.loop.steady.drawn(shown.frame, upload_ms, warp_ms)

    def __enter__(self) -> InTurn:
        return self

    def __exit__(self, *error: object) -> None:
        """Nothing is left to do."""
