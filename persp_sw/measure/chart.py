"""Time against accuracy: one point for each way to sample at each quality, one for each peer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import PerspSWError
from .bench import Plan, Row, measure
from .cases import Case
from .modes import MODES, available

QUALITIES = (0.35, 0.5, 0.71, 1.0, 1.41, 2.0, 2.83, 4.0)


def points_of(case: Case, plan: Plan, qualities: Sequence[float] = QUALITIES) -> list[Row]:
    """`bench.measure`'s rows for all modes and qualities of the plan's first settings, and for its peers.

    Ours have `mode`, and `on_front`: nothing measured of ours is both faster and more accurate.

    Raises
    ------
    PerspSWError
        The case cannot be rendered.
    """
    modes = available(MODES, plan.settings[0])
    labels = [(mode, quality) for mode in modes for quality in qualities]
    settings = [replace(modes[mode], quality=quality) for mode, quality in labels]
    rows = measure(case, replace(plan, settings=settings, search=False))
    failed = [row for row in rows if "error" in row]
    if failed:
        raise PerspSWError(f"{failed[0]['case']}, {failed[0]['renderer']}: {failed[0]['error']}")
    ours = rows[: len(labels)]
    for row, (mode, _) in zip(ours, labels, strict=True):
        row["mode"] = mode
    kept = set(front([row["ms"] for row in ours], [row["psnr"] for row in ours]))
    for index, row in enumerate(ours):
        row["on_front"] = index in kept
    return rows


def front(ms: Sequence[float], psnr: Sequence[float]) -> list[int]:
    """Indices of the points that no other beats in both time and accuracy, fastest first."""
    order = sorted(range(len(ms)), key=lambda n: (ms[n], -psnr[n]))
    kept, best = [], -np.inf
    for index in order:
        if psnr[index] > best:
            kept.append(index)
            best = psnr[index]
    return kept


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
