"""Marks in pictures of a volume: box, axes, letters, scale bar, legend, cursor, ruler, each at its depth.

What they are is data (`MarkChoice`, `Marks`); `veil` tells how an eye sees them through the volume; `painted`
lays them over a finished picture.
"""

from .choice import MarkChoice, legend_for, with_marks
from .geometry import (
    axes,
    bounding_box,
    cursor,
    orientation_letters,
    position_text,
    ruler,
    scale_bar,
    unit_of,
)
from .legend import Legend, legend
from .lettering import lettered
from .numbers import length_text, round_length, short, ticks
from .paint import label_picture, lay_over, paint, painted
from .shapes import Label, Line, Marks, Palette, Sheet
from .veil import NEAREST, Veiled, VeiledLabel, VeiledLine, VeiledSheet, veil

__all__ = [
    "NEAREST",
    "Label",
    "Legend",
    "Line",
    "MarkChoice",
    "Marks",
    "Palette",
    "Sheet",
    "Veiled",
    "VeiledLabel",
    "VeiledLine",
    "VeiledSheet",
    "axes",
    "bounding_box",
    "cursor",
    "label_picture",
    "lay_over",
    "legend",
    "legend_for",
    "length_text",
    "lettered",
    "orientation_letters",
    "paint",
    "painted",
    "position_text",
    "round_length",
    "ruler",
    "scale_bar",
    "short",
    "ticks",
    "unit_of",
    "veil",
    "with_marks",
]
