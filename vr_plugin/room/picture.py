"""A picture of a rig: the room from behind the viewer, its plan, and what there is to know of both."""

from __future__ import annotations

import numpy as np
from PIL import Image

import persp_sw as psw

from ..rig import Rig
from .drawing import Sheet
from .facts import draw_facts
from .plan import draw_plan
from .scene import RoomScene
from .view import draw_view

SIZE = (1720, 1080)
_SIDE = 620  # pixels of the right column
_MARGIN = 24


def draw_room(
    rig: Rig,
    volume: psw.Volume | None = None,
    renderer: psw.Renderer | None = None,
    heads: np.ndarray | None = None,
) -> Image.Image:
    """The room as a picture, RGB.

    Parameters
    ----------
    volume
        Its box is drawn where the rig places it, with letters or axes.
    renderer
        Of that volume: then the volume itself is in the box, as it would be seen from here.
    heads
        (n, 3) room positions of a head, in order: the path it takes.
    """
    volume = volume if volume is not None or renderer is None else renderer.volume
    scene = RoomScene.of(rig, volume, heads)
    width, height = SIZE
    sheet = Sheet(width, height)
    sheet.text((_MARGIN, 34), rig.name or "rig", 26)
    left = width - _SIDE
    draw_view(sheet, (_MARGIN, 56, left - _MARGIN, height - _MARGIN), scene, renderer)
    sheet.line(np.array([[left, _MARGIN], [left, height - _MARGIN]]), (215, 215, 215))
    sheet.text((left + _MARGIN, 34), "plan, from above", 17)
    draw_plan(sheet, (left + _MARGIN, 56, width - _MARGIN, 610), scene)
    draw_facts(sheet, (left + _MARGIN, 646, width - _MARGIN, height - _MARGIN), scene)
    return sheet.finished()
