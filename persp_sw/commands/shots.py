"""One shot: a scene rendered and timed and, if wanted, held against the reference."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any, Protocol

import numpy as np

from .. import images, reference
from ..arrays import Image
from ..geometry.regions import Regions
from ..geometry.view import View
from ..measure.metrics import compare
from ..renderer import Renderer
from ..warp.canvas import Canvas
from .output import ProgressCall

_COUNTS = (
    "threads", "faces", "intermediate_size", "samples_per_interval", "preintegrated", "samples", "runs_bytes",
)  # fmt: skip
MIN_FRAMES = 3  # `max_seconds` never stops before


@dataclass
class Timing:
    """Times of the frames of one scene; frame 0, the warm-up, is not among `frame_ms`.

    Attributes
    ----------
    image
        The last frame's picture.
    last
        The renderer's statistics of that picture.
    first_ms
        The warm-up's wall time, encoding and compilation included.
    frame_ms, composite_ms, warp_ms
        One number a timed frame.
    encode_ms, compile_ms
        Sums over all frames, the warm-up too.
    """

    image: Image
    last: dict[str, Any]
    first_ms: float
    frame_ms: list[float] = field(default_factory=list)
    composite_ms: list[float] = field(default_factory=list)
    warp_ms: list[float] = field(default_factory=list)
    encode_ms: float = 0.0
    compile_ms: float = 0.0

    def report(self) -> dict[str, Any]:
        """The keys of `--json`: medians of the timed frames, and the last picture's counts."""
        last = self.last
        return {
            "ms": median(self.frame_ms),
            "ms_p95": float(np.quantile(self.frame_ms, 0.95)),
            "ms_max": max(self.frame_ms),
            "first_ms": self.first_ms,
            "timed_frames": len(self.frame_ms),
            "composite_ms": median(self.composite_ms),
            "warp_ms": median(self.warp_ms),
            "encode_ms": self.encode_ms,
            "compile_ms": self.compile_ms,
            **{key: last[key] for key in _COUNTS},
        }


class Draws(Protocol):
    """What makes pictures: a `Renderer`, or one with another warp."""

    last: dict[str, Any]

    def render(self, view: View, out: Canvas | None = None) -> Image:
        """As `Renderer.render`."""
        ...


def time_frames(renderer: Draws, views: Sequence[View], max_seconds: float | None = None) -> Timing:
    """Render `views[0]` to warm up, then time the others in order.

    Parameters
    ----------
    views
        At least two.
    max_seconds
        Stop once so much time has passed, though never before three frames; the last view is rendered in any
        case, since its picture is the one that counts.
    """
    start = perf_counter()
    image = renderer.render(views[0])
    timing = Timing(image, dict(renderer.last), 1e3 * (perf_counter() - start))
    timing.encode_ms, timing.compile_ms = timing.last["encode_ms"], timing.last["compile_ms"]
    begin, timed, canvas = perf_counter(), views[1:], Canvas(*views[-1].size)
    for number, view in enumerate(timed, 1):
        start = perf_counter()
        timing.image = renderer.render(view, canvas)
        timing.frame_ms.append(1e3 * (perf_counter() - start))
        timing.last = dict(renderer.last)
        timing.composite_ms.append(timing.last["composite_ms"])
        timing.warp_ms.append(timing.last["warp_ms"])
        timing.encode_ms += timing.last["encode_ms"]
        timing.compile_ms += timing.last["compile_ms"]
        if max_seconds is not None and number >= MIN_FRAMES and perf_counter() - begin > max_seconds:
            if number < len(timed):
                timing.image = renderer.render(timed[-1], canvas)
                timing.last = dict(renderer.last)
            break
    return timing


@dataclass
class Judgement:
    """A picture held against the converged one.

    Attributes
    ----------
    truth
        (h, w, 4) float64.
    figures
        psnr, psnr_covered, max_error, mean_signed_error, ssim, rms_error, p99_error, reference_ms.
    """

    truth: np.ndarray
    figures: dict[str, float]

    @classmethod
    def of(
        cls,
        image: Image,
        renderer: Renderer,
        view: View,
        *,
        regions: Regions,
        tolerance: float,
        threads: int | None,
        progress: ProgressCall,
    ) -> Judgement:
        """Cast the reference of the same view, and compare."""
        start = perf_counter()
        truth = reference.render(
            renderer.volume,
            renderer.transfer,
            view,
            regions=regions,
            look=renderer.look,
            tolerance=tolerance,
            threads=threads,
            progress=progress,
        )
        spent = 1e3 * (perf_counter() - start)
        return cls(truth, {"reference_ms": spent, **compare(image, truth)})


def write_judgement(
    out: Path, image: Image, judgement: Judgement, background: np.ndarray, scale: float | None = None
) -> dict[str, Any]:
    """Write OUT-reference.EXT and OUT-error.png beside OUT.EXT; gives their names and the map's scale."""
    truth_path = out.with_name(f"{out.stem}-reference{out.suffix}")
    error_path = out.with_name(f"{out.stem}-error.png")
    images.write(truth_path, judgement.truth, background)
    rgb, scale = images.error_map(image, judgement.truth, scale)
    images.write_rgb(error_path, rgb)
    return {"reference": str(truth_path), "error_map": str(error_path), "error_scale": scale}
