"""What happens to windows, as data: keys, text, mouse, sizes, closing, focus, monitors.

Positions and sizes are in pixels of the window's picture, counted from its upper left corner, y downwards.
Keys have the names of what is printed on them without shift ("A", "1", "+"), others their usual ones
("ESCAPE", "TAB", "SPACE", "LEFT", "PAGE_UP", "F1", "LEFT_SHIFT").
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Event:
    """Something happened to the window of this name."""

    window: str


@dataclass(frozen=True)
class Key(Event):
    """A key went down or up; `repeat` while it is held down."""

    name: str
    down: bool
    shift: bool = False
    control: bool = False
    alt: bool = False
    repeat: bool = False


@dataclass(frozen=True)
class Text(Event):
    """A character was typed, with all that shift, layout and dead keys make of it."""

    character: str


@dataclass(frozen=True)
class Pointer(Event):
    """The mouse is at (x, y)."""

    x: float
    y: float


@dataclass(frozen=True)
class Button(Event):
    """A mouse button, "left", "right", "middle" or its number, went down or up."""

    name: str
    down: bool
    shift: bool = False
    control: bool = False
    alt: bool = False


@dataclass(frozen=True)
class Wheel(Event):
    """The wheel turned: notches, away from the user > 0, and to the right for wheels that tilt."""

    notches: float
    right: float = 0.0
    shift: bool = False


@dataclass(frozen=True)
class Resized(Event):
    """The picture has another size, pixels; (0, 0) of a window that is iconified."""

    width: int
    height: int


@dataclass(frozen=True)
class Closing(Event):
    """The user wants the window closed; it is the program that does so, or not."""


@dataclass(frozen=True)
class Focus(Event):
    """The keyboard belongs to the window now, or no longer: then no key is down any more."""

    gained: bool


@dataclass(frozen=True)
class MonitorChange(Event):
    """A monitor was connected or lost; `window` is empty, windows were already moved."""

    monitor: str
    connected: bool


def asks_to_end(event: Event) -> bool:
    """Whether an event is the user's usual way to end a program: escape, or a window's close button."""
    return isinstance(event, Closing) or (isinstance(event, Key) and event.name == "ESCAPE" and event.down)
