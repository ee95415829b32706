"""Which warp makes a command's pictures: the software's, or OpenGL's without a screen."""

from __future__ import annotations

from itertools import pairwise
from time import perf_counter
from typing import Any

from ..arrays import Image
from ..errors import GraphicsError, MissingPackageError
from ..eye_image import EyeImage
from ..geometry.view import View
from ..renderer import Renderer
from ..warp.canvas import Canvas


class WarpChoice:
    """A renderer that draws by the warp one wants.

    Parameters
    ----------
    wanted
        "texture", "software" or "auto": software where there is no graphics card, for a software rasteriser
        takes three times its time and more (`benchmarks/texture_warp.py`); with one, the faster of the two
        on the first picture, reading it back included.
    size
        Width and height of the pictures.

    Attributes
    ----------
    name
        The warp that drew the last picture.
    last
        As `Renderer.last`.

    Raises
    ------
    MissingPackageError, GraphicsError
        "texture" is wanted, and there is no OpenGL.
    """

    def __init__(self, renderer: Renderer, wanted: str, size: tuple[int, int]):
        self.renderer = renderer
        self.name = "software"
        self.last: dict[str, Any] = {}
        self._offscreen: _Offscreen | None = None
        self._undecided = False
        if wanted != "software":
            try:
                self._offscreen = _Offscreen(size)
            except (MissingPackageError, GraphicsError):
                if wanted == "texture":
                    raise
        if self._offscreen is not None and wanted == "auto":
            self._undecided = not self._offscreen.context.is_software
            if not self._undecided:
                self.close()
        if self._offscreen is not None:
            self.name = "texture"

    def render(self, view: View, out: Canvas | None = None) -> Image:
        """As `Renderer.render`; `out` is used by the software warp only."""
        image = self.renderer.composite(view.eye, [view.wall])
        if self._undecided:
            self._decide(image, view)
        if self.name == "software":
            picture = self.renderer.warp(image, view, out)
            self.last = dict(self.renderer.last)
            return picture
        start = perf_counter()
        picture = self._offscreen.draw(image, view)
        self.last = {**self.renderer.last, "warp_ms": 1e3 * (perf_counter() - start)}
        return picture

    def close(self) -> None:
        """Give OpenGL's memory back."""
        if self._offscreen is not None:
            self._offscreen.close()
        self._offscreen = None

    def __enter__(self) -> WarpChoice:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _decide(self, image: EyeImage, view: View) -> None:
        """Let both draw: once to compile, then three times, of which the least counts."""
        self._undecided = False
        canvas = Canvas(*view.size)
        spent = {}
        for name, draw in (
            ("software", lambda: self.renderer.warp(image, view, canvas)),
            ("texture", lambda: self._offscreen.draw(image, view)),
        ):
            draw()
            times = [perf_counter()]
            for _ in range(3):
                draw()
                times.append(perf_counter())
            spent[name] = min(after - before for before, after in pairwise(times))
        self.name = min(spent, key=spent.__getitem__)
        self.renderer.last["warp_ms"] = 0.0  # of this trial


class _Offscreen:
    """A context with all that one picture at a time needs."""

    def __init__(self, size: tuple[int, int]):
        from ..warp.context import OffscreenContext
        from ..warp.framebuffer import Framebuffer
        from ..warp.texture import TextureWarp

        self.context = OffscreenContext()
        self._warp, self._target = TextureWarp(), Framebuffer(*size)

    def draw(self, image: EyeImage, view: View) -> Image:
        self.context.make_current()
        self._warp.upload(image)
        self._target.clear()
        self._warp.draw_view(view)
        return self._target.read()

    def close(self) -> None:
        self.context.make_current()
        self._warp.close()
        self._target.close()
        self.context.close()
