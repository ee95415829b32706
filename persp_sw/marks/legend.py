"""A transfer function as a picture: its colours over the values, its opacity as a curve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..optics.transfer import TransferFunction
from .lettering import lettered
from .numbers import short, ticks
from .shapes import Colour, Palette

_BACK = 0.55  # opacity of the panel
_CURVE = 3.2  # width of the curve's part, in letters; the colours' is a third of it
_EVERY = 3.0  # letters between two numbers, at least


@dataclass(frozen=True, eq=False)
class Legend:
    """A legend as a picture.

    Attributes
    ----------
    picture
        (h, w, 4) float32, linear, premultiplied.
    rows
        First row of the colours, and the one after the last.
    columns
        The same across.
    values
        (rows,) of each row's middle, from the highest down.
    """

    picture: NDArray[np.float32]
    rows: tuple[int, int]
    columns: tuple[int, int]
    values: NDArray[np.float64]


def legend(
    transfer: TransferFunction,
    value_range: tuple[float, float],
    height: int,
    letter: int = 12,
    palette: Palette | None = None,
) -> Legend:
    """The legend of a transfer function.

    Parameters
    ----------
    value_range
        Of the volume. Shown is what of it the function's points span, and a tenth of that on either side.
    height
        Of the colours, pixels, ≥ 16.
    letter
        Height of the numbers, pixels.
    palette
        Dark letters are on a light panel, light ones on a dark one. None: over a black background.

    Returns
    -------
    Opacity as a curve, 0 on the right, the highest of the function on the left; colours, as `transfer.colour`
    has them; numbers at round values, and longer lines at the first and the last of the function's points:
    of a window these are its borders.
    """
    palette = palette or Palette.over()
    low, high = _shown_range(transfer, value_range)
    step = (high - low) / height
    values = high - (np.arange(height) + 0.5) * step
    numbers = ticks(low, high, max(int(height / (_EVERY * letter)), 2))
    texts = {value: lettered(short(value), letter) for value in numbers}
    margin, curve = max(letter // 2, 3), round(_CURVE * letter)
    bar = round(curve / 3)
    words = max((text.shape[1] for text in texts.values()), default=0)
    left = margin + curve
    line_end = left + bar + margin
    size = height + 2 * (margin + letter // 2), line_end + words
    size = tuple(n + n % 2 for n in size)  # it can be halved
    back = np.array([*palette.halo, 1.0]) * _BACK
    picture = np.empty((*size, 4))
    picture[:] = back
    top = margin + letter // 2
    rows = slice(top, top + height)
    _draw_curve(picture[rows, margin:left], transfer, values, palette.ink)
    frame = picture[top - 1 : top + height + 1, left - 1 : left + bar + 1]
    frame[:] = frame / 2 + np.array([*palette.ink, 1.0]) / 2
    picture[rows, left : left + bar, :3] = transfer.colour(values)[:, None]
    picture[rows, left : left + bar, 3] = 1

    def row_of(value: float) -> int:
        return top + int(np.clip((high - value) / step, 0, height - 1))

    ink = np.array([*palette.ink, 1.0])
    for value, text in texts.items():
        picture[row_of(value), left + bar : left + bar + margin // 2 + 1] = ink
        first = int(np.clip(row_of(value) - text.shape[0] // 2, 0, size[0] - text.shape[0]))
        part = picture[first : first + text.shape[0], line_end - margin // 2 :][:, : text.shape[1]]
        text = text[:, : part.shape[1], None]
        part *= 1 - text
        part += text * ink
    for border in (transfer.values[0], transfer.values[-1]):
        if low < border < high:
            picture[row_of(border), left - margin // 2 : left] = ink
            picture[row_of(border), left + bar : line_end] = ink
    return Legend(picture.astype(np.float32), (top, top + height), (left, left + bar), values)


def _shown_range(transfer: TransferFunction, value_range: tuple[float, float]) -> tuple[float, float]:
    first, last = float(transfer.values[0]), float(transfer.values[-1])
    beside = (last - first) / 10
    low, high = max(first - beside, value_range[0]), min(last + beside, value_range[1])
    if not high > low:  # all of the volume's values, or one, are beyond the function's points
        low, high = value_range
    if not high > low:
        low, high = low - 0.5, low + 0.5
    return low, high


def _draw_curve(part: NDArray[np.float64], transfer: TransferFunction, values: NDArray, ink: Colour) -> None:
    """Opacity as an area from the right; its square root, for what is seen of a volume is mostly faint."""
    most = max(float(transfer.opacities.max()), 1e-9)
    width = part.shape[1]
    reach = np.sqrt(transfer.opacity(values) / most) * (width - 1)
    from_right = width - 0.5 - np.arange(width)
    area = np.clip(reach[:, None] + 0.5 - from_right, 0, 1)
    edge = area * np.clip(from_right - reach[:, None] + 2.0, 0, 1)
    cover = (0.35 * area + 0.65 * edge)[..., None] * (reach > 0)[:, None, None]
    part *= 1 - cover
    part += cover * np.array([*ink, 1.0])
