"""`persp-sw view`: look around a volume in a window, in stereo, and at a room of walls from outside."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from statistics import median
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from click.core import ParameterSource

from persp_sw.commands.options import (
    NAMES,
    json_option,
    look_options,
    mark_options,
    marks_of,
    open_scene,
    region_options,
    say_missing_voxels,
    setting_options,
    settings_for,
    tf_option,
    volume_options,
    window_option,
)
from persp_sw.commands.output import numbers, print_facts, print_json, progress_bars

from ..rig import STEREO_MODES

if TYPE_CHECKING:
    from ..preview.controller import Preview
    from ..preview.laid_over import LaidOver
    from ..preview.pictures import PreviewPictures
    from ..preview.run import Run
    from ..window import Window

_EPILOG = """\b
Examples:
  persp-sw view head.nrrd
  persp-sw view scene.toml --stereo anaglyph
  persp-sw view head.nrrd --rig configs/cave4.toml --path walk.csv.gz --outside
  persp-sw view head.nrrd --shot-size 7680 4320 --shot-samples 2
  persp-sw view head-001.session.toml
  persp-sw view scene.toml --fly flight.csv
  persp-sw view head.nrrd --offscreen --frames 36 --turn 10 -o pictures

In a window quality follows the frame rate of --target, and goes up to the most while nothing
moves. A --quality that is given without --target is held until 0 is pressed.

\b
H or F1 in the window lists all keys: drag to orbit, wheel to zoom, F to fly with
W A S D, 1 to 8 for stereo, Tab for the room from outside, + and − to hold quality and 0 to
let it go again, F2 for the panel (transfer function, clipping, …), I to pick what is under the
pointer, B Y U L C for marks, P for a picture on disk, F5 for a session file, F9 to record a
flight and to end it, Esc to leave.
"""
_PATIENCE_SECONDS = 1.5  # a first picture that takes longer is explained


@click.command(epilog=_EPILOG)
@click.argument("scene", type=click.Path())
@click.option("--size", type=int, nargs=2, metavar="W H", help="Window size in pixels. [default: 960 720]")
@click.option(
    "--stereo",
    type=click.Choice(STEREO_MODES),
    help="Stereo mode to start with. [default: mono]",
)
@click.option(
    "--rig", "rig_file", type=click.Path(), help="Room of the outside view; by default a four-wall CAVE."
)
@click.option("--outside", is_flag=True, help="Start with the room from outside.")
@click.option("--panel", is_flag=True, help="Start with the panel, which F2 shows and hides.")
@click.option(
    "--path", "recording", type=click.Path(), help="Recorded head path in the room, .csv or .csv.gz."
)
@click.option(
    "--fly", "flight_file", type=click.Path(), help="Fly along a flight; see persp-sw movie --help."
)
@click.option(
    "--shot-size",
    type=click.IntRange(1, 16384),
    nargs=2,
    metavar="W H",
    help="Size of the pictures that P writes, rendered anew. [default: the window's]",
)
@click.option(
    "--shot-samples",
    type=click.IntRange(1, 8),
    default=1,
    show_default=True,
    help="Samples along each edge of such a picture's pixels.",
)
@click.option(
    "--shot-format",
    type=click.Choice(["png", "npy", "exr"]),
    default="png",
    show_default=True,
    help="Of such a picture.",
)
@click.option(
    "--warp",
    type=click.Choice(["auto", "texture", "software"]),
    default="auto",
    show_default=True,
    help="Who draws the eye images: OpenGL or the processor.",
)
@click.option(
    "--target",
    "target_hz",
    type=float,
    metavar="HZ",
    help="Frames a second to make room for by quality; 0: quality stays. [default: 30; offscreen 0]",
)
@click.option("--offscreen", is_flag=True, help="No window: write frames into the folder of -o.")
@click.option("--frames", type=int, metavar="N", help="Leave after N frames; offscreen 1 by default.")
@click.option("--press", "keys_pressed", metavar="KEYS", help="Press keys at the start, as 'TAB 8 O'.")
@click.option(
    "--turn", type=float, default=0.0, metavar="DEGREES", help="Orbit by so much from frame to frame."
)
@click.option(
    "--trace", "trace_file", type=click.Path(), help="Record every frame; see persp-sw trace --help."
)
@click.option("-o", "--out", type=click.Path(), default=".", show_default=True, help="Folder for pictures.")
@tf_option
@window_option
@setting_options
@look_options
@region_options
@mark_options
@volume_options
@json_option
def view(
    scene: str,
    size: tuple[int, int] | None,
    stereo: str | None,
    rig_file: str | None,
    outside: bool,
    panel: bool,
    recording: str | None,
    flight_file: str | None,
    shot_size: tuple[int, int] | None,
    shot_samples: int,
    shot_format: str,
    warp: str,
    target_hz: float | None,
    offscreen: bool,
    frames: int | None,
    keys_pressed: str | None,
    turn: float,
    trace_file: str | None,
    out: str,
    quality: float,
    samples: str | None,
    residual: float,
    threads: int | None,
    as_json: bool,
    **keys: Any,
) -> None:
    """Look around SCENE, a scene file or any volume file, in a window, in mono or stereo.

    Tab shows a room of walls, such as a CAVE, from outside: the pictures on its walls as the tracked head
    sees them, the head, its eyes, and the volume.
    """
    import persp_sw as psw

    from ..film.flight_file import load_flight
    from ..preview.keepsakes import Keepsakes
    from ..preview.recorder import TARGET_HZ, recorder_to
    from ..preview.run import FRAME_SECONDS, run_offscreen
    from ..preview.session import PreviewError, open_preview, press

    if not offscreen:
        check_display()
    if frames is not None and frames < 1:
        raise PreviewError(f"--frames is at least 1; given {frames}")
    marks = marks_of(keys)
    folder = psw.images.output_folder(out)
    source = click.get_current_context().get_parameter_source("quality")
    held = target_hz is None and source is ParameterSource.COMMANDLINE
    if target_hz is None:
        target_hz = 0.0 if offscreen else TARGET_HZ
    with progress_bars() as progress:
        chosen = open_scene(scene, progress, **keys)
        settings = settings_for(chosen, quality, samples, residual, threads)
        preview, pictures = open_preview(
            chosen,
            settings,
            size=size,
            stereo=stereo,
            rig_file=rig_file,
            recording=recording,
            presets=NAMES,
            target_hz=target_hz,
            held=held,
            flight=load_flight(flight_file) if flight_file else None,
            marks=marks,
            progress=progress,
        )
        press(preview, "TAB " * outside + "F2 " * panel + (keys_pressed or ""))
        with patience():
            first = pictures.composite(preview.advance(-FRAME_SECONDS))
        say_missing_voxels(chosen.volume)
        recording_to = recorder_to(trace_file, scene, settings, pictures.target_hz, preview.rig.quality)
        anew = shot_size or (preview.size if (shot_samples, shot_format) != (1, "png") else None)
        kept = {"size": anew, "samples": shot_samples, "suffix": f".{shot_format}"}
        keepsakes = Keepsakes(preview, pictures, folder, chosen.name, chosen, **kept)
        if anew:
            psw.images.check_output(folder / f"shot.{shot_format}")
        common = {"folder": folder, "name": chosen.name, "turn": np.radians(turn), "warp": warp}
        common["keepsakes"] = keepsakes
        if offscreen:
            with recording_to as recorder:
                done = run_offscreen(
                    preview, pictures, frames=frames or 1, recorder=recorder, progress=progress, **common
                )
    if not offscreen:
        from ..preview.in_window import run_window

        with recording_to as recorder:
            done = run_window(
                preview,
                pictures,
                frames=frames,
                recorder=recorder,
                open_panel=partial(open_panel, preview=preview, pictures=pictures),
                **common,
            )
    keepsakes.finish()
    values = report(done, chosen.name, first.statistics)
    if as_json:
        print_json(values)
    else:
        _print(values)


def open_panel(window: Window, preview: Preview, pictures: PreviewPictures) -> LaidOver:
    """The panel over a window; MissingPackageError without its package, which nobody else needs."""
    from ..panel.frontend import Panel

    return Panel(window, preview, pictures)


def check_display() -> None:
    """PreviewError where there is no screen to open a window on."""
    from ..preview.session import PreviewError

    screens = ("DISPLAY", "WAYLAND_DISPLAY")
    if sys.platform.startswith("linux") and not any(os.environ.get(name) for name in screens):
        raise PreviewError(
            "there is no screen for a window (neither DISPLAY nor WAYLAND_DISPLAY is set): write a picture "
            "with `persp-sw render`, or frames of this preview with --offscreen"
        )


@contextmanager
def patience() -> Iterator[None]:
    """Say on stderr what a user waits for, if it takes long."""
    what = "preparing the first picture; a first start also compiles"
    timer = threading.Timer(_PATIENCE_SECONDS, lambda: click.echo(what, err=True))
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def report(done: Run, name: str, first: Mapping[str, Any]) -> dict[str, Any]:
    """The keys of --json: medians over all frames but the first, and the last one's counts."""
    rows = done.frames
    timed = rows[1:] or rows
    times = (
        {key: median(row[key] for row in timed) for key in ("ms", "composite_ms", "upload_ms", "warp_ms")}
        if timed
        else {}
    )
    last = (
        {} if not rows else {key: value for key, value in rows[-1].items() if key not in (*times, "picture")}
    )
    return {
        "name": name,
        "frames": len(rows),
        **last,
        **times,
        "encode_ms": first["encode_ms"],
        "compile_ms": first["compile_ms"],
        "pictures": [row["picture"] for row in rows if "picture" in row],
        "screenshots": done.screenshots,
    }


def _print(values: dict[str, Any]) -> None:
    from ..preview.figures import quality_line

    if not values["frames"]:
        return
    facts = {
        "frames": f"{values['frames']}, median {values['ms']:.1f} ms (composite "
        f"{values['composite_ms']:.1f}, {values['warp']} warp {values['warp_ms']:.1f})",
        "eye images": f"{values['compositings']} a frame, {numbers(values['intermediate_size'])} pixels, "
        f"{values['samples']:,} samples",
    }
    if values["target_hz"]:
        facts["quality"] = quality_line(values)
    files = values["pictures"] + values["screenshots"]
    if files:
        facts["pictures"] = files[0] if len(files) == 1 else f"{files[0]} … {files[-1]}, {len(files)} of them"
    print_facts(facts)
