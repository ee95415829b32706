"""`persp-sw chart`: milliseconds against PSNR, for our settings and for other renderers."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import click

from ..errors import FileError, MissingPackageError, SettingsError
from .bench_tables import print_chart
from .choose_cases import case_options, chosen_cases, peer_option, threads_chosen
from .options import json_option
from .output import print_json, progress_bars

_SUFFIXES = (".png", ".svg", ".pdf")
_EPILOG = """\b
Examples:
  persp-sw chart
  persp-sw chart scene.json -o chart.svg
  persp-sw chart --volume engine --peer vtk -o engine.png
  persp-sw chart --volume ct256 --function surface --quality 1 --quality 2 --json

\b
A curve for each way to sample along the ray; its points are qualities. The broad
grey line is the best of ours: nothing measured is both faster and more accurate.
From each peer an arrow leads to our time at its accuracy.
"""


@click.command(epilog=_EPILOG)
@click.argument("scenes", nargs=-1, metavar="[SCENE|FILE]...", type=click.Path())
@case_options
@click.option("--threads", type=click.IntRange(1), help="2 by default, where there are so many.")
@click.option("--quality", "qualities", multiple=True, type=float, help="0.35 … 4 by default. Repeatable.")
@click.option("--seconds", type=float, default=0.4, show_default=True, help="Timed for each point.")
@peer_option
@click.option(
    "-o", "--out", type=click.Path(), default="chart.png", show_default=True, help=".png, .svg or .pdf."
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
    path = _picture_file(out)
    if not 0 < seconds <= 600:
        raise SettingsError(f"--seconds lies between 0 and 600; given {seconds:g}")
    if not scenes:
        choice["looks"] = choice["looks"] or ("front",)
        choice["sizes"] = choice["sizes"] or (512,)
        choice["volumes"] = choice["volumes"] or ("ct128",)
    cases = chosen_cases(scenes, **choice)
    count = threads_chosen([threads] if threads else [])[-1]

    from ..measure.bench import Plan
    from ..measure.chart import QUALITIES, figures, points_of
    from ..measure.machine import describe_machine
    from ..measure.peers import peers_named
    from ..measure.plot import draw
    from ..measure.truth import Truths, default_cache
    from ..settings import Settings

    group = peers_named(peers, [count])
    panels = []
    try:
        with progress_bars() as progress:
            truths = Truths(Path(cache) if cache else default_cache())
            plan = Plan([Settings(threads=count)], truths, seconds, group, progress=progress)
            for number, case in enumerate(cases):
                progress(number, len(cases), "cases")
                panels.append(points_of(case, plan, qualities or QUALITIES))
            draw(panels, path)
    finally:
        for peer in group:
            peer.close()
    rows = [row for panel in panels for row in panel]
    equal = [figure for panel in panels for figure in figures(panel)]
    values = {"machine": describe_machine(), "out": str(path), "rows": rows, "equal_accuracy": equal}
    if as_json:
        print_json(values)
    else:
        print_chart(values)


def _picture_file(out: str) -> Path:
    """The picture to write, tried before anything is measured."""
    path = Path(out)
    if path.suffix.lower() not in _SUFFIXES:
        raise FileError(f"a chart is written as {', '.join(_SUFFIXES)}; given {out!r}")
    if importlib.util.find_spec("matplotlib") is None:
        raise MissingPackageError("chart needs the package matplotlib: pip install 'persp-sw[bench]'")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.open("a").close()
    except OSError as error:
        raise FileError(f"cannot write {path}: {error.strerror}; choose another file with -o") from None
    return path
