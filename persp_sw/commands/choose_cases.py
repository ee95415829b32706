"""Which cases `bench` and `chart` measure: scene files, volume files, or the fixed ones."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import click

from ..errors import PerspSWError, SettingsError
from ..measure.cases import FUNCTIONS, LOOKS, Case, Stage, data_folder, default_volumes, fixed_cases
from ..scene import Scene
from .options import open_scene

Function = TypeVar("Function", bound=Callable[..., Any])

_OPTIONS = [
    click.option("--match", metavar="REGEX", help="Only cases whose name it is found in."),
    click.option(
        "--volume",
        "volumes",
        multiple=True,
        metavar="NAME",
        help="Volume of the fixed cases: a name in the data folder, ctN (made up, N³), a file; @N resamples. "
        "Repeatable.",
    ),
    click.option("--function", "functions", multiple=True, type=click.Choice(FUNCTIONS), help="Repeatable."),
    click.option("--view", "looks", multiple=True, type=click.Choice(LOOKS), help="Repeatable."),
    click.option(
        "--size", "sizes", multiple=True, type=click.IntRange(16, 8192), help="Pictures' edge. Repeatable."
    ),
    click.option("--data", type=click.Path(), help="Folder of real volumes. [default: $PERSP_SW_DATA]"),
    click.option("--cache", type=click.Path(), help="Folder to keep reference pictures in."),
]
peer_option = click.option(
    "--peer",
    "peers",
    multiple=True,
    type=click.Choice(["vtk", "vtk-fixed", "vtk-fixed-2px", "vtk-gpu"]),
    help="Measure VTK on the same cases too: both mappers, or one. Repeatable.",
)


def case_options(function: Function) -> Function:
    """Options that choose cases."""
    for option in reversed(_OPTIONS):
        function = option(function)
    return function


def chosen_cases(
    scenes: Sequence[str],
    *,
    match: str | None,
    volumes: Sequence[str],
    functions: Sequence[str],
    looks: Sequence[str],
    sizes: Sequence[int],
    data: str | None,
) -> list[Case]:
    """The cases of `scenes`, or else the fixed ones; PerspSWError where none is left."""
    if scenes:
        if volumes or functions or looks:
            raise PerspSWError(
                "--volume, --function and --view choose fixed cases; leave them out with SCENE"
            )
        cases = [scene_case(path, size) for path in scenes for size in (sizes or [None])]
    else:
        folder = data_folder(data)
        cases = fixed_cases(
            volumes or default_volumes(folder),
            folder,
            functions or FUNCTIONS,
            looks or LOOKS,
            sizes or (512, 1024),
        )
    try:
        kept = [case for case in cases if not match or re.search(match, case.name)]
    except re.error as error:
        raise PerspSWError(f"--match {match!r} is no regular expression: {error}") from None
    if not kept:
        raise PerspSWError(f"no case matches {match!r}; there are {', '.join(c.name for c in cases[:8])} …")
    return kept


def scene_case(path: str, edge: int | None = None) -> Case:
    """The case of a scene file or a volume file; its keys are checked now, its volume is read later."""
    scene = open_scene(path, lambda done, total, what: None, **({"size": (edge, edge)} if edge else {}))
    name = f"{scene.name}-{edge}" if edge else scene.name
    return Case(name, Path(str(scene.keys.volume)).name, "scene", "scene", scene.size, lambda: _stage(scene))


def threads_chosen(given: Sequence[int]) -> list[int]:
    """The given numbers of threads, or 1 and all up to 2."""
    from .._jit import max_threads

    wrong = [count for count in given if count > max_threads()]
    if wrong:
        raise SettingsError(f"threads lies between 1 and {max_threads()}; given {wrong[0]}")
    return list(dict.fromkeys(given or [1, min(2, max_threads())]))


def _stage(scene: Scene) -> Stage:
    views = scene.views()
    return Stage(
        scene.volume,
        scene.transfer,
        views if scene.animated else [views[0], views[0]],
        scene.regions,
        scene.look,
    )
