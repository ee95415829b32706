"""Lit pictures by many lights, one by one and through a reflectance map, in turn.

    python benchmarks/reflectance.py [--edge 128] [--size 512] [--frames 9] [--threads N] [--power P]

For 0, 1, 2 … 32 directional lights without shadows, together as bright at any number: milliseconds of a
picture with each light evaluated for every sample, the same through a map, their ratio, how large the maps
are, milliseconds to make them once, and the largest difference of the two pictures beside the bound that
is claimed, in steps of 8-bit pictures. Where the ratio passes 1 is
`optics.reflectance.LIGHTS_THAT_PAY`. A map that would err by more than half a step is not used: "too
coarse". Frames of both kinds take turns.
"""

from __future__ import annotations

import argparse
from math import inf
from statistics import median
from time import perf_counter

import numpy as np
from rich.console import Console
from rich.table import Table

import persp_sw as psw
from persp_sw.measure.cases import eye_path, transfer_for
from persp_sw.optics import reflectance
from persp_sw.volume.phantoms import synthetic_ct

COUNTS = (0, 1, 2, 4, 8, 16, 32)
BRIGHTNESS = 0.8  # of all lights together; no map is fine enough for one that is brighter


def lighting_of(count: int, power: float) -> psw.Lighting:
    """Lights all around, evenly: a Fibonacci spiral."""
    height = 1 - 2 * (np.arange(count) + 0.5) / max(count, 1)
    angle = np.pi * (3 - np.sqrt(5)) * np.arange(count) + 0.3
    across = np.sqrt(1 - height**2)
    towards = np.column_stack([across * np.cos(angle), across * np.sin(angle), height])
    tints = [(1, 0.9, 0.7), (0.6, 0.8, 1.0), (0.9, 1, 0.8)]
    lights = [
        psw.Light(tuple(one), tuple(BRIGHTNESS / count * c for c in tints[n % 3]))
        for n, one in enumerate(towards)
    ]
    return psw.Lighting(headlight=0.3, lights=lights, power=power)


def picture(
    renderer: psw.Renderer, view: psw.View, canvas: psw.Canvas, by_map: bool
) -> tuple[float, np.ndarray]:
    """Seconds of a picture, and the picture."""
    reflectance.LIGHTS_THAT_PAY = 1 if by_map else inf
    start = perf_counter()
    image = renderer.render(view, canvas)
    return perf_counter() - start, image


def made(lighting: psw.Lighting) -> tuple[str, float, float]:
    """The sizes of a look's maps, seconds to make them, and their bound; no sizes where there are none."""
    reflectance.LIGHTS_THAT_PAY = 1
    reflectance.built.cache_clear()
    start = perf_counter()
    maps = reflectance.reflectance_of(lighting)
    seconds = perf_counter() - start
    if maps is None:
        return "too coarse" if lighting.lights else "", seconds, 0.0
    return "+".join(f"{2 * half + 1}" for half in maps.halves if half), seconds, maps.error


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--edge", type=int, default=128, help="voxels along an edge")
    parser.add_argument("--size", type=int, default=512, help="pixels along an edge")
    parser.add_argument("--frames", type=int, default=9, help="of each kind, whose median is told")
    parser.add_argument("--threads", type=int)
    parser.add_argument("--power", type=float, default=20.0, help="of highlights")
    given = parser.parse_args()
    volume = synthetic_ct(given.edge)
    view = eye_path(volume, "corner", (given.size, given.size), frames=0)[0]
    canvas = psw.Canvas(*view.size)
    table = Table("function", "lights", "direct ms", "map ms", "ratio", "texels²", "made ms",
                  "difference", "bound")  # fmt: skip
    for function in ("fog", "surface"):
        transfer = transfer_for("ct", function, volume)
        renderer = psw.Renderer(volume, transfer, psw.Settings(threads=given.threads))
        for count in COUNTS:
            lighting = lighting_of(count, given.power)
            sizes, seconds, bound = made(lighting)
            renderer.look = psw.Look(lighting)
            times: dict[bool, list[float]] = {False: [], True: []}
            pictures = {}
            for _ in range(given.frames + 1):  # the first encodes, and compiles
                for by_map, taken in times.items():
                    one, image = picture(renderer, view, canvas, by_map)
                    taken.append(one)
                    pictures[by_map] = image.copy()
            direct, mapped = (1e3 * median(times[kind][1:]) for kind in (False, True))
            off = np.abs(pictures[True] - pictures[False]).max() * 255
            table.add_row(
                function, str(count), f"{direct:.1f}", f"{mapped:.1f}", f"{mapped / direct:.2f}", sizes,
                f"{1e3 * seconds:.0f}", f"{off:.3f}", f"{255 * bound:.3f}",
            )  # fmt: skip
    Console().print(table)


if __name__ == "__main__":
    main()
