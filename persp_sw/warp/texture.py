"""The texture warp: eye images drawn by OpenGL, in whatever context is current."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Image, Matrix
from ..errors import GraphicsError, ViewError
from ..eye_image import EyeImage
from ..geometry.view import View
from . import shaders
from .context import integers, opengl
from .gl_objects import Program, Texture
from .gl_state import drawing, uploading
from .moved import layers_for
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
        self._programs: dict[tuple[str, frozenset[str]], Program] = {}
        self._picture: Texture | None = None

    def upload(self, image: EyeImage, slot: str = "") -> None:
        """Take an eye image into a slot, in place of what was in it; its textures are used again.

        Cost: one upload, whatever the number of walls, and one more for each of its slabs. Contexts that
        share may draw it at once.
        """
        gl = _ready()
        old = self._slots.get(slot)
        textures = list(old.textures) if old else []
        images = (image, *image.slabs) if image.faces else ()
        for spare in textures[len(images) :] if images else ():
            spare.delete()
        with uploading():
            if images:
                textures += [None] * (len(images) - len(textures))
                textures = [self._filled(*each) for each in zip(textures, images, strict=False)]
        self._slots[slot] = _Slot(
            image, tuple(Quads(layer) for layer in (image, *image.slabs)), tuple(textures)
        )
        gl.glFlush()

    def draw(self, clip_from_world: Matrix, slot: str = "", depth_test: bool = True) -> None:
        """Lay a slot's faces over the picture that is there.

        Parameters
        ----------
        clip_from_world
            (4, 4), projection × view: world xyz1 to OpenGL's clip space. For the eye that the image was made
            for the picture is exact; for an eye that has moved since it is what a plane in the volume shows,
            or the image's slabs, one plane each, from behind to the front.
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
        layers = self._slots[slot].layers(clip_from_world)
        gl = _ready()
        if not layers:
            return
        image = layers[0].quads.image
        depth = depth_test and layers[0].quads.bounded
        faces = len(image.faces)
        options = {f"FACES {faces}": faces > 1, "PARALLEL": image.eye.is_at_infinity}
        options |= {"DEPTH": depth, "EXACT": self.precision == "float32"}
        options |= {
            "NEAR": depth and image.eye.near > 0,
            "PLANES": depth and len(image.half_spaces) > 0,
        }
        with drawing():
            program = self._use(shaders.face_sources, options)
            for layer in layers:
                program.set(**_face_uniforms(layer, options))
                layer.texture.bind()
                _draw(gl, program, layer.shown.outline, depth)

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
            Depth z / w of all of it, as `EyeImage.clip_depth` tells; None: it is in front of everything.
        """
        if picture.ndim != 3 or picture.shape[2] != 4 or picture.dtype != np.float32:
            raise ViewError(f"a picture is (h, w, 4) float32; given {picture.dtype} {picture.shape}")
        gl = _ready()
        height, width = picture.shape[:2]
        with uploading():
            self._picture = Texture.fitting(self._picture, "float32", (width, height, 0))
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
        held = [texture for slot in self._slots.values() for texture in slot.textures]
        for texture in [*held, self._picture]:
            if texture is not None:
                texture.delete()
        for program in self._programs.values():
            gl.glDeleteProgram(program.name)
        self._slots, self._programs, self._picture = {}, {}, None

    def __enter__(self) -> TextureWarp:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _filled(self, texture: Texture | None, image: EyeImage) -> Texture:
        """The texture, or another where it does not fit, with the faces of an image."""
        width, height = (max(face.size[axis] for face in image.faces) for axis in (0, 1))
        texture = Texture.fitting(texture, self.precision, (width, height, len(image.faces)))
        for number in range(len(image.faces)):
            texture.fill(image.face_pixels(number), number)
        return texture

    def _use(self, sources, options: dict[str, bool]) -> Program:
        chosen = frozenset(name for name, wanted in options.items() if wanted)
        key = sources.__name__, chosen
        if key not in self._programs:
            self._programs[key] = Program(*sources(chosen))
        program = self._programs[key]
        if not opengl().glIsProgram(program.name):
            raise GraphicsError(
                "this texture warp was made in another OpenGL context, which shares nothing with the current "
                "one: create the contexts as sharing, or make a texture warp for each"
            )
        opengl().glUseProgram(program.name)
        return program


class _Layer(NamedTuple):
    """An image to be drawn, and what a window shows of it."""

    quads: Quads
    texture: Texture
    shown: Shown | None


@dataclass(frozen=True, eq=False)
class _Slot:
    """An eye image; where its faces and those of its slabs, front to back, lie, and their textures.

    An image without faces keeps the textures that were there for the next one.
    """

    image: EyeImage
    quads: tuple[Quads, ...]
    textures: tuple[Texture, ...]

    def layers(self, clip_from_world: Matrix) -> list[_Layer]:
        """What to draw for a matrix's eye, the last on top; nothing where the window shows nothing."""
        if not self.image.faces:
            return []
        shift = self.quads[0].shift(clip_from_world)
        wanted = layers_for(self.image, np.zeros(3) if shift is None else shift)
        held = [each for each in zip(self.quads, self.textures, strict=True) if each[0].image in wanted]
        shown = [_Layer(quads, texture, quads.shown(clip_from_world)) for quads, texture in held[::-1]]
        return [layer for layer in shown if layer.shown is not None]


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


def _face_uniforms(layer: _Layer, options: dict[str, bool]) -> dict[str, NDArray | np.generic]:
    quads, shown = layer.quads, layer.shown
    image = quads.image
    uniforms = {
        "texels": np.int32(0),
        "face_from_ndc": shown.face_from_ndc,
        "last": np.array([face.size for face in image.faces]) - 1,
    }
    if len(image.faces) > 1:
        uniforms |= {"middle": quads.middles, "pitch": np.float32(image.faces[0].pitch)}
        uniforms |= {"alone": np.float32(image.alone)}
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


def _draw(gl, program: Program, outline: NDArray, depth: bool) -> None:
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
    version = *integers(gl.GL_MAJOR_VERSION), *integers(gl.GL_MINOR_VERSION)
    return version >= (4, 5) and integers(gl.GL_CLIP_DEPTH_MODE) == [gl.GL_ZERO_TO_ONE]
