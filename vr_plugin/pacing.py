"""The frame-time controller of a rig and a scene."""

from __future__ import annotations

import persp_sw as psw

from .rig import QualityAim

_USER_S = ("samples_per_interval", "preintegrated", "residual", "single_face_tangent", "level_of_detail")


def controller_for(renderer: psw.Renderer, aim: QualityAim, rate_hz: float) -> psw.FrameTimeController | None:
    """What holds `rate_hz` within the aim's limits of quality, from the renderer's quality on.

    None where the limits leave nothing to choose. It walks the ladder that `persp-sw chart` measured for this
    scene and machine, if it did; where the user chose how rays are sampled, quality alone is free.
    """
    if aim.min_quality >= aim.max_quality:
        return None
    usual, settings = psw.Settings(), renderer.settings
    chosen = any(getattr(settings, name) != getattr(usual, name) for name in _USER_S)
    return psw.FrameTimeController(
        1e3 / rate_hz,
        psw.Ladder.default() if chosen else psw.ladder_for(renderer),
        quality=renderer.settings.quality,
        min_quality=aim.min_quality,
        max_quality=aim.max_quality,
    )
