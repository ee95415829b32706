"""A frame's pictures as arrays, without a window: by the software warp, or by OpenGL without a screen."""

from __future__ import annotations

from time import perf_counter
from typing import NamedTuple, Protocol

import numpy as np

import persp_sw as psw

from ..frame import Frame, Picture
from .wall_marks import WallMarks

WARPS = ("auto", "texture", "software")


class Drawn(NamedTuple):
    """Pictures by (wall, eye), (height, width, 4) float32, linear, premultiplied; and what each cost, ms.

    `upload_ms`: of all eye images, once a frame. Pictures are valid until the next frame is drawn.
    """

    pictures: dict[tuple[str, str], np.ndarray]
    warp_ms: dict[tuple[str, str], float]
    upload_ms: float


class Drawer(Protocol):
    """What draws frames; `name` says by which warp."""

    name: str

    def draw(self, frame: Frame) -> Drawn:
        """All pictures of a frame."""
        ...

    def close(self) -> None:
        """Give memory back."""
        ...


def drawer(renderer: psw.Renderer, warp: str, marks: WallMarks | None = None) -> Drawer:
    """The drawer of `WARPS`, with marks in its pictures.

    auto: OpenGL where a graphics card draws, else software, which is faster there.

    Raises
    ------
    PerspSWError
        "texture", and there is no OpenGL.
    """
    if warp == "software":
        return SoftwareDrawer(renderer, marks)
    try:
        texture = TextureDrawer(marks)
    except psw.PerspSWError:
        if warp == "texture":
            raise
        return SoftwareDrawer(renderer, marks)
    if warp == "auto" and texture.context.is_software:
        texture.close()
        return SoftwareDrawer(renderer, marks)
    return texture


class SoftwareDrawer:
    """Warps on the processor, each wall and eye on a canvas of its own."""

    name = "software"

    def __init__(self, renderer: psw.Renderer, marks: WallMarks | None = None):
        self._renderer, self._marks = renderer, marks
        self._canvases: dict[tuple[str, str], psw.Canvas] = {}

    def draw(self, frame: Frame) -> Drawn:
        """All pictures of a frame."""
        pictures, spent = {}, {}
        if self._marks is not None:
            self._marks.follow()
        for picture in frame.pictures:
            key = picture.wall.name, picture.eye
            start = perf_counter()
            canvas = self._canvases.get(key)
            if canvas is None or canvas.pixels.shape[1::-1] != picture.view.size:
                canvas = self._canvases[key] = psw.Canvas(*picture.view.size)
            pictures[key] = _marked(
                self._renderer.warp(picture.image, picture.view, canvas), picture, self._marks
            )
            spent[key] = 1e3 * (perf_counter() - start)
        return Drawn(pictures, spent, 0.0)

    def close(self) -> None:
        """Nothing to give back."""


class TextureDrawer:
    """Draws with OpenGL without a screen: one upload for each eye, one draw for each wall."""

    name = "texture"

    def __init__(self, marks: WallMarks | None = None):
        self._marks = marks
        self.context = psw.OffscreenContext()
        self._warp = psw.TextureWarp()
        self._targets: dict[tuple[int, int], psw.Framebuffer] = {}

    def draw(self, frame: Frame) -> Drawn:
        """All pictures of a frame; a picture's time includes reading it back, which ends its drawing."""
        self.context.make_current()
        if self._marks is not None:
            self._marks.follow()
        start = perf_counter()
        for eye, image in frame.images.items():
            self._warp.upload(image, eye)
        upload_ms = 1e3 * (perf_counter() - start)
        pictures, spent = {}, {}
        for picture in frame.pictures:
            start = perf_counter()
            target = self._targets.get(picture.view.size)
            if target is None:
                target = self._targets[picture.view.size] = psw.Framebuffer(*picture.view.size)
            target.clear()
            self._warp.draw_view(picture.view, picture.eye)
            key = picture.wall.name, picture.eye
            pictures[key] = _marked(target.read(), picture, self._marks)
            spent[key] = 1e3 * (perf_counter() - start)
        return Drawn(pictures, spent, upload_ms)

    def close(self) -> None:
        """Delete everything of OpenGL."""
        self.context.make_current()
        self._warp.close()
        for target in self._targets.values():
            target.close()
        self.context.close()


def _marked(image: np.ndarray, picture: Picture, marks: WallMarks | None) -> np.ndarray:
    """A picture with its marks, in a copy: canvases know what was drawn on them."""
    veiled = None if marks is None else marks.seen(picture)
    if veiled is None:
        return image
    image = image.copy()
    psw.marks.paint(image, picture.view, veiled)
    return image
