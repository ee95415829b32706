"""The bytes of VRPN (07.xx) over TCP: messages out of a stream, and into one. No sockets here.

Source: the stream of a real VRPN 07.38 server. Both sides send a cookie of 24 bytes, then messages: five
big-endian int32 (length with the header but without padding, seconds, microseconds, sender, type), 4 bytes of
padding, and a payload padded to a multiple of 8. Types below 0 are the connection's own: −1 and −2 give names
to the numbers of senders and types, −3 offers UDP, which is declined by saying nothing.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from ..pose import Pose, PoseError
from .sample import TrackerError

PORT = 3883
COOKIE_PREFIX = b"vrpn: ver. 07."
COOKIE = b"vrpn: ver. 07.38  0".ljust(24, b"\0")

# VRPN's own buffers hold 64000 bytes, and its tables 2000 names of below 100 characters.
MAX_MESSAGE = 64000
MAX_NAMES = 2000
MAX_NAME = 100
MAX_BUTTONS = 256
MAX_AXES = 128
MAX_NUMBER = 1e6  # metres, or whatever unit: what is larger is damage, and would overflow further on

POSE, BUTTON, BUTTONS, AXES = (
    "vrpn_Tracker Pos_Quat", "vrpn_Button Change", "vrpn_Button States", "vrpn_Analog Channel",
)  # fmt: skip
PING, PONG = "vrpn_Base ping_message", "vrpn_Base pong_message"

_HEADER = struct.Struct(">5i4x")
_POSE = struct.Struct(">2i7d")
_SENDER, _TYPE = -1, -2


class WireError(TrackerError):
    """Bytes that are not VRPN: the stream cannot be followed any further."""


class Message(NamedTuple):
    """One message; names are empty where the number had not been given one."""

    sender: str
    type: str
    seconds: float
    payload: bytes


class Parser:
    """Cuts one side's stream into messages, whatever pieces it comes in.

    Holds at most `MAX_MESSAGE` and what one `feed` brings, as long as `messages` is read until it ends.
    """

    def __init__(self):
        self._buffer = bytearray()
        self._greeted = False
        self._names: dict[int, dict[int, str]] = {_SENDER: {}, _TYPE: {}}

    @property
    def greeted(self) -> bool:
        """Whether the other side's cookie has come."""
        return self._greeted

    def feed(self, data: bytes) -> None:
        """Take what came."""
        self._buffer += data

    def __len__(self) -> int:
        return len(self._buffer)

    def messages(self, limit: int) -> Iterator[Message]:
        """Up to `limit` messages, names and other matters of the connection counted but not shown.

        Raises
        ------
        WireError
            No cookie of VRPN 07, or a length that cannot be. The stream is lost then.
        """
        if not self._greeted and not self._greet():
            return
        place, buffer = 0, self._buffer
        try:
            for _ in range(limit):
                if len(buffer) - place < _HEADER.size:
                    return
                length, seconds, micros, sender, kind = _HEADER.unpack_from(buffer, place)
                if not _HEADER.size <= length <= MAX_MESSAGE:
                    raise WireError(f"not VRPN: a message of {length} bytes")
                end = place + length
                if len(buffer) < place + (length + 7) // 8 * 8:
                    return
                payload = bytes(buffer[place + _HEADER.size : end])
                place += (length + 7) // 8 * 8
                if kind >= 0:
                    names, types = self._names[_SENDER], self._names[_TYPE]
                    yield Message(
                        names.get(sender, ""), types.get(kind, ""), seconds + 1e-6 * micros, payload
                    )
                elif kind in self._names:
                    self._name(self._names[kind], sender, payload)
        finally:
            del buffer[:place]

    def _greet(self) -> bool:
        start = bytes(self._buffer[: len(COOKIE_PREFIX)])
        if not COOKIE_PREFIX.startswith(start):
            raise WireError(f"not VRPN 07: it greets with {start!r}")
        self._greeted = len(self._buffer) >= len(COOKIE)
        if self._greeted:
            del self._buffer[: len(COOKIE)]
        return self._greeted

    def _name(self, names: dict[int, str], number: int, payload: bytes) -> None:
        if not 0 <= number < MAX_NAMES or len(payload) < 4:
            return
        (length,) = struct.unpack_from(">i", payload)
        if 0 < length <= min(MAX_NAME, len(payload) - 4):
            names[number] = payload[4 : 4 + length].rstrip(b"\0").decode("utf-8", "replace")


def message(sender: int, kind: int, payload: bytes, seconds: float = 0.0) -> bytes:
    """One message, padded."""
    whole = int(seconds // 1)
    head = _HEADER.pack(_HEADER.size + len(payload), whole, int((seconds - whole) * 1e6), sender, kind)
    return head + payload + bytes(-len(payload) % 8)


def naming(kind: int, number: int, name: str) -> bytes:
    """The message that gives a number its name; `kind` −1: a sender, −2: a type."""
    text = name.encode() + b"\0"
    return message(number, kind, struct.pack(">i", len(text)) + text)


def greeting(senders: Sequence[str], types: Sequence[str]) -> bytes:
    """What one side says first: the cookie, and names for the numbers it will use, counted from 0."""
    names = [naming(_SENDER, i, name) for i, name in enumerate(senders)]
    names += [naming(_TYPE, i, name) for i, name in enumerate(types)]
    return COOKIE + b"".join(names)


def pose_payload(sensor: int, pose: Pose) -> bytes:
    """Of a `POSE` message. The sensor's number twice, as VRPN does, to align what follows."""
    return _POSE.pack(sensor, sensor, *pose.position, *pose.orientation)


def buttons_payload(pressed: Sequence[bool]) -> bytes:
    """Of a `BUTTONS` message."""
    return struct.pack(f">{1 + len(pressed)}i", len(pressed), *map(int, pressed))


def button_payload(number: int, pressed: bool) -> bytes:
    """Of a `BUTTON` message."""
    return struct.pack(">2i", number, int(pressed))


def axes_payload(values: Sequence[float]) -> bytes:
    """Of an `AXES` message."""
    return struct.pack(f">{1 + len(values)}d", len(values), *values)


def read_pose(payload: bytes) -> tuple[int, Pose] | None:
    """Sensor and pose (metres) of a `POSE` message; None of one that is damaged."""
    if len(payload) != _POSE.size:
        return None
    sensor, _, *numbers = _POSE.unpack(payload)
    if sensor < 0 or not _plausible(numbers):
        return None
    try:
        return sensor, Pose(numbers[:3], numbers[3:])
    except PoseError:
        return None


def read_button(payload: bytes) -> tuple[int, bool] | None:
    """Number and state of a `BUTTON` message; None of one that is damaged."""
    if len(payload) != 8:
        return None
    number, state = struct.unpack(">2i", payload)
    return (number, state != 0) if 0 <= number < MAX_BUTTONS else None


def read_buttons(payload: bytes) -> tuple[bool, ...] | None:
    """All states of a `BUTTONS` message; None of one that is damaged."""
    count = len(payload) // 4 - 1
    if not 0 <= count <= MAX_BUTTONS or len(payload) % 4:
        return None
    said, *states = struct.unpack(f">{1 + count}i", payload)
    return tuple(state != 0 for state in states) if said == count else None


def read_axes(payload: bytes) -> tuple[float, ...] | None:
    """All values of an `AXES` message; None of one that is damaged or not finite."""
    count = len(payload) // 8 - 1
    if not 0 <= count <= MAX_AXES or len(payload) % 8:
        return None
    said, *values = struct.unpack(f">{1 + count}d", payload)
    return tuple(values) if said == count and _plausible(values) else None


def _plausible(numbers: Sequence[float]) -> bool:
    return all(-MAX_NUMBER < number < MAX_NUMBER for number in numbers)  # false of NaN, too
