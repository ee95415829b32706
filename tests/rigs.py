"""Rigs that tests share."""

from __future__ import annotations

from pathlib import Path

from samples import ROOT

from vr_plugin.rigs.file import rig_of_keys

CONFIGS = ROOT / "configs"


_TWO_WALLS = """
[[wall]]
name = "front"
lower_left = [-1.5, 0, -1.5]
lower_right = [1.5, 0, -1.5]
upper_left = [-1.5, 3, -1.5]
pixels = PIXELS
stereo = "quad"

[[wall]]
name = "floor"
lower_left = [-1.5, 0, 1.5]
lower_right = [1.5, 0, 1.5]
upper_left = [-1.5, 0, -1.5]
pixels = PIXELS
stereo = "quad"

[eyes]
rest_pose = { position = [0, 1.7, 1.0], look = [0, 0, -1] }

[world]
centre = [0, 1.2, 0]
"""


def two_walls(pixels: int) -> str:
    """A rig file: a front wall and a floor, quad-buffered, so many pixels along each edge."""
    return _TWO_WALLS.replace("PIXELS", str([pixels, pixels]))


def wall_keys(name: str = "front", **others: object) -> dict:
    """A good [[wall]]: 2 × 2 m, 2 m before the viewer."""
    keys = {
        "name": name,
        "lower_left": [-1, 0.7, -2],
        "lower_right": [1, 0.7, -2],
        "upper_left": [-1, 2.7, -2],
        "pixels": [64, 64],
    }
    return {**keys, **others}


def rig_of(*walls: dict, **keys: object):
    """A rig of these [[wall]] tables, or of a good one."""
    return rig_of_keys({"wall": list(walls) or [wall_keys()], **keys})


def assert_same_rig(a, b) -> None:
    """Every number and word of two rigs is the same, bit for bit."""
    assert described(a) == described(b)


def described(thing: object) -> object:
    """A rig or part of one as plain lists, for comparison."""
    if hasattr(thing, "__dataclass_fields__"):
        return {name: described(getattr(thing, name)) for name in thing.__dataclass_fields__}
    if hasattr(thing, "tolist"):
        return thing.tolist()
    if isinstance(thing, list | tuple):
        return [described(item) for item in thing]
    return str(thing) if isinstance(thing, Path) else thing
