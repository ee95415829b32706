"""`persp-sw papers`: a paper's own experiments, with this renderer, beside what the paper prints."""

from __future__ import annotations

from pathlib import Path

import click

from ..errors import SettingsError
from .choose_cases import threads_chosen
from .options import json_option
from .output import print_json, progress_bars

_EPILOG = """\b
Examples:
  persp-sw papers schulze2001 --quick
  persp-sw papers schulze2001 --data volumes
  persp-sw papers schulze2001 --json > schulze2001.json

\b
`persp-sw papers PAPER --help` explains each.
"""
_SCHULZE2001_EPILOG = """\b
Examples:
  persp-sw papers schulze2001 --quick
  persp-sw papers schulze2001 --data volumes --seconds 3
  persp-sw papers schulze2001 --json > schulze2001.json

\b
Figure 5, tables 2 to 4 and section 4.5, each in the paper's layout: its figures,
ours, and how far ours are from a float64 reference, which is cast once and kept.
What the paper leaves open, and what was assumed, stands below each table.
"""


@click.group(epilog=_EPILOG, invoke_without_command=True)
@click.pass_context
def papers(ctx: click.Context) -> None:
    """Repeat a paper's own experiments, beside what it prints."""
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())


@papers.command(
    epilog=_SCHULZE2001_EPILOG,
    short_help="Perspective shear-warp in a virtual environment: all of section 4.",
)
@click.option(
    "--data",
    type=click.Path(),
    help="Folder of real volumes, engine and brainsmall; made-up ones stand in. [default: $PERSP_SW_DATA]",
)
@click.option("--cache", type=click.Path(), help="Folder to keep reference pictures in.")
@click.option("--seconds", type=float, help="Timed for each row. [default: 1]")
@click.option(
    "--threads",
    type=click.IntRange(1),
    help="In section 4.5; all cores by default. The tables take one, as the paper did.",
)
@click.option("--quick", is_flag=True, help="All sizes a quarter of the paper's, and little time.")
@json_option
def schulze2001(
    data: str | None,
    cache: str | None,
    seconds: float | None,
    threads: int | None,
    quick: bool,
    as_json: bool,
) -> None:
    """Schulze, Niemeier, Lang: the perspective shear-warp algorithm in a virtual environment, 2001.

    The tables' times are ours on this machine beside the paper's on its two, 1.4 GHz and 195 MHz.
    """
    seconds = (0.05 if quick else 1.0) if seconds is None else seconds
    if not 0 < seconds <= 600:
        raise SettingsError(f"--seconds lies between 0 and 600; given {seconds:g}")
    from .._jit import max_threads
    from ..measure.cases import data_folder
    from ..measure.machine import describe_machine
    from ..measure.papers import schulze2001 as experiments
    from ..measure.papers import schulze2001_printed as printed
    from ..measure.papers.painter import SoftwareWarp
    from ..measure.papers.texture import texture_warp
    from ..measure.truth import Truths, default_cache

    count = threads_chosen([threads])[-1] if threads else max_threads()
    folder = data_folder(data)
    truths = Truths(Path(cache) if cache else default_cache())
    with progress_bars() as progress, texture_warp() as (texture, about):
        warps = [*([texture] if texture else []), SoftwareWarp()]
        sizes = experiments.QUICK if quick else experiments.FULL
        laboratory = experiments.Laboratory(
            folder, warps, about.get("missing", ""), truths, sizes, seconds, count
        )
        result = {
            "paper": printed.TITLE,
            "systems": printed.SYSTEMS,
            "machine": describe_machine(),
            "opengl": about,
            "seconds": seconds,
            "share_of_sizes": sizes.share,
            "assumed": printed.ASSUMED,
            **laboratory.run(progress),
        }
    if as_json:
        print_json(result)
    else:
        from .papers_tables import print_schulze2001

        print_schulze2001(result)
