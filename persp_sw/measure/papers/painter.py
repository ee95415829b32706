"""Contestants that draw a frame of one or several eyes and walls with either warp."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any, Protocol

import numpy as np

from ...arrays import Image
from ...eye_image import EyeImage
from ...geometry.regions import Regions
from ...geometry.view import Eye, View, Wall
from ...renderer import Renderer
from ...settings import Settings
from ...warp.canvas import Canvas
from ..metrics import max_error, mean_signed_error, psnr, psnr_covered
from ..timing import time_in_turn
from ..truth import Truths

Frame = Sequence[tuple[Eye, Sequence[Wall]]]  # what is drawn at one moment: each eye once, with its walls
Row = dict[str, Any]


class Warp(Protocol):
    """A way from eye images to pictures."""

    name: str

    def begin(self, renderer: Renderer, image: EyeImage, slot: str) -> None:
        """Take an eye image; `draw` shows it. `slot` tells eyes apart."""

    def draw(self, view: View, slot: str) -> None:
        """Draw one picture of it."""

    def finish(self) -> None:
        """Return when all that was asked for is drawn."""

    def picture(self, view: View, slot: str) -> Image:
        """The picture `draw` makes, (h, w, 4) linear premultiplied; not timed."""


class SoftwareWarp:
    """The warp on the processor."""

    name = "software"

    def __init__(self) -> None:
        self._canvases: dict[tuple[str, Any], Canvas] = {}
        self._images: dict[str, tuple[Renderer, EyeImage]] = {}

    def begin(self, renderer: Renderer, image: EyeImage, slot: str) -> None:
        """See `Warp`; nothing has to be carried anywhere."""
        self._images[slot] = renderer, image

    def draw(self, view: View, slot: str) -> None:
        """See `Warp`; a wall's pictures are drawn on one canvas."""
        key = slot, (view.wall.name, view.size)
        canvas = self._canvases.get(key)
        if canvas is None:
            canvas = self._canvases[key] = Canvas(*view.size)
        renderer, image = self._images[slot]
        renderer.warp(image, view, canvas)

    def finish(self) -> None:
        """See `Warp`; it is finished at once."""

    def picture(self, view: View, slot: str) -> Image:
        """See `Warp`."""
        renderer, image = self._images[slot]
        return renderer.warp(image, view)


@dataclass(eq=False)
class Painter:
    """A `timing.Contestant` on a path of frames, which it takes by their number.

    Attributes
    ----------
    path
        The frames; the last one's pictures are judged.
    """

    renderer: Renderer
    settings: Settings
    warp: Warp
    path: Sequence[Frame]

    def prepare(self, view: int) -> None:
        """A frame to warm up: what is encoded, compiled or allocated is not timed."""
        self.draw(view)

    def draw(self, view: int) -> dict[str, float]:
        """One frame: `ms`, and of that `composite_ms` and `warp_ms`, which is upload and drawing."""
        self.renderer.settings = self.settings
        composite = warp = 0.0
        start = perf_counter()
        for number, (eye, walls) in enumerate(self.path[view]):
            began = perf_counter()
            image = self.renderer.composite(eye, walls)
            composited = perf_counter()
            self.warp.begin(self.renderer, image, str(number))
            for wall in walls:
                self.warp.draw(View(eye, wall), str(number))
            composite += composited - began
            warp += perf_counter() - composited
        began = perf_counter()
        self.warp.finish()
        end = perf_counter()
        times = {"ms": end - start, "composite_ms": composite, "warp_ms": warp + end - began}
        return {name: 1e3 * seconds for name, seconds in times.items()}

    def judge(self, truths: Truths) -> Row:
        """What the last frame's pictures are like: size of the eye image, errors of all together."""
        self.renderer.settings = self.settings
        pictures, exact, size = [], [], (0, 0)
        for number, (eye, walls) in enumerate(self.path[-1]):
            image = self.renderer.composite(eye, walls)
            size = max(size, tuple(self.renderer.last["intermediate_size"]), key=np.prod)
            self.warp.begin(self.renderer, image, str(number))
            for wall in walls:
                view = View(eye, wall)
                pictures.append(self.warp.picture(view, str(number)))
                exact.append(truths.of(self.renderer.volume, self.renderer.transfer, view, Regions()))
        image, truth = np.concatenate(pictures), np.concatenate(exact)
        return {
            "intermediate_size": list(size),
            **{name: self.renderer.last[name] for name in ("samples_per_interval", "preintegrated")},
            "psnr": psnr(image, truth),
            "psnr_covered": psnr_covered(image, truth),
            "mean_signed_error": mean_signed_error(image, truth),
            "max_error": max_error(image, truth),
        }


def measure(painters: Sequence[Painter], truths: Truths, seconds: float) -> list[Row]:
    """Errors and times of all, in turn on their paths, which are equally long."""
    rows = [
        {
            "warp": painter.warp.name,
            "threads": painter.settings.threads,
            **painter.judge(truths),
        }
        for painter in painters
    ]
    if painters:
        for row, taken in zip(
            rows, time_in_turn(painters, range(len(painters[0].path)), seconds), strict=True
        ):
            row |= taken.figures()
    return rows
