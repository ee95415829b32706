"""The chart of time against accuracy as a picture. Needs the package matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from .bench import Row
from .chart import figures, time_at

# Colours that most colour-blind people tell apart (Okabe and Ito).
_COLOURS = ("#0072b2", "#009e73", "#d55e00", "#cc79a7", "#56b4e9", "#e69f00")
_PEERS = {"vtk-fixed": "s", "vtk-fixed-2px": "D", "vtk-gpu": "^"}
_INK, _PALE = "#222222", "#888888"
_COLUMNS = 3
_NAMED = (0.5, 1, 2, 4, 8)  # qualities


def draw(panels: Sequence[Sequence[Row]], path: Path) -> None:
    """A panel for each case; one curve a mode along the qualities, the best of all broad and grey, the peers.

    Parameters
    ----------
    panels
        The rows of `chart.points_of`, case by case.
    path
        .png, .svg or .pdf.
    """
    columns = min(_COLUMNS, len(panels))
    lines = -(-len(panels) // columns)
    with matplotlib.rc_context({"font.size": 9, "svg.fonttype": "none", "axes.unicode_minus": True}):
        figure = Figure(figsize=(4.6 * columns, 3.9 * lines + 0.6), layout="constrained")
        axes = figure.subplots(lines, columns, squeeze=False).ravel()
        for axis, rows in zip(axes, panels, strict=False):
            _panel(axis, rows)
        for axis in axes[len(panels) :]:
            axis.set_axis_off()
        handles: dict[str, object] = {}
        for axis in axes:
            for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
                handles.setdefault(label, handle)
        figure.legend(
            handles.values(),
            handles.keys(),
            loc="outside lower center",
            ncols=3 * columns,
            frameon=False,
            fontsize=8.5,
        )
        figure.savefig(path, dpi=160)


def _panel(axis: Axes, rows: Sequence[Row]) -> None:
    ours = [row for row in rows if "mode" in row]
    peers = [row for row in rows if row["renderer"] != "persp_sw"]
    best = sorted((row for row in ours if row["on_front"]), key=lambda row: row["ms"])
    accuracies = np.linspace(min(row["psnr"] for row in best), max(row["psnr"] for row in best), 300)
    axis.plot(
        [time_at(psnr, ours) for psnr in accuracies],
        accuracies,
        color=_INK,
        linewidth=4,
        alpha=0.15,
        solid_capstyle="round",
        label="best of ours",
        zorder=1,
    )
    for colour, mode in zip(_COLOURS, dict.fromkeys(row["mode"] for row in ours), strict=False):
        curve = sorted((row for row in ours if row["mode"] == mode), key=lambda row: row["quality"])
        axis.plot(
            [row["ms"] for row in curve],
            [row["psnr"] for row in curve],
            "o-",
            color=colour,
            markersize=3.5,
            linewidth=1.2,
            label=mode,
            zorder=3,
        )
    _name_qualities(axis, best)
    _draw_peers(axis, peers, rows)
    axis.set_xscale("log")
    axis.xaxis.set_major_locator(LogLocator(10, subs=(1, 2, 5)))
    axis.xaxis.set_major_formatter(FuncFormatter(lambda ms, _: f"{ms:g}"))
    axis.xaxis.set_minor_formatter(NullFormatter())
    axis.margins(0.09, 0.1)
    axis.grid(True, which="major", color="#e4e4e4", linewidth=0.7)
    axis.set_axisbelow(True)
    axis.spines[["top", "right"]].set_visible(False)
    threads = rows[0]["threads"]
    axis.set_title(rows[0]["case"], loc="left", fontweight="bold", fontsize=9.5)
    axis.set_xlabel(f"ms a frame, {threads} thread{'s' * (threads > 1)}")
    axis.set_ylabel("PSNR, dB")


def _name_qualities(axis: Axes, best: Sequence[Row]) -> None:
    """The quality beside some points of the front."""
    named: list[Row] = []
    for row in best:
        same = [other for other in named if other["quality"] == row["quality"]]
        beside = any(abs(np.log(row["ms"] / other["ms"])) < 0.05 for other in same)
        if row["quality"] in _NAMED and not beside:
            named.append(row)
            axis.annotate(
                f"{row['quality']:g}",
                (row["ms"], row["psnr"]),
                xytext=(-4, 4),
                textcoords="offset points",
                ha="right",
                fontsize=7.5,
                color=_INK,
            )


def _draw_peers(axis: Axes, peers: Sequence[Row], rows: Sequence[Row]) -> None:
    """Each peer, and how many times as fast ours is where its front is as accurate."""
    equal = {figure["renderer"]: figure for figure in figures(rows)}
    for row in peers:
        axis.plot(
            row["ms"],
            row["psnr"],
            _PEERS.get(row["renderer"], "*"),
            color=_INK,
            markersize=6,
            linestyle="none",
            label=row["renderer"],
            zorder=4,
        )
        figure = equal[row["renderer"]]
        if figure["equal_ms"] is not None:
            axis.annotate(
                "",
                (figure["equal_ms"], row["psnr"]),
                xytext=(row["ms"], row["psnr"]),
                arrowprops={"arrowstyle": "->", "color": _PALE, "linewidth": 0.9, "linestyle": "--"},
                zorder=2,
            )
        axis.annotate(
            "not reached" if figure["ratio"] is None else f"{figure['ratio']:.2g} ×",
            (row["ms"], row["psnr"]),
            xytext=(-6, 4),
            textcoords="offset points",
            ha="right",
            fontsize=8,
            color=_INK,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.6},
            zorder=5,
        )
