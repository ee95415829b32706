"""`persp-sw trace`: how steady a recorded session was, as figures and as a picture."""

from __future__ import annotations

import importlib.util
import logging
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import FileError, MissingPackageError
from .options import json_option
from .output import print_json

if TYPE_CHECKING:
    from ..measure.trace_reading import Trace

_SUFFIXES = (".png", ".svg", ".pdf")
_PICTURE = "trace.png"
_NEEDS = "the picture of a trace needs the package matplotlib: pip install 'persp-sw[bench]'"
_EPILOG = """\b
Examples:
  persp-sw cave configs/cave4.toml head.nrrd --trace run.jsonl.gz    record a session
  persp-sw trace run.jsonl.gz                                     figures, and trace.png
  persp-sw trace before.jsonl after.jsonl -o compare.svg          side by side
  persp-sw trace run.jsonl.gz --json                              for programs, no picture

\b
The picture, from above, over the session's seconds:
  frame    milliseconds; the line is the median, the pale area goes from the least to
           the most, so that no spike is lost; the green band is the target ± 10 %;
           red ticks are refreshes of the display that had no new picture
  stages   what each took, their means stacked, and the budget of compositing
  quality  what the controller chose, its limits, the rungs of its ladder
  latency  from the tracker's stamp to the end of the swap; the eye image's age

\b
A trace is a text file: a line of JSON that tells what the session was, then one a frame.
"""


@click.command(epilog=_EPILOG)
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=click.Path())
@click.option(
    "-o",
    "--out",
    metavar="PICTURE",
    type=click.Path(),
    help=f".png, .svg or .pdf; {_PICTURE} by default, with --json none.",
)
@json_option
def trace(files: tuple[str, ...], out: str | None, as_json: bool) -> None:
    """Tell how steady a session was, from the trace that `--trace FILE` recorded.

    Prints the share of frames in time, percentiles, missed frames, how quality moved and the latency, and
    draws them over time. Several traces stand side by side.
    """
    picture = _picture_file(out, as_json)

    from ..measure.trace_reading import read_trace
    from ..measure.trace_summary import summary

    traces = [read_trace(file) for file in files]
    summaries = [summary(one) for one in traces]
    if picture is not None:
        _draw(traces, picture)
    if as_json:
        rows = [
            {"file": file, "header": one.header, "cut": one.cut, **figures}
            for file, one, figures in zip(files, traces, summaries, strict=True)
        ]
        print_json({"out": None if picture is None else str(picture), "traces": rows})
    else:
        _print(files, traces, summaries)
        if picture is not None:
            click.echo(f"the picture is {picture}")


def _picture_file(out: str | None, as_json: bool) -> Path | None:
    """The picture to write, as far as can be told before anything is read; None: none."""
    if out is None and as_json:
        return None
    path = Path(out or _PICTURE)
    if path.suffix.lower() not in _SUFFIXES:
        raise FileError(f"a trace is drawn as {', '.join(_SUFFIXES)}; given {out!r}")
    if importlib.util.find_spec("matplotlib") is None:
        if out is None:
            logging.getLogger("persp_sw").warning(_NEEDS)
            return None
        raise MissingPackageError(_NEEDS)
    return path


def _draw(traces: Sequence[Trace], path: Path) -> None:
    from ..measure.trace_plot import draw

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        draw(traces, path)
    except OSError as error:
        raise FileError(
            f"cannot write {path}: {error.strerror or error}; choose another file with -o"
        ) from None


def _print(files: Sequence[str], traces: Sequence[Trace], summaries: Sequence[dict[str, Any]]) -> None:
    """A line for each figure that any of the traces has, a column for each trace."""
    from .tables import print_table

    often = Counter(one.name for one in traces)
    names = [file if often[one.name] > 1 else one.name for file, one in zip(files, traces, strict=True)]
    rows: list[dict[str, Any]] = []
    for label, cell in _FIGURES:
        row: dict[str, Any] = {"label": label}
        row |= {str(number): cell(figures) for number, figures in enumerate(summaries)}
        if any(list(row.values())[1:]):
            rows.append(row)

    def column(number: int) -> Callable[[dict[str, Any]], str]:
        return lambda row: row[str(number)]

    columns = [("", lambda row: row["label"]), *((name, column(number)) for number, name in enumerate(names))]
    print_table("how steady", columns, rows)


def _percent(name: str) -> Callable[[dict[str, Any]], str]:
    return lambda figures: "" if figures[name] is None else f"{100 * figures[name]:.1f} %"


def _several(form: str, *names: str) -> Callable[[dict[str, Any]], str]:
    """Figures beside each other; none where the first is unknown."""

    def cell(figures: dict[str, Any]) -> str:
        values = [figures[name] for name in names]
        return "" if values[0] is None else ", ".join(format(value, form) for value in values)

    return cell


_SHARES = ("p50", "p95", "p99")
_FIGURES: tuple[tuple[str, Callable[[dict[str, Any]], str]], ...] = (
    ("frames", _several("d", "frames")),
    ("seconds", _several(".1f", "seconds")),
    ("frames a second", _several(".1f", "hz")),
    ("target, ms", _several(".2f", "target_ms")),
    ("within ± 10 % of it", _percent("within")),
    ("… of frames at no limit of quality", _percent("within_free")),
    ("frame, ms: p50, p95, p99, most", _several(".1f", *(f"frame_ms_{p}" for p in (*_SHARES, "max")))),
    ("frame over target: p50, p95, p99", _several(".2f", *(f"of_target_{p}" for p in _SHARES))),
    ("… without single frames' noise", _several(".2f", *(f"running_{p}" for p in _SHARES))),
    ("compositing within ± 10 % of budget", _percent("within_budget")),
    ("refreshes missed, most in a row", _several("d", "missed", "missed_most")),
    ("quality: least, median, most", _several(".2f", "quality_least", "quality_median", "quality_most")),
    ("at no limit of quality", _percent("free")),
    ("largest step of quality, factor", _several(".3f", "quality_step")),
    ("mean (Δ ln quality)²", _several(".2g", "quality_energy")),
    ("changes of rung", _several("d", "rung_changes")),
    ("latency, ms: p50, p95, p99", _several(".1f", *(f"latency_ms_{p}" for p in _SHARES))),
    ("re-warped", _percent("rewarped")),
    ("at rest, refined", _percent("refined")),
)
