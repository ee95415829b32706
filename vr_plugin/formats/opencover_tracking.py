"""What tracks the head in a COVISE configuration.

room_from_head = device · tracked pose · body, in OpenCOVER's axes; an offset is a shift after the turn.
Source: inputdevice, trackingbody and person of OpenCOVER's input, DTrackDriver, VRPNDriver.
"""

from __future__ import annotations

import numpy as np

from .draft import DraftTracker
from .report import Report, quoted
from .scopes import Settings
from .screens import ROOM_FROM_Z_UP, turn

_INPUT = "COVER|VIVE.Input"


def head_tracker(settings: Settings, report: Report) -> DraftTracker | None:
    """The tracker of the default person's head, as one host sees it; None where there is none we can read."""
    persons = list(settings.elements(f"{_INPUT}.Persons.Person"))
    if not persons:
        system = settings.text(f"{_INPUT}.TrackingSystem")
        if system:
            report.note(f"tracking system {quoted(system)} of the old style is not read; fill in [tracker]")
        return None
    person = next((p for p in persons if p.get("default").lower() == "true"), persons[0])
    body = f"{_INPUT}.Body.{person.get('head')}"
    device_name = settings.text(body, "device") if _is_name(person.get("head")) else ""
    if not _is_name(device_name):
        report.note(f"the head of person {quoted(person.get('name'))} is tracked by no device of the file")
        return None
    if other := settings.text(body, "device1"):
        report.note(f"the head has a second tracker, {quoted(other)}; only {quoted(device_name)} is read")
    device = f"{_INPUT}.Device.{device_name}"
    tracker = _opened(settings, device, device_name, report)
    if tracker is None:
        return None
    tracker.head = settings.whole(body, "bodyIndex")
    tracker.room_turn = ROOM_FROM_Z_UP @ _turn(settings, device)
    tracker.room_offset = ROOM_FROM_Z_UP @ _offset(settings, device)
    tracker.head_turn = _turn(settings, body) @ ROOM_FROM_Z_UP.T
    tracker.head_offset = _offset(settings, body)
    hand = f"{_INPUT}.Body.{person.get('hand')}"
    if _is_name(person.get("hand")) and settings.text(hand, "device") == device_name:
        tracker.wand = settings.whole(hand, "bodyIndex")
    if tracker.kind == "dtrack":
        _count_bodies(settings, device, tracker, report)
    return tracker


def _opened(settings: Settings, device: str, name: str, report: Report) -> DraftTracker | None:
    driver = settings.text(device, "driver").lower()
    if driver == "dtrack":
        port = settings.whole(device, "port", 5000)
        if not 1 <= port <= 65535:
            raise report.broken(
                settings.host or name, f"device {quoted(name)}: a port is 1 … 65535; given {port}"
            )
        return DraftTracker("dtrack", f"udp://{port}")
    if driver == "vrpn":
        tracker = settings.text(device, "tracker")
        if tracker:
            return DraftTracker("vrpn", f"{tracker}@{settings.text(device, 'host', default='localhost')}")
    report.note(f"tracker {quoted(name)} with driver {quoted(driver)} is not read; fill in [tracker]")
    return None


def _count_bodies(settings: Settings, device: str, tracker: DraftTracker, report: Report) -> None:
    """OpenCOVER numbers DTrack's flysticks and bodies in one row, flysticks first; we each on their own."""
    base = settings.whole(device, "bodyBase", -1)
    if base < 0:
        base = tracker.wand + 1 if tracker.wand is not None and tracker.wand < tracker.head else 0
        report.note(
            f"DTrack: input {tracker.head} of OpenCOVER is taken as body {tracker.head - base}, as flysticks "
            "come first there; see which body moves with persp-sw track"
        )
    tracker.head = max(tracker.head - base, 0)
    if tracker.wand is not None and tracker.wand >= base:
        report.note(f"DTrack: the hand, input {tracker.wand} of OpenCOVER, is a body, no flystick; no wand")
        tracker.wand = None
    report.note(
        f"DTrack: {tracker.address} hears this machine alone; name an address to listen on, udp://0.0.0.0:…"
    )


def _turn(settings: Settings, path: str) -> np.ndarray:
    return turn(*(settings.number(f"{path}.Orientation", angle) for angle in "hpr"))


def _offset(settings: Settings, path: str) -> np.ndarray:
    return np.array([settings.number(f"{path}.Offset", axis) for axis in "xyz"])


def _is_name(text: str) -> bool:
    """Whether a text can be a part of a path."""
    return bool(text) and not set(".:|") & set(text)
