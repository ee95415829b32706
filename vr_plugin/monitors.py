"""Monitors: which there are, which one a window is on, and what becomes of windows when one is lost.

Knows glfw only as what it is handed.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple

from persp_sw.errors import PerspSWError

from .rig import WindowPlace

if TYPE_CHECKING:
    from .window import Window

_log = logging.getLogger("persp_sw")


class WindowError(PerspSWError):
    """Windows cannot be opened here, or not as asked."""


class Monitor(NamedTuple):
    """A monitor: its name, and where it is on the desktop, in screen coordinates."""

    name: str
    position: tuple[int, int]
    size: tuple[int, int]
    hz: int


class Monitors:
    """The monitors of the display.

    Attributes
    ----------
    displaced
        Windows that filled a monitor that was lost, by its name.
    """

    def __init__(self, glfw: ModuleType):
        self._glfw = glfw
        self.displaced: dict[str, Window] = {}

    def all(self) -> list[Monitor]:
        """Those that are connected; the first is the main one."""
        return [self.describe(handle) for handle in self._glfw.get_monitors()]

    def name(self, handle: Any) -> str:
        """What the window system calls a monitor, such as "DP-1"."""
        name = self._glfw.get_monitor_name(handle)
        return name.decode(errors="replace") if isinstance(name, bytes) else str(name)

    def describe(self, handle: Any) -> Monitor:
        """All there is to know of a monitor."""
        mode = self._glfw.get_video_mode(handle)
        position = tuple(self._glfw.get_monitor_pos(handle))
        return Monitor(self.name(handle), position, tuple(mode.size), mode.refresh_rate)

    def wanted(self, name: str, place: WindowPlace) -> Any:
        """glfw's handle of the monitor that a window is to be on; None if that does not matter.

        Raises
        ------
        WindowError
            There is no such monitor; the message lists those that there are.
        """
        if place.monitor is None and not place.fullscreen:
            return None
        handles, number = self._glfw.get_monitors(), place.monitor or 0
        if 0 <= number < len(handles):
            return handles[number]
        there = [f"{i} ({m.name}, {_text(m.size)} at {m.position})" for i, m in enumerate(self.all())]
        raise WindowError(
            f"the window of {name!r} wants monitor {number}; there are: {', '.join(there) or 'none'}"
        )

    def below(self, window: Window) -> Monitor | None:
        """The monitor that shows most of a window; None without monitors."""
        x, y = window.position
        width, height = self._glfw.get_window_size(window.handle)

        def shown(monitor: Monitor) -> int:
            (left, top), (wide, high) = monitor.position, monitor.size
            across = min(x + width, left + wide) - max(x, left)
            down = min(y + height, top + high) - max(y, top)
            return max(across, 0) * max(down, 0)

        return max(self.all(), key=shown, default=None)

    def fill(self, handle: Any, window: Window) -> None:
        """Let a window fill a monitor, at its resolution."""
        there = self.describe(handle)
        self._glfw.set_window_monitor(window.handle, handle, 0, 0, *there.size, there.hz)
        window.fullscreen_on = there.name
        _log.warning("monitor %s is back: window %s fills it again", there.name, window.name)

    def displace(self, name: str, windows: Sequence[Window]) -> None:
        """A monitor is lost: the window that filled it becomes one with a frame on the main one, and says so.

        Half as large as the monitor, so that it does not hide another wall there.
        """
        left = self.all()
        for window in windows:
            if window.fullscreen_on != name:
                continue
            window.fullscreen_on = ""
            self.displaced[name] = window
            where = "on no monitor"
            if left:
                (x, y), (width, height) = left[0].position, left[0].size
                place = x + width // 4, y + height // 4, width // 2, height // 2
                self._glfw.set_window_attrib(window.handle, self._glfw.DECORATED, True)
                self._glfw.set_window_monitor(window.handle, None, *place, self._glfw.DONT_CARE)
                where = f"a window of {_text(place[2:])} on {left[0].name}"
            _log.warning(
                "monitor %s is lost: window %s, which filled it, is now %s", name, window.name, where
            )

    def forget(self, window: Window) -> None:
        """A window was closed."""
        self.displaced = {name: other for name, other in self.displaced.items() if other is not window}


def _text(size: Sequence[int]) -> str:
    return f"{size[0]} × {size[1]}"
