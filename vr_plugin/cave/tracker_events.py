"""Windows' events for a head that is moved by keyboard and mouse."""

from __future__ import annotations

from ..screen.events import Button, Event, Focus, Key, Pointer, Wheel
from ..trackers import MouseTracker

_BUTTONS = {"left": 0, "right": 1, "middle": 2}
_KEYS = {
    "LEFT_SHIFT": "shift",
    "RIGHT_SHIFT": "shift",
    "LEFT_CONTROL": "ctrl",
    "RIGHT_CONTROL": "ctrl",
}


class TrackerEvents:
    """Gives events to a tracker; those that it has no use for are ignored."""

    def __init__(self, tracker: MouseTracker):
        self._tracker = tracker
        self._pointers: dict[
            str, tuple[float, float]
        ] = {}  # by window: a mouse that changes it does not jump
        self._held: set[str] = set()

    def feed(self, event: Event) -> None:
        """One event, in their order."""
        tracker = self._tracker
        if isinstance(event, Key) and not event.repeat:
            name = _KEYS.get(event.name, event.name.lower())
            (self._held.add if event.down else self._held.discard)(name)
            tracker.key(name, event.down)
        elif isinstance(event, Button) and event.name in _BUTTONS:
            tracker.button(_BUTTONS[event.name], event.down)
        elif isinstance(event, Wheel):
            tracker.scroll(event.notches)
        elif isinstance(event, Pointer):
            x, y = self._pointers.get(event.window, (event.x, event.y))
            self._pointers[event.window] = event.x, event.y
            tracker.move(event.x - x, event.y - y)
        elif isinstance(event, Focus) and not event.gained:  # nobody will say that keys went up
            for name in sorted(self._held):
                tracker.key(name, False)
            self._held.clear()
            for number in _BUTTONS.values():
                tracker.button(number, False)
            self._pointers.clear()
