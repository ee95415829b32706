"""Steady frames for real: recorded heads in a CAVE, ours beside a fixed quality and OpenCOVER's rule.

    python benchmarks/steady.py heptane:fog mni152@512:surface [--rates 30 60 90] [--seconds 60]
                                [--data FOLDER] [--path FILE]... [--world 1.0] [--walls 1024] [-o traces]

Each frame of a path is composited and warped for all walls of `configs/cave4.toml`, both eyes, once by each
rule, one after another, so that all meet the same machine; nothing waits for a display. What compositing may
take is the target less the warps, as measured. Prints a table, and writes the traces for `persp-sw trace`.

A scene is VOLUME:FUNCTION, a volume of the data folder or ct128 … as for `persp-sw bench`, @N resampled to N
voxels. Without --path: a made-up walk that comes close and goes again.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np

import persp_sw as psw
from persp_sw.measure.cases import data_folder, transfer_for, volume_named
from persp_sw.measure.rules import Fixed, OpenCover
from persp_sw.measure.trace_reading import read_trace
from persp_sw.measure.trace_summary import summary
from vr_plugin.cave.wall_pictures import SoftwareDrawer
from vr_plugin.loop import Loop
from vr_plugin.pacing import controller_for
from vr_plugin.pose import Pose
from vr_plugin.record import Times, record_of
from vr_plugin.rig import Rig
from vr_plugin.rigs.file import load_rig
from vr_plugin.shown import Shown
from vr_plugin.trackers import Sample, open_tracker

CAVE = Path(__file__).parent.parent / "configs" / "cave4.toml"
WARM_UP = 3


class Walk:
    """A head that comes to the volume's middle and goes away, to and fro: what no recording is needed for."""

    def poll(self, now: float) -> list[Sample]:
        """Where it is now."""
        share = 0.5 - 0.5 * np.cos(2 * np.pi * now / 12)
        position = (0.4 * np.sin(now), 1.65 + 0.05 * np.sin(3 * now), 1.2 - 1.1 * share)
        return [Sample(now, 0, Pose(position))]

    def close(self) -> None:
        """Nothing to let go of."""


def room(options: argparse.Namespace) -> Rig:
    """The CAVE, with as many pixels a wall and as large a volume as wished for."""
    rig = load_rig(CAVE)
    walls = [replace(w, wall=replace(w.wall, pixels=(options.walls, options.walls))) for w in rig.walls]
    return replace(rig, walls=walls, placement=replace(rig.placement, size=options.world))


def run(rig: Rig, scene: str, recording: str | None, rate: float, options: argparse.Namespace) -> None:
    """One path of one scene at one rate: all rules, frame by frame."""
    name, function = scene.split(":")
    folder = data_folder(options.data)
    volume = volume_named(name, folder)
    renderer = psw.Renderer(volume, transfer_for(name, function, volume))
    target_ms, limits = 1e3 / rate, (rig.quality.min_quality, rig.quality.max_quality)
    rules = {
        "ours": controller_for(renderer, rig.quality, rate),
        "OpenCOVER's": OpenCover(target_ms, limits=limits),
        f"fixed {options.fixed:g}": Fixed(options.fixed),
    }
    path = "walk" if recording is None else Path(recording).name.partition(".")[0]
    if recording is not None:
        rig = replace(rig, tracker=rig.tracker_for(recording))
    label = f"{name}-{function}-{path}-{rate:g}hz"
    loops, drawers, writers = {}, {}, {}
    for rule, controller in rules.items():
        tracker = Walk()
        if recording is not None:
            tracker = open_tracker(rig.tracker, rest_pose=rig.eyes.rest_pose, folder=".", start=0.0)
        loops[rule] = Loop(rig, renderer, tracker, controller)
        drawers[rule] = SoftwareDrawer(renderer)
        header = {"rig": rig.name, "scene": scene, "rule": rule, "path": path, "target_hz": rate}
        header |= {"min_quality": limits[0], "max_quality": limits[1]}
        file = options.out / f"{label}-{rule.replace(' ', '-')}.jsonl.gz"
        writers[rule] = psw.TraceWriter(file, header)
    order = list(loops)
    for number in range(-WARM_UP, round(options.seconds * rate)):
        now = (number + WARM_UP) / rate
        # In turns, for who comes first finds the caches cold.
        for rule in order[number % len(order) :] + order[: number % len(order)]:
            loop = loops[rule]
            start = perf_counter()
            frame = loop.frame(now)
            warp_ms = sum(drawers[rule].draw(frame).warp_ms.values())
            ms = 1e3 * (perf_counter() - start)
            loop.steady.drawn(frame, warp_ms=warp_ms)
            if number >= 0:
                times = Times(now, now, 0.0, warp_ms, 0.0, ms)
                record = record_of(number, Shown(frame, frame.moment), times, target_ms, on_display=False)
                writers[rule].write(record)
    print(f"\n{scene}, {path}, {rate:g} Hz{HEAD}")
    for rule, loop in loops.items():
        loop.close()
        writers[rule].close()
        print(row(rule, summary(read_trace(writers[rule].path))), flush=True)


HEAD = """
| rule | within ±10 % | p50, p95, p99 of ms/target | without noise: within, p50, p95, p99 | missed | \
quality | largest step | free |
|---|---|---|---|---|---|---|---|"""


def row(rule: str, s: dict) -> str:
    """A line of the table.

    Without noise: of running medians of nine frames. Missed: refreshes of a display of that rate. Free:
    frames at neither limit of quality.
    """
    times, running = (
        ", ".join(f"{s[f'{name}_p{n}']:.2f}" for n in (50, 95, 99)) for name in ("of_target", "running")
    )
    step = f"{100 * (s['quality_step'] - 1):.0f} %"
    quality = f"{s['quality_least']:.2f} … {s['quality_most']:.2f}"
    return (
        f"| {rule} | {s['within']:.0%} | {times} | {s['within_running']:.0%}, {running} | {s['missed']} | "
        f"{quality} | {step} | {s['free']:.0%} |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", default=["ct256:fog"], metavar="VOLUME:FUNCTION")
    parser.add_argument("--rates", type=float, nargs="+", default=[30, 60, 90], metavar="HZ")
    parser.add_argument("--seconds", type=float, default=60, help="of the path")
    parser.add_argument("--path", action="append", help="recorded head path, repeatable")
    parser.add_argument(
        "--world", type=float, default=1.0, metavar="M", help="the volume's longest edge in the room"
    )
    parser.add_argument("--walls", type=int, default=1024, metavar="PIXELS", help="of a wall's edge")
    parser.add_argument("--fixed", type=float, default=1.0, metavar="QUALITY")
    parser.add_argument("--data", help="folder of volumes")
    parser.add_argument("-o", "--out", type=Path, default=Path("traces"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    rig = room(options)
    for scene in options.scenes:
        for recording in options.path or [None]:
            for rate in options.rates:
                run(rig, scene, recording, rate, options)


if __name__ == "__main__":
    main()
