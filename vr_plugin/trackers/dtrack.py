"""A receiver of DTrack's UDP packets."""

from __future__ import annotations

import ipaddress
import logging
import socket
import struct

from . import dtrack_wire as wire
from .clock import ClockMap
from .sample import Sample, TrackerError

_log = logging.getLogger("persp_sw")

MAX_BYTES_PER_POLL = 131072
MAX_PACKETS_PER_POLL = 64
SILENT_AFTER_S = 2.0
# Flysticks are numbered on their own in DTrack; as sensors they come after all bodies.
FLYSTICK = wire.MAX_ID


class DTrack:
    """Tracks by the packets that a DTrack controller sends here.

    Bodies are the sensors 0, 1, …; flystick n is the sensor `FLYSTICK` + n. Poses in metres.

    Parameters
    ----------
    port
        Where packets are sent to.
    address
        Which of this machine's addresses listens: loopback unless another is given, "0.0.0.0" for all; a
        multicast group is joined.

    Raises
    ------
    TrackerError
        The port is taken, or the address is none of this machine's.
    """

    def __init__(self, port: int = wire.PORT, address: str = "127.0.0.1"):
        self.port, self.address = port, address
        self.damaged = 0  # entries that could not be read
        self._clock = ClockMap()
        self._seen: set[int] = set()
        self._heard: float | None = None
        self._silent = False
        self._socket: socket.socket | None = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setblocking(False)
            self._bind()
            self.port = self._socket.getsockname()[1]
        except (OSError, OverflowError, UnicodeError) as error:
            self.close()
            raise TrackerError(
                f"DTrack: cannot listen on {address}:{port} ({error}); give a free port and one of this "
                "machine's addresses (or none: then only this machine can send)"
            ) from None

    @property
    def status(self) -> str:
        """Whether packets come."""
        if self._socket is None:
            return "closed"
        what = "waiting for packets" if self._heard is None or self._silent else "packets come in"
        return f"{what} on {self.address}:{self.port}"

    def poll(self, now: float) -> list[Sample]:
        """What came since the last poll; of a flood, 64 packets and 128 kB, and the system drops the rest."""
        samples: list[Sample] = []
        left = MAX_BYTES_PER_POLL
        for _ in range(MAX_PACKETS_PER_POLL if self._socket is not None else 0):
            try:
                data = self._socket.recv(wire.MAX_PACKET)
            except BlockingIOError:
                break
            except OSError:  # what an earlier packet's sender is told is none of ours
                continue
            self._take(wire.read(data), now, samples)
            left -= len(data)
            if left <= 0:
                break
        self._listen(now)
        return samples

    def close(self) -> None:
        """Stop listening."""
        if self._socket is not None:
            self._socket.close()
        self._socket = None

    def _bind(self) -> None:
        try:
            group = ipaddress.ip_address(self.address).is_multicast
        except ValueError:
            group = False
        if group:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._socket.bind((self.address, self.port))
        if group:
            member = struct.pack("4s4s", socket.inet_aton(self.address), socket.inet_aton("0.0.0.0"))
            self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)

    def _take(self, packet: wire.Packet, now: float, samples: list[Sample]) -> None:
        self.damaged += packet.damaged
        if packet.frame < 0 and not packet.bodies and not packet.flysticks:
            return
        self._heard = now
        stamp = self._clock.ours(packet.seconds, now)
        there = set()
        for body in packet.bodies:
            there.add(body.number)
            samples.append(_pose_sample(stamp, body.number, body))
        for stick in packet.flysticks:
            sensor = FLYSTICK + stick.number
            there.add(sensor)
            samples.append(_pose_sample(stamp, sensor, stick))
            if stick.buttons:
                samples.append(Sample(stamp, sensor, kind="buttons", buttons=stick.buttons))
            if stick.axes:
                samples.append(Sample(stamp, sensor, kind="axes", axes=stick.axes))
        samples += [Sample(stamp, sensor, kind="lost") for sensor in sorted(self._seen - there)]
        self._seen = there  # so that a sensor is missed once only

    def _listen(self, now: float) -> None:
        """Say once that packets stay away, and once that they are back."""
        if self._heard is None:
            return
        silent = now - self._heard > SILENT_AFTER_S
        if silent and not self._silent:
            _log.warning("DTrack on %s:%d: no packets any more", self.address, self.port)
        elif self._silent and not silent:
            _log.warning("DTrack on %s:%d: packets are back", self.address, self.port)
        self._silent = silent


def _pose_sample(stamp: float, sensor: int, body: wire.Body) -> Sample:
    return Sample(stamp, sensor, body.pose) if body.pose else Sample(stamp, sensor, kind="lost")
