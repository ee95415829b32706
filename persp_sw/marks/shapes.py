"""What marks are made of: lines, sheets and words in the world, with colours but without pixels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Points

Colour = tuple[float, float, float]  # linear light, 0 … 1

LETTER = 15  # height of letters, pixels


@dataclass(frozen=True, eq=False)
class Line:
    """A straight line.

    Attributes
    ----------
    start, end
        World xyz.
    colour
        Linear, 0 … 1.
    width
        Pixels, the same near and far.
    opacity
        0 … 1.
    veiled
        Whether it is at its depth: what the volume shows in front of it dims it. Else it lies over all.
    """

    start: Points
    end: Points
    colour: Colour
    width: float = 1.5
    opacity: float = 1.0
    veiled: bool = True


@dataclass(frozen=True, eq=False)
class Sheet:
    """A flat translucent parallelogram: corner + u·edges[0] + v·edges[1] for u, v in 0 … 1; at its depth.

    Attributes
    ----------
    corner, edges
        World, (3,) and (2, 3).
    colour, opacity
        As of `Line`.
    """

    corner: Points
    edges: Points
    colour: Colour
    opacity: float


@dataclass(frozen=True, eq=False)
class Label:
    """A word, its middle at a point.

    Attributes
    ----------
    point
        World xyz.
    shift
        Pixels to the right and downwards that it stands off its point.
    halo
        Colour of a thin rim, which keeps it legible.
    letter
        Height, pixels.
    text, colour, veiled
        As of `Line`.
    """

    point: Points
    text: str
    colour: Colour
    halo: Colour = (0.0, 0.0, 0.0)
    shift: tuple[float, float] = (0.0, 0.0)
    letter: int = LETTER
    veiled: bool = True


@dataclass(frozen=True, eq=False)
class Marks:
    """Marks in the order in which they are painted: sheets, then lines, then words."""

    sheets: Sequence[Sheet] = ()
    lines: Sequence[Line] = ()
    labels: Sequence[Label] = ()

    def __add__(self, other: Marks) -> Marks:
        return Marks(
            [*self.sheets, *other.sheets], [*self.lines, *other.lines], [*self.labels, *other.labels]
        )


@dataclass(frozen=True)
class Palette:
    """Colours that are legible over a background: light ones over dark, dark ones over light.

    Attributes
    ----------
    ink, faint
        Of words and scales; of what should not catch the eye.
    halo
        Around words.
    axes
        Of x, y and z: red, green, blue.
    ruler
        Of measured distances.
    sheet
        Opacity of planes.
    """

    ink: Colour
    faint: Colour
    halo: Colour
    axes: tuple[Colour, Colour, Colour]
    ruler: Colour
    sheet: float

    @classmethod
    def over(cls, background: ArrayLike = (0.0, 0.0, 0.0)) -> Palette:
        """For a background, (3,) linear."""
        return _DARK if np.asarray(background, np.float64) @ (0.2126, 0.7152, 0.0722) > 0.2 else _LIGHT


def from_srgb(code: str) -> Colour:
    """Linear light of a colour as people write it, rrggbb."""
    value = np.array([int(code[i : i + 2], 16) for i in (0, 2, 4)]) / 255
    red, green, blue = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4).tolist()
    return red, green, blue


_LIGHT = Palette(
    from_srgb("f2f2ee"),
    from_srgb("c8b478"),
    (0.0, 0.0, 0.0),
    (from_srgb("ff5a50"), from_srgb("5fd45f"), from_srgb("6a9cff")),
    from_srgb("ffd23c"),
    0.07,
)
_DARK = Palette(
    from_srgb("141418"),
    from_srgb("6e5a28"),
    (1.0, 1.0, 1.0),
    (from_srgb("c8140a"), from_srgb("0a7814"), from_srgb("1440c8")),
    from_srgb("a04600"),
    0.12,
)
