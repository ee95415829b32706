"""What drawing with OpenGL needs, in whatever 3.3 core context is current: programs, textures, kept state."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from numpy.typing import ArrayLike

from persp_sw.errors import GraphicsError, MissingPackageError

try:
    from OpenGL import GL
    from OpenGL.raw.GL.VERSION.GL_1_0 import glGetIntegerv as _get
except ImportError as error:
    raise MissingPackageError(
        f"drawing needs the package PyOpenGL and the system's OpenGL library ({error}): "
        "pip install 'persp-sw[view]'; on Debian apt-get install libgl1 libegl1"
    ) from None

# Switched off while we draw, or as each draw wants them.
_CAPABILITIES = (
    GL.GL_BLEND,
    GL.GL_COLOR_LOGIC_OP,
    GL.GL_CULL_FACE,
    GL.GL_DEPTH_CLAMP,
    GL.GL_DEPTH_TEST,
    GL.GL_FRAMEBUFFER_SRGB,
    GL.GL_POLYGON_OFFSET_FILL,
    GL.GL_RASTERIZER_DISCARD,
    GL.GL_SAMPLE_ALPHA_TO_COVERAGE,
    GL.GL_SCISSOR_TEST,
    GL.GL_STENCIL_TEST,
)
_UNITS = 2
_PIXEL_STORE = {
    GL.GL_UNPACK_ALIGNMENT: 1,
    GL.GL_UNPACK_ROW_LENGTH: 0,
    GL.GL_UNPACK_SKIP_ROWS: 0,
    GL.GL_UNPACK_SKIP_PIXELS: 0,
    GL.GL_PACK_ALIGNMENT: 1,
    GL.GL_PACK_ROW_LENGTH: 0,
    GL.GL_PACK_SKIP_ROWS: 0,
    GL.GL_PACK_SKIP_PIXELS: 0,
}


def integers(name: int, count: int) -> tuple[int, ...]:
    """`count` whole numbers of the context's state."""
    # The raw call into an array of ours is five times as fast as PyOpenGL's own, and we ask for fifty a draw.
    values = (ctypes.c_int * 16)()
    _get(name, values)
    return tuple(values[:count])


def integer(name: int) -> int:
    """One whole number of the context's state."""
    return integers(name, 1)[0]


@contextmanager
def kept_state() -> Iterator[None]:
    """Leave the context's state as it was found; within, all tests are off and pixels are packed tightly."""
    blend = [
        integer(name)
        for name in (GL.GL_BLEND_SRC_RGB, GL.GL_BLEND_DST_RGB, GL.GL_BLEND_SRC_ALPHA, GL.GL_BLEND_DST_ALPHA)
    ]
    equations = integer(GL.GL_BLEND_EQUATION_RGB), integer(GL.GL_BLEND_EQUATION_ALPHA)
    enabled = [capability for capability in _CAPABILITIES if GL.glIsEnabled(capability)]
    framebuffers = {
        target: integer(name)
        for target, name in (
            (GL.GL_DRAW_FRAMEBUFFER, GL.GL_DRAW_FRAMEBUFFER_BINDING),
            (GL.GL_READ_FRAMEBUFFER, GL.GL_READ_FRAMEBUFFER_BINDING),
        )
    }
    buffers = {
        target: integer(name)
        for target, name in (
            (GL.GL_ARRAY_BUFFER, GL.GL_ARRAY_BUFFER_BINDING),
            (GL.GL_PIXEL_UNPACK_BUFFER, GL.GL_PIXEL_UNPACK_BUFFER_BINDING),
            (GL.GL_PIXEL_PACK_BUFFER, GL.GL_PIXEL_PACK_BUFFER_BINDING),
        )
    }
    program, vertices = integer(GL.GL_CURRENT_PROGRAM), integer(GL.GL_VERTEX_ARRAY_BINDING)
    viewport = integers(GL.GL_VIEWPORT, 4)
    colour_mask = integers(GL.GL_COLOR_WRITEMASK, 4)
    depth_mask = integer(GL.GL_DEPTH_WRITEMASK)
    depth_function = integer(GL.GL_DEPTH_FUNC)
    offset = [float(GL.glGetFloatv(n)) for n in (GL.GL_POLYGON_OFFSET_FACTOR, GL.GL_POLYGON_OFFSET_UNITS)]
    clear_colour = [float(n) for n in GL.glGetFloatv(GL.GL_COLOR_CLEAR_VALUE)]
    clear_depth = float(GL.glGetFloatv(GL.GL_DEPTH_CLEAR_VALUE))
    polygon_mode = integer(GL.GL_POLYGON_MODE)
    store = {name: integer(name) for name in _PIXEL_STORE}
    unit = integer(GL.GL_ACTIVE_TEXTURE)
    textures = []
    for number in range(_UNITS):
        GL.glActiveTexture(GL.GL_TEXTURE0 + number)
        textures.append((integer(GL.GL_TEXTURE_BINDING_2D), integer(GL.GL_SAMPLER_BINDING)))
    try:
        for capability in enabled:
            GL.glDisable(capability)
        for target, name in buffers.items():
            if name:
                GL.glBindBuffer(target, 0)
        for name, value in _PIXEL_STORE.items():
            if store[name] != value:
                GL.glPixelStorei(name, value)
        GL.glColorMask(True, True, True, True)
        GL.glPolygonMode(GL.GL_FRONT_AND_BACK, GL.GL_FILL)
        yield
    finally:
        for number, (texture, sampler) in enumerate(textures):
            GL.glActiveTexture(GL.GL_TEXTURE0 + number)
            GL.glBindTexture(GL.GL_TEXTURE_2D, texture)
            GL.glBindSampler(number, sampler)
        GL.glActiveTexture(unit)
        for name, value in store.items():
            GL.glPixelStorei(name, value)
        GL.glPolygonMode(GL.GL_FRONT_AND_BACK, polygon_mode)
        GL.glClearDepth(clear_depth)
        GL.glClearColor(*clear_colour)
        GL.glDepthFunc(depth_function)
        GL.glDepthMask(depth_mask)
        GL.glPolygonOffset(*offset)
        GL.glColorMask(*colour_mask)
        GL.glViewport(*viewport)
        GL.glBindVertexArray(vertices)
        GL.glUseProgram(program)
        for target, name in (*buffers.items(),):
            GL.glBindBuffer(target, name)
        for target, name in framebuffers.items():
            GL.glBindFramebuffer(target, name)
        for capability in _CAPABILITIES:
            (GL.glEnable if capability in enabled else GL.glDisable)(capability)
        GL.glBlendEquationSeparate(*equations)
        GL.glBlendFuncSeparate(*blend)


class Program:
    """A vertex and a fragment shader, linked.

    Raises
    ------
    GraphicsError
        The driver's own words where it refuses them.
    """

    def __init__(self, vertex: str, fragment: str):
        shaders = []
        self.name = GL.glCreateProgram()
        try:
            for kind, source in ((GL.GL_VERTEX_SHADER, vertex), (GL.GL_FRAGMENT_SHADER, fragment)):
                shader = GL.glCreateShader(kind)
                shaders.append(shader)
                GL.glShaderSource(shader, "#version 330 core\n" + source)
                GL.glCompileShader(shader)
                if not GL.glGetShaderiv(shader, GL.GL_COMPILE_STATUS):
                    raise GraphicsError(f"a shader does not compile: {_text(GL.glGetShaderInfoLog(shader))}")
                GL.glAttachShader(self.name, shader)
            GL.glLinkProgram(self.name)
            if not GL.glGetProgramiv(self.name, GL.GL_LINK_STATUS):
                raise GraphicsError(f"shaders do not link: {_text(GL.glGetProgramInfoLog(self.name))}")
        except GraphicsError:
            self.close()
            raise
        finally:
            for shader in shaders:
                GL.glDeleteShader(shader)
        self._places: dict[str, int] = {}

    def place(self, uniform: str) -> int:
        """Where a uniform is set."""
        if uniform not in self._places:
            self._places[uniform] = GL.glGetUniformLocation(self.name, uniform)
        return self._places[uniform]

    def close(self) -> None:
        """Delete it."""
        if self.name:
            GL.glDeleteProgram(self.name)
            self.name = 0


class Texture:
    """A two-dimensional RGBA texture; row 0 of what is uploaded is on top.

    Parameters
    ----------
    size
        Width and height.
    internal
        OpenGL's internal format, such as GL_RGBA16F.
    """

    def __init__(self, size: Sequence[int], internal: int = GL.GL_RGBA16F):
        largest = integer(GL.GL_MAX_TEXTURE_SIZE)
        if max(size) > largest:
            raise GraphicsError(
                f"this graphics system's pictures have {largest} pixels a side at most; given {size}"
            )
        self.size = int(size[0]), int(size[1])
        self.internal = internal
        self.name = int(GL.glGenTextures(1))
        with kept_state():
            GL.glActiveTexture(GL.GL_TEXTURE0)
            GL.glBindTexture(GL.GL_TEXTURE_2D, self.name)
            GL.glTexImage2D(GL.GL_TEXTURE_2D, 0, internal, *self.size, 0, GL.GL_RGBA, GL.GL_FLOAT, None)
            for name, value in (
                (GL.GL_TEXTURE_MIN_FILTER, GL.GL_LINEAR),
                (GL.GL_TEXTURE_MAG_FILTER, GL.GL_LINEAR),
                (GL.GL_TEXTURE_WRAP_S, GL.GL_CLAMP_TO_EDGE),
                (GL.GL_TEXTURE_WRAP_T, GL.GL_CLAMP_TO_EDGE),
            ):
                GL.glTexParameteri(GL.GL_TEXTURE_2D, name, value)

    def upload(self, image: ArrayLike) -> None:
        """Fill it with (h, w, 4) linear premultiplied values, converted here: drivers do so slowly."""
        image = np.asarray(image)
        if image.shape != (self.size[1], self.size[0], 4):
            raise GraphicsError(
                f"this texture is (h, w) = {self.size[::-1]}; given an array of {image.shape}"
            )
        kind, number = (
            (GL.GL_FLOAT, np.float32) if self.internal == GL.GL_RGBA32F else (GL.GL_HALF_FLOAT, np.float16)
        )
        rows = np.ascontiguousarray(image[::-1], number)
        with kept_state():
            GL.glActiveTexture(GL.GL_TEXTURE0)
            GL.glBindTexture(GL.GL_TEXTURE_2D, self.name)
            GL.glTexSubImage2D(GL.GL_TEXTURE_2D, 0, 0, 0, *self.size, GL.GL_RGBA, kind, rows)

    def close(self) -> None:
        """Delete it."""
        if self.name:
            GL.glDeleteTextures([self.name])
            self.name = 0


def read_pixels(size: Sequence[int], layout: int, kind: int, number: type, channels: int) -> np.ndarray:
    """(h, w, channels) of the framebuffer that is bound for reading, row 0 on top; within `kept_state`."""
    image = np.empty((size[1], size[0], channels), number)
    GL.glReadPixels(0, 0, *size, layout, kind, image)
    return np.ascontiguousarray(image[::-1])


def _text(log: bytes | str) -> str:
    return (log.decode(errors="replace") if isinstance(log, bytes) else log).strip()
