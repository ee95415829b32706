"""Traces as a picture: frame time, stages, quality and latency over time. Needs the package matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.ticker import MaxNLocator

from . import trace_panels as panels
from .trace_reading import Trace
from .trace_summary import WITHIN, frame_ms, summary

_COLUMNS = 3
_COLUMN_INCHES = {1: 10.0, 2: 6.6, 3: 5.4}
_MOST_OF_TARGET = 2.5  # frames beyond are told, not drawn: else one spike flattens all others
_SAME_TARGET = 0.01


def draw(traces: Sequence[Trace], path: Path) -> None:
    """A column for each trace; the same scales in all, those of times where the targets are the same.

    Parameters
    ----------
    traces
        With frames.
    path
        .png, .svg or .pdf.
    """
    shown = [panel for panel in panels.PANELS if any(panel.has(trace) for trace in traces)]
    columns = min(_COLUMNS, len(traces))
    blocks = [traces[start : start + columns] for start in range(0, len(traces), columns)]
    alike = _same_target(traces)
    rungs = tuple(dict.fromkeys(rung for trace in traces for rung in trace["rung"]))
    with matplotlib.rc_context({"font.size": 9, "svg.fonttype": "none", "axes.unicode_minus": True}):
        height = sum(panel.inches + 0.2 for panel in shown) + 0.9
        size = _COLUMN_INCHES[columns] * columns, height * len(blocks)
        figure = Figure(figsize=size, layout="constrained")
        first: dict[str, Axes] = {}  # whose scale others share
        for part, block in zip(np.ravel(figure.subfigures(len(blocks), 1)), blocks, strict=True):
            grid = part.subplots(
                len(shown), columns, squeeze=False, sharex="col", height_ratios=[p.inches for p in shown]
            )
            for number, trace in enumerate(block):
                of_rates = number == len(block) - 1 or not alike
                common = panels.Common(_top_ms(traces if alike else [trace]), rungs, of_rates)
                for panel, axis in zip(shown, grid[:, number], strict=True):
                    if alike or not panel.of_times:
                        _share(axis, first.setdefault(panel.name, axis), hide=number > 0)
                    panel.draw(axis, trace, common)
                    _dress(axis)
            _finish(part, grid, shown, block, legends=block is blocks[0])
        figure.savefig(path, dpi=150)


def _same_target(traces: Sequence[Trace]) -> bool:
    targets = [target for trace in traces if (target := summary(trace)["target_ms"])]
    return not targets or max(targets) <= (1 + _SAME_TARGET) * min(targets)


def _top_ms(traces: Sequence[Trace]) -> float:
    """The highest time of a frame that is drawn."""
    every = np.concatenate([frame_ms(trace) for trace in traces])
    if not (every > 0).any():
        return 1.0
    target = float(np.nanmax(np.concatenate([trace["target_ms"] for trace in traces]), initial=0))
    usual = max(np.nanpercentile(ms, 99) for ms in map(frame_ms, traces) if np.isfinite(ms).any())
    highest = max(float(np.nanmax(every)), (1 + WITHIN) * target)
    return min(1.08 * highest, max(_MOST_OF_TARGET * target, 1.2 * float(usual)))


def _share(axis: Axes, first: Axes, hide: bool) -> None:
    if axis is not first:
        axis.sharey(first)
    axis.tick_params(labelleft=not hide)


def _dress(axis: Axes) -> None:
    if axis.get_yscale() == "linear":
        axis.yaxis.set_major_locator(MaxNLocator(5))
    axis.grid(True, which="major", color="#e4e4e4", linewidth=0.7)
    axis.set_axisbelow(True)
    axis.spines[["top", "right"]].set_visible(False)
    axis.margins(x=0.005, y=0.1)


def _finish(
    part: SubFigure, grid: np.ndarray, shown: Sequence[panels.Panel], block: Sequence[Trace], legends: bool
) -> None:
    """What needs all of a block's panels drawn: titles, names of axes, legends."""
    for axes, trace in zip(grid.T, block, strict=False):
        _title(axes[0], trace)
        axes[-1].set_xlabel("seconds")
    for panel, row in zip(shown, grid, strict=True):
        row[0].set_ylabel(panel.label)
        for axis in row[: len(block)]:
            if axis.get_yscale() == "linear":
                axis.set_ylim(bottom=0)
        for axis in row[len(block) :]:
            axis.set_axis_off()
        if legends:
            _legend(row, beside_rates=panel.name == "time")
    part.align_ylabels(grid[:, 0])


def _title(axis: Axes, trace: Trace) -> None:
    figures = summary(trace)
    parts = []
    if figures["within"] is not None:
        within = f"{panels.percent(figures['within'])} within ± {panels.percent(WITHIN)}"
        parts.append(f"{within} of {figures['target_ms']:.3g} ms")
        parts.append(f"p99 {figures['of_target_p99']:.2f} × target")
    parts.append(f"{figures['missed']} missed")
    axis.set_title(trace.name, loc="left", fontweight="bold", fontsize=9.5, pad=18)
    axis.annotate(
        ", ".join(parts), (0, 1), (0, 5), xycoords="axes fraction", textcoords="offset points", fontsize=8.5
    )


def _legend(row: Sequence[Axes], beside_rates: bool) -> None:
    """One for all of a row, on its right."""
    handles: dict[str, object] = {}
    for axis in row:
        for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    last = row[-1]
    inches = last.get_window_extent().width / last.figure.dpi
    last.legend(
        handles.values(),
        handles.keys(),
        loc="center left",
        bbox_to_anchor=(1 + (0.54 if beside_rates else 0.06) / inches, 0.5),
        frameon=False,
        fontsize=8,
        borderaxespad=0,
        handlelength=1.4,
    )
