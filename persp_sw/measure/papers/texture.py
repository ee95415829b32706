"""The texture warp for measuring, in an OpenGL context without a screen."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from ...arrays import Image
from ...errors import PerspSWError
from ...eye_image import EyeImage
from ...geometry.view import View
from ...renderer import Renderer
from ...warp.context import OffscreenContext, opengl
from ...warp.framebuffer import Framebuffer
from ...warp.texture import TextureWarp
from .painter import Row


class OffscreenWarp:
    """A `painter.Warp` that uploads and draws; float32 framebuffers, one for each eye and wall."""

    name = "texture"

    def __init__(self, warp: TextureWarp) -> None:
        self._warp = warp
        self._framebuffers: dict[tuple[str, str, tuple[int, int]], Framebuffer] = {}

    def begin(self, renderer: Renderer, image: EyeImage, slot: str) -> None:
        """See `painter.Warp`: one upload."""
        self._warp.upload(image, slot)

    def draw(self, view: View, slot: str) -> None:
        """See `painter.Warp`; OpenGL may still be at it when this returns."""
        self._drawn(view, slot)

    def finish(self) -> None:
        """See `painter.Warp`."""
        opengl().glFinish()

    def picture(self, view: View, slot: str) -> Image:
        """See `painter.Warp`: what `draw` left, read back."""
        return self._drawn(view, slot).read()

    def close(self) -> None:
        """Delete the framebuffers."""
        for framebuffer in self._framebuffers.values():
            framebuffer.close()
        self._framebuffers.clear()

    def _drawn(self, view: View, slot: str) -> Framebuffer:
        key = slot, view.wall.name, view.size
        framebuffer = self._framebuffers.get(key)
        if framebuffer is None:
            framebuffer = self._framebuffers[key] = Framebuffer(*view.size)
        framebuffer.clear()
        self._warp.draw_view(view, slot)
        return framebuffer


@contextmanager
def texture_warp() -> Iterator[tuple[OffscreenWarp | None, Row]]:
    """The texture warp in a context of its own, and what draws it: `renderer`, `precision`.

    Without OpenGL None and `missing`: why there is none.
    """
    try:
        context = OffscreenContext()
    except PerspSWError as error:
        yield None, {"missing": f"no OpenGL here: {error}"}
        return
    with context, TextureWarp() as warp:
        drawing = OffscreenWarp(warp)
        try:
            yield drawing, {"renderer": context.renderer, "precision": warp.precision}
        finally:
            drawing.close()
