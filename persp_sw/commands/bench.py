"""`persp-sw bench`: time, work, memory and error of fixed cases, beside other renderers."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import click

from ..errors import PerspSWError, SettingsError
from .choose_cases import case_options, chosen_cases, peer_option, threads_chosen
from .options import json_option
from .output import plain, print_json, progress_bars, try_to_write

_EPILOG = """\b
Examples:
  persp-sw bench --quick
  persp-sw bench --data volumes --peer vtk -o results.json
  persp-sw bench --volume engine --volume ct512 --size 1024 --threads 2
  persp-sw bench --match 'ct256-surface' --quality 1 --quality 2 --quality 4
  persp-sw bench --ablate --volume ct256 --size 512
  persp-sw bench scene.json head.nrrd --peer vtk-fixed

\b
All contestants of a case are timed in turn on the same short path of the eye.
`ms` is the whole frame, compositing and warp on the processor; encoding and
compilation are apart. Errors are to a float64 reference, which is cast once and
kept. `waste` is samples taken over samples that were needed. Memory is the
largest resident size of the process while it drew a frame, volume included.
At equal accuracy: our time at the quality whose PSNR is the peer's.
"""


@click.command(epilog=_EPILOG)
@click.argument("scenes", nargs=-1, metavar="[SCENE]...", type=click.Path())
@case_options
@click.option(
    "--threads", "counts", multiple=True, type=click.IntRange(1), help="1 and 2 by default. Repeatable."
)
@click.option("--quality", "qualities", multiple=True, type=float, help="1 by default. Repeatable.")
@click.option(
    "--samples", type=click.Choice(["1", "2", "4"]), help="From slice to slice; automatic by default."
)
@click.option("--seconds", type=float, help="Timed for each contestant of a case. [default: 1]")
@peer_option
@click.option("--ablate", is_flag=True, help="Switch parts of the renderer off, one at a time.")
@click.option("--quick", is_flag=True, help="A made-up 128³ volume, small pictures, little time.")
@click.option("-o", "--out", type=click.Path(), help="JSON file, written anew after each case.")
@json_option
def bench(
    scenes: tuple[str, ...],
    counts: tuple[int, ...],
    qualities: tuple[float, ...],
    samples: str | None,
    seconds: float | None,
    peers: tuple[str, ...],
    ablate: bool,
    quick: bool,
    out: str | None,
    as_json: bool,
    cache: str | None,
    **choice: Any,
) -> None:
    """Measure time, work, memory and error of fixed cases, or of SCENE files.

    Without SCENE the cases are all combinations of volumes (those of the data folder, and a made-up one), the
    transfer functions fog, ramp and surface, the views front, corner and inside, and sizes 512 and 1024.
    """
    from ..settings import Settings

    if quick:
        choice["volumes"] = choice["volumes"] or (() if scenes else ("ct128",))
        choice["looks"] = choice["looks"] or (() if scenes else ("front", "inside"))
        choice["sizes"] = choice["sizes"] or (256,)
        seconds = seconds or 0.2
    seconds = 1.0 if seconds is None else seconds
    if not 0 < seconds <= 600:
        raise SettingsError(f"--seconds lies between 0 and 600; given {seconds:g}")
    if ablate and peers:
        raise PerspSWError("--ablate compares the renderer with itself; leave --peer out")
    path = None if out is None else Path(out)
    if path is not None:
        try_to_write(path)
    cases = chosen_cases(scenes, **choice)
    threads = threads_chosen(counts)
    settings = [
        Settings(quality=q, samples_per_interval=int(samples) if samples else None, threads=t)
        for t in threads
        for q in qualities or (1.0,)
    ]
    result, interrupted = _measure(cases, settings, threads, seconds, peers, ablate, cache, path)
    if as_json:
        print_json(result)
    else:
        from .bench_tables import print_tables

        print_tables(result)
    if interrupted:
        raise KeyboardInterrupt


def _measure(
    cases: Sequence[Any],
    settings: Sequence[Any],
    threads: Sequence[int],
    seconds: float,
    peer_names: Sequence[str],
    ablate: bool,
    cache: str | None,
    out: Path | None,
) -> tuple[dict[str, Any], bool]:
    """All rows, and whether Ctrl-C came before the last; then those of the cases that were done."""
    from ..measure.ablation import ablate as ablate_case
    from ..measure.bench import Plan, compare_at_equal_accuracy, measure
    from ..measure.machine import describe_machine
    from ..measure.peers import peers_named
    from ..measure.truth import Truths, default_cache

    peers = peers_named(peer_names, threads)
    rows: list[dict[str, Any]] = []
    result: dict[str, Any] = {"machine": describe_machine(), "seconds": seconds, "rows": rows}
    interrupted = False
    try:
        with progress_bars() as progress:
            truths = Truths(Path(cache) if cache else default_cache())
            plan = Plan(settings, truths, seconds, peers, progress)
            for number, case in enumerate(cases):
                progress(number, len(cases), "cases")
                if ablate:
                    for count in threads:
                        rows += ablate_case(case, plan_with(plan, count))
                else:
                    rows += measure(case, plan)
                    result["equal_accuracy"] = compare_at_equal_accuracy(rows)
                if out:
                    _write(out, result)
            progress(len(cases), len(cases), "cases")
    except KeyboardInterrupt:
        interrupted = True
    finally:
        for peer in peers:
            with suppress(OSError):
                peer.close()
    result["interrupted"] = interrupted
    if out:
        _write(out, result)
    return result, interrupted


def plan_with(plan: Any, threads: int) -> Any:
    """The plan for one number of threads."""
    from dataclasses import replace

    return replace(plan, settings=[s for s in plan.settings if s.threads == threads])


def _write(path: Path, result: dict[str, Any]) -> None:
    path.write_text(json.dumps(plain(result), indent=1, ensure_ascii=False, allow_nan=False) + "\n")
