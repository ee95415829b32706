"""Monitors: which there are, which one a window is on, and what becomes of windows when one is lost.

Knows glfw only as what it is handed.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple

from persp_sw.errors import PerspSWError

from ..rig import WindowPlace

if TYPE_CHECKING:
    from ..window import Window

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
        By the name of a monitor that was lost: the windows that were on it, with their position on the
        desktop, or None for one that filled it.
    """

    def __init__(self, glfw: ModuleType):
        self._glfw = glfw
        self.displaced: dict[str, list[tuple[Window, tuple[int, int] | None]]] = {}

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
        return max(self.all(), key=lambda monitor: self._shown(window, monitor), default=None)

    def lost(self, name: str, windows: Sequence[Window]) -> None:
        """A monitor is gone: windows that nobody sees any more go to the main one, and a warning says so.

        A window that filled it gets a frame and half the main monitor's edges, so as not to hide all there.
        """
        left = self.all()
        for window in windows:
            filled = window.fullscreen_on == name
            if not filled and (not left or any(self._shown(window, monitor) for monitor in left)):
                continue
            self.displaced.setdefault(name, []).append((window, None if filled else window.position))
            window.fullscreen_on = ""
            if not left:
                _log.warning(
                    "monitor %s is lost, and with it window %s: there is no other", name, window.name
                )
                continue
            (x, y), (width, height) = left[0].position, left[0].size
            if filled:
                place = x + width // 4, y + height // 4, width // 2, height // 2
                self._glfw.set_window_attrib(window.handle, self._glfw.DECORATED, True)
                self._glfw.set_window_monitor(window.handle, None, *place, self._glfw.DONT_CARE)
            else:
                self._glfw.set_window_pos(window.handle, x, y)
            _log.warning(
                "monitor %s is lost: window %s is now a window on %s", name, window.name, left[0].name
            )

    def found(self, handle: Any) -> None:
        """A monitor is there: what was on it before goes back."""
        there = self.describe(handle)
        for window, position in self.displaced.pop(there.name, ()):
            if position is None:
                self._glfw.set_window_monitor(window.handle, handle, 0, 0, *there.size, there.hz)
                window.fullscreen_on = there.name
            else:
                self._glfw.set_window_pos(window.handle, *position)
            _log.warning("monitor %s is back, and window %s on it", there.name, window.name)

    def forget(self, window: Window) -> None:
        """A window was closed."""
        for name, windows in self.displaced.items():
            self.displaced[name] = [entry for entry in windows if entry[0] is not window]

    def _shown(self, window: Window, monitor: Monitor) -> int:
        """How much of a window a monitor shows, square screen coordinates."""
        x, y = window.position
        width, height = self._glfw.get_window_size(window.handle)
        (left, top), (wide, high) = monitor.position, monitor.size
        across = min(x + width, left + wide) - max(x, left)
        down = min(y + height, top + high) - max(y, top)
        return max(across, 0) * max(down, 0)


def _text(size: Sequence[int]) -> str:
    return f"{size[0]} × {size[1]}"
