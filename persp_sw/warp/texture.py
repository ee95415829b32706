"""The texture warp: eye images drawn by OpenGL, in whatever context is current."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Image, Matrix
from ..errors import GraphicsError, ViewError
from ..eye_image import EyeImage
from ..geometry.view import View
from . import shaders
from .context import opengl
from .gl_state import drawing, uploading
from .quads import Quads, Shown


_VIEWPORT = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], np.float32)
# Depths of a view that says none: as parts of the wall's distance from the eye.
_NEAR, _FAR = 1e-3, 1e3


class TextureWarp:
    """Draws eye images into the framebuffer and viewport that are bound, in any OpenGL 3.3 context.

    Textures and programs belong to the context that is current at the first call, and serve all contexts that
    share with it. All of OpenGL's state is afterwards as it was before.

    Parameters
    ----------
    precision
        How textures hold pixels. "float32": the software warp's picture, to 1e-4. "float16": half the memory,
        to 1e-3. "rgba8": a quarter, to 6e-3. "auto": "float32", the fastest wherever the processor that
        composites also uploads; see `benchmarks/texture_warp.py`.

    Raises
    ------
    GraphicsError
        No such precision.
    """

    PRECISIONS = ("auto", "float32", "float16", "rgba8")

    def __init__(self, precision: str = "auto"):
        if precision not in self.PRECISIONS:
            raise GraphicsError(f"precision is one of {', '.join(self.PRECISIONS)}; given {precision!r}")
        self.precision = "float32" if precision == "auto" else precision
        self._slots: dict[str, _Slot] = {}
        self._programs: dict[tuple[str, frozenset[str]], _Program] = {}
        self._picture: _Texture | None = None

    def upload(self, image: EyeImage, slot: str = "") -> None:
        """Take an eye image into a slot, in place of what was in it; its texture is used again.

        Cost: one upload, whatever the number of walls. Contexts that share may draw it at once.
        """
        gl = _ready()
        old = self._slots.get(slot)
        texture = old.texture if old else None
        with uploading():
            if image.faces:
                width, height = (max(face.size[axis] for face in image.faces) for axis in (0, 1))
                size = (width, height, len(image.faces))
                texture = _Texture.fitting(texture, self.precision, size)
                for number in range(len(image.faces)):
                    texture.fill(image.face_pixels(number), number)
        self._slots[slot] = _Slot(image, Quads(image), texture)
        gl.glFlush()

    def draw(self, clip_from_world: Matrix, slot: str = "", depth_test: bool = True) -> None:
        """Lay a slot's faces over the picture that is there.

        Parameters
        ----------
        clip_from_world
            (4, 4), projection × view: world xyz1 to OpenGL's clip space. For the eye that the image was made
            for the picture is exact; for an eye that has moved since it is what a plane in the volume shows.
        slot
            As given to `upload`; an image without faces draws nothing.
        depth_test
            Whether depths count. Each ray has the depth of the middle of what is shown of the volume on it:
            so polygons in front of the volume hide it, and those behind shine through. Near and far planes
            clip nothing; depths beyond them count as theirs. Off saves a part of the time.

        Raises
        ------
        GraphicsError
            No current context, one too old or one that shares nothing with that of the upload.
        ViewError
            No such slot or no matrix.
        """
        if slot not in self._slots:
            raise ViewError(f"nothing was uploaded to the slot {slot!r}; there are {list(self._slots)}")
        held = self._slots[slot]
        shown = held.quads.shown(clip_from_world)
        gl = _ready()
        if shown is None or held.texture is None:
            return
        depth = depth_test and held.quads.bounded
        options = {"SEVERAL": len(held.image.faces) > 1, "PARALLEL": held.image.eye.is_at_infinity}
        options |= {"DEPTH": depth, "EXACT": self.precision == "float32"}
        with drawing():
            program = self._use(shaders.face_sources, options)
            program.set(**_face_uniforms(held, shown, options))
            held.texture.bind()
            _draw(gl, program, shown.outline, depth)

    def draw_view(
        self, view: View, slot: str = "", near: float | None = None, far: float | None = None
    ) -> None:
        """Lay a slot's faces over what is there, as a view's picture; without near and far at no depth.

        `near` and `far` as for `View.clip_from_world`.
        """
        depth_test = near is not None and far is not None
        if not depth_test:
            near, far = (-1, 1) if view.eye.is_at_infinity else np.array([_NEAR, _FAR]) * view.wall_distance
        self.draw(view.clip_from_world(float(near), float(far)), slot, depth_test)

    def draw_picture(self, picture: Image, clip_depth: float | None = None) -> None:
        """Lay a picture, the software warp's for example, over the whole viewport.

        Parameters
        ----------
        picture
            (h, w, 4) float32, linear, premultiplied, row 0 on top; pixel by pixel where the viewport is as
            large, else the nearest pixel's.
        clip_depth
            Depth z / w of all of it, as `depth_of` tells; None: whatever the depths, it is in front.
        """
        if picture.ndim != 3 or picture.shape[2] != 4 or picture.dtype != np.float32:
            raise ViewError(f"a picture is (h, w, 4) float32; given {picture.dtype} {picture.shape}")
        gl = _ready()
        height, width = picture.shape[:2]
        with uploading():
            self._picture = _Texture.fitting(self._picture, "float32", (width, height, 0))
            self._picture.fill(np.ascontiguousarray(picture), 0)
        depth = clip_depth is not None
        with drawing():
            program = self._use(shaders.picture_sources, {"DEPTH": depth})
            program.set(picture=np.int32(0), clip_depth=np.float32(clip_depth or 0))
            self._picture.bind()
            _draw(gl, program, _VIEWPORT, depth)

    def close(self) -> None:
        """Delete all that was made; the context, or one that shares with it, must be current."""
        gl = opengl()
        for texture in [*(held.texture for held in self._slots.values()), self._picture]:
            if texture is not None:
                texture.delete()
        for program in self._programs.values():
            gl.glDeleteProgram(program.name)
        self._slots, self._programs, self._picture = {}, {}, None

    def __enter__(self) -> TextureWarp:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _use(self, sources, options: dict[str, bool]) -> _Program:
        chosen = frozenset(name for name, wanted in options.items() if wanted)
        key = sources.__name__, chosen
        if key not in self._programs:
            self._programs[key] = _Program(*sources(chosen))
        program = self._programs[key]
        if not opengl().glIsProgram(program.name):
            raise GraphicsError(
                "this texture warp was made in another OpenGL context, which shares nothing with the current "
                "one: create the contexts as sharing, or make a texture warp for each"
            )
        opengl().glUseProgram(program.name)
        return program


@dataclass(frozen=True, eq=False)
class _Slot:
    image: EyeImage
    quads: Quads
    texture: _Texture | None


class _Texture:
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
        largest = int(gl.glGetIntegerv(gl.GL_MAX_TEXTURE_SIZE))
        if max(size[:2]) > largest:
            raise GraphicsError(
                f"an eye image of {size[0]}×{size[1]} pixels is larger than OpenGL's textures here, {largest}: "
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
    def fitting(cls, old: _Texture | None, precision: str, size: tuple[int, int, int]) -> _Texture:
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
        gl = opengl()
        self.bind()
        height, width = pixels.shape[:2]
        data = _stored(pixels, self.precision)
        if self.size[2]:
            corner = 0, 0, layer, width, height, 1
            gl.glTexSubImage3D(self._target, 0, *corner, gl.GL_RGBA, self._type, data)
        else:
            gl.glTexSubImage2D(self._target, 0, 0, 0, width, height, gl.GL_RGBA, self._type, data)

    def bind(self) -> None:
        opengl().glBindTexture(self._target, self.name)

    def delete(self) -> None:
        opengl().glDeleteTextures([self.name])


class _Program:
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


def _ready():
    """OpenGL's functions, once a context that can do what we need is current."""
    gl = opengl()
    version = gl.glGetString(gl.GL_VERSION)
    text = "" if version is None else version.decode(errors="replace")
    if not text:
        raise GraphicsError("no OpenGL context is current: make one current, or use an OffscreenContext")
    numbers = text.split()[0].split(".")
    if not text[0].isdigit() or (int(numbers[0]), int(numbers[1])) < (3, 3):
        raise GraphicsError(f"the texture warp needs OpenGL 3.3; the current context is {text!r}")
    return gl


def _stored(pixels: Image, precision: str) -> NDArray:
    if precision == "float32":
        return pixels
    if precision == "float16":
        return pixels.astype(np.float16)
    scaled = np.multiply(pixels, np.float32(255))
    scaled += np.float32(0.5)
    return np.clip(scaled, 0, 255, out=scaled).astype(np.uint8)


def _face_uniforms(held: _Slot, shown: Shown, options: dict[str, bool]) -> dict[str, NDArray | np.generic]:
    image, quads = held.image, held.quads
    uniforms = {
        "texels": np.int32(0),
        "face_from_ndc": shown.face_from_ndc,
        "last": np.array([face.size for face in image.faces]) - 1,
    }
    if options["SEVERAL"]:
        pitch = np.float32(image.faces[0].pitch)
        uniforms |= {"faces": np.int32(len(image.faces)), "middle": quads.middles, "pitch": pitch}
    if options["DEPTH"]:
        planes = image.half_spaces[: shaders.MOST_PLANES].copy()
        planes[:, 3] += planes[:, :3] @ quads.base
        uniforms |= {
            "start_from_face": quads.start_from_face[:1],
            "object_from_face": quads.object_from_face,
            "low": (image.box[0] - quads.base)[None],
            "high": (image.box[1] - quads.base)[None],
            "planes": np.int32(len(planes)),
            "plane": planes,
            "world_from_object": image.world_from_object[None, :3, :3],
            "nearest": np.float32(image.eye.near),
            "depth_from_object": shown.depth_from_object[None],
        }
    return uniforms


def _draw(gl, program: _Program, outline: NDArray, depth: bool) -> None:
    """Fill a convex polygon; with a vertex array of the moment, for contexts do not share them."""
    program.set(outline=outline)
    if depth:
        program.set(window_from_depth=np.array([(1, 0) if _zero_to_one(gl) else (0.5, 0.5)]))
    else:
        gl.glDisable(gl.GL_DEPTH_TEST)
    vertex_array = gl.glGenVertexArrays(1)
    gl.glBindVertexArray(vertex_array)
    gl.glDrawArrays(gl.GL_TRIANGLE_FAN, 0, len(outline))
    gl.glDeleteVertexArrays(1, [vertex_array])


def _zero_to_one(gl) -> bool:
    """Whether the host's clip space has depths 0 … 1 (glClipControl, OpenGL 4.5)."""
    if (int(gl.glGetIntegerv(gl.GL_MAJOR_VERSION)), int(gl.glGetIntegerv(gl.GL_MINOR_VERSION))) < (4, 5):
        return False
    return np.ravel(gl.glGetIntegerv(gl.GL_CLIP_DEPTH_MODE))[0] == gl.GL_ZERO_TO_ONE
