"""Many pictures in one, with their names: a contact sheet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import persp_sw as psw

_MARGIN, _TITLE = 8, 22
_PAPER, _INK = (38, 38, 42), (225, 225, 225)


def contact_sheet(
    pictures: Mapping[tuple[str, str], np.ndarray],
    background: Sequence[float] = (0, 0, 0),
    edge: int = 320,
) -> np.ndarray:
    """(h, w, 3) uint8: a column for each wall, a row for each eye, every picture at most `edge` pixels long.

    Parameters
    ----------
    pictures
        By (wall, eye): (height, width, 4) float32, linear, premultiplied.
    background
        Linear colour behind the volume.
    """
    walls = list(dict.fromkeys(wall for wall, _ in pictures))
    eyes = list(dict.fromkeys(eye for _, eye in pictures))
    width = len(walls) * (edge + _MARGIN) + _MARGIN
    height = len(eyes) * (edge + _TITLE + _MARGIN) + _MARGIN
    sheet = Image.new("RGB", (width, height), _PAPER)
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(14)
    for (wall, eye), picture in pictures.items():
        x = _MARGIN + walls.index(wall) * (edge + _MARGIN)
        y = _MARGIN + eyes.index(eye) * (edge + _TITLE + _MARGIN)
        small = Image.fromarray(psw.images.presented(picture, background))
        small.thumbnail((edge, edge))
        pen.text((x, y + 2), f"{wall}, {eye} eye", _INK, font)
        sheet.paste(small, (x, y + _TITLE))
    return np.asarray(sheet)
