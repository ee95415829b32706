"""Colours as people pick them: encoded for a screen (sRGB), 0 … 1, and back to linear light."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import persp_sw as psw

Three = tuple[float, float, float]


def encoded(colour: Sequence[float]) -> Three:
    """Of a linear colour; what is brighter than a screen is white."""
    red, green, blue = np.asarray(psw.images.srgb(colour), np.float64).tolist()
    return red, green, blue


def decoded(colour: Sequence[float]) -> Three:
    """Of an encoded colour, linear, 0 … 1."""
    code = np.clip(np.asarray(colour, np.float64), 0, 1)
    linear = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)
    red, green, blue = np.clip(linear, 0, 1).tolist()
    return red, green, blue
