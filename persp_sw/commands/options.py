"""Options that several commands share, and the scene they make."""

from __future__ import annotations

import logging
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from ..errors import ViewError
from ..optics.presets import NAMES
from ..scene import Scene
from ..volume.grid import Volume
from .output import ProgressCall

if TYPE_CHECKING:
    from ..marks import MarkChoice
    from ..settings import Settings

Function = TypeVar("Function", bound=Callable[..., Any])

_VOLUME_OPTIONS = [
    click.option(
        "--spacing", type=float, nargs=3, metavar="X Y Z", help="Voxel spacing; the file's pose is dropped."
    ),
    click.option("--frame", "time_frame", type=int, metavar="N", help="Frame of a 4D file, from 0."),
    click.option("--component", metavar="N|magnitude", help="Component of a multi-component file, from 0."),
    click.option("--series", metavar="N|UID", help="Series of a DICOM folder, from 1."),
    click.option("--shape", type=int, nargs=3, metavar="X Y Z", help="Raw files: voxels along x, y and z."),
    click.option("--dtype", metavar="TYPE", help="Raw files: uint8, int16, uint16, float32, …"),
    click.option("--byte-order", type=click.Choice(["little", "big"]), help="Raw files; little by default."),
    click.option("--header-bytes", type=int, metavar="N", help="Raw files: bytes to leave out at the start."),
]
tf_option = click.option(
    "--preset",
    "--tf",
    "tf",
    metavar="NAME|FILE",
    help="Transfer function: a preset or a saved one; chosen from the values by default.",
)
window_option = click.option(
    "--window",
    type=float,
    nargs=2,
    metavar="LEVEL WIDTH",
    help="Window and level: a grey ramp over these values, instead of a transfer function.",
)
_MARK_OPTIONS = [
    click.option("--box", is_flag=True, help="Show the volume's bounding box."),
    click.option("--axes", is_flag=True, help="Show its axes and, of a patient, the letters L R A P S I."),
    click.option("--scale-bar", is_flag=True, help="Show a scale bar, as deep as the pivot."),
    click.option("--legend", is_flag=True, help="Show the transfer function's colours and values."),
    click.option("--cursor", type=float, nargs=3, metavar="X Y Z", help="Show a 3D cursor there, world."),
    click.option("--planes", is_flag=True, help="The cursor with planes."),
    click.option(
        "--ruler", type=float, nargs=6, metavar="X Y Z X Y Z", help="Show the distance of two points, world."
    ),
]
_CAMERA_OPTIONS = [
    tf_option,
    window_option,
    click.option("--size", type=int, nargs=2, metavar="W H", help="Picture size in pixels."),
    click.option("--eye", type=float, nargs=3, metavar="X Y Z", help="Where the eye stands, world."),
    click.option("--centre", type=float, nargs=3, metavar="X Y Z", help="The point in the middle, world."),
    click.option("--up", type=float, nargs=3, metavar="X Y Z", help="What points upwards."),
    click.option("--fovy", type=float, metavar="DEGREES", help="Vertical opening angle."),
    click.option(
        "--parallel",
        "parallel_height",
        type=float,
        metavar="H",
        help="Parallel projection, H high in world.",
    ),
    click.option("--background", type=float, nargs=3, metavar="R G B", help="Linear colour behind, 0 … 1."),
]
_VIEW_OPTIONS = [
    *_CAMERA_OPTIONS,
    click.option("--frames", type=int, metavar="N", help="Frames to time."),
]
_REGION_OPTIONS = [
    click.option("--crop", type=float, nargs=6, metavar="X0 X1 Y0 Y1 Z0 Z1", help="Crop box, voxel index."),
    click.option(
        "--crop-flags",
        metavar="NAME|N",
        help="Which of the 27 regions that the crop's planes make: 27 bits, or subvolume (the box), fence, "
        "inverted_fence, cross, inverted_cross.",
    ),
    click.option(
        "--clip",
        type=float,
        nargs=4,
        multiple=True,
        metavar="A B C D",
        help="Show where A x + B y + C z + D ≥ 0, world; may be repeated.",
    ),
    click.option(
        "--cut",
        type=(float, float, float, float, float, click.Choice(["inside", "outside"])),
        multiple=True,
        metavar="A B C D T inside|outside",
        help="Show only what is inside, or outside, a slab T thick around a plane; may be repeated.",
    ),
]
_LIGHT_NUMBERS = ("ambient", "diffuse", "specular", "power")
_LOOK_OPTIONS = [
    click.option("--shade/--no-shade", default=None, help="Lit, or not; any light that is given lights it."),
    click.option(
        "--light",
        "lights",
        type=float,
        nargs=3,
        multiple=True,
        metavar="X Y Z",
        help="A light in this direction, world, besides the headlight; may be repeated.",
    ),
    click.option(
        "--shadows", is_flag=True, default=None, help="The lights cast shadows; the headlight none."
    ),
    click.option("--ambient", type=float, metavar="A", help="Light from everywhere. [default: 0.2]"),
    click.option(
        "--diffuse", type=float, metavar="D", help="Of a light, what surfaces spread. [default: 0.8]"
    ),
    click.option("--specular", type=float, metavar="S", help="Of a light, what they mirror. [default: 0.3]"),
    click.option("--power", type=float, metavar="P", help="Of highlights: more is smaller. [default: 20]"),
    click.option(
        "--modulate",
        type=float,
        metavar="OPACITY",
        help="How much of the opacity is the gradient's, 0 … 1: boundaries instead of what they enclose.",
    ),
]
_SETTING_OPTIONS = [
    click.option(
        "--quality", type=float, default=1.0, show_default=True, help="Sharpness of the eye image, 0.05 … 8."
    ),
    click.option(
        "--samples",
        type=click.Choice(["1", "2", "4"]),
        help="Samples from slice to slice; by default 1, pre-integrated where one can hide more than half.",
    ),
    click.option(
        "--residual", type=float, default=0.005, show_default=True, help="Rays stop at this transparency."
    ),
    click.option("--threads", type=int, metavar="N", help="Threads; all cores by default."),
]

warp_option = click.option(
    "--warp",
    type=click.Choice(["auto", "texture", "software"]),
    default="auto",
    show_default=True,
    help="What draws the eye image: OpenGL, the processor, or whichever is faster here.",
)


def volume_options(function: Function) -> Function:
    """Which volume of a file, and how to read a raw one."""
    return _decorated(function, _VOLUME_OPTIONS)


def camera_options(function: Function) -> Function:
    """How it looks and from where; over the scene file's keys."""
    return _decorated(function, _CAMERA_OPTIONS)


def view_options(function: Function) -> Function:
    """The same, and how often."""
    return _decorated(function, _VIEW_OPTIONS)


def region_options(function: Function) -> Function:
    """Which part is shown; over the scene file's keys."""
    return _decorated(function, _REGION_OPTIONS)


def look_options(function: Function) -> Function:
    """Lights, shadows and modulation; over the scene file's keys."""
    return _decorated(function, _LOOK_OPTIONS)


def setting_options(function: Function) -> Function:
    """Speed and accuracy."""
    return _decorated(function, _SETTING_OPTIONS)


def mark_options(function: Function) -> Function:
    """Marks in the picture; `marks_of` takes them."""
    return _decorated(function, _MARK_OPTIONS)


def marks_of(keys: dict[str, Any]) -> MarkChoice:
    """The choice of `mark_options`, which are taken out of `keys`."""
    from ..marks import MarkChoice

    given = {name: keys.pop(name) for name in ("box", "axes", "scale_bar", "legend", "planes")}
    cursor, ruler = keys.pop("cursor"), keys.pop("ruler")
    if given["planes"] and not cursor:
        raise ViewError("--planes are those of a cursor: say where, with --cursor X Y Z")
    return MarkChoice(**given, cursor=cursor or None, ruler=(ruler[:3], ruler[3:]) if ruler else None)


def json_option(function: Function) -> Function:
    """--json."""
    return click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout, nothing else.")(
        function
    )


def open_scene(path: str, progress: ProgressCall, **given: Any) -> Scene:
    """The scene of a scene file (.json, .toml) or of a volume file; what is `given` replaces its keys."""
    keys = {name: value for name, value in given.items() if value is not None and value != ()}
    if "cut" in keys:
        keys["cut"] = [{"plane": cut[:4], "thickness": cut[4], "show": cut[5]} for cut in keys["cut"]]
    with suppress(KeyError, ValueError):  # a name stays one
        keys["crop_flags"] = int(keys["crop_flags"], 0)
    for name in ("component", "series"):
        if str(keys.get(name, "")).isdecimal():
            keys[name] = int(keys[name])
    if "tf" in keys and keys["tf"] not in NAMES:  # relative to here, not to the scene
        keys["tf"] = str(Path(keys["tf"]).absolute()) if Path(keys["tf"]).exists() else keys["tf"]
    is_scene = Path(path).suffix.lower() in (".json", ".toml")
    _take_look(keys, path if is_scene else None)
    if is_scene:
        return Scene.load(path, progress=progress, **keys)
    return Scene.of_file(path, progress=progress, **keys)


def _take_look(keys: dict[str, Any], scene_file: str | None) -> None:
    """Make what `look_options` gave the scene's keys, each number beside those that the file has."""
    light = {name: keys.pop(name) for name in _LIGHT_NUMBERS if name in keys}
    gradient = {"opacity": keys.pop("modulate")} if "modulate" in keys else {}
    if "lights" in keys:
        keys["lights"] = [{"direction": list(direction)} for direction in keys["lights"]]
    wants_light = [name for name in ("lights", "shadows") if name in keys] + list(light)
    if wants_light and keys.get("shade") is False:
        option = "light" if wants_light[0] == "lights" else wants_light[0]
        raise ViewError(f"--no-shade and --{option} are opposites: leave one of the two out")
    if wants_light:
        keys["shade"] = True
    elif keys.get("shade") is False:  # the file's lights have nothing to do then
        keys |= {"lights": [], "shadows": False}
    for name, given in (("light", light), ("gradient", gradient)):
        if given:
            of_file = _keys_of(scene_file).get(name, {}) if scene_file else {}
            keys[name] = {**of_file, **given} if isinstance(of_file, dict) else given


def _keys_of(scene_file: str) -> dict[str, Any]:
    from ..scene_schema import read_text

    return read_text(Path(scene_file))


def settings_for(
    scene: Scene, quality: float, samples: str | None, residual: float, threads: int | None, **more: Any
) -> Settings:
    """The settings of `setting_options` for a scene, whose hint holds where no samples are given."""
    from ..settings import Settings  # numba loads here, not for --help

    return Settings(
        quality=quality,
        samples_per_interval=int(samples) if samples else scene.samples_per_interval,
        residual=residual,
        threads=threads,
        **more,
    )


def say_missing_voxels(volume: Volume) -> None:
    """A warning on stderr where a volume has voxels without a value."""
    if volume.nonfinite:
        share = 100 * volume.nonfinite / volume.data.size
        logging.getLogger("persp_sw").warning(
            "%d of %d voxels (%.3g %%) are NaN or infinite; they are left transparent",
            volume.nonfinite,
            volume.data.size,
            share,
        )


def _decorated(function: Function, options: list[Callable[[Function], Function]]) -> Function:
    for option in reversed(options):
        function = option(function)
    return function
