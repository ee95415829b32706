"""Our windows' events as Dear ImGui's input. Knows ImGui only as what it is handed."""

from __future__ import annotations

from types import ModuleType
from typing import Any

from ..screen.events import Button, Event, Focus, Key, Pointer, Text, Wheel

_BUTTONS = {"left": 0, "right": 1, "middle": 2}
_NAMED = {
    "TAB": "tab", "BACKSPACE": "backspace", "ENTER": "enter", "KP_ENTER": "enter", "ESCAPE": "escape",
    "DELETE": "delete", "INSERT": "insert", "SPACE": "space", "HOME": "home", "END": "end",
    "LEFT": "left_arrow", "RIGHT": "right_arrow", "UP": "up_arrow", "DOWN": "down_arrow",
    "PAGE_UP": "page_up", "PAGE_DOWN": "page_down",
    "LEFT_SHIFT": "left_shift", "RIGHT_SHIFT": "right_shift",
    "LEFT_CONTROL": "left_ctrl", "RIGHT_CONTROL": "right_ctrl",
    "LEFT_ALT": "left_alt", "RIGHT_ALT": "right_alt",
}  # fmt: skip


def tell(imgui: ModuleType, io: Any, event: Event) -> None:
    """Queue an event; those that ImGui has no use for are nothing to it."""
    if isinstance(event, Key | Button):
        # A modifier's own key comes without itself; ImGui wants to know what holds from now on.
        pressed = {"SHIFT": event.shift, "CONTROL": event.control, "ALT": event.alt}
        if isinstance(event, Key):
            _, _, own = event.name.rpartition("_")
            if own in pressed and event.name.split("_")[0] in ("LEFT", "RIGHT"):
                pressed[own] = event.down
        for name, key in (("SHIFT", "mod_shift"), ("CONTROL", "mod_ctrl"), ("ALT", "mod_alt")):
            io.add_key_event(getattr(imgui.Key, key), pressed[name])
    if isinstance(event, Pointer):
        io.add_mouse_pos_event(event.x, event.y)
    elif isinstance(event, Button):
        if event.name in _BUTTONS:
            io.add_mouse_button_event(_BUTTONS[event.name], event.down)
    elif isinstance(event, Wheel):
        io.add_mouse_wheel_event(-event.right, event.notches)
    elif isinstance(event, Text):
        io.add_input_character(ord(event.character))
    elif isinstance(event, Focus):
        io.add_focus_event(event.gained)
    elif isinstance(event, Key):
        key = key_of(imgui, event.name)
        if key is not None:
            io.add_key_event(key, event.down)


def key_of(imgui: ModuleType, name: str) -> Any:
    """ImGui's name of a key of ours; None for keys that it has no use for."""
    if len(name) == 1 and name.isascii() and name.isalnum():
        return getattr(imgui.Key, f"_{name}" if name.isdigit() else name.lower())
    if name.startswith("F") and name[1:].isdigit():
        return getattr(imgui.Key, name.lower(), None)
    return getattr(imgui.Key, _NAMED[name]) if name in _NAMED else None
