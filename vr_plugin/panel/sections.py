"""What the panel shows, section by section; every control changes what a call of `Desk` or `Choices` does."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import imgui, implot

import persp_sw as psw
from persp_sw.errors import PerspSWError

from ..rig import STEREO_MODES
from ..stereo import MODES
from .colours import decoded, encoded
from .desk import Desk
from .light_section import LightSection
from .shape_edit import shape_like
from .shape_plot import ShapePlot
from .statistics import SECONDS, Recent
from .tf_plot import TransferPlot

if TYPE_CHECKING:
    from ..preview.controller import Preview

_WIDTH_EM = 25.0  # of the panel
_OPEN = imgui.TreeNodeFlags_.default_open
_CLAMPED = imgui.SliderFlags_.always_clamp
_TARGETS = (0.0, 15.0, 24.0, 30.0, 60.0, 72.0, 90.0, 120.0)


class Sections:
    """The panel's window, at the right edge.

    Attributes
    ----------
    recent
        What frames took lately.
    shows_handles
        Whether the view has handles.
    """

    def __init__(self, desk: Desk, preview: Preview, places: dict[str, tuple[float, float]]):
        self.desk, self.recent = desk, Recent()
        self.shows_handles = False
        self._preview, self._choices, self._places = preview, preview.choices, places
        self._plot = TransferPlot(desk.edit, desk.volume, places)
        self._plane = ShapePlot(desk.shapes, desk.volume, places)
        self._light = LightSection(desk, self._mark, self._button)
        self._file, self._handles_wanted = "transfer.json", True
        inputs = implot.get_input_map()
        inputs.pan = inputs.fit = imgui.MouseButton_.middle  # the left button moves points
        inputs.override_mod = 0  # and with Ctrl it adds them

    @property
    def is_waiting(self) -> bool:
        """Whether it will look different soon, by itself."""
        return self._plane.is_waiting

    def close(self) -> None:
        """End what it began."""
        self._plane.close()

    def show(self, size: tuple[int, int]) -> None:
        """One pass, in a window of that size."""
        width = min(_WIDTH_EM * imgui.get_font_size(), 0.6 * size[0])
        imgui.set_next_window_pos((size[0] - width, 0.0))
        imgui.set_next_window_size((width, float(size[1])))
        flags = imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_resize | imgui.WindowFlags_.no_title_bar
        flags |= imgui.WindowFlags_.no_saved_settings | imgui.WindowFlags_.no_bring_to_front_on_focus
        self.shows_handles = False
        imgui.begin("panel", None, flags)
        imgui.push_item_width(-8.0 * imgui.get_font_size())
        for title, show, flag in (
            ("Transfer function", self._transfer, _OPEN),
            ("Light", lambda: self._light.show(self._preview.wanted.camera.axes), 0),
            ("Clipping and cropping", self._regions, 0),
            ("Quality and stereo", self._quality, _OPEN),
            ("Statistics", self._statistics, _OPEN),
        ):
            is_open = imgui.collapsing_header(title, flag)
            self._mark(title)
            if is_open:
                show()
        imgui.pop_item_width()
        imgui.end()

    # --- transfer function ---------------------------------------------------------------------------------

    def _transfer(self) -> None:
        desk, editor = self.desk, self.desk.editor
        self._presets()
        changed, plane = imgui.checkbox("by value and gradient", desk.is_2d)
        self._mark("by value and gradient")
        if changed:
            desk.show_2d(plane)
            editor = desk.editor
        if desk.is_2d:
            self._plane.show(14.0 * imgui.get_font_size())
            imgui.text_disabled("drag middles and sides · right click deletes · wheel zooms")
        else:
            self._plot.show(11.0 * imgui.get_font_size())
            imgui.text_disabled("drag · double click adds · right click deletes · wheel zooms")
        self._button("Undo", editor.undo, editor.history.can_undo)
        imgui.same_line()
        self._button("Redo", editor.redo, editor.history.can_redo)
        imgui.same_line()
        if desk.is_2d:
            self._selected_shape()
        else:
            edit = desk.edit
            logarithmic = edit.axis.knee is not None
            changed, logarithmic = imgui.checkbox("logarithmic", logarithmic)
            self._mark("logarithmic")
            if changed:
                edit.set_logarithmic(logarithmic)
            self._selected_point()
        self._files()
        desk.hand_over()

    def _presets(self) -> None:
        desk = self.desk
        if imgui.begin_combo("Preset", desk.preset):
            for name in self._choices.presets:
                chosen, _ = imgui.selectable(desk.called(name), desk.called(name) == desk.preset)
                self._mark(f"preset {desk.called(name)}")
                if chosen:
                    desk.choose_preset(name)
            imgui.end_combo()
        self._mark("Preset")

    def _selected_point(self) -> None:
        edit, index = self.desk.edit, self.desk.edit.selected
        imgui.begin_disabled(index is None)
        value, colour, opacity = edit.transfer.points[0 if index is None else index]
        enter = imgui.InputTextFlags_.enter_returns_true
        changed, to_value = imgui.input_double("Value", value, format="%.6g", flags=enter)
        self._mark("Value")
        if changed and index is not None:
            edit.move(index, to_value, opacity)
        changed, to_opacity = imgui.input_double("Opacity", opacity, format="%.6g", flags=enter)
        self._mark("Opacity")
        if changed and index is not None:
            edit.move(index, value, min(max(to_opacity, 0.0), 1.0))
        changed, picked = imgui.color_edit3("Colour", list(encoded(colour)))
        self._mark("Colour")
        if changed and index is not None:
            edit.set_colour(index, decoded(picked))
        if imgui.is_item_deactivated():
            edit.release()
        imgui.end_disabled()

    def _selected_shape(self) -> None:
        edit, index = self.desk.shapes, self.desk.shapes.selected
        shape = edit.transfer.shapes[0 if index is None else index]
        self._button("Add a box", lambda: edit.add(shape_like(shape, edit.limits, psw.Box)))
        imgui.same_line()
        self._button("Add a triangle", lambda: edit.add(shape_like(shape, edit.limits, psw.Triangle)))
        imgui.begin_disabled(index is None)
        changed, opacity = imgui.slider_float("Opacity", shape.opacity, 0.0, 1.0, "%.3f", _CLAMPED)
        let_go = imgui.is_item_deactivated()
        self._mark("Opacity")
        softer, soft = imgui.slider_float("Softness", shape.soft, 0.0, 1.0, "%.2f", _CLAMPED)
        let_go = let_go or imgui.is_item_deactivated()
        if (changed or softer) and index is not None:
            edit.weigh(index, opacity, soft)
        changed, picked = imgui.color_edit3("Colour", list(encoded(shape.colour)))
        if changed and index is not None:
            edit.recolour(index, decoded(picked))
        if let_go or imgui.is_item_deactivated():
            edit.release()
        imgui.end_disabled()

    def _files(self) -> None:
        _, self._file = imgui.input_text("File", self._file)
        self._mark("File")
        self._button("Save", lambda: self._tried(self.desk.editor.save, "written"))
        imgui.same_line()
        self._button("Load", lambda: self._tried(self.desk.editor.load, "read"))

    def _tried(self, act: Callable[[Path], None], done: str) -> None:
        path = Path(self._file).expanduser()
        try:
            act(path)
            self._preview.say(f"{done}: {path}")
        except PerspSWError as error:
            self._preview.say(str(error))

    # --- regions -------------------------------------------------------------------------------------------

    def _regions(self) -> None:
        desk = self.desk
        _, self._handles_wanted = imgui.checkbox("handles in the view", self._handles_wanted)
        self._mark("handles in the view")
        self.shows_handles = self._handles_wanted
        crop = desk.crop
        for axis, name in enumerate("xyz"):
            low, high = crop[2 * axis : 2 * axis + 2]
            last = desk.volume.size[axis] - 1.0
            clamped = imgui.SliderFlags_.always_clamp
            changed, to_low, to_high = imgui.drag_float_range2(
                f"Crop {name}", low, high, last / 200, 0.0, last, "%.1f", flags=clamped
            )
            self._mark(f"Crop {name}")
            if changed and to_low != np.float32(low):
                desk.set_crop(2 * axis, to_low)
            if changed and to_high != np.float32(high):
                desk.set_crop(2 * axis + 1, to_high)
        reach = float(np.linalg.norm(desk.volume.extent)) / 2
        for number, plane in enumerate(desk.regions.clip):
            self._clip(number, plane, reach)
        self._button("Add a clip plane", lambda: desk.add_clip(-self._preview.wanted.camera.axes[2]))
        imgui.same_line()
        self._button("Show all as at first", desk.reset_regions, self._choices.edits.regions is not None)

    def _clip(self, number: int, plane: tuple[float, ...], reach: float) -> None:
        desk = self.desk
        imgui.push_id(number)
        normal = np.array(plane[:3])
        length = np.linalg.norm(normal)
        changed, picked = imgui.slider_float3("Plane's normal", (normal / length).tolist(), -1.0, 1.0, "%.2f")
        if changed and np.linalg.norm(picked) > 1e-3:
            # It turns about the point of the plane that is nearest to the volume's middle.
            turned = np.array(picked) / np.linalg.norm(picked)
            centre = desk.volume.centre
            point = centre - (normal @ centre + plane[3]) / length**2 * normal
            desk.set_clip(number, (*turned.tolist(), -float(turned @ point)))
        away = float(normal @ desk.volume.centre + plane[3]) / length
        changed, to = imgui.slider_float("Its distance", away, -reach, reach, "%.4g")
        self._mark(f"distance {number}")
        if changed:
            desk.set_clip(number, (*plane[:3], plane[3] + (to - away) * float(length)))
        self._button("Turn round", lambda: desk.set_clip(number, [-n for n in plane]))
        imgui.same_line()
        self._button("Remove", lambda: desk.remove_clip(number))
        imgui.pop_id()

    # --- quality, stereo, statistics -----------------------------------------------------------------------

    def _quality(self) -> None:
        choices = self._choices
        held = choices.quality is not None
        changed, held = imgui.checkbox("hold quality", held)
        self._mark("hold quality")
        if changed:
            choices.hold_quality(choices.drawn_quality if held else None)
        flags = imgui.SliderFlags_.logarithmic | imgui.SliderFlags_.always_clamp
        quality = choices.drawn_quality if choices.quality is None else choices.quality
        changed, quality = imgui.slider_float("Quality", quality, 0.1, 8.0, "%.2f", flags)
        self._mark("Quality")
        if changed:
            choices.hold_quality(quality)
        now = self.desk.target_hz
        if imgui.begin_combo("Frame rate", _rate(now)):
            for target_hz in sorted({*_TARGETS, now}):
                if imgui.selectable(_rate(target_hz), target_hz == now)[0]:
                    choices.follow_rate(target_hz)
            imgui.end_combo()
        self._mark("Frame rate")
        if imgui.begin_combo("Stereo", MODES[choices.stereo.mode]):
            for mode in STEREO_MODES:
                chosen, _ = imgui.selectable(MODES[mode], mode == choices.stereo.mode)
                if chosen:
                    choices.set_stereo(mode)
            imgui.end_combo()
        self._mark("Stereo")
        if imgui.checkbox("swap the eyes", choices.stereo.swapped)[0]:
            choices.swap_eyes()
        changed, share = imgui.slider_float(
            "Eyes apart", choices.separation, 0.002, 0.2, "%.3f", imgui.SliderFlags_.logarithmic
        )
        if changed:
            choices.separation = share

    def _statistics(self) -> None:
        times = self.recent.column("at_s")
        implot.push_style_var(implot.StyleVar_.plot_padding, (0.0, 0.0))
        for name, title, form in (
            ("ms", "ms a frame", "%.0f"),
            ("quality", "quality", "%.2f"),
            ("samples", "million samples", "%.1f"),
        ):
            values = self.recent.column(name) * (1e-6 if name == "samples" else 1.0)
            newest = form % values[-1] if len(values) else "–"
            imgui.text(f"{title}: {newest}")
            flags = implot.Flags_.canvas_only | implot.Flags_.no_inputs
            if implot.begin_plot(f"##{name}", (-1, 2.6 * imgui.get_font_size()), flags):
                bare = implot.AxisFlags_.no_decorations
                implot.setup_axes("", "", bare, bare)
                most = (
                    float(1.5 * np.quantile(values, 0.9)) if len(values) else 1.0
                )  # not a first compilation
                implot.setup_axes_limits(-SECONDS, 0.0, 0.0, max(most, 1e-6), implot.Cond_.always)
                if len(values):
                    spec = implot.Spec()
                    spec.line_color, spec.line_weight = (0.55, 0.78, 1.0, 1.0), 1.5
                    implot.plot_line(f"##{name} line", times, values, spec)
                implot.end_plot()
        implot.pop_style_var()

    # --- small things --------------------------------------------------------------------------------------

    def _button(self, text: str, act: Callable[[], object], enabled: bool = True) -> None:
        imgui.begin_disabled(not enabled)
        if imgui.button(text):
            act()
        imgui.end_disabled()
        self._mark(text)

    def _mark(self, name: str) -> None:
        """Remember where the last widget is."""
        low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
        self._places[name] = (low.x + high.x) / 2, (low.y + high.y) / 2


def _rate(target_hz: float) -> str:
    return f"{target_hz:g} Hz" if target_hz else "quality stays"
