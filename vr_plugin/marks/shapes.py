"""Marks drawn with OpenGL, as `psw.marks.paint` does on the processor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import persp_sw as psw

from ..screen.gl_objects import Texture
from ..screen.shapes import Shapes, clip_from_pixels

_NEAR, _FAR = 0.5 * psw.marks.NEAREST, 1e4  # of the eye's distance from the wall; nothing here tests depth
_KEPT = 64  # textures of words


class MarkShapes:
    """Draws marks into the bound framebuffer. Belongs to the context of its shapes."""

    def __init__(self, shapes: Shapes):
        self._shapes = shapes
        self._words: dict[tuple[object, ...], Texture] = {}
        self._legend: tuple[psw.marks.Legend, Texture] | None = None

    def draw(self, veiled: psw.marks.Veiled, view: psw.View, size: Sequence[int]) -> None:
        """Draw what `psw.marks.veil` made for a view over its picture.

        size: of the window in which it is shown in the end, pixels, for words (see `Overlay`).
        """
        distance = view.wall_distance
        clip_from_world = view.clip_from_world(_NEAR * distance, _FAR * distance)
        if veiled.sheets:
            triangles = [_triangles(sheet) for sheet in veiled.sheets]
            corners, tones = (np.concatenate(part) for part in zip(*triangles, strict=True))
            self._shapes.triangles(clip_from_world, corners, tones)
        if veiled.lines:
            bands = [_bands(line) for line in veiled.lines]
            segments, tones, widths = (np.concatenate(part) for part in zip(*bands, strict=True))
            self._shapes.bands(clip_from_world, segments, tones, widths)
        for shown in veiled.labels:
            texture = self._word(shown.label)
            squeeze = _squeeze(size, view.size)
            middle = view.project(shown.label.point) + np.array(shown.label.shift) / squeeze
            place = np.rint(middle - np.array(texture.size) // squeeze / 2)
            self._picture(texture, place * squeeze, size, shown.veil)

    def draw_legend(
        self, legend: psw.marks.Legend, place: tuple[int, int], view: psw.View, size: Sequence[int]
    ) -> None:
        """Draw a legend over a view's picture, at a place of a window of so many pixels."""
        if self._legend is None or self._legend[0] is not legend:
            if self._legend is not None:
                self._legend[1].close()
            texture = Texture(legend.picture.shape[1::-1])
            texture.upload(legend.picture)
            self._legend = legend, texture
        squeeze = _squeeze(size, view.size)
        self._picture(self._legend[1], np.array(place) // squeeze * squeeze, size)

    def close(self) -> None:
        """Delete what it made."""
        for texture in self._words.values():
            texture.close()
        self._words.clear()
        if self._legend is not None:
            self._legend[1].close()
        self._legend = None

    def _word(self, label: psw.marks.Label) -> Texture:
        key = label.text, label.colour, label.halo, label.letter
        if key not in self._words:
            if len(self._words) >= _KEPT:  # distances are many
                self._words.pop(next(iter(self._words))).close()
            picture = psw.marks.label_picture(label)
            texture = self._words[key] = Texture(picture.shape[1::-1])
            texture.upload(picture)
        return self._words[key]

    def _picture(
        self, texture: Texture, place: np.ndarray, size: Sequence[int], veil: Sequence[float] = (0, 0, 0, 1)
    ) -> None:
        (left, top), (width, height) = place, texture.size
        corners = [(left, top + height, 0), (left + width, top + height, 0)]
        corners += [(left + width, top, 0), (left, top, 0)]
        self._shapes.picture(clip_from_pixels(size), corners, texture.name, veil=veil, hidden=False)


def _squeeze(size: Sequence[int], eye_size: Sequence[int]) -> np.ndarray:
    """How many pixels of the window, across and down, one of an eye's picture becomes."""
    return np.maximum(np.array(size) // eye_size, 1)


def _triangles(shown: psw.marks.VeiledSheet) -> tuple[np.ndarray, np.ndarray]:
    """Corners (n, 3, 3) and premultiplied tones (n, 3, 4) of a sheet's cells, cut from (0, 0) to (1, 1)."""
    opacity = shown.sheet.opacity
    tones = np.concatenate([shown.tones, np.ones((*shown.tones.shape[:2], 1))], -1) * opacity

    def cut(grid: np.ndarray) -> np.ndarray:
        a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
        halves = np.stack([np.stack([a, b, c], 2), np.stack([a, c, d], 2)], 2)
        return halves.reshape(-1, 3, grid.shape[-1])

    return cut(shown.places), cut(tones)


def _bands(line: psw.marks.VeiledLine) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Segments (n, 2, 3), premultiplied tones (n, 2, 4) and widths (n,) of a line's pieces."""
    tones = np.column_stack([line.tones, np.ones(len(line.tones))]) * line.opacity
    segments = np.stack([line.points[:-1], line.points[1:]], 1)
    return segments, np.stack([tones[:-1], tones[1:]], 1), np.full(len(segments), line.width)
