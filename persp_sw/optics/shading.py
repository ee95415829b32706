"""A look in the numbers that kernels take."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..kernels import phong
from ..kernels.phong import Shade
from ..volume.gradient import FAINTEST, largest_magnitude, world_from_differences
from ..volume.grid import Volume
from ..volume.lift import lift_exponent
from .classification import Classification
from .lighting import Light, Lighting
from .look import Look, Modulation
from .reflectance import Reflectance, reflectance_of

if TYPE_CHECKING:
    from .shadows import Shadows


def weights_of(modulation: Modulation | None, largest: float) -> tuple[float, float, float, float]:
    """A modulation as kernels take it: lowest magnitude, weight a magnitude, shares of extinction and colour.

    `largest`: the longest gradient possible, in the unit that magnitudes are told in.
    """
    modulation = modulation or Modulation(opacity=0, colour=0)
    shares = modulation.opacity, modulation.colour
    if not largest > 0:
        return 0.0, 0.0, *shares
    return modulation.low * largest, 1 / ((modulation.high - modulation.low) * largest), *shares


def shade_of(
    look: Look,
    volume: Volume,
    axes: list[int],
    classification: Classification,
    shadows: Shadows | None = None,
) -> Shade:
    """What gradients do to a transfer function, in the standard space of these axes (i, j, k).

    Kernels see values as `volume.lift` brings them near 1, and so do these numbers.
    """
    lighting = look.lighting
    largest = float(np.ldexp(largest_magnitude(volume, look.gradient_distance), lift_exponent(volume)))
    numbers = np.zeros(phong.NUMBERS, np.float32)
    numbers[phong.REACH] = look.gradient_distance
    # No gradient at all has no normal, but must not divide by zero.
    numbers[phong.FAINT] = max((FAINTEST * largest) ** 2, float(np.finfo(np.float32).tiny))
    weights = phong.LOW, phong.PER_WEIGHT, phong.THICKENED, phong.COLOURED
    numbers[list(weights)] = weights_of(look.modulation, largest)
    numbers[phong.ROWS], numbers[phong.MAGNITUDES] = len(classification.table), classification.magnitudes
    numbers[phong.PER_MAGNITUDE] = classification.per_magnitude
    numbers[phong.OWN] = 1.0 if lighting is None else lighting.emissive + lighting.ambient
    numbers[phong.PER_SHADOW] = 0 if shadows is None else 1 / shadows.factor
    lighting = lighting or Lighting(diffuse=0, specular=0)
    numbers[phong.POWER] = lighting.power
    numbers[phong.TWO_SIDED], numbers[phong.BLINN] = lighting.two_sided, lighting.model == "blinn"
    numbers[phong.SHADOW_SIZE :][:3] = 0 if shadows is None else shadows.size(tuple(axes))
    numbers[phong.HEADLIGHT :][:6] = _colours(lighting, lighting.headlight)
    numbers[phong.NORMAL_FROM_SLOPES :][:9] = -world_from_differences(volume)[:, axes].ravel()
    numbers[phong.WORLD_FROM_STANDARD :][:9] = volume.world_from_object[:3, axes].ravel()
    maps, lights = reflectance_of(lighting), lighting.lights
    if maps is not None:
        numbers[[phong.HALF_DIFFUSE, phong.HALF_MIRRORED]] = maps.halves
        numbers = _joined(numbers.tobytes(), maps)
        lights = tuple(light for light in lights if light.shadows)
    return Shade(
        numbers,
        _lights(lights, lighting, volume, axes, 1 if shadows is None else shadows.factor),
        np.zeros(1, np.uint16) if shadows is None else shadows.standard(tuple(axes)),
    )


@lru_cache(maxsize=3)  # for a volume's three axes: megabytes, which each picture would copy anew
def _joined(numbers: bytes, maps: Reflectance) -> NDArray[np.float32]:
    return np.concatenate([np.frombuffer(numbers, np.float32), maps.texels.ravel()])


def _colours(lighting: Lighting, colour: tuple[float, float, float]) -> NDArray[np.float32]:
    """(6,): what of a light's colour is reflected in all directions, and what is mirrored."""
    return np.outer([lighting.diffuse, lighting.specular], colour).astype(np.float32).ravel()


def _lights(
    lights: tuple[Light, ...], lighting: Lighting, volume: Volume, axes: list[int], coarser: int
) -> NDArray[np.float32]:
    object_from_world = np.linalg.inv(volume.world_from_object[:3, :3])
    # Shadows that are coarser than the data blur a surface's outermost layer as much more.
    offset = lighting.shadow_offset * min(volume.spacing) * coarser
    rows, shadows = [], 0
    for light in lights:
        number, shadows = (shadows, shadows + 1) if light.shadows else (-1, shadows)
        start = (object_from_world @ light.direction * offset)[axes]
        rows.append([*light.direction, *_colours(lighting, light.colour), number, *start])
    return np.array(rows, np.float32).reshape(-1, phong.LIGHT_COLUMNS)
