"""Recorded costs for tests: what `benchmarks/record_costs.py` measured, and how traces on them are judged."""

from __future__ import annotations

import numpy as np
from samples import ROOT

from persp_sw.measure.replay import RecordedScene, Trace

SCENES = RecordedScene.load(ROOT / "benchmarks" / "recorded_costs.json")
LIMITS = 0.25, 2.0  # of quality, a controller's own


def settling(trace: Trace, target: float, start: int) -> int:
    """Frames from `start` after which the time without noise stays within 10 % of the target."""
    outside = np.flatnonzero(np.abs(trace.clean_ms[start:] / target - 1) > 0.1)
    return int(outside[-1]) + 1 if len(outside) else 0
