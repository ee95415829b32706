"""Window and level, as radiologists set them: which values a grey ramp shows."""

from __future__ import annotations

from ..arrays import number
from ..errors import TransferFunctionError
from .transfer import TransferFunction

# (level, width) in Hounsfield units, as radiology's textbooks give them.
CT_WINDOWS = {
    "abdomen": (40.0, 400.0),
    "angio": (300.0, 600.0),
    "bone": (400.0, 1800.0),
    "brain": (40.0, 80.0),
    "lung": (-600.0, 1500.0),
}
_MOST = 1e30


def window_level(
    level: float, width: float, *, opacity: float = 0.2, opacity_unit: float | None = None
) -> TransferFunction:
    """Black and transparent up to level − width/2, from there in proportion to white at level + width/2.

    Parameters
    ----------
    level, width
        Of the values, in the volume's own units; width > 0.
    opacity
        Of white, 0 … 1 per `opacity_unit`; below it falls with the brightness.
    opacity_unit
        World length; None: the volume's smallest spacing.

    Returns
    -------
    Two control points; grey is linear in light.

    Raises
    ------
    TransferFunctionError
        Numbers out of range.
    """
    level = number(level, "a window's level", TransferFunctionError, -_MOST, _MOST)
    width = number(width, "a window's width", TransferFunctionError, 1e-30, _MOST)
    low, high = level - width / 2, level + width / 2
    return TransferFunction([(low, (0, 0, 0), 0), (high, (1, 1, 1), opacity)], opacity_unit)


def window_of(transfer: TransferFunction) -> tuple[float, float]:
    """The level and width of the values between a transfer function's first and last point."""
    low, high = float(transfer.values[0]), float(transfer.values[-1])
    return (low + high) / 2, high - low
