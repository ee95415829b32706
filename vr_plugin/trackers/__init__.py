"""Trackers: where heads and wands are, from the network, a recording, or keyboard and mouse."""

from .addresses import place_of
from .calibration import Calibrated
from .head_filter import FilterSettings, HeadFilter
from .mouse import MouseTracker
from .opening import open_tracker, wand_sensor
from .outside import OutsideWatch, is_outside
from .recording import PathTracker, Recording
from .sample import NoTracker, Sample, Tracker, TrackerError
from .wand import Bindings, Wand

__all__ = [
    "Bindings",
    "Calibrated",
    "FilterSettings",
    "HeadFilter",
    "MouseTracker",
    "NoTracker",
    "OutsideWatch",
    "PathTracker",
    "Recording",
    "Sample",
    "Tracker",
    "TrackerError",
    "Wand",
    "is_outside",
    "open_tracker",
    "place_of",
    "wand_sensor",
]
