"""`persp-sw movie`: a turntable or a flight, as a film or as numbered pictures."""

from __future__ import annotations

from typing import Any

import click
import numpy as np

from persp_sw.commands.options import (
    camera_options,
    json_option,
    look_options,
    open_scene,
    region_options,
    say_missing_voxels,
    setting_options,
    settings_for,
    volume_options,
)
from persp_sw.commands.output import print_facts, print_json, progress_bars

LAYOUTS = ("mono", "left", "right", "side_by_side", "top_bottom", "interlaced", "anaglyph")
_EPILOG = """\b
Examples:
  persp-sw movie head.nrrd -o head.mp4                        once around, 6 s
  persp-sw movie head.nrrd -o head.gif --turntable 90 --frames 24 --fps 12 --tilt 20
  persp-sw movie scene.toml -o vr.mp4 --stereo side_by_side --size 1920 1080
  persp-sw movie scene.toml -o pictures --quality 2           a folder: frame-00000.png …
  persp-sw movie scene.toml -o flight.webm --path flight.csv --constant-speed

\b
A flight is a CSV file, a row for each key view, whose first line names the columns
  seconds,eye_x,eye_y,eye_z,centre_x,centre_y,centre_z,up_x,up_y,up_z,fovy
(world units, fovy vertical in degrees), or JSON or TOML with a list `key` of tables with
seconds, eye, centre, up, fovy. `persp-sw view` records one: press F9, fly, press F9.
The camera passes through each key view, smoothly in place and direction.

The same scene gives the same frames, bit by bit. A film that is interrupted leaves no
file; of pictures, those that are finished stay.
"""


@click.command(epilog=_EPILOG)
@click.argument("scene", type=click.Path())
@click.option(
    "-o",
    "--out",
    type=click.Path(),
    help="Film to write: .mp4, .webm or .gif; without suffix a folder of PNG pictures. [default: NAME.mp4]",
)
@click.option(
    "--turntable",
    "degrees",
    type=float,
    metavar="DEGREES",
    help="Turn around the volume by so much, about --axis; from where all of it is seen all the time, where "
    "no --eye is given. [default: 360]",
)
@click.option(
    "--axis", type=float, nargs=3, metavar="X Y Z", help="Of the turntable, world. [default: up of the scene]"
)
@click.option("--tilt", type=float, default=0.0, metavar="DEGREES", help="Look down on the turntable.")
@click.option("--path", "flight_file", type=click.Path(), help="Fly along the key views of this file.")
@click.option(
    "--constant-speed", is_flag=True, help="With --path: the eye goes evenly; only the whole time is kept."
)
@click.option(
    "--frames",
    type=click.IntRange(1, 1_000_000),
    metavar="N",
    help="Frames of the film. [default: 6 s of a turntable, the seconds of a flight]",
)
@click.option("--fps", type=float, default=30.0, show_default=True, help="Frames a second.")
@click.option(
    "--stereo",
    type=click.Choice(LAYOUTS),
    default="mono",
    show_default=True,
    help="Layout of two eyes in a frame.",
)
@click.option(
    "--separation",
    type=click.FloatRange(0, 1),
    default=1 / 30,
    metavar="SHARE",
    help="Of the eyes, as a part of their distance from the centre. [default: 1/30]",
)
@click.option(
    "--crf", type=int, metavar="N", help="What the film may lose, 0 … 51. [default: 16 (.webm 18): not seen]"
)
@click.option(
    "--preintegrated/--point-samples",
    default=None,
    help="All values on a ray count, or only those at samples; by the transfer function where not said.",
)
@setting_options
@look_options
@camera_options
@region_options
@volume_options
@json_option
def movie(
    scene: str,
    out: str | None,
    degrees: float | None,
    axis: tuple[float, float, float] | None,
    tilt: float,
    flight_file: str | None,
    constant_speed: bool,
    frames: int | None,
    fps: float,
    stereo: str,
    separation: float,
    crf: int | None,
    preintegrated: bool | None,
    quality: float,
    samples: str | None,
    residual: float,
    threads: int | None,
    as_json: bool,
    **keys: Any,
) -> None:
    """Film SCENE, a scene file or any volume file: once around it, or along a flight.

    --size is that of the film; each eye's picture is half of it side by side and top-bottom. Films need
    ffmpeg, which the extra brings: pip install 'persp-sw[movie]'. A folder of pictures needs nothing.
    """
    import persp_sw as psw

    from ..cameras import Camera
    from ..film.files import film_file
    from ..film.filming import take_film
    from ..film.flight import FlightError
    from ..film.flight_file import load_flight
    from ..film.shots import Shot
    from ..film.turntable import far_enough, turntable
    from ..placement import corners_in_room

    if flight_file and (degrees is not None or axis or tilt):
        raise FlightError("--path is a flight, --turntable, --axis and --tilt are not: give one or the other")
    if constant_speed and not flight_file:
        raise FlightError("--constant-speed is of flights: give --path, or leave it out")
    with progress_bars() as progress:
        chosen = open_scene(scene, progress, **keys)
        path = out or f"{chosen.name}.mp4"
        file = film_file(path, chosen.size, fps, crf)
        settings = settings_for(chosen, quality, samples, residual, threads, preintegrated=preintegrated)
        if flight_file:
            flight = load_flight(flight_file)
            times = flight.times(frames or round(flight.duration * fps) + 1, constant_speed=constant_speed)
            cameras, parallel = [flight.at(seconds) for seconds in times], False
            near = 0.0
        else:
            view = chosen.view(0)
            parallel, near = view.eye.is_at_infinity, view.eye.near
            up = axis or chosen.keys.up or (0.0, 0.0, 1.0)
            turn = 360.0 if degrees is None else degrees
            count = frames or max(round(6 * fps), 1)

            def around(home: Camera) -> list[Camera]:
                return turntable(home, up, count, turn, tilt)

            home, volume = Camera.of_view(view), chosen.volume
            if chosen.keys.eye is None and not parallel:
                cameras = far_enough(home, around, corners_in_room(np.eye(4), volume), chosen.size)
            else:
                cameras = around(home)
        shot = Shot(chosen.size, stereo, separation, tuple(chosen.background), near, parallel)
        renderer = psw.Renderer(
            chosen.volume, chosen.transfer, settings, chosen.regions, progress, chosen.look
        )
        figures = take_film(renderer, shot, cameras, file, progress)
    say_missing_voxels(chosen.volume)
    values = {
        "name": chosen.name,
        "out": str(path),
        "frames": len(cameras),
        "fps": fps,
        "seconds": len(cameras) / fps,
        "size": chosen.size,
        "stereo": stereo,
        "quality": quality,
        **figures,
    }
    if as_json:
        print_json(values)
    else:
        _print(values)


def _print(values: dict[str, Any]) -> None:
    width, height = values["size"]
    print_facts(
        {
            "film": f"{values['out']}, {values['frames']} frames of {width} × {height} pixels, "
            f"{values['seconds']:.2f} s at {values['fps']:g} a second",
            "time": f"{values['ms']:.1f} ms a frame (composite {values['composite_ms']:.1f}, warp "
            f"{values['warp_ms']:.1f} an eye; file {values['file_ms']:.1f})",
        }
    )
