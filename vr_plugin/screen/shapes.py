"""Lines, flat polygons and pictures in space, drawn with OpenGL: a room seen from outside, text, frames.

In whatever 3.3 core context is current; one `Shapes` for each context. State is left as it was.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from OpenGL import GL

from .gl_objects import Program, integers, kept_state

_VERTEX = """
layout(location = 0) in vec4 clip;
layout(location = 1) in vec2 place;  // in the picture, 0 … 1; of a line: x is the pixels from its middle
out vec2 at;
noperspective out float off;
void main() {
    gl_Position = clip;
    at = place;
    off = place.x;
}
"""

_FRAGMENT = """
uniform int kind;  // 0: flat, 1: line, 2: picture
uniform vec4 tint;  // premultiplied; behind a picture
uniform float half_width;
uniform float opacity;
uniform sampler2D picture;
in vec2 at;
noperspective in float off;
out vec4 colour;
void main() {
    colour = tint;
    if (kind == 1) colour *= clamp(half_width + 0.5 - abs(off), 0, 1);
    if (kind == 2) {
        vec4 shown = texture(picture, at);
        colour = (shown + (1 - shown.a) * tint) * opacity;
    }
    if (colour.a <= 0) discard;  // or it would hide by its depth what lies behind
}
"""
_FLAT, _LINE, _PICTURE = 0, 1, 2


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
        self._vertices, self._buffer = int(GL.glGenVertexArrays(1)), int(GL.glGenBuffers(1))
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
            GL.glBindVertexArray(self._vertices)
            GL.glBindBuffer(GL.GL_ARRAY_BUFFER, self._buffer)
            for location, count, start in ((0, 4, 0), (1, 2, 16)):
                GL.glEnableVertexAttribArray(location)
                GL.glVertexAttribPointer(location, count, GL.GL_FLOAT, False, 24, GL.GLvoidp(start))

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
        vertices = _ribbons(np.asarray(clip_from_space), segments, viewport[2:], width / 2)
        self._draw(GL.GL_TRIANGLES, vertices, _LINE, colour, half_width=width / 2, hidden=hidden)

    def polygon(
        self,
        clip_from_space: np.ndarray,
        corners: ArrayLike,
        colour: Sequence[float],
        *,
        hidden: bool = True,
    ) -> None:
        """A flat convex polygon of one colour; corners (n, 3) in order."""
        clip = _clip(np.asarray(clip_from_space), np.asarray(corners, np.float64))
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
        mipmaps
            Use its smaller copies, which `EyeTarget.make_mipmaps` makes, where it is seen small.
        """
        clip = _clip(np.asarray(clip_from_space), np.asarray(corners, np.float64).reshape(4, 3))
        vertices = np.column_stack([clip, [(0, 0), (1, 0), (1, 1), (0, 1)]])
        sampler = self._mipmapped if mipmaps else self._sampler
        self._draw(
            GL.GL_TRIANGLE_FAN,
            vertices,
            _PICTURE,
            background,
            (texture, sampler),
            opacity=opacity,
            hidden=hidden,
        )

    def close(self) -> None:
        """Delete what it made."""
        if self._vertices:
            self._program.close()
            GL.glDeleteVertexArrays(1, [self._vertices])
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
            if kind != _LINE:  # outlines lie before what they outline, to the last pixel of their width
                GL.glEnable(GL.GL_POLYGON_OFFSET_FILL)
                GL.glPolygonOffset(2.5, 4)
            GL.glDepthMask(hidden)
            GL.glEnable(GL.GL_BLEND)
            GL.glBlendEquation(GL.GL_FUNC_ADD)
            GL.glBlendFunc(GL.GL_ONE, GL.GL_ONE_MINUS_SRC_ALPHA)
            GL.glUseProgram(self._program.name)
            GL.glBindVertexArray(self._vertices)
            GL.glBindBuffer(GL.GL_ARRAY_BUFFER, self._buffer)
            data = np.ascontiguousarray(vertices, np.float32)
            GL.glBufferData(GL.GL_ARRAY_BUFFER, data.nbytes, data, GL.GL_STREAM_DRAW)
            place = self._program.place
            red, green, blue, alpha = (*colour, 1.0)[:4]
            GL.glUniform4f(place("tint"), red * alpha, green * alpha, blue * alpha, alpha)
            GL.glUniform1i(place("kind"), kind)
            GL.glUniform1f(place("half_width"), half_width)
            GL.glUniform1f(place("opacity"), opacity)
            if picture:
                GL.glActiveTexture(GL.GL_TEXTURE0)
                GL.glBindTexture(GL.GL_TEXTURE_2D, picture[0])
                GL.glBindSampler(0, picture[1])
                GL.glUniform1i(place("picture"), 0)
            GL.glDrawArrays(primitive, 0, len(data))


def _clip(clip_from_space: np.ndarray, points: np.ndarray) -> np.ndarray:
    return points @ clip_from_space[:, :3].T + clip_from_space[:, 3]


def _ribbons(
    clip_from_space: np.ndarray, segments: np.ndarray, viewport: Sequence[int], half: float
) -> np.ndarray:
    """(6 n, 6): two triangles for each segment before the near plane: clip position, pixels off its line."""
    ends = _clip(clip_from_space, segments)
    before = ends[..., 2] + ends[..., 3]  # 0 on the near plane
    ends, before = ends[(before > 0).any(1)], before[(before > 0).any(1)]
    if not len(ends):
        return np.empty((0, 6))
    change = before[:, 1] - before[:, 0]
    part = np.clip(-before[:, 0] / np.where(change == 0, 1, change), 0, 1)[:, None]
    cut = ends[:, 0] + part * (ends[:, 1] - ends[:, 0])
    for end in (0, 1):
        ends[:, end] = np.where(before[:, [end]] < 0, cut, ends[:, end])
    pixels = np.asarray(viewport, np.float64) / 2
    w = np.maximum(ends[..., 3:], np.finfo(np.float64).tiny)
    on_screen = ends[..., :2] / w * pixels
    along = on_screen[:, 1] - on_screen[:, 0]
    length = np.linalg.norm(along, axis=1, keepdims=True)
    along = np.where(length > 1e-9, along / np.maximum(length, 1e-9), [1.0, 0.0])
    across = np.stack([-along[:, 1], along[:, 0]], -1)
    reach = half + 1  # a pixel for the smooth edge
    vertices = []
    for end, side in ((0, -1), (1, -1), (1, 1), (0, -1), (1, 1), (0, 1)):
        corner = on_screen[:, end] + side * reach * across + (2 * end - 1) * half * along
        xy = corner / pixels * w[:, end]
        off = np.full((len(xy), 1), side * reach)
        vertices.append(np.concatenate([xy, ends[:, end, 2:], off, np.zeros_like(off)], 1))
    return np.stack(vertices, 1).reshape(-1, 6)
