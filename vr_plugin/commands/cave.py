"""`persp-sw cave`: a rig, live or without a screen."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from persp_sw.commands.options import (
    json_option,
    look_options,
    mark_options,
    marks_of,
    open_scene,
    say_missing_voxels,
    setting_options,
    settings_for,
    tf_option,
    volume_options,
)
from persp_sw.commands.output import numbers, print_facts, print_json, progress_bars

if TYPE_CHECKING:
    import persp_sw as psw

    from ..cave.offscreen import Costs
    from ..cave.wall_marks import WallMarks
    from ..frame import Frame
    from ..loop import Loop
    from ..rig import Rig

_EPILOG = """\b
Examples:
  persp-sw cave configs/cave4.toml head.nrrd
  persp-sw cave configs/cave4.toml head.nrrd --offscreen --frames 120 --path head.csv.gz -o pictures
  persp-sw cave configs/powerwall.toml scene.json --machine left-node
  persp-sw cave kitware.pvx scene.json --unit m --offscreen --json

RIG is a rig file (.toml), or a wall file of ParaView, OpenCOVER, CalVR or VR Juggler. Each
wall's picture comes from one eye image for each eye, whatever the number of walls.

\b
Keys, with windows:
  Esc  end                 X  swap eyes              M  mono, and back
  + −  hold quality        0  let quality go again   V  put the volume back
A rig whose tracker is "mouse" moves the head by keys and mouse, too (persp-sw track --help).

With windows, quality follows the frame time (target_hz, min_quality, max_quality of the
rig's [quality]), and eye images are composited beside the display, which shows the newest one
from where the head is now; while the head rests, they are refined to full quality.

Offscreen, time is counted: frame i is at i / rate seconds of the recorded path, so a run can
be repeated. A frame 0 warms up; what is written is the last frame, or every K-th (--every).
"""


@click.command(epilog=_EPILOG)
@click.argument("rig", type=click.Path())
@click.argument("scene", type=click.Path())
@click.option("--offscreen", is_flag=True, help="No windows: write each wall's picture.")
@click.option("--frames", type=click.IntRange(1), metavar="N", help="Timed frames; offscreen 10 by default.")
@click.option("--path", "recording", type=click.Path(), help="Recorded head path, .csv or .csv.gz.")
@click.option(
    "--rate", type=click.FloatRange(1, 1000), help="Frames a second, of the path too; the rig's aim."
)
@click.option("--start", type=click.FloatRange(0), default=0.0, help="Seconds into the path to begin at.")
@click.option("--every", type=click.IntRange(1), metavar="K", help="Write every K-th frame, too.")
@click.option("--warp", type=click.Choice(["auto", "texture", "software"]), default="auto", show_default=True)
@click.option("--separate", is_flag=True, help="Also time every picture as a view of its own.")
@click.option("--reference", "judge", is_flag=True, help="Compare the last frame with the reference (slow).")
@click.option(
    "--adapt/--no-adapt",
    default=None,
    help="Quality follows the frame time, or stays at --quality; with windows it follows by default.",
)
@click.option("--in-turn", is_flag=True, help="Windows wait for compositing, instead of going on beside it.")
@click.option(
    "--slabs",
    type=click.IntRange(1, 8),
    default=1,
    show_default=True,
    help="With windows: depth slabs of eye images, for a head that moves on; 2 … 4 pay in fog.",
)
@click.option(
    "--trace", "trace_file", type=click.Path(), help="Record every frame; see persp-sw trace --help."
)
@click.option("--unit", metavar="mm|cm|m|in|ft", help="Of the lengths in another system's wall file.")
@click.option("--machine", metavar="NAME", help="Whose walls to show, of a rig of several machines.")
@click.option("--no-tracking", is_flag=True, help="The head rests, whatever the rig says.")
@click.option("-o", "--out", type=click.Path(), default=".", show_default=True, help="Folder for pictures.")
@tf_option
@setting_options
@look_options
@mark_options
@volume_options
@json_option
def cave(
    rig: str,
    scene: str,
    offscreen: bool,
    frames: int | None,
    recording: str | None,
    rate: float | None,
    start: float,
    every: int | None,
    warp: str,
    separate: bool,
    judge: bool,
    adapt: bool | None,
    in_turn: bool,
    slabs: int,
    trace_file: str | None,
    unit: str | None,
    machine: str | None,
    no_tracking: bool,
    out: str,
    quality: float,
    samples: str | None,
    residual: float,
    threads: int | None,
    as_json: bool,
    **keys: Any,
) -> None:
    """Show SCENE on all walls of RIG, for a tracked viewer, in stereo."""
    import persp_sw as psw

    from ..cave.wall_marks import WallMarks
    from ..formats.opening import open_rig
    from ..loop import Loop
    from ..pacing import controller_for
    from ..rigs.one_machine import rig_on_machine
    from ..trackers import open_tracker

    choice = marks_of(keys)
    if choice and judge:
        raise psw.PerspSWError("--reference judges pictures without marks: leave one of the two out")
    chosen = rig_on_machine(open_rig(rig, unit), machine, offscreen=offscreen)
    if recording:
        chosen = replace(chosen, tracker=chosen.tracker_for(recording))
    if no_tracking:
        chosen = replace(chosen, tracker=replace(chosen.tracker, kind="none"))
    folder = psw.images.output_folder(out) if offscreen else Path(out)
    with progress_bars() as progress:
        shown = open_scene(scene, progress, **keys)
        say_missing_voxels(shown.volume)
        if click.get_current_context().get_parameter_source("quality") is not ParameterSource.COMMANDLINE:
            quality = chosen.quality.quality
        settings = settings_for(shown, quality, samples, residual, threads)
        if not (offscreen or in_turn):  # else each image is shown to the eye it was made for
            settings = replace(settings, depth_slabs=slabs)
        renderer = psw.Renderer(shown.volume, shown.transfer, settings, shown.regions, progress, shown.look)
        tracker = open_tracker(
            chosen.tracker,
            rest_pose=chosen.eyes.rest_pose,
            folder="." if recording else Path(rig).parent,
            start=0.0 if offscreen else None,
        )
        rate = rate or chosen.quality.target_hz
        chosen = replace(chosen, quality=replace(chosen.quality, target_hz=rate))
        adapts = not offscreen if adapt is None else adapt
        controller = controller_for(renderer, chosen.quality, rate) if adapts else None
        loop = Loop(chosen, renderer, tracker, controller)
        try:
            marks = WallMarks(loop, choice, shown.background)
            with _trace(trace_file, chosen, scene, rate, settings) as trace:
                if not offscreen:
                    from ..cave.windows import run_windows

                    progress(1, 1, "starting")
                    values = run_windows(
                        loop, warp, shown.background, frames, in_turn=in_turn, trace=trace, marks=marks
                    )
                else:
                    values = _offscreen(
                        loop, chosen, warp, frames or 10, rate, start, every,
                        separate, judge, folder, Path(scene).stem, shown.background, trace, marks, progress,
                    )  # fmt: skip
        finally:
            loop.close()
    values = {"rig": chosen.name or Path(rig).stem, "scene": scene, **values}
    if as_json:
        print_json(values)
    else:
        _print(values)


def _trace(
    file: str | None, rig: Rig, scene: str, rate_hz: float, settings: psw.Settings
) -> AbstractContextManager[psw.TraceWriter | None]:
    """What takes the frames' records; nothing where nobody wants them."""
    import persp_sw as psw

    if file is None:
        return nullcontext()
    limits = {"min_quality": rig.quality.min_quality, "max_quality": rig.quality.max_quality}
    header = {"rig": rig.name, "scene": scene, "target_hz": rate_hz, **limits, "settings": settings}
    return psw.TraceWriter(file, header)


def _offscreen(
    loop: Loop,
    rig: Rig,
    warp: str,
    frames: int,
    rate_hz: float,
    start_s: float,
    every: int | None,
    separate: bool,
    judge: bool,
    folder: Path,
    name: str,
    background: Sequence[float],
    trace: psw.TraceWriter | None,
    marks: WallMarks,
    progress: Any,
) -> dict[str, Any]:
    import persp_sw as psw

    from ..cave import offscreen as cave_offscreen
    from ..cave.contact_sheet import contact_sheet
    from ..cave.wall_pictures import drawer

    def write(pictures: Any, number: int | None) -> dict[tuple[str, str], str]:
        tag = "" if number is None else f"-{number:05d}"
        return {
            (wall, eye): str(psw.images.write(folder / f"{name}-{wall}-{eye}{tag}.png", picture, background))
            for (wall, eye), picture in pictures.items()
        }

    def each(number: int, frame: Frame, drawn: Any) -> None:
        if every and number % every == 0:
            write(drawn.pictures, number)

    chosen = drawer(loop.renderer, warp, marks)
    try:
        costs, frame, drawn = cave_offscreen.run_offscreen(
            loop, chosen, frames, rate_hz=rate_hz, start_s=start_s, separate=separate, each=each,
            trace=trace, progress=progress,
        )  # fmt: skip
        written = write(drawn.pictures, None)
        sheet = psw.images.write_rgb(folder / f"{name}-sheet.png", contact_sheet(drawn.pictures, background))
        errors = cave_offscreen.errors(loop.renderer, frame, drawn, progress) if judge else {}
    finally:
        chosen.close()
    last = max(frame.statistics.values(), key=lambda s: s["samples"], default={})
    pictures = [
        {
            "wall": picture.wall.name,
            "eye": picture.eye,
            "pixels": list(picture.view.size),
            "warp_ms": _median(costs, picture.wall.name, picture.eye),
            "out": written[picture.wall.name, picture.eye],
            **errors.get((picture.wall.name, picture.eye), {}),
        }
        for picture in frame.pictures
    ]
    return {
        "warp": chosen.name,
        "walls": [wall.name for wall in rig.walls],
        **costs.report(),
        **{key: last.get(key) for key in ("threads", "faces", "intermediate_size", "runs_bytes")},
        "quality": frame.made.quality,
        "rate_hz": rate_hz,
        "head": frame.head.position.tolist(),
        "outside_frames": loop.outside.frames if loop.outside else 0,
        "edge_on_frames": loop.edge_on,
        "pictures": pictures,
        "sheet": str(sheet),
    }


def _median(costs: Costs, wall: str, eye: str) -> float:
    from statistics import median

    return median(costs.warp_ms.get((wall, eye), [0.0]))


def _print(values: dict[str, Any]) -> None:
    rows = {"rig": f"{values['rig']}: {', '.join(values['walls'])}"}
    what = "a frame" if "pictures" in values else "from frame to frame"  # a display's waits included
    rows["time"] = (
        f"{values['ms']:.1f} ms {what}, median of {values['timed_frames']} (composite "
        f"{values['composite_ms']:.1f}, upload {values['upload_ms']:.1f}, warp {values['warp_ms']:.1f}; "
        f"{values['warp']} warp)"
    )
    rows["compositings"] = f"{values['compositings_per_frame']} a frame"
    if "separate_ms" in values:
        ms, ratio = values["separate_ms"], values["separate_ratio"]
        rows["separately"] = f"{ms:.1f} ms, each picture by itself: {ratio:.1f} × as long"
    if values.get("missed_frames"):
        rows["missed"] = f"{values['missed_frames']} refreshes"
    if values.get("outside_frames"):
        rows["outside"] = f"an eye was outside the walls in {values['outside_frames']} frames"
    for picture in values.get("pictures", []):
        error = (
            f", largest error {picture['max_error']:.4f}, mean {picture['mean_error']:.5f}"
            if "max_error" in picture
            else ""
        )
        rows[f"{picture['wall']}, {picture['eye']}"] = (
            f"{picture['warp_ms']:.2f} ms, {numbers(picture['pixels'])} pixels{error}, {picture['out']}"
        )
    if "sheet" in values:
        rows["all of them"] = values["sheet"]
    print_facts(rows)
