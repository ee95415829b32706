"""A picture in OpenGL's memory to draw into and read back."""

from __future__ import annotations

import numpy as np

from ..arrays import Image
from ..errors import GraphicsError
from .context import opengl


class Framebuffer:
    """A picture with depth to draw into, in the context that is current.

    Parameters
    ----------
    width, height
        Pixels.
    kind
        "float32" or "float16"; "rgba8"; or "srgb8", which OpenGL encodes while GL_FRAMEBUFFER_SRGB is on.

    Attributes
    ----------
    texture
        OpenGL's name of the 2D texture that holds the colours.

    Raises
    ------
    GraphicsError
        OpenGL cannot draw into such a picture.
    """

    KINDS = ("float32", "float16", "rgba8", "srgb8")

    def __init__(self, width: int, height: int, kind: str = "float32"):
        gl = opengl()
        if kind not in self.KINDS:
            raise GraphicsError(f"a framebuffer's kind is one of {', '.join(self.KINDS)}; given {kind!r}")
        formats = gl.GL_RGBA32F, gl.GL_RGBA16F, gl.GL_RGBA8, gl.GL_SRGB8_ALPHA8
        self.size = width, height
        self._name = gl.glGenFramebuffers(1)
        self.texture = gl.glGenTextures(1)
        self._depth = gl.glGenRenderbuffers(1)
        before = gl.glGetIntegerv(gl.GL_TEXTURE_BINDING_2D), gl.glGetIntegerv(gl.GL_RENDERBUFFER_BINDING)
        gl.glBindTexture(gl.GL_TEXTURE_2D, self.texture)
        chosen = formats[self.KINDS.index(kind)]
        gl.glTexImage2D(gl.GL_TEXTURE_2D, 0, chosen, width, height, 0, gl.GL_RGBA, gl.GL_FLOAT, None)
        for side in (gl.GL_TEXTURE_MIN_FILTER, gl.GL_TEXTURE_MAG_FILTER):
            gl.glTexParameteri(gl.GL_TEXTURE_2D, side, gl.GL_NEAREST)
        gl.glBindRenderbuffer(gl.GL_RENDERBUFFER, self._depth)
        gl.glRenderbufferStorage(gl.GL_RENDERBUFFER, gl.GL_DEPTH_COMPONENT32F, width, height)
        gl.glBindTexture(gl.GL_TEXTURE_2D, before[0])
        gl.glBindRenderbuffer(gl.GL_RENDERBUFFER, before[1])
        gl.glBindFramebuffer(gl.GL_FRAMEBUFFER, self._name)
        target, colour = gl.GL_FRAMEBUFFER, gl.GL_COLOR_ATTACHMENT0
        gl.glFramebufferTexture2D(target, colour, gl.GL_TEXTURE_2D, self.texture, 0)
        gl.glFramebufferRenderbuffer(target, gl.GL_DEPTH_ATTACHMENT, gl.GL_RENDERBUFFER, self._depth)
        if gl.glCheckFramebufferStatus(target) != gl.GL_FRAMEBUFFER_COMPLETE:
            self.close()
            raise GraphicsError(f"OpenGL cannot draw into {width}×{height} pixels of kind {kind}")
        gl.glViewport(0, 0, width, height)

    def bind(self) -> None:
        """Draw into it from now on; the viewport becomes all of it."""
        gl = opengl()
        gl.glBindFramebuffer(gl.GL_FRAMEBUFFER, self._name)
        gl.glViewport(0, 0, *self.size)

    def clear(self, colour: tuple[float, float, float, float] = (0, 0, 0, 0), depth: float = 1.0) -> None:
        """Bind it and fill it with one linear premultiplied colour and one window depth."""
        gl = opengl()
        self.bind()
        gl.glClearBufferfv(gl.GL_COLOR, 0, np.array(colour, np.float32))
        gl.glClearBufferfv(gl.GL_DEPTH, 0, np.array([depth], np.float32))

    def read(self) -> Image:
        """(height, width, 4) float32, row 0 on top: what is stored, so encoded in an "srgb8"."""
        gl = opengl()
        self.bind()
        width, height = self.size
        pixels = np.empty((height, width, 4), np.float32)
        gl.glReadPixels(0, 0, width, height, gl.GL_RGBA, gl.GL_FLOAT, pixels)
        return np.ascontiguousarray(pixels[::-1])

    def close(self) -> None:
        """Delete it; the context that it was made in must be current."""
        gl = opengl()
        gl.glDeleteFramebuffers(1, [self._name])
        gl.glDeleteTextures([self.texture])
        gl.glDeleteRenderbuffers(1, [self._depth])
