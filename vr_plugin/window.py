"""Windows (glfw): one for each wall or eye, with shared OpenGL objects, swapped together, events as data.

All of it belongs to one thread, the program's main one.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from types import ModuleType
from typing import Any

from persp_sw.errors import MissingPackageError

from .rig import WindowPlace
from .screen.events import Event, MonitorChange
from .screen.monitors import Monitors, WindowError
from .screen.window_input import listen

_NO_SCREEN = (
    "start it in a desktop session or give DISPLAY; without a screen, use --offscreen, or a virtual one: "
    "xvfb-run -a -s '-screen 0 1600x1200x24' …"
)


class Window:
    """One window; `Windows.open` makes it.

    Attributes
    ----------
    name
        As given; a wall's.
    size
        Width and height of its picture in pixels, which on some systems are more than screen coordinates;
        (0, 0) while it is iconified.
    fullscreen_on
        Name of the monitor that it fills; empty for none.
    """

    def __init__(self, windows: Windows, name: str, handle: Any):
        self.name = name
        self.handle = handle
        self.size = 0, 0
        self.fullscreen_on = ""
        self._windows = windows
        self._glfw = windows.glfw
        self._scale = 1.0, 1.0  # pixels of a screen coordinate
        self.measure()

    @property
    def is_open(self) -> bool:
        """Whether it was not closed."""
        return self.handle is not None

    @property
    def is_drawn(self) -> bool:
        """Whether it has pixels to draw: it is open and not iconified."""
        return self.is_open and min(self.size) > 0

    @property
    def position(self) -> tuple[int, int]:
        """Of its picture's upper left corner on the desktop, screen coordinates; (0, 0) if nobody tells."""
        return self._glfw.get_window_pos(self.handle)

    @property
    def content_scale(self) -> float:
        """How large letters are to be, relative to a monitor of usual resolution: what the desktop says."""
        return max(self._glfw.get_window_content_scale(self.handle))

    @property
    def first_row(self) -> int:
        """The row of its monitor that its picture's top row lies on, for `stereo.shows_left`."""
        monitor = self._windows.monitors.below(self)
        top = monitor.position[1] if monitor else 0
        return round((self.position[1] - top) * self._scale[1])

    def make_current(self) -> None:
        """Draw here from now on, into framebuffer 0."""
        self._glfw.make_context_current(self.handle)

    def set_title(self, title: str) -> None:
        """What its frame says."""
        self._glfw.set_window_title(self.handle, title)

    def resize(self, width: int, height: int) -> None:
        """Ask for another size, screen coordinates; an event says when it has it."""
        self._glfw.set_window_size(self.handle, width, height)

    def measure(self) -> None:
        """Ask the window system for the size."""
        self.size = self._glfw.get_framebuffer_size(self.handle)
        on_screen = self._glfw.get_window_size(self.handle)
        if min(self.size) > 0 and min(on_screen) > 0:
            self._scale = self.size[0] / on_screen[0], self.size[1] / on_screen[1]

    def pixel(self, x: float, y: float) -> tuple[float, float]:
        """Pixel position of a position in screen coordinates."""
        return x * self._scale[0], y * self._scale[1]

    def close(self) -> None:
        """Close it and what OpenGL objects it did not share. Delete those first: its context goes with it."""
        if self.handle is not None:
            self._windows.forget(self)
            self._glfw.destroy_window(self.handle)
            self.handle = None


class Windows:
    """All windows of the program; there is one of these at a time, for glfw is one.

    Parameters
    ----------
    vsync
        Wait for the display once for all windows together: at the last one that is swapped.

    Attributes
    ----------
    monitors
        What is connected; see `Monitors`.

    Raises
    ------
    MissingPackageError
        No glfw.
    WindowError
        No display, or another of these is open.
    """

    _there: Windows | None = None

    def __init__(self, vsync: bool = True):
        if Windows._there is not None:
            raise WindowError("the program's windows are open already: open more of them there")
        self.glfw = _load()
        self._vsync = vsync
        self._windows: list[Window] = []
        self._events: list[Event] = []
        self._reason = ""
        # The library would warn at the time and place of its choice.
        self.glfw.set_error_callback(self._failed)
        if not self.glfw.init():
            reason = self._reason or "no reason given"
            self.glfw.set_error_callback(None)
            raise WindowError(f"no window can be opened: {reason}; {_NO_SCREEN}")
        self.monitors = Monitors(self.glfw)
        self.glfw.set_monitor_callback(self._monitor_changed)
        Windows._there = self

    def __enter__(self) -> Windows:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[Window]:
        return iter(tuple(self._windows))

    def open(
        self,
        name: str,
        place: WindowPlace | None = None,
        pixels: Sequence[int] = (1280, 800),
        title: str = "",
        *,
        quad_buffered: bool = False,
        visible: bool = True,
    ) -> Window:
        """Open a window and make it current. All share textures, buffers and programs.

        Parameters
        ----------
        name
            For events and messages; a wall's.
        place
            Fullscreen on a monitor, whose resolution is kept; or at a position, without a frame, so that its
            pixels lie exactly there; or in the middle of a monitor. None: where the window system likes.
        pixels
            Width and height where `place` has none.
        quad_buffered
            Ask for left and right buffers; the window opens without them, too (see `Composer.possible_mode`).

        Raises
        ------
        WindowError
            No such monitor, a name given twice, or no OpenGL 3.3.
        """
        place = place or WindowPlace()
        if any(window.name == name for window in self._windows):
            raise WindowError(f"there is a window {name!r} already; windows need names of their own")
        glfw = self.glfw
        monitor = self.monitors.wanted(name, place)
        width, height = place.size or pixels
        if place.fullscreen:
            mode = glfw.get_video_mode(monitor)
            width, height = mode.size
        hints = self._hints(place, quad_buffered)
        if place.fullscreen:
            hints[glfw.REFRESH_RATE] = mode.refresh_rate
        screen = monitor if place.fullscreen else None
        handle = self._create(hints, (width, height), title or name, screen)
        if not handle and quad_buffered:
            handle = self._create(hints | {glfw.STEREO: False}, (width, height), title or name, screen)
        if not handle:
            raise WindowError(
                f"no window for {name!r}: {self._reason or 'no reason given'}. It needs OpenGL 3.3: update "
                "the graphics driver, draw with the processor (LIBGL_ALWAYS_SOFTWARE=1), or use --offscreen"
            )
        if not place.fullscreen:
            self._put(handle, place, monitor, (width, height))
        window = Window(self, name, handle)
        if place.fullscreen:
            window.fullscreen_on = self.monitors.name(monitor)
        listen(glfw, window, self._events)
        self._windows.append(window)
        if visible:
            glfw.show_window(handle)
        self._set_intervals()
        window.make_current()
        return window

    def poll(self, wait_s: float = 0.0) -> list[Event]:
        """What happened since the last call, in order; waits so long for something to happen."""
        if wait_s > 0:
            self.glfw.wait_events_timeout(wait_s)
        else:
            self.glfw.poll_events()
        events = self._events.copy()
        self._events.clear()
        return events

    def swap(self) -> None:
        """Show what was drawn, in all windows together: first draw all, then call this once."""
        for window in self._windows:
            window.make_current()
            self.glfw.swap_buffers(window.handle)

    def forget(self, window: Window) -> None:
        """A window is being closed."""
        self._windows = [other for other in self._windows if other is not window]
        self.monitors.forget(window)
        self._set_intervals()

    def close(self) -> None:
        """Close all windows and let go of the display; twice is once."""
        if Windows._there is not self:
            return
        Windows._there = None
        for window in tuple(self._windows):
            window.close()
        self.glfw.terminate()
        self.glfw.set_error_callback(None)

    def _hints(self, place: WindowPlace, quad_buffered: bool) -> dict[int, int]:
        glfw = self.glfw
        return {
            glfw.CONTEXT_CREATION_API: _context_api(glfw),
            glfw.CONTEXT_VERSION_MAJOR: 3,
            glfw.CONTEXT_VERSION_MINOR: 3,
            glfw.OPENGL_PROFILE: glfw.OPENGL_CORE_PROFILE,
            glfw.OPENGL_FORWARD_COMPAT: sys.platform == "darwin",
            glfw.OPENGL_DEBUG_CONTEXT: False,
            glfw.SRGB_CAPABLE: True,
            glfw.STEREO: quad_buffered,
            glfw.DECORATED: place.position is None,
            glfw.AUTO_ICONIFY: False,  # a wall stays when another window is clicked on
            glfw.VISIBLE: False,  # until it is where it belongs
        }

    def _create(self, hints: dict[int, int], size: Sequence[int], title: str, screen: Any) -> Any:
        glfw = self.glfw
        glfw.default_window_hints()
        for name, value in hints.items():
            glfw.window_hint(name, int(value))
        self._reason = ""
        shared = self._windows[0].handle if self._windows else None
        handle = glfw.create_window(int(size[0]), int(size[1]), title, screen, shared)
        glfw.default_window_hints()
        return handle

    def _put(self, handle: Any, place: WindowPlace, monitor: Any, size: Sequence[int]) -> None:
        """Where a window that does not fill a monitor is to be."""
        position = place.position
        if position is None and place.monitor is not None:
            there = self.monitors.describe(monitor)
            position = [
                p + (whole - part) // 2
                for p, whole, part in zip(there.position, there.size, size, strict=True)
            ]
        if position is not None:
            self.glfw.set_window_pos(handle, int(position[0]), int(position[1]))

    def _monitor_changed(self, handle: Any, change: int) -> None:
        name = self.monitors.name(handle)
        connected = change == self.glfw.CONNECTED
        self._events.append(MonitorChange("", name, connected))
        if connected:
            self.monitors.found(handle)
        else:
            self.monitors.lost(name, self._windows)

    def _set_intervals(self) -> None:
        """Only the last window that is swapped waits for the display, or n windows would wait n times."""
        for number, window in enumerate(self._windows, 1):
            window.make_current()
            self.glfw.swap_interval(int(self._vsync and number == len(self._windows)))

    def _failed(self, code: int, description: bytes | str) -> None:
        text = description.decode(errors="replace") if isinstance(description, bytes) else str(description)
        self._reason = text.strip()


def _load() -> ModuleType:
    """glfw, for the window system that can do what walls need."""
    if sys.platform.startswith("linux") and os.environ.get("DISPLAY"):
        # On Wayland no window can be placed, nor knows where it is; XWayland can.
        os.environ.setdefault("PYGLFW_LIBRARY_VARIANT", "x11")
        if "OpenGL" not in sys.modules and "WAYLAND_DISPLAY" in os.environ:
            os.environ.setdefault("PYOPENGL_PLATFORM", "glx")
    try:
        import glfw
    except ImportError as error:
        raise MissingPackageError(
            f"windows need the package glfw ({error}): pip install 'persp-sw[view]'"
        ) from None
    return glfw


def _context_api(glfw: ModuleType) -> int:
    """How contexts are made: PyOpenGL finds only those of the system that it was loaded for."""
    platform = getattr(sys.modules.get("OpenGL.platform"), "PLATFORM", None)
    name = type(platform).__name__ if platform else os.environ.get("PYOPENGL_PLATFORM", "")
    return glfw.EGL_CONTEXT_API if name.lower().startswith("egl") else glfw.NATIVE_CONTEXT_API
