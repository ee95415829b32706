"""`persp-sw warmup`: compile, or load, all that a first picture would wait for."""

from __future__ import annotations

from contextlib import suppress
from time import perf_counter
from typing import TYPE_CHECKING, Any

import click

from ..arrays import VOXEL_DTYPES
from ..errors import ViewError
from .options import json_option
from .output import print_facts, print_json, progress_bars

if TYPE_CHECKING:
    from ..optics.look import Look

_EPILOG = """\b
Examples:
  persp-sw warmup
  persp-sw warmup --type uint8 --lit --reference
  persp-sw warmup --json

\b
Compiled kernels are kept on disk, for this version of the sources and this
processor; a second warmup only loads them.
"""
_TYPES = [dtype.name for dtype in VOXEL_DTYPES]
_EDGE = 24  # voxels: small, yet with empty blocks


@click.command(epilog=_EPILOG)
@click.option("--type", "types", multiple=True, type=click.Choice(_TYPES), help="Only these. Repeatable.")
@click.option("--lit", is_flag=True, help="Lit pictures and shadows too.")
@click.option("--reference", "judge", is_flag=True, help="The reference ray caster and its figures too.")
@json_option
def warmup(types: tuple[str, ...], lit: bool, judge: bool, as_json: bool) -> None:
    """Compile the kernels that a normal run needs, so that the first picture later is quick.

    It renders small made-up volumes of each voxel type: see-through and opaque, from outside, from a corner
    and from inside.
    """
    start = perf_counter()
    from .. import _jit

    compiled = _jit.compile_seconds()
    steps: list[dict[str, Any]] = [{"what": "start numba", "ms": 1e3 * (perf_counter() - start)}]
    names = list(dict.fromkeys(types or _TYPES))
    with progress_bars() as progress:
        for number, name in enumerate(names):
            progress(number, len(names) + judge, "kernels")
            steps.append(_timed(f"{name} volumes", lambda name=name: _render(name)))
            if lit:
                steps.append(_timed(f"lit {name} volumes", lambda name=name: _render_lit(name)))
        if judge:
            progress(len(names), len(names) + 1, "kernels")
            steps.append(_timed("reference", lambda: _judge(lit)))
        progress(len(names) + judge, len(names) + judge, "kernels")
    values = {
        "ms": 1e3 * (perf_counter() - start),
        "compile_ms": 1e3 * (_jit.compile_seconds() - compiled),
        "steps": steps,
    }
    if as_json:
        print_json(values)
        return
    print_facts({step["what"]: f"{step['ms'] / 1e3:.2f} s" for step in steps})
    compiled = values["compile_ms"] / 1e3
    click.echo(
        f"\nready in {values['ms'] / 1e3:.1f} s"
        + (f", {compiled:.1f} s of it compiling" if compiled else "; nothing had to be compiled")
    )


def _timed(what: str, work: Any) -> dict[str, Any]:
    start = perf_counter()
    work()
    return {"what": what, "ms": 1e3 * (perf_counter() - start)}


def _render(name: str) -> None:
    """One sample an interval and several, one face and several; from inside too."""
    from ..measure.cases import eye_path, transfer_for
    from ..probe import Probe
    from ..renderer import Renderer
    from ..settings import Settings
    from ..volume.phantoms import synthetic_ct

    volume = synthetic_ct(_EDGE, dtype=name)
    renderer = Renderer(volume, transfer_for("ct", "fog", volume))
    for function in ("fog", "surface"):
        renderer.transfer = transfer_for("ct", function, volume)
        for look in ("front", "corner", "inside"):
            view = eye_path(volume, look, (48, 48), frames=0)[0]
            for samples in (None, 4):
                renderer.settings = Settings(samples_per_interval=samples)
                with suppress(ViewError):  # an eye inside, where that is refused, needs no kernel
                    renderer.render(view)
    probe = Probe.of(renderer)  # marks and picks
    probe.in_front(view.eye, volume.centre)
    probe.pick(view, (24.0, 24.0))


def _render_lit(name: str) -> None:
    """Plain samples and pre-integrated ones, on slices and between, with a light that casts shadows."""
    from ..measure.cases import eye_path, transfer_for
    from ..renderer import Renderer
    from ..settings import Settings
    from ..volume.phantoms import synthetic_ct

    volume = synthetic_ct(_EDGE, dtype=name)
    renderer = Renderer(volume, transfer_for("ct", "surface", volume), look=_lit())
    view = eye_path(volume, "corner", (48, 48), frames=0)[0]
    for preintegrated in (False, True):
        renderer.settings = Settings(preintegrated=preintegrated)
        renderer.render(view)


def _lit() -> Look:
    from ..optics.lighting import Light, Lighting
    from ..optics.look import Look

    return Look(Lighting(lights=(Light((1, 2, 3), shadows=True),)))


def _judge(lit: bool) -> None:
    from .. import reference
    from ..measure.cases import eye_path, transfer_for
    from ..measure.metrics import compare
    from ..volume.phantoms import synthetic_ct

    volume = synthetic_ct(_EDGE)
    transfer = transfer_for("ct", "ramp", volume)
    view = eye_path(volume, "front", (16, 16), frames=0)[0]
    truth = reference.render(volume, transfer, view, tolerance=1e-3)
    compare(truth, truth)
    if lit:
        view = eye_path(volume, "front", (4, 4), frames=0)[0]
        reference.render(volume, transfer, view, look=_lit(), tolerance=1e-2)
