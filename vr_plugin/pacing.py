"""The frame-time controller of a rig and a scene."""

from __future__ import annotations

import persp_sw as psw

from .rig import QualityAim

_SAMPLING = ("samples_per_interval", "preintegrated", "residual", "single_face_tangent", "level_of_detail")


def controller_for(
    renderer: psw.Renderer, aim: QualityAim, rate_hz: float, ladder: psw.Ladder | None = None
) -> psw.FrameTimeController | None:
    """What holds `rate_hz` within the aim's limits of quality, from the renderer's quality on.

    None where the limits leave nothing to choose. It walks the ladder that `persp-sw chart` measured for this
    scene and machine, if it did, on to the aim's limits; where the user chose how rays are sampled, quality
    alone is free. `ladder`: one that is known.
    """
    if aim.min_quality >= aim.max_quality:
        return None
    return psw.FrameTimeController(
        1e3 / rate_hz,
        ladder or _ladder(renderer).extended(aim.min_quality, aim.max_quality),
        quality=renderer.settings.quality,
        min_quality=aim.min_quality,
        max_quality=aim.max_quality,
    )


def _ladder(renderer: psw.Renderer) -> psw.Ladder:
    usual, settings = psw.Settings(), renderer.settings
    chosen = any(getattr(settings, name) != getattr(usual, name) for name in _SAMPLING)
    return psw.Ladder.default() if chosen else psw.ladder_for(renderer)
