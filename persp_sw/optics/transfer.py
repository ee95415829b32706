"""One-dimensional transfer functions: value to colour and opacity per unit of length."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import number
from ..errors import TransferFunctionError
from .function_files import read_function, write_function

# An opacity of 1 would be an infinite extinction. 1 − 1e-6 per unit lets 1e-6 of the light through.
MAX_OPACITY = 1 - 1e-6


@dataclass(frozen=True, eq=False, init=False)
class TransferFunction:
    """Control points, linear between, constant beyond the first and the last.

    Parameters
    ----------
    points
        (value, (r, g, b), opacity) each: value in the volume's own units, ascending; two points at one value
        are a step (the second holds at the value itself and above); colours linear, not premultiplied, 0 … 1;
        opacity 0 … 1 per `opacity_unit` of length.
    opacity_unit
        World length over which the opacities hold; None means the volume's smallest spacing, filled in by
        `with_unit` when a volume is known.

    Raises
    ------
    TransferFunctionError
        No points, values unsorted, three points at one value, or a number that is NaN or out of range.
    """

    values: NDArray[np.float64]
    colours: NDArray[np.float64]
    opacities: NDArray[np.float64]
    opacity_unit: float | None

    def __init__(
        self,
        points: Iterable[tuple[float, tuple[float, float, float], float]],
        opacity_unit: float | None = None,
    ):
        try:
            rows = np.array([[v, *rgb, a] for v, rgb, a in points], np.float64)
        except (TypeError, ValueError, OverflowError):
            raise TransferFunctionError("control points are (value, (r, g, b), opacity)") from None
        _check_points(rows)
        if opacity_unit is not None:
            opacity_unit = number(opacity_unit, "opacity_unit", TransferFunctionError, 1e-30, 1e30)
        set_ = object.__setattr__
        set_(self, "values", rows[:, 0])
        set_(self, "colours", rows[:, 1:4])
        set_(self, "opacities", rows[:, 4])
        set_(self, "opacity_unit", opacity_unit)

    @property
    def points(self) -> list[tuple[float, tuple[float, float, float], float]]:
        """The control points, as given to the constructor."""
        rows = zip(self.values.tolist(), self.colours.tolist(), self.opacities.tolist(), strict=True)
        return [(v, tuple(c), a) for v, c, a in rows]

    def with_unit(self, opacity_unit: float) -> TransferFunction:
        """Itself if it has a unit of its own, else the same points per `opacity_unit`."""
        return self if self.opacity_unit else TransferFunction(self.points, opacity_unit)

    def colour(self, values: ArrayLike) -> NDArray[np.float64]:
        """(..., 3) linear colour, not premultiplied, at `values`."""
        below, weight = self._bracket(values)
        above = np.minimum(below + 1, len(self.values) - 1)
        weight = weight[..., None]
        return self.colours[below] * (1 - weight) + self.colours[above] * weight

    def opacity(self, values: ArrayLike) -> NDArray[np.float64]:
        """Opacity per `opacity_unit` at `values`, 0 … 1 − 1e-6."""
        below, weight = self._bracket(values)
        above = np.minimum(below + 1, len(self.values) - 1)
        return np.minimum(self.opacities[below] * (1 - weight) + self.opacities[above] * weight, MAX_OPACITY)

    def extinction(self, values: ArrayLike) -> NDArray[np.float64]:
        """τ = −ln(1 − opacity) / opacity_unit at `values`, per world unit; needs a unit."""
        if self.opacity_unit is None:
            raise TransferFunctionError(
                "this transfer function has no opacity_unit yet; call with_unit(length)"
            )
        return -np.log1p(-self.opacity(values)) / self.opacity_unit

    def _bracket(self, values: ArrayLike) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Index of the last point at or below each value, and the weight of the next point, 0 … 1."""
        values = np.asarray(values, np.float64)
        below = np.clip(np.searchsorted(self.values, values, side="right") - 1, 0, None)
        values = np.clip(values, self.values[0], self.values[-1])
        above = np.minimum(below + 1, len(self.values) - 1)
        width = self.values[above] - self.values[below]
        return below, np.divide(
            values - self.values[below], width, out=np.zeros_like(values), where=width > 0
        )

    def to_dict(self) -> dict:
        """JSON-ready: `tf` as rows [value, r, g, b, a], and `opacity_unit`; the scene file's keys."""
        rows = np.column_stack([self.values, self.colours, self.opacities]).tolist()
        return {"tf": rows, "opacity_unit": self.opacity_unit}

    @classmethod
    def from_rows(
        cls, rows: Iterable[Iterable[float]], opacity_unit: float | None = None
    ) -> TransferFunction:
        """From [value, r, g, b, a] rows, as in scene files."""
        try:
            points = [(v, (r, g, b), a) for v, r, g, b, a in rows]
        except (TypeError, ValueError):
            raise TransferFunctionError("each row of tf is five numbers [value, r, g, b, a]") from None
        return cls(points, opacity_unit)

    def save(self, path: str | Path) -> None:
        """Write as JSON."""
        write_function(path, self.to_dict())

    @classmethod
    def load(cls, path: str | Path) -> TransferFunction:
        """Read what `save` wrote; TransferFunctionError where it is not that."""

        def of_content(content: dict[str, Any]) -> TransferFunction:
            return cls.from_rows(content["tf"], content.get("opacity_unit"))

        return read_function(path, of_content, "transfer function", "tf = [[value, r, g, b, a], …]")


def _check_points(rows: NDArray[np.float64]) -> None:
    if rows.size == 0:
        raise TransferFunctionError("a transfer function needs at least one control point")
    bad = ~np.isfinite(rows).all(1) | (np.abs(rows[:, 0]) > 1e300)  # differences must be finite too
    if bad.any():
        first = int(np.argmax(bad))
        raise TransferFunctionError(
            f"control point {first} has a NaN or infinite or too large number: {rows[first].tolist()}"
        )
    steps = np.diff(rows[:, 0])
    if (steps < 0).any():
        bad = int(np.argmax(steps < 0)) + 1
        raise TransferFunctionError(
            f"control points must be sorted by value: point {bad} at {rows[bad, 0]:g} "
            f"follows {rows[bad - 1, 0]:g}"
        )
    if ((steps[1:] == 0) & (steps[:-1] == 0)).any():
        raise TransferFunctionError(
            "three control points share one value; two make a step, more mean nothing"
        )
    outside = (rows[:, 1:] < 0) | (rows[:, 1:] > 1)
    if outside.any():
        bad = int(np.argmax(outside.any(1)))
        raise TransferFunctionError(
            f"colours and opacities lie between 0 and 1; point {bad} is {rows[bad].tolist()}"
        )
