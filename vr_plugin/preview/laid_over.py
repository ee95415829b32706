"""What may lie over the preview's frames and take its events first, such as a panel, as the loop sees it."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, Protocol

from persp_sw.errors import PerspSWError

from ..screen.events import Event
from .wanted import Wanted

if TYPE_CHECKING:
    from ..window import Window
    from .choices import Choices

_log = logging.getLogger("persp_sw")


class LaidOver(Protocol):
    """Made, used and closed by the thread that the window belongs to, its context current."""

    @property
    def wants_frame(self) -> bool:
        """Whether it looks different from what `draw` drew last, or soon will."""

    def take(self, events: Iterable[Event], wanted: Wanted) -> list[Event]:
        """Look at what happened, and act; the events that are not for it, in order."""

    def tell(self, figures: Mapping[str, Any], seconds: float) -> None:
        """A frame was composited: its figures, and how long it took from its begin to its display."""

    def draw(self) -> None:
        """Over the finished frame in the bound framebuffer, whose other pixels stay as they are."""

    def close(self) -> None:
        """Delete all that it made."""


Opener = Callable[["Window"], LaidOver]


class PanelSlot:
    """Where the panel is, if the user wants it and there is one."""

    def __init__(self, choices: Choices, window: Window, opener: Opener | None):
        self._choices, self._window, self._opener = choices, window, opener
        self._panel: LaidOver | None = None

    @property
    def shown(self) -> LaidOver | None:
        """The panel, where it is to be shown; made the first time."""
        choices = self._choices
        if choices.panel and self._panel is None:
            if self._opener is None:
                choices.panel = False
                return None
            try:
                self._window.make_current()
                self._panel = self._opener(self._window)
            except PerspSWError as error:  # a package is missing; the preview does without
                choices.panel, self._opener = False, None
                choices.say(str(error))
                _log.warning("%s", error)
        return self._panel if choices.panel else None

    @property
    def wants_frame(self) -> bool:
        """Whether the panel is shown and does."""
        panel = self.shown
        return panel is not None and panel.wants_frame

    def close(self) -> None:
        """Close the panel."""
        if self._panel is not None and self._window.is_open:
            self._window.make_current()
            self._panel.close()
        self._panel = None
