"""All cases of the atlas, in the order of its page."""

from __future__ import annotations

from . import eye_positions, shapes, values
from .case import Case

CASES: tuple[Case, ...] = (
    eye_positions.CASE,
    shapes.CASE,
    values.CASE,
)
