"""The transfer function's curve over the histogram, and the pointer that edits it."""

from __future__ import annotations

import numpy as np
from imgui_bundle import imgui, implot

import persp_sw as psw

from .colours import encoded
from .tf_edit import TransferEdit

_BINS = 256
_REACH = 8.0  # pixels from a point's middle at which it can be taken
_RADIUS = 4.5
_COLUMNS = 160  # of the picture under the curve
_TICKS = (0.0, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0)
_LINEAR_TICKS = (0.0, 0.25, 0.5, 0.75, 1.0)
_STRAY = 0.0005  # part of the voxels that lie beyond what is shown at first
_ROOM = 0.06  # below no opacity and above the highest, for their points to be taken


class TransferPlot:
    """One editor of one volume's transfer function.

    Parameters
    ----------
    places
        Gets "point n", the pixel of each control point, and "plot", that of the plot's middle.
    """

    def __init__(self, edit: TransferEdit, volume: psw.Volume, places: dict[str, tuple[float, float]]):
        self._edit, self._places = edit, places
        counts, edges = psw.value_counts(volume, _BINS)
        self._centres = (edges[:-1] + edges[1:]) / 2
        heights = np.log1p(counts.astype(np.float64))
        self._heights = heights / max(heights.max(), 1.0)
        below = np.cumsum(counts) / max(counts.sum(), 1)
        self._limits = float(edges[0]), float(edges[-1])
        stray = int(np.searchsorted(below, 1 - _STRAY))
        self._shown = float(edges[0]), float(edges[min(stray + 1, _BINS)])

    def show(self, height: float) -> None:
        """The plot as wide as there is room, and the colours below it."""
        flags = implot.Flags_.no_title | implot.Flags_.no_legend | implot.Flags_.no_menus
        flags |= implot.Flags_.no_box_select | implot.Flags_.no_mouse_text
        if not implot.begin_plot("##transfer function", (-1, height), flags):
            return
        low, high = self._shown
        last = float(self._edit.transfer.values[-1])
        high = max(high, min(last * 1.02 if last > 0 else last, self._limits[1]))
        room = 0.02 * (high - low)
        lock = implot.AxisFlags_.lock | implot.AxisFlags_.no_grid_lines
        implot.setup_axes("", "", implot.AxisFlags_.no_grid_lines, lock)
        implot.setup_axis_limits(implot.ImAxis_.x1, low - room, high + room, implot.Cond_.once)
        wide = 0.5 * (self._limits[1] - self._limits[0])
        limits = self._limits[0] - wide, self._limits[1] + wide
        implot.setup_axis_limits_constraints(implot.ImAxis_.x1, *limits)
        implot.setup_axis_limits(implot.ImAxis_.y1, -_ROOM, 1 + _ROOM, implot.Cond_.always)
        ticks = _LINEAR_TICKS if self._edit.axis.knee is None else _TICKS
        positions = [float(self._edit.axis.position(tick)) for tick in ticks]
        implot.setup_axis_ticks(implot.ImAxis_.y1, positions, [f"{tick:g}" for tick in ticks])
        implot.setup_finish()
        self._hands()
        self._histogram()
        self._curve()
        self._points()
        implot.end_plot()
        self._colour_bar()

    def _hands(self) -> None:
        edit, mouse = self._edit, implot.get_plot_mouse_pos()
        a, b = implot.pixels_to_plot(0.0, 0.0), implot.pixels_to_plot(1.0, 1.0)
        scale = imgui.get_style().font_scale_dpi * _REACH
        reach = scale * abs(b.x - a.x), scale * abs(b.y - a.y)
        corner, size = implot.get_plot_pos(), implot.get_plot_size()
        self._span = [implot.pixels_to_plot(corner.x + x * size.x, 0.0).x for x in (0, 1)]
        self._places["plot"] = corner.x + size.x / 2, corner.y + size.y / 2
        self._places["plot's first pixel"] = corner.x, corner.y
        self._places["plot's size"] = size.x, size.y
        if edit.is_dragging:
            edit.drag(mouse.x, mouse.y)
            if not imgui.is_mouse_down(imgui.MouseButton_.left):
                edit.release()
            return
        if not implot.is_plot_hovered():
            return
        at = edit.point_at(mouse.x, mouse.y, reach)
        wants_more = imgui.get_io().key_ctrl or imgui.is_mouse_double_clicked(imgui.MouseButton_.left)
        if imgui.is_mouse_clicked(imgui.MouseButton_.left):
            if wants_more and at is None:
                edit.add(mouse.x)
            else:
                edit.press(mouse.x, mouse.y, reach)
        elif imgui.is_mouse_clicked(imgui.MouseButton_.right) and at is not None:
            edit.delete(at)

    def _histogram(self) -> None:
        spec = implot.Spec()
        spec.fill_color = (0.55, 0.60, 0.68, 1.0)
        spec.fill_alpha = 0.45
        spec.line_color = (0.0, 0.0, 0.0, 0.0)
        implot.plot_shaded("##counts", self._centres, self._heights, 0.0, spec)

    def _curve(self) -> None:
        transfer, axis = self._edit.transfer, self._edit.axis
        low, high = self._span
        edges = np.linspace(low, high, _COLUMNS + 1)
        middles = (edges[:-1] + edges[1:]) / 2
        colours = np.column_stack([psw.images.srgb(transfer.colour(middles)), np.full(_COLUMNS, 0.55)])
        tops = axis.position(transfer.opacity(middles))
        implot.push_plot_clip_rect()
        draw = implot.get_plot_draw_list()
        for edge, after, top, colour in zip(edges[:-1], edges[1:], tops, colours.tolist(), strict=True):
            if top > 0:
                foot, head = implot.plot_to_pixels(after, 0.0), implot.plot_to_pixels(edge, float(top))
                # Whole pixels across, or neighbours' smoothed edges show as stripes.
                corners = (round(head.x), head.y), (round(foot.x), foot.y)
                draw.add_rect_filled(*corners, imgui.get_color_u32(tuple(colour)))
        implot.pop_plot_clip_rect()
        # Straight in opacity is not straight on a logarithmic axis: the points, and many places between them.
        values = np.unique(np.concatenate([np.linspace(low, high, 4 * _COLUMNS), transfer.values]))
        values = np.sort(np.concatenate([values, np.nextafter(transfer.values, -np.inf)]))  # both of a step
        spec = implot.Spec()
        spec.line_color, spec.line_weight = (0.96, 0.97, 0.98, 1.0), 1.5
        implot.plot_line("##curve", values, np.asarray(axis.position(transfer.opacity(values))), spec)

    def _points(self) -> None:
        edit, draw = self._edit, implot.get_plot_draw_list()
        scale = imgui.get_style().font_scale_dpi
        implot.push_plot_clip_rect(_RADIUS * scale + 2)
        for index, colour in enumerate(edit.transfer.colours.tolist()):
            at = implot.plot_to_pixels(*edit.place(index))
            self._places[f"point {index}"] = at.x, at.y
            radius = scale * _RADIUS * (1.3 if index == edit.selected else 1.0)
            rim = (1.0, 1.0, 1.0, 1.0) if index == edit.selected else (0.82, 0.84, 0.87, 1.0)
            draw.add_circle_filled(at, radius + 2.5 * scale, imgui.get_color_u32((0.0, 0.0, 0.0, 0.9)))
            draw.add_circle_filled(at, radius + 1.5 * scale, imgui.get_color_u32(rim))
            draw.add_circle_filled(at, radius, imgui.get_color_u32((*encoded(colour), 1.0)))
        implot.pop_plot_clip_rect()

    def _colour_bar(self) -> None:
        """What colour values have, opaque, below the plot and as wide."""
        left, width = self._places["plot's first pixel"][0], self._places["plot's size"][0]
        height = 0.6 * imgui.get_font_size()
        top, draw = imgui.get_cursor_screen_pos().y, imgui.get_window_draw_list()
        edges = np.linspace(*self._span, _COLUMNS + 1)
        colours = psw.images.srgb(self._edit.transfer.colour((edges[:-1] + edges[1:]) / 2)).tolist()
        x = np.round(left + width * np.arange(_COLUMNS + 1) / _COLUMNS)
        for n, colour in enumerate(colours):
            draw.add_rect_filled(
                (float(x[n]), top), (float(x[n + 1]), top + height), imgui.get_color_u32((*colour, 1.0))
            )
        imgui.dummy((1.0, height))
