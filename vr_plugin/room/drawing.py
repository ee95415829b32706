"""A sheet to draw on: lines, areas, arrows and words, smooth because it is drawn larger and reduced."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import persp_sw as psw

_OVERSAMPLING = 2

Colour = tuple[int, int, int]


class Sheet:
    """A white RGB picture. Places are (column, row) pixels of the finished picture; alpha is 0 … 1."""

    def __init__(self, width: int, height: int):
        self._image = Image.new("RGB", (width * _OVERSAMPLING, height * _OVERSAMPLING), "white")
        self._draw = ImageDraw.Draw(self._image, "RGBA")

    def finished(self) -> Image.Image:
        """The picture."""
        return self._image.reduce(_OVERSAMPLING)

    def area(self, corners: np.ndarray, colour: Colour, alpha: float = 1.0) -> None:
        """A filled polygon."""
        self._draw.polygon(_places(corners), fill=_ink(colour, alpha))

    def line(self, points: np.ndarray, colour: Colour, width: float = 1.0, alpha: float = 1.0) -> None:
        """A line through points; gaps where they are not finite."""
        points = np.asarray(points, np.float64)
        broken = np.flatnonzero(~np.isfinite(points).all(1))
        for part in np.split(points, broken):
            part = part[np.isfinite(part).all(1)]
            if len(part) > 1:
                pen = max(1, round(width * _OVERSAMPLING))
                self._draw.line(_places(part), fill=_ink(colour, alpha), width=pen, joint="curve")

    def dashes(self, start: np.ndarray, end: np.ndarray, colour: Colour, width: float = 1.0) -> None:
        """A dashed line."""
        start, end = np.asarray(start), np.asarray(end)
        length = np.linalg.norm(end - start)
        if not np.isfinite(length) or length == 0:
            return
        steps = np.arange(0, length, 9.0) / length
        for step in steps:
            piece = np.array([step, min(step + 5 / length, 1.0)])
            self.line(start + piece[:, None] * (end - start), colour, width)

    def arrow(
        self, start: np.ndarray, end: np.ndarray, colour: Colour, width: float = 1.5, head: float = 9.0
    ) -> None:
        """A line with a filled head."""
        start, end = np.asarray(start, float), np.asarray(end, float)
        length = np.linalg.norm(end - start)
        if not np.isfinite(length) or length < 1:
            return
        head = min(head, 0.6 * length)
        along = (end - start) / length
        across = np.array([-along[1], along[0]])
        neck = end - head * along
        self.line(np.array([start, neck]), colour, width)
        self.area(np.array([end, neck + 0.38 * head * across, neck - 0.38 * head * across]), colour)

    def dot(self, place: np.ndarray, radius: float, colour: Colour, edge: Colour | None = None) -> None:
        """A filled circle."""
        low, high = (np.asarray(place) + s * radius for s in (-1, 1))
        if np.isfinite([*low, *high]).all():
            outline = _ink(edge, 1.0) if edge else None
            self._draw.ellipse(_places(np.array([low, high])), _ink(colour, 1.0), outline, _OVERSAMPLING)

    def text(
        self,
        place: Sequence[float],
        words: str,
        size: float = 15,
        colour: Colour = (30, 30, 30),
        anchor: str = "lm",
        halo: bool = False,
    ) -> None:
        """Words beside a place; `anchor` is Pillow's: l, m or r, then a, m, s or d."""
        if not np.isfinite(place).all():
            return
        stroke = {"stroke_width": 3 * _OVERSAMPLING // 2, "stroke_fill": (255, 255, 255)} if halo else {}
        at = tuple(np.asarray(place) * _OVERSAMPLING)
        self._draw.text(at, _spoken(words), _ink(colour, 1.0), _font(size * _OVERSAMPLING), anchor, **stroke)

    def text_on(self, corners: np.ndarray, words: str, colour: Colour, height: float, alpha: float) -> None:
        """Words painted on a flat quadrilateral, in its upper left corner, as it is seen.

        corners: (4, 2) lower left, lower right, upper right, upper left. height: of the words, as a share of
        the quadrilateral's.
        """
        corners = np.asarray(corners, np.float64) * _OVERSAMPLING
        if not np.isfinite(corners).all():
            return
        across = np.linalg.norm(corners[1] - corners[0]) + np.linalg.norm(corners[2] - corners[3])
        along = np.linalg.norm(corners[3] - corners[0]) + np.linalg.norm(corners[2] - corners[1])
        tall = 400
        wide = int(np.clip(tall * across / max(along, 1.0), 100, 1600))
        words, font = _spoken(words), _font(height * tall)
        length = font.getlength(words)
        if length > 0.94 * wide:
            font = _font(height * tall * 0.94 * wide / length)
        paper = Image.new("L", (wide, tall), 0)
        ImageDraw.Draw(paper).text((0.03 * wide, 0.03 * tall), words, round(255 * alpha), font, "la")
        low, high = np.floor(corners.min(0)).astype(int), np.ceil(corners.max(0)).astype(int)
        extent = tuple(int(n) for n in np.clip(high - low, 1, 8192))
        paper_corners = np.array([[0, tall], [wide, tall], [wide, 0], [0, 0]], float)
        seen = paper.transform(
            extent,
            Image.Transform.PERSPECTIVE,
            _perspective(corners - low, paper_corners),
            Image.Resampling.BICUBIC,
        )
        self._image.paste(colour, tuple(int(n) for n in low), seen)

    def picture(self, pixels: np.ndarray, low: tuple[int, int]) -> None:
        """A (height, width, 4) linear premultiplied picture over what is there; `low` is its upper left."""
        height, width = (n * _OVERSAMPLING for n in pixels.shape[:2])
        alpha = np.clip(pixels[..., 3:], 0, 1)
        light = psw.images.srgb(pixels[..., :3] / np.maximum(alpha, 1e-6))
        levels = np.round(255 * np.concatenate([light, alpha], -1)).astype(np.uint8)
        paper = Image.fromarray(levels, "RGBA").resize((width, height), Image.Resampling.BICUBIC)
        self._image.paste(paper, (low[0] * _OVERSAMPLING, low[1] * _OVERSAMPLING), paper)


def text_width(words: str, size: float) -> float:
    """Pixels that words take."""
    return _font(size).getlength(_spoken(words))


@lru_cache(64)
def _font(size: float) -> ImageFont.FreeTypeFont:
    name = _font_file()
    return ImageFont.truetype(name, max(1.0, size)) if name else ImageFont.load_default(max(1.0, size))


@lru_cache(1)
def _font_file() -> str | None:
    """A font that has more than ASCII, of the system or of matplotlib; None: Pillow's, which has not."""
    names = ["DejaVuSans.ttf", "Arial.ttf", "Helvetica.ttc", "NotoSans-Regular.ttf"]
    spec = find_spec("matplotlib")
    if spec is not None:
        names += [
            str(Path(home) / "mpl-data/fonts/ttf/DejaVuSans.ttf") for home in spec.submodule_search_locations
        ]
    for name in names:
        try:
            ImageFont.truetype(name, 10)
        except OSError:
            continue
        return name
    return None


def _spoken(words: str) -> str:
    """Words with signs that the font has."""
    return words if _font_file() else words.replace("×", "x").replace("−", "-").replace("…", "...")


def _places(points: np.ndarray) -> list[tuple[float, float]]:
    return [tuple(p) for p in np.asarray(points, np.float64) * _OVERSAMPLING]


def _ink(colour: Colour, alpha: float) -> tuple[int, int, int, int]:
    return (*colour, round(255 * alpha))


def _perspective(seen: np.ndarray, paper: np.ndarray) -> list[float]:
    """Pillow's eight numbers: where on the paper a place of the picture is."""
    rows, values = [], []
    for (x, y), (u, v) in zip(seen, paper, strict=True):
        rows += [[x, y, 1, 0, 0, 0, -u * x, -u * y], [0, 0, 0, x, y, 1, -v * x, -v * y]]
        values += [u, v]
    return np.linalg.lstsq(np.array(rows), np.array(values), rcond=None)[0].tolist()
