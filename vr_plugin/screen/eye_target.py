"""What one eye's picture is drawn in: a picture of linear light with depth, in the current OpenGL context."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from numpy.typing import ArrayLike, NDArray
from OpenGL import GL

from persp_sw.errors import GraphicsError

from .gl_objects import Texture, integer, kept_state, read_pixels

FORMATS = {"float16": GL.GL_RGBA16F, "float32": GL.GL_RGBA32F, "srgb8": GL.GL_SRGB8_ALPHA8}


class EyeTarget:
    """What one eye's picture is drawn in: colour, linear and premultiplied, and depth.

    Parameters
    ----------
    size
        Width and height in pixels.
    precision
        One of `FORMATS`. After three half-transparent layers float16 is off by at most one of the screen's
        256 steps, 0.016 in the mean; srgb8 by two, 0.4 in the mean, and a tenth to a quarter faster where the
        processor draws (`benchmarks/eye_targets.py`). float32 is for tests.
    """

    def __init__(self, size: Sequence[int], precision: str = "float16"):
        if precision not in FORMATS:
            raise GraphicsError(f"there is no precision {precision!r}; choose one of {', '.join(FORMATS)}")
        self.precision = precision
        self.size = (0, 0)
        self._texture: Texture | None = None
        self._framebuffer = self._depth = 0
        self.resize(size)

    @property
    def texture(self) -> int:
        """OpenGL's name of the colour texture; another one after `resize`."""
        return self._texture.name

    def resize(self, size: Sequence[int]) -> None:
        """Give it another size; what it held is lost. Nothing happens where it has that size."""
        size = int(size[0]), int(size[1])
        if size == self.size:
            return
        if min(size) < 1:
            raise GraphicsError(f"a picture has at least one pixel; given {size}")
        self.close()
        with kept_state():
            self._texture = Texture(size, FORMATS[self.precision])
            self._depth = int(GL.glGenRenderbuffers(1))
            bound = integer(GL.GL_RENDERBUFFER_BINDING)
            GL.glBindRenderbuffer(GL.GL_RENDERBUFFER, self._depth)
            GL.glRenderbufferStorage(GL.GL_RENDERBUFFER, GL.GL_DEPTH_COMPONENT32F, *size)
            GL.glBindRenderbuffer(GL.GL_RENDERBUFFER, bound)
            self._framebuffer = int(GL.glGenFramebuffers(1))
            GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._framebuffer)
            GL.glFramebufferTexture2D(
                GL.GL_FRAMEBUFFER, GL.GL_COLOR_ATTACHMENT0, GL.GL_TEXTURE_2D, self._texture.name, 0
            )
            GL.glFramebufferRenderbuffer(
                GL.GL_FRAMEBUFFER, GL.GL_DEPTH_ATTACHMENT, GL.GL_RENDERBUFFER, self._depth
            )
            status = GL.glCheckFramebufferStatus(GL.GL_FRAMEBUFFER)
        if status != GL.GL_FRAMEBUFFER_COMPLETE:
            self.close()
            raise GraphicsError(f"this graphics system cannot draw into {self.precision} pictures of {size}")
        self.size = size

    @contextmanager
    def drawing(self, clear: bool = True) -> Iterator[None]:
        """Within, what is drawn goes here: transparent and infinitely far at first, unless `clear` is False.

        Depth test and blending are as the caller sets them. The state before comes back at the end.
        """
        with kept_state():
            GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._framebuffer)
            GL.glViewport(0, 0, *self.size)
            GL.glEnable(GL.GL_FRAMEBUFFER_SRGB)  # srgb8 alone heeds it
            if clear:
                GL.glDepthMask(True)
                GL.glClearColor(0, 0, 0, 0)
                GL.glClearDepth(1)
                GL.glClear(GL.GL_COLOR_BUFFER_BIT | GL.GL_DEPTH_BUFFER_BIT)
            yield

    def upload(self, image: ArrayLike) -> None:
        """Fill the colour with a picture made elsewhere: (h, w, 4) linear premultiplied, row 0 on top."""
        if self.precision == "srgb8":
            raise GraphicsError("a picture is uploaded in float16 or float32")
        self._texture.upload(image)

    def make_mipmaps(self) -> None:
        """Smaller copies of the picture as it is now, for where it is seen small."""
        with kept_state():
            GL.glActiveTexture(GL.GL_TEXTURE0)
            GL.glBindTexture(GL.GL_TEXTURE_2D, self._texture.name)
            GL.glGenerateMipmap(GL.GL_TEXTURE_2D)

    def read(self) -> NDArray[np.float32]:
        """The picture: (h, w, 4) float32, linear, premultiplied, row 0 on top."""
        with kept_state():
            GL.glBindFramebuffer(GL.GL_READ_FRAMEBUFFER, self._framebuffer)
            image = read_pixels(self.size, GL.GL_RGBA, GL.GL_FLOAT, np.float32, 4)
        if self.precision == "srgb8":  # is read as it is stored
            rgb = image[..., :3]
            rgb[:] = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        return image

    def close(self) -> None:
        """Delete its textures."""
        if self._texture:
            self._texture.close()
        if self._framebuffer:
            GL.glDeleteFramebuffers(1, [self._framebuffer])
            GL.glDeleteRenderbuffers(1, [self._depth])
        self._texture, self._framebuffer, self._depth, self.size = None, 0, 0, (0, 0)
