"""A rig on this machine's screens: a window for each wall, all drawn from the same eye images."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from statistics import median
from typing import Any

import persp_sw as psw

from ..frame import Frame
from ..loop import Loop
from ..present import Composer
from ..screen.events import Event, Key, asks_to_end
from ..screen.eye_target import EyeTarget
from ..trackers import MouseTracker
from ..window import Window, Windows
from .tracker_events import TrackerEvents

QUALITY_STEP = 2**0.25


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
        self.targets = {}

    def draw(self, frame: Frame, channels: Sequence[str], mode: str, warp: Any, background: Any) -> None:
        """Draw a frame's pictures of this wall into the window, in its mode; not yet shown."""
        self.window.make_current()
        views = {p.eye: p.view for p in frame.pictures if p.wall.name == self.rig_wall.name}
        for eye in dict.fromkeys(channels):
            target = self.targets.get(eye)
            if target is None:
                target = self.targets[eye] = EyeTarget(self.rig_wall.wall.pixels)
            with target.drawing():
                if eye in views:  # none where an eye is in the wall's plane
                    warp.draw_view(views[eye], eye)
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
            self.composer.close()
            self.window.close()


class WindowLoop:
    """Draws until the user ends it.

    Parameters
    ----------
    background
        Linear colour behind the volume.
    """

    def __init__(self, loop: Loop, background: Sequence[float] = (0, 0, 0)):
        self.loop, self.background = loop, background
        self.ended = False
        self.frame_ms: list[float] = []
        self.stages: dict[str, list[float]] = {
            "composite_ms": [],
            "upload_ms": [],
            "warp_ms": [],
            "swap_ms": [],
        }
        self.compositings = 0
        self._quality = loop.renderer.settings.quality
        walks = isinstance(loop.tracker, MouseTracker)
        self._events = TrackerEvents(loop.tracker) if walks else None

    def run(self, frames: int | None = None) -> None:
        """Show so many frames, or until escape or a window is closed."""
        with Windows() as windows:
            walls: list[WallWindow] = []
            warp = psw.TextureWarp()
            try:
                walls += [WallWindow(windows, self.loop, n) for n in range(len(self.loop.rig.walls))]
                while not self.ended and (frames is None or len(self.frame_ms) < frames):
                    start = time.perf_counter()
                    for event in windows.poll():
                        self.handle(event)
                    self._show(windows, walls, warp)
                    self.frame_ms.append(1e3 * (time.perf_counter() - start))
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
            self._set_quality(loop.renderer.settings.quality * QUALITY_STEP)
        elif key in ("-", "KP_SUBTRACT"):
            self._set_quality(loop.renderer.settings.quality / QUALITY_STEP)
        elif key == "0":
            self._set_quality(self._quality)
        elif key == "V":
            loop.put_back()
        else:
            return False
        return True

    def _set_quality(self, quality: float) -> None:
        limits = self.loop.rig.quality
        quality = min(max(quality, limits.min_quality), max(limits.max_quality, self._quality))
        self.loop.renderer.settings = replace(self.loop.renderer.settings, quality=quality)

    def _show(self, windows: Windows, walls: Sequence[WallWindow], warp: Any) -> None:
        now = time.monotonic()
        frame = self.loop.frame(now, now + 1 / self.loop.rig.quality.target_hz)
        self.compositings = max(self.compositings, frame.compositings)
        self.stages["composite_ms"].append(sum(s["composite_ms"] for s in frame.statistics.values()))
        clock = [time.perf_counter()]
        drawn = [wall for wall in walls if wall.window.is_drawn]
        if drawn:
            drawn[0].window.make_current()
            for eye, image in frame.images.items():
                warp.upload(image, eye)
        clock.append(time.perf_counter())
        for wall in drawn:
            stereo = self.loop.stereo[wall.rig_wall.name]
            wall.draw(frame, stereo.channels, stereo.shown_mode, warp, self.background)
        clock.append(time.perf_counter())
        windows.swap()
        clock.append(time.perf_counter())
        for name, begin, end in zip(("upload_ms", "warp_ms", "swap_ms"), clock, clock[1:], strict=False):
            self.stages[name].append(1e3 * (end - begin))


def run_windows(
    loop: Loop, warp: str, background: Sequence[float], frames: int | None, title: str
) -> dict[str, Any]:
    """Show a rig until the user ends it; medians of what frames cost, the first left out.

    OpenGL draws while the program goes on: what `warp_ms` has not, `swap_ms` waits for.
    """
    if warp == "software":
        raise psw.PerspSWError("windows are drawn by OpenGL: leave --warp software out, or use --offscreen")
    shown = WindowLoop(loop, background)
    with suppress(KeyboardInterrupt):  # Ctrl-C in the terminal ends it as escape does
        shown.run(frames)
    times = shown.frame_ms[1:] or shown.frame_ms or [0.0]
    return {
        "warp": "texture",
        "walls": [wall.name for wall in loop.rig.walls],
        "ms": median(times),
        **{name: median(spent[1:] or spent or [0.0]) for name, spent in shown.stages.items()},
        "compositings_per_frame": shown.compositings,
        "timed_frames": len(times),
        "outside_frames": loop.outside.frames if loop.outside else 0,
        "edge_on_frames": loop.edge_on,
    }
