"""A paper's tables in its own layout, ours beside its figures."""

from __future__ import annotations

from collections.abc import Callable
from textwrap import fill
from typing import Any

import click

from ..measure.papers import schulze2001_printed as printed
from .tables import Columns, Row, milliseconds, number, print_table

_BAR = 32  # characters for the longest time


def print_schulze2001(result: Row) -> None:
    """All of `schulze2001`, in the paper's order."""
    _print_conditions(result)
    longest = max(row.get("ms", 0.0) for row in result["figure5"])
    rows = [{**row, "bar": "█" * round(_BAR * row.get("ms", 0.0) / longest)} for row in result["figure5"]]
    _print(printed.FIGURE5, _FIGURE5, rows, left=4)
    edges = " and ".join(map(str, printed.FIGURE5["jumps"]))
    _note(
        f"The paper: a curve, whose values its text does not give, with jumps at {edges} pixels: "
        f"“{printed.FIGURE5['words']}”"
    )
    _assumed(result, "figure5", "engine", "all")
    rows = [part for row in result["table2"] for part in _ratio_and_parts(row)]
    _print(printed.TABLE2, _TABLE2, rows, left=3)
    _assumed(result, "table2")
    _print(printed.TABLE3, _TABLE3, result["table3"])
    _assumed(result, "table3")
    _print(printed.TABLE4, _TABLE4, result["table4"])
    _assumed(result, "table4")
    _print(printed.CUBE, _CUBE, result["cube"], left=3)
    _note(f"The paper: “{printed.CUBE['words']}”")
    _assumed(result, "cube")


def _print(paper: Row, columns: Columns, rows: list[Row], **layout: Any) -> None:
    caption = paper["caption"].rstrip(".")
    print_table(f"{caption} (section {paper['section']})", columns, rows, **layout)


def _print_conditions(result: Row) -> None:
    """Which machines, volumes and sizes."""
    click.echo(click.style(result["paper"], bold=True))
    for name, what in result["systems"].items():
        click.echo(f"  {name}, 2001: {what}")
    machine = result["machine"]
    versions = ", ".join(f"{name} {number_}" for name, number_ in machine["versions"].items())
    load = "" if machine["load"] is None else f", load before {machine['load']}"
    click.echo(f"  here: {machine['processor']}, {machine['cores']} cores{load}; {versions}")
    opengl = result["opengl"]
    click.echo(f"  texture warp: {opengl.get('missing') or opengl['renderer'] + ', ' + opengl['precision']}")
    for name, volume in result["volumes"].items():
        size = " × ".join(map(str, volume["size"]))
        stands_in = ", made up, for there is no such file; see --data" if volume["made_up"] else ""
        click.echo(f"  {name}: {volume['name']}, {size} voxels{stands_in}")
    if result["share_of_sizes"] != 1:
        text = f"Sizes are {result['share_of_sizes']:g} of the paper's: a look, not its experiments."
        click.echo(click.style(f"  {text}", fg="yellow"))
    click.echo("")


def _note(text: str, first: str = "  ") -> None:
    click.echo(fill(text, 108, initial_indent=first, subsequent_indent=" " * len(first)))


def _assumed(result: Row, *topics: str) -> None:
    """What was assumed for a table, below it."""
    click.echo("  Assumed:")
    for topic in topics:
        for text in result["assumed"][topic]:
            _note(text, "  - ")
    click.echo("")


def _ratio_and_parts(row: Row) -> list[Row]:
    """The paper's row, and one for each projection with its error."""
    if "missing" in row:
        return [row]
    return [row, *({**row[name], "part": name} for name in ("perspective", "parallel"))]


def _paper(system: str, form: str = "g") -> Callable[[Row], str]:
    """The paper's figure for one of its machines."""
    return lambda row: format(row["paper"][system], form) if system in row.get("paper", {}) else ""


def _here(cell: Callable[[Row], str]) -> Callable[[Row], str]:
    """Ours, or that there is none."""
    return lambda row: "no OpenGL here" if "missing" in row else cell(row)


def _square(row: Row) -> str:
    return f"{row['output']}²"


def _intermediate(row: Row) -> str:
    """What was asked for."""
    if "edge" not in row:
        return ""
    return f"{row['edge']}²" if row["edge"] else "1 pixel a voxel"


def _size(row: Row) -> str:
    """What it became: our images have two sides."""
    return "×".join(map(str, row["intermediate_size"])) if "intermediate_size" in row else ""


def _sampling(row: Row) -> str:
    """How rays were sampled."""
    if "missing" in row:
        return ""
    return f"{row['samples_per_interval']}" + ", pre-integrated" * row["preintegrated"]


_ERRORS: Columns = [
    ("PSNR", number("psnr", ".1f")),
    ("covered", number("psnr_covered", ".1f")),
    ("mean error", number("mean_signed_error", "+.1e")),
    ("max error", number("max_error", ".3f")),
]
_FIGURE5: Columns = [
    ("warp", lambda row: row["warp"]),
    ("samples a slice", _sampling),
    ("edge", lambda row: str(row.get("edge", "no OpenGL here"))),
    ("", lambda row: row["bar"]),
    ("ms", milliseconds("ms")),
    ("least", milliseconds("ms_min")),
    ("composite", milliseconds("composite_ms")),
    ("warp", milliseconds("warp_ms")),
    ("image", _size),
    *_ERRORS,
]
_TABLE2: Columns = [
    ("", lambda row: f"  {row['part']}" if "part" in row else "Perspective : parallel projection"),
    ("warp", lambda row: "" if "part" in row else row["warp"]),
    ("intermediate", _intermediate),
    ("PC", _paper("PC")),
    ("Onyx2", _paper("Onyx2")),
    ("here", _here(number("ratio", ".2f"))),
    ("ms", milliseconds("ms")),
    ("least", milliseconds("ms_min")),
    ("image", _size),
    *_ERRORS,
]
_TABLE3: Columns = [
    ("Warp type", lambda row: row["warp"].capitalize()),
    ("Output image size", _square),
    ("PC [ms]", _paper("PC")),
    ("Onyx2 [ms]", _paper("Onyx2")),
    ("here [ms]", _here(milliseconds("warp_ms"))),
    ("p95", milliseconds("warp_ms_p95")),
    ("image", _size),
    *_ERRORS,
]
_TABLE4: Columns = [
    ("Warp type", lambda row: row["warp"].capitalize()),
    ("Output image size", _square),
    ("PC", _paper("PC")),
    ("Onyx2", _paper("Onyx2")),
    ("here", _here(number("ratio", ".3g"))),
    ("composite", milliseconds("composite_ms")),
    ("warp", milliseconds("warp_ms")),
    ("image", _size),
    *_ERRORS,
]
_CUBE: Columns = [
    ("warp", lambda row: row["warp"]),
    ("samples a slice", _sampling),
    ("intermediate", _intermediate),
    ("threads", lambda row: str(row.get("threads", ""))),
    ("Onyx2 [1/s]", _paper("Onyx2")),
    ("here [1/s]", _here(number("rate_hz", ".3g"))),
    ("ms", milliseconds("ms")),
    ("least", milliseconds("ms_min")),
    ("composite", milliseconds("composite_ms")),
    ("warp", milliseconds("warp_ms")),
    ("image", _size),
    *_ERRORS,
]
