"""What texture formats cost and what error they add; compositing does not see them."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from typing import Any

from ..arrays import Image
from ..errors import GraphicsError, MissingPackageError
from ..eye_image import EyeImage
from ..geometry.view import View
from ..renderer import Renderer
from ..warp.context import OffscreenContext, opengl
from ..warp.framebuffer import Framebuffer
from ..warp.texture import TextureWarp
from .metrics import max_error, psnr

_REPEATS = 15


def texture_rows(renderer: Renderer, view: View) -> list[dict[str, Any]]:
    """For each texture format `texture`, `upload_ms`, `draw_ms`, `psnr` and `max_error`; none without OpenGL.

    Milliseconds are the least of several; errors are against the software warp of the same eye image, made
    with the renderer's settings. `gl`: what OpenGL draws with.
    """
    image = renderer.composite(view.eye, [view.wall])
    truth = renderer.warp(image, view)
    try:
        with OffscreenContext() as context:
            formats = [name for name in TextureWarp.PRECISIONS if name != "auto"]
            return [{**_row_of(name, image, view, truth), "gl": context.renderer} for name in formats]
    except (GraphicsError, MissingPackageError):
        return []


def _row_of(precision: str, image: EyeImage, view: View, truth: Image) -> dict[str, Any]:
    target = Framebuffer(*view.size)
    with TextureWarp(precision) as warp:
        upload = _least_ms(lambda: warp.upload(image))
        target.clear()
        warp.draw_view(view)
        picture = target.read()
        draw = _least_ms(lambda: warp.draw_view(view))
    target.close()
    return {
        "texture": precision,
        "upload_ms": upload,
        "draw_ms": draw,
        "psnr": psnr(picture, truth),
        "max_error": max_error(picture, truth),
    }


def _least_ms(work: Callable[[], object]) -> float:
    """Of a call, OpenGL's work included: what else runs on the machine only adds to it."""
    gl, spent = opengl(), []
    for _ in range(_REPEATS):
        gl.glFinish()
        start = perf_counter()
        work()
        gl.glFinish()
        spent.append(1e3 * (perf_counter() - start))
    return min(spent)
