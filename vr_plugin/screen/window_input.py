"""glfw's callbacks of a window, turned into events. Knows glfw only as what it is handed."""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING, Any

from .events import Button, Closing, Event, Focus, Key, Pointer, Resized, Text, Wheel

if TYPE_CHECKING:
    from ..window import Window

_BUTTONS = ("left", "right", "middle")


def listen(glfw: ModuleType, window: Window, events: list[Event]) -> None:
    """Append all that happens to a window to `events`, and keep its size up to date."""
    name = window.name
    names = {
        value: constant[4:]
        for constant, value in vars(glfw).items()
        if constant.startswith("KEY_") and constant not in ("KEY_LAST", "KEY_UNKNOWN")
    }
    shift_held = False

    def modifiers(bits: int) -> dict[str, bool]:
        return {
            "shift": bool(bits & glfw.MOD_SHIFT),
            "control": bool(bits & glfw.MOD_CONTROL),
            "alt": bool(bits & glfw.MOD_ALT),
        }

    def key(_: Any, number: int, scancode: int, action: int, bits: int) -> None:
        nonlocal shift_held
        if number == glfw.KEY_UNKNOWN:
            return
        down = action != glfw.RELEASE
        if number in (glfw.KEY_LEFT_SHIFT, glfw.KEY_RIGHT_SHIFT):
            shift_held = down
        printed = glfw.get_key_name(number, scancode)
        printed = printed.decode(errors="replace") if isinstance(printed, bytes) else printed
        shown = printed.upper() if printed else names.get(number, str(number))
        events.append(Key(name, shown, down, **modifiers(bits), repeat=action == glfw.REPEAT))

    def text(_: Any, codepoint: int) -> None:
        events.append(Text(name, chr(codepoint)))

    def pointer(_: Any, x: float, y: float) -> None:
        events.append(Pointer(name, *window.pixel(x, y)))

    def button(_: Any, number: int, action: int, bits: int) -> None:
        shown = _BUTTONS[number] if number < len(_BUTTONS) else str(number + 1)
        events.append(Button(name, shown, action == glfw.PRESS, **modifiers(bits)))

    def wheel(_: Any, right: float, notches: float) -> None:
        events.append(Wheel(name, notches, right, shift_held))

    def resized(_: Any, width: int, height: int) -> None:
        window.measure()
        events.append(Resized(name, width, height))

    def closing(handle: Any) -> None:
        glfw.set_window_should_close(handle, False)  # that is the program's to decide
        events.append(Closing(name))

    def focus(_: Any, gained: int) -> None:
        nonlocal shift_held
        shift_held = shift_held and bool(gained)
        events.append(Focus(name, bool(gained)))

    handle = window.handle
    glfw.set_key_callback(handle, key)
    glfw.set_char_callback(handle, text)
    glfw.set_cursor_pos_callback(handle, pointer)
    glfw.set_mouse_button_callback(handle, button)
    glfw.set_scroll_callback(handle, wheel)
    glfw.set_framebuffer_size_callback(handle, resized)
    glfw.set_window_close_callback(handle, closing)
    glfw.set_window_focus_callback(handle, focus)
