"""How well compositing uses the cores: rows dealt to all of them, against one eye each.

    python benchmarks/scheduling.py [--volume 128] [--rounds 60]

Both eyes before (far, near) and in a synthetic CT of the CAVE of `persp_sw.measure.cave`, 1 m wide. Three
ways alternate: one thread; two threads, which share the rows of every face (as `Renderer.composite` has
them); and two Python threads that composite an eye each, with one thread. The last share nothing, so they
tell what two cores give at best, and they overlap the Python work between kernels. Where the system tells
how many processes run, rounds beside another one are thrown away.

Printed: medians in ms of the rounds kept (of all where hardly any was quiet), and their number; the quartiles
of rows over eyes; the part of Python in the time with two threads; and from counted samples, so without
noise, how much longer the busiest thread is at work than the mean one, all calls of the kernel one after the
other, for 2, 4, 8 and 16 threads.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from time import perf_counter, sleep

import numpy as np

import persp_sw as psw
from persp_sw import compositor
from persp_sw.measure.cave import SEPARATION, four_walls, placed
from persp_sw.volume.phantoms import synthetic_ct

# Opacity a voxel.
SCENES = {
    "fog": [
        (0, (0.2, 0.3, 0.8), 0),
        (6, (0.2, 0.3, 0.8), 0),
        (40, (0.4, 0.6, 0.9), 0.012),
        (255, (1, 0.9, 0.7), 0.04),
    ],
    "bone": [(0, (0, 0, 0), 0), (100, (0.9, 0.7, 0.5), 0), (125, (0.9, 0.7, 0.5), 1), (255, (1, 1, 1), 1)],
}
PLACES = {"far": 1.3, "near": 0.6, "inside": 0.0}  # metres before the room's centre
QUALITIES = (0.3, 1.0, 2.0)
THREADS = (2, 4, 8, 16)
SECONDS = 12.0  # for a line, at most


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--volume", type=int, default=128, help="voxels an edge")
    parser.add_argument("--rounds", type=int, default=60)
    options = parser.parse_args()
    volume, walls = placed(synthetic_ct(options.volume)), four_walls(1024)
    print("scene where  quality faces M samples | 1 thread  rows    eyes  of |   rows/eyes     | Python | "
          + " ".join(f"{n:5}" for n in THREADS))  # fmt: skip
    for scene, points in SCENES.items():
        renderer = psw.Renderer(volume, psw.TransferFunction(points, 1 / (options.volume - 1)))
        for where, z in PLACES.items():
            eyes = [psw.Eye((0.1 + side * SEPARATION / 2, 1.6, z)) for side in (-1, 1)]
            plans = [renderer.plan(eye, walls) for eye in eyes]
            for quality in QUALITIES:
                numbers = measure(renderer, plans, quality, options.rounds)
                print(f"{scene:5} {where:7} {quality:6} {numbers}", flush=True)


def measure(renderer: psw.Renderer, plans: list[psw.EyePlan], quality: float, rounds: int) -> str:
    """One line's numbers."""
    one, two = (psw.Settings(quality=quality, threads=n) for n in (1, 2))

    def eye(plan: psw.EyePlan, settings: psw.Settings) -> psw.EyeImage:
        classification = renderer._classification
        return compositor.composite_eye(renderer.detail, classification, renderer.regions, settings, plan)

    with ThreadPoolExecutor(1) as pool:

        def an_eye_each() -> list[psw.EyeImage]:
            other = pool.submit(eye, plans[1], one)
            return [eye(plans[0], one), other.result()]

        ways = [lambda: [eye(p, one) for p in plans], lambda: [eye(p, two) for p in plans], an_eye_each]
        images = ways[0]()
        ways[2]()
        times = np.array(alternating(ways, rounds))
    rows, shares = counted(lambda: [eye(p, two) for p in plans])
    python = min(timed(lambda: [eye(p, two) for p in plans], without_kernel=True) for _ in range(30))
    medians = 1e3 * np.median(times, axis=0)
    quartiles = np.quantile(times[:, 1] / times[:, 2], [0.25, 0.5, 0.75])
    times_ms = " ".join(f"{median:7.2f}" for median in medians)
    return (
        f"{len(images[0].faces):5} {rows / 1e6:9.2f} | {times_ms} {len(times):3} | "
        f"    {quartiles[0]:.2f} {quartiles[1]:.2f} {quartiles[2]:.2f} | {1e3 * python / medians[1]:5.0%}  | "
        + " ".join(f"{share - 1:5.1%}" for share in shares)
    )


def alternating(ways: list[Callable[[], object]], rounds: int) -> list[list[float]]:
    """Seconds [round, way] of rounds with nothing else at work, each beginning with another way.

    Where there are not five in `SECONDS`, of all rounds.
    """
    every, quiet = [], []
    end = perf_counter() + SECONDS
    while len(quiet) < rounds and perf_counter() < end:
        alone, spent = running() <= 1, [0.0] * len(ways)
        for way in np.roll(range(len(ways)), len(every) % len(ways)):
            spent[way] = timed(ways[way])
            alone = alone and running() <= 1
        every.append(spent)
        if alone:
            quiet.append(spent)
        else:
            sleep(0.005)
    return quiet if len(quiet) >= min(5, rounds) else every


def running() -> int:
    """Processes at work, this one included; 1 where the system does not tell."""
    try:
        lines = Path("/proc/stat").read_text().splitlines()
    except OSError:
        return 1
    return next((int(line.split()[1]) for line in lines if line.startswith("procs_running")), 1)


def timed(work: Callable[[], object], without_kernel: bool = False) -> float:
    """Seconds that it takes."""
    kernel = compositor.composite_face
    if without_kernel:
        compositor.composite_face = lambda *_: None
    try:
        start = perf_counter()
        work()
        return perf_counter() - start
    finally:
        compositor.composite_face = kernel


def counted(work: Callable[[], object]) -> tuple[int, list[float]]:
    """Samples taken; and, for each of `THREADS`, those of the busiest thread over the mean thread's."""
    kernel, calls = compositor.composite_face, []

    def watched(*arguments):
        kernel(*arguments)
        calls.append(arguments[-2].copy())

    compositor.composite_face = watched
    try:
        work()
    finally:
        compositor.composite_face = kernel
    total = sum(int(samples.sum()) for samples in calls)
    busiest = partial(_busiest, calls)
    return total, [busiest(threads) * threads / max(total, 1) for threads in THREADS]


def _busiest(calls: list[np.ndarray], threads: int) -> int:
    return sum(max(int(samples[n::threads].sum()) for n in range(threads)) for samples in calls)


if __name__ == "__main__":
    main()
