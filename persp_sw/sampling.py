"""How rays are sampled: how often in a slice interval, and what a sample stands for."""

from __future__ import annotations

from math import log
from typing import NamedTuple

from .optics.classification import Classification
from .settings import Settings
from .volume.grid import Volume

# Optical depth of the longest slice interval beyond which one sample hides more than half of what follows.
# Below, of five volumes under ten functions each, one plain sample errs by 0.024 at most, above by up to
# 0.054, and one pre-integrated sample two to seven times less; `benchmarks/sampling_choice.py`.
OPAQUE_DEPTH = log(2) * (1 + 1e-5)  # a half itself is not more, however it is rounded


class Sampling(NamedTuple):
    """Samples in a slice interval of a ray that is not steep; whether each takes its piece's mean."""

    samples_per_interval: int
    preintegrated: bool


def choose_sampling(settings: Settings, classification: Classification, volume: Volume) -> Sampling:
    """What `settings` say, or, where they leave it open, what serves this transfer function best.

    Where one sample can hide more than half, what it misses shows: one pre-integrated sample then is as good
    as two to four others, at about the time of two (`docs/performance.md`). It is used where voxels have no
    value, too: its samples lie in the cells that are left out for them, plain ones on the slices between.
    Elsewhere one plain sample does. A two-dimensional function has no integrals: where one sample can hide
    more than half, it has two plain ones.
    """
    opaque = classification.largest_extinction * max(volume.spacing) > OPAQUE_DEPTH
    if classification.magnitudes > 1:
        return Sampling(settings.samples_per_interval or (2 if opaque else 1), False)
    preintegrated = settings.preintegrated
    if preintegrated is None:
        preintegrated = settings.samples_per_interval is None and (opaque or volume.nonfinite > 0)
    return Sampling(settings.samples_per_interval or 1, preintegrated)
