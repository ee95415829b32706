"""Lights, and how surfaces answer them: Phong's model, with normals from the volume's gradient."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from ..arrays import Vector, number, vector
from ..errors import LookError

Model = Literal["phong", "blinn"]
Three = tuple[float, float, float]

_BRIGHTEST = 1e3


@dataclass(frozen=True)
class Light:
    """A directional light, as far away as the sun.

    Parameters
    ----------
    direction
        Towards the light, world; any length but 0.
    colour
        Linear r, g, b, each 0 … 1000.
    shadows
        Whether the volume shadows itself from it: at each place the light is dimmed by the transmittance of
        what is shown on the straight way towards it; where that begins, `Lighting` says (`shadow_offset`).

    Raises
    ------
    LookError
        Not three finite numbers, no direction, or a colour out of range.
    """

    direction: Three
    colour: Three = (1.0, 1.0, 1.0)
    shadows: bool = False

    def __post_init__(self):
        direction = vector(self.direction, "a light's direction", LookError)
        length = float(np.linalg.norm(direction))
        if not length > 0:
            raise LookError(f"a light's direction needs a length; given {self.direction!r}")
        object.__setattr__(self, "direction", tuple((direction / length).tolist()))
        object.__setattr__(self, "colour", _colour(self.colour, "a light's colour"))
        _truth(self.shadows, "a light's shadows")


@dataclass(frozen=True)
class Lighting:
    """Phong's model: what is seen of a colour C under lights L of colours I; V leads to the eye.

        C · (emissive + ambient + diffuse · Σ I · max(N·L, 0)) + specular · Σ I · max(R·L, 0)^power

    N is the normal, against the gradient: from large values to small ones; R = 2·(N·V)·N − (N·N)·V is V
    mirrored. With the model "blinn" R·L gives way to N·H, H = (L + V) / |L + V|. Sums run over `lights` and
    the headlight, a light at the eye: L = V on each ray. Where values do not change there is no normal, and
    only what is emitted and ambient is left: N = −g / √(|g|² + ε²), g the gradient, ε a 10,000th of the
    longest one possible (`volume.gradient`). N·N, not 1: else a light behind would shine through such places
    as a highlight. A surface seen from behind, N·V < 0, has no highlights. Results may exceed 1. Eight and
    more lights without shadows may be summed into maps, which change colours by less than 1/510, half a step
    of 8-bit pictures (`optics.reflectance`); `reference` never does so.

    Parameters
    ----------
    ambient, diffuse, specular, emissive
        0 … 1000. Emissive light counts like ambient light; it is the volume's own.
    power
        Of highlights, 0.1 … 10000.
    headlight
        Linear r, g, b, or one number for all three, 0 … 1000; 0: there is none.
    lights
        Any number of them.
    two_sided
        The normal is turned towards the eye, so that surfaces are lit alike from within and from outside.
    model
        "phong" or "blinn".
    shadow_offset
        Smallest spacings, 0 … 100, towards a light from where shadows begin to count: with 0 a surface lies
        in the shadow of its own outermost layer, and is darker than a lit one. Of the shadows' own spacings
        where they are coarser than the data (volumes of over 160 voxels).

    Raises
    ------
    LookError
        A number out of range, or lights that are none.

    Source: Phong 1975; Blinn 1977.
    """

    ambient: float = 0.2
    diffuse: float = 0.8
    specular: float = 0.3
    power: float = 20.0
    emissive: float = 0.0
    headlight: float | Three = 1.0
    lights: tuple[Light, ...] = ()
    two_sided: bool = True
    model: Model = "phong"
    shadow_offset: float = 2.0

    def __post_init__(self):
        for name in ("ambient", "diffuse", "specular", "emissive"):
            object.__setattr__(self, name, number(getattr(self, name), name, LookError, 0, _BRIGHTEST))
        object.__setattr__(self, "power", number(self.power, "power", LookError, 0.1, 1e4))
        object.__setattr__(self, "headlight", _colour(self.headlight, "headlight"))
        if not isinstance(self.lights, Iterable) or not all(isinstance(one, Light) for one in self.lights):
            raise LookError(f"lights are a sequence of Light; given {self.lights!r}")
        object.__setattr__(self, "lights", tuple(self.lights))
        _truth(self.two_sided, "two_sided")
        offset = number(self.shadow_offset, "shadow_offset", LookError, 0, 100)
        object.__setattr__(self, "shadow_offset", offset)
        if self.model not in get_args(Model):
            raise LookError(f"model is one of {', '.join(get_args(Model))}; given {self.model!r}")


def _colour(value: float | Vector, name: str) -> Three:
    if np.ndim(value) == 0:
        value = (number(value, name, LookError, 0, _BRIGHTEST),) * 3
    colour = vector(value, name, LookError)
    if (colour < 0).any() or (colour > _BRIGHTEST).any():
        raise LookError(f"{name} has numbers 0 … {_BRIGHTEST:g}; given {value!r}")
    return tuple(colour.tolist())


def _truth(value: bool, name: str) -> None:
    if not isinstance(value, bool):
        raise LookError(f"{name} is true or false; given {value!r}")
