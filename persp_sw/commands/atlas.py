"""`persp-sw atlas`: the ways in which volume renderers fail, measured here beside their bounds."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

import click

from .. import images
from ..errors import SettingsError
from .options import json_option
from .output import console, plain, print_json, progress_bars

if TYPE_CHECKING:
    from ..measure.atlas.case import Case
    from ..measure.atlas.outcome import Outcome

_EPILOG = """\b
Examples:
  persp-sw atlas --list
  persp-sw atlas --quick -o quick
  persp-sw atlas --case eye-positions --case values
  persp-sw atlas --json > atlas.json

\b
Into DIR go atlas.html, atlas.md, atlas.json and a strip of pictures for each
finding that has one: ours, the reference, their difference. They are brought up
to date after every case, so an interrupted atlas leaves what it had found.

\b
Exit code: 0, also where a finding does not keep its bound; with --strict, 1
then. 1 where a case breaks off.
"""


@click.command(epilog=_EPILOG)
@click.option("--case", "names", multiple=True, metavar="NAME", help="Only this case. Repeatable.")
@click.option("--list", "only_list", is_flag=True, help="Name the cases and stop.")
@click.option("--quick", is_flag=True, help="Small volumes and pictures: under two minutes on two cores.")
@click.option("--strict", is_flag=True, help="Exit with 1 where a finding does not keep its bound.")
@click.option(
    "-o",
    "--out",
    type=click.Path(),
    default="persp-sw-atlas",
    show_default=True,
    metavar="DIR",
    help="Folder to write to.",
)
@json_option
def atlas(
    names: tuple[str, ...], only_list: bool, quick: bool, strict: bool, out: str, as_json: bool
) -> None:
    """Measure how the ways in which volume renderers fail show here: the stability atlas.

    Each case has metrics with bounds and verdicts, mostly beside those of a plain ray caster and of the
    single-axis perspective shear-warp of 2001.
    """
    from ..measure.atlas.catalogue import CASES  # numba loads here, not for --help

    if only_list:
        _print_cases(CASES, as_json)
        return
    cases = _chosen(CASES, names)
    folder = images.output_folder(out)

    from ..measure.atlas.case import Scale
    from ..measure.atlas.outcome import outcome_of
    from ..measure.atlas.page import report_of, write_page, write_pictures
    from ..measure.machine import describe_machine

    about: dict[str, Any] = {"quick": quick, "machine": plain(describe_machine())}
    outcomes, pictures, files = [], {}, []
    with progress_bars() as progress:
        for number, case in enumerate(cases):
            progress(number, len(cases), "cases")
            outcomes.append(outcome_of(case, Scale(quick), progress))
            pictures |= write_pictures(outcomes[-1], folder)
            files = write_page(outcomes, pictures, about, folder)
        progress(len(cases), len(cases), "cases")
    if as_json:
        print_json({**report_of(outcomes, pictures, about), "files": [str(path) for path in files]})
    else:
        _print_overview(outcomes)
        click.echo(f"\n{files[0]}")
    broken = any(outcome.fault for outcome in outcomes)
    if broken or (strict and not all(outcome.holds for outcome in outcomes)):
        raise click.exceptions.Exit(1)


def _chosen(cases: Sequence[Case], names: Sequence[str]) -> list[Case]:
    """The cases of these names in the catalogue's order; all where none is given."""
    known = [case.name for case in cases]
    for name in names:
        if name not in known:
            near = get_close_matches(name, known, 1)
            hint = f"did you mean {near[0]}?" if near else f"the cases are {', '.join(known)}"
            raise SettingsError(f"the atlas has no case {name!r}; {hint}")
    return [case for case in cases if case.name in names or not names]


def _print_cases(cases: Sequence[Case], as_json: bool) -> None:
    if as_json:
        print_json({"cases": [{"name": case.name, "title": case.title} for case in cases]})
        return
    width = max((len(case.name) for case in cases), default=0)
    for case in cases:
        click.echo(f"{case.name:<{width}}  {case.title}")


def _print_overview(outcomes: Sequence[Outcome]) -> None:
    from rich.padding import Padding
    from rich.table import Table
    from rich.text import Text

    from ..measure.atlas.page import overview

    table = Table(box=None, pad_edge=False)
    table.add_column("metric", overflow="fold")
    for name in ("value", "bound", "ray caster", "2001"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    before = ""
    for name, metric, *cells, verdict in overview(outcomes):
        if name != before:
            table.add_row(Text(name, "bold"))
        style = "green" if verdict == "holds" else "bold red"
        table.add_row(Padding(Text(metric), (0, 0, 0, 2)), *map(Text, cells), Text(verdict, style))
        before = name
    console().print(table)
