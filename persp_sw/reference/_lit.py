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
from ._panels import (
    DEEPEST,
    ENDS,
    LEVEL,
    NODES,
    PANEL,
    PLACES,
    START,
    WIDTH,
    hidden_change,
    light_of_panel,
)
from ._plain import ATTEMPTS, MAX_HALVINGS
from ._rays import CHANGE, DEPTH, OPAQUE_DEPTH, Rays, Shown, cut_ray, is_shown
from ._shading import Lights, answers, highlight, light_direction, light_zones, lights_of, normal_of
from ._shadows import transmittance_to, way_out
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

# What only the gradient decides shows at no break of the values: a piece is looked at in so many places,
# which is cheap, and halved down to them where they differ. Edges of shadows show in no such look: where
# there are any, pieces are halved in any case.
_LOOKS, _LOOKED_HALVINGS, _SHADOW_HALVINGS = 8, 3, 2


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
        panels, shadow_ends = np.empty((MAX_HALVINGS + 3, PANEL)), np.empty(len(shown.planes) + 2)
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
def _way_to_light(scene, ray, where, u, n):
    """Where the way to light number n begins whose shadows count at u."""
    distance, offset, along = where[0] + u * (where[1] - where[0]), scene.lights.offset, scene.lights.along[n]
    return (
        ray.eye[0] + distance * ray.direction[0] + offset * along[0],
        ray.eye[1] + distance * ray.direction[1] + offset * along[1],
        ray.eye[2] + distance * ray.direction[2] + offset * along[2],
    )


@kernel
def _light_up(scene, ray, where, piece, u, node):
    """Fill `node`: extinction per opacity unit and colour at u of the stretch."""
    field, material, lights = scene.field, scene.material, scene.lights
    sight, stretch = ray.sight, ray.stretch
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
            point, along = _way_to_light(scene, ray, where, u, n), lights.along[n]
            left = transmittance_to(
                field, material, scene.shown, point, along, scene.limit, ray.shadow, ray.shadow_ends
            )
            matt, gloss = matt * left, gloss * left
        node[1] += lights.colours[n, 0] * (matt * red + gloss)
        node[2] += lights.colours[n, 1] * (matt * green + gloss)
        node[3] += lights.colours[n, 2] * (matt * blue + gloss)


@kernel
def _zones(scene, ray, where, u, ends):
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
        for n in range(len(scene.lights.shadows)):
            if scene.lights.shadows[n]:
                point = _way_to_light(scene, ray, where, u, n)
                bends = 64 * bends + way_out(point, scene.lights.along[n], scene.shown)
    ends[0], ends[1] = steps, bends


@kernel
def _fill(scene, ray, where, piece, panel):
    """The three places of a panel whose start and width are set."""
    for n in range(3):
        u = panel[START] + PLACES[n] * panel[WIDTH]
        node = panel[NODES + 4 * n : NODES + 4 * n + 4]
        _light_up(scene, ray, where, piece, u, node)


@kernel
def _integrate(scene, ray, where, n, state):
    """Add the light of one piece, halving until one halving more changes the pixel by ≤ the limit."""
    panels, cuts = ray.panels, ray.stretch.cuts
    start, end, piece = cuts[n, 0], cuts[n + 1, 0], int(cuts[n, 1])
    length = (where[1] - where[0]) / scene.material.unit
    top = 0
    panels[0, START], panels[0, WIDTH], panels[0, LEVEL] = start, end - start, 0.0
    _zones(scene, ray, where, start, panels[0, ENDS : ENDS + 2])
    _zones(scene, ray, where, end, panels[0, ENDS + 2 : ENDS + 4])
    _fill(scene, ray, where, piece, panels[0])
    least = _SHADOW_HALVINGS if scene.lights.shadows.any() else 0
    if scene.asks and _differs(scene, ray, where, panels[0], panels[1]):
        least = _LOOKED_HALVINGS
    while top >= 0:
        whole, front, back = panels[top], panels[top + 1], panels[top + 2]
        half, level = 0.5 * whole[WIDTH], whole[LEVEL]
        front[START], back[START] = whole[START], whole[START] + half
        for part in (front, back):
            part[WIDTH], part[LEVEL] = half, level + 1
            _fill(scene, ray, where, piece, part)
        front[ENDS : ENDS + 2] = whole[ENDS : ENDS + 2]
        back[ENDS + 2 : ENDS + 4] = whole[ENDS + 2 : ENDS + 4]
        _zones(scene, ray, where, back[START], back[ENDS : ENDS + 2])
        front[ENDS + 2 : ENDS + 4] = back[ENDS : ENDS + 2]

        depth, red, green, blue = light_of_panel(whole, length)
        depth_1, red_1, green_1, blue_1 = light_of_panel(front, length)
        depth_2, red_2, green_2, blue_2 = light_of_panel(back, length)
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
        change = max(change, hidden_change(whole, front, back, opacity))
        transmittance = np.exp(-state[DEPTH])
        coarse = level < least or change * transmittance > scene.limit
        deep = depth_12 > DEEPEST and transmittance > scene.limit
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
def _differs(scene, ray, where, panel, scratch):
    """Whether steps or bends lie between places of a panel."""
    ends, here = panel[ENDS : ENDS + 4], scratch[ENDS : ENDS + 2]
    if ends[0] != ends[2] or ends[1] != ends[3]:
        return True
    for n in range(1, _LOOKS):
        _zones(scene, ray, where, panel[START] + n / _LOOKS * panel[WIDTH], here)
        if here[0] != ends[0] or here[1] != ends[1]:
            return True
    return False
