"""A receiver of DTrack's UDP packets."""

from __future__ import annotations

import ipaddress
import logging
import socket
import struct

from . import dtrack_wire as wire
from .dtrack_samples import DTrackSamples
from .sample import Sample, TrackerError

_log = logging.getLogger("persp_sw")

MAX_PACKETS_PER_POLL = 64
# Some 25 ms of reading; a controller that reports 20 bodies 150 times a second sends less to frames of 50 ms.
MAX_BYTES_READ = 16384
SILENT_AFTER_S = 2.0


class DTrack:
    """Tracks by the packets that a DTrack controller sends here.

    See `DTrackSamples` for the sensors' numbers.

    Parameters
    ----------
    port
        Where packets are sent to.
    address
        Which of this machine's addresses listens: loopback unless another is given, "0.0.0.0" for all; a
        multicast group is joined.

    Attributes
    ----------
    skipped
        Packets that were left unread in a flood.

    Raises
    ------
    TrackerError
        The port is taken, or the address is none of this machine's.
    """

    def __init__(self, port: int = wire.PORT, address: str = "127.0.0.1"):
        self.port, self.address = port, address
        self.skipped = 0
        self._packets = DTrackSamples()
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
        """What came since the last poll; of a flood the newest 16 kB of 64 packets, no more."""
        packets: list[bytes] = []
        for _ in range(MAX_PACKETS_PER_POLL if self._socket is not None else 0):
            try:
                packets.append(self._socket.recv(wire.MAX_PACKET))
            except BlockingIOError:
                break
            except OSError:  # what an earlier packet's sender is told is none of ours
                continue
        # The newest tell where a body is now; what the older ones tell is no use by the time it is read.
        size, first = 0, len(packets)
        while first > 0 and (size == 0 or size + len(packets[first - 1]) <= MAX_BYTES_READ):
            first -= 1
            size += len(packets[first])
        self.skipped += first
        samples = self._packets.read(packets[first:], now)
        if samples:
            self._heard = now
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
