"""Perspective shear-warp volume rendering for immersive virtual reality.

What is listed in `__all__` is imported when it is first used (PEP 562), so that `import persp_sw` and the
command line start at once: numba and the file readers load only when something needs them.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from . import images, marks, reference
    from .cancel import Cancel, Cancelled
    from .errors import PerspSWError
    from .eye_image import EyeImage
    from .geometry.regions import Cut, Regions
    from .geometry.view import Eye, View, Wall
    from .measure.trace import FrameRecord, TraceWriter
    from .measure.trace_reading import read_trace
    from .optics import editing
    from .optics.histogram import value_counts
    from .optics.joint_histogram import JointHistogram
    from .optics.lighting import Light, Lighting
    from .optics.look import Look, Modulation
    from .optics.transfer import TransferFunction
    from .optics.transfer2d import Box, TransferFunction2D, Triangle
    from .optics.window_level import CT_WINDOWS, window_level, window_of
    from .planning import EyePlan
    from .probe import Pick, Probe
    from .quality.controller import Choice, FrameTimeController
    from .quality.features import FrameCost, SceneFeatures
    from .quality.ladder import Ladder
    from .quality.rest import Refinement
    from .quality.saved_ladder import ladder_for
    from .renderer import Renderer
    from .scene import Scene
    from .settings import Settings
    from .volume.files import load
    from .volume.gradient import largest_magnitude
    from .volume.grid import Volume
    from .warp.canvas import Canvas
    from .warp.context import OffscreenContext
    from .warp.framebuffer import Framebuffer
    from .warp.texture import TextureWarp

__all__ = [
    "CT_WINDOWS",
    "Box",
    "Cancel",
    "Cancelled",
    "Canvas",
    "Choice",
    "Cut",
    "Eye",
    "EyeImage",
    "EyePlan",
    "FrameCost",
    "FrameRecord",
    "FrameTimeController",
    "Framebuffer",
    "JointHistogram",
    "Ladder",
    "Light",
    "Lighting",
    "Look",
    "Modulation",
    "OffscreenContext",
    "PerspSWError",
    "Pick",
    "Probe",
    "Refinement",
    "Regions",
    "Renderer",
    "Scene",
    "SceneFeatures",
    "Settings",
    "TextureWarp",
    "TraceWriter",
    "TransferFunction",
    "TransferFunction2D",
    "Triangle",
    "View",
    "Volume",
    "Wall",
    "__version__",
    "editing",
    "images",
    "ladder_for",
    "largest_magnitude",
    "load",
    "marks",
    "read_trace",
    "reference",
    "value_counts",
    "window_level",
    "window_of",
]
__version__ = "0.1.0"

_HOME = {
    "Box": ".optics.transfer2d",
    "CT_WINDOWS": ".optics.window_level",
    "Cancel": ".cancel",
    "Cancelled": ".cancel",
    "Canvas": ".warp.canvas",
    "Choice": ".quality.controller",
    "Cut": ".geometry.regions",
    "Eye": ".geometry.view",
    "EyeImage": ".eye_image",
    "EyePlan": ".planning",
    "FrameCost": ".quality.features",
    "FrameRecord": ".measure.trace",
    "FrameTimeController": ".quality.controller",
    "Framebuffer": ".warp.framebuffer",
    "JointHistogram": ".optics.joint_histogram",
    "Ladder": ".quality.ladder",
    "Light": ".optics.lighting",
    "Lighting": ".optics.lighting",
    "Look": ".optics.look",
    "Modulation": ".optics.look",
    "OffscreenContext": ".warp.context",
    "Pick": ".probe",
    "Probe": ".probe",
    "PerspSWError": ".errors",
    "Refinement": ".quality.rest",
    "Regions": ".geometry.regions",
    "Renderer": ".renderer",
    "Scene": ".scene",
    "SceneFeatures": ".quality.features",
    "Settings": ".settings",
    "TextureWarp": ".warp.texture",
    "TraceWriter": ".measure.trace",
    "TransferFunction": ".optics.transfer",
    "TransferFunction2D": ".optics.transfer2d",
    "Triangle": ".optics.transfer2d",
    "View": ".geometry.view",
    "Volume": ".volume.grid",
    "Wall": ".geometry.view",
    "ladder_for": ".quality.saved_ladder",
    "largest_magnitude": ".volume.gradient",
    "load": ".volume.files",
    "read_trace": ".measure.trace_reading",
    "value_counts": ".optics.histogram",
    "window_level": ".optics.window_level",
    "window_of": ".optics.window_level",
}
_MODULES = {"editing": ".optics.editing", "images": ".images", "reference": ".reference"}


def __getattr__(name: str) -> object:
    if name in _MODULES:
        return import_module(_MODULES[name], __name__)
    if name in ("images", "marks", "reference"):  # modules
        return import_module(f".{name}", __name__)
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_HOME[name], __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
