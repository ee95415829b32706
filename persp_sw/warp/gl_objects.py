"""Textures and programs, as the texture warp needs them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Image
from ..errors import GraphicsError
from .context import integers, opengl


class Texture:
    """A picture (depth 0) or a stack of them, in OpenGL's memory."""

    def __init__(self, precision: str, size: tuple[int, int, int]):
        gl = opengl()
        self.precision, self.size = precision, size
        self._target = gl.GL_TEXTURE_2D_ARRAY if size[2] else gl.GL_TEXTURE_2D
        stored, self._type, self._filter = {
            "float32": (gl.GL_RGBA32F, gl.GL_FLOAT, gl.GL_NEAREST),
            "float16": (gl.GL_RGBA16F, gl.GL_HALF_FLOAT, gl.GL_LINEAR),
            "rgba8": (gl.GL_RGBA8, gl.GL_UNSIGNED_BYTE, gl.GL_LINEAR),
        }[precision]
        (largest,) = integers(gl.GL_MAX_TEXTURE_SIZE)
        if max(size[:2]) > largest:
            raise GraphicsError(
                f"an eye image of {size[0]}×{size[1]} pixels exceeds this OpenGL's textures, {largest}: "
                "lower the quality or max_intermediate"
            )
        self.name = gl.glGenTextures(1)
        self.bind()
        form = self._target, 0, stored
        if size[2]:
            gl.glTexImage3D(*form, *size, 0, gl.GL_RGBA, self._type, None)
        else:
            gl.glTexImage2D(*form, *size[:2], 0, gl.GL_RGBA, self._type, None)
        for key in (gl.GL_TEXTURE_MIN_FILTER, gl.GL_TEXTURE_MAG_FILTER):
            gl.glTexParameteri(self._target, key, self._filter)
        for key in (gl.GL_TEXTURE_WRAP_S, gl.GL_TEXTURE_WRAP_T):
            gl.glTexParameteri(self._target, key, gl.GL_CLAMP_TO_EDGE)
        gl.glTexParameteri(self._target, gl.GL_TEXTURE_MAX_LEVEL, 0)

    @classmethod
    def fitting(cls, old: Texture | None, precision: str, size: tuple[int, int, int]) -> Texture:
        """The old one if it holds so much and not far more, else a new one in its place.

        A picture's size must be its own.
        """
        if old is not None:
            fits = (
                old.size == size if not size[2] else all(a >= b for a, b in zip(old.size, size, strict=True))
            )
            if fits and np.prod(old.size) <= 4 * np.prod(size):
                return old
            old.delete()
        return cls(precision, size)

    def fill(self, pixels: Image, layer: int) -> None:
        """Put (h, w, 4) float32 pixels, row 0 first, into the corner of a layer."""
        gl = opengl()
        self.bind()
        height, width = pixels.shape[:2]
        data = stored_pixels(pixels, self.precision)
        if self.size[2]:
            corner = 0, 0, layer, width, height, 1
            gl.glTexSubImage3D(self._target, 0, *corner, gl.GL_RGBA, self._type, data)
        else:
            gl.glTexSubImage2D(self._target, 0, 0, 0, width, height, gl.GL_RGBA, self._type, data)

    def bind(self) -> None:
        """To the active texture unit."""
        opengl().glBindTexture(self._target, self.name)

    def delete(self) -> None:
        """Give the memory back."""
        opengl().glDeleteTextures([self.name])


class Program:
    """A linked program and where its uniforms are."""

    def __init__(self, vertex: str, fragment: str):
        gl = opengl()
        parts = []
        for kind, source in ((gl.GL_VERTEX_SHADER, vertex), (gl.GL_FRAGMENT_SHADER, fragment)):
            part = gl.glCreateShader(kind)
            gl.glShaderSource(part, source)
            gl.glCompileShader(part)
            parts.append(part)
        self.name = gl.glCreateProgram()
        for part in parts:
            gl.glAttachShader(self.name, part)
        gl.glLinkProgram(self.name)
        logs = [gl.glGetShaderInfoLog(part) for part in parts] + [gl.glGetProgramInfoLog(self.name)]
        for part in parts:
            gl.glDetachShader(self.name, part)
            gl.glDeleteShader(part)
        if not gl.glGetProgramiv(self.name, gl.GL_LINK_STATUS):
            text = " ".join(log.decode(errors="replace") if isinstance(log, bytes) else log for log in logs)
            raise GraphicsError(f"this OpenGL does not take our shaders: {text.strip()}")
        self._places: dict[str, int] = {}

    def set(self, **values: NDArray | np.generic) -> None:
        """Uniforms by name; int32 and float32 numbers, (n, k) vectors, (n, rows, columns) matrices."""
        gl = opengl()
        for name, value in values.items():
            place = self._places.get(name)
            if place is None:
                place = self._places[name] = gl.glGetUniformLocation(self.name, name)
            if place < 0:  # unused in this variant
                continue
            if isinstance(value, np.generic):
                (gl.glUniform1i if value.dtype == np.int32 else gl.glUniform1f)(place, value.item())
                continue
            value = np.ascontiguousarray(value, np.float32)
            if value.ndim == 2:
                functions = {2: gl.glUniform2fv, 3: gl.glUniform3fv, 4: gl.glUniform4fv}
                functions[value.shape[1]](place, len(value), value)
            else:
                functions = {(3, 3): gl.glUniformMatrix3fv, (2, 4): gl.glUniformMatrix4x2fv}
                functions[value.shape[1:]](place, len(value), gl.GL_TRUE, value)


def stored_pixels(pixels: Image, precision: str) -> NDArray:
    """Pixels as a texture of that precision holds them."""
    if precision == "float32":
        return pixels
    if precision == "float16":
        return pixels.astype(np.float16)
    scaled = np.multiply(pixels, np.float32(255))
    scaled += np.float32(0.5)
    return np.clip(scaled, 0, 255, out=scaled).astype(np.uint8)
