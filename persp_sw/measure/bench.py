"""One case of the benchmark: time, work, memory and error of each group of settings and of each peer."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from ..arrays import Image
from ..errors import PerspSWError
from ..geometry.view import View
from ..renderer import Renderer
from ..settings import Settings
from . import equal_accuracy
from .cases import Case, Stage
from .metrics import compare
from .ours import Ours
from .timing import time_in_turn
from .truth import Truths

Row = dict[str, Any]
Progress = Callable[[int, int, str], None]


class Peer(Protocol):
    """Another renderer, as a `timing.Contestant` whose picture can be judged."""

    name: str
    threads: int

    def open(self, stage: Stage) -> None:
        """Take the scene; PerspSWError where the peer cannot show it."""

    def prepare(self, view: View) -> None:
        """See `timing.Contestant`."""

    def draw(self, view: View) -> dict[str, float]:
        """See `timing.Contestant`."""

    def picture(self, view: View) -> Image:
        """(h, w, 4) linear premultiplied."""


@dataclass
class Plan:
    """What to measure in every case.

    Parameters
    ----------
    settings
        Groups of settings; the first is the one that peers are compared with at its own quality.
    seconds
        Timed for each contestant.
    search
        Whether to look for our settings that equal each peer's accuracy.
    waste
        Whether to count the samples that could not be done without, which takes longer than a frame.
    """

    settings: Sequence[Settings]
    truths: Truths
    seconds: float = 1.0
    peers: Sequence[Peer] = ()
    search: bool = True
    waste: bool = True
    progress: Progress = field(default=lambda done, total, what: None)


def measure(case: Case, plan: Plan) -> list[Row]:
    """All rows of one case. What cannot be rendered becomes a row with `error`, not an exception.

    Returns
    -------
    A row for each group of settings, then for each peer; and for each peer one with `equal_to`, which holds
    our time at the peer's accuracy.
    """
    try:
        stage = case.open()
        view = stage.views[-1]
        renderer = Renderer(stage.volume, stage.transfer, plan.settings[0], stage.regions, look=stage.look)
        first = Ours(renderer, plan.settings[0])
        first.prepare(stage.views[0])  # whether it can be rendered shows here
        truth = plan.truths.of(stage.volume, stage.transfer, view, stage.regions, plan.progress, stage.look)
    except PerspSWError as error:
        return [{**case.labels, "renderer": "persp_sw", "error": str(error)}]
    ours = [first, *(Ours(renderer, settings) for settings in plan.settings[1:])]
    contestants: list[tuple[Row, Any]] = [({**case.labels, **settings_row(o.settings)}, o) for o in ours]
    able, failed = open_peers(case, stage, plan.peers, truth)
    contestants += able
    if plan.search:
        contestants += _equals(case, plan, contestants, renderer, view, truth)
    try:
        return time_rows(contestants, stage, truth, plan) + failed
    except PerspSWError as error:  # on the way: an eye that walks into the volume, a peer that dies
        return [{**case.labels, "renderer": "persp_sw", "error": str(error)}, *failed]


def open_peers(
    case: Case, stage: Stage, peers: Sequence[Peer], truth: np.ndarray
) -> tuple[list[tuple[Row, Peer]], list[Row]]:
    """Peers with the scene as contestants, their rows begun; rows with `error` of those that fail."""
    able, failed = [], []
    for peer in peers:
        row = {**case.labels, "renderer": peer.name, "threads": peer.threads}
        try:
            peer.open(stage)
            row |= compare(peer.picture(stage.views[-1]), truth)
        except PerspSWError as error:
            failed.append({**row, "error": str(error)})
        else:
            able.append((row, peer))
    return able, failed


def settings_row(settings: Settings) -> Row:
    """What a row says about our settings."""
    return {
        "renderer": "persp_sw",
        "threads": settings.threads,
        "quality": settings.quality,
        "residual": settings.residual,
    }


def time_rows(
    contestants: Sequence[tuple[Row, Any]], stage: Stage, truth: np.ndarray, plan: Plan
) -> list[Row]:
    """Judge and time all contestants of a case in turn, and complete their rows."""
    view = stage.views[-1]
    for row, contestant in contestants:
        if "psnr" not in row:
            contestant.prepare(view)  # encodes and compiles apart
            row |= compare(contestant.picture(view), truth)
        if isinstance(contestant, Ours):
            row |= contestant.counts(stage, view, plan.waste)
    turns = iter(range(1, 1 + 5 * len(contestants)))
    times = time_in_turn(
        [contestant for _, contestant in contestants],
        stage.views,
        plan.seconds,
        after_turn=lambda: plan.progress(next(turns), 5 * len(contestants), "turns"),
    )
    for (row, contestant), taken in zip(contestants, times, strict=True):
        row |= taken.figures()
        if isinstance(contestant, Ours):
            row |= contestant.once
            row["samples_per_second"] = 1e3 * row["samples"] / max(row["composite_ms"], 1e-6)
    return [row for row, _ in contestants]


def _equals(
    case: Case,
    plan: Plan,
    contestants: Iterable[tuple[Row, Any]],
    renderer: Renderer,
    view: View,
    truth: np.ndarray,
) -> list[tuple[Row, Ours]]:
    """For each peer our settings that reach its accuracy, as contestants of their own."""
    found: list[tuple[Row, Ours]] = []
    searched: dict[str, Any] = {}
    for row, contestant in contestants:
        if isinstance(contestant, Ours):
            continue
        name = contestant.name
        if name not in searched:  # the accuracy does not depend on the threads
            plan.progress(0, 1, f"settings equal to {name}")
            searched[name] = equal_accuracy.search(renderer, plan.settings[0], view, truth, row["psnr"])
        reached = searched[name]
        settings = replace(reached.settings, threads=row["threads"])
        equal = {
            **case.labels,
            **settings_row(settings),
            "equal_to": name,
            "mode": reached.mode,
            "reached": reached.reached,
        }
        found.append((equal, Ours(renderer, settings)))
    return found


def compare_at_equal_accuracy(rows: Sequence[Row]) -> list[Row]:
    """One row for each peer, threads and case: both times, both errors, and the ratios of the medians.

    `ratio` is the peer's time over ours at its accuracy, None where no setting of ours reaches it;
    `plain_ratio` is over our time at the first settings with as many threads.
    """
    result = []
    for equal in rows:
        if "equal_to" not in equal:
            continue
        same = [
            row for row in rows if row["case"] == equal["case"] and row.get("threads") == equal["threads"]
        ]
        peer = next(row for row in same if row["renderer"] == equal["equal_to"])
        plain = next((r for r in same if r["renderer"] == "persp_sw" and "equal_to" not in r), None)
        result.append(
            {
                **{name: equal[name] for name in ("case", "size", "threads", "mode", "quality", "reached")},
                **{name: equal[name] for name in ("samples_per_interval", "preintegrated")},
                "peer": peer["renderer"],
                "peer_ms": peer["ms"],
                "peer_psnr": peer["psnr"],
                "ms": equal["ms"],
                "psnr": equal["psnr"],
                "ratio": peer["ms"] / equal["ms"] if equal["reached"] else None,
                "plain_quality": plain["quality"] if plain else None,
                "plain_ms": plain["ms"] if plain else None,
                "plain_psnr": plain["psnr"] if plain else None,
                "plain_ratio": peer["ms"] / plain["ms"] if plain else None,
            }
        )
    return result
