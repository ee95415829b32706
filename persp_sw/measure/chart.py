"""Time against accuracy: our settings, on and off the front, and the peers; and the ladder that follows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from hashlib import sha256
from time import perf_counter
from typing import Any

import numpy as np

from ..errors import PerspSWError
from ..quality.ladder import Ladder, Point
from ..quality.ladder_choice import ladder_from_points
from ..quality.saved_ladder import machine_key, program_key, volume_key
from ..renderer import Renderer
from ..settings import Settings
from .bench import Plan, Row, open_peers, settings_row, time_rows
from .cases import Case, Stage
from .front import Space, Trial, Way, front, search
from .metrics import psnr
from .modes import OPTIONS, SAMPLING
from .ours import Ours
from .textures import texture_rows

QUALITIES = (0.25, 0.35, 0.5, 0.71, 1.0, 1.41, 2.0, 2.83, 4.0)
_TRIAL_FRAMES = 3


@dataclass(frozen=True)
class Chart:
    """What was measured of one case.

    Attributes
    ----------
    rows
        Of `bench.time_rows`. Ours have `mode`, the way's name, `sampling` and `varied`, its parts, `changes`,
        what it sets, and `on_front`: no other of ours is both faster and more accurate.
    textures
        Of `textures.texture_rows`; empty where there is no OpenGL.
    volume
        `volume_key` of the case's volume, transfer function and look.
    """

    rows: list[Row]
    textures: list[Row]
    volume: str


def chart_of(case: Case, plan: Plan, qualities: Sequence[float] = QUALITIES) -> Chart:
    """Search and measure one case, its peers and texture formats, too.

    `plan.settings[0]` gives what is not varied: the threads.

    Raises
    ------
    PerspSWError
        The case cannot be rendered, or a peer cannot.
    """
    stage = case.open()
    view, base = stage.views[-1], plan.settings[0]
    renderer = Renderer(stage.volume, stage.transfer, base, stage.regions, look=stage.look)
    renderer.render(stage.views[0])  # whether it can be rendered shows here, before the truth is cast
    truth = plan.truths.of(stage.volume, stage.transfer, view, stage.regions, plan.progress, stage.look)
    peers, failed = open_peers(case, stage, plan.peers, truth)
    for row in failed:
        raise PerspSWError(f"{row['case']}, {row['renderer']}: {row['error']}")
    space = Space(SAMPLING, OPTIONS, sorted(set(qualities)))
    contestants: list[tuple[Row, Any]] = []
    for way, quality in search(space, _Trials(renderer, space, stage, truth, plan)):
        changes = space.changes(way)
        settings = replace(base, quality=quality, **changes)
        row = {**case.labels, **settings_row(settings), "mode": way.name, "sampling": way.sampling}
        row |= {"varied": list(way.varied), "changes": dict(changes)}
        contestants.append((row, Ours(renderer, settings)))
    rows = time_rows([*contestants, *peers], stage, truth, replace(plan, waste=False))
    ours = rows[: len(contestants)]
    kept = set(front([row["ms"] for row in ours], [row["psnr"] for row in ours]))
    for index, row in enumerate(ours):
        row["on_front"] = index in kept
    renderer.settings = base
    textures = texture_rows(renderer, view)
    return Chart(rows, textures, volume_key(stage.volume, stage.transfer, stage.look))


def ladder_of(charts: Sequence[Chart], settings: Settings) -> Ladder:
    """The ladder of one or several views of one volume and transfer function.

    Costs are milliseconds of compositing. Of several views they are the geometric means, and accuracies the
    means, of the settings that were measured in all. Ways without levels of detail make no rung: what they
    gain in a still picture flickers in a moving one, which PSNR does not see.

    Raises
    ------
    SettingsError
        The points make no ladder.
    """
    tables = [{(r["mode"], r["quality"]): r for r in chart.rows if "mode" in r} for chart in charts]
    shared = reduce(lambda known, table: [key for key in known if key in table], tables[1:], [*tables[0]])
    points = []
    for key in shared:
        rows = [table[key] for table in tables]
        if not rows[0]["changes"].get("level_of_detail", True):
            continue
        cost = float(np.exp(np.mean([np.log(max(row["composite_ms"], 1e-6)) for row in rows])))
        accuracy = float(np.mean([row["psnr"] for row in rows]))
        points.append((key[0], rows[0]["changes"], Point(key[1], cost, accuracy)))
    machine = machine_key(settings.threads)
    return ladder_from_points(points, machine, charts[0].volume, program_key())


def time_at(target: float, rows: Sequence[Row]) -> float | None:
    """Our time at `target` dB: the least of all modes', log(ms) linear between a mode's points.

    A mode's fastest point where even that is more accurate; None where no mode is accurate enough.
    """
    times = []
    for mode in dict.fromkeys(row["mode"] for row in rows if "mode" in row):
        ms, psnr = zip(*((row["ms"], row["psnr"]) for row in rows if row.get("mode") == mode), strict=True)
        kept = front(ms, psnr)
        if target <= psnr[kept[-1]]:
            times.append(np.interp(target, [psnr[n] for n in kept], [np.log(ms[n]) for n in kept]))
    return float(np.exp(min(times))) if times else None


def figures(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """For each peer its time over ours at its accuracy, between measured points; None if not reached."""
    result = []
    for row in rows:
        if row["renderer"] != "persp_sw":
            equal = time_at(row["psnr"], rows)
            result.append(
                {
                    **{name: row[name] for name in ("case", "renderer", "threads", "ms", "psnr")},
                    "equal_ms": equal,
                    "ratio": row["ms"] / equal if equal else None,
                }
            )
    return result


class _Trials:
    """Tries ways for `search`: one frame to encode and compile, a few of which the fastest counts."""

    def __init__(self, renderer: Renderer, space: Space, stage: Stage, truth: np.ndarray, plan: Plan):
        self.renderer, self.space, self.plan = renderer, space, plan
        self.view, self.truth = stage.views[-1], truth
        self.done = 0

    def __call__(self, way: Way, quality: float) -> Trial:
        changes = self.space.changes(way)
        self.renderer.settings = replace(self.plan.settings[0], quality=quality, **changes)
        picture = self.renderer.render(self.view)
        spent = []
        for _ in range(_TRIAL_FRAMES):
            start = perf_counter()
            self.renderer.composite(self.view.eye, [self.view.wall])
            spent.append(1e3 * (perf_counter() - start))
        self.done += 1
        # How many points will be near the front is not known: about as many again as the grid has.
        grid = len(self.space.sampling) * len(self.space.qualities)
        self.plan.progress(self.done, max(2 * grid, self.done + 1), "settings tried")
        return Trial(min(spent), psnr(picture, self.truth), sha256(picture).hexdigest())
