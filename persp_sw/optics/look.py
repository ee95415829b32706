"""How what a transfer function shows looks: lit or plain, and what its gradient does to it."""

from __future__ import annotations

from dataclasses import dataclass

from ..arrays import number
from ..errors import LookError
from .lighting import Lighting


@dataclass(frozen=True)
class Modulation:
    """Makes more of boundaries than of what they enclose, by the gradient's magnitude.

    A magnitude m, as a part of the largest possible one (`volume.gradient.largest_magnitude`), has the weight
    w = clip((m − low) / (high − low), 0, 1). Extinction is multiplied by 1 − opacity + opacity·w, colour,
    before it is lit, by 1 − colour + colour·w. Of a volume of one value, m is 0.

    Parameters
    ----------
    low, high
        Parts of the largest possible magnitude, 0 ≤ low < high ≤ 1.
    opacity, colour
        0 … 1: not at all … wholly.

    Source: Yuan et al. 2011, whose bound it is: unlike the data's largest magnitude it needs no pass over
    them, and does not change with a crop.
    """

    low: float = 0.0
    high: float = 0.25
    opacity: float = 1.0
    colour: float = 0.0

    def __post_init__(self):
        for name in ("low", "high", "opacity", "colour"):
            value = number(getattr(self, name), f"modulation's {name}", LookError, 0, 1)
            object.__setattr__(self, name, value)
        if not self.low < self.high:
            raise LookError(f"modulation's low is below its high; given {self.low:g} and {self.high:g}")


@dataclass(frozen=True)
class Look:
    """All that changes the look of a transfer function.

    Parameters
    ----------
    lighting
        None: colours as the transfer function has them.
    modulation
        None: as the transfer function has it.
    gradient_distance
        Voxels along each axis to the two neighbours whose difference is the gradient, 0.5 … 4. More is
        smoother and finds less detail.

    Raises
    ------
    LookError
        A number out of range.
    """

    lighting: Lighting | None = None
    modulation: Modulation | None = None
    gradient_distance: float = 1.0

    def __post_init__(self):
        distance = number(self.gradient_distance, "gradient_distance", LookError, 0.5, 4)
        object.__setattr__(self, "gradient_distance", distance)
        if not isinstance(self.lighting, Lighting | None):
            raise LookError(f"lighting is a Lighting or None; given {self.lighting!r}")
        if not isinstance(self.modulation, Modulation | None):
            raise LookError(f"modulation is a Modulation or None; given {self.modulation!r}")

    @property
    def is_plain(self) -> bool:
        """Whether nothing asks for gradients."""
        return self.lighting is None and self.modulation is None
