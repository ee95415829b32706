"""Many directional lights summed once into maps over directions: any number for the price of a look-up.

With q on the octahedron |q|₁ = |x| + |y| + |z| = 1, N the normal and R what is seen of it, mirrored, where
|R| = N·N (`optics.lighting`), and I the lights' colours as reflected (diffuse) or mirrored (specular):

    Σ I · max(N·L, 0)       = |N|₁ · D(N / |N|₁),            D(q) = Σ I · max(q·L, 0)
    Σ I · max(R·L, 0)^power = (N·N)^power · S(R / |R|₁),     S(q) = Σ I · max(q·L / |q|, 0)^power

Maps hold D and S at texels, between which kernels interpolate linearly in triangles: `kernels.reflect` has
the layout. They depend on neither view nor volume. How fine they are, and whether they serve at all, follows
from bounds of the error:

- D is linear on each face of the octahedron but where a light sets. There, of a light whose q·L is P above
  0 at some corner of a triangle and Q below at another, it errs by PQ / (P + Q) ≤ (P + Q) / 4 at most, and
  P + Q ≤ √2 / half, an edge of a triangle; times |N|₁ ≤ √3, for all lights that set in one triangle. Across
  it directions turn by √6 / half at most.
- S bends: a linear interpolant errs by M·ρ² / 2 (Waldron 1998), M the largest second derivative along any
  line, ρ² = 2 / (3·half²) of the triangle's circumscribed circle. Along a line at distance D from the
  middle, directions turn by ψ' = D / |q|² ≤ √3 a unit, and |ψ''| ≤ 1 / |q|² ≤ 3; the cosine c to a light has
  c'² ≤ 1 − c² and c'' = −c. So M ≤ 3·Σ I·m(c), with m of `_bend`: the error is Σ I·m(c) / half² at most.

Both sums are largest somewhere: they are taken at the texels of a coarse map, each for all directions that
are nearer to it than to others. An error of D is never below 0.

Sources: reflectance maps as VolumePro has them, Pfister et al. 1999; the map's shape, Praun and Hoppe 2003.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .lighting import Light, Lighting

# Lights from which on a map costs less than they do one by one; `benchmarks/reflectance.py`.
LIGHTS_THAT_PAY = 8
# Half a step of 8-bit pictures, linear, of brightness 1: what maps may change of a colour.
LARGEST_ERROR = 1 / 510
# A part of it is the diffuse map's: its error falls with the size, that of the other with its square.
_DIFFUSE_PART = 7 / 8
# Half the cells along an edge; at 256 a map has 4 MB.
HALVES = (16, 24, 32, 48, 64, 96, 128, 192, 256)
# Below, the second derivative is infinite where a light sets.
_LEAST_POWER = 2.0
_COARSE = 64  # half of the map on which sums are bounded
_ANGLES = 4096
_AT_ONCE = 8192  # texels


@dataclass(frozen=True, eq=False)
class Reflectance:
    """Maps of some lights' diffuse and mirrored light.

    Attributes
    ----------
    lights
        Which lights they hold.
    halves
        Half the cells along an edge of the diffuse map, and of the mirrored one: 0, none.
    texels
        float32 (n, 4): those of the first map, then those of the second.
    error
        What they change at most of any colour up to 1, but for float32's roundings.
    """

    lights: tuple[Light, ...]
    halves: tuple[int, int]
    texels: NDArray[np.float32]
    error: float


def reflectance_of(lighting: Lighting) -> Reflectance | None:
    """Maps of all lights that cast no shadows; None where these are cheaper or nearer the truth one by one.

    Nearer the truth: highlights of Blinn's model, which depend on two directions, or of a power below 2; and
    where the finest maps would err by more than LARGEST_ERROR: bright lights many of which set at one place,
    or bright highlights of a power of some hundred and more.
    """
    lights = tuple(light for light in lighting.lights if not light.shadows)
    smooth = lighting.model == "phong" and lighting.power >= _LEAST_POWER
    if len(lights) < LIGHTS_THAT_PAY or not (smooth or lighting.specular == 0):
        return None
    return built(lights, lighting.diffuse, lighting.specular, lighting.power)


@lru_cache(maxsize=4)
def built(lights: tuple[Light, ...], diffuse: float, specular: float, power: float) -> Reflectance | None:
    """Maps of these lights, the coarsest that are fine enough; None where none is."""
    towards = np.array([light.direction for light in lights])
    colours = np.array([light.colour for light in lights])
    halves, error = [], 0.0
    allowed = LARGEST_ERROR * _DIFFUSE_PART, LARGEST_ERROR * (1 - _DIFFUSE_PART)
    bounds = diffuse_errors(towards, diffuse * colours), mirrored_errors(towards, specular * colours, power)
    for found, most in zip(bounds, allowed, strict=True):
        fine = np.flatnonzero(found <= most)
        if not len(fine):
            return None
        halves.append(HALVES[fine[0]])
        error += float(found[fine[0]])
    if specular == 0:
        halves[1] = 0
    texels = [diffuse_map(towards, diffuse * colours, halves[0])]
    if halves[1]:
        texels.append(mirrored_map(towards, specular * colours, power, halves[1]))
    return Reflectance(lights, (halves[0], halves[1]), np.concatenate(texels), error)


def octahedron(half: int) -> NDArray[np.float64]:
    """(n, 3): the places q of a map's texels, row by row."""
    steps = np.arange(-half, half + 1) / half
    u, v = (axis.ravel() for axis in np.meshgrid(steps, steps))
    z = 1 - np.abs(u) - np.abs(v)
    x = np.where(z < 0, np.copysign(1 - np.abs(v), u), u)
    y = np.where(z < 0, np.copysign(1 - np.abs(u), v), v)
    return np.column_stack([x, y, z])


def diffuse_map(towards: NDArray[np.float64], colours: NDArray[np.float64], half: int) -> NDArray[np.float32]:
    """(n, 4): D at the texels. `towards`, `colours`: (lights, 3), to each light and I of it."""
    return _summed(octahedron(half), towards, colours, 1.0)


def mirrored_map(
    towards: NDArray[np.float64], colours: NDArray[np.float64], power: float, half: int
) -> NDArray[np.float32]:
    """(n, 4): S at the texels. `towards`, `colours`: (lights, 3), to each light and I of it."""
    return _summed(_unit(octahedron(half)), towards, colours, power)


def _unit(directions: NDArray[np.float64]) -> NDArray[np.float64]:
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def _summed(
    places: NDArray[np.float64], towards: NDArray[np.float64], colours: NDArray[np.float64], power: float
) -> NDArray[np.float32]:
    texels = np.zeros((len(places), 4), np.float32)
    for first in range(0, len(places), _AT_ONCE):
        facing = np.maximum(places[first : first + _AT_ONCE] @ towards.T, 0)
        texels[first : first + _AT_ONCE, :3] = (facing if power == 1 else facing**power) @ colours
    return texels


def diffuse_errors(towards: NDArray[np.float64], colours: NDArray[np.float64]) -> NDArray[np.float64]:
    """For each of HALVES what a diffuse map of this size errs by at most, in any channel."""
    height = np.abs(_angles_to(towards) - np.pi / 2)
    return np.array([
        np.sqrt(6) / 4 / half * ((height <= np.sqrt(6) / half + _NEAR) @ colours).max() for half in HALVES
    ])  # fmt: skip


def mirrored_errors(
    towards: NDArray[np.float64], colours: NDArray[np.float64], power: float
) -> NDArray[np.float64]:
    """For each of HALVES what a map of mirrored light of this size errs by at most, in any channel."""
    if not colours.any():
        return np.zeros(len(HALVES))
    angles = np.linspace(0, np.pi / 2, _ANGLES)
    bend = _bend(np.cos(angles), power)
    most_beyond = np.append(np.maximum.accumulate(bend[::-1])[::-1], 0.0)
    nearest = np.maximum(_angles_to(towards) - _NEAR, 0)
    at = np.minimum((nearest / angles[1]).astype(int), _ANGLES)
    return (most_beyond[at] @ colours).max() / np.array(HALVES, float) ** 2


# From any direction to the nearest texel of the coarse map: ρ on the octahedron, up to √3 times in angle.
_NEAR = np.sqrt(2) / _COARSE


def _angles_to(towards: NDArray[np.float64]) -> NDArray[np.float64]:
    """(texels, lights) of the coarse map."""
    return np.arccos(np.clip(_unit(octahedron(_COARSE)) @ towards.T, -1, 1))


def _bend(c: NDArray[np.float64], power: float) -> NDArray[np.float64]:
    """m(c): of c^power along a great circle, at most, the second derivative and the first one's size."""
    sine = np.sqrt(1 - c**2)
    second = np.maximum(c**power, c ** (power - 2) * ((power - 1) * sine**2 - c**2))
    return power * (second + c ** (power - 1) * sine)
