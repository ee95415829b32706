"""Addresses of trackers as people write them."""

from __future__ import annotations

from typing import NamedTuple

from ..rig import TrackerPlace
from . import dtrack_wire, vrpn_wire
from .sample import TrackerError

LOOPBACK = "127.0.0.1"
FORMS = "Tracker0@host[:3883] (VRPN), dtrack[:address]:5000 (DTrack), or a recorded path (.csv, .csv.gz)"


class VrpnAddress(NamedTuple):
    """Devices of one server: the first gives poses, all give buttons and axes."""

    devices: tuple[str, ...]
    host: str
    port: int


def host_and_port(text: str, default_host: str, default_port: int, what: str) -> tuple[str, int]:
    """`host`, `host:port`, `:port`, `port` or `[v6]:port`, what is left out by default.

    Raises
    ------
    TrackerError
        A port that is no number from 0 to 65535.
    """
    text = text.strip()
    if text.startswith("["):
        host, _, port = text[1:].partition("]")
        port = port.removeprefix(":")
    elif ":" in text:
        host, _, port = text.rpartition(":")
    else:
        host, port = ("", text) if text.isdecimal() else (text, "")
    if port and not (port.isascii() and port.isdecimal() and int(port) < 65536):
        raise TrackerError(f"{what}: {port!r} is no port; give a number from 0 to 65535")
    return host or default_host, int(port) if port else default_port


def vrpn_address(text: str) -> VrpnAddress:
    """`Tracker0@host[:3883]`; `Tracker0,Wand0@host` adds devices whose buttons and axes count, too.

    Raises
    ------
    TrackerError
        No device or no host.
    """
    names, at, place = text.partition("@")
    devices = tuple(dict.fromkeys(name.strip() for name in names.split(",") if name.strip()))
    for prefix in ("tcp://", "tcp:", "x-vrpn://"):
        place = place.removeprefix(prefix)
    if not (at and devices and place.strip()) or any(
        len(name.encode()) >= vrpn_wire.MAX_NAME for name in devices
    ):
        raise TrackerError(f"a VRPN address is written Tracker0@host[:{vrpn_wire.PORT}]; given {text!r}")
    return VrpnAddress(devices, *host_and_port(place, LOOPBACK, vrpn_wire.PORT, text))


def dtrack_address(text: str) -> tuple[str, int]:
    """Address and port to listen on: `udp://[address:]5000`, `dtrack:[address:]5000`; loopback by default."""
    for prefix in ("udp://", "dtrack://", "dtrack:", "udp:", "dtrack"):
        if text.startswith(prefix):
            text = text.removeprefix(prefix)
            break
    return host_and_port(text, LOOPBACK, dtrack_wire.PORT, "DTrack")


def place_of(text: str, head: int = 0, wand: int | None = None) -> TrackerPlace:
    """What an address names, as a rig would say it.

    Raises
    ------
    TrackerError
        No form that is known; the message lists them.
    """
    text = text.strip()
    if text.startswith(("dtrack", "udp:")) and not text.endswith((".csv", ".gz")):
        dtrack_address(text)
        return TrackerPlace("dtrack", text, head, wand)
    if "@" in text:
        vrpn_address(text)
        return TrackerPlace("vrpn", text, head, wand)
    if text.endswith((".csv", ".csv.gz")):
        return TrackerPlace("path", text, head, wand)
    raise TrackerError(f"no tracker is addressed like {text!r}; write {FORMS}")
