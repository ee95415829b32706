"""The eyes' pictures on the screen: targets to draw them in, and one pass that composes a window from two.

Works in whatever OpenGL 3.3 core context is current, leaves its state as it was and deletes what it made.
Colours are linear and premultiplied in the targets and encoded for the screen (sRGB) once, at the end.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from numpy.typing import ArrayLike, NDArray
from OpenGL import GL

import persp_sw as psw
from persp_sw.errors import GraphicsError

from .gl_objects import Program, Texture, integer, kept_state
from .stereo import DUBOIS_LEFT, DUBOIS_RIGHT, Rectangle, rectangles, without_quad_buffers

_log = logging.getLogger("persp_sw")

FORMATS = {"float16": GL.GL_RGBA16F, "float32": GL.GL_RGBA32F, "srgb8": GL.GL_SRGB8_ALPHA8}

# A triangle that covers the viewport.
_VERTEX = """
out vec2 at;
void main() {
    at = 2 * vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = vec4(2 * at - 1, 0, 1);
}
"""

# In variants, not with branches: software rasterisers run both sides of a branch for all pixels.
_FRAGMENT = """
uniform sampler2D left, right;
uniform vec3 background;
uniform mat3 left_matrix, right_matrix;
uniform int row_offset;  // minus a row counted from below: even where the screen shows the left eye
in vec2 at;
out vec4 colour;

vec3 shown(sampler2D eye) {
    vec4 value = texture(eye, at);
    return value.rgb + (1 - value.a) * background;
}

void main() {
#if defined(MATRICES)
    vec3 light = left_matrix * shown(left) + right_matrix * shown(right);
    light = clamp(light, 0, 1);
#elif defined(ROWS)
    vec3 light = ((row_offset - int(gl_FragCoord.y)) & 1) == 0 ? shown(left) : shown(right);
#else
    vec3 light = shown(left);
#endif
#if defined(ENCODE)
    light = clamp(light, 0, 1);
    vec3 curve = 1.055 * pow(light, vec3(1 / 2.4)) - 0.055;
    light = mix(curve, 12.92 * light, lessThanEqual(light, vec3(0.0031308)));
#endif
    colour = vec4(light, 1);
}
"""
_VARIANTS = {"interlaced": "ROWS", "anaglyph": "MATRICES"}


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
            image = _read(self.size, GL.GL_RGBA, GL.GL_FLOAT, np.float32, 4)
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


class Composer:
    """Composes the eyes' pictures into the bound framebuffer, in any stereo mode. One for each context."""

    def __init__(self):
        self._programs: dict[str, Program] = {}
        self._vertices = int(GL.glGenVertexArrays(1))
        self._samplers = [int(name) for name in GL.glGenSamplers(2)]
        for sampler, kind in zip(self._samplers, (GL.GL_NEAREST, GL.GL_LINEAR), strict=True):
            for name, value in (
                (GL.GL_TEXTURE_MIN_FILTER, kind),
                (GL.GL_TEXTURE_MAG_FILTER, kind),
                (GL.GL_TEXTURE_WRAP_S, GL.GL_CLAMP_TO_EDGE),
                (GL.GL_TEXTURE_WRAP_T, GL.GL_CLAMP_TO_EDGE),
            ):
                GL.glSamplerParameteri(sampler, name, value)
        self._quad_buffers = GL.GL_BACK_LEFT, GL.GL_BACK_RIGHT
        self._said = False

    def has_quad_buffers(self) -> bool:
        """Whether the bound framebuffer has a left and a right buffer: a window's, of a context for it."""
        return integer(GL.GL_DRAW_FRAMEBUFFER_BINDING) == 0 and bool(GL.glGetBooleanv(GL.GL_STEREO))

    def possible_mode(self, mode: str) -> str:
        """`mode`, or what is shown instead where it is quad-buffered and the screen is not; said once."""
        if mode != "quad" or self.has_quad_buffers():
            return mode
        instead = without_quad_buffers(mode)
        if not self._said:
            self._said = True
            _log.warning(
                "this screen has no quad-buffered stereo: showing %s instead; switch stereo on in the "
                "graphics driver (on Linux: X11, option Stereo), or choose another stereo mode",
                instead,
            )
        return instead

    def compose(
        self,
        left: EyeTarget,
        right: EyeTarget,
        mode: str,
        size: Sequence[int],
        *,
        background: ArrayLike = (0, 0, 0),
        first_row: int = 0,
        encode: bool = True,
    ) -> None:
        """Draw what a window shows of two pictures into the bound framebuffer.

        Parameters
        ----------
        left, right
            The eyes' pictures; the same one for a mode of one eye. Those of `stereo.eye_size` are shown pixel
            by pixel, others are stretched.
        mode, background, first_row
            As for `stereo.combine`; quad fills the window's two buffers.
        size
            Width and height of the window's framebuffer in pixels.
        encode
            Encode for the screen (sRGB); False writes linear light, for framebuffers of floats.
        """
        mode = self.possible_mode(mode)
        places = rectangles(mode, size)
        with kept_state():
            GL.glDepthMask(False)
            GL.glBindVertexArray(self._vertices)
            if mode in _VARIANTS:
                program = self._use(_VARIANTS[mode], encode, background)
                GL.glUniform1i(program.place("row_offset"), size[1] - 1 + first_row % 2)
                for name, matrix in (("left_matrix", DUBOIS_LEFT), ("right_matrix", DUBOIS_RIGHT)):
                    GL.glUniformMatrix3fv(program.place(name), 1, True, matrix.astype(np.float32))
                GL.glUniform1i(program.place("right"), 1)
                self._bind(1, right, size)
                self._draw(left, Rectangle(0, 0, *size), size)
            elif mode == "quad":
                self._use("", encode, background)
                # Which buffers are drawn into belongs to the framebuffer, not to what kept_state keeps.
                before = integer(GL.GL_DRAW_BUFFER)
                for buffer, picture in zip(self._quad_buffers, (left, right), strict=True):
                    GL.glDrawBuffer(buffer)
                    self._draw(picture, Rectangle(0, 0, *size), size)
                GL.glDrawBuffer(before)
            else:
                if mode in ("side_by_side", "top_bottom") and (size[0] % 2 or size[1] % 2):
                    GL.glClearColor(*(psw.images.srgb(background) if encode else background), 1)
                    GL.glClear(GL.GL_COLOR_BUFFER_BIT)  # an odd pixel is nobody's
                self._use("", encode, background)
                for picture, place in zip((left, right), places, strict=True):
                    if place:
                        self._draw(picture, place, size)

    def close(self) -> None:
        """Delete what it made."""
        if self._vertices:
            for program in self._programs.values():
                program.close()
            self._programs.clear()
            GL.glDeleteVertexArrays(1, [self._vertices])
            GL.glDeleteSamplers(2, self._samplers)
            self._vertices = 0

    def _use(self, variant: str, encode: bool, background: ArrayLike) -> Program:
        """The variant's program, in use."""
        defines = [f"#define {name}\n" for name in (variant, "ENCODE" * encode) if name]
        key = "".join(defines)
        if key not in self._programs:
            self._programs[key] = Program(_VERTEX, key + _FRAGMENT)
        program = self._programs[key]
        GL.glUseProgram(program.name)
        GL.glUniform3f(program.place("background"), *(float(c) for c in background))
        GL.glUniform1i(program.place("left"), 0)
        return program

    def _bind(self, unit: int, picture: EyeTarget, size: Sequence[int]) -> None:
        GL.glActiveTexture(GL.GL_TEXTURE0 + unit)
        GL.glBindTexture(GL.GL_TEXTURE_2D, picture.texture)
        GL.glBindSampler(unit, self._samplers[0 if tuple(size) == picture.size else 1])

    def _draw(self, picture: EyeTarget, place: Rectangle, size: Sequence[int]) -> None:
        """The picture, and what is bound beside it, in a part of a window of that size."""
        self._bind(0, picture, place[2:])
        GL.glViewport(place.x, size[1] - place.y - place.height, place.width, place.height)
        GL.glDrawArrays(GL.GL_TRIANGLES, 0, 3)


def read_screen(size: Sequence[int]) -> NDArray[np.uint8]:
    """What the bound framebuffer holds, as encoded for the screen: (h, w, 3) uint8, row 0 on top.

    Of a window, before its buffers are swapped.
    """
    with kept_state():
        return _read(size, GL.GL_RGB, GL.GL_UNSIGNED_BYTE, np.uint8, 3)


def _read(size: Sequence[int], layout: int, kind: int, number: type, channels: int) -> np.ndarray:
    image = np.empty((size[1], size[0], channels), number)
    GL.glReadPixels(0, 0, *size, layout, kind, image)
    return np.ascontiguousarray(image[::-1])
