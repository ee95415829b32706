"""A rig without a screen: the same loop on a counted clock, its pictures as arrays, its costs as figures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np

import persp_sw as psw

from ..frame import Frame
from ..loop import Loop
from ..record import Times, record_of
from ..shown import Shown
from .wall_pictures import Drawer, Drawn


@dataclass
class Costs:
    """What the timed frames cost, milliseconds; one number a frame, warm-up left out.

    Attributes
    ----------
    ms
        The whole frame: pose, compositings, uploads, warps.
    composite_ms, upload_ms
        Of all eyes.
    warp_ms
        By (wall, eye).
    separate_ms
        Rendering every picture by itself, a compositing for each; empty where not asked for.
    encode_ms, compile_ms
        Sums over all frames, the warm-up included.
    """

    ms: list[float] = field(default_factory=list)
    composite_ms: list[float] = field(default_factory=list)
    upload_ms: list[float] = field(default_factory=list)
    warp_ms: dict[tuple[str, str], list[float]] = field(default_factory=dict)
    separate_ms: list[float] = field(default_factory=list)
    compositings: list[int] = field(default_factory=list)
    samples: list[int] = field(default_factory=list)
    encode_ms: float = 0.0
    compile_ms: float = 0.0

    def add(self, frame: Frame, drawn: Drawn, ms: float) -> None:
        """A timed frame."""
        self.ms.append(ms)
        cost = frame.cost()
        self.composite_ms.append(cost.ms)
        self.upload_ms.append(drawn.upload_ms)
        for key, spent in drawn.warp_ms.items():
            self.warp_ms.setdefault(key, []).append(spent)
        self.compositings.append(frame.compositings)
        self.samples.append(int(cost.samples))

    def report(self) -> dict[str, Any]:
        """Medians, as `--json` has them."""
        values = {
            "ms": median(self.ms),
            "ms_p95": float(np.quantile(self.ms, 0.95)),
            "composite_ms": median(self.composite_ms),
            "upload_ms": median(self.upload_ms),
            "warp_ms": median(map(sum, zip(*self.warp_ms.values(), strict=True))) if self.warp_ms else 0.0,
            "encode_ms": self.encode_ms,
            "compile_ms": self.compile_ms,
            "compositings_per_frame": max(self.compositings),
            "samples": int(median(self.samples)),
            "timed_frames": len(self.ms),
        }
        if self.separate_ms:
            values["separate_ms"] = median(self.separate_ms)
            values["separate_ratio"] = values["separate_ms"] / values["ms"]
        return values


def run_offscreen(
    loop: Loop,
    drawer: Drawer,
    frames: int,
    *,
    rate_hz: float = 60.0,
    start_s: float = 0.0,
    separate: bool = False,
    each: Callable[[int, Frame, Drawn], None] = lambda number, frame, drawn: None,
    trace: psw.TraceWriter | None = None,
    progress: Callable[[int, int, str], None] = lambda done, total, what: None,
) -> tuple[Costs, Frame, Drawn]:
    """Frame 0, which warms up, then `frames` timed ones, 1 / rate_hz seconds of the counted clock apart.

    Parameters
    ----------
    start_s
        Time of frame 0, seconds.
    separate
        Also time each picture as a view of its own, software warp.
    each
        Gets every timed frame and its pictures, which are valid until it returns.
    trace
        Takes a record of each timed frame; its target is a period of `rate_hz`.

    Returns
    -------
    Costs, and the last frame with its pictures.
    """
    costs = Costs()
    canvases: dict[tuple[str, str], psw.Canvas] = {}
    for number in range(frames + 1):
        begin, now = perf_counter(), start_s + number / rate_hz
        frame = loop.frame(now)
        drawn = drawer.draw(frame)
        ms = 1e3 * (perf_counter() - begin)
        warp_ms = sum(drawn.warp_ms.values())
        loop.steady.drawn(frame, drawn.upload_ms, warp_ms)
        for statistics in frame.statistics.values():
            costs.encode_ms += statistics["encode_ms"]
            costs.compile_ms += statistics["compile_ms"]
        if number:
            costs.add(frame, drawn, ms)
            if trace is not None:
                times = Times(now, now, drawn.upload_ms, warp_ms, 0.0, ms)
                shown = Shown(frame, frame.moment)
                trace.write(record_of(number - 1, shown, times, 1e3 / rate_hz, on_display=False))
            each(number, frame, drawn)
        if separate:
            spent = _separately(loop.renderer, frame, canvases)
            if number:
                costs.separate_ms.append(spent)
        progress(number + 1, frames + 1, "frames")
    return costs, frame, drawn


def _separately(renderer: psw.Renderer, frame: Frame, canvases: dict[tuple[str, str], psw.Canvas]) -> float:
    """Milliseconds that a frame's pictures take, each as a view of its own."""
    for picture in frame.pictures:
        key = picture.wall.name, picture.eye
        if key not in canvases or canvases[key].pixels.shape[1::-1] != picture.view.size:
            canvases[key] = psw.Canvas(*picture.view.size)
    begin = perf_counter()
    for picture in frame.pictures:
        renderer.render(picture.view, canvases[picture.wall.name, picture.eye])
    return 1e3 * (perf_counter() - begin)


def errors(
    renderer: psw.Renderer,
    frame: Frame,
    drawn: Drawn,
    progress: Callable[[int, int, str], None] = lambda done, total, what: None,
) -> dict[tuple[str, str], dict[str, float]]:
    """By (wall, eye): the largest and mean absolute and the rms difference to the float64 reference."""
    result = {}
    for number, picture in enumerate(frame.pictures):
        progress(number, len(frame.pictures), "reference")
        truth = psw.reference.render(
            renderer.volume,
            renderer.transfer,
            picture.view,
            regions=renderer.regions,
            look=renderer.look,
        )
        difference = np.abs(drawn.pictures[picture.wall.name, picture.eye] - truth)
        result[picture.wall.name, picture.eye] = {
            "max_error": float(difference.max()),
            "mean_error": float(difference.mean()),
            "rms_error": float(np.sqrt(np.mean(difference**2))),
        }
    progress(len(frame.pictures), len(frame.pictures), "reference")
    return result
