"""`persp-sw pick`: what is seen at a pixel of a scene's picture."""

from __future__ import annotations

from typing import Any

import click

from ..errors import ViewError
from .options import json_option, open_scene, region_options, view_options, volume_options
from .output import print_facts, print_json, progress_bars

_EPILOG = """\b
Examples:
  persp-sw pick head.nrrd 400 300
  persp-sw pick scene.json 120 80 --threshold 0.9 --json

\b
The ray of the pixel's centre goes on until what it has met hides half (or --threshold) of
what is behind. Depth is the distance from the eye; of a parallel view, from the picture's
plane through the centre.
"""


@click.command(epilog=_EPILOG)
@click.argument("scene", type=click.Path())
@click.argument("x", type=int)
@click.argument("y", type=int)
@click.option(
    "--threshold", type=float, default=0.5, show_default=True, help="Opacity that counts as hit, 0 … 1."
)
@view_options
@region_options
@volume_options
@json_option
def pick(scene: str, x: int, y: int, threshold: float, as_json: bool, **keys: Any) -> None:
    """Tell value, position and depth of what is seen at pixel X Y of the picture of SCENE.

    X counts from the left, Y from the top, both from 0. SCENE is a scene file or any volume file, as for
    `render`.
    """
    with progress_bars() as progress:
        chosen = open_scene(scene, progress, **keys)
        view, volume = chosen.view(0), chosen.volume
        width, height = view.size
        if not (0 <= x < width and 0 <= y < height):
            raise ViewError(
                f"the picture has pixels 0 … {width - 1} across and 0 … {height - 1} down; given {x} {y}"
            )
        from ..marks import position_text, unit_of
        from ..probe import Probe

        probe = Probe(volume, chosen.transfer, chosen.regions, chosen.look)
        found = probe.pick(view, (x + 0.5, y + 0.5), threshold)
    values: dict[str, Any] = {"name": chosen.name, "pixel": [x, y], "size": [width, height]}
    values |= {"threshold": threshold, "hit": found is not None, "unit": unit_of(volume)}
    if found is not None:
        values |= {
            "value": found.value,
            "position_world": found.position_world,
            "position_object": found.position_object,
            "depth": found.distance,
        }
    if as_json:
        print_json(values)
    elif found is None:
        print_facts({"pixel": f"{x} {y}", "hit": f"nothing that hides {threshold:g} of what is behind it"})
    else:
        print_facts(
            {
                "pixel": f"{x} {y}",
                "value": f"{found.value:.6g}",
                "position": position_text(volume, found.position_world),
                "voxel": " ".join(f"{n:.2f}" for n in found.position_object) + " (x y z, the first is 0)",
                "depth": f"{found.distance:.6g} {unit_of(volume)}",
            }
        )
