"""`persp-sw chart`: milliseconds against accuracy, for our settings and for others; and the ladder."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import FileError, MissingPackageError, SettingsError
from .bench_tables import print_chart
from .choose_cases import case_options, chosen_cases, peer_option, threads_chosen
from .options import json_option
from .output import plain, print_json, progress_bars, try_to_write

if TYPE_CHECKING:
    from ..measure.chart import Chart
    from ..settings import Settings

_SUFFIXES = (".png", ".svg", ".pdf")
_REACH = 0.5, 2.0  # qualities that a ladder must have to be of use
_EPILOG = """\b
Examples:
  persp-sw chart
  persp-sw chart scene.json -o scene.png
  persp-sw chart --volume engine --function surface --peer vtk -o engine
  persp-sw chart --volume ct256 --function surface --quality 1 --quality 2 --json

\b
What is measured:
  1. samples on a ray (1, 2, 4, pre-integrated) × quality: all, a curve each;
  2. for what is on or near the front by then, one after the other: levels of
     detail, when a ray stops (residual);
  3. texture formats' upload, drawing and error, where there is OpenGL.
The broad grey line is the front: no other setting is both faster and more
accurate. From each peer an arrow leads to our time at its accuracy.

\b
The ladder that a frame-time controller walks is made of the compositing times
and kept in $XDG_DATA_HOME/persp_sw/ladders, for this processor, these threads,
this volume, transfer function and look (lit or not, how many lights). Several
views of them make one ladder. None is kept where --quality does not reach from 0.5 to 2.
"""


@click.command(epilog=_EPILOG)
@click.argument("scenes", nargs=-1, metavar="[SCENE|FILE]...", type=click.Path())
@case_options
@click.option("--threads", type=click.IntRange(1), help="All by default, as in a CAVE.")
@click.option("--quality", "qualities", multiple=True, type=float, help="0.25 … 4 by default. Repeatable.")
@click.option("--seconds", type=float, default=0.4, show_default=True, help="Timed for each point.")
@peer_option
@click.option(
    "-o",
    "--out",
    type=click.Path(),
    default="chart",
    show_default=True,
    help="Name of the files, suffix or not: NAME.png, NAME.svg, NAME.json, and NAME.pdf if asked for.",
)
@json_option
def chart(
    scenes: tuple[str, ...],
    threads: int | None,
    qualities: tuple[float, ...],
    seconds: float,
    peers: tuple[str, ...],
    out: str,
    as_json: bool,
    cache: str | None,
    **choice: Any,
) -> None:
    """Draw time against accuracy for scenes, volume files or fixed cases.

    Without SCENE: the three transfer functions on a volume of the data folder, or on a made-up one, from the
    front at 512 × 512.
    """
    files = _output_files(out)
    if not 0 < seconds <= 600:
        raise SettingsError(f"--seconds lies between 0 and 600; given {seconds:g}")
    if not scenes:
        choice["looks"] = choice["looks"] or ("front",)
        choice["sizes"] = choice["sizes"] or (512,)
        choice["volumes"] = choice["volumes"] or ("ct128",)
    cases = chosen_cases(scenes, **choice)

    from .._jit import max_threads
    from ..measure.bench import Plan
    from ..measure.chart import QUALITIES, chart_of, figures
    from ..measure.machine import describe_machine
    from ..measure.peers import peers_named
    from ..measure.plot import draw
    from ..measure.truth import Truths, default_cache
    from ..settings import Settings

    (count,) = threads_chosen([threads or max_threads()])
    base = Settings(threads=count)
    group = peers_named(peers, [count])
    qualities = [replace(base, quality=quality).quality for quality in qualities or QUALITIES]
    charts = []
    try:
        with progress_bars() as progress:
            truths = Truths(Path(cache) if cache else default_cache())
            plan = Plan([base], truths, seconds, group, progress=progress)
            for number, case in enumerate(cases):
                progress(number, len(cases), "cases")
                charts.append(chart_of(case, plan, qualities))
    finally:
        for peer in group:
            peer.close()
    values = {
        "machine": describe_machine(),
        "files": [str(path) for path in files],
        "rows": [row for chart in charts for row in chart.rows],
        "equal_accuracy": [figure for chart in charts for figure in figures(chart.rows)],
        "textures": [{"case": chart.rows[0]["case"], **row} for chart in charts for row in chart.textures],
        "ladders": _save_ladders(charts, base, qualities),
    }
    text = json.dumps(plain(values), ensure_ascii=False, indent=1) + "\n"
    contents = {path: text.encode() for path in files if path.suffix == ".json"}
    drawn = (path for path in files if path not in contents)
    contents |= {path: draw([chart.rows for chart in charts], path.suffix[1:]) for path in drawn}
    for path, content in contents.items():  # a run that broke off before has left files as they were
        path.write_bytes(content)
    if as_json:
        print_json(values)
    else:
        print_chart(values)


def _save_ladders(
    charts: Sequence[Chart], base: Settings, qualities: Sequence[float]
) -> list[dict[str, Any]]:
    """Keep a ladder for each volume and function; for each the file, or why there is none."""
    from ..measure.chart import ladder_of
    from ..quality.saved_ladder import save_ladder

    by_volume: dict[str, list[Chart]] = {}
    for chart in charts:
        by_volume.setdefault(chart.volume, []).append(chart)
    reports = []
    for volume, views in by_volume.items():
        report: dict[str, Any] = {"case": " + ".join(chart.rows[0]["case"] for chart in views), "file": None}
        report["volume"] = volume
        try:
            if min(qualities) > _REACH[0] or max(qualities) < _REACH[1]:
                raise SettingsError("its qualities do not reach from {:g} to {:g}".format(*_REACH))
            ladder = ladder_of(views, base)
            report["rungs"] = [asdict(replace(rung, changes=dict(rung.changes))) for rung in ladder.rungs]
            report["file"] = str(save_ladder(ladder))
        except (SettingsError, FileError) as error:
            report["why_not"] = str(error)
        reports.append(report)
    return reports


def _output_files(out: str) -> list[Path]:
    """The files to write, tried before anything is measured."""
    given = Path(out)
    suffix = given.suffix.lower()
    if suffix not in (*_SUFFIXES, ".json", ""):
        raise FileError(f"a chart is written as {', '.join(_SUFFIXES)} and .json; given {out!r}")
    if importlib.util.find_spec("matplotlib") is None:
        raise MissingPackageError("chart needs the package matplotlib: pip install 'persp-sw[bench]'")
    files = [given.with_suffix(s) for s in (".png", ".svg", *([".pdf"] if suffix == ".pdf" else []), ".json")]
    for path in files:
        try_to_write(path)
    return files
