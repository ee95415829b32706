"""A rig as the text of a rig file, for people to read and change."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence

import numpy as np

from ..pose import Pose
from ..rig import FIXED_TO, STEREO_MODES, TRACKER_KINDS, Rig, RigWall, TrackerPlace, WindowPlace
from .schema import RestPoseKeys
from .similarity import parts_of


def rig_to_toml(rig: Rig) -> str:
    """A commented rig file that `load_rig` reads back as the same rig, number by number."""
    eyes, world, quality = rig.eyes, rig.placement, rig.quality
    blocks = [
        [
            "# A rig: the walls of one installation, whose eyes look at them, what tracks those.",
            "# Lengths are metres. The room is right-handed with y up; a viewer at rest looks along -z.",
            *([f"name = {_text(rig.name)}"] if rig.name else []),
        ],
        *(_wall(wall, number == 0) for number, wall in enumerate(rig.walls)),
        [
            "[eyes]",
            f"separation = {_number(eyes.separation)}  # of the eyes; negative swaps them",
            f"offset = {_numbers(eyes.offset)}  # from the tracked point to between them: right, up, back",
            f"rest_pose = {_rest(eyes.rest_pose)}  # without a tracker, or when it is lost",
            f"near = {_number(eyes.near)}  # nothing nearer to an eye is shown",
        ],
        [
            "[tracker]",
            f"kind = {_text(rig.tracker.kind)}  # {' | '.join(TRACKER_KINDS)}",
            *_tracker(rig.tracker),
        ],
        *(["[[recording]]  # a recorded path, by its file's name", *_place(one)] for one in rig.recordings),
        [
            "[world]  # where and how large the volume stands",
            *(
                [f"room_from_world = {_similarity(world.room_from_world)}"]
                if world.room_from_world is not None
                else [
                    f"size = {_number(world.size)}  # its longest edge",
                    f"centre = {_numbers(world.centre)}"
                    if world.centre is not None
                    else "# centre = [0.0, 1.5, 0.0]  # without it: the middle of the room, at eye height",
                ]
            ),
        ],
        [
            "[quality]",
            f"target_hz = {_number(quality.target_hz)}",
            f"quality = {_number(quality.quality)}  # 1 is a pixel a voxel",
            f"min = {_number(quality.min_quality)}  # limits for steady frames",
            f"max = {_number(quality.max_quality)}",
        ],
    ]
    return "\n\n".join("\n".join(block) for block in blocks) + "\n"


def _wall(wall: RigWall, explained: bool) -> list[str]:
    def say(text: str) -> str:
        return f"  # {text}" if explained else ""

    w = wall.wall
    lines = [
        "[[wall]]",
        f"name = {_text(w.name)}",
        f"lower_left = {_numbers(w.lower_left)}{say('as the viewer sees it')}",
        f"lower_right = {_numbers(w.lower_right)}",
        f"upper_left = {_numbers(w.upper_left)}",
        f"pixels = {_wholes(w.pixels)}{say('of the picture for one eye')}",
        f"stereo = {_text(wall.stereo)}{say(' | '.join(STEREO_MODES))}",
    ]
    if wall.fixed_to != FIXED_TO[0]:
        lines.append(f"fixed_to = {_text(wall.fixed_to)}  # its corners go with the head")
    if wall.machine:
        lines.append(f"machine = {_text(wall.machine)}{say('which shows it')}")
    if wall.window != WindowPlace():
        lines.append(f"window = {_window(wall.window)}{say('screen coordinates')}")
    return lines


def _window(window: WindowPlace) -> str:
    parts = {
        "monitor": window.monitor,
        "position": window.position and _wholes(window.position),
        "size": window.size and _wholes(window.size),
        "fullscreen": "true" if window.fullscreen else None,
    }
    return _table(f"{key} = {value}" for key, value in parts.items() if value is not None)


def _rest(pose: Pose) -> str:
    look = np.round(-pose.matrix[:3, 2], 9) + 0.0
    try:
        same = np.array_equal(RestPoseKeys(look=look.tolist()).pose.orientation, pose.orientation)
    except ValueError:  # looks straight up or down
        same = False
    turn = f"look = {_numbers(look)}" if same else f"orientation = {_numbers(pose.orientation)}"
    return _table([f"position = {_numbers(pose.position)}", turn])


def _rigid(pose: Pose) -> str:
    return _table([f"position = {_numbers(pose.position)}", f"orientation = {_numbers(pose.orientation)}"])


def _tracker(place: TrackerPlace) -> list[str]:
    lines = [f"head = {place.head}  # number of the sensor or body"]
    if place.wand is not None:
        lines.append(f"wand = {place.wand}")
    return [*lines, *_place(place)]


def _place(place: TrackerPlace) -> list[str]:
    lines = [f"address = {_text(place.address)}"] if place.address else []
    lines.append(f"room_from_tracker = {_similarity(place.room_from_tracker)}")
    pose = place.sensor_from_head
    if pose.position.any() or not np.array_equal(pose.orientation, (0, 0, 0, 1)):
        lines.append(f"sensor_from_head = {_rigid(pose)}  # how the head lies in the tracked body's axes")
    return [*lines, f"latency = {_number(place.latency)}  # seconds"]


def _similarity(matrix: np.ndarray) -> str:
    matrix = np.asarray(matrix, np.float64)
    parts = parts_of(matrix)
    if parts is None:
        return "[\n" + "".join(f"  {_numbers(row)},\n" for row in matrix) + "]"
    entries = [f"position = {_numbers(parts['position'])}"]
    if parts["axes"] != ["x", "y", "z"]:
        entries.append(f"axes = [{', '.join(map(_text, parts['axes']))}]")
    entries += [
        f"{key} = {_number(parts[key])}" for key, none in (("turn", 0), ("scale", 1)) if parts[key] != none
    ]
    return _table(entries)


def _table(entries: Iterable[str]) -> str:
    return "{ " + ", ".join(entries) + " }"


def _numbers(values: Sequence[float]) -> str:
    return "[" + ", ".join(_number(value) for value in values) + "]"


def _wholes(values: Sequence[int]) -> str:
    return "[" + ", ".join(str(int(value)) for value in values) + "]"


def _number(value: float) -> str:
    return repr(float(value) + 0.0)  # shortest text that reads back as this number


def _text(value: str) -> str:
    # JSON's strings are TOML's but for DEL, which TOML wants escaped, too.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
