"""DTrack: packets of text to samples, units, rotations, what is not seen; over a socket."""

from __future__ import annotations

import logging
import socket

import numpy as np
import pytest
from tracker_samples import assert_pose, random_pose, until

from vr_plugin.pose import Pose, rotation_of, turn_about
from vr_plugin.trackers import TrackerError, dtrack
from vr_plugin.trackers import dtrack_wire as wire
from vr_plugin.trackers.dtrack import DTrack
from vr_plugin.trackers.dtrack_samples import FLYSTICK, DTrackSamples

# As a controller sends it: a body turned by 90° about z takes x to y, so its first column is (0, 1, 0).
PACKET = (
    b"fr 21753\r\n"
    b"ts 39596.024831\r\n"
    b"6dcal 3\r\n"
    b"6d 2 [0 1.000][326.848 -187.216 109.503 0.0000 0.0000 90.0000]"
    b"[0.000000 1.000000 0.000000 -1.000000 0.000000 0.000000 0.000000 0.000000 1.000000] "
    b"[2 -1.000][0.000 0.000 0.000 0.0000 0.0000 0.0000]"
    b"[0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000]\r\n"
    b"6df2 1 1 [0 1.000 6 2][261.103 116.520 41.085]"
    b"[1.000000 0.000000 0.000000 0.000000 1.000000 0.000000 0.000000 0.000000 1.000000][9 -0.50 1.00]\r\n"
    b"\0"
)


def test_a_packet_is_read_as_the_manual_has_it():
    packet = wire.read(PACKET)
    assert (packet.frame, packet.seconds, packet.damaged) == (21753, 39596.024831, 0)
    seen, unseen = packet.bodies
    assert_pose(seen.pose, Pose((0.326848, -0.187216, 0.109503), turn_about((0, 0, 1), np.pi / 2)))
    assert (unseen.number, unseen.pose) == (2, None)
    (stick,) = packet.flysticks
    assert_pose(stick.pose, Pose((0.261103, 0.11652, 0.041085)))
    assert stick.buttons == (True, False, False, True, False, False)
    assert stick.axes == (-0.5, 1.0)


def test_what_is_written_is_read_again(rng):
    for _ in range(50):
        bodies = tuple(wire.Body(i, random_pose(rng) if rng.random() < 0.8 else None) for i in range(3))
        buttons = tuple(bool(b) for b in rng.integers(0, 2, 40))
        sticks = (wire.Body(1, random_pose(rng), buttons, (0.25, -0.75)), wire.Body(2))
        packet = wire.read(wire.write(wire.Packet(7, 12.5, bodies, sticks)))
        assert (packet.frame, packet.seconds, packet.damaged) == (7, 12.5, 0)
        for one, two in zip((*packet.bodies, *packet.flysticks), (*bodies, *sticks), strict=True):
            assert (one.number, one.buttons, one.axes) == (two.number, two.buttons, two.axes)
            assert (one.pose is None) == (two.pose is None)
            if one.pose is not None:  # six digits of a turn, a tenth of a micrometre of mm
                assert_pose(one.pose, two.pose, atol=2e-6)


def test_the_angles_written_are_those_of_the_matrix(rng):
    for _ in range(20):
        pose = random_pose(rng)
        text = wire.write(wire.Packet(0, 0.0, (wire.Body(0, pose),))).decode()
        rx, ry, rz = np.deg2rad([float(word) for word in text.split("][")[1].split()[3:]])
        r = [
            rotation_of(turn_about(axis, angle)) for axis, angle in zip(np.eye(3), (rx, ry, rz), strict=True)
        ]
        np.testing.assert_allclose(r[0] @ r[1] @ r[2], rotation_of(pose.orientation), atol=1e-5)


def test_what_is_not_seen_is_lost():
    packets = DTrackSamples()
    kinds = [(s.sensor, s.kind) for s in packets.read([PACKET], 5.0)]
    assert kinds == [
        (0, "pose"), (2, "lost"), (FLYSTICK, "pose"), (FLYSTICK, "buttons"), (FLYSTICK, "axes"),
    ]  # fmt: skip
    gone = b"fr 21754\r\nts 39596.03\r\n6d 0\r\n\0"
    assert [(s.sensor, s.kind) for s in packets.read([gone], 5.1)] == [(n, "lost") for n in (0, 2, FLYSTICK)]
    assert packets.read([gone], 5.2) == []


def test_stamps_of_packets_that_come_together_keep_their_steps():
    packets = [
        b"fr %d\r\nts %.6f\r\n6d 1 [0 1.0][1 2 3 0 0 0][1 0 0 0 1 0 0 0 1]\0" % (i, 100 + i / 64)
        for i in range(9)
    ]
    samples = DTrackSamples().read(packets, 7.0)
    np.testing.assert_allclose([s.stamp for s in samples], 7 - np.arange(8, -1, -1) / 64, atol=1e-9)


@pytest.mark.parametrize(
    ("entry", "damaged"),
    [
        (b"6d 1 [0 1.0][1 2 3 0 0 0][1 0 0 0 1 0 0 0 nan]", 1),
        (b"6d 1 [0 1.0][1 2 inf 0 0 0][1 0 0 0 1 0 0 0 1]", 1),
        (b"6d 1 [0 1.0][1 2 3 0 0 0][2 0 0 0 2 0 0 0 2]", 1),
        (b"6d 1 [0 1.0][1 2 3 0 0 0][1 0 0 0 1 0 0 0 -1]", 1),
        (b"6d 1 [0 1.0][1 2 3][1 0 0 0 1 0 0 0 1]", 1),
        (b"6d 1 [-4 1.0][1 2 3 0 0 0][1 0 0 0 1 0 0 0 1]", 1),
        (b"6d 1 [0 1.0][1 2 3 0 0 0]", 1),
        (b"6df2 1 1 [0 1.0 3 0][1 2 3][1 0 0 0 1 0 0 0 1][]", 1),
        (b"6df2 1 1 [0 1.0 999999999 0][1 2 3][1 0 0 0 1 0 0 0 1][1]", 1),
        (b"fr " + b"9" * 5000, 1),
        (b"6dmt 4 anything", 0),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_counted_and_left_out(entry, damaged):
    good = b"6d 1 [5 1.0][1000 0 0 0 0 0][1 0 0 0 1 0 0 0 1]\r\n"
    packet = wire.read(entry + b"\r\n" + good)
    assert packet.damaged == damaged
    assert [body.number for body in packet.bodies] == [5]
    assert packet.bodies[0].pose.position[0] == 1.0


def test_no_time_means_the_time_of_arrival():
    for line in (b"", b"ts -1\r\n", b"ts nan\r\n", b"ts 1e300\r\n"):
        packets = DTrackSamples()
        for now in (3.0, 3.1, 3.2):
            (sample,) = packets.read([line + b"6d 1 [0 1.0][1 2 3 0 0 0][1 0 0 0 1 0 0 0 1]\0"], now)
            assert sample.stamp == now


# --- over a socket -----------------------------------------------------------------------------------------


@pytest.fixture
def receiver():
    receiver = DTrack(port=0)
    yield receiver
    receiver.close()


def test_packets_are_received_on_loopback_only(receiver):
    assert receiver.address == "127.0.0.1"
    assert receiver.poll(0.0) == []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        found = []

        def step() -> bool:
            sender.sendto(PACKET, (receiver.address, receiver.port))
            found.extend(receiver.poll(1.0))
            return bool(found)

        until(step)
    assert found[0].pose.position[0] == 0.326848
    assert "come in" in receiver.status


def test_of_a_flood_the_newest_is_read(receiver):
    entry = b"[%d 1.0][1000 0 0 0 0 0][1 0 0 0 1 0 0 0 1]"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for i in range(40):  # of 1 kB each
            packet = b"fr %d\r\n6d 1 " % i + entry % i
            sender.sendto(packet + bytes(1024 - len(packet)), (receiver.address, receiver.port))
        numbers = [sample.sensor for sample in receiver.poll(1.0) if sample.kind == "pose"]
        assert numbers == list(range(24, 40))
        assert receiver.skipped == 24
        # One huge packet is read, but no more entries of it than a controller has.
        sender.sendto(b"6d 1 " + entry % 7 * 1300, (receiver.address, receiver.port))
        samples = [sample for sample in receiver.poll(2.0) if sample.kind == "pose"]
        assert len(samples) == wire.MAX_ENTRIES
        for _ in range(300):
            sender.sendto(PACKET, (receiver.address, receiver.port))
        before = receiver.skipped
        assert receiver.poll(3.0)
        assert 0 < receiver.skipped - before < dtrack.MAX_PACKETS_PER_POLL


def test_silence_is_said_once_and_so_is_its_end(receiver, caplog):
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
        caplog.at_level(logging.WARNING, "persp_sw"),
    ):
        for start in (0.0, 100.0):
            sender.sendto(PACKET, (receiver.address, receiver.port))
            until(lambda: bool(receiver.poll(start)))  # noqa: B023
            for now in np.arange(start, start + 60, 0.5):
                receiver.poll(float(now))
    said = [record.getMessage() for record in caplog.records]
    assert ["no packets" in said[0], "back" in said[1], "no packets" in said[2]] == [True] * 3
    assert len(said) == 3


def test_a_port_that_is_taken_is_said(receiver):
    for port, address in ((receiver.port, "127.0.0.1"), (0, "203.0.113.7"), (70000, "127.0.0.1")):
        with pytest.raises(TrackerError, match="cannot listen"):
            DTrack(port, address)
    receiver.close()
    receiver.close()
    assert receiver.poll(0.0) == []
