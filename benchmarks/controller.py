"""Frame-time control on recorded costs: ours, a fixed quality, and OpenCOVER's rule, in one harness.

    python benchmarks/controller.py [--frames 3600] [--seed 1] [--targets 60 90 120]

First, at 48 poses along the path of `recorded_costs.json`, a viewer at rest whose load becomes 4 times as
heavy or light (less, where qualities from 0.27 to 1.9 cannot make up for that): frames until the time without
noise stays within 10 % of the target, and how far it goes beyond. Next, how much quality moves under constant
load with noise of 30 %, and with that recorded.

Then it plays the path (head into the volume and back, to and fro) with the noise recorded on it, drawn anew
for each frame, the same for all rules. Prints the share of frames within 10 % of the target, the quantiles of
their times over it, the range of quality and its largest change from frame to frame. *free*: the share among
frames whose target some quality between the limits can meet, costs without noise.
"""

from __future__ import annotations

import argparse
from math import exp
from pathlib import Path

import numpy as np

from persp_sw.measure.replay import Disturbance, RecordedScene, Rule, Trace, replay
from persp_sw.measure.rules import Fixed, OpenCover
from persp_sw.quality.controller import FrameTimeController

RECORDED = Path(__file__).with_name("recorded_costs.json")
LIMITS = 0.25, 2.0
RATE = 60.0
HEAD = """                 within ±10 %      time / target        the same, no noise
  rule            all  clean   free    p50    p95    p99    p50    p95    p99  quality      step"""


def row(name: str, trace: Trace, target: float, free: np.ndarray) -> str:
    """A line of the table."""
    over, clean = trace.ms / target, trace.clean_ms / target
    within = np.abs(clean - 1) <= 0.1
    shares = np.mean(np.abs(over - 1) <= 0.1), within.mean(), within[free].mean()
    cells = [f"{name:12}", *(f"{share:5.0%}" for share in shares)]
    cells += [f"{q:5.2f}" for times in (over, clean) for q in np.quantile(times, (0.5, 0.95, 0.99))]
    cells.append(f"{trace.quality.min():.2f} … {trace.quality.max():.2f}")
    cells.append(f"{exp(np.abs(np.diff(np.log(trace.quality))).max()) - 1:4.0%}")
    return "  " + "  ".join(cells)


def reachable(scene: RecordedScene, target: float, times: np.ndarray) -> np.ndarray:
    """Which frames have a quality between the limits, costs without noise, that meets the target."""
    low, high = (np.array([scene.cost(t, "", q).ms for t in times]) for q in LIMITS)
    return (low <= target) & (target <= high)


def steps(scene: RecordedScene) -> None:
    """Print how steps of the load are met at rest."""
    for kind in ("machine", "content", "extent"):
        for heavier in (True, False):
            found = []
            for time in np.arange(0, scene.seconds, 0.25):
                light, heavy = (scene.cost(time, "", q).ms for q in (0.27, 1.9))
                factor = min(4.0, 0.9 * heavy / light)
                load = {kind: lambda n, f=factor, up=heavier: f if (n >= 200) == up else 1.0}
                target = factor * light
                trace = replay(
                    scene, ours(target), 400, time=lambda n, t=time: t, disturbance=Disturbance(**load)
                )
                after = trace.clean_ms[200:] / target
                outside = np.flatnonzero(np.abs(after - 1) > 0.1)
                crossed = int(np.argmax(after <= 1.1 if heavier else after >= 0.9))
                beyond = (1 / after if heavier else after)[crossed:].max() - 1
                found.append((outside[-1] + 1 if len(outside) else 0, max(beyond, 0.0)))
            settled, beyond = np.array(found).T
            frames = ", ".join(f"{np.quantile(settled, q):.0f}" for q in (0.5, 0.9, 1.0))
            print(
                f"  {kind:8} {'heavier' if heavier else 'lighter'}  settled after (50, 90, 100 %) {frames}"
                f" frames, {np.mean(settled <= 10):.0%} within 10;  beyond by at most {beyond.max():.0%}"
            )


def rests(scene: RecordedScene, seed: int) -> None:
    """Print what noise does at rest."""
    for name in ("30 %", "recorded"):
        rows = []
        for number, time in enumerate((0.5, 4.0, 6.5, 7.75)):
            rng = np.random.default_rng(seed + number)
            normal = np.exp(0.3 * rng.normal(size=3000) - 0.045)
            noise = normal if name == "30 %" else rng.choice(scene.noise, 3000)
            target = scene.cost(time, "", 0.9).ms
            disturbance = Disturbance(noise=lambda n, noise=noise: float(noise[n]))
            trace = replay(scene, ours(target), 3000, time=lambda n, t=time: t, disturbance=disturbance)
            share = np.mean(np.abs(trace.clean_ms[20:] / target - 1) <= 0.1)
            rows.append((share, *(trace.energy(a, a + 1000) for a in (0, 1000, 2000))))
        share, *energies = np.mean(rows, axis=0)
        print(
            f"  noise {name:8}  within ±10 % {share:4.0%};  energy of each thousand frames "
            + ", ".join(f"{energy:.4f}" for energy in energies)
        )


def ours(target: float) -> FrameTimeController:
    """Ours, within the limits."""
    return FrameTimeController(target, min_quality=LIMITS[0], max_quality=LIMITS[1])


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--frames", type=int, default=3600)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--targets", type=float, nargs="+", default=[60, 90, 120], help="frames a second")
    options = parser.parse_args()
    times = np.arange(options.frames) / RATE
    for scene in RecordedScene.load(RECORDED).values():
        print(f"{scene.name}, at rest")
        steps(scene)
        rests(scene, options.seed)
        noise = np.random.default_rng(options.seed).choice(scene.noise, options.frames)
        disturbance = Disturbance(noise=lambda n, noise=noise: float(noise[n]))
        for rate in options.targets:
            target = 1e3 / rate
            free = reachable(scene, target, times)
            print(f"{scene.name}, {rate:g} Hz, {target:.1f} ms to composite in, {free.mean():.0%} are free")
            print(HEAD)
            rules: dict[str, Rule] = {
                "ours": ours(target),
                "OpenCOVER's": OpenCover(target, limits=LIMITS),
                "fixed 1": Fixed(1.0),
            }
            for name, rule in rules.items():
                trace = replay(scene, rule, options.frames, time=lambda n: n / RATE, disturbance=disturbance)
                print(row(name, trace, target, free))


if __name__ == "__main__":
    main()
