"""The handles of `handles.py` drawn in the view, and the pointer that drags them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import imgui

from .desk import Desk
from .handles import Handle, box_edges, handle_at, handles_of, move, pixel, pixels_from_world, steps_to

if TYPE_CHECKING:
    from ..preview.wanted import Wanted

_RADIUS = 5.5
_COLOURS = {"crop": (0.45, 0.80, 1.0, 1.0), "clip": (1.0, 0.75, 0.35, 1.0)}
# Where a window's halves are the eyes', a place in it is no place in the view.
_SPLIT = ("side_by_side", "top_bottom")


class ViewHandles:
    """What lies over the view while the regions are edited."""

    def __init__(self, desk: Desk, places: dict[str, tuple[float, float]]):
        self._desk, self._places = desk, places
        self._shown: list[Handle] = []
        self._pointer = np.zeros(2)
        self._held: Handle | None = None
        self._offset = np.zeros(2)  # from the pointer to the dot, pixels

    def hide(self) -> None:
        """There are none; one that is held stays so until it is let go."""
        self._shown = []

    def hover(self, pointer: tuple[float, float]) -> None:
        """The pointer is there."""
        self._pointer = np.array(pointer)

    def press(self, wanted: Wanted) -> bool:
        """Take the dot under the pointer; whether there is one."""
        matrix = pixels_from_world(wanted.camera, wanted.size)
        self._held = handle_at(self._shown, matrix, tuple(self._pointer))
        if self._held is None:
            return False
        self._offset = pixel(matrix, self._held.point) - self._pointer
        return True

    def drag(self, pointer: tuple[float, float], wanted: Wanted) -> None:
        """The pointer that holds a dot is there now."""
        self.hover(pointer)
        if self._held is None:
            return
        matrix = pixels_from_world(wanted.camera, wanted.size)
        steps = steps_to(self._held, matrix, tuple(self._pointer + self._offset))
        if steps is not None:
            move(self._desk, self._held, steps)

    def release(self) -> None:
        """Let go."""
        self._held = None

    def show(self, wanted: Wanted) -> None:
        """Draw them under the panel, and the box that is cropped to."""
        self._shown = []
        if wanted.outside or wanted.stereo.shown_mode in _SPLIT:
            return
        self._shown = handles_of(self._desk)
        matrix, draw = pixels_from_world(wanted.camera, wanted.size), imgui.get_background_draw_list()
        scale = imgui.get_style().font_scale_dpi
        line = imgui.get_color_u32((0.45, 0.80, 1.0, 0.45))
        for edge in box_edges(self._desk):
            ends = [pixel(matrix, point) for point in edge]
            if all(end is not None for end in ends):
                draw.add_line(*(tuple(end) for end in ends), line, scale)
        near = handle_at(self._shown, matrix, tuple(self._pointer))
        for handle in self._shown:
            at = pixel(matrix, handle.point)
            if at is None:
                continue
            self._places[f"{handle.kind} {handle.number}"] = float(at[0]), float(at[1])
            held = self._held is not None and (self._held.kind, self._held.number) == (
                handle.kind,
                handle.number,
            )
            radius = scale * _RADIUS * (1.35 if held or (self._held is None and handle is near) else 1.0)
            draw.add_circle_filled(tuple(at), radius + 1.5 * scale, imgui.get_color_u32((0, 0, 0, 0.8)))
            draw.add_circle_filled(tuple(at), radius, imgui.get_color_u32(_COLOURS[handle.kind]))
