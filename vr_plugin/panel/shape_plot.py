"""Shapes of a two-dimensional transfer function over the joint histogram, and the pointer that edits them."""

from __future__ import annotations

import numpy as np
from imgui_bundle import imgui, implot

import persp_sw as psw

from ..worker import Worker
from .colours import encoded
from .shape_edit import ShapeEdit, grips_of

_BINS = (64, 64)
_REACH = 8.0  # pixels from a grip's middle at which it can be taken
_RADIUS = 4.0
_STRAY = 0.001  # part of the gradients that lie above what is shown at first


class ShapePlot:
    """One editor of one volume's 2D function. Its histogram is made in a thread, once it is first shown.

    Parameters
    ----------
    places
        Gets "shape n PART", the pixels of all grips.
    """

    def __init__(self, edit: ShapeEdit, volume: psw.Volume, places: dict[str, tuple[float, float]]):
        self._edit, self._volume, self._places = edit, volume, places
        self._counting: Worker[psw.Volume, psw.JointHistogram] | None = None
        self._histogram: psw.JointHistogram | None = None
        self._fitted = False

    @property
    def is_waiting(self) -> bool:
        """Whether the histogram is being made."""
        return self._counting is not None and self._histogram is None

    def close(self) -> None:
        """End the thread."""
        if self._counting is not None:
            self._counting.close()

    def show(self, height: float) -> None:
        """The plot as wide as there is room."""
        self._count()
        flags = implot.Flags_.no_title | implot.Flags_.no_legend | implot.Flags_.no_menus
        flags |= implot.Flags_.no_box_select | implot.Flags_.no_mouse_text
        if not implot.begin_plot("##2D transfer function", (-1, height), flags):
            return
        first, last, _ = self._edit.limits
        top, room = self._top(), 0.08 * ((last - first) or 1.0)
        implot.setup_axes(
            "value", "gradient", implot.AxisFlags_.no_grid_lines, implot.AxisFlags_.no_grid_lines
        )
        implot.setup_axis_limits(implot.ImAxis_.x1, first - room, last + room, implot.Cond_.once)
        # Once more when the histogram is there: it knows how far gradients reach.
        found = self._histogram is not None
        again = implot.Cond_.once if found == self._fitted else implot.Cond_.always
        self._fitted = found
        implot.setup_axis_limits(implot.ImAxis_.y1, -0.05 * top, top, again)
        implot.setup_finish()
        self._hands()
        if self._histogram is not None:
            joint = self._histogram
            counts = np.log1p(joint.counts.astype(np.float64)).T[::-1]
            implot.push_colormap(implot.Colormap_.greys)
            low, high = implot.Point(first, 0.0), implot.Point(last, joint.magnitudes[1])
            # Greys run from white to black: the fewest are dark.
            implot.plot_heatmap("##counts", np.ascontiguousarray(-counts), -counts.max(), 0.0, "", low, high)
            implot.pop_colormap()
        self._shapes()
        implot.end_plot()

    def _count(self) -> None:
        if self._counting is None:
            self._counting = Worker(lambda volume, cancel: psw.JointHistogram.of(volume, _BINS), "counting")
            self._counting.ask(self._volume)
        if self._histogram is None:
            self._histogram = self._counting.newest()

    def _top(self) -> float:
        """The magnitude up to which is shown at first."""
        shapes = max(shape.magnitudes[1] for shape in self._edit.transfer.shapes)
        if self._histogram is None:
            return 1.1 * shapes
        each = self._histogram.counts.sum(0)
        below = np.cumsum(each) / max(each.sum(), 1)
        share = (int(np.searchsorted(below, 1 - _STRAY)) + 1) / _BINS[1]
        return 1.1 * max(shapes, share * self._histogram.magnitudes[1])

    def _hands(self) -> None:
        edit, mouse = self._edit, implot.get_plot_mouse_pos()
        if edit.is_dragging:
            edit.drag(mouse.x, mouse.y)
            if not imgui.is_mouse_down(imgui.MouseButton_.left):
                edit.release()
            return
        if not implot.is_plot_hovered():
            return
        a, b = implot.pixels_to_plot(0.0, 0.0), implot.pixels_to_plot(1.0, 1.0)
        scale = imgui.get_style().font_scale_dpi * _REACH
        reach = scale * abs(b.x - a.x), scale * abs(b.y - a.y)
        if imgui.is_mouse_clicked(imgui.MouseButton_.left):
            edit.press(mouse.x, mouse.y, reach)
        elif imgui.is_mouse_clicked(imgui.MouseButton_.right):
            found = edit.grip_at(mouse.x, mouse.y, reach)
            if found is not None:
                edit.delete(found[0])

    def _shapes(self) -> None:
        draw, scale = implot.get_plot_draw_list(), imgui.get_style().font_scale_dpi
        implot.push_plot_clip_rect(_RADIUS * scale + 2)
        for number, shape in enumerate(self._edit.transfer.shapes):
            (left, right), (low, high) = shape.values, shape.magnitudes
            if isinstance(shape, psw.Box):
                outline = [(left, low), (right, low), (right, high), (left, high)]
            else:
                outline = [(shape.value, low), (right, high), (left, high)]
            corners = [implot.plot_to_pixels(*corner) for corner in outline]
            colour, selected = encoded(shape.colour), number == self._edit.selected
            fill = imgui.get_color_u32((*colour, 0.15 + 0.45 * shape.opacity))
            rim = imgui.get_color_u32((1.0, 1.0, 1.0, 1.0) if selected else (*colour, 1.0))
            if len(corners) == 4:
                draw.add_quad_filled(*corners, fill)
            else:
                draw.add_triangle_filled(*corners, fill)
            for one, other in zip(corners, [*corners[1:], corners[0]], strict=True):
                draw.add_line(one, other, rim, 1.5 * scale)
            for grip in grips_of(shape):
                at = implot.plot_to_pixels(grip.value, grip.magnitude)
                self._places[f"shape {number} {grip.part}"] = at.x, at.y
                draw.add_circle_filled(at, (_RADIUS + 1.5) * scale, imgui.get_color_u32((0.0, 0.0, 0.0, 0.9)))
                draw.add_circle_filled(at, _RADIUS * scale, rim)
        implot.pop_plot_clip_rect()
