"""Edits of one-dimensional transfer functions: each takes one and gives another, the first one stays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Vector, number, vector
from ..errors import TransferFunctionError
from .transfer import TransferFunction

Point = tuple[float, tuple[float, float, float], float]

_FARTHEST = 1e300  # values that `TransferFunction` takes


@dataclass(frozen=True)
class OpacityAxis:
    """Where opacities stand on an axis of 0 … 1.

    Parameters
    ----------
    knee
        Opacities far below it stand at distances in proportion, those far above at those of their
        logarithms: 0.001 gives what a thin fog needs as much room as what a wall does. None: a linear axis.

    position = arsinh(opacity / knee) / arsinh(1 / knee): from 0 to 1, with 0 itself, which a logarithm
    has not.
    """

    knee: float | None = None

    def __post_init__(self):
        if self.knee is not None:
            number(self.knee, "an opacity axis' knee", TransferFunctionError, 1e-9, 1e9)

    def position(self, opacity: np.ndarray | float) -> np.ndarray | float:
        """Of opacities 0 … 1."""
        if self.knee is None:
            return opacity
        return np.arcsinh(np.divide(opacity, self.knee)) / np.arcsinh(1 / self.knee)

    def opacity(self, position: float) -> float:
        """At a position, both 0 … 1; beyond the axis' ends that of the end."""
        position = min(max(float(position), 0.0), 1.0)
        if self.knee is None or position in (0.0, 1.0):
            return position
        return float(min(np.sinh(position * np.arcsinh(1 / self.knee)) * self.knee, 1.0))


LINEAR, LOGARITHMIC = OpacityAxis(), OpacityAxis(1e-3)


def step_partner(transfer: TransferFunction, index: int) -> int | None:
    """The other one of the two points that are a step; None where point `index` is none of a step's."""
    _check_index(transfer, index)
    for other in (index - 1, index + 1):
        if 0 <= other < len(transfer.values) and transfer.values[other] == transfer.values[index]:
            return other
    return None


def moved(
    transfer: TransferFunction,
    index: int,
    value: float,
    opacity: float | None = None,
    within: tuple[float, float] = (-_FARTHEST, _FARTHEST),
) -> TransferFunction:
    """Point `index` at another value, and at another opacity where one is given.

    It stays between its neighbours, never at their values, and `within` two values. The two points of a step
    stay one: both move to the value, each keeps its own opacity but for the one named.

    Raises
    ------
    TransferFunctionError
        No such point, or a number that is none or out of range.
    """
    partner = step_partner(transfer, index)
    together = sorted({index, index if partner is None else partner})
    value = number(value, "a control point's value", TransferFunctionError)
    low, high = max(within[0], -_FARTHEST), min(within[1], _FARTHEST)
    if together[0] > 0:
        low = max(low, float(np.nextafter(transfer.values[together[0] - 1], np.inf)))
    if together[-1] + 1 < len(transfer.values):
        high = min(high, float(np.nextafter(transfer.values[together[-1] + 1], -np.inf)))
    points: list[Point] = transfer.points
    if low <= high:
        for n in together:
            points[n] = (min(max(value, low), high), *points[n][1:])
    if opacity is not None:
        points[index] = (*points[index][:2], opacity)
    return TransferFunction(points, transfer.opacity_unit)


def added(transfer: TransferFunction, value: float) -> tuple[TransferFunction, int]:
    """One more point, on the curve, and its index; where there is one at that value already, that one's.

    Accuracy: the curve between the first and the last point changes by the rounding of float64. Beyond them
    it does not change either, but what tables of 12 bits span does (see `Classification`).
    """
    value = number(value, "a control point's value", TransferFunctionError, -_FARTHEST, _FARTHEST)
    there = np.flatnonzero(transfer.values == value)
    if there.size:
        return transfer, int(there[-1])
    index = int(np.searchsorted(transfer.values, value))
    colour = tuple(np.clip(transfer.colour(value), 0, 1).tolist())
    below, weight = transfer._bracket(value)
    above = min(int(below) + 1, len(transfer.values) - 1)  # an opacity of 1 stays one: `opacity` caps it
    opacity = transfer.opacities[below] * (1 - weight) + transfer.opacities[above] * weight
    points = transfer.points
    points.insert(index, (value, colour, float(np.clip(opacity, 0, 1))))
    return TransferFunction(points, transfer.opacity_unit), index


def deleted(transfer: TransferFunction, index: int) -> TransferFunction:
    """Without point `index`.

    Raises
    ------
    TransferFunctionError
        No such point, or it is the only one.
    """
    _check_index(transfer, index)
    points = transfer.points
    if len(points) == 1:
        raise TransferFunctionError("a transfer function needs a control point: the last one stays")
    del points[index]
    return TransferFunction(points, transfer.opacity_unit)


def coloured(transfer: TransferFunction, index: int, colour: Vector) -> TransferFunction:
    """Point `index` in another colour: linear r, g, b, each 0 … 1.

    Raises
    ------
    TransferFunctionError
        No such point, or no such colour.
    """
    _check_index(transfer, index)
    points = transfer.points
    rgb = tuple(vector(colour, "a control point's colour", TransferFunctionError).tolist())
    points[index] = (points[index][0], rgb, points[index][2])
    return TransferFunction(points, transfer.opacity_unit)


def with_opacity(transfer: TransferFunction, index: int, opacity: float) -> TransferFunction:
    """Point `index` at another opacity, 0 … 1 per opacity unit.

    Raises
    ------
    TransferFunctionError
        No such point, or no such opacity.
    """
    _check_index(transfer, index)
    return moved(transfer, index, float(transfer.values[index]), opacity)


def _check_index(transfer: TransferFunction, index: int) -> None:
    if not 0 <= index < len(transfer.values):
        raise TransferFunctionError(f"there are control points 0 … {len(transfer.values) - 1}; given {index}")
