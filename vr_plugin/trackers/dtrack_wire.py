"""DTrack's UDP packets: lines of text to bodies and flysticks, and back. No sockets here.

Source: ART, DTrack user manual, "Output of measurement data via Ethernet". Lines end with CR LF, the packet
with NUL; positions in mm; rotations column by column; quality −1, or no entry, means not seen:

    fr 21753
    ts 39596.024831
    6dcal 2
    6d 1 [0 1.000][326.848 -187.216 109.503 -160.4704 -3.6963 -7.0913][r0 … r8]
    6df2 1 1 [0 1.000 6 2][261.103 116.520 41.085][r0 … r8][0 0.00 0.00]

A flystick's last block holds its buttons, 32 to an integer (the first in the lowest bit), then its joysticks.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from ..pose import Pose, PoseError, rotation_of

PORT = 5000
MAX_PACKET = 65536
MAX_LINES = 64
MAX_ENTRIES = 128  # of a whole packet
MAX_ID = 4096
MAX_NUMBER = 1e9  # mm
MAX_BUTTONS, MAX_AXES = 256, 64

_BLOCK = re.compile(r"\[([^\[\]]*)\]")


@dataclass(frozen=True, eq=False)
class Body:
    """One body or flystick of a packet; `pose` in metres, None where it is not seen."""

    number: int
    pose: Pose | None = None
    buttons: tuple[bool, ...] = ()
    axes: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class Packet:
    """One packet; `seconds` is NaN where it tells no time, `damaged` counts what could not be read."""

    frame: int = -1
    seconds: float = math.nan
    bodies: tuple[Body, ...] = field(default_factory=tuple)
    flysticks: tuple[Body, ...] = field(default_factory=tuple)
    damaged: int = 0


def read(data: bytes) -> Packet:
    """What a packet says. Never raises: what cannot be read is counted and left out."""
    text = data[:MAX_PACKET].split(b"\0", 1)[0].decode("ascii", "replace")
    frame, seconds, damaged, entries = -1, math.nan, 0, 0
    found: dict[str, list[Body]] = {"6d": [], "6df2": []}
    for line in text.splitlines()[:MAX_LINES]:
        kind, _, rest = line.strip().partition(" ")
        try:
            if kind == "fr":
                frame = int(rest)
            elif kind == "ts":
                seconds = float(rest)
            elif kind in found:
                blocks = [block.split() for block in _BLOCK.findall(rest)]
                size, make = (3, _body) if kind == "6d" else (4, _flystick)
                if len(blocks) % size:
                    damaged += 1
                for i in range(0, len(blocks) - size + 1, size):
                    entries += 1
                    if entries > MAX_ENTRIES:
                        damaged += 1
                        break
                    try:
                        found[kind].append(make(*blocks[i : i + size]))
                    except (ValueError, PoseError):
                        damaged += 1
        except ValueError:
            damaged += 1
    if seconds < 0:  # DTrack knows no time
        seconds = math.nan
    return Packet(frame, seconds, tuple(found["6d"]), tuple(found["6df2"]), damaged)


def write(packet: Packet) -> bytes:
    """A packet as DTrack would send it."""
    lines = [f"fr {packet.frame}"]
    if math.isfinite(packet.seconds):
        lines.append(f"ts {packet.seconds:.6f}")
    lines += [f"6dcal {len(packet.bodies)}", f"6d {len(packet.bodies)}" + _entries(packet.bodies, _body_text)]
    if packet.flysticks:
        seen = sum(one.pose is not None for one in packet.flysticks)
        lines.append(f"6df2 {len(packet.flysticks)} {seen}" + _entries(packet.flysticks, _flystick_text))
    return ("\r\n".join(lines) + "\r\n\0").encode()


def _body(head: list[str], place: list[str], turn: list[str]) -> Body:
    number, quality = _head(head, 2)
    if len(place) != 6:
        raise ValueError
    return Body(number, _pose(place[:3], turn) if quality >= 0 else None)


def _flystick(head: list[str], place: list[str], turn: list[str], state: list[str]) -> Body:
    number, quality = _head(head, 4)
    buttons, axes = int(head[2]), int(head[3])
    words = -(-buttons // 32)
    if not (0 <= buttons <= MAX_BUTTONS and 0 <= axes <= MAX_AXES and len(state) == words + axes):
        raise ValueError
    bits = [int(word) for word in state[:words]]
    pressed = tuple(bool(bits[i // 32] >> (i % 32) & 1) for i in range(buttons))
    pose = _pose(place, turn) if quality >= 0 else None
    return Body(number, pose, pressed, tuple(_numbers(state[words:], axes)))


def _head(head: list[str], length: int) -> tuple[int, float]:
    if len(head) != length:
        raise ValueError
    number, quality = int(head[0]), float(head[1])
    if not 0 <= number < MAX_ID or not math.isfinite(quality):
        raise ValueError
    return number, quality


def _pose(place: list[str], turn: list[str]) -> Pose:
    matrix = np.eye(4)
    matrix[:3, 3] = [mm / 1000 for mm in _numbers(place, 3)]
    matrix[:3, :3] = np.reshape(_numbers(turn, 9), (3, 3)).T
    return Pose.from_matrix(matrix)


def _numbers(words: list[str], count: int) -> list[float]:
    numbers = [float(word) for word in words]
    if len(numbers) != count or not all(-MAX_NUMBER < number < MAX_NUMBER for number in numbers):
        raise ValueError
    return numbers


def _entries(bodies: Iterable[Body], text: object) -> str:
    return "".join(" " + text(body) for body in bodies)


def _block(numbers: Iterable[float], digits: int) -> str:
    return "[" + " ".join(f"{number:.{digits}f}" for number in numbers) + "]"


def _parts(pose: Pose | None) -> tuple[np.ndarray, np.ndarray]:
    """Position in mm and the nine numbers of the turn; zeros of what is not seen."""
    if pose is None:
        return np.zeros(3), np.zeros(9)
    return 1000 * pose.position, rotation_of(pose.orientation).T.ravel()


def _body_text(body: Body) -> str:
    place, turn = _parts(body.pose)
    r = turn.reshape(3, 3).T
    angles = np.rad2deg(
        [
            math.atan2(-r[1, 2], r[2, 2]),
            math.asin(min(max(r[0, 2], -1.0), 1.0)),
            math.atan2(-r[0, 1], r[0, 0]),
        ]
    )  # rx, ry, rz of R = Rx·Ry·Rz
    quality = -1.0 if body.pose is None else 1.0
    return f"[{body.number} {quality:.3f}]" + _block([*place, *angles], 4) + _block(turn, 6)


def _flystick_text(body: Body) -> str:
    place, turn = _parts(body.pose)
    quality = -1.0 if body.pose is None else 1.0
    words = [0] * -(-len(body.buttons) // 32)
    for i, pressed in enumerate(body.buttons):
        words[i // 32] |= int(pressed) << (i % 32)
    head = f"[{body.number} {quality:.3f} {len(body.buttons)} {len(body.axes)}]"
    state = " ".join([*map(str, words), *(f"{axis:.2f}" for axis in body.axes)])
    return head + _block(place, 3) + _block(turn, 6) + f"[{state}]"
