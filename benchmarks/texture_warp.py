"""The texture warp beside the software warp: ms of upload and of drawing, and errors, by texture format.

    python benchmarks/texture_warp.py [--sizes 512 1024] [--walls 4] [--repeats 30]

An eye image of a synthetic CT with an intermediate image of `size` pixels, shown on pictures of `size`²: one
face from without, several from within. *draw* is a wall's share where several are drawn one after the other,
*+depth* the same with depths tested; *read* copies the picture back to the processor's memory, which only
`render` needs; *total* is a wall's share of the upload, and draw and read. Errors are against the software
warp. Last, how often the texture warp is faster for `render`: what `--warp auto` should do here.
"""

from __future__ import annotations

import argparse
from time import perf_counter, process_time

import numpy as np
from OpenGL import GL

import persp_sw as psw
from persp_sw.volume.phantoms import synthetic_ct
from persp_sw.warp.canvas import Canvas

TRANSFER = [(0, (0, 0, 0), 0), (60, (0.9, 0.5, 0.3), 0.02), (160, (1, 0.9, 0.8), 0.7), (255, (1, 1, 1), 1)]


clock = perf_counter


def ms(function, repeats: int) -> float:
    """Least milliseconds of a call, OpenGL's work included: what else runs here only adds to it."""
    times = []
    for _ in range(repeats):
        GL.glFinish()
        start = clock()
        function()
        GL.glFinish()
        times.append(1e3 * (clock() - start))
    return min(times)


def wall_ms(warp, view, options, ends) -> float:
    """Milliseconds a wall where several are drawn."""

    def draw():
        for _ in range(options.walls):
            warp.draw_view(view, near=ends[0], far=ends[1])

    return ms(draw, options.repeats) / options.walls


def case(size: int, inside: bool, options) -> tuple[float, float]:
    """Print one case; returns a wall's ms by software and by the best texture, reading back included."""
    volume = psw.Volume(synthetic_ct(options.volume).data)
    settings = psw.Settings(intermediate_size=size)
    renderer = psw.Renderer(volume, psw.TransferFunction(TRANSFER, 1.0), settings)
    reach = 0.35 if inside else 1.6
    eye = volume.centre + reach * max(volume.extent) * np.array([0.3, -0.8, 0.52])
    view = psw.View.look_at(eye, volume.centre, (0, 0, 1), 90 if inside else 42, (size, size))
    image = renderer.composite(view.eye, [view.wall])
    canvas = Canvas(size, size)
    truth = renderer.warp(image, view, canvas).copy()
    software = ms(lambda: renderer.warp(image, view, canvas), options.repeats)
    covered = (truth[..., 3] > 0).mean()
    faces = "+".join("×".join(map(str, face.size)) for face in image.faces)
    print(f"\n{size}², {len(image.faces)} face(s) {faces}, {covered:.0%} covered")
    print("            upload   draw  +depth   read  total   max error  mean error")
    print(f"  software         {software:7.2f}                 {software:6.2f}")
    target = psw.Framebuffer(size, size)
    best = np.inf
    for precision in psw.TextureWarp.PRECISIONS[1:]:
        with psw.TextureWarp(precision) as warp:
            upload = ms(lambda warp=warp: warp.upload(image), options.repeats)
            target.clear()
            warp.draw_view(view)
            picture = target.read()
            error = np.abs(picture - truth)
            flat, depth = (wall_ms(warp, view, options, ends) for ends in ((None, None), (1, 1e4)))
        read = ms(target.read, options.repeats)
        total = upload / options.walls + flat + read
        best = min(best, upload + flat + read)
        print(
            f"  {precision:8}{upload:9.2f}{flat:7.2f}{depth:8.2f}{read:7.2f}{total:7.2f}"
            f"{error.max():12.1e}{error.mean():12.1e}",
            flush=True,
        )
    target.close()
    return software, best


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sizes", type=int, nargs="+", default=[512, 1024])
    parser.add_argument("--volume", type=int, default=128, help="voxels an edge")
    parser.add_argument("--walls", type=int, default=4, help="walls that one upload serves")
    parser.add_argument("--repeats", type=int, default=30)
    parser.add_argument(
        "--cpu", action="store_true", help="processor time of all threads: for llvmpipe on a busy machine"
    )
    options = parser.parse_args()
    if options.cpu:
        global clock
        clock = process_time
    with psw.OffscreenContext() as context:
        print(context.renderer)
        rows = [case(size, inside, options) for size in options.sizes for inside in (False, True)]
    wins = sum(texture < software for software, texture in rows)
    print(f"\n--warp auto: texture is faster in {wins} of {len(rows)} cases (one wall, read back)")


if __name__ == "__main__":
    main()
