"""Tables for people: a column is its heading and how a row fills it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from rich.box import SIMPLE
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from .output import console

Row = dict[str, Any]
Columns = Sequence[tuple[str, Callable[[Row], str]]]


def print_table(title: str, columns: Columns, rows: Sequence[Row], heading: str = "", left: int = 1) -> None:
    """A table as wide as it must be, for a cut figure is no figure.

    Parameters
    ----------
    heading
        A value of the rows: where it changes, it stands on a line of its own and the rows are indented.
    left
        So many columns are flush left; figures are flush right.
    """
    table = Table(box=SIMPLE, title=title, title_justify="left", title_style="bold", pad_edge=False)
    table.padding = (0, 1, 0, 0)
    for place, (name, _) in enumerate(columns):
        table.add_column(Text(name), justify="left" if place < left else "right", no_wrap=True)
    before = None
    for row in rows:
        if heading and row[heading] != before:
            before = row[heading]
            table.add_row(Text(before, style="bold"))
        first = "  " * bool(heading) + columns[0][1](row)
        table.add_row(*map(Text, [first, *(cell(row) for _, cell in columns[1:])]))  # Text: "[" is no markup
    wide = console()
    wide.width = max(wide.width, Measurement.get(wide, wide.options.update(max_width=1000), table).maximum)
    wide.print(table, soft_wrap=True)


def number(name: str, form: str, scale: float = 1.0) -> Callable[[Row], str]:
    """The cell of one figure; empty where a row does not have it."""
    return lambda row: "" if row.get(name) is None else format(row[name] * scale, form)


def milliseconds(name: str) -> Callable[[Row], str]:
    """Three digits, so that 0.8 ms and 1200 ms are both told well."""

    def cell(row: Row) -> str:
        value = row.get(name)
        return "" if value is None else f"{value:.0f}" if value >= 100 else f"{value:.3g}"

    return cell


def ratio(name: str) -> Callable[[Row], str]:
    """How many times; empty where a row does not have it."""
    return lambda row: "" if row.get(name) is None else f"{row[name]:.3g} ×"
