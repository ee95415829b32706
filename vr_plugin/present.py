"""The eyes' pictures on the screen: one pass composes a window from two, in any stereo mode.

Works in whatever OpenGL 3.3 core context is current, leaves its state as it was and deletes what it made.
Colours are linear and premultiplied in the targets and encoded for the screen (sRGB) once, at the end.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from OpenGL import GL

import persp_sw as psw

from .screen.eye_target import EyeTarget
from .screen.gl_objects import Program, integer, kept_state, read_pixels
from .stereo import DUBOIS_LEFT, DUBOIS_RIGHT, MODES, Rectangle, StereoError, rectangles, without_quad_buffers

_log = logging.getLogger("persp_sw")

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

    def has_quad_buffers(self) -> bool:
        """Whether the bound framebuffer has a left and a right buffer: a window's, of a context for it."""
        return integer(GL.GL_DRAW_FRAMEBUFFER_BINDING) == 0 and bool(GL.glGetBooleanv(GL.GL_STEREO))

    def possible_mode(self, mode: str) -> str:
        """`mode`, or what is shown instead where it is quad-buffered and the screen is not; said once."""
        if mode != "quad" or self.has_quad_buffers():
            return mode
        instead = without_quad_buffers(mode)
        _say_without_quad_buffers(MODES[instead])
        return instead

    def finish(self) -> None:
        """Wait until all that was asked of the current context is drawn."""
        GL.glFinish()

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

        Raises
        ------
        StereoError
            No such mode, or two windows: each shows its own, left or right.
        """
        if mode == "two_windows":
            raise StereoError("two windows show the modes left and right; compose each of them")
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
                try:
                    for buffer, picture in zip(self._quad_buffers, (left, right), strict=True):
                        GL.glDrawBuffer(buffer)
                        self._draw(picture, Rectangle(0, 0, *size), size)
                finally:
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


@cache
def _say_without_quad_buffers(instead: str) -> None:
    """Once, however many walls ask."""
    _log.warning(
        "this screen has no quad-buffered stereo: showing %s instead; switch stereo on in the graphics "
        "driver (on Linux: X11, option Stereo), or choose another stereo mode",
        instead,
    )


def read_screen(size: Sequence[int]) -> NDArray[np.uint8]:
    """What the bound framebuffer holds, as encoded for the screen: (h, w, 3) uint8, row 0 on top.

    Of a window, before its buffers are swapped.
    """
    with kept_state():
        return read_pixels(size, GL.GL_RGB, GL.GL_UNSIGNED_BYTE, np.uint8, 3)
