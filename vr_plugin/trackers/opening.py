"""Opens what a rig's [tracker] names."""

from __future__ import annotations

from pathlib import Path

from ..pose import Pose
from ..rig import TrackerPlace
from .addresses import dtrack_address, vrpn_address
from .calibration import Calibrated
from .dtrack import DTrack
from .dtrack_samples import FLYSTICK
from .mouse import MouseTracker
from .recording import PathTracker, Recording
from .sample import NoTracker, Tracker, TrackerError
from .vrpn_client import VrpnClient


def open_tracker(
    place: TrackerPlace,
    *,
    rest_pose: Pose | None = None,
    end: str = "loop",
    folder: str | Path = ".",
    start: float | None = None,
) -> Tracker:
    """A tracker whose samples lie in the room.

    Parameters
    ----------
    place
        Kind, address, sensors and calibration.
    rest_pose
        Where a head begins that is moved by keyboard and mouse.
    end
        What a recorded path does at its end: "loop" or "hold".
    folder
        What a recorded path's name is relative to: the rig file's folder.
    start
        When a recorded path begins, on the polls' clock; None: at the first poll.

    Returns
    -------
    Tracker
        `Calibrated` around the one that listens, or a `MouseTracker`, which wants events. A VRPN server need
        not be there yet. Close it at the end.

    Raises
    ------
    TrackerError
        An address or recording that cannot be read, a port that is taken, a calibration that is none.
    """
    if place.kind == "none":
        return NoTracker()
    if place.kind == "mouse":
        return MouseTracker(rest_pose, place.head, place.wand)
    if place.kind == "vrpn":
        devices, host, port = vrpn_address(place.address)
        source: Tracker = VrpnClient(devices, host, port, place.wand)
    elif place.kind == "dtrack":
        address, port = dtrack_address(place.address)
        source = DTrack(port, address)
    elif place.kind == "path":
        source = PathTracker(Recording.load(Path(folder) / place.address), end, place.head, start)
    else:
        raise TrackerError(f"no tracker is of kind {place.kind!r}")
    try:
        return Calibrated(source, place.room_from_tracker, place.latency)
    except TrackerError:
        source.close()
        raise


def wand_sensor(place: TrackerPlace) -> int | None:
    """The number that samples of the wand carry: of DTrack a flystick's, which are numbered on their own."""
    if place.wand is None:
        return None
    return FLYSTICK + place.wand if place.kind == "dtrack" else place.wand
