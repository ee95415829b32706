"""Rays through a volume whose gradient counts: lit, modulated, or shown by a two-dimensional function."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._jit import kernel, parallel_kernel, prange
from ..optics.look import Look
from ..optics.transfer import TransferFunction
from ..optics.transfer2d import TransferFunction2D
from ..volume.grid import Volume
from ._material import Material, look_up, material_of, material_zones, may_show
from ._plain import ATTEMPTS, MAX_HALVINGS
from ._rays import CHANGE, DEPTH, OPAQUE_DEPTH, Rays, Shown, cut_ray, is_shown
from ._shading import Lights, answers, highlight, light_direction, light_zones, lights_of, normal_of
from ._shadows import transmittance_to
from ._stretch import (
    Field,
    Stretch,
    cut_at_breaks,
    field_of,
    gradient_on,
    lay_gradient,
    lay_value,
    next_cut,
    room_for,
    set_out,
    value_on,
)

_ROOT15 = np.sqrt(15.0)
_LEAST_HALVINGS = 2  # of a piece: what only the gradient decides shows at no break of the values
# All of an opaque panel's light comes from its first part, where no place may be: in its own shadow, then.
_DEEPEST = 2.0
# A bend between an end of a half panel and its first place hides ½ · 0.056² of the slope there: of twice
# the mean slope, at both ends, this part of what the colour changes over the panel.
_HIDDEN = 0.006

# Columns of a panel: where, level, steps and bends at both ends, extinction and colour at three places.
_START, _WIDTH, _LEVEL, _ENDS, _NODES, _PANEL = 0, 1, 2, 3, 7, 19


class _Scene(NamedTuple):
    """All that rays have in common."""

    field: Field
    material: Material
    lights: Lights
    asks: bool  # for the gradient
    shown: Shown
    limit: float  # of one piece's change


class _Ray(NamedTuple):
    """A ray and the room it needs."""

    eye: NDArray[np.float64]
    direction: NDArray[np.float64]
    sight: NDArray[np.float64]
    stretch: Stretch
    shadow: Stretch
    shadow_ends: NDArray[np.float64]
    panels: NDArray[np.float64]


def caster(
    volume: Volume,
    data: NDArray[np.float32],
    transfer: TransferFunction | TransferFunction2D,
    look: Look,
    shown: Shown,
    tolerance: float,
) -> Callable[[Rays, NDArray[np.float64]], None]:
    """What casts rays into their accumulators."""
    field = field_of(volume, data, look.gradient_distance)
    material = material_of(volume, transfer, look)
    lights = lights_of(volume, look)
    modulated = material.modulation[2] > 0 or material.modulation[3] > 0
    asks = lights.on or modulated or material.asks_gradient

    def cast(rays: Rays, states: NDArray[np.float64]) -> None:
        _cast_band(field, material, lights, asks, rays, shown, tolerance, states)

    return cast


@parallel_kernel
def _cast_band(field, material, lights, asks, rays, shown, tolerance, states):
    for pixel in prange(len(states)):
        eye, direction, sight = rays.starts[pixel], rays.directions[pixel], rays.sights[pixel]
        state = states[pixel]
        ends = np.empty(len(shown.planes) + 2)
        stretch, shadow = room_for(field, material.breaks), room_for(field, material.breaks)
        panels, shadow_ends = np.empty((MAX_HALVINGS + 3, _PANEL)), np.empty(len(shown.planes) + 2)
        ray = _Ray(eye, direction, sight, stretch, shadow, shadow_ends, panels)
        count = cut_ray(eye, direction, rays.near, shown.planes, shown.kinds, ends)
        limit = tolerance / 32
        for _ in range(ATTEMPTS):
            state[:] = 0.0
            scene = _Scene(field, material, lights, asks, shown, limit)
            for n in range(count - 1):
                middle = 0.5 * (ends[n] + ends[n + 1])
                if ends[n] < ends[n + 1] and is_shown(
                    eye, direction, middle, shown.planes, shown.kinds, shown.crop_flags
                ):
                    _cast_ray(scene, ray, ends[n], ends[n + 1], state)
            if state[CHANGE] <= tolerance:
                break
            limit /= 16


@kernel
def _cast_ray(scene, ray, entry, leave, state):
    """Front to back between two distances; adds to `state`."""
    field, material = scene.field, scene.material
    eye, direction, stretch = ray.eye, ray.direction, ray.stretch
    set_out(field, eye, direction, entry, stretch.planes)
    here = entry
    while here < leave and state[DEPTH] < OPAQUE_DEPTH:
        there = next_cut(eye, direction, here, leave, stretch.planes)
        lowest, highest = lay_value(field, eye, direction, here, there, stretch)
        if lowest == lowest and may_show(material, lowest, highest):
            if scene.asks:
                lay_gradient(field, eye, direction, here, there, stretch)
            where = (here, there)
            count = cut_at_breaks(stretch, material.breaks)
            for n in range(count):
                if state[DEPTH] < OPAQUE_DEPTH:
                    _integrate(scene, ray, where, n, state)
        here = there


@kernel
def _light_up(scene, ray, where, piece, u, node):
    """Fill `node`: extinction per opacity unit and colour at u of the stretch."""
    field, material, lights = scene.field, scene.material, scene.lights
    eye, direction, sight, stretch = ray.eye, ray.direction, ray.sight, ray.stretch
    gradient = gradient_on(field, stretch, u) if scene.asks else (0.0, 0.0, 0.0)
    magnitude = np.sqrt(gradient[0] ** 2 + gradient[1] ** 2 + gradient[2] ** 2)
    depth, red, green, blue = look_up(material, piece, value_on(stretch, u), magnitude)
    node[0], node[1], node[2], node[3] = depth, red, green, blue
    if not lights.on or not depth > 0:
        return
    node[1], node[2], node[3] = lights.constant * red, lights.constant * green, lights.constant * blue
    normal = normal_of(lights, gradient, sight)
    for n in range(len(lights.towards)):
        cosine, glance = answers(lights, normal, sight, light_direction(lights, n, sight))
        matt, gloss = lights.diffuse * cosine, lights.specular * highlight(lights, glance)
        if matt == 0 and gloss == 0:
            continue
        if lights.shadows[n]:
            distance = where[0] + u * (where[1] - where[0])
            along = (lights.along[n, 0], lights.along[n, 1], lights.along[n, 2])
            point = (
                eye[0] + distance * direction[0] + lights.offset * along[0],
                eye[1] + distance * direction[1] + lights.offset * along[1],
                eye[2] + distance * direction[2] + lights.offset * along[2],
            )
            left = transmittance_to(
                field, material, scene.shown, point, along, scene.limit, ray.shadow, ray.shadow_ends
            )
            matt, gloss = matt * left, gloss * left
        node[1] += lights.colours[n, 0] * (matt * red + gloss)
        node[2] += lights.colours[n, 1] * (matt * green + gloss)
        node[3] += lights.colours[n, 2] * (matt * blue + gloss)


@kernel
def _zones(scene, ray, u, ends):
    """Fill two numbers: the steps and the bends at u."""
    ends[0], ends[1] = 0.0, 0.0
    if not scene.asks:
        return
    gradient = gradient_on(scene.field, ray.stretch, u)
    magnitude = np.sqrt(gradient[0] ** 2 + gradient[1] ** 2 + gradient[2] ** 2)
    steps, bends = material_zones(scene.material, value_on(ray.stretch, u), magnitude)
    if scene.lights.on:
        more_steps, more_bends = light_zones(scene.lights, gradient, ray.sight)
        steps, bends = 2 * steps + more_steps, 31 * bends + more_bends
    ends[0], ends[1] = steps, bends


@kernel
def _fill(scene, ray, where, piece, panel):
    """The three places of a panel whose start and width are set."""
    for n in range(3):
        u = panel[_START] + (0.5 + (n - 1) * _ROOT15 / 10) * panel[_WIDTH]
        node = panel[_NODES + 4 * n : _NODES + 4 * n + 4]
        _light_up(scene, ray, where, piece, u, node)


@kernel
def _integrate(scene, ray, where, n, state):
    """Add the light of one piece, halving until one halving more changes the pixel by ≤ the limit."""
    panels, cuts = ray.panels, ray.stretch.cuts
    start, end, piece = cuts[n, 0], cuts[n + 1, 0], int(cuts[n, 1])
    length = (where[1] - where[0]) / scene.material.unit
    top = 0
    panels[0, _START], panels[0, _WIDTH], panels[0, _LEVEL] = start, end - start, 0.0
    _zones(scene, ray, start, panels[0, _ENDS : _ENDS + 2])
    _zones(scene, ray, end, panels[0, _ENDS + 2 : _ENDS + 4])
    _fill(scene, ray, where, piece, panels[0])
    while top >= 0:
        whole, front, back = panels[top], panels[top + 1], panels[top + 2]
        half, level = 0.5 * whole[_WIDTH], whole[_LEVEL]
        front[_START], back[_START] = whole[_START], whole[_START] + half
        for part in (front, back):
            part[_WIDTH], part[_LEVEL] = half, level + 1
            _fill(scene, ray, where, piece, part)
        front[_ENDS : _ENDS + 2] = whole[_ENDS : _ENDS + 2]
        back[_ENDS + 2 : _ENDS + 4] = whole[_ENDS + 2 : _ENDS + 4]
        _zones(scene, ray, back[_START], back[_ENDS : _ENDS + 2])
        front[_ENDS + 2 : _ENDS + 4] = back[_ENDS : _ENDS + 2]

        depth, red, green, blue = _panel(whole, length)
        depth_1, red_1, green_1, blue_1 = _panel(front, length)
        depth_2, red_2, green_2, blue_2 = _panel(back, length)
        behind = np.exp(-depth_1)
        red_12, green_12, blue_12 = (
            red_1 + behind * red_2,
            green_1 + behind * green_2,
            blue_1 + behind * blue_2,
        )
        depth_12 = depth_1 + depth_2
        opacity = -np.expm1(-depth_12)
        change = abs(opacity + np.expm1(-depth))
        change = max(change, max(abs(red_12 - red), max(abs(green_12 - green), abs(blue_12 - blue))))
        change = max(change, _hidden(whole, front, back, opacity))
        transmittance = np.exp(-state[DEPTH])
        coarse = level < _LEAST_HALVINGS or change * transmittance > scene.limit
        deep = depth_12 > _DEEPEST and transmittance > scene.limit
        if level < MAX_HALVINGS and (coarse or deep):
            # The front half is next; the back half waits in the place of the whole.
            panels[top] = back
            top += 1
            continue
        state[0] += transmittance * red_12
        state[1] += transmittance * green_12
        state[2] += transmittance * blue_12
        state[DEPTH] += depth_12
        state[CHANGE] += change * transmittance
        if state[DEPTH] > OPAQUE_DEPTH:
            return
        top -= 1


@kernel
def _hidden(whole, front, back, opacity):
    """Most that a step or a bend that no place has met can change, where the zones tell that there is one."""
    middle = back[_ENDS : _ENDS + 2]
    stepped = whole[_ENDS] != middle[0] or whole[_ENDS + 2] != middle[0]
    bent = whole[_ENDS + 1] != middle[1] or whole[_ENDS + 3] != middle[1]
    if not (stepped or bent):
        return 0.0
    brightest, spread = 1.0, 0.0
    for c in range(1, 4):
        least, most = whole[_NODES + c], whole[_NODES + c]
        for n in range(_NODES + c, _PANEL, 4):
            least = min(least, min(whole[n], min(front[n], back[n])))
            most = max(most, max(whole[n], max(front[n], back[n])))
        brightest, spread = max(brightest, most), max(spread, most - least)
    return opacity * brightest if stepped else opacity * spread * _HIDDEN


@kernel
def _panel(panel, length):
    """Optical depth and light of one panel by the three-stage Gauss rule."""
    scale = length * panel[_WIDTH]
    a, b, c = panel[_NODES : _NODES + 4], panel[_NODES + 4 : _NODES + 8], panel[_NODES + 8 : _NODES + 12]
    t1, t2, t3 = scale * a[0], scale * b[0], scale * c[0]
    depth = (5 * t1 + 8 * t2 + 5 * t3) / 18
    if not depth > 0:
        return 0.0, 0.0, 0.0, 0.0
    # Depths up to the three nodes.
    d1 = t1 * (5 / 36) + t2 * (2 / 9 - _ROOT15 / 15) + t3 * (5 / 36 - _ROOT15 / 30)
    d2 = t1 * (5 / 36 + _ROOT15 / 24) + t2 * (2 / 9) + t3 * (5 / 36 - _ROOT15 / 24)
    d3 = t1 * (5 / 36 + _ROOT15 / 30) + t2 * (2 / 9 + _ROOT15 / 15) + t3 * (5 / 36)
    e1, e2, e3 = 5 * t1 * np.exp(-d1) / 18, 8 * t2 * np.exp(-d2) / 18, 5 * t3 * np.exp(-d3) / 18
    opacity = -np.expm1(-depth)
    # The colour's mean, weighted by extinction, is exact at any depth; the rest is small where colours are
    # alike: red = mean · opacity + Σ e · (colour − mean).
    w1, w2, w3 = 5 * t1 / (18 * depth), 8 * t2 / (18 * depth), 5 * t3 / (18 * depth)
    rest = opacity - e1 - e2 - e3
    f1, f2, f3 = w1 * rest + e1, w2 * rest + e2, w3 * rest + e3
    red = f1 * a[1] + f2 * b[1] + f3 * c[1]
    green = f1 * a[2] + f2 * b[2] + f3 * c[2]
    blue = f1 * a[3] + f2 * b[3] + f3 * c[3]
    return depth, red, green, blue
