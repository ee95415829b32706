"""A head that has moved: errors of the old eye image against the shift, and what depth and slabs cost.

    python benchmarks/rewarp.py [ct128 engine engine@128 FILE …] [--data FOLDER] [--size 256] [--no-truth]

Each volume as fog and as surface, its longest edge 0.8 m and 1.2 m from the eye; and 2 m, the eye inside.
The eye image is composited once, for a wall a quarter larger than the one shown, so that nothing is missing
at its edges, and then drawn for eyes that have moved by 5, 10 and 20 mm: to the right, up and forwards.

*fresh dB* is the PSNR against an eye image composited anew for the moved eye with the same settings: the
error of the re-warp alone. *truth dB* is that against the float64 reference. Both are means over the three
shifts.

*mrad* is how far, as seen from the eye, a shift of 20 mm at right angles leaves things from where they should
be: the root mean square, the median and the 95th percentile over all samples of all rays, weighted by what
they add to the picture. It is computed from the samples' exact depths, by a march in float64 that shares no
code with the renderer, and from the distances at which planes lie. Smaller shifts have less, nearly in
proportion.

*composite*, *warp* are milliseconds relative to those of an image without depth, medians of interleaved runs;
*samples* is counted. The warp is the software warp, on one canvas.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
from PIL import Image

import persp_sw as psw
from persp_sw.geometry.placement import depth_range
from persp_sw.measure.cases import data_folder, transfer_for, volume_named
from persp_sw.measure.metrics import psnr
from persp_sw.measure.truth import Truths
from persp_sw.warp.moved import distance_of

WAYS = {0: "middle of the box", 1: "measured depth", 2: "2 slabs", 4: "4 slabs", 8: "8 slabs"}
SHIFTS = (0.0, 5.0, 10.0, 20.0)  # mm
TOWARDS = np.array((0.42, 0.27, 0.87)) / np.linalg.norm((0.42, 0.27, 0.87))
MARGIN = 1.25  # of the wall composited for
SKIN = [
    *((0, (0, 0, 0), 0), (45, (0.9, 0.5, 0.35), 0), (70, (0.9, 0.5, 0.35), 0.03)),
    *((120, (0.9, 0.7, 0.5), 0.03), (160, (1, 0.97, 0.9), 0.5), (215, (0.7, 0.8, 1), 0.5)),
    (255, (0.4, 0.6, 1), 0.8),
]
MARCH = 0.25  # voxels a sample of the exact depths
RAYS = 48  # a side


def grown(wall: psw.Wall, share: float) -> psw.Wall:
    """The wall, larger about its middle, with pixels as large as before."""
    middle = (wall.lower_right + wall.upper_left) / 2
    corners = (middle + share * (c - middle) for c in (wall.lower_left, wall.lower_right, wall.upper_left))
    return psw.Wall(*corners, pixels=tuple(round(share * n) for n in wall.pixels))


def own_view(volume: psw.Volume, inside: bool, size: int) -> tuple[psw.View, float]:
    """Where the eye stands, and the world's units in a metre."""
    edge = max(volume.extent)
    unit = edge / (2.0 if inside else 0.8)
    eye = volume.centre + TOWARDS * (0.1 * edge if inside else 1.2 * unit)
    centre = volume.centre - 0.3 * edge * TOWARDS if inside else volume.centre
    return psw.View.look_at(eye, centre, (0, 1, 0), 90 if inside else 45, (size, size)), unit


def moved_views(view: psw.View, length: float) -> list[psw.View]:
    """The wall seen by eyes to the right, above and in front of the view's, `length` world units away."""
    wall = view.wall
    right, up = wall.lower_right - wall.lower_left, wall.upper_left - wall.lower_left
    ways = [way / np.linalg.norm(way) for way in (right, up, np.cross(up, right))]
    return [psw.View(psw.Eye(view.eye.position + length * way), wall) for way in ways]


class Depths:
    """What is seen of a volume, sample by sample: how much it adds to the picture, and how far it is away."""

    def __init__(self, volume: psw.Volume, transfer: psw.TransferFunction, view: psw.View):
        coarse = psw.View(view.eye, replace(view.wall, pixels=(RAYS, RAYS)))
        object_from_world = np.linalg.inv(volume.world_from_object)
        eye = object_from_world[:3, :3] @ view.eye.position + object_from_world[:3, 3]
        high = np.array(volume.size) - 1.0
        weights, relative, reach = [], [], []
        for direction in coarse.directions().reshape(-1, 3):
            direction = direction / np.linalg.norm(direction)
            along = object_from_world[:3, :3] @ direction
            with np.errstate(divide="ignore", invalid="ignore"):
                ends = np.sort([(0 - eye) / along, (high - eye) / along], axis=0)
            enter, leave = max(np.nanmax(ends[0]), 0), np.nanmin(ends[1])
            step = MARCH / np.linalg.norm(along)
            way = np.arange(enter + step / 2, leave, step)
            if not len(way):
                continue
            offset = way[:, None] * along
            value = trilinear(volume.data, np.clip(eye + offset, 0, high))
            depth = transfer.extinction(value) * step
            clear = np.exp(-np.concatenate([[0], depth.cumsum()]))
            kept = -np.diff(clear)
            seen = kept > 1e-6
            weights.append(kept[seen])
            relative.append(offset[seen])
            reach.append(way[seen])
        self.weights, self.offsets, self.reach = (np.concatenate(p) for p in (weights, relative, reach))

    def milliradians(self, image: psw.EyeImage, shift: float) -> tuple[float, float, float]:
        """Root mean square, and what half and 95 % of the weight stay below, for a shift at right angles."""
        faces = image.faces
        eye = np.linalg.solve(image.world_from_object, np.append(image.eye.position, 1))[:3]
        if len(faces) == 1:
            depth = faces[0].sign * self.offsets[:, faces[0].axis]
        else:
            depth = np.abs(self.offsets).max(1)
        layers = image.slabs or (image,)
        ends = [depth_range(faces, eye, layer.box)[1] for layer in layers[:-1]]
        shown = np.array([distance_of(layer) for layer in layers])[np.searchsorted(ends, depth)]
        error = 1e3 * np.abs(np.arctan(shift / self.reach) - np.arctan(shift / (self.reach * shown / depth)))
        order = np.argsort(error)
        below = self.weights[order].cumsum()
        rms = np.sqrt((self.weights * error**2).sum() / self.weights.sum())
        half, most = error[order][np.searchsorted(below, np.array([0.5, 0.95]) * below[-1])]
        return float(rms), float(half), float(most)


def trilinear(data, places):
    """Values [z, y, x] between voxels at object places (n, 3), xyz."""
    last = np.array(data.shape[::-1]) - 2
    low = np.minimum(places.astype(int), np.maximum(last, 0))
    share = places - low
    value = np.zeros(len(places))
    for corner in np.ndindex(2, 2, 2):
        x, y, z = (low + corner).T
        value += np.prod(np.where(corner, share, 1 - share), axis=1) * data[z, y, x]
    return value


def case(name, function, inside, options, folder, truths):
    """Print one table."""
    volume = volume_named(name, folder)
    transfer = transfer_for(name, function, volume)
    view, unit = own_view(volume, inside, options.size)
    walls = [grown(view.wall, MARGIN)]
    base = psw.Settings(quality=options.quality)
    renderer = psw.Renderer(volume, transfer, base)
    views = {shift: moved_views(view, shift / 1e3 * unit) for shift in SHIFTS}
    fresh = {s: [renderer.warp(renderer.composite(v.eye, walls), v) for v in views[s]] for s in SHIFTS}
    exact = {}
    if truths:
        exact = {s: [truths.of(volume, transfer, v, psw.Regions()) for v in views[s]] for s in SHIFTS}
    depths = Depths(volume, transfer, view)

    canvas = psw.Canvas(*view.size)
    settings = {count: replace(base, depth_slabs=count) for count in WAYS}
    made, times, samples = {}, {count: ([], []) for count in WAYS}, {}
    for run in range(options.runs + 1):
        for count, each in settings.items():
            renderer.settings = each
            start = perf_counter()
            made[count] = renderer.composite(view.eye, walls)
            between = perf_counter()
            renderer.warp(made[count], views[5.0][0], canvas)
            if run:
                times[count][0].append(between - start)
                times[count][1].append(perf_counter() - between)
            samples[count] = made[count].samples
    ms = {count: 1e3 * np.median(pair, axis=1) for count, pair in times.items()}

    image = made[0]
    sizes = "+".join("×".join(map(str, face.size)) for face in image.faces)
    where = "2 m, from inside" if inside else "0.8 m, at 1.2 m"
    print(
        f"\n{name}, {function}, {where}: {len(image.faces)} face(s) {sizes}; "
        f"{ms[0][0]:.1f} ms to composite, {ms[0][1]:.2f} ms to warp"
    )
    heads = " ".join(f"{shift:3.0f} mm" for shift in SHIFTS)
    truth_heads = f" | truth dB: {heads}" if exact else ""
    print(f"{'':18} composite samples  warp | mrad   50 %  95 % | fresh dB: {heads}{truth_heads}")
    for count, label in WAYS.items():
        wrong = " ".join(f"{angle:5.1f}" for angle in depths.milliradians(made[count], 0.02 * unit))
        cells = f"{label:18} {ms[count][0] / ms[0][0]:8.2f}× {samples[count] / samples[0]:6.2f}×"
        cells += f" {ms[count][1] / ms[0][1]:4.1f}× | {wrong} |          "
        renderer.settings = base
        for other in [fresh, exact] if exact else [fresh]:
            for shift in SHIFTS:
                pairs = zip(views[shift], other[shift], strict=True)
                decibels = np.mean([psnr(renderer.warp(made[count], v, canvas), t) for v, t in pairs])
                cells += f" {decibels:6.1f}"
            cells += " |          " if exact and other is fresh else ""
        print(cells, flush=True)


def picture(path: Path):
    """Anew, one plane and four slabs for a head 20 mm to the right; below, the old view and errors × 4."""
    volume = volume_named("ct128", None)
    transfer = psw.TransferFunction(SKIN, min(volume.spacing))
    view, unit = own_view(volume, False, 300)
    view = psw.View.look_at(view.eye.position, volume.centre, (0, 1, 0), 34, (300, 300))
    walls, moved = [grown(view.wall, MARGIN)], moved_views(view, 0.02 * unit)[0]
    renderer = psw.Renderer(volume, transfer, psw.Settings(quality=2))
    fresh = renderer.warp(renderer.composite(moved.eye, walls), moved)
    top, bottom = [fresh], [renderer.warp(renderer.composite(view.eye, walls), view)]
    for count in (1, 4):
        renderer.settings = psw.Settings(quality=2, depth_slabs=count)
        top.append(renderer.warp(renderer.composite(view.eye, walls), moved))
        bottom.append((4 * np.abs(top[-1] - fresh)).clip(0, 1) ** 2.2)  # as they are, not as light
        print(f"{count}: {psnr(top[-1], fresh):.1f} dB")
    colours = np.vstack([np.hstack(top), np.hstack(bottom)])[..., :3]
    Image.fromarray((255 * colours.clip(0, 1) ** (1 / 2.2)).astype(np.uint8)).save(path)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("volumes", nargs="*", default=["ct128"], help="ctN, names in --data, files; @N")
    parser.add_argument("--data", help="folder of real volumes; else PERSP_SW_DATA")
    parser.add_argument("--functions", nargs="+", default=["fog", "surface"])
    parser.add_argument("--size", type=int, default=256, help="pixels of the square picture")
    parser.add_argument("--quality", type=float, default=1.0)
    parser.add_argument("--runs", type=int, default=15, help="for times")
    parser.add_argument("--cache", type=Path, help="folder of reference pictures")
    parser.add_argument("--no-truth", action="store_true", help="no reference pictures, which take minutes")
    parser.add_argument("--picture", type=Path, metavar="PNG", help="write the picture of docs/rewarp.md")
    options = parser.parse_args()
    if options.picture:
        return picture(options.picture)
    truths = None if options.no_truth else Truths(options.cache) if options.cache else Truths()
    folder = data_folder(options.data)
    for name in options.volumes:
        for function in options.functions:
            for inside in (False, True):
                case(name, function, inside, options, folder, truths)


if __name__ == "__main__":
    main()
