"""The benchmark's figures as tables for people."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import click
from rich.box import SIMPLE
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from .output import console

Row = dict[str, Any]
Columns = Sequence[tuple[str, Callable[[Row], str]]]


def print_tables(result: Row) -> None:
    """All rows, and what the peers make of them."""
    machine = result["machine"]
    versions = ", ".join(f"{name} {number}" for name, number in machine["versions"].items())
    click.echo(f"{machine['processor']}, {machine['cores']} cores; {versions}\n")
    rows = result["rows"]
    good = [row for row in rows if "error" not in row]
    if any("switch" in row for row in good):
        _print("what each part is worth", _ABLATION, good)
    elif good:
        _print("milliseconds a frame, work, memory, error", _MEASURED, good)
    if result.get("equal_accuracy"):
        _print("at equal accuracy", _EQUAL, result["equal_accuracy"])
    for row in rows:
        if "error" in row:
            click.echo(click.style(f"{row['case']} {row['renderer']}: ", fg="red") + row["error"], err=True)


def print_chart(values: Row) -> None:
    """Where our best settings are, and how they compare with the peers."""
    for row in values["rows"]:
        row["front"] = "•" if row.get("on_front") else ""
    _print("time against accuracy", _CHART, values["rows"])
    if values["equal_accuracy"]:
        _print("at equal accuracy, between measured points", _CHART_EQUAL, values["equal_accuracy"])
    click.echo(f"the chart is {values['out']}")


def _print(title: str, columns: Columns, rows: Sequence[Row]) -> None:
    """A table with a heading for each case; as wide as it must be, for a cut figure is no figure."""
    table = Table(box=SIMPLE, title=title, title_justify="left", title_style="bold", pad_edge=False)
    table.padding = (0, 1, 0, 0)
    for number, (heading, _) in enumerate(columns):
        table.add_column(heading, justify="right" if number else "left", no_wrap=True)
    case = None
    for row in rows:
        if row["case"] != case:
            case = row["case"]
            table.add_row(Text(case, style="bold"))
        table.add_row("  " + columns[0][1](row), *(cell(row) for _, cell in columns[1:]))
    wide = console()
    wide.width = max(wide.width, Measurement.get(wide, wide.options.update(max_width=1000), table).maximum)
    wide.print(table, soft_wrap=True)


def _number(name: str, form: str, scale: float = 1.0) -> Callable[[Row], str]:
    """The cell of one figure; empty where a row does not have it."""
    return lambda row: "" if row.get(name) is None else format(row[name] * scale, form)


def _milliseconds(name: str) -> Callable[[Row], str]:
    """Three digits, so that 0.8 ms and 1200 ms are both told well."""

    def cell(row: Row) -> str:
        value = row.get(name)
        return "" if value is None else f"{value:.0f}" if value >= 100 else f"{value:.3g}"

    return cell


def _who(row: Row) -> str:
    if row["renderer"] != "persp_sw":
        return row["renderer"]
    text = f"q {row['quality']:.3g}, {row['samples_per_interval']}" + " pre" * row["preintegrated"]
    if row["residual"] != 0.005:
        text += f", residual {row['residual']:g}"
    if "equal_to" in row:
        text += f" {'=' if row['reached'] else '<'} {row['equal_to']}"
    return text


def _ratio(name: str) -> Callable[[Row], str]:
    return lambda row: "" if row.get(name) is None else f"{row[name]:.3g} ×"


_MEASURED: Columns = [
    ("who", _who),
    ("thr", lambda row: str(row["threads"])),
    ("ms", _milliseconds("ms")),
    ("p95", _milliseconds("ms_p95")),
    ("p99", _milliseconds("ms_p99")),
    ("composite", _milliseconds("composite_ms")),
    ("warp", _milliseconds("warp_ms")),
    ("encode", _milliseconds("encode_ms")),
    ("compile", _milliseconds("compile_ms")),
    ("Msamples/s", _number("samples_per_second", ".0f", 1e-6)),
    ("waste", _number("waste", ".2f")),
    ("PSNR", _number("psnr", ".1f")),
    ("covered", _number("psnr_covered", ".1f")),
    ("mean error", _number("mean_signed_error", "+.1e")),
    ("SSIM", _number("ssim", ".4f")),
    ("runs MB", _number("runs_bytes", ".1f", 1e-6)),
    ("peak MB", _number("peak_bytes", ".0f", 1e-6)),
]
_EQUAL: Columns = [
    ("peer", lambda row: row["peer"]),
    ("thr", lambda row: str(row["threads"])),
    ("peer ms", _milliseconds("peer_ms")),
    ("dB", _number("peer_psnr", ".1f")),
    ("ours ms", _milliseconds("ms")),
    ("dB", _number("psnr", ".1f")),
    ("with", lambda row: f"quality {row['quality']:.3g}, {row['mode']}"),
    ("ratio", lambda row: _ratio("ratio")(row) or "not reached"),
    ("at quality", _number("plain_quality", "g")),
    ("ms", _milliseconds("plain_ms")),
    ("dB", _number("plain_psnr", ".1f")),
    ("ratio", _ratio("plain_ratio")),
]
_ABLATION: Columns = [
    ("switch", lambda row: row["switch"]),
    ("thr", lambda row: str(row["threads"])),
    ("ms", _milliseconds("ms")),
    ("time", _ratio("time_ratio")),
    ("samples", _ratio("sample_ratio")),
    ("waste", _number("waste", ".2f")),
    ("PSNR", _number("psnr", ".1f")),
    ("change dB", _number("psnr_change", "+.2f")),
    ("runs MB", _number("runs_bytes", ".1f", 1e-6)),
]
_CHART: Columns = [
    ("with", lambda row: f"q {row['quality']:.3g}, {row['mode']}" if "mode" in row else row["renderer"]),
    ("thr", lambda row: str(row["threads"])),
    ("ms", _milliseconds("ms")),
    ("p95", _milliseconds("ms_p95")),
    ("PSNR", _number("psnr", ".1f")),
    ("covered", _number("psnr_covered", ".1f")),
    ("mean error", _number("mean_signed_error", "+.1e")),
    ("front", lambda row: row["front"]),
]
_CHART_EQUAL: Columns = [
    ("peer", lambda row: row["renderer"]),
    ("thr", lambda row: str(row["threads"])),
    ("peer ms", _milliseconds("ms")),
    ("dB", _number("psnr", ".1f")),
    ("ours ms", _milliseconds("equal_ms")),
    ("ratio", lambda row: _ratio("ratio")(row) or "not reached"),
]
