"""The frame-time controller of a rig and a scene."""

from __future__ import annotations

import persp_sw as psw

from .rig import QualityAim


def controller_for(renderer: psw.Renderer, aim: QualityAim, rate_hz: float) -> psw.FrameTimeController | None:
    """What holds `rate_hz` within the aim's limits of quality, from the renderer's quality on.

    None where the limits leave nothing to choose.
    """
    if aim.min_quality >= aim.max_quality:
        return None
    return psw.FrameTimeController(
        1e3 / rate_hz,
        quality=renderer.settings.quality,
        min_quality=aim.min_quality,
        max_quality=aim.max_quality,
    )
