"""What each part of the renderer is worth: it is switched off alone, and time, samples and error compared."""

from __future__ import annotations

from ..errors import PerspSWError
from ..renderer import Renderer
from .bench import Plan, Row, settings_row, time_rows
from .cases import Case
from .modes import ABLATIONS, available
from .ours import Ours

DEFAULT = "default"


def ablate(case: Case, plan: Plan) -> list[Row]:
    """A row for the plan's first settings, and one for each switch that changes them.

    Every row has `switch`, `time_ratio` and `sample_ratio` (to the default's) and `psnr_change` in dB. Each
    switch has a renderer of its own, since some change what is stored.
    """
    base = plan.settings[0]
    switches = {DEFAULT: base, **available(ABLATIONS, base)}
    try:
        stage = case.open()
        contestants = []
        for name, settings in switches.items():
            if name == DEFAULT or settings != base:
                plan.progress(len(contestants), len(switches), "encoding")
                renderer = Renderer(stage.volume, stage.transfer, settings, stage.regions, look=stage.look)
                ours = Ours(renderer, settings)
                ours.prepare(stage.views[0])
                contestants.append(({**case.labels, "switch": name, **settings_row(settings)}, ours))
        truth = plan.truths.of(
            stage.volume, stage.transfer, stage.views[-1], stage.regions, plan.progress, stage.look
        )
    except PerspSWError as error:
        return [{**case.labels, "switch": DEFAULT, "renderer": "persp_sw", "error": str(error)}]
    rows = time_rows(contestants, stage, truth, plan)
    default = rows[0]
    for row in rows:
        row["time_ratio"] = row["ms"] / default["ms"]
        row["sample_ratio"] = row["samples"] / default["samples"] if default["samples"] else None
        row["psnr_change"] = row["psnr"] - default["psnr"]
    return rows
