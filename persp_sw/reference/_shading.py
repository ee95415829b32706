"""Phong's model at a point, in float64."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._jit import kernel
from ..optics.look import Look
from ..volume.gradient import FAINTEST, largest_magnitude
from ..volume.grid import Volume


class Lights(NamedTuple):
    """Lights and how surfaces answer them; see `optics.lighting`.

    Attributes
    ----------
    on
        Whether there is any lighting.
    constant
        Emissive and ambient together.
    floor
        Squared, the gradient below which normals fade.
    towards, along
        (n, 3): unit vectors to the lights, world; the same per world unit in object space.
    colours, shadows
        (n, 3) and (n,). The last light is the headlight; its direction is not used.
    offset
        World distance towards a light from where its shadows count.
    """

    on: bool
    constant: float
    diffuse: float
    specular: float
    power: float
    blinn: bool
    two_sided: bool
    floor: float
    towards: NDArray[np.float64]
    along: NDArray[np.float64]
    colours: NDArray[np.float64]
    shadows: NDArray[np.bool_]
    offset: float


def lights_of(volume: Volume, look: Look) -> Lights:
    """The tables of a look's lighting."""
    lighting = look.lighting
    if lighting is None:
        none = *np.zeros((3, 1, 3)), np.zeros(1, bool)
        return Lights(False, 1.0, 0.0, 0.0, 1.0, False, False, 0.0, *none, 0.0)
    towards = np.array([*(light.direction for light in lighting.lights), (0.0, 0.0, 0.0)])
    colours = np.array([*(light.colour for light in lighting.lights), lighting.headlight])
    shadows = np.array([*(light.shadows for light in lighting.lights), False])
    object_from_world = np.linalg.inv(volume.world_from_object[:3, :3])
    return Lights(
        True,
        lighting.emissive + lighting.ambient,
        lighting.diffuse,
        lighting.specular,
        lighting.power,
        lighting.model == "blinn",
        lighting.two_sided,
        (FAINTEST * largest_magnitude(volume, look.gradient_distance)) ** 2,
        towards,
        towards @ object_from_world.T,
        colours,
        shadows,
        lighting.shadow_offset * min(volume.spacing),
    )


@kernel
def normal_of(lights, gradient, sight):
    """Against the gradient, fading where that is faint; towards the eye if two-sided."""
    x, y, z = gradient
    square = x * x + y * y + z * z
    if not square > 0:
        return 0.0, 0.0, 0.0
    factor = -1 / np.sqrt(square + lights.floor)
    if lights.two_sided and factor * (x * sight[0] + y * sight[1] + z * sight[2]) < 0:
        factor = -factor
    return factor * x, factor * y, factor * z


@kernel
def light_direction(lights, n, sight):
    """Towards light number n; the last one is at the eye."""
    if n == len(lights.towards) - 1:
        return sight[0], sight[1], sight[2]
    return lights.towards[n, 0], lights.towards[n, 1], lights.towards[n, 2]


@kernel
def answers(lights, normal, sight, light):
    """Cosine, not below 0, and the base of the highlight's power, of either sign."""
    cosine = normal[0] * light[0] + normal[1] * light[1] + normal[2] * light[2]
    facing = normal[0] * sight[0] + normal[1] * sight[1] + normal[2] * sight[2]
    between = light[0] * sight[0] + light[1] * sight[1] + light[2] * sight[2]
    if lights.blinn:
        length = np.sqrt(max(2 + 2 * between, 0.0))  # of L + V
        glance = (cosine + facing) / length if length > 1e-12 else 0.0
    else:
        square = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]
        glance = 2 * facing * cosine - square * between
    if facing <= 0:  # seen from behind
        glance = 0.0
    return max(cosine, 0.0), glance


@kernel
def highlight(lights, glance):
    """What a highlight's base gives."""
    return glance**lights.power if glance > 0 else 0.0


@kernel
def light_zones(lights, gradient, sight):
    """Two numbers that differ wherever a step, or only a bend, of the light lies between two places."""
    steps, bends = 0, 0
    facing = gradient[0] * sight[0] + gradient[1] * sight[1] + gradient[2] * sight[2]
    if len(lights.towards) > 1:
        steps = 1 if facing < 0 else 0
    else:
        bends = 1 if facing < 0 else 0
    normal = normal_of(lights, gradient, sight)
    for n in range(len(lights.towards)):
        cosine, glance = answers(lights, normal, sight, light_direction(lights, n, sight))
        bends = bends * 4 + (1 if cosine > 0 else 0) + (2 if glance > 0 else 0)
    return steps, bends
