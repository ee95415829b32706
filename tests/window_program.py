"""Helpers of the programs that test_window runs on a virtual screen."""

from __future__ import annotations

import json
from dataclasses import asdict
from time import monotonic

import numpy as np

from vr_plugin.screen.events import Event, asks_to_end
from vr_plugin.window import Windows


def say(value: object) -> None:
    """One JSON value, at once."""
    print(json.dumps(value), flush=True)


def tell(event: Event) -> None:
    """An event with its kind."""
    say({"kind": type(event).__name__, **asdict(event)})


def run(windows: Windows, draw=lambda: None, seconds: float = 50.0) -> None:
    """Draw, swap and tell events until one asks to end; gives up where none ever does."""
    end = monotonic() + seconds
    while monotonic() < end:
        draw()
        windows.swap()
        events = windows.poll(0.02)
        for event in events:
            tell(event)
        if any(asks_to_end(event) for event in events):
            return
    raise SystemExit("nobody asked to end")


def settle(windows: Windows, done, seconds: float = 20.0) -> list[Event]:
    """Events until something is so, or too late: the window system answers when it likes."""
    end, events = monotonic() + seconds, windows.poll()
    while not done() and monotonic() < end:
        events += windows.poll(0.05)
    return events


def flat(colour: tuple[float, float, float], size: tuple[int, int]):
    """An eye target of one linear opaque colour."""
    from vr_plugin.screen.eye_target import EyeTarget

    target = EyeTarget(size, "float32")
    target.upload(np.broadcast_to(np.float32([*colour, 1]), (size[1], size[0], 4)))
    return target
