"""The chart of time against accuracy as a picture. Needs the package matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from .bench import Row
from .chart import figures
from .front import front
from .modes import OPTIONS

# Colours that most colour-blind people tell apart (Okabe and Ito).
_COLOURS = ("#0072b2", "#009e73", "#d55e00", "#cc79a7", "#56b4e9", "#e69f00")
_PEERS = {"vtk-fixed": "s", "vtk-fixed-2px": "D", "vtk-gpu": "^"}
_BETTER = {"psnr": 1, "unlike": -1}
_INK, _PALE = "#222222", "#888888"
# Of what is varied; sampling modes as usual are dots on a line.
_SEVERAL = "several of these"
_VARIED = dict(
    zip([name for option in OPTIONS.values() for name in option] + [_SEVERAL], "DPX*", strict=True)
)
_COLUMNS = 3
_NAMED = (0.25, 0.5, 1, 2, 4)  # qualities
_LEAST_UNLIKE = 1e-7  # 1 − SSIM of pictures that are all but equal


def draw(panels: Sequence[Sequence[Row]], kind: str) -> bytes:
    """Two panels for each case, PSNR and SSIM over ms: a curve a sampling mode, the front, the peers.

    Each panel has the front of its own figure, and of what is varied besides the sampling only what is on it.

    Parameters
    ----------
    panels
        `chart.Chart.rows`, case by case.
    kind
        Of file: "png", "svg" or "pdf".

    Returns
    -------
    bytes
        What the file holds.
    """
    columns = min(_COLUMNS, len(panels))
    lines = -(-len(panels) // columns)
    with matplotlib.rc_context({"font.size": 9, "svg.fonttype": "none", "axes.unicode_minus": True}):
        figure = Figure(
            figsize=(5.4 * columns + 1.2 * (columns == 1), 6.2 * lines + 1.2), layout="constrained"
        )
        axes = figure.subplots(
            2 * lines,
            columns,
            squeeze=False,
            sharex="col" if lines == 1 else False,
            height_ratios=[3, 2] * lines,
        )
        shown: set[str] = set()
        for index in range(lines * columns):
            line, column = divmod(index, columns)
            upper, lower = axes[2 * line, column], axes[2 * line + 1, column]
            if index >= len(panels):
                upper.set_axis_off()
                lower.set_axis_off()
                continue
            rows = [_with_unlike(row) for row in panels[index]]
            shown |= {
                _varied(row) for axis in ((upper, "psnr"), (lower, "unlike")) for row in _panel(*axis, rows)
            }
            upper.set_title(rows[0]["case"], loc="left", fontweight="bold", fontsize=10)
            lower.set_xlim(upper.get_xlim())
            threads = rows[0]["threads"]
            lower.set_xlabel(f"ms a frame, {threads} thread{'s' * (threads > 1)}")
        for name in (name for name in _VARIED if name in shown):
            axes[0, 0].plot([], [], _VARIED[name], color=_INK, markersize=6.5, mfc="white", label=name)
        handles: dict[str, object] = {}
        for axis in axes.ravel():
            for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
                handles.setdefault(label, handle)
        figure.legend(
            handles.values(),
            handles.keys(),
            loc="outside lower center",
            ncols=2 * columns,
            frameon=False,
            fontsize=8.5,
        )
        file = BytesIO()
        figure.savefig(file, format=kind, dpi=160)
    return file.getvalue()


def _with_unlike(row: Row) -> Row:
    """With 1 − SSIM, which has more to tell than SSIM where pictures are good."""
    return {**row, "unlike": max(1 - row["ssim"], _LEAST_UNLIKE)}


def _varied(row: Row) -> str:
    """What is varied in a row of ours; empty where nothing is."""
    return _SEVERAL if len(row["varied"]) > 1 else "".join(row["varied"])


def _panel(axis: Axes, figure: str, rows: Sequence[Row]) -> list[Row]:
    """One figure of merit, "psnr" or "unlike", over the time of a frame; returns its front."""
    ours = [row for row in rows if "mode" in row]
    peers = [row for row in rows if row["renderer"] != "persp_sw"]
    best = [ours[n] for n in front([r["ms"] for r in ours], [r[figure] * _BETTER[figure] for r in ours])]
    axis.plot(
        [row["ms"] for row in best],
        [row[figure] for row in best],
        color=_INK,
        linewidth=7,
        alpha=0.15,
        solid_capstyle="round",
        solid_joinstyle="round",
        label="front: none is faster and better",
        zorder=1,
    )
    for colour, mode in zip(_COLOURS, dict.fromkeys(row["sampling"] for row in ours), strict=False):
        of_mode = sorted((row for row in ours if row["sampling"] == mode), key=lambda row: row["quality"])
        curve = [row for row in of_mode if not row["varied"]]
        axis.plot(
            [row["ms"] for row in curve],
            [row[figure] for row in curve],
            "o-",
            color=colour,
            markersize=3.5,
            linewidth=1.2,
            label=mode,
            zorder=3,
        )
        for row in of_mode:  # what is varied is shown where it is of use
            if row["varied"] and row in best:
                marker = _VARIED[_varied(row)]
                axis.plot(row["ms"], row[figure], marker, color=colour, markersize=6.5, mfc="white", zorder=4)
    if figure == "psnr":
        _name_qualities(axis, best)
        _draw_peers(axis, peers, rows)
        axis.set_ylabel("PSNR, dB")
    else:
        for row in peers:
            axis.plot(
                row["ms"], row[figure], _PEERS.get(row["renderer"], "*"), color=_INK, markersize=6, zorder=4
            )
        axis.set_yscale("log")
        axis.invert_yaxis()
        unlike = [row[figure] for row in rows]
        few = max(unlike) > 300 * min(unlike)
        axis.yaxis.set_major_locator(LogLocator(10, subs=(1,) if few else (1, 2, 5), numticks=9))
        axis.yaxis.set_major_formatter(FuncFormatter(lambda unlike, _: f"{1 - unlike:.7g}"))
        axis.yaxis.set_minor_formatter(NullFormatter())
        axis.set_ylabel("SSIM")
    axis.set_xscale("log")
    axis.xaxis.set_major_locator(LogLocator(10, subs=(1, 2, 5)))
    axis.xaxis.set_major_formatter(FuncFormatter(lambda ms, _: f"{ms:g}"))
    axis.xaxis.set_minor_formatter(NullFormatter())
    axis.margins(0.09, 0.1)
    axis.grid(True, which="major", color="#e4e4e4", linewidth=0.7)
    axis.set_axisbelow(True)
    axis.spines[["top", "right"]].set_visible(False)
    return best


def _two_digits(ratio: float) -> str:
    return f"{ratio:.2g}" if ratio < 99.5 else f"{float(f'{ratio:.2g}'):.0f}"


def _name_qualities(axis: Axes, best: Sequence[Row]) -> None:
    """The quality beside some points of the front."""
    named: list[Row] = []
    for n, row in enumerate(best):
        beside = any(abs(np.log(row["ms"] / other["ms"])) < 0.12 for other in named)
        again = any(
            (other["mode"], other["quality"]) == (row["sampling"], row["quality"]) for other in best[:n]
        )
        if row["quality"] in _NAMED and not beside and not again:
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
            "not reached" if figure["ratio"] is None else f"{_two_digits(figure['ratio'])} ×",
            (row["ms"], row["psnr"]),
            xytext=(-6, 4),
            textcoords="offset points",
            ha="right",
            fontsize=8,
            color=_INK,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.6},
            zorder=5,
        )
