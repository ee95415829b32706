"""All cases of the atlas, in the order of its page."""

from __future__ import annotations

from . import (
    axis_switch,
    clipping,
    eye_positions,
    far_slices,
    long_runs,
    obliquity,
    opacity_extremes,
    shapes,
    sharp_classification,
    stereo,
    values,
    zoom,
)
from .case import Case

CASES: tuple[Case, ...] = (
    axis_switch.CASE,
    obliquity.CASE,
    far_slices.CASE,
    zoom.CASE,
    eye_positions.CASE,
    sharp_classification.CASE,
    opacity_extremes.CASE,
    shapes.CASE,
    values.CASE,
    clipping.CASE,
    stereo.CASE,
    long_runs.CASE,
)
