"""Transfer functions for a first look, made from a volume's values.

A preset places its control points relative to what the histogram tells: where the background ends, where the
material lies. Opacities hold per smallest voxel spacing of a volume about 200 voxels across; they are
corrected for larger and smaller ones, so that a preset looks alike on both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from ..errors import TransferFunctionError
from ..volume.grid import Volume
from .histogram import Histogram
from .transfer import TransferFunction

Point = tuple[float, str, float]  # value, sRGB colour as rrggbb, opacity per voxel

_VOXELS_ACROSS = 200.0
_LEAST = 1e-60  # distance of points where values have no size: far below float32's smallest number


@dataclass(frozen=True)
class Preset:
    """A named transfer function for one volume.

    Attributes
    ----------
    name
        One of `NAMES`.
    why
        What in the volume led to it, for people; "" where it was asked for by name.
    transfer
        The transfer function; its opacity unit is left open, which means the volume's smallest spacing.
    """

    name: str
    why: str
    transfer: TransferFunction


def _ct_bone(h: Histogram) -> Iterable[Point]:
    """Bones and metal, a hint of the vessels and the skin around."""
    if h.hounsfield:
        levels = (60, 140, 220, 400, 700, 1400)
    else:
        levels = [h.level(part) for part in (0.5, 0.86, 0.93, 0.975, 0.992, 0.999)]
    colours = ("5a1e12", "9c3f22", "d98a54", "f3d9b0", "fff6e4", "ffffff")
    return zip(levels, colours, (0.0, 0.008, 0.05, 0.16, 0.4, 0.6), strict=True)


def _ct_soft(h: Histogram) -> Iterable[Point]:
    """Skin and organs as a thin glow, bones bright inside."""
    if h.hounsfield:
        levels = (-600, -350, -120, 40, 160, 350, 900)
    else:
        levels = [h.level(part) for part in (0.0, 0.2, 0.5, 0.8, 0.93, 0.975, 0.995)]
    colours = ("3a1a10", "8a4a2c", "c98050", "c0503c", "e8b48a", "fff0d8", "ffffff")
    return zip(levels, colours, (0.0, 0.008, 0.004, 0.012, 0.06, 0.25, 0.5), strict=True)


def _mri(h: Histogram) -> Iterable[Point]:
    """Soft tissue: dark rims, warm inside, the brightest nearly white."""
    levels = [h.between(0.3), h.between(0.65), h.main, h.level(0.8), h.level(0.97), h.high]
    colours = ("180604", "5c1c14", "b4583c", "e8b48c", "fff0dc", "ffffff")
    return zip(levels, colours, (0.0, 0.03, 0.08, 0.16, 0.3, 0.4), strict=True)


def _layers(h: Histogram) -> Iterable[Point]:
    """Parts of different density: the light one as tinted glass, the dense ones solid within."""
    split = h.split
    return [
        (h.threshold, "0e1c2c", 0.0),
        (h.between(0.6), "2c5a80", 0.012),
        (min(h.main, 0.98 * split + 0.02 * h.threshold), "7cb4d8", 0.022),
        (split, "b87838", 0.05),
        (0.5 * (split + h.high), "ffc070", 0.35),
        (h.high, "fff4dc", 0.6),
    ]


def _simulation(h: Histogram) -> Iterable[Point]:
    """A smooth field: nested glowing shells from blue through red to white."""
    start = min(h.threshold, h.span(0.06))
    levels = [start, *(h.span(part) for part in (0.12, 0.25, 0.4, 0.6, 0.8, 1.0))]
    colours = ("141c60", "2848b8", "1fa0c8", "50c878", "f0c840", "f06428", "fff4e0")
    return zip(levels, colours, (0.0, 0.006, 0.012, 0.03, 0.08, 0.2, 0.5), strict=True)


def _microscopy(h: Histogram) -> Iterable[Point]:
    """Fluorescence: the noise floor cut off, the signal glowing from deep green to white."""
    levels = [h.level(part) for part in (0.1, 0.4, 0.7, 0.9, 0.99)]
    colours = ("04281c", "0a7850", "28d078", "b0f8b0", "ffffff")
    return zip(levels, colours, (0.0, 0.012, 0.04, 0.1, 0.25), strict=True)


def _fog(h: Histogram) -> Iterable[Point]:
    """All of it, thinly, as in an X-ray picture."""
    levels = [h.threshold, h.level(0.2), h.level(0.6), h.level(0.9), h.level(0.995)]
    colours = ("2c3c58", "5878a0", "90b4d0", "d8e8f0", "ffffff")
    return zip(levels, colours, (0.0, 0.002, 0.005, 0.012, 0.04), strict=True)


def _surface(h: Histogram) -> Iterable[Point]:
    """The outer surface, opaque."""
    middle = 0.5 * (h.threshold + h.level(0.3))
    step = max(0.12 * (middle - h.background), 1e-6 * max(abs(middle), _LEAST))
    return [
        (middle - step, "5c3420", 0.0),
        (middle + step, "e0a878", 0.7),
        (max(h.level(0.9), middle + 2 * step), "fff0d8", 0.9),
    ]


_MAKERS: dict[str, Callable[[Histogram], Iterable[Point]]] = {
    "ct_bone": _ct_bone,
    "ct_soft": _ct_soft,
    "mri": _mri,
    "layers": _layers,
    "simulation": _simulation,
    "microscopy": _microscopy,
    "fog": _fog,
    "surface": _surface,
}
NAMES: tuple[str, ...] = tuple(_MAKERS)


def describe(name: str) -> str:
    """One line on what the preset `name` shows."""
    return (_MAKERS[name].__doc__ or "").strip()


def make(name: str, volume: Volume, *, why: str = "", histogram: Histogram | None = None) -> Preset:
    """The preset `name` for `volume`.

    Parameters
    ----------
    histogram
        The volume's, where it is known already.

    Raises
    ------
    TransferFunctionError
        There is no preset of that name.
    """
    if name not in _MAKERS:
        raise TransferFunctionError(f"there is no preset {name!r}; choose one of {', '.join(NAMES)}")
    histogram = histogram or Histogram.of(volume)
    points = _MAKERS[name](histogram)
    apart = max(2e-3 * (histogram.high - histogram.background), 1e-6 * abs(histogram.high), _LEAST)
    return Preset(name, why, _transfer(points, _VOXELS_ACROSS / _voxels_across(volume), apart))


def choose(volume: Volume) -> Preset:
    """The preset that suits the volume's values best; its `why` says what decided.

    Hounsfield units are recognised first, by air; then a noise floor, falling tails, and the shape of the
    foremost peak. A guess, of course: `make` takes any other name.
    """
    h = Histogram.of(volume)
    name, why = _guess(h, volume.data.dtype.kind == "f")
    return make(name, volume, why=why, histogram=h)


def _guess(h: Histogram, real: bool) -> tuple[str, str]:
    if h.hounsfield:
        if h.dense_fraction > 0.004:
            return "ct_bone", "values look like Hounsfield units, with bone or metal among them"
        return "ct_soft", "values look like Hounsfield units, hardly any of them bone"
    if h.falling and h.noise_floor:
        return "microscopy", "a noise floor with a tail of brighter signal"
    if h.falling or real:
        return "simulation", "values fall off smoothly from the background"
    if h.peak_width < 0.35:
        return "layers", "a narrow peak of one material, and denser ones"
    return "mri", "one broad hump of tissue values above an empty background"


def _voxels_across(volume: Volume) -> float:
    """Typical edge of the volume in units of its smallest spacing, ≥ 8."""
    return max(float(np.median(volume.extent)) / min(volume.spacing), 8.0)


def srgb_points(points: Iterable[Point]) -> list[tuple[float, tuple[float, float, float], float]]:
    """Control points with colours as people write them (rrggbb, sRGB), for `TransferFunction`."""
    return [(value, _linear(colour), opacity) for value, colour, opacity in points]


def _transfer(points: Iterable[Point], thickness: float, apart: float) -> TransferFunction:
    """Points at least `apart` from each other, so none is a step; `thickness` multiplies every extinction."""
    rows: list[tuple[float, tuple[float, float, float], float]] = []
    for value, colour, opacity in srgb_points(points):
        value = max(float(value), rows[-1][0] + apart) if rows else float(value)
        rows.append((value, colour, float(1 - (1 - opacity) ** thickness)))
    return TransferFunction(rows)


def _linear(colour: str) -> tuple[float, float, float]:
    """rrggbb in sRGB as linear light."""
    encoded = np.array([int(colour[i : i + 2], 16) for i in (0, 2, 4)]) / 255
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    r, g, b = linear.tolist()
    return r, g, b
