"""The preview in a window: events in, frames out, until the user has seen enough.

While something moves, eye images are composited in turn with drawing, as well as the frame rate allows. At
rest a thread refines them, so that hands are answered at once: the loop goes on looking for events, and what
is under way is given up when something moves. What the user edits in the panel is encoded and composited in a
thread, too, always the newest edit, while the last picture and the panel stay in hand.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterable
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from persp_sw.errors import PerspSWError

from ..record import FrameClock
from ..screen.events import Button, Closing, Event, Focus, Key, Pointer, Resized, Wheel
from ..window import Window, Windows
from .background import Background
from .controller import Preview
from .figures import Rate
from .laid_over import Opener, PanelSlot
from .pictures import Composited, PreviewPictures
from .recorder import Recorder
from .run import Run, Screenshots, texts
from .wanted import Wanted

if TYPE_CHECKING:
    from .screen import PreviewScreen

_FRAMES_FOR_A_RATE = 3
_REST_SECONDS = 0.25  # how long nothing happens before we look again whether something did
_REFINING_SECONDS = 0.01  # how long before we look again whether a better picture is finished
# How long an edit's picture is waited for before the panel is drawn without it: a frame of both is half the
# work of two, and the thread has the processor to itself.
_EDITING_SECONDS = 0.08
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
    recorder: Recorder | None = None,
    open_panel: Opener | None = None,
    keepsakes: Screenshots | None = None,
) -> Run:
    """Show the preview in a window until the user leaves, or for so many frames.

    Frames are drawn while something moves; at rest they are refined, then the program waits.

    Parameters
    ----------
    frames
        Composited and drawn, whether anything moves or not.
    turn
        Radians to orbit by from frame to frame; 0: hands alone move the view.
    warp
        "texture", "software", or "auto": the faster one, measured on the first frame.
    recorder
        Takes each frame.
    open_panel
        Makes the panel when it is first shown; None: there is none.
    keepsakes
        Writes what the user asks for; None: pictures alone.

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
            shots = keepsakes or Screenshots(preview, pictures, folder, name)
            panel = PanelSlot(preview.choices, window, open_panel)
            recorder = recorder or Recorder()
            loop = PreviewLoop(preview, pictures, screen, windows, window, shots, recorder, panel)
            loop.choose_warp = warp == "auto"
            return loop.run(frames, turn)
        finally:
            if window.is_open:
                window.make_current()
                screen.close()


class PreviewLoop:
    """Turns of a preview in one window; each looks for events, then does what is most urgent.

    Attributes
    ----------
    rows
        Figures of each frame that was composited in turn.
    wait_s
        How long the next turn may wait for events.
    background
        What is made in a thread meanwhile.
    choose_warp
        Measure which warp is faster, once.
    """

    def __init__(
        self,
        preview: Preview,
        pictures: PreviewPictures,
        screen: PreviewScreen,
        windows: Windows,
        window: Window,
        shots: Screenshots,
        recorder: Recorder,
        panel: PanelSlot | None = None,
    ):
        self.preview, self.pictures, self.screen = preview, pictures, screen
        self.windows, self.window = windows, window
        self.rows: list[dict[str, Any]] = []
        self.wait_s, self.choose_warp = 0.0, False
        self._shots, self._recorder = shots, recorder
        self._panel = panel or PanelSlot(preview.choices, window, None)
        self._rate = Rate()
        self._shown: Composited | None = None
        self._shown_for: tuple[object, ...] = ()  # `Wanted.eye_images`
        self.background = Background(pictures)
        self._clock = FrameClock()
        self._kind: object = None
        self._failed: set[type] = set()
        self._title = f"{window.name}: persp-sw view"
        pictures.progress = self._say_progress

    def run(self, frames: int | None = None, turn: float = 0.0) -> Run:
        """Until the user leaves, or for so many composited frames."""
        try:
            while not self.preview.finished and (frames is None or len(self.rows) < frames):
                feed(self.preview, self._left_by_panel(self.windows.poll(self.wait_s)))
                if self.rows and turn:
                    self.preview.orbit(turn)
                self.turn(self.preview.advance(monotonic()), always=frames is not None)
        finally:
            self.background.give_up()
            self._panel.close()
        return Run(self.rows, self._shots.written)

    def _left_by_panel(self, events: list[Event]) -> list[Event]:
        panel = self._panel.shown
        return events if panel is None else panel.take(events, self.preview.wanted)

    def turn(self, wanted: Wanted, always: bool = False) -> None:
        """Composite and show a frame, or refine the one shown, or do nothing and let the next turn wait.

        Parameters
        ----------
        always
            Composite, though nothing has changed.
        """
        self.wait_s = 0.0
        kind = (wanted.outside, wanted.stereo, wanted.quality, wanted.preset, wanted.size)
        try:
            if not self.window.is_drawn:
                self.background.give_up()
                self._pause(_REST_SECONDS)
                return
            if kind != self._kind:
                self._kind = kind
                self._rate.clear()
            # A rate is known, and shown, after a few frames of one kind.
            rated = self._rate.count >= _FRAMES_FOR_A_RATE
            edited = rated and not always and wanted.differs_by_edits_alone(self._shown_for)
            if edited and self.preview.choices.panel:
                self._edit(wanted)
            elif always or not rated or wanted.eye_images != self._shown_for:
                self._composite(wanted)
            elif wanted.moving or self._panel.wants_frame:  # texts
                self._show(wanted, self._shown, is_new=False)
            else:
                self._refine(wanted)
        except PerspSWError as error:  # a place that has no picture: the next one may have
            if type(error) not in self._failed:
                self._failed.add(type(error))
                _log.warning("%s", error)
            self.preview.say(str(error))
            self._pause(_REST_SECONDS)

    def _composite(self, wanted: Wanted) -> None:
        self.background.give_up()
        begin = monotonic()
        done = self.pictures.composite(wanted)
        figures = self._show(wanted, done, begin=begin)
        seconds = monotonic() - begin
        self._rate.add(seconds)
        self.rows.append({"ms": 1e3 * seconds, **figures})

    def _edit(self, wanted: Wanted) -> None:
        """Have the newest edit's picture made, show those that are finished, and the panel meanwhile."""
        edited = self.background.edited(wanted, _EDITING_SECONDS)
        if edited is not None and edited.done is not self._shown:
            self._show(wanted, edited.done, of=edited.wanted)
        elif wanted.moving or self._panel.wants_frame:
            self._show(wanted, self._shown, is_new=False)

    def _refine(self, wanted: Wanted) -> None:
        """Show a better picture where there is one, and have the next one made."""
        if self.background.is_refining:
            self._pause(_REFINING_SECONDS)
            return
        better = self.background.refined()
        if better is not None and better.done is not self._shown:
            self._show(wanted, better.done)
        elif self.pictures.is_refined(wanted):
            self.background.give_up()
            self._pause(_REST_SECONDS)
        else:
            self.background.refine(wanted)
            self._pause(_REFINING_SECONDS)

    def _show(
        self,
        wanted: Wanted,
        done: Composited,
        *,
        begin: float | None = None,
        is_new: bool = True,
        of: Wanted | None = None,
    ) -> dict[str, Any]:
        """Draw it; its figures.

        `begin`: of its compositing, if the display waited for that. `of`: what it was composited for, where
        that is not what is wanted now.
        """
        self.window.make_current()
        if self.choose_warp:
            self.screen.choose_warp(wanted, done)
            self.choose_warp = False
        start = monotonic()
        figures = self.screen.draw(
            wanted, done, lambda s: texts(wanted, s, self._rate), first_row=self.window.first_row
        )
        panel = self._panel.shown
        if panel is not None:
            panel.draw()
        # Whoever asks what drawing takes has to wait for it: OpenGL draws while the program goes on.
        if self.pictures.target_hz > 0 or self._recorder.is_on:
            self.screen.finish()
        drawn = monotonic()
        self.windows.swap()
        end = monotonic()
        upload_ms = figures["upload_ms"]
        warp_ms = 1e3 * (drawn - start) - upload_ms  # texts and all
        times = self._clock.take(
            start if begin is None else begin, end, upload_ms, warp_ms, 1e3 * (end - drawn)
        )
        self._recorder.add(done, times, is_new=is_new)
        if is_new:
            self.pictures.drawn(wanted, done, upload_ms, warp_ms)  # a swap does nothing but wait
            self._shown, self._shown_for = done, (of or wanted).eye_images
            if panel is not None:
                panel.tell(figures, end - (start if begin is None else begin))
        self.preview.choices.drawn_quality = figures["quality"]
        if figures["encode_ms"]:
            self.window.set_title(self._title)
        if self._shots.asked():  # two threads must not work with one renderer
            self.background.give_up()
        self._shots.write_if_asked(wanted, done)
        return figures

    def _pause(self, seconds: float) -> None:
        """Nothing to do for so long."""
        self.wait_s = seconds
        self._clock.pause()

    def _say_progress(self, done: int, total: int, what: str) -> None:
        if threading.current_thread() is threading.main_thread():  # windows belong to it
            self.window.set_title(f"{self.window.name}: {what}, {100 * done // max(total, 1)} %")
