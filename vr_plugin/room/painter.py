"""Paints a room seen from outside, on the processor: walls with their pictures, lines, dots, words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

import persp_sw as psw

from ..cameras import Camera
from ..screen.lettering import lettered
from .outside import Colour, Dot, Label, Line, Sheet

NEAREST = 0.02  # of the pivot's distance: what is nearer to the camera is not painted
FINE = 2  # lines are drawn so many times finer, then averaged
BACKGROUND: Colour = (24, 26, 31)

_FINE_STEPS = 4096
_ENCODED = np.rint(255 * psw.images.srgb(np.linspace(0, 1, _FINE_STEPS))).astype(np.uint8)
_CODES = np.arange(256) / 255
_LINEAR = np.where(_CODES <= 0.04045, _CODES / 12.92, ((_CODES + 0.055) / 1.055) ** 2.4).astype(np.float32)


def encoded(rgb: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Linear light as sRGB bytes, to one of their steps: by a table, whose steps are narrower everywhere."""
    return _ENCODED[np.clip(rgb * (_FINE_STEPS - 1) + 0.5, 0, _FINE_STEPS - 1).astype(np.int16)]


class RoomPainter:
    """A picture of the room under way: an `outside.Painter`.

    Parameters
    ----------
    camera
        In room space.
    size
        Width and height, pixels.
    pictures
        Of walls, by name: (h, w, 3) sRGB.
    volume
        As the camera sees it: (h, w, 4) linear, premultiplied, of the whole size. None: it is not shown.
    """

    def __init__(
        self,
        camera: Camera,
        size: tuple[int, int],
        pictures: Mapping[str, NDArray[np.uint8]],
        volume: NDArray[np.float32] | None = None,
    ):
        self.view = psw.View.through_wall(camera.position, camera.wall(size))
        self.size = size
        self._matrix = self.view.viewport_from_world
        self._image = Image.new("RGB", size, BACKGROUND)
        self._pictures, self._volume = pictures, volume

    def pixels(self, points: np.ndarray) -> np.ndarray:
        """(n, 3): homogeneous pixel positions of room points (n, 3); the last is 1 at the pivot's depth."""
        return np.asarray(points, np.float64) @ self._matrix[:, :3].T + self._matrix[:, 3]

    def sheet(self, sheet: Sheet, opacity: float = 1.0) -> None:
        """A wall with its picture."""
        corners, picture = sheet.corners, self._pictures[sheet.name]
        shape = _clipped(self.pixels(corners), self.size, closed=True)
        if len(shape) < 3:
            return
        x0, y0 = np.maximum(np.floor(shape.min(0)), 0).astype(int)
        x1, y1 = np.minimum(np.ceil(shape.max(0)), self.size).astype(int)
        if x0 >= x1 or y0 >= y1:
            return
        height, width = picture.shape[:2]
        across, down = (corners[1] - corners[0]) / width, (corners[0] - corners[3]) / height
        room_from_texel = np.column_stack([across, down, corners[3]])
        pixel_from_texel = self._matrix[:, :3] @ room_from_texel
        pixel_from_texel[:, 2] += self._matrix[:, 3]
        determinant = np.linalg.det(pixel_from_texel)
        if abs(determinant) < 1e-12 * np.prod(np.linalg.norm(pixel_from_texel, axis=0)):
            return  # seen edge-on
        texel_from_pixel = np.linalg.inv(pixel_from_texel) @ np.array([[1, 0, x0], [0, 1, y0], [0, 0, 1.0]])
        with np.errstate(divide="ignore", invalid="ignore"):
            texel_from_pixel /= texel_from_pixel[2, 2]
        if not np.isfinite(texel_from_pixel).all():
            return
        box = (x1 - x0, y1 - y0)
        source = Image.fromarray(np.ascontiguousarray(picture))
        warped = source.transform(
            box, Image.Transform.PERSPECTIVE, texel_from_pixel.ravel()[:8].tolist(), Image.Resampling.BILINEAR
        )
        mask = Image.new("L", (box[0] * FINE, box[1] * FINE))
        ImageDraw.Draw(mask).polygon(
            [tuple(p) for p in (shape - (x0, y0)) * FINE - 0.5], round(255 * opacity)
        )
        self._image.paste(warped, (int(x0), int(y0)), mask.reduce(FINE))

    def volume(self) -> None:
        """The volume as the camera sees it, if it is to be shown."""
        picture = self._volume
        if picture is None:
            return
        rows, columns = picture[..., 3].any(1), picture[..., 3].any(0)
        if not rows.any():
            return
        (y0, y1), (x0, x1) = (np.flatnonzero(seen)[[0, -1]] + (0, 1) for seen in (rows, columns))
        part = picture[y0:y1, x0:x1]
        under = _LINEAR[np.asarray(self._image.crop((x0, y0, x1, y1)))]
        mixed = encoded(part[..., :3] + (1 - part[..., 3:]) * under)
        self._image.paste(Image.fromarray(mixed), (int(x0), int(y0)))

    def lines(self, lines: Iterable[Line]) -> None:
        """Lines, what is behind the camera cut off."""
        alike: dict[tuple[Colour, float], list[np.ndarray]] = {}
        for line in lines:
            for piece in _pieces(self.pixels(line.points), self.size):
                alike.setdefault((line.colour, line.width), []).append(piece)
        for (colour, width), pieces in alike.items():
            self._ink(colour, pieces, width)

    def dots(self, dots: Iterable[Dot]) -> None:
        """Discs, each with a dark rim."""
        for dot in dots:
            (x, y, w) = self.pixels(dot.point[None])[0]
            if w > NEAREST:
                for colour, radius in (((0, 0, 0), dot.radius + 1), (dot.colour, dot.radius)):
                    self._ink(colour, [np.array([[x / w, y / w]])], 2 * radius)

    def labels(self, labels: Iterable[Label], letter: int = 14) -> None:
        """Words over everything, with a shadow."""
        for label in labels:
            x, y, w = self.pixels(label.point[None])[0]
            if w > NEAREST and label.text:
                ink = Image.fromarray(np.rint(255 * lettered(label.text, letter)).astype(np.uint8))
                place = round(x / w - ink.width / 2), round(y / w - ink.height / 2)
                self._image.paste((0, 0, 0), (place[0] + 1, place[1] + 1), ink)
                self._image.paste(label.colour, place, ink)

    def finished(self) -> NDArray[np.float32]:
        """(h, w, 4) float32, linear, opaque."""
        picture = np.ones((self.size[1], self.size[0], 4), np.float32)
        picture[..., :3] = _LINEAR[np.asarray(self._image)]
        return picture

    def _ink(self, colour: Colour, pieces: Sequence[np.ndarray], width: float) -> None:
        """Polylines, or discs where one has a single point, anti-aliased."""
        points = np.concatenate(pieces)
        low = np.clip(np.floor(points.min(0) - width - 1), 0, self.size).astype(int)
        high = np.clip(np.ceil(points.max(0) + width + 1), 0, self.size).astype(int)
        if (low >= high).any():
            return
        mask = Image.new("L", tuple(((high - low) * FINE).tolist()))
        draw = ImageDraw.Draw(mask)
        # Pillow draws around its pixels' centres at whole numbers; even widths lean to one side.
        wide = 2 * round((width * FINE - 1) / 2) + 1
        for piece in pieces:
            at = [tuple(p) for p in np.rint((piece - low) * FINE - 0.5).tolist()]
            if len(at) == 1:
                draw.circle(at[0], width / 2 * FINE, 255)
            else:
                draw.line(at, 255, wide, joint="curve")
        self._image.paste(colour, tuple(low.tolist()), mask.reduce(FINE))


def _pieces(points: np.ndarray, size: tuple[int, int]) -> list[np.ndarray]:
    """Polylines (n, 2) in pixels: what of a homogeneous one lies before the camera, near the picture."""
    if (_within(points, size) > 0).all():
        return [points[:, :2] / points[:, 2:]]
    parts = (_clipped(np.array(pair), size, closed=False) for pair in pairwise(points))
    return [part for part in parts if len(part) == 2]


def _clipped(points: np.ndarray, size: tuple[int, int], closed: bool) -> np.ndarray:
    """(m, 2) pixels: a homogeneous polygon, or a line of two points, cut to what lies near the picture."""
    for number in range(len(_within(points, size))):
        heights = _within(points, size)[number]
        kept = []
        last = len(points) if closed else len(points) - 1
        for i in range(last):
            a, b, here, there = (
                points[i],
                points[i - len(points) + 1],
                heights[i],
                heights[i - len(points) + 1],
            )
            if here > 0:
                kept.append(a)
            if (here > 0) != (there > 0):
                kept.append(a + here / (here - there) * (b - a))
        if not closed and heights[-1] > 0:
            kept.append(points[-1])
        points = np.array(kept).reshape(-1, 3)
        if not len(points):
            break
    return points[:, :2] / points[:, 2:]


def _within(points: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """(5, n): all above 0 for homogeneous points before the camera that are within a picture's size of it."""
    x, y, w = points.T
    width, height = size
    return np.array([w - NEAREST, x + width * w, 2 * width * w - x, y + height * w, 2 * height * w - y])
