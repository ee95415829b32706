"""From a hand's move on the transfer function to the new picture: the preview's real loop in a real window.

    xvfb-run -a -s "-screen 0 1600x1200x24" python benchmarks/tf_drag.py [VOLUME] [--size 960 720]
        [--moves 60] [--every 0.12] [--target 30] [--quality 1] [--colours] [--json]

Without VOLUME, 256³ voxels of `synthetic_ct`. The panel is open; its first control point, which bounds what
is visible, is taken and moved a few pixels at a time, to and fro, as a mouse would; with --colours a point's
colour changes instead. A move's latency runs from the moment the window hands its event over to the moment
the buffers with its picture are swapped; a move that a later one has overtaken counts to that one's picture.
Prints medians and 95th percentiles, of the latency and of its parts; the first moves are not counted.
"""

import argparse
import json
import tempfile
from pathlib import Path
from time import monotonic, perf_counter
from types import SimpleNamespace

import numpy as np

import persp_sw as psw
from persp_sw.volume.phantoms import synthetic_ct
from vr_plugin.panel.frontend import Panel
from vr_plugin.preview import in_window
from vr_plugin.preview.session import open_preview
from vr_plugin.screen.events import Button, Pointer

_SETTLE_S = 4.0  # before the first move: compiling, refining
_REACH = 14.0  # pixels to each side
_WARM = 12  # first moves, which compile what coarse pictures need and are not counted


class DraggingLoop(in_window.PreviewLoop):
    """The preview's loop with a hand that is not there, and a watch."""

    plan = SimpleNamespace()
    latencies: list
    parts: list

    def __init__(self, *given, **more):
        super().__init__(*given, **more)
        DraggingLoop.latencies, DraggingLoop.parts = [], []
        self._moves: list[tuple[float, object]] = []  # when, and the function that it made
        self._asked, self._finished = 0, {}
        self._start = monotonic()
        self._composite_once, self.pictures.composite = self.pictures.composite, self._timed

    def _left_by_panel(self, events):
        at, before = monotonic(), self.preview.choices.edits.transfer
        left = super()._left_by_panel([*events, *self._hand(at)])
        after = self.preview.choices.edits.transfer
        if after is not before and self._asked > _WARM:
            self._moves.append((at, after))
            self._panel_ms = 1e3 * (monotonic() - at)
        return left

    def _hand(self, now: float) -> list:
        panel, plan, name = self._panel.shown, self.plan, self.window.name
        if panel is None or now < self._start + _SETTLE_S + self._asked * plan.every_s:
            return []
        number, self._asked = self._asked, self._asked + 1
        if number == 0:
            self._place = panel.places["point 0"]
        x, y = self._place
        if number > plan.moves + 8:
            self.preview.finished = True
        if number > plan.moves:
            return [Button(name, "left", False)] if number == plan.moves + 1 else []
        if plan.colours:
            share = number / plan.moves
            panel.desk.edit.set_colour(1, (share, 1 - share, 0.5))
            panel.desk.hand_over()
            return []
        place = Pointer(name, x + _REACH * np.sin(number / 3), y)
        return [place] if number else [Pointer(name, x, y), Button(name, "left", True)]

    def _timed(self, wanted, cancel=None, resting=False):
        start = perf_counter()
        done = self._composite_once(wanted, cancel, resting)
        whole, figures = 1e3 * (perf_counter() - start), done.statistics
        parts = {name: figures[f"{name}_ms"] for name in ("encode", "composite", "compile")}
        self._finished[id(done)] = {"classify and plan": whole - sum(parts.values()), **parts} | {
            "quality": figures["quality"], "samples": figures["samples"],
        }  # fmt: skip
        return done

    def _show(self, wanted, done, **more):
        start = perf_counter()
        figures = super()._show(wanted, done, **more)
        drawn, now, of = 1e3 * (perf_counter() - start), monotonic(), more.get("of")
        if of is not None:
            made = [n for n, (_, transfer) in enumerate(self._moves) if transfer is of.edits.transfer]
            if made:
                answered, self._moves = self._moves[: made[0] + 1], self._moves[made[0] + 1 :]
                self.latencies += [1e3 * (now - at) for at, _ in answered]
                self.parts.append(
                    {"panel": self._panel_ms, **self._finished.pop(id(done)), "draw and swap": drawn}
                )
        return figures


def main() -> None:
    """Drag, and print."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("volume", nargs="?")
    options.add_argument("--size", type=int, nargs=2, default=(960, 720))
    options.add_argument("--moves", type=int, default=60)
    options.add_argument("--every", type=float, default=0.12, help="seconds from move to move")
    options.add_argument(
        "--target", type=float, default=30.0, help="frames a second that quality follows; 0: none"
    )
    options.add_argument("--quality", type=float, default=1.0)
    options.add_argument("--colours", action="store_true")
    options.add_argument("--json", action="store_true")
    given = options.parse_args()
    volume = psw.load(given.volume) if given.volume else synthetic_ct(256)
    scene = psw.Scene.of_volume(volume, size=tuple(given.size))
    settings = psw.Settings(quality=given.quality)
    preview, pictures = open_preview(scene, settings, size=tuple(given.size), target_hz=given.target)
    preview.choices.panel = True
    DraggingLoop.plan = SimpleNamespace(every_s=given.every, moves=given.moves, colours=given.colours)
    in_window.PreviewLoop = DraggingLoop
    with tempfile.TemporaryDirectory() as folder:
        in_window.run_window(
            preview, pictures, folder=Path(folder), name="drag",
            open_panel=lambda window: Panel(window, preview, pictures),
        )  # fmt: skip
    latencies, parts = np.array(DraggingLoop.latencies), DraggingLoop.parts
    medians = {name: float(np.median([row[name] for row in parts])) for name in parts[0]}
    values = {
        "volume": scene.name or "synthetic_ct", "size": list(volume.size), "moves": len(latencies),
        "pictures": len(parts), "median_ms": float(np.median(latencies)),
        "p95_ms": float(np.quantile(latencies, 0.95)), "most_ms": float(latencies.max()), "parts": medians,
    }  # fmt: skip
    if given.json:
        print(json.dumps(values))
        return
    print(f"{values['moves']} moves, {values['pictures']} pictures of {volume.size} voxels")
    print(f"latency: median {values['median_ms']:.1f} ms, 95 % below {values['p95_ms']:.1f} ms, "
          f"most {values['most_ms']:.1f} ms")  # fmt: skip
    for name, value in medians.items():
        print(f"  {name:18} {value:10.2f}" + (" ms" if name not in ("quality", "samples") else ""))


if __name__ == "__main__":
    main()
