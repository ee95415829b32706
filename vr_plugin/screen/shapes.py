"""Lines, flat polygons and pictures in space, drawn with OpenGL: a room seen from outside, text, frames.

In whatever 3.3 core context is current; one `Shapes` for each context. State is left as it was.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from OpenGL import GL

from .gl_objects import Program, integers, kept_state
from .ribbons import CORNERS, clipped, ribbons

_VERTEX = """
layout(location = 0) in vec4 clip;
layout(location = 1) in vec2 place;  // in the picture, 0 … 1; of a line: pixels from its middle, half width
layout(location = 2) in vec4 shade;  // premultiplied, of what has a colour for each corner
out vec2 at;
out vec4 tone;
noperspective out float off;
void main() {
    gl_Position = clip;
    at = place;
    tone = shade;
    off = place.x;
}
"""

_FRAGMENT = """
uniform int kind;  // 0: flat, 1: line, 2: picture; 3: flat, 4: line, both with a colour for each corner
uniform vec4 tint;  // premultiplied; behind a picture
uniform float half_width;
uniform float opacity;
uniform vec4 veil;  // what a picture is seen through: premultiplied colour, transparency
uniform sampler2D picture;
in vec2 at;
in vec4 tone;
noperspective in float off;
out vec4 colour;
void main() {
    colour = tint;
    if (kind == 1) colour *= clamp(half_width + 0.5 - abs(off), 0, 1);
    if (kind == 2) {
        vec4 shown = texture(picture, at);
        shown.rgb = shown.rgb * veil.a + shown.a * veil.rgb;
        colour = (shown + (1 - shown.a) * tint) * opacity;
    }
    if (kind >= 3) colour = tone;
    if (kind == 4) colour *= clamp(at.y + 0.5 - abs(off), 0, 1);
    if (colour.a <= 0) discard;  // or it would hide by its depth what lies behind
}
"""
_FLAT, _LINE, _PICTURE, _SHADED, _BAND = range(5)
_CLEAR = (0.0, 0.0, 0.0, 1.0)  # nothing that a picture is seen through


def clip_from_pixels(size: Sequence[int]) -> np.ndarray:
    """(4, 4): clip space from pixels of a window, counted from its upper left corner; z is kept."""
    width, height = size
    matrix = np.diag([2 / width, -2 / height, 1.0, 1.0])
    matrix[:2, 3] = -1, 1
    return matrix


class Shapes:
    """Draws into the bound framebuffer and viewport, over what is there and hidden by what is nearer.

    Colours are (r, g, b) or (r, g, b, opacity), linear, not premultiplied. Space is whatever
    `clip_from_space` comes from: a (4, 4) projection × view matrix, float64.
    """

    def __init__(self):
        self._program = Program(_VERTEX, _FRAGMENT)
        self._vertices, self._shaded = (int(name) for name in GL.glGenVertexArrays(2))
        self._buffer = int(GL.glGenBuffers(1))
        self._sampler = int(GL.glGenSamplers(1))
        self._mipmapped = int(GL.glGenSamplers(1))
        for sampler, minified in (
            (self._sampler, GL.GL_LINEAR),
            (self._mipmapped, GL.GL_LINEAR_MIPMAP_LINEAR),
        ):
            for name, value in (
                (GL.GL_TEXTURE_MIN_FILTER, minified),
                (GL.GL_TEXTURE_MAG_FILTER, GL.GL_LINEAR),
                (GL.GL_TEXTURE_WRAP_S, GL.GL_CLAMP_TO_EDGE),
                (GL.GL_TEXTURE_WRAP_T, GL.GL_CLAMP_TO_EDGE),
            ):
                GL.glSamplerParameteri(sampler, name, value)
        with kept_state():
            GL.glBindBuffer(GL.GL_ARRAY_BUFFER, self._buffer)
            parts = ((0, 4, 0), (1, 2, 16), (2, 4, 24))
            for vertices, size, has in ((self._vertices, 24, parts[:2]), (self._shaded, 40, parts)):
                GL.glBindVertexArray(vertices)
                for location, count, start in has:
                    GL.glEnableVertexAttribArray(location)
                    GL.glVertexAttribPointer(location, count, GL.GL_FLOAT, False, size, GL.GLvoidp(start))

    def lines(
        self,
        clip_from_space: np.ndarray,
        segments: ArrayLike,
        colour: Sequence[float],
        width: float = 1.5,
        *,
        hidden: bool = True,
    ) -> None:
        """Straight lines with smooth edges, equally wide near and far.

        Parameters
        ----------
        segments
            (n, 2, 3) end points.
        width
            Pixels.
        hidden
            Whether what is nearer hides them.
        """
        segments = np.asarray(segments, np.float64).reshape(-1, 2, 3)
        viewport = integers(GL.GL_VIEWPORT, 4)
        if min(viewport[2:]) < 1:
            return
        vertices = ribbons(np.asarray(clip_from_space), segments, viewport[2:], width / 2)
        self._draw(GL.GL_TRIANGLES, vertices, _LINE, colour, half_width=width / 2, hidden=hidden)

    def bands(
        self, clip_from_space: np.ndarray, segments: ArrayLike, tones: ArrayLike, widths: ArrayLike
    ) -> None:
        """Pieces of lines, each with its colours and width, over everything; pieces of one line just touch.

        Parameters
        ----------
        segments
            (n, 2, 3) end points; those not before the near plane are left out.
        tones
            (n, 2, 4) of the ends: linear, premultiplied.
        widths
            (n,) pixels.
        """
        matrix, viewport = np.asarray(clip_from_space), integers(GL.GL_VIEWPORT, 4)
        segments = np.asarray(segments, np.float64).reshape(-1, 2, 3)
        clip = clipped(matrix, segments)
        before = (clip[..., 2] + clip[..., 3] > 0).all(1)
        if min(viewport[2:]) < 1 or not before.any():
            return
        half = np.asarray(widths, np.float64)[before, None] / 2
        vertices = ribbons(matrix, segments[before], viewport[2:], half, cap=0.0)
        vertices[:, 5] = np.repeat(half, 6)
        tones = np.asarray(tones, np.float64)[before][:, [end for end, _ in CORNERS]].reshape(-1, 4)
        self._draw(GL.GL_TRIANGLES, np.hstack([vertices, tones]), _BAND, _CLEAR, hidden=False)

    def triangles(self, clip_from_space: np.ndarray, corners: ArrayLike, tones: ArrayLike) -> None:
        """Triangles (n, 3, 3), over everything; their corners' colours (n, 3, 4), linear, premultiplied."""
        clip = clipped(np.asarray(clip_from_space), np.asarray(corners, np.float64).reshape(-1, 3))
        tones = np.asarray(tones, np.float64).reshape(-1, 4)
        vertices = np.hstack([clip, np.zeros((len(clip), 2)), tones])
        self._draw(GL.GL_TRIANGLES, vertices, _SHADED, _CLEAR, hidden=False)

    def polygon(
        self,
        clip_from_space: np.ndarray,
        corners: ArrayLike,
        colour: Sequence[float],
        *,
        hidden: bool = True,
    ) -> None:
        """A flat convex polygon of one colour; corners (n, 3) in order."""
        clip = clipped(np.asarray(clip_from_space), np.asarray(corners, np.float64))
        vertices = np.column_stack([clip, np.zeros((len(clip), 2))])
        self._draw(GL.GL_TRIANGLE_FAN, vertices, _FLAT, colour, hidden=hidden)

    def picture(
        self,
        clip_from_space: np.ndarray,
        corners: ArrayLike,
        texture: int,
        *,
        background: Sequence[float] = (0, 0, 0, 0),
        opacity: float = 1.0,
        veil: Sequence[float] = _CLEAR,
        mipmaps: bool = False,
        hidden: bool = True,
    ) -> None:
        """A texture on a parallelogram, such as an eye's picture on its wall.

        Parameters
        ----------
        corners
            (4, 3): lower left, lower right, upper right, upper left, as one sees the picture upright.
        texture
            OpenGL's name of it; linear, premultiplied.
        background
            Colour behind the picture; three numbers: opaque.
        veil
            What it is seen through: premultiplied colour, and transparency.
        mipmaps
            Use its smaller copies, which `EyeTarget.make_mipmaps` makes, where it is seen small.
        """
        clip = clipped(np.asarray(clip_from_space), np.asarray(corners, np.float64).reshape(4, 3))
        vertices = np.column_stack([clip, [(0, 0), (1, 0), (1, 1), (0, 1)]])
        sampler = self._mipmapped if mipmaps else self._sampler
        self._draw(
            GL.GL_TRIANGLE_FAN,
            vertices,
            _PICTURE,
            background,
            (texture, sampler),
            opacity=opacity,
            veil=veil,
            hidden=hidden,
        )

    def close(self) -> None:
        """Delete what it made."""
        if self._vertices:
            self._program.close()
            GL.glDeleteVertexArrays(2, [self._vertices, self._shaded])
            GL.glDeleteBuffers(1, [self._buffer])
            GL.glDeleteSamplers(2, [self._sampler, self._mipmapped])
            self._vertices = 0

    def _draw(
        self,
        primitive: int,
        vertices: np.ndarray,
        kind: int,
        colour: Sequence[float],
        picture: tuple[int, int] | None = None,
        *,
        half_width: float = 0.0,
        opacity: float = 1.0,
        veil: Sequence[float] = _CLEAR,
        hidden: bool,
    ) -> None:
        if not len(vertices):
            return
        encoding = GL.glIsEnabled(GL.GL_FRAMEBUFFER_SRGB)  # as the framebuffer's owner wants it
        with kept_state():
            if encoding:
                GL.glEnable(GL.GL_FRAMEBUFFER_SRGB)
            if hidden:
                GL.glEnable(GL.GL_DEPTH_TEST)
                GL.glDepthFunc(GL.GL_LEQUAL)
            if kind not in (
                _LINE,
                _BAND,
            ):  # outlines lie before what they outline, to the last pixel of their width
                GL.glEnable(GL.GL_POLYGON_OFFSET_FILL)
                GL.glPolygonOffset(2.5, 4)
            GL.glDepthMask(hidden)
            GL.glEnable(GL.GL_BLEND)
            GL.glBlendEquation(GL.GL_FUNC_ADD)
            GL.glBlendFunc(GL.GL_ONE, GL.GL_ONE_MINUS_SRC_ALPHA)
            GL.glUseProgram(self._program.name)
            GL.glBindVertexArray(self._shaded if kind >= _SHADED else self._vertices)
            GL.glBindBuffer(GL.GL_ARRAY_BUFFER, self._buffer)
            data = np.ascontiguousarray(vertices, np.float32)
            GL.glBufferData(GL.GL_ARRAY_BUFFER, data.nbytes, data, GL.GL_STREAM_DRAW)
            place = self._program.place
            red, green, blue, alpha = (*colour, 1.0)[:4]
            GL.glUniform4f(place("tint"), red * alpha, green * alpha, blue * alpha, alpha)
            GL.glUniform1i(place("kind"), kind)
            GL.glUniform1f(place("half_width"), half_width)
            GL.glUniform1f(place("opacity"), opacity)
            GL.glUniform4f(place("veil"), *(float(n) for n in veil))
            if picture:
                GL.glActiveTexture(GL.GL_TEXTURE0)
                GL.glBindTexture(GL.GL_TEXTURE_2D, picture[0])
                GL.glBindSampler(0, picture[1])
                GL.glUniform1i(place("picture"), 0)
            GL.glDrawArrays(primitive, 0, len(data))
