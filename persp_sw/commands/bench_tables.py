"""The benchmark's figures as tables for people."""

from __future__ import annotations

import click

from .tables import Columns, Row, milliseconds, number, print_table, ratio


def print_tables(result: Row) -> None:
    """All rows, and what the peers make of them."""
    machine = result["machine"]
    versions = ", ".join(f"{name} {number}" for name, number in machine["versions"].items())
    click.echo(f"{machine['processor']}, {machine['cores']} cores; {versions}\n")
    rows = result["rows"]
    good = [row for row in rows if "error" not in row]
    if any("switch" in row for row in good):
        print_table("what each part is worth", _ABLATION, good, heading="case")
    elif good:
        print_table("milliseconds a frame, work, memory, error", _MEASURED, good, heading="case")
    if result.get("equal_accuracy"):
        print_table("at equal accuracy", _EQUAL, result["equal_accuracy"], heading="case")
    for row in rows:
        if "error" in row:
            click.echo(click.style(f"{row['case']} {row['renderer']}: ", fg="red") + row["error"], err=True)


def print_chart(values: Row) -> None:
    """Where our best settings are, and how they compare with the peers."""
    for row in values["rows"]:
        row["front"] = "•" if row.get("on_front") else ""
    print_table("time against accuracy", _CHART, values["rows"], heading="case")
    if values["equal_accuracy"]:
        print_table(
            "at equal accuracy, between measured points",
            _CHART_EQUAL,
            values["equal_accuracy"],
            heading="case",
        )
    if values["textures"]:
        print_table(
            "texture formats, beside the software warp", _TEXTURES, values["textures"], heading="case"
        )
    for ladder in values["ladders"]:
        if ladder["file"] is None:
            click.echo(f"{ladder['case']}: no ladder was kept: {ladder['why_not']}")
            continue
        rungs = [{"case": ladder["case"], **rung} for rung in ladder["rungs"]]
        print_table("the ladder for steady frames", _LADDER, rungs, heading="case")
        click.echo(f"kept in {ladder['file']}")
    click.echo(f"the chart is {', '.join(values['files'])}")


def _who(row: Row) -> str:
    if row["renderer"] != "persp_sw":
        return row["renderer"]
    text = f"q {row['quality']:.3g}, {row['samples_per_interval']}" + " pre" * row["preintegrated"]
    if row["residual"] != 0.005:
        text += f", residual {row['residual']:g}"
    if "equal_to" in row:
        text += f" {'=' if row['reached'] else '<'} {row['equal_to']}"
    return text


_MEASURED: Columns = [
    ("who", _who),
    ("thr", lambda row: str(row["threads"])),
    ("ms", milliseconds("ms")),
    ("p95", milliseconds("ms_p95")),
    ("p99", milliseconds("ms_p99")),
    ("composite", milliseconds("composite_ms")),
    ("warp", milliseconds("warp_ms")),
    ("encode", milliseconds("encode_ms")),
    ("compile", milliseconds("compile_ms")),
    ("Msamples/s", number("samples_per_second", ".0f", 1e-6)),
    ("waste", number("waste", ".2f")),
    ("PSNR", number("psnr", ".1f")),
    ("covered", number("psnr_covered", ".1f")),
    ("mean error", number("mean_signed_error", "+.1e")),
    ("SSIM", number("ssim", ".4f")),
    ("runs MB", number("runs_bytes", ".1f", 1e-6)),
    ("peak MB", number("peak_bytes", ".0f", 1e-6)),
]
_EQUAL: Columns = [
    ("peer", lambda row: row["peer"]),
    ("thr", lambda row: str(row["threads"])),
    ("peer ms", milliseconds("peer_ms")),
    ("dB", number("peer_psnr", ".1f")),
    ("ours ms", milliseconds("ms")),
    ("dB", number("psnr", ".1f")),
    ("with", lambda row: f"quality {row['quality']:.3g}, {row['mode']}"),
    ("ratio", lambda row: ratio("ratio")(row) or "not reached"),
    ("at quality", number("plain_quality", "g")),
    ("ms", milliseconds("plain_ms")),
    ("dB", number("plain_psnr", ".1f")),
    ("ratio", ratio("plain_ratio")),
]
_ABLATION: Columns = [
    ("switch", lambda row: row["switch"]),
    ("thr", lambda row: str(row["threads"])),
    ("ms", milliseconds("ms")),
    ("time", ratio("time_ratio")),
    ("samples", ratio("sample_ratio")),
    ("waste", number("waste", ".2f")),
    ("PSNR", number("psnr", ".1f")),
    ("change dB", number("psnr_change", "+.2f")),
    ("runs MB", number("runs_bytes", ".1f", 1e-6)),
]
_CHART: Columns = [
    ("with", lambda row: f"q {row['quality']:.3g}, {row['mode']}" if "mode" in row else row["renderer"]),
    ("thr", lambda row: str(row["threads"])),
    ("ms", milliseconds("ms")),
    ("p95", milliseconds("ms_p95")),
    ("PSNR", number("psnr", ".1f")),
    ("covered", number("psnr_covered", ".1f")),
    ("mean error", number("mean_signed_error", "+.1e")),
    ("SSIM", number("ssim", ".4f")),
    ("front", lambda row: row["front"]),
]
_CHART_EQUAL: Columns = [
    ("peer", lambda row: row["renderer"]),
    ("thr", lambda row: str(row["threads"])),
    ("peer ms", milliseconds("ms")),
    ("dB", number("psnr", ".1f")),
    ("ours ms", milliseconds("equal_ms")),
    ("ratio", lambda row: ratio("ratio")(row) or "not reached"),
]
_TEXTURES: Columns = [
    ("texture", lambda row: row["texture"]),
    ("upload", milliseconds("upload_ms")),
    ("draw", milliseconds("draw_ms")),
    ("PSNR", number("psnr", ".1f")),
    ("largest error", number("max_error", ".1e")),
    ("OpenGL by", lambda row: row["gl"]),
]
_LADDER: Columns = [
    ("rung", lambda row: row["name"]),
    ("quality", lambda row: _span(row, "quality")),
    ("composite ms", lambda row: _span(row, "cost")),
    ("PSNR", lambda row: _span(row, "psnr")),
]


def _span(row: Row, name: str) -> str:
    return " … ".join(f"{row['points'][end][name]:.3g}" for end in (0, -1))
