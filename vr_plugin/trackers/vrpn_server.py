"""A small VRPN server: hands poses, buttons and axes to clients, so that a rig can do without hardware."""

from __future__ import annotations

import logging
import math
import socket
import time
from collections.abc import Iterable

from . import vrpn_wire as wire
from .sample import Sample, TrackerError

_log = logging.getLogger("persp_sw")

MAX_CLIENTS = 16
MAX_WAITING = 262144  # bytes that a client may leave unread
GREETING_S = 5.0
_TYPES = (wire.POSE, wire.BUTTON, wire.BUTTONS, wire.AXES, wire.PING, wire.PONG)


class VrpnServer:
    """Serves one device by TCP; clients of VRPN's own library reach it as `name@tcp://host:port`.

    Parameters
    ----------
    name
        The device's.
    address, port
        Where it listens: loopback unless another address is given; port 0 takes a free one.

    Raises
    ------
    TrackerError
        The port is taken, or the address is none of this machine's.
    """

    def __init__(self, name: str = "Tracker0", address: str = "127.0.0.1", port: int = wire.PORT):
        if not 0 < len(name.encode()) < wire.MAX_NAME or "@" in name:
            raise TrackerError(f"a VRPN device has a name of 1 to 99 characters without @; given {name!r}")
        self.name, self.address = name, address
        self.dropped = 0  # clients that did not read, or sent what is not VRPN
        self._clients: list[_Client] = []
        try:
            self._socket = socket.create_server((address, port), backlog=MAX_CLIENTS)
        except (OSError, OverflowError, UnicodeError) as error:
            raise TrackerError(
                f"VRPN server: cannot listen on {address}:{port} ({error}); give a free port and one of this "
                "machine's addresses"
            ) from None
        self._socket.setblocking(False)
        self.port: int = self._socket.getsockname()[1]

    @property
    def clients(self) -> int:
        """How many are connected."""
        return len(self._clients)

    def send(self, samples: Iterable[Sample], now: float) -> None:
        """Hand samples to all clients and look after these; call it often, with no samples too. Never waits.

        Stamps, on the clock of `now` (`time.monotonic` as a rule), go out as times of day, as VRPN's do.
        """
        self._accept(now)
        shift = time.time() - now
        data = b"".join(map(lambda sample: _bytes_of(sample, shift), samples))
        for client in list(self._clients):
            try:
                self._attend(client, data, now, shift)
            except BlockingIOError:
                continue
            except (OSError, wire.WireError) as error:
                client.socket.close()
                self._clients.remove(client)
                self.dropped += not isinstance(error, ConnectionError)

    def close(self) -> None:
        """Stop, and let all clients go."""
        for client in self._clients:
            client.socket.close()
        self._clients.clear()
        self._socket.close()

    def _accept(self, now: float) -> None:
        for _ in range(MAX_CLIENTS):
            try:
                peer, _ = self._socket.accept()
            except OSError:  # nobody there, or not any more
                return
            if len(self._clients) >= MAX_CLIENTS:
                peer.close()
                continue
            peer.setblocking(False)
            peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._clients.append(_Client(peer, now, wire.greeting([self.name], _TYPES)))

    def _attend(self, client: _Client, data: bytes, now: float, shift: float) -> None:
        client.read(now + shift)
        if not client.parser.greeted:
            if now - client.since > GREETING_S:
                raise wire.WireError("no greeting")
            data = b""  # as VRPN's: nothing before both have greeted
        client.waiting += data
        if len(client.waiting) > MAX_WAITING:
            _log.warning("VRPN server: a client does not read what it is sent; it is let go")
            raise wire.WireError("too slow")
        client.write()


class _Client:
    """One connection."""

    def __init__(self, peer: socket.socket, now: float, greeting: bytes):
        self.socket, self.since = peer, now
        self.waiting = bytearray(greeting)
        self.parser = wire.Parser()

    def read(self, time_of_day: float) -> None:
        """Answer its pings; all else it says is no matter here. 64 kB at most."""
        try:
            data = self.socket.recv(wire.MAX_MESSAGE)
        except BlockingIOError:
            return
        if not data:
            raise ConnectionResetError
        self.parser.feed(data)
        answer = wire.message(0, _TYPES.index(wire.PONG), b"", time_of_day)
        for message in self.parser.messages(wire.MAX_MESSAGE):
            if message.type == wire.PING and len(self.waiting) < MAX_WAITING // 2:
                self.waiting += answer

    def write(self) -> None:
        """As much as the system takes."""
        while self.waiting:
            sent = self.socket.send(self.waiting)
            del self.waiting[:sent]


def _bytes_of(sample: Sample, shift: float) -> bytes:
    seconds = sample.stamp + shift
    if not math.isfinite(seconds):
        seconds = shift
    if sample.kind == "pose" and sample.pose is not None:
        return wire.message(
            0, _TYPES.index(wire.POSE), wire.pose_payload(sample.sensor, sample.pose), seconds
        )
    if sample.kind == "buttons":
        return wire.message(0, _TYPES.index(wire.BUTTONS), wire.buttons_payload(sample.buttons), seconds)
    if sample.kind == "axes":
        return wire.message(0, _TYPES.index(wire.AXES), wire.axes_payload(sample.axes), seconds)
    return b""
