"""A virtual screen (Xvfb) for tests of windows, and hands for it."""

from __future__ import annotations

import ctypes
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from samples import ROOT

SCREEN = (1600, 1200)
SECONDS = 60  # that a program under test may take for a step; a hang is a failure


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    """The name of a virtual screen of 1600 × 1200 pixels, on a free number."""
    missing = [tool for tool in ("Xvfb", "xdotool") if not shutil.which(tool)]
    if missing:
        if os.environ.get("CI") == "true":
            pytest.fail(f"CI lacks {missing}")
        pytest.skip(f"no {' and '.join(missing)}: apt-get install xvfb xdotool")
    screen = f"{SCREEN[0]}x{SCREEN[1]}x24"
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", "1", "-screen", "0", screen, "-nolisten", "tcp", "-noreset"],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    try:
        number = server.stdout.readline().strip()
        assert number, "Xvfb did not start"
        yield f":{number}"
    finally:
        server.terminate()
        server.wait(SECONDS)
        server.stdout.close()


def environment(display: str | None, **more: str) -> dict[str, str]:
    """For a program on that screen, or on none; it draws with the processor."""
    dropped = (
        "DISPLAY",
        "WAYLAND_DISPLAY",
        "XDG_SESSION_TYPE",
        "PYOPENGL_PLATFORM",
        "PYGLFW_LIBRARY_VARIANT",
    )
    kept = {name: value for name, value in os.environ.items() if name not in dropped}
    kept |= {"PYTHONPATH": f"{ROOT}{os.pathsep}{ROOT / 'tests'}", "LIBGL_ALWAYS_SOFTWARE": "1"}
    return kept | ({"DISPLAY": display} if display else {}) | more


class Program:
    """A Python program on a virtual screen, which prints one JSON value a line."""

    def __init__(self, display: str | None, code: str, **more: str):
        self.display = display
        self._process = subprocess.Popen(
            [sys.executable, "-W", "error", "-c", code],
            env=environment(display, **more),
            cwd=ROOT,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def __enter__(self) -> Program:
        return self

    def __exit__(self, *_: object) -> None:
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait(SECONDS)
        self._process.stdout.close()
        self._process.stderr.close()

    def value(self) -> object:
        """What it prints next; a failure with its last words where it ends instead."""
        line = self._process.stdout.readline()
        if not line:
            pytest.fail(f"the program ended: {self._process.stderr.read()}")
        return json.loads(line)

    def until(self, wanted: str) -> list[dict]:
        """All events up to the first of this kind."""
        seen = []
        while not seen or seen[-1]["kind"] != wanted:
            seen.append(self.value())
        return seen

    def end(self) -> tuple[int, str]:
        """Its exit code and what it said on stderr, once it ends by itself."""
        _, words = self._process.communicate(timeout=SECONDS)
        return self._process.returncode, words

    def hand(self, *words: object) -> str:
        """What a hand does: xdotool's words."""
        arguments = [str(word) for word in words]
        return subprocess.run(
            ["xdotool", *arguments],
            env=environment(self.display),
            check=True,
            capture_output=True,
            text=True,
            timeout=SECONDS,
        ).stdout.strip()

    def window(self, title: str) -> str:
        """X's number of the window with this title."""
        return self.hand("search", "--sync", "--name", f"^{title}$").splitlines()[0]

    def focus(self, title: str) -> str:
        """Give the keyboard to a window: no window manager is there to do so."""
        end = time.monotonic() + SECONDS
        while True:
            number = self.window(title)
            try:
                self.hand("windowfocus", "--sync", number)
                break
            except subprocess.CalledProcessError:  # of the program before, and closed since it was found
                if time.monotonic() > end:
                    raise
                time.sleep(0.1)
        return number

    def grab(self, path: Path | None = None) -> np.ndarray:
        """What the screen shows: (height, width, 3) uint8."""
        from PIL import ImageGrab

        picture = ImageGrab.grab(xdisplay=self.display).convert("RGB")
        if path:
            picture.save(path)
        return np.asarray(picture)

    def press_close(self, title: str) -> None:
        """What a window manager does when the close button is pressed: xdotool destroys windows instead."""
        x11 = ctypes.CDLL("libX11.so.6")
        x11.XOpenDisplay.restype = ctypes.c_void_p
        x11.XInternAtom.restype = ctypes.c_ulong
        x11.XInternAtom.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int]
        x11.XSendEvent.argtypes = [
            ctypes.c_void_p,
            ctypes.c_ulong,
            ctypes.c_int,
            ctypes.c_long,
            ctypes.c_void_p,
        ]
        x11.XCloseDisplay.argtypes = [ctypes.c_void_p]
        display = x11.XOpenDisplay(self.display.encode())
        window = int(self.window(title))
        message = _ClientMessage(
            33, 0, 1, display, window, x11.XInternAtom(display, b"WM_PROTOCOLS", 0), 32,
            (ctypes.c_long * 5)(x11.XInternAtom(display, b"WM_DELETE_WINDOW", 0)),
        )  # fmt: skip
        event = (ctypes.c_long * 24)()
        ctypes.memmove(event, ctypes.byref(message), ctypes.sizeof(message))
        x11.XSendEvent(display, window, 0, 0, event)
        x11.XCloseDisplay(display)


class _ClientMessage(ctypes.Structure):
    """Xlib's XClientMessageEvent."""

    _fields_ = (
        ("type", ctypes.c_int),
        ("serial", ctypes.c_ulong),
        ("send_event", ctypes.c_int),
        ("display", ctypes.c_void_p),
        ("window", ctypes.c_ulong),
        ("message_type", ctypes.c_ulong),
        ("format", ctypes.c_int),
        ("data", ctypes.c_long * 5),
    )
