"""A client of a VRPN server: poses, buttons and axes by TCP, without ever waiting."""

from __future__ import annotations

import errno
import logging
import os
import socket
import threading

from . import vrpn_wire as wire
from .sample import Sample
from .vrpn_samples import VrpnSamples

_log = logging.getLogger("persp_sw")

CHUNK = 65536
MAX_BYTES_PER_POLL = 131072
MAX_MESSAGES_PER_POLL = 1024
CONNECT_S = 5.0  # to connect, and to be greeted
PING_AFTER_S = 3.0  # of silence, as VRPN's own clients do
LOST_AFTER_S = 10.0
FIRST_WAIT_S, LONGEST_WAIT_S = 0.25, 8.0
_IN_PROGRESS = (0, errno.EINPROGRESS, errno.EWOULDBLOCK, errno.EINTR)


class VrpnClient:
    """Tracks by one VRPN server.

    Parameters
    ----------
    devices, wand
        See `VrpnSamples`.
    host, port
        Where the server is. A name is resolved in a thread, for that can take seconds.

    It connects at the first `poll`; when the server is not there or goes away, it says so once, tries again
    after 0.25, 0.5, … 8 s, and says when it is back. From one poll to the next it takes 128 kB and 1024
    messages at most; the rest stays with the sender.
    """

    def __init__(self, devices: tuple[str, ...], host: str, port: int = wire.PORT, wand: int | None = None):
        self.devices, self.host, self.port, self.wand = devices, host, port, wand
        self.reconnects = 0
        self._status = "not connected yet"
        self._socket: socket.socket | None = None
        self._state = "idle"
        self._retry_at = -float("inf")
        self._wait = FIRST_WAIT_S
        self._complained = False
        self._resolver: _Resolver | None = None

    @property
    def status(self) -> str:
        """Connected, connecting, or why not."""
        return self._status

    def poll(self, now: float) -> list[Sample]:
        """What came since the last poll. Never waits, never raises for what a network does."""
        samples: list[Sample] = []
        try:
            if self._state == "idle" and now >= self._retry_at:
                self._start(now)
            if self._state == "resolving":
                self._resolved(now)
            if self._state == "connecting":
                self._connected(now)
            if self._state in ("greeting", "live"):
                self._read(now, samples)
        except (OSError, wire.WireError) as error:
            self._lose(now, getattr(error, "strerror", None) or str(error))
        return samples

    def close(self) -> None:
        """Leave the server."""
        if self._socket is not None:
            self._socket.close()
        self._socket, self._state, self._retry_at = None, "idle", float("inf")
        self._status = "closed"

    @property
    def _where(self) -> str:
        return f"{self.host}:{self.port}"

    def _start(self, now: float) -> None:
        self._status = f"connecting to {self._where}"
        self._resolver = _Resolver(self.host, self.port)
        self._state, self._since = "resolving", now

    def _resolved(self, now: float) -> None:
        if not self._resolver.done.is_set():
            if now - self._since > CONNECT_S:
                raise OSError("its name is not answered for")
            return
        if self._resolver.error:
            raise OSError(self._resolver.error)
        family, address = self._resolver.result
        self._socket = socket.socket(family, socket.SOCK_STREAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        code = self._socket.connect_ex(address)
        if code not in _IN_PROGRESS:
            raise OSError(code, os.strerror(code))
        self._state, self._since = "connecting", now

    def _connected(self, now: float) -> None:
        code = self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        if code:
            raise OSError(code, os.strerror(code))
        try:
            self._socket.getpeername()
        except OSError:
            if now - self._since > CONNECT_S:
                raise OSError("no answer") from None
            return
        # A few hundred bytes always fit into a new connection's buffer.
        self._socket.send(wire.greeting(self.devices, [wire.PING]))
        self._stream = VrpnSamples(self.devices, self.wand)
        self._state, self._since, self._heard, self._pinged = "greeting", now, now, now

    def _read(self, now: float, samples: list[Sample]) -> None:
        left, messages = MAX_BYTES_PER_POLL, MAX_MESSAGES_PER_POLL
        while True:
            count, found = self._stream.read(now, messages)
            messages -= count
            samples += found
            if self._stream.greeted and self._state == "greeting":
                self._welcome(now)
            # What the limit cuts off waits in the stream; nothing is read on top of that.
            if messages <= 0 or left <= 0 or self._stream.waiting > wire.MAX_MESSAGE:
                break
            try:
                data = self._socket.recv(min(CHUNK, left))
            except BlockingIOError:
                break
            if not data:
                raise OSError("the server has closed the connection")
            self._heard = now
            left -= len(data)
            self._stream.feed(data)
        if now - self._since > CONNECT_S:
            if self._state == "greeting":
                raise OSError("it does not greet")
            self._wait = FIRST_WAIT_S  # only now: one that greets and leaves must not be asked ever so often
        if now - self._heard > LOST_AFTER_S:
            raise OSError(f"silent for {LOST_AFTER_S:.0f} s")
        if now - max(self._heard, self._pinged) > PING_AFTER_S:
            self._pinged = now
            self._socket.send(wire.message(0, 0, b""))

    def _welcome(self, now: float) -> None:
        self._state, self._since = "live", now
        self._status = f"connected to {self._where}"
        if self._complained:
            self.reconnects += 1
            self._complained = False
            _log.warning("VRPN %s is back", self._where)

    def _lose(self, now: float, why: str) -> None:
        if self._socket is not None:
            self._socket.close()
        self._socket, self._state = None, "idle"
        self._retry_at = now + self._wait
        self._wait = min(2 * self._wait, LONGEST_WAIT_S)
        self._status = f"no connection to {self._where}: {why}"
        if not self._complained:
            self._complained = True
            _log.warning("VRPN %s: %s; trying again until it answers", self._where, why)


class _Resolver:
    """A host's address, found in a thread unless it is a number."""

    def __init__(self, host: str, port: int):
        self.done = threading.Event()
        self.error = ""
        self.result: tuple[int, tuple] = (0, ())
        try:
            self._find(host, port, socket.AI_NUMERICHOST)
        except (OSError, UnicodeError):
            threading.Thread(target=self._look_up, args=(host, port), daemon=True).start()

    def _look_up(self, host: str, port: int) -> None:
        try:
            self._find(host, port, 0)
        except (OSError, UnicodeError) as error:
            self.error = f"the host's address cannot be found ({error})"
            self.done.set()

    def _find(self, host: str, port: int, flags: int) -> None:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=flags)
        # VRPN servers listen on IPv4.
        found.sort(key=lambda one: one[0] != socket.AF_INET)
        self.result = (found[0][0], found[0][4])
        self.done.set()
