"""`persp-sw render`: a picture, its time and its measured error."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .. import images
from ..optics.presets import NAMES, describe
from ..scene import Scene
from .options import (
    json_option,
    look_options,
    mark_options,
    marks_of,
    open_scene,
    region_options,
    say_missing_voxels,
    setting_options,
    settings_for,
    view_options,
    volume_options,
    warp_option,
)
from .output import byte_size, numbers, print_facts, print_json, progress_bars

if TYPE_CHECKING:
    from ..marks import MarkChoice

_PRESETS = "\n".join(f"  {name:<11} {describe(name)}" for name in NAMES)
_EPILOG = f"""\b
Examples:
  persp-sw render head.nrrd -o head.png
  persp-sw render head.nrrd --preset ct_bone --eye 0 -600 200 --size 1024 768
  persp-sw render scene.toml --quality 2 --samples 2 --reference
  persp-sw render head.nrrd --clip 1 0 0 -90 --cut 0 0.2 1 -60 10 outside
  persp-sw render head.nrrd --box --axes --scale-bar --cursor 12 -30 44 --legend
  persp-sw render ct.nrrd --window 40 400
  persp-sw render scene.json --reference --json > result.json

\b
Presets:
{_PRESETS}

\b
A scene file has the keys that the options have, and more (README, "Scene files").
`ms` is the median of the timed frames; a first frame, which encodes and compiles,
comes before them. --quality and --samples change speed and error, never the look.
"""


@click.command(epilog=_EPILOG)
@click.argument("scene", type=click.Path())
@click.option(
    "-o", "--out", type=click.Path(), help="Picture to write: .png, .npy or .exr. [default: NAME-render.png]"
)
@click.option(
    "--reference", "judge", is_flag=True, help="Write OUT-reference and OUT-error.png too; print the error."
)
@click.option(
    "--tolerance", type=float, default=1e-5, show_default=True, help="How far the reference may be unsettled."
)
@click.option(
    "--intermediate", type=int, metavar="N", help="Pixels of the eye image's longer side; replaces --quality."
)
@click.option(
    "--preintegrated/--point-samples",
    default=None,
    help="All values on a ray count, or only those at samples; by the transfer function where not said.",
)
@warp_option
@setting_options
@look_options
@view_options
@region_options
@mark_options
@volume_options
@json_option
def render(
    scene: str,
    out: str | None,
    judge: bool,
    tolerance: float,
    intermediate: int | None,
    preintegrated: bool | None,
    warp: str,
    quality: float,
    samples: str | None,
    residual: float,
    threads: int | None,
    as_json: bool,
    **keys: Any,
) -> None:
    """Write a picture of SCENE, its time and, with --reference, its measured error.

    SCENE is a scene file (.json, .toml) or any volume file; then everything else has a default. A .png shows
    the picture over the background, sRGB-encoded; .npy and .exr hold linear, premultiplied float32 RGBA.
    """
    marks = marks_of(keys)
    with progress_bars() as progress:
        chosen = open_scene(scene, progress, **keys)
        path = images.check_output(out or f"{chosen.name}-render.png")
        settings = settings_for(
            chosen,
            quality,
            samples,
            residual,
            threads,
            preintegrated=preintegrated,
            intermediate_size=intermediate,
        )
        values = {
            "scene": scene,
            **shoot(chosen, path, settings, tolerance if judge else None, progress, warp, marks),
        }
    say_missing_voxels(chosen.volume)
    if as_json:
        print_json(values)
    else:
        _print(values)


def shoot(
    scene: Scene,
    path: Path,
    settings: Any,
    tolerance: float | None,
    progress: Any,
    warp: str = "software",
    marks: MarkChoice | None = None,
) -> dict[str, Any]:
    """Render and time `scene`, write its picture, with `marks` in it, to `path`.

    Where a `tolerance` is given the picture without marks is judged, too.
    """
    from ..marks import with_marks
    from ..renderer import Renderer
    from .shots import MIN_FRAMES, Judgement, time_frames, write_judgement
    from .warps import WarpChoice

    volume = scene.volume
    views = scene.views()
    if not scene.animated:  # one view; repeated so that its time is a median
        views = [views[0]] * (1 + max(scene.frames, MIN_FRAMES))
    renderer = Renderer(volume, scene.transfer, settings, scene.regions, progress, scene.look)
    progress(0, len(views), "rendering")
    with WarpChoice(renderer, warp, views[0].size) as drawn:
        timing = time_frames(drawn, views, scene.max_seconds)
    progress(len(views), len(views), "rendering")
    shown = timing.image
    if marks:
        shown = with_marks(shown, renderer, views[-1], marks, background=scene.background)
    images.write(path, shown, scene.background)
    values = {
        "name": scene.name,
        "volume": str(scene.keys.volume),
        "size": scene.size,
        "out": str(path),
        "preset": scene.preset.name if scene.preset else None,
        "quality": settings.quality,
        **timing.report(),
        "warp": drawn.name,
        "dense_bytes": volume.data.nbytes,
    }
    if tolerance is not None:
        judgement = Judgement.of(
            timing.image,
            renderer,
            views[-1],
            regions=scene.regions,
            tolerance=tolerance,
            threads=settings.threads,
            progress=progress,
        )
        values |= judgement.figures | write_judgement(path, timing.image, judgement, scene.background)
    return values


def _print(values: dict[str, Any]) -> None:
    faces, threads = values["faces"], values["threads"]
    warp = f"{values['warp']} warp {values['warp_ms']:.1f}"
    compiled = f", compile {values['compile_ms']:.0f}" if values["compile_ms"] else ""
    rows = {
        "picture": f"{values['out']}, {numbers(values['size'])} pixels",
        "preset": values["preset"] or "the scene's own transfer function",
        "time": f"{values['ms']:.1f} ms a frame, median of {values['timed_frames']} (composite "
        f"{values['composite_ms']:.1f}, {warp}), {threads} thread{'s' * (threads > 1)}",
        "once": f"first frame {values['first_ms']:.0f} ms (encode {values['encode_ms']:.0f}{compiled})",
        "eye image": f"{faces} face{'s' * (faces != 1)}, {numbers(values['intermediate_size'])} pixels, "
        f"{values['samples']:,} samples",
        "memory": f"runs {byte_size(values['runs_bytes'])}, dense volume {byte_size(values['dense_bytes'])}",
    }
    if "psnr" in values:
        rows |= {
            "error": f"PSNR {values['psnr']:.2f} dB (covered {values['psnr_covered']:.2f}), SSIM "
            f"{values['ssim']:.4f}, largest {values['max_error']:.4f}, signed mean "
            f"{values['mean_signed_error']:+.2e}",
            "error map": f"{values['error_map']}, brightest at {values['error_scale']:g}",
            "reference": f"{values['reference']} ({values['reference_ms'] / 1e3:.1f} s)",
        }
    print_facts(rows)
