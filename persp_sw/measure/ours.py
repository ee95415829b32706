"""This renderer as a contestant: one group of settings on one scene."""

from __future__ import annotations

from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

from ..arrays import Image
from ..geometry.view import View
from ..renderer import Renderer
from ..settings import Settings
from ..warp.canvas import Canvas
from .cases import Stage
from .memory import peak_bytes, restart_peak
from .waste import samples_that_count

_COUNTS = "faces", "intermediate_size", "samples_per_interval", "preintegrated", "samples", "runs_bytes"


@dataclass(eq=False)
class Ours:
    """A `timing.Contestant`; several may share a renderer, whose settings it sets for its turn."""

    renderer: Renderer
    settings: Settings
    once: dict[str, float] = field(default_factory=lambda: {"encode_ms": 0.0, "compile_ms": 0.0})
    _canvas: Canvas | None = None

    def prepare(self, view: View) -> None:
        """A frame to warm up; what is encoded or compiled now is counted in `once`."""
        self.picture(view)
        for name in self.once:
            self.once[name] += self.renderer.last[name]

    def draw(self, view: View) -> dict[str, float]:
        """One frame: compositing and warp on the processor."""
        if self._canvas is None or self._canvas.pixels.shape[1::-1] != view.size:
            self._canvas = Canvas(*view.size)
        start = perf_counter()
        self.renderer.render(view, self._canvas)
        ms = 1e3 * (perf_counter() - start)
        last = self.renderer.last
        return {"ms": ms, "composite_ms": last["composite_ms"], "warp_ms": last["warp_ms"]}

    def picture(self, view: View) -> Image:
        """The picture that is judged."""
        self.renderer.settings = self.settings
        return self.renderer.render(view)

    def counts(self, stage: Stage, view: View, waste: bool = True) -> dict[str, Any]:
        """Work and memory for one view: samples, waste (if wanted), faces, bytes."""
        self.renderer.settings = self.settings
        afresh = restart_peak()
        eye_image = self.renderer.composite(view.eye, [view.wall])
        self.renderer.warp(eye_image, view)
        last, peak = dict(self.renderer.last), peak_bytes()
        report = {name: last[name] for name in _COUNTS}
        if waste:
            needed = samples_that_count(
                eye_image, [view.wall], stage.volume, stage.transfer, self.settings, stage.regions
            )
            report["needed_samples"] = round(needed)
            report["waste"] = last["samples"] / needed if needed else None
        return {
            **report,
            "dense_bytes": stage.volume.data.nbytes,
            "peak_bytes": peak,
            "peak_of": "frame" if afresh else "process",
        }
