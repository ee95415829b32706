"""The preview's frames drawn with OpenGL, into whatever framebuffer is bound."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from time import perf_counter
from typing import Any

import numpy as np

import persp_sw as psw

from ..frame import Picture
from ..marks.shapes import MarkShapes
from ..present import Composer, EyeTarget, read_screen
from ..projection import clip_from_view_space
from ..room.outside import Colour, Dot, Label, Line, Sheet
from ..room.painter import BACKGROUND
from ..screen.gl_objects import Texture
from ..screen.lettering import lettered
from ..screen.shapes import Shapes, clip_from_pixels
from ..screen.text_overlay import Overlay
from .pictures import Composited, PreviewPictures
from .wanted import Wanted

# Of the distance to the pivot; nothing here tests depth.
_NEAR, _FAR = 0.02, 1000.0
_DISC = np.stack([np.cos(np.linspace(0, 2 * np.pi, 25)), np.sin(np.linspace(0, 2 * np.pi, 25))], -1)


def linear(colour: Colour) -> tuple[float, float, float]:
    """sRGB 0 … 255 as linear light 0 … 1."""
    code = np.array(colour) / 255
    red, green, blue = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4).tolist()
    return red, green, blue


class PreviewScreen:
    """Draws what a preview wants. Made, used and closed with one OpenGL context current.

    Parameters
    ----------
    warp
        "texture": OpenGL draws the eye images; "software": the processor does, and OpenGL shows what it drew.
    """

    def __init__(self, pictures: PreviewPictures, warp: str = "texture"):
        self.pictures, self.warp = pictures, warp
        self._texture = psw.TextureWarp()
        self._composer, self._shapes = Composer(), Shapes()
        self._marks = MarkShapes(self._shapes)
        self._targets: dict[str, EyeTarget] = {}
        self._overlays: dict[str, Overlay] = {}
        self._labels: dict[tuple[str, Colour], Texture] = {}
        self._uploaded: dict[str, psw.EyeImage] = {}
        self._upload_ms = 0.0  # of this frame

    @property
    def has_quad_buffers(self) -> bool:
        """Whether the bound framebuffer can show quad-buffered stereo."""
        return self._composer.has_quad_buffers()

    def draw(
        self,
        wanted: Wanted,
        done: Composited,
        texts: Callable[[Mapping[str, Any]], Iterable[tuple[str, int, str]]],
        *,
        first_row: int = 0,
        encode: bool = True,
    ) -> dict[str, Any]:
        """Draw a frame into the bound framebuffer.

        Parameters
        ----------
        texts
            Given the frame's figures, the texts over it: each with the height of its letters and its corner.
        first_row, encode
            As for `Composer.compose`.

        Returns
        -------
        The frame's figures. `upload_ms` and `warp_ms` are what this thread spent on them: a graphics card may
        go on by itself, until `finish`.
        """
        start = perf_counter()
        self._uploaded.clear()
        self._upload_ms = 0.0
        if wanted.outside:
            target = self._draw_room(wanted, done)
            shown, mode = {"left": target, "middle": target, "right": target}, "mono"
        else:
            shown, mode = self._draw_eyes(wanted, done.inside.pictures, "window"), wanted.stereo.shown_mode
        warp_ms = 1e3 * (perf_counter() - start) - self._upload_ms
        times = {"upload_ms": self._upload_ms, "warp_ms": warp_ms, "warp": self.warp}
        figures = {**done.statistics, **times}
        written = list(texts(figures))
        left, right = (shown[name] for name in wanted.stereo.channels)
        for target in {id(target): target for target in (left, right)}.values():
            with target.drawing(clear=False):
                for text, letter, corner in written:
                    self._overlay(corner, letter).draw(text, wanted.size, corner)
        self._composer.compose(
            left,
            right,
            mode,
            wanted.size,
            background=self.pictures.background,
            first_row=first_row,
            encode=encode,
        )
        return figures

    def finish(self) -> None:
        """Wait until all is drawn."""
        self._composer.finish()

    def choose_warp(self, wanted: Wanted, done: Composited) -> str:
        """The faster warp here, measured by drawing this frame; used from now on."""
        seconds = {}
        for self.warp in ("software", "texture"):
            for _ in range(2):  # the first time makes what is needed
                start = perf_counter()
                self.draw(wanted, done, lambda figures: ())
                read_screen((1, 1))  # waits for it
                seconds[self.warp] = perf_counter() - start
        self.warp = min(seconds, key=seconds.get)
        return self.warp

    def close(self) -> None:
        """Delete all that it made."""
        for part in (*self._targets.values(), *self._overlays.values(), *self._labels.values()):
            part.close()
        for part in (self._texture, self._composer, self._marks, self._shapes):
            part.close()

    def _draw_eyes(self, wanted: Wanted, pictures: Sequence[Picture], name: str) -> dict[str, EyeTarget]:
        """Targets by the eyes' names, each with its eye's picture of one wall, marks and all."""
        targets = {}
        for picture in pictures:
            target = targets[picture.eye] = self._target(f"{name} {picture.eye}", picture.view.size)
            if self.warp == "software":
                target.upload(self.pictures.warp(f"{name} {picture.eye}", picture.image, picture.view))
            else:
                self._upload(picture)
                with target.drawing():
                    self._texture.draw_view(picture.view, picture.eye)
            self._draw_marks(wanted, picture, target)
        return targets

    def _draw_marks(self, wanted: Wanted, picture: Picture, target: EyeTarget) -> None:
        veiled = self.pictures.marks.veiled(wanted, picture)
        if veiled is None:
            return
        with target.drawing(clear=False):
            size = picture.view.size if wanted.outside else wanted.size
            self._marks.draw(veiled, picture.view, size)
            if (made := self.pictures.marks.legend(wanted)) is not None:
                self._marks.draw_legend(*made, picture.view, wanted.size)

    def _draw_room(self, wanted: Wanted, done: Composited) -> EyeTarget:
        walls = {}
        for name in dict.fromkeys(picture.wall.name for picture in done.inside.pictures):
            own = [picture for picture in done.inside.pictures if picture.wall.name == name]
            eyes = self._draw_eyes(wanted, own, f"wall {name}")
            mode = wanted.stereo.shown_mode if len(eyes) == 2 else "mono"
            (left, right) = (
                (eyes[c] for c in wanted.stereo.channels) if len(eyes) == 2 else 2 * [*eyes.values()]
            )
            size = own[0].view.size
            walls[name] = wall = self._target(f"wall {name}", size)
            with wall.drawing():
                self._composer.compose(
                    left, right, mode, size, background=self.pictures.background, encode=False
                )
            wall.make_mipmaps()
        room = self._target("room", wanted.size)
        with room.drawing():
            painter = _RoomOnScreen(self, wanted, walls, done.outside)
            self.pictures.paint_room(painter, wanted, done)
        return room

    def _upload(self, picture: Picture) -> None:
        """An eye's image once a frame, for all the walls that show it."""
        if self._uploaded.get(picture.eye) is not picture.image:
            start = perf_counter()
            self._texture.upload(picture.image, picture.eye)
            self._uploaded[picture.eye] = picture.image
            self._upload_ms += 1e3 * (perf_counter() - start)

    def _target(self, name: str, size: Sequence[int]) -> EyeTarget:
        if name not in self._targets:
            self._targets[name] = EyeTarget(size)
        self._targets[name].resize(size)
        return self._targets[name]

    def _overlay(self, corner: str, letter: int) -> Overlay:
        if corner not in self._overlays:
            self._overlays[corner] = Overlay(self._shapes)
        self._overlays[corner].letter = letter
        return self._overlays[corner]

    def paint_volume(self, picture: Picture) -> None:
        """The volume as an eye sees it, over the whole bound framebuffer."""
        width, height = picture.view.size
        if self.warp == "texture":
            self._upload(picture)
            self._texture.draw_view(picture.view, picture.eye)
            return
        drawn = self._target(picture.eye, (width, height))
        drawn.upload(self.pictures.warp(picture.eye, picture.image, picture.view))
        corners = [(0, height, 0), (width, height, 0), (width, 0, 0), (0, 0, 0)]
        self._shapes.picture(clip_from_pixels((width, height)), corners, drawn.texture, hidden=False)

    def label(self, text: str, colour: Colour) -> Texture:
        """Words with a shadow as a texture, made once."""
        if (text, colour) not in self._labels:
            ink = np.pad(lettered(text, 14), ((0, 1), (0, 1)))
            shadow = np.roll(ink, (1, 1), (0, 1))
            alpha = ink + (1 - ink) * shadow
            rgb = ink[..., None] * np.array(linear(colour))
            texture = self._labels[text, colour] = Texture(ink.shape[::-1])
            texture.upload(np.concatenate([rgb, alpha[..., None]], -1))
        return self._labels[text, colour]


class _RoomOnScreen:
    """An `outside.Painter` that paints into the bound framebuffer."""

    def __init__(
        self, screen: PreviewScreen, wanted: Wanted, walls: Mapping[str, EyeTarget], volume: Picture | None
    ):
        camera, self._size = wanted.camera, wanted.size
        near, far = _NEAR * camera.distance, _FAR * camera.distance
        projection, view = clip_from_view_space(camera.position, camera.wall(wanted.size), near, far)
        self._clip_from_room, self._clip_from_pixels = projection @ view, clip_from_pixels(wanted.size)
        self._screen, self._shapes = screen, screen._shapes
        self._walls, self._volume = walls, volume
        width, height = wanted.size
        all_of_it = [(0, height, 0), (width, height, 0), (width, 0, 0), (0, 0, 0)]
        self._shapes.polygon(self._clip_from_pixels, all_of_it, linear(BACKGROUND), hidden=False)

    def sheet(self, sheet: Sheet, opacity: float = 1.0) -> None:
        texture = self._walls[sheet.name].texture
        self._shapes.picture(
            self._clip_from_room, sheet.corners, texture, opacity=opacity, mipmaps=True, hidden=False
        )

    def volume(self) -> None:
        if self._volume is not None:
            self._screen.paint_volume(self._volume)

    def lines(self, lines: Iterable[Line]) -> None:
        alike: dict[tuple[Colour, float], list[np.ndarray]] = {}
        for line in lines:
            alike.setdefault((line.colour, line.width), []).append(
                np.stack([line.points[:-1], line.points[1:]], 1)
            )
        for (colour, width), segments in alike.items():
            self._shapes.lines(
                self._clip_from_room, np.concatenate(segments), linear(colour), width, hidden=False
            )

    def dots(self, dots: Iterable[Dot]) -> None:
        for dot in dots:
            at = self._pixel(dot.point)
            if at is None:
                continue
            for radius, colour in ((dot.radius + 1, (0, 0, 0)), (dot.radius, dot.colour)):
                rim = np.column_stack([at + (radius - 0.5) * _DISC, np.zeros(len(_DISC))])
                edge = np.stack([rim[:-1], rim[1:]], 1)  # smooth, which polygons are not
                self._shapes.polygon(self._clip_from_pixels, rim[:-1], linear(colour), hidden=False)
                self._shapes.lines(self._clip_from_pixels, edge, linear(colour), 1.0, hidden=False)

    def labels(self, labels: Iterable[Label]) -> None:
        for label in labels:
            at = self._pixel(label.point)
            if at is None or not label.text:
                continue
            texture = self._screen.label(label.text, label.colour)
            width, height = texture.size
            left, top = np.round(at - ((width - 1) / 2, (height - 1) / 2))  # without its shadow
            corners = [(left, top + height, 0), (left + width, top + height, 0)]
            corners += [(left + width, top, 0), (left, top, 0)]
            self._shapes.picture(self._clip_from_pixels, corners, texture.name, hidden=False)

    def _pixel(self, point: np.ndarray) -> np.ndarray | None:
        """Where a room point is in the picture; None behind the camera."""
        x, y, _, w = self._clip_from_room @ (*point, 1.0)
        if w <= 0:
            return None
        width, height = self._size
        return np.array([(x / w + 1) * width / 2, (1 - y / w) * height / 2])
