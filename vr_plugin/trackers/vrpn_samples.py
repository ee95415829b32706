"""Samples out of a VRPN server's stream. No sockets here."""

from __future__ import annotations

from dataclasses import replace

from . import vrpn_wire as wire
from .clock import ClockMap
from .sample import Sample


class VrpnSamples:
    """One connection's stream, from bytes to samples.

    Parameters
    ----------
    devices
        Names. Poses come from the first; buttons and axes from all.
    wand
        Sensor number that buttons and axes carry, which VRPN does not number; None: the device's place in
        `devices`.

    Attributes
    ----------
    damaged
        Messages of these devices whose content was no pose, no buttons, no axes.
    """

    def __init__(self, devices: tuple[str, ...], wand: int | None = None):
        self.devices, self.wand = devices, wand
        self.damaged = 0
        self._parser = wire.Parser()
        self._clocks = {name: ClockMap() for name in devices}
        self._buttons: dict[str, tuple[bool, ...]] = {}

    @property
    def greeted(self) -> bool:
        """Whether the server's cookie has come."""
        return self._parser.greeted

    @property
    def waiting(self) -> int:
        """Bytes that wait for `read`, or for the rest of their message."""
        return len(self._parser)

    def feed(self, data: bytes) -> None:
        """Take what came."""
        self._parser.feed(data)

    def read(self, now: float, limit: int) -> tuple[int, list[Sample]]:
        """Samples of up to `limit` messages, and how many messages that were.

        Raises
        ------
        vrpn_wire.WireError
            This is no VRPN, or not any more.
        """
        count, found = 0, []
        for message in self._parser.messages(limit):
            count += 1
            if message.sender in self._clocks:
                sample = self._sample(message)
                if sample is not None:
                    found.append((message.sender, sample))
        stamps = {
            name: iter(clock.all_ours([s.stamp for sender, s in found if sender == name], now))
            for name, clock in self._clocks.items()
        }
        return count, [replace(sample, stamp=next(stamps[sender])) for sender, sample in found]

    def _sample(self, message: wire.Message) -> Sample | None:
        """With the server's stamp."""
        place = self.devices.index(message.sender)
        sensor = self.wand if self.wand is not None else place
        if message.type == wire.POSE and place == 0:
            content = wire.read_pose(message.payload)
        elif message.type in (wire.BUTTON, wire.BUTTONS):
            content = self._pressed(message)
        elif message.type == wire.AXES:
            content = wire.read_axes(message.payload)
        else:
            return None
        if content is None:
            self.damaged += 1
            return None
        if message.type == wire.POSE:
            return Sample(message.seconds, *content)
        if message.type == wire.AXES:
            return Sample(message.seconds, sensor, kind="axes", axes=content)
        return Sample(message.seconds, sensor, kind="buttons", buttons=content)

    def _pressed(self, message: wire.Message) -> tuple[bool, ...] | None:
        """All buttons of a device after a message: one that names a single button changes that."""
        if message.type == wire.BUTTONS:
            content = wire.read_buttons(message.payload)
        else:
            change = wire.read_button(message.payload)
            if change is None:
                return None
            states = list(self._buttons.get(message.sender, ()))
            states += [False] * (change[0] + 1 - len(states))
            states[change[0]] = change[1]
            content = tuple(states)
        if content is not None:
            self._buttons[message.sender] = content
        return content
