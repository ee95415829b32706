"""A rig on this machine's screens: a window for each wall, all drawn from the same eye images."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from itertools import pairwise
from statistics import median
from typing import Any

import persp_sw as psw

from ..beside import Beside
from ..frame import Frame, Picture
from ..loop import Loop
from ..marks.shapes import MarkShapes
from ..present import Composer
from ..record import FrameClock, record_of
from ..screen.events import Event, Key, asks_to_end
from ..screen.eye_target import EyeTarget
from ..screen.shapes import Shapes
from ..shown import InTurn, Source
from ..trackers import MouseTracker
from ..window import Window, Windows
from .tracker_events import TrackerEvents
from .wall_marks import WallMarks

QUALITY_STEP = 2**0.25
_PATIENCE_S = 0.002
_UNSYNCED_MS = 1.0
_RECORDS = 1000


class WallWindow:
    """One wall's window and what it draws with; OpenGL objects of its own context."""

    def __init__(self, windows: Windows, loop: Loop, number: int):
        self.rig_wall = loop.rig.walls[number]
        quad = self.rig_wall.stereo == "quad"
        pixels = self.rig_wall.wall.pixels
        self.window: Window = windows.open(
            self.rig_wall.name, self.rig_wall.window, pixels, quad_buffered=quad
        )
        self.composer = Composer()
        self.shapes = Shapes()
        self.marks = MarkShapes(self.shapes)
        self.targets = {}

    def draw(
        self,
        pictures: Sequence[Picture],
        channels: Sequence[str],
        mode: str,
        warp: Any,
        background: Any,
        marks: WallMarks,
    ) -> None:
        """Draw the pictures of this wall into the window, in its mode; not yet shown."""
        self.window.make_current()
        own = {p.eye: p for p in pictures if p.wall.name == self.rig_wall.name}
        for eye in dict.fromkeys(channels):
            target = self.targets.get(eye)
            if target is None:
                target = self.targets[eye] = EyeTarget(self.rig_wall.wall.pixels)
            with target.drawing():
                if eye in own:  # none where an eye is in the wall's plane
                    view = own[eye].view
                    warp.draw_view(view, eye)
                    if (veiled := marks.seen(own[eye])) is not None:
                        self.marks.draw(veiled, view, view.size)
        left, right = (self.targets[eye] for eye in channels)
        self.composer.compose(
            left, right, mode, self.window.size, background=background, first_row=self.window.first_row
        )

    def close(self) -> None:
        """Delete its OpenGL objects, then the window."""
        if self.window.is_open:
            self.window.make_current()
            for target in self.targets.values():
                target.close()
            for part in (self.composer, self.marks, self.shapes):
                part.close()
            self.window.close()


class WindowLoop:
    """Draws until the user ends it.

    Parameters
    ----------
    source
        Where frames come from: composited in turn with drawing, or beside it.
    background
        Linear colour behind the volume.
    trace
        Takes a record of each frame.
    marks
        On the walls; None: none, until the wand picks.

    Attributes
    ----------
    records
        Of the last frames.
    frames, missed, compositings
        Frames shown, refreshes missed, the most eye images composited for one frame.
    """

    def __init__(
        self,
        loop: Loop,
        source: Source,
        background: Sequence[float] = (0, 0, 0),
        trace: psw.TraceWriter | None = None,
        marks: WallMarks | None = None,
    ):
        self.marks = marks or WallMarks(loop, psw.marks.MarkChoice(), background)
        self.loop, self.source, self.background, self.trace = loop, source, background, trace
        self.ended = False
        self.records: deque[psw.FrameRecord] = deque(maxlen=_RECORDS)
        self.frames = self.missed = self.compositings = 0
        # Whoever asks what drawing takes has to wait for it: OpenGL draws while the program goes on.
        self.timed = trace is not None or isinstance(source, InTurn)
        self.target_ms = 1e3 / loop.rig.quality.target_hz
        self._uploaded: Frame | None = None
        self._clock = FrameClock()
        walks = isinstance(loop.tracker, MouseTracker)
        self._events = TrackerEvents(loop.tracker) if walks else None

    def run(self, frames: int | None = None) -> None:
        """Show so many frames, or until escape or a window is closed."""
        with Windows() as windows:
            walls: list[WallWindow] = []
            warp = psw.TextureWarp()
            try:
                walls += [WallWindow(windows, self.loop, n) for n in range(len(self.loop.rig.walls))]
                while not self.ended and (frames is None or self.frames < frames):
                    for event in windows.poll():
                        self.handle(event)
                    self._show(windows, walls, warp)
            finally:
                if walls:
                    walls[0].window.make_current()
                    warp.close()
                for wall in reversed(walls):
                    wall.close()

    def handle(self, event: Event) -> None:
        """What a user does."""
        if asks_to_end(event):
            self.ended = True
        elif isinstance(event, Key) and event.down and not event.control and self._command(event.name):
            return
        elif self._events is not None:
            self._events.feed(event)

    def _command(self, key: str) -> bool:
        """Do what a key stands for; false for a key that is no command."""
        loop = self.loop
        if key == "X":
            loop.swap_eyes()
        elif key == "M":
            loop.toggle_mono()
        elif key in ("+", "=", "KP_ADD"):
            self._set_quality(QUALITY_STEP)
        elif key in ("-", "KP_SUBTRACT"):
            self._set_quality(1 / QUALITY_STEP)
        elif key == "0":
            loop.steady.held = None
        elif key == "V":
            loop.put_back()
        else:
            return False
        return True

    def _set_quality(self, factor: float) -> None:
        """Hold it by hand, from where it is."""
        steady, limits = self.loop.steady, self.loop.rig.quality
        quality = factor * (steady.held or self.loop.renderer.settings.quality)
        steady.held = min(max(quality, limits.min_quality), max(limits.max_quality, steady.base.quality))

    def _show(self, windows: Windows, walls: Sequence[WallWindow], warp: Any) -> None:
        begin = time.monotonic()
        shown = self.source.show(begin)
        if shown is None:  # the first frame is being composited
            time.sleep(_PATIENCE_S)
            return
        clock = [time.monotonic()]
        drawn = [wall for wall in walls if wall.window.is_drawn]
        if drawn and shown.frame is not self._uploaded:  # not `is_new`: no window may have been drawn then
            drawn[0].window.make_current()
            for eye, image in shown.frame.images.items():
                warp.upload(image, eye)
            self._uploaded = shown.frame
        clock.append(time.monotonic())
        pictures = shown.pictures
        self.marks.follow()
        for wall in drawn:
            stereo = shown.frame.moment.stereo[wall.rig_wall.name]
            wall.draw(pictures, stereo.channels, stereo.shown_mode, warp, self.background, self.marks)
            if self.timed:
                wall.composer.finish()
        clock.append(time.monotonic())
        windows.swap()
        clock.append(time.monotonic())
        upload_ms, warp_ms, swap_ms = (1e3 * (end - start) for start, end in pairwise(clock))
        self.source.drawn(shown, upload_ms, warp_ms)  # a swap does nothing but wait
        times = self._clock.take(begin, clock[-1], upload_ms, warp_ms, swap_ms)
        if swap_ms < _UNSYNCED_MS:
            # No display to wait for: more frames than are wanted would take the time of compositing.
            time.sleep(max(0.0, 1e-3 * self.target_ms - (clock[-1] - begin)))
        record = record_of(self.frames, shown, times, self.target_ms, on_display=True)
        self.records.append(record)
        self.frames += 1
        self.missed += record.missed
        self.compositings = max(self.compositings, record.compositings)
        if self.trace is not None:
            self.trace.write(record)


def run_windows(
    loop: Loop,
    warp: str,
    background: Sequence[float],
    frames: int | None,
    *,
    in_turn: bool = False,
    trace: psw.TraceWriter | None = None,
    marks: WallMarks | None = None,
) -> dict[str, Any]:
    """Show a rig until the user ends it; medians of what the last frames cost.

    With neither `in_turn` nor `trace` OpenGL draws while the program goes on: what `warp_ms` has not,
    `swap_ms` waits for.

    Parameters
    ----------
    in_turn
        Composite each frame before it is drawn, instead of beside the display.
    """
    if warp == "software":
        raise psw.PerspSWError("windows are drawn by OpenGL: leave --warp software out, or use --offscreen")
    period_s = 1 / loop.rig.quality.target_hz
    source = InTurn(loop, period_s) if in_turn else Beside(loop, period_s)
    shown = WindowLoop(loop, source, background, trace, marks)
    with suppress(KeyboardInterrupt), source:  # Ctrl-C in the terminal ends it as escape does
        shown.run(frames)
    records = list(shown.records)[1 if shown.frames <= _RECORDS else 0 :] or shown.records
    return {
        "warp": "texture",
        "walls": [wall.name for wall in loop.rig.walls],
        **{name: _median(records, name) for name in ("composite_ms", "upload_ms", "warp_ms", "swap_ms")},
        "ms": _median(records, "frame_ms"),
        "compositings_per_frame": shown.compositings,
        "timed_frames": len(records),
        "missed_frames": shown.missed,
        "outside_frames": loop.outside.frames if loop.outside else 0,
        "edge_on_frames": loop.edge_on,
    }


def _median(records: Sequence[psw.FrameRecord], name: str) -> float:
    values = [value for record in records if (value := getattr(record, name)) is not None]
    return median(values) if values else 0.0
