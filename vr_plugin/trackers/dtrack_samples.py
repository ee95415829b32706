"""Samples out of DTrack's packets. No sockets here."""

from __future__ import annotations

from collections.abc import Iterable

from . import dtrack_wire as wire
from .clock import ClockMap
from .sample import Sample

# Flysticks are numbered on their own in DTrack; as sensors they come after all bodies.
FLYSTICK = wire.MAX_ID


class DTrackSamples:
    """One controller's packets, from bytes to samples in metres.

    Bodies are the sensors 0, 1, …; flystick n is the sensor `FLYSTICK` + n. One that is not seen gives "lost"
    in every packet that says so; one that is not named any more, once.

    Attributes
    ----------
    damaged
        Entries that could not be read.
    """

    def __init__(self):
        self.damaged = 0
        self._clock = ClockMap()
        self._named: set[int] = set()

    def read(self, packets: Iterable[bytes], now: float) -> list[Sample]:
        """Samples of packets that came together; none of what is no packet of DTrack's."""
        understood = []
        for packet in map(wire.read, packets):
            self.damaged += packet.damaged
            if packet.frame >= 0 or packet.bodies or packet.flysticks:
                understood.append(packet)
        stamps = self._clock.all_ours([packet.seconds for packet in understood], now)
        return [
            sample
            for packet, stamp in zip(understood, stamps, strict=True)
            for sample in self._samples(packet, stamp)
        ]

    def _samples(self, packet: wire.Packet, stamp: float) -> list[Sample]:
        samples: list[Sample] = []
        named = set()
        for first, entries in ((0, packet.bodies), (FLYSTICK, packet.flysticks)):
            for entry in entries:
                sensor = first + entry.number
                named.add(sensor)
                kind = "lost" if entry.pose is None else "pose"
                samples.append(Sample(stamp, sensor, entry.pose, kind))
                if entry.buttons:
                    samples.append(Sample(stamp, sensor, kind="buttons", buttons=entry.buttons))
                if entry.axes:
                    samples.append(Sample(stamp, sensor, kind="axes", axes=entry.axes))
        samples += [Sample(stamp, sensor, kind="lost") for sensor in sorted(self._named - named)]
        self._named = named
        return samples
