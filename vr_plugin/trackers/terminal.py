"""Keys and mouse of a terminal, for a `MouseTracker` without a window.

Terminals report the mouse as `ESC [ < buttons ; column ; row M` (released: m) once they are asked to (modes
1002 and 1006 of xterm, which nearly all have), and keys as characters, but never that a key was released.
"""

from __future__ import annotations

import contextlib
import os
import re
import select
import sys
from collections.abc import Iterator

from .mouse import MouseTracker

# How long a key counts as held: longer than the pause between repeats, shorter than a stride.
HELD_S = 0.15
CELL = (8.0, 16.0)  # a character's size in pixels, about
MOUSE_ON, MOUSE_OFF = "\x1b[?1002h\x1b[?1006h", "\x1b[?1006l\x1b[?1002l"
_MAX_PENDING = 64

_MOUSE = re.compile(rb"\x1b\[<(\d{1,4});(\d{1,5});(\d{1,5})([Mm])")
_ARROWS = {b"A": "up", b"B": "down", b"C": "right", b"D": "left"}
_BUTTONS = {0: 0, 1: 2, 2: 1}  # a terminal's left, middle, right
_SHIFT, _CTRL, _MOTION, _WHEEL = 4, 16, 32, 64


class TerminalEvents:
    """Turns a terminal's bytes into a tracker's events."""

    def __init__(self, tracker: MouseTracker):
        self.tracker = tracker
        self._pending = b""
        self._until: dict[str, float] = {}
        self._cell: tuple[int, int] | None = None

    def feed(self, data: bytes, now: float) -> None:
        """Take what came, in whatever pieces, and let go of keys that were held long enough."""
        for key in [key for key, until in self._until.items() if now >= until]:
            del self._until[key]
            self.tracker.key(key, False)
        data = self._pending + data
        while data:
            if data[:1] != b"\x1b":
                self._character(chr(data[0]), now)
                data = data[1:]
            elif mouse := _MOUSE.match(data):
                self._mouse(*map(int, mouse.groups()[:3]), released=mouse[4] == b"m")
                data = data[mouse.end() :]
            elif data[:2] == b"\x1b[" and data[2:3] in _ARROWS:
                self._hold(_ARROWS[data[2:3]], now)
                data = data[3:]
            elif data in (b"\x1b", b"\x1b[") or (data[:3] == b"\x1b[<" and not re.search(rb"[Mm]", data)):
                break
            else:  # a sequence that is none of ours
                data = data[1:]
        self._pending = data if len(data) < _MAX_PENDING else b""

    def _character(self, character: str, now: float) -> None:
        if character.isalnum():
            if character.isupper():
                self._hold("shift", now)
            self._hold(character.lower(), now)

    def _hold(self, key: str, now: float) -> None:
        if key not in self._until:
            self.tracker.key(key, True)
        self._until[key] = now + HELD_S

    def _mouse(self, code: int, column: int, row: int, released: bool) -> None:
        self.tracker.key("ctrl", bool(code & _CTRL))
        if code & _WHEEL:
            self.tracker.scroll(-1.0 if code & 1 else 1.0)
            return
        if self._cell is not None and code & _MOTION:
            columns, rows = column - self._cell[0], row - self._cell[1]
            self.tracker.move(columns * CELL[0], rows * CELL[1])
        self._cell = (column, row)
        if not code & _MOTION and (code & 3) in _BUTTONS:
            self.tracker.button(_BUTTONS[code & 3], not released)


@contextlib.contextmanager
def terminal_input() -> Iterator[object]:
    """A callable that returns what was typed and moved since its last call, without waiting.

    The terminal gives every key at once and reports its mouse as long as this lasts. Where stdin is no
    terminal the callable returns nothing.
    """
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        yield lambda: b""
        return
    import termios  # no Windows
    import tty

    handle = sys.stdin.fileno()
    before = termios.tcgetattr(handle)
    try:
        tty.setcbreak(handle)
        sys.stdout.write(MOUSE_ON)
        sys.stdout.flush()
        yield lambda: os.read(handle, 4096) if select.select([handle], [], [], 0)[0] else b""
    finally:
        sys.stdout.write(MOUSE_OFF)
        sys.stdout.flush()
        termios.tcsetattr(handle, termios.TCSADRAIN, before)
