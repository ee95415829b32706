"""The panel in a window: Dear ImGui fed with our events, drawn over our frames. It opens no windows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from persp_sw.errors import MissingPackageError

from ..screen.events import Button, Event, Key, Pointer, Text, Wheel
from ..screen.gl_objects import kept_state

try:
    import imgui_bundle
    from imgui_bundle import imgui, implot
    from imgui_bundle.python_backends.opengl_backend_programmable import ProgrammablePipelineRenderer
except ImportError as error:
    raise MissingPackageError(
        f"the panel needs the package imgui-bundle ({error}): pip install 'persp-sw[panel]'"
    ) from None

from . import imgui_input
from .desk import Desk
from .sections import Sections
from .view_handles import ViewHandles

if TYPE_CHECKING:
    from ..preview.controller import Preview
    from ..preview.pictures import PreviewPictures
    from ..preview.wanted import Wanted
    from ..window import Window

LETTER = 15.0  # pixels, times the desktop's scale
# Passes after the last event until nothing changes any more: one to see what is hovered, one to show it.
_SETTLING = 3


class Panel:
    """A `LaidOver`; makes one ImGui context, which is its own, in the current OpenGL context.

    Parameters
    ----------
    window
        What it is drawn over: its size, and how large letters are there.
    preview, pictures
        What it changes.

    Attributes
    ----------
    desk
        What it changes, without widgets.
    places
        Where its parts were last, by name: pixels (x, y) of the window, y downwards.
    """

    def __init__(self, window: Window, preview: Preview, pictures: PreviewPictures):
        self._window = window
        self.desk = Desk(preview.choices, pictures)
        self.places: dict[str, tuple[float, float]] = {}
        self._context, self._plots = imgui.create_context(), implot.create_context()
        self._use()
        self._io = io = imgui.get_io()
        io.set_ini_filename("")  # leaves no file behind
        io.set_log_filename("")
        io.config_input_text_cursor_blink = False  # no frames for that
        io.config_input_trickle_event_queue = False  # every press gets its own pass, see `take`
        fonts = Path(imgui_bundle.__file__).parent / "assets" / "fonts" / "Roboto"
        io.fonts.add_font_from_file_ttf(str(fonts / "Roboto-Regular.ttf"), LETTER)
        _style(window.content_scale)
        with kept_state():
            self._renderer = ProgrammablePipelineRenderer()
        self._sections = Sections(self.desk, preview, self.places)
        self._handles = ViewHandles(self.desk, self.places)
        self._owners: dict[str, str] = {}  # who has the press of a mouse button: "panel", "handle", "view"
        self._stale = True  # events have come since the last pass
        self._drawn = False
        self._settling = _SETTLING
        self._time = monotonic()
        self._wanted: Wanted | None = None

    @property
    def wants_frame(self) -> bool:
        """Whether it looks different from what was drawn last."""
        return not self._drawn or self._settling > 0 or self._sections.is_waiting

    def take(self, events: Iterable[Event], wanted: Wanted) -> list[Event]:
        """Look at what happened, and act; the events that are not for it."""
        self._use()
        self._wanted = wanted
        self.desk.take_over()
        left = [event for event in events if not self._takes(event)]
        if self._stale or self._settling > 0 or self._sections.is_waiting:
            self._settling -= self._settling > 0 and not self._stale
            self._pass()
        return left

    def tell(self, figures: Mapping[str, Any], seconds: float) -> None:
        """A frame was composited."""
        self._sections.recent.add(monotonic(), figures, seconds)
        self._settling = max(self._settling, 1)

    def draw(self) -> None:
        """Over the finished frame in the bound framebuffer."""
        self._use()
        if self._wanted is None:
            return
        with kept_state():
            self._renderer.render(imgui.get_draw_data())
        self._drawn = True

    def close(self) -> None:
        """Delete all that it made."""
        if self._context is not None:
            self._use()
            self._sections.close()
            with kept_state():
                self._renderer.shutdown()
            implot.destroy_context(self._plots)
            imgui.destroy_context(self._context)
            self._context = None

    def _use(self) -> None:
        imgui.set_current_context(self._context)
        implot.set_current_context(self._plots)

    def _takes(self, event: Event) -> bool:
        """Whether an event is the panel's alone."""
        presses = isinstance(event, Button | Wheel | Text) or (isinstance(event, Key) and event.down)
        if presses and self._stale:
            self._pass()  # to know what is under the pointer, or has the keyboard, now
        mine = self._is_mine(event)
        if not (isinstance(event, Wheel | Text) and not mine):
            imgui_input.tell(imgui, self._io, event)
            self._stale, self._settling = True, _SETTLING
        if isinstance(event, Button | Key):
            self._pass()
        return mine

    def _is_mine(self, event: Event) -> bool:
        io = self._io
        if isinstance(event, Button):
            if not event.down:
                owner = self._owners.pop(event.name, "view")
                if owner == "handle":
                    self._handles.release()
            elif io.want_capture_mouse:
                owner = self._owners[event.name] = "panel"
            elif event.name == "left" and not event.shift and self._handles.press(self._wanted):
                owner = self._owners[event.name] = "handle"
            else:
                owner = self._owners[event.name] = "view"
            return owner != "view"
        if isinstance(event, Pointer):
            if "handle" in self._owners.values():
                self._handles.drag((event.x, event.y), self._wanted)
            else:
                self._handles.hover((event.x, event.y))
            return bool(self._owners) and "view" not in self._owners.values()
        if isinstance(event, Wheel):
            return bool(io.want_capture_mouse)
        if isinstance(event, Text):
            return bool(io.want_text_input)
        if isinstance(event, Key) and event.down:
            if io.want_text_input:
                return True
            if event.control and event.name == "Z":
                (self.desk.editor.redo if event.shift else self.desk.editor.undo)()
                self.desk.hand_over()
                return True
            return bool(io.want_capture_keyboard)
        return False

    def _pass(self) -> None:
        """One pass of ImGui: it takes its events, and the sections act on them and say how they look."""
        now = monotonic()
        self._io.delta_time, self._time = max(now - self._time, 1e-4), now
        width, height = self._window.size
        self._io.display_size = float(max(width, 1)), float(max(height, 1))
        self.places.clear()
        imgui.new_frame()
        if self._sections.shows_handles:
            self._handles.show(self._wanted)
        else:
            self._handles.hide()
        self._sections.show((width, height))
        imgui.render()
        self.desk.hand_over()
        self._stale = self._drawn = False


def _style(scale: float) -> None:
    imgui.style_colors_dark()
    style = imgui.get_style()
    style.window_rounding, style.frame_rounding, style.grab_rounding = 0.0, 3.0, 3.0
    style.window_border_size, style.frame_border_size = 0.0, 0.0
    style.window_padding, style.frame_padding, style.item_spacing = (8.0, 8.0), (6.0, 3.0), (6.0, 5.0)
    style.scrollbar_size = 11.0
    style.scale_all_sizes(scale)
    style.font_scale_dpi = scale
    colours = {
        imgui.Col_.window_bg: (0.09, 0.10, 0.12, 0.96),
        imgui.Col_.popup_bg: (0.12, 0.13, 0.15, 0.98),
        imgui.Col_.frame_bg: (0.20, 0.22, 0.26, 1.0),
        imgui.Col_.frame_bg_hovered: (0.26, 0.29, 0.34, 1.0),
        imgui.Col_.frame_bg_active: (0.30, 0.34, 0.40, 1.0),
        imgui.Col_.header: (0.17, 0.20, 0.25, 1.0),
        imgui.Col_.header_hovered: (0.22, 0.27, 0.34, 1.0),
        imgui.Col_.header_active: (0.26, 0.32, 0.40, 1.0),
        imgui.Col_.button: (0.22, 0.27, 0.34, 1.0),
        imgui.Col_.button_hovered: (0.28, 0.36, 0.46, 1.0),
        imgui.Col_.button_active: (0.34, 0.44, 0.56, 1.0),
        imgui.Col_.check_mark: (0.55, 0.78, 1.0, 1.0),
        imgui.Col_.slider_grab: (0.45, 0.62, 0.82, 1.0),
        imgui.Col_.slider_grab_active: (0.55, 0.78, 1.0, 1.0),
        imgui.Col_.text: (0.92, 0.93, 0.94, 1.0),
        imgui.Col_.text_disabled: (0.60, 0.63, 0.67, 1.0),
    }
    for name, colour in colours.items():
        style.set_color_(name, colour)
    implot.style_colors_dark()
