"""Two-dimensional transfer functions: value and gradient magnitude to colour and opacity."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Vector, number, shown, vector
from ..errors import TransferFunctionError
from .function_files import read_function, write_function
from .transfer import MAX_OPACITY

Three: TypeAlias = tuple[float, float, float]

_FARTHEST = 1e300  # differences of values must be finite, too


@dataclass(frozen=True)
class Box:
    """What has a value and a gradient magnitude between two each, the ends included.

    Parameters
    ----------
    values, magnitudes
        (low, high), low < high; magnitudes ≥ 0, in value units per world unit.
    colour
        Linear r, g, b, each 0 … 1.
    opacity
        In the middle, 0 … 1 per the function's `opacity_unit`.
    soft
        Part, 0 … 1, of the half-size over which the opacity falls linearly to 0 at an edge: along values and
        along magnitudes, both factors multiplied. 0: none. An edge at magnitude 0 is never soft: there is
        nothing below.

    Raises
    ------
    TransferFunctionError
        A number that is NaN or out of range, or low ≥ high.
    """

    values: tuple[float, float]
    magnitudes: tuple[float, float]
    colour: Three
    opacity: float
    soft: float = 0.5

    name: ClassVar[str] = "box"

    def __post_init__(self):
        object.__setattr__(self, "values", _interval(self.values, "a box's values"))
        _check_common(self)

    def opacities(self, values: ArrayLike, magnitudes: ArrayLike) -> NDArray[np.float64]:
        """Opacity per unit at `values` and `magnitudes`, which broadcast."""
        along, up = np.asarray(values, np.float64), np.asarray(magnitudes, np.float64)
        (left, right), (low, high) = self.values, self.magnitudes
        sides = np.minimum(along - left, right - along) / (0.5 * (right - left))
        below = (up - low) if low > 0 else np.where(up >= low, np.inf, -1)
        ends = np.minimum(below, high - up) / (0.5 * (high - low))
        return self.opacity * _fall(sides, self.soft) * _fall(ends, self.soft)


@dataclass(frozen=True)
class Triangle:
    """A boundary between materials: at the apex no width of values, at the upper end ± `width`.

    Parameters
    ----------
    value
        Of the apex, and of the middle of the upper edge.
    magnitudes
        (low, high): of the apex and of the upper edge, 0 ≤ low < high, in value units per world unit. The
        apex itself is outside.
    width
        Half the width of the upper edge, in values, > 0.
    colour
        Linear r, g, b, each 0 … 1.
    opacity
        Along the middle, 0 … 1 per the function's `opacity_unit`.
    soft
        Part, 0 … 1, of the half-size over which the opacity falls linearly to 0 at an edge: of half the width
        at that magnitude towards the sides, of half the height towards the upper edge, both factors
        multiplied. 0: none.

    Raises
    ------
    TransferFunctionError
        A number that is NaN or out of range, or low ≥ high.

    Source: Kindlmann and Durkin 1998; Kniss, Kindlmann and Hansen 2001, whose widget it is.
    """

    value: float
    magnitudes: tuple[float, float]
    width: float
    colour: Three
    opacity: float
    soft: float = 0.5

    name: ClassVar[str] = "triangle"

    def __post_init__(self):
        error = TransferFunctionError
        value = number(self.value, "a triangle's value", error, -_FARTHEST, _FARTHEST)
        object.__setattr__(self, "value", value)
        object.__setattr__(self, "width", number(self.width, "a triangle's width", error, 1e-300, _FARTHEST))
        _check_common(self)

    @property
    def values(self) -> tuple[float, float]:
        """(low, high): no value beyond them is in the triangle."""
        return self.value - self.width, self.value + self.width

    def opacities(self, values: ArrayLike, magnitudes: ArrayLike) -> NDArray[np.float64]:
        """Opacity per unit at `values` and `magnitudes`, which broadcast."""
        along, up = np.asarray(values, np.float64), np.asarray(magnitudes, np.float64)
        low, high = self.magnitudes
        half = self.width * (up - low) / (high - low)
        inside = half > 0
        sides = np.where(inside, 1 - np.abs(along - self.value) / np.where(inside, half, 1), -1)
        ends = (high - up) / (0.5 * (high - low))
        return self.opacity * _fall(sides, self.soft) * _fall(ends, self.soft)


Shape: TypeAlias = Box | Triangle
_KINDS = {kind.name: kind for kind in (Box, Triangle)}


@dataclass(frozen=True, eq=False, init=False)
class TransferFunction2D:
    """Shapes on the plane of values and gradient magnitudes; nothing is seen outside of them.

    Where shapes overlap, their extinctions add, and their colours mix in proportion to them.

    Parameters
    ----------
    shapes
        `Box` and `Triangle`, at least one; their order does not matter.
    opacity_unit
        World length over which the opacities hold; None means the volume's smallest spacing, filled in by
        `with_unit` when a volume is known.

    Raises
    ------
    TransferFunctionError
        No shapes, something that is none, or a unit that is no length.
    """

    shapes: tuple[Shape, ...]
    opacity_unit: float | None

    def __init__(self, shapes: Iterable[Shape], opacity_unit: float | None = None):
        if not isinstance(shapes, Iterable):
            raise TransferFunctionError(f"shapes are a sequence of Box and Triangle; given {shown(shapes)}")
        shapes = tuple(shapes)
        for n, shape in enumerate(shapes):
            if not isinstance(shape, Box | Triangle):
                raise TransferFunctionError(f"shape {n} is neither a Box nor a Triangle: {shown(shape)}")
        if not shapes:
            raise TransferFunctionError("a 2D transfer function needs at least one shape")
        if opacity_unit is not None:
            opacity_unit = number(opacity_unit, "opacity_unit", TransferFunctionError, 1e-30, 1e30)
        object.__setattr__(self, "shapes", shapes)
        object.__setattr__(self, "opacity_unit", opacity_unit)

    def with_unit(self, opacity_unit: float) -> TransferFunction2D:
        """Itself if it has a unit of its own, else the same shapes per `opacity_unit`."""
        return self if self.opacity_unit else TransferFunction2D(self.shapes, opacity_unit)

    def colour(self, values: ArrayLike, magnitudes: ArrayLike) -> NDArray[np.float64]:
        """(..., 3) linear colour, not premultiplied, at `values`, `magnitudes`; black outside all shapes."""
        depths = self._depths(values, magnitudes)
        total = sum(depths)[..., None]
        mixed = sum(d[..., None] * s.colour for d, s in zip(depths, self.shapes, strict=True))
        return np.divide(mixed, total, out=np.zeros_like(mixed), where=total > 0)

    def opacity(self, values: ArrayLike, magnitudes: ArrayLike) -> NDArray[np.float64]:
        """Opacity per `opacity_unit` at `values` and `magnitudes`, 0 … 1; of one shape at most 1 − 1e-6."""
        return -np.expm1(-sum(self._depths(values, magnitudes)))

    def extinction(self, values: ArrayLike, magnitudes: ArrayLike) -> NDArray[np.float64]:
        """Σ −ln(1 − opacity) / opacity_unit over the shapes, per world unit; needs a unit."""
        if self.opacity_unit is None:
            raise TransferFunctionError(
                "this transfer function has no opacity_unit yet; call with_unit(length)"
            )
        return sum(self._depths(values, magnitudes)) / self.opacity_unit

    def _depths(self, values: ArrayLike, magnitudes: ArrayLike) -> list[NDArray[np.float64]]:
        """Of each shape, the extinction per opacity unit."""
        opacities = (shape.opacities(values, magnitudes) for shape in self.shapes)
        return [-np.log1p(-np.minimum(opacity, MAX_OPACITY)) for opacity in opacities]

    def to_dict(self) -> dict:
        """JSON-ready: `tf2d`, a list of shapes, and `opacity_unit`; the scene file's keys."""
        rows = [{"shape": shape.name, **_listed(asdict(shape))} for shape in self.shapes]
        return {"tf2d": rows, "opacity_unit": self.opacity_unit}

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> TransferFunction2D:
        """From what `to_dict` gives: `tf2d`, and `opacity_unit` or none."""
        return cls.from_rows(content["tf2d"], content.get("opacity_unit"))

    @classmethod
    def from_rows(
        cls, rows: Iterable[Mapping[str, Any]], opacity_unit: float | None = None
    ) -> TransferFunction2D:
        """From {"shape": "box" or "triangle", …the shape's parameters}, as in scene files."""
        if not isinstance(rows, Iterable) or isinstance(rows, str | Mapping):
            raise TransferFunctionError(f"tf2d is a list of shapes; given {shown(rows)}")
        return cls([shape_of(row) for row in rows], opacity_unit)

    def save(self, path: str | Path) -> None:
        """Write as JSON."""
        write_function(path, self.to_dict())

    @classmethod
    def load(cls, path: str | Path) -> TransferFunction2D:
        """Read what `save` wrote; TransferFunctionError where it is not that."""
        return read_function(path, cls.from_dict, "2D transfer function", 'tf2d = [{"shape": …}, …]')


def _fall(depth: NDArray[np.float64], soft: float) -> NDArray[np.float64]:
    """1 inside, 0 outside (`depth` < 0), and between linear up to a depth of `soft`."""
    return np.where(depth < 0, 0.0, np.clip(depth / soft, 0, 1) if soft > 1e-300 else 1.0)


def _interval(value: Vector, name: str, low: float = -_FARTHEST) -> tuple[float, float]:
    first, last = vector(value, name, TransferFunctionError, 2, _FARTHEST).tolist()
    if not low <= first < last:
        least = f"{low:g} ≤ " if low > -_FARTHEST else ""
        raise TransferFunctionError(f"{name} are (low, high) with {least}low < high; given {shown(value)}")
    return first, last


def _check_common(shape: Shape) -> None:
    name, error, set_ = f"a {shape.name}'s", TransferFunctionError, object.__setattr__
    set_(shape, "magnitudes", _interval(shape.magnitudes, f"{name} magnitudes", 0.0))
    colour = vector(shape.colour, f"{name} colour", error)
    if (colour < 0).any() or (colour > 1).any():
        raise error(f"{name} colour has numbers 0 … 1; given {shown(shape.colour)}")
    set_(shape, "colour", tuple(colour.tolist()))
    set_(shape, "opacity", number(shape.opacity, f"{name} opacity", error, 0, 1))
    set_(shape, "soft", number(shape.soft, f"{name} soft", error, 0, 1))


def _listed(keys: dict[str, Any]) -> dict[str, Any]:
    return {key: list(value) if isinstance(value, tuple) else value for key, value in keys.items()}


def shape_of(row: Mapping[str, Any]) -> Shape:
    """A shape from {"shape": "box" or "triangle", …}; TransferFunctionError where it is none."""
    kind = row.get("shape") if isinstance(row, Mapping) else None
    if not isinstance(kind, str) or kind not in _KINDS:
        raise TransferFunctionError(f'a shape is {{"shape": "box" or "triangle", …}}; given {shown(row)}')
    keys = [field.name for field in fields(_KINDS[kind])]
    given = {key: value for key, value in row.items() if key != "shape"}
    for key in given:
        if key not in keys:
            near = difflib.get_close_matches(str(key).lower(), keys, 1, 0.5)
            advice = f"did you mean {near[0]}?" if near else f"its keys are {', '.join(keys)}"
            raise TransferFunctionError(f"a {kind} has no {key}; {advice}")
    missing = [key for key in keys if key not in given and key != "soft"]
    if missing:
        raise TransferFunctionError(f"a {kind} needs {', '.join(missing)}; given {shown(row)}")
    return _KINDS[kind](**given)
