"""The panel's section on light: shading, its lights, and what gradients do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from imgui_bundle import imgui

import persp_sw as psw

from .colours import decoded, encoded
from .desk import Desk

_FIELDS = (("ambient", 2.0), ("diffuse", 2.0), ("specular", 2.0), ("emissive", 2.0))
_FIRST_LIGHT = (1.0, 1.0, 1.0)  # a new light's direction, in the camera's own axes: over the shoulder
_CLAMPED = imgui.SliderFlags_.always_clamp


class LightSection:
    """Its widgets; `mark(name)` is called after each, `button(text, act)` makes one that acts."""

    def __init__(self, desk: Desk, mark: Callable[[str], None], button: Callable[..., None]):
        self._desk, self._mark, self._button = desk, mark, button

    def show(self, camera_axes: np.ndarray) -> None:
        """One pass; `camera_axes`: rows right, up and back, world."""
        desk = self._desk
        changed, lit = imgui.checkbox("shading", desk.look.lighting is not None)
        self._mark("shading")
        if changed:
            desk.shade(lit)
        if desk.look.lighting is not None:
            self._lighting(camera_axes)
        self._gradients()
        self._button("Light as at first", desk.reset_look, desk.choices.edits.look is not None)

    def _lighting(self, camera_axes: np.ndarray) -> None:
        desk, lighting = self._desk, self._desk.look.lighting
        for name, most in _FIELDS:
            self._slider(
                name, getattr(lighting, name), most, lambda to, name=name: desk.set_lighting(**{name: to})
            )
        changed, power = imgui.slider_float(
            "power", lighting.power, 1.0, 200.0, "%.0f", imgui.SliderFlags_.logarithmic | _CLAMPED
        )
        if changed:
            desk.set_lighting(power=power)
        changed, colour = imgui.color_edit3("headlight", encoded(np.minimum(lighting.headlight, 1.0)))
        self._mark("headlight")
        if changed:
            desk.set_lighting(headlight=decoded(colour))
        for name, text in (("two_sided", "two-sided"), ("model", "Blinn's model")):
            is_on = lighting.model == "blinn" if name == "model" else lighting.two_sided
            changed, is_on = imgui.checkbox(text, is_on)
            imgui.same_line()
            if changed:
                desk.set_lighting(**{name: ("blinn" if is_on else "phong") if name == "model" else is_on})
        imgui.new_line()
        for number, light in enumerate(lighting.lights):
            imgui.push_id(number)
            self._light(number, light)
            imgui.pop_id()
        toward = np.array(_FIRST_LIGHT) @ camera_axes
        self._button("Add a light", lambda: desk.set_light(len(lighting.lights), psw.Light(tuple(toward))))

    def _light(self, number: int, light: psw.Light) -> None:
        desk = self._desk
        changed, to = imgui.slider_float3("towards it", list(light.direction), -1.0, 1.0, "%.2f")
        self._mark(f"light {number}")
        if changed and np.linalg.norm(to) > 1e-3:
            desk.set_light(number, replace(light, direction=tuple(to)))
        changed, colour = imgui.color_edit3("its colour", encoded(np.minimum(light.colour, 1.0)))
        if changed:
            desk.set_light(number, replace(light, colour=decoded(colour)))
        changed, shadows = imgui.checkbox("shadows", light.shadows)
        self._mark(f"shadows {number}")
        if changed:
            desk.set_light(number, replace(light, shadows=shadows))
        imgui.same_line()
        self._button("Remove it", lambda: desk.set_light(number, None))

    def _gradients(self) -> None:
        desk, modulation = self._desk, self._desk.look.modulation
        changed, is_on = imgui.checkbox("boundaries more than what they enclose", modulation is not None)
        self._mark("modulation")
        if changed:
            desk.modulate(psw.Modulation() if is_on else None)
        if modulation is not None and is_on:
            changed, low, high = imgui.drag_float_range2(
                "gradient", modulation.low, modulation.high, 0.002, 0.0, 1.0, "%.3f", flags=_CLAMPED
            )
            if changed and low < high:
                desk.modulate(replace(modulation, low=low, high=high))
            for name in ("opacity", "colour"):
                self._slider(
                    f"its {name}",
                    getattr(modulation, name),
                    1.0,
                    lambda to, name=name: desk.modulate(replace(modulation, **{name: to})),
                )
        distance = desk.look.gradient_distance
        changed, to = imgui.slider_float("gradient distance", distance, 0.5, 4.0, "%.2f voxels", _CLAMPED)
        if changed:
            desk.set_look(replace(desk.look, gradient_distance=to))

    def _slider(self, name: str, value: float, most: float, act: Callable[[float], Any]) -> None:
        changed, to = imgui.slider_float(name, value, 0.0, most, "%.2f", _CLAMPED)
        self._mark(name)
        if changed:
            act(to)
