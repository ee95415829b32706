"""What comes from the network can be anything: damaged packets and streams, never a failure, never too much.

A seeded share runs with the suite; `slow` runs a million. No sockets: what these hand on is fed directly.
"""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from tracker_samples import random_pose, server_stream

from vr_plugin.trackers import Sample, dtrack_wire, vrpn_wire
from vr_plugin.trackers.dtrack_samples import FLYSTICK, DTrackSamples
from vr_plugin.trackers.vrpn_samples import VrpnSamples

SPECIAL = [0, 1, 7, 23, 24, 25, 63999, 64000, 64001, 2**16, 2**31 - 1, -1, -2, -3, -(2**31)]
WORDS = [
    b"[",
    b"]",
    b"-1",
    b"nan",
    b"1e999",
    b"-0",
    b"\r\n",
    b"\0",
    b"6d",
    b"6df2 9 9",
    b" ",
    b"99999999999",
    b"\xff",
]


def check(samples: list[Sample], now: float) -> None:
    """What is handed on can be relied on."""
    for sample in samples:
        assert sample.stamp <= now
        assert sample.sensor >= 0
        if sample.kind == "pose":
            numbers = [*sample.pose.position, *sample.pose.orientation]
            assert all(abs(number) <= 1e6 for number in numbers)  # false of NaN
            assert abs(sum(q * q for q in numbers[3:]) - 1) < 1e-9
        assert len(sample.buttons) <= 256
        assert len(sample.axes) <= 128
        assert all(abs(axis) <= 1e9 for axis in sample.axes)


class Mutator:
    """Damages bytes in one to four places, in the ways in which networks and strangers do."""

    def __init__(self, rng: np.random.Generator):
        # Numbers drawn in heaps: one at a time would take longer than what is tested.
        self.rng, self._heap, self._next = rng, [], 0

    def number(self, below: int) -> int:
        if self._next >= len(self._heap):
            self._heap, self._next = self.rng.integers(0, 2**31, 100_000).tolist(), 0
        self._next += 1
        return self._heap[self._next - 1] % below

    def damage(self, data: bytes, words: list[bytes]) -> bytes:
        for _ in range(1 + self.number(4)):
            if not data:
                break
            at, way = self.number(len(data)), self.number(7)
            if way == 0:
                data = data[:at] + bytes([self.number(256)]) + data[at + 1 :]
            elif way == 1:
                data = data[:at]
            elif way == 2:
                data = data[:at] + data[at + 1 + self.number(16) :]
            elif way == 3:
                data = data[:at] + data[at:][: self.number(64)] + data[at:]
            elif way == 4:
                data = data[:at] + words[self.number(len(words))] + data[at:]
            elif way == 5:
                data = data[at:] + data[:at]
            else:
                word = words[self.number(len(words))]
                at -= at % 4
                data = data[:at] + word + data[at + len(word) :]
        return data


def fuzz_vrpn(count: int, seed: int) -> int:
    """Damaged messages, a few after each greeting, in pieces; returns how many samples came through."""
    mutator = Mutator(np.random.default_rng(seed))
    poses = [random_pose(mutator.rng) for _ in range(60)]
    greeting = server_stream([])
    body = server_stream(poses)[len(greeting) :]
    payloads = [(0, vrpn_wire.pose_payload(i % 2, pose)) for i, pose in enumerate(poses)]
    payloads += [(2, vrpn_wire.button_payload(5, True)), (3, vrpn_wire.buttons_payload([True, False, True]))]
    payloads += [(4, vrpn_wire.axes_payload([0.5, -0.5, 0.25]))]
    words = [number.to_bytes(4, "big", signed=True) for number in SPECIAL] + [
        bytes(8),
        b"\x7f\xf0" + bytes(6),
        b"\x7f\xef" + bytes(6),
    ]
    through, done, now = 0, 0, 0.0
    while done < count:
        reader = VrpnSamples(("Tracker0",), wand=1)
        reader.feed(mutator.damage(greeting, words) if mutator.number(8) == 0 else greeting)
        for _ in range(40):
            way = mutator.number(16)
            if way == 0:  # damage anywhere: mostly the end of this stream
                start = 8 * mutator.number(len(body) // 8) if mutator.number(4) == 0 else 0
                packet = mutator.damage(body[start : start + 40 + mutator.number(400)], words)
            else:  # a whole message with damage inside
                kind, payload = payloads[mutator.number(len(payloads))]
                damaged = mutator.damage(payload, words) if way < 12 else payload
                sender = 2 - mutator.number(8) // 7
                packet = vrpn_wire.message(sender, kind, damaged, mutator.number(2**31) - 2**30)
            reader.feed(packet)
            now += 0.001
            done += 1
            try:
                _, samples = reader.read(now, 50)
            except vrpn_wire.WireError:
                break  # as the client does: a new connection
            check(samples, now)
            through += len(samples)
            # At most one message that is not complete, and what a limit of 50 leaves of one packet.
            assert reader.waiting <= vrpn_wire.MAX_MESSAGE
    return through


def fuzz_dtrack(count: int, seed: int) -> int:
    """Damaged packets; returns how many samples came through."""
    mutator = Mutator(np.random.default_rng(seed))
    bases = []
    for i in range(20):
        bodies = tuple(
            dtrack_wire.Body(n, random_pose(mutator.rng) if n != i % 3 else None) for n in range(2)
        )
        stick = dtrack_wire.Body(0, random_pose(mutator.rng), (True, False, True), (0.5, -0.5))
        bases.append(dtrack_wire.write(dtrack_wire.Packet(i, 1000 + i / 60, bodies, (stick,))))
    packets, through = DTrackSamples(), 0
    for done in range(count):
        samples = packets.read([mutator.damage(bases[done % len(bases)], WORDS)], done / 60)
        check(samples, done / 60)
        assert all(sample.sensor < FLYSTICK + dtrack_wire.MAX_ID for sample in samples)
        through += len(samples)
    return through


def test_damaged_vrpn_streams_neither_fail_nor_pile_up():
    assert fuzz_vrpn(75_000, seed=1) > 10_000


def test_damaged_dtrack_packets_never_fail():
    assert fuzz_dtrack(25_000, seed=2) > 10_000


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3, 7))
def test_a_million_damaged_packets(seed):
    assert fuzz_vrpn(175_000, seed) + fuzz_dtrack(75_000, seed + 100) > 50_000


def test_noise_is_no_tracker(rng):
    for _ in range(2000):
        noise = rng.bytes(int(rng.integers(0, 3000)))
        reader = VrpnSamples(("Tracker0",))
        reader.feed(noise)
        with contextlib.suppress(vrpn_wire.WireError):
            assert reader.read(1.0, 1000) == (0, [])
        assert DTrackSamples().read([noise], 1.0) == []


def test_names_and_buttons_have_bounds():
    reader = VrpnSamples(("Tracker0",))
    stream = [server_stream([])]
    stream += [vrpn_wire.naming(-1, number, "x" * 90) for number in range(-5, 5000)]
    stream += [vrpn_wire.naming(-2, 3, "y" * 5000)]
    reader.feed(b"".join(stream))
    assert reader.read(1.0, 10**6) == (0, [])
    # A number is given a name of its own anew; the parser keeps no more than VRPN's own tables do.
    assert max(map(len, reader._parser._names.values())) == vrpn_wire.MAX_NAMES
    assert vrpn_wire.read_buttons(vrpn_wire.buttons_payload([True] * 257)) is None
    assert vrpn_wire.read_axes(vrpn_wire.axes_payload([0.0] * 129)) is None
