"""The preview in a window: events in, frames out, until the user has seen enough."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from pathlib import Path
from time import perf_counter
from typing import Any

from persp_sw.errors import PerspSWError

from ..screen.events import Button, Closing, Event, Focus, Key, Pointer, Resized, Wheel
from ..window import Windows
from .controller import Preview
from .figures import Rate
from .pictures import PreviewPictures
from .run import Run, Screenshots, texts

_FRAMES_FOR_A_RATE = 3
_REST_SECONDS = 0.25  # how long nothing happens before we look again whether something did
_log = logging.getLogger("persp_sw")


def feed(preview: Preview, events: Iterable[Event]) -> None:
    """Tell the controller what happened to the window."""
    for event in events:
        if isinstance(event, Key):
            preview.key(event.name, event.down, shift=event.shift, control=event.control)
        elif isinstance(event, Pointer):
            preview.pointer(event.x, event.y)
        elif isinstance(event, Button):
            preview.button(event.name, event.down, shift=event.shift, control=event.control)
        elif isinstance(event, Wheel):
            preview.wheel(event.notches, shift=event.shift)
        elif isinstance(event, Resized):
            preview.resize(event.width, event.height)
        elif isinstance(event, Closing):
            preview.finished = True
        elif isinstance(event, Focus) and not event.gained:
            preview.let_go()


def run_window(
    preview: Preview,
    pictures: PreviewPictures,
    *,
    folder: Path,
    name: str,
    frames: int | None = None,
    turn: float = 0.0,
    warp: str = "auto",
) -> Run:
    """Show the preview in a window until the user leaves, or for so many frames.

    Frames are drawn while something moves; at rest the program waits.

    Parameters
    ----------
    turn
        Radians to orbit by from frame to frame; 0: hands alone move the view.
    warp
        "texture", "software", or "auto": the faster one, measured on the first frame.

    Raises
    ------
    PerspSWError
        No window can be opened.
    """
    with Windows() as windows:
        window = windows.open(
            name,
            None,
            preview.size,
            f"{name}: persp-sw view",
            quad_buffered=preview.choices.stereo.mode == "quad",
        )
        from .screen import PreviewScreen  # OpenGL: now there is a context

        screen = PreviewScreen(pictures, "texture" if warp == "auto" else warp)
        try:
            preview.resize(*window.size)
            preview.choices.quad_buffers = screen.has_quad_buffers
            if missing := preview.choices.say_missing_quad_buffers():
                _log.warning("%s", missing)
            pictures.progress = lambda done, total, what: window.set_title(
                f"{name}: {what}, {100 * done // max(total, 1)} %"
            )
            return _loop(
                preview,
                pictures,
                screen,
                windows,
                window,
                Screenshots(preview, pictures, folder, name),
                frames,
                turn,
                warp,
            )
        finally:
            if window.is_open:
                window.make_current()
                screen.close()


def _loop(preview, pictures, screen, windows, window, shots, frames, turn, warp) -> Run:
    rows: list[dict[str, Any]] = []
    rate, kind, title, failed = Rate(), None, f"{window.name}: persp-sw view", set()
    wait = 0.0
    while not preview.finished and (frames is None or len(rows) < frames):
        feed(preview, windows.poll(wait))
        if rows and turn:
            preview.orbit(turn)
        start = perf_counter()
        wanted = preview.advance(start)
        # A rate is known, and shown, after a few frames of one kind.
        needed = wanted.moving or frames is not None or rate.count < _FRAMES_FOR_A_RATE
        if not window.is_drawn or not needed:
            wait = _REST_SECONDS
            continue
        wait = 0.0
        if kind != (kind := (wanted.outside, wanted.stereo, wanted.quality, wanted.preset, wanted.size)):
            rate.clear()
        try:
            done = pictures.composite(wanted)
            window.make_current()
            if warp == "auto":
                warp = screen.choose_warp(wanted, done)
            figures = screen.draw(
                wanted, done, lambda s, wanted=wanted: texts(wanted, s, rate), first_row=window.first_row
            )
            windows.swap()
            shots.write_if_asked(wanted)
        except PerspSWError as error:  # a place that has no picture: the next one may have
            if type(error) not in failed:
                failed.add(type(error))
                _log.warning("%s", error)
            preview.say(str(error))
            wait = _REST_SECONDS
            continue
        if figures["encode_ms"]:
            window.set_title(title)
        rate.add(perf_counter() - start)
        rows.append({"ms": 1e3 * (perf_counter() - start), **figures})
    return Run(rows, shots.written)
