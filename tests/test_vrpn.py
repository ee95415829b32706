"""VRPN: bytes to samples, in whatever pieces; the real server's stream; client and server together."""

from __future__ import annotations

import contextlib
import logging
import socket
import struct

import numpy as np
import pytest
from data_folder import data_path
from tracker_samples import assert_pose, pose_sample, random_pose, server_stream, until

from vr_plugin.pose import Pose, turn_about
from vr_plugin.trackers import Sample, TrackerError, vrpn_client, vrpn_server
from vr_plugin.trackers import vrpn_wire as wire
from vr_plugin.trackers.vrpn_client import VrpnClient
from vr_plugin.trackers.vrpn_samples import VrpnSamples
from vr_plugin.trackers.vrpn_server import VrpnServer

ALL = 10**9


def samples_of(stream: bytes, device: str = "Tracker0", pieces: list[int] | None = None) -> list[Sample]:
    """All samples of a stream that comes in pieces, cut at these places, at once."""
    reader = VrpnSamples((device,))
    found = []
    for start, stop in zip([0, *(pieces or [])], [*(pieces or []), len(stream)], strict=True):
        reader.feed(stream[start:stop])
        found += reader.read(1.0, ALL)[1]
    assert reader.damaged == 0
    return found


def contents(samples: list[Sample]) -> list[tuple]:
    return [
        (s.sensor, s.kind, s.buttons, s.axes, None if s.pose is None else tuple(s.pose.matrix.ravel()))
        for s in samples
    ]


# --- the stream --------------------------------------------------------------------------------------------


def test_a_pose_message_is_what_the_real_server_sends():
    # Bytes of a VRPN 07.38 server: Spin0, sensor 1, turned about y.
    sent = bytes.fromhex(
        "000000586b02310700014a68000000010000000400000000"
        "0000000100000001000000000000000000000000000000000000000000000000"
        "00000000000000003fdaca30a4dabd0700000000000000003fed0fc5034d673d"
    )
    pose = Pose((0, 0, 0), (0, 0.41859069918696473, 0, 0.9081749977587844))
    seconds = 0x6B023107 + 0x14A68 * 1e-6
    ours = wire.message(1, 4, wire.pose_payload(1, pose), seconds)
    assert ours[:8] == sent[:8]
    assert abs(int.from_bytes(ours[8:12], "big") - 0x14A68) <= 1  # microseconds of a float64
    assert ours[12:40] == sent[12:40]
    sensor, read = wire.read_pose(sent[24:])
    assert sensor == 1
    assert_pose(read, pose)


def test_samples_are_exact_and_in_order(rng):
    poses = [random_pose(rng) for _ in range(40)]
    samples = samples_of(server_stream(poses))
    seen = [sample for sample in samples if sample.kind == "pose"]
    assert [sample.sensor for sample in seen] == [i % 2 for i in range(40)]
    for sample, pose in zip(seen, poses, strict=True):
        assert_pose(sample.pose, pose, atol=1e-15)
    # Sent in steps of 1/64 s; read at once, so only the last is no later than its arrival.
    np.testing.assert_allclose(np.diff([sample.stamp for sample in seen]), 1 / 64, atol=2e-6)
    assert seen[-1].stamp <= 1.0


def test_buttons_and_axes_are_states_not_changes():
    samples = samples_of(server_stream([Pose()] * 7))
    buttons = [sample.buttons for sample in samples if sample.kind == "buttons"]
    assert buttons == [
        (True,), (True, False, True), (True, False, True, False), (True, False, True), (True, False, True),
    ]  # fmt: skip
    assert [sample.axes for sample in samples if sample.kind == "axes"] == [(0.25, -0.5)] * 2


def test_pieces_do_not_matter(rng):
    stream = server_stream([random_pose(rng) for _ in range(30)])
    whole = contents(samples_of(stream))
    assert len(whole) > 40
    for _ in range(30):
        pieces = sorted(rng.integers(0, len(stream), rng.integers(1, 200)).tolist())
        assert contents(samples_of(stream, pieces=pieces)) == whole
    assert contents(samples_of(stream, pieces=list(range(1, len(stream))))) == whole


def test_a_stream_cut_off_gives_what_was_complete(rng):
    stream = server_stream([random_pose(rng) for _ in range(4)])
    whole = contents(samples_of(stream))
    for stop in range(len(stream)):
        part = contents(samples_of(stream[:stop]))
        assert part == whole[: len(part)]


@pytest.mark.parametrize("greeting", [b"HTTP/1.1 400 Bad Request", b"vrpn: ver. 06.04  0\0\0\0\0\0", b"\0"])
def test_what_greets_otherwise_is_refused(greeting):
    with pytest.raises(wire.WireError, match="greets with"):
        samples_of(greeting)


@pytest.mark.parametrize("length", [-1, 0, 23, wire.MAX_MESSAGE + 1, 2**31 - 1])
def test_a_length_that_cannot_be_ends_the_stream(length):
    with pytest.raises(wire.WireError, match=f"{length} bytes"):
        samples_of(server_stream([Pose()]) + struct.pack(">5i4x", length, 0, 0, 0, 0))


def test_what_is_no_pose_is_counted_and_left_out():
    stream = server_stream([])
    bad = [
        struct.pack(">2i7d", 0, 0, *numbers)
        for numbers in ([np.nan] * 7, [0] * 7, [1e300, 0, 0, 0, 0, 0, 1], [0, 0, 0, 1e200, 0, 0, 1])
    ]
    bad += [struct.pack(">2i7d", -5, 0, *[0] * 6, 1), b"", bytes(63), bytes(65)]
    for payload in bad:
        stream += wire.message(2, 0, payload)
    stream += wire.message(2, 2, struct.pack(">2i", 10**6, 1)) + wire.message(2, 3, struct.pack(">2i", 7, 1))
    stream += wire.message(2, 4, struct.pack(">2d", 1, np.inf))
    reader = VrpnSamples(("Tracker0",))
    reader.feed(stream + wire.message(2, 0, wire.pose_payload(3, Pose((1, 2, 3)))))
    (sample,) = reader.read(1.0, ALL)[1]
    assert sample.sensor == 3
    assert reader.damaged == len(bad) + 3


def test_further_devices_give_buttons_and_axes_only():
    stream = wire.greeting(["Head", "Wand"], [wire.POSE, wire.BUTTONS])
    for sender in (0, 1):
        stream += wire.message(sender, 0, wire.pose_payload(0, Pose((sender, 0, 0))))
        stream += wire.message(sender, 1, wire.buttons_payload([sender == 1]))
    reader = VrpnSamples(("Head", "Wand"), wand=7)
    reader.feed(stream)
    samples = reader.read(1.0, ALL)[1]
    assert [(s.kind, s.sensor) for s in samples] == [("pose", 0), ("buttons", 7), ("buttons", 7)]
    assert samples[0].pose.position[0] == 0
    assert samples[2].buttons == (True,)


# --- a real server's stream --------------------------------------------------------------------------------


def test_the_real_server_is_understood_in_any_pieces(rng):
    stream = data_path("tracking", "vrpn-07.38-server.bin").read_bytes()
    still, spin = samples_of(stream, "Tracker0"), samples_of(stream, "Spin0")
    assert len(still) == 176
    assert len(spin) == 342
    assert {sample.sensor for sample in still} == {sample.sensor for sample in spin} == {0, 1}
    for sample in still:
        assert_pose(sample.pose, Pose())
    for sample in spin:
        assert not sample.pose.position.any()
        assert abs(sample.pose.orientation[[0, 2]]).max() == 0
    # It spins about y by its clock, a turn in 10 s; stamps have microseconds, and are taken a little later.
    turns = [s.pose.orientation for s in spin if s.sensor == 0]
    angles = np.unwrap([2 * np.arctan2(turn[1], turn[3]) for turn in turns])
    stamps = np.array([s.stamp for s in spin if s.sensor == 0])
    np.testing.assert_allclose(
        angles - angles[0], (stamps - stamps[0]) * 2 * np.pi / 10, atol=0.001 * 2 * np.pi / 10
    )
    assert 1 / np.median(np.diff(stamps)) == pytest.approx(60, rel=0.05)
    whole = contents(spin)
    for _ in range(3):
        pieces = sorted(rng.integers(0, len(stream), 500).tolist())
        assert contents(samples_of(stream, "Spin0", pieces)) == whole


def test_the_real_server_cut_off_or_damaged_never_fails_otherwise(rng):
    stream = data_path("tracking", "vrpn-07.38-server.bin").read_bytes()[:20000]
    for _ in range(200):
        damaged = bytearray(stream[: rng.integers(1, len(stream))])
        for place in rng.integers(0, len(damaged), 5):
            damaged[place] = rng.integers(0, 256)
        reader = VrpnSamples(("Spin0",))
        reader.feed(bytes(damaged))
        try:
            for sample in reader.read(1.0, ALL)[1]:
                assert sample.stamp <= 1.0
        except wire.WireError:
            pass


# --- client and server -------------------------------------------------------------------------------------


@pytest.fixture
def server():
    server = VrpnServer("Tracker0", port=0)
    yield server
    server.close()


def connected(server: VrpnServer, now: float = 0.0, **keys: object) -> VrpnClient:
    """A client that the server knows."""
    client = VrpnClient((server.name,), server.address, server.port, **keys)

    def step() -> bool:
        server.send([], now)
        client.poll(now)
        return client.status.startswith("connected")

    until(step)
    return client


def received(server: VrpnServer, client: VrpnClient, count: int, now: float = 0.0) -> list[Sample]:
    found: list[Sample] = []

    def step() -> bool:
        server.send([], now)
        found.extend(client.poll(now))
        return len(found) >= count

    until(step)
    return found


def test_what_the_server_is_handed_comes_out_of_the_client(server, rng):
    poses = [random_pose(rng) for _ in range(100)]
    sent = [Sample(i / 100, i % 3, pose) for i, pose in enumerate(poses)]
    sent += [
        Sample(1.0, 1, kind="buttons", buttons=(True, False)),
        Sample(1.0, 1, kind="axes", axes=(0.5, -1.0)),
        Sample(1.0, 1, kind="lost"),  # VRPN has no word for it
    ]
    client = connected(server, now=1.0, wand=1)
    try:
        server.send(sent, now=1.0)
        found = received(server, client, len(sent) - 1, now=1.0)
    finally:
        client.close()
    assert [one[:4] for one in contents(found)] == [one[:4] for one in contents(sent[:-1])]
    for one, pose in zip(found[:100], poses, strict=True):
        assert_pose(one.pose, pose)
    stamps = np.array([sample.stamp for sample in found[:100]])
    np.testing.assert_allclose(np.diff(stamps), 0.01, atol=3e-6)


def test_two_clients_get_the_same(server):
    clients = [connected(server) for _ in range(2)]
    server.send([pose_sample(0.0, (1, 2, 3))], now=0.0)
    for client in clients:
        assert received(server, client, 1)[0].pose.position.tolist() == [1, 2, 3]
        client.close()
    until(lambda: server.send([], 0.0) or server.clients == 0)


def test_nothing_connects_or_listens_unasked(server):
    assert server.address == "127.0.0.1"
    client = VrpnClient(("Tracker0",), server.address, server.port)
    server.send([], 0.0)
    assert server.clients == 0
    client.close()
    assert client.poll(1.0) == []
    assert client.status == "closed"


def test_a_server_that_dies_is_said_once_and_found_again(caplog):
    server = VrpnServer("Tracker0", port=0)
    port = server.port
    client = connected(server)
    with caplog.at_level(logging.WARNING, "persp_sw"):
        server.close()
        now = 0.0
        until(lambda: client.poll(now) == [] and "no connection" in client.status)
        for now in np.arange(0.1, 60, 0.1):  # a minute without: it tries again and again
            assert client.poll(float(now)) == []
        assert len(caplog.records) == 1
        assert "closed" in caplog.text or "reset" in caplog.text.lower()
        server = VrpnServer("Tracker0", port=port)
        found: list[Sample] = []
        time = [60.0]

        def step() -> bool:
            time[0] += 0.05
            server.send([pose_sample(time[0], (4, 5, 6))], time[0])
            found.extend(client.poll(time[0]))
            return bool(found)

        until(step)
        assert found[0].pose.position.tolist() == [4, 5, 6]
        assert [record.getMessage().rpartition(" ")[2] for record in caplog.records][1:] == ["back"]
        assert client.reconnects == 1
        for now in time[0] + np.arange(0, 6, 0.1):  # a good while, and away again: no long wait now
            server.send([], now)
            client.poll(float(now))
        server.close()
        until(lambda: client.poll(now) == [] and "no connection" in client.status)
        client.poll(now + 0.2)
        assert "no connection" in client.status
        client.poll(now + 0.26)
        assert "connecting" in client.status or "refused" in client.status
    client.close()


def test_attempts_to_connect_become_rarer(monkeypatch):
    tries = []

    class Refused:
        def __init__(self, *_):
            tries.append(now)
            raise OSError(111, "Connection refused")

    monkeypatch.setattr(vrpn_client, "_Resolver", Refused)
    client = VrpnClient(("Tracker0",), "127.0.0.1", 1)
    for step in range(3000):
        now = step / 100
        client.poll(now)
    np.testing.assert_allclose(np.diff(tries), [0.25, 0.5, 1, 2, 4, 8, 8], atol=0.011)


def test_a_name_that_cannot_be_resolved_is_no_stop():
    client = VrpnClient(("Tracker0",), "no-such-host.invalid", 3883)
    until(lambda: client.poll(0.0) == [] and "cannot be found" in client.status)
    client.close()


def test_a_silent_server_is_pinged_and_then_left(server):
    client = connected(server)
    for now in np.arange(0, 60, 0.5):  # it answers pings, so silence is no loss
        received_before = client.status
        until(lambda: server.send([], now) or client.poll(now) == [])  # noqa: B023
        assert received_before.startswith("connected")
        if now % 3 == 0:
            until(lambda: _settled(server, client, now))  # noqa: B023
    assert client.reconnects == 0
    for now in (61.0, 66.0, 80.0):  # it answers no more
        client.poll(now)
    assert "silent" in client.status
    client.close()


def _settled(server: VrpnServer, client: VrpnClient, now: float, rounds: list[int] = []) -> bool:  # noqa: B006
    """A few rounds, so that a ping and its answer get through."""
    server.send([], now)
    client.poll(now)
    rounds.append(1)
    return len(rounds) % 5 == 0


def test_a_server_that_greets_and_leaves_is_not_asked_ever_so_often():
    listener = socket.create_server(("127.0.0.1", 0))
    listener.setblocking(False)
    client = VrpnClient(("Tracker0",), *listener.getsockname())
    visits = 0
    for step in range(1500):  # 15 s, and a little real time for the system to carry bytes
        client.poll(step / 100)
        try:
            peer, _ = listener.accept()
        except BlockingIOError:
            continue
        visits += 1
        peer.sendall(wire.COOKIE)
        peer.close()
        until(lambda: client.poll(step / 100) == [] and "no connection" in client.status)  # noqa: B023
    client.close()
    listener.close()
    assert 3 <= visits <= 8


# --- bounds ------------------------------------------------------------------------------------------------


def test_a_flood_is_taken_in_portions():
    listener = socket.create_server(("127.0.0.1", 0))
    client = VrpnClient(("Tracker0",), *listener.getsockname())
    client.poll(0.0)
    peer, _ = listener.accept()
    peer.setblocking(False)
    flood = server_stream([]) + wire.message(2, 2, wire.button_payload(1, True)) * 50_000
    sent, found, most = 0, 0, 0

    def step() -> bool:
        nonlocal sent, found, most
        with contextlib.suppress(BlockingIOError):
            sent += peer.send(flood[sent : sent + 10**6])
        count = len(client.poll(0.0))
        found, most = found + count, max(most, count)
        return found == 50_000

    until(step)
    assert most == vrpn_client.MAX_MESSAGES_PER_POLL
    client.close()
    peer.close()
    listener.close()


def test_the_server_lets_go_who_does_not_read(server, caplog):
    deaf = socket.create_connection((server.address, server.port))
    deaf.sendall(wire.COOKIE)
    until(lambda: server.send([], 0.0) or server.clients == 1)
    samples = [pose_sample(0.0)] * 1000
    until(lambda: server.send(samples, 0.0) or server.clients == 0)
    assert server.dropped == 1
    assert "does not read" in caplog.text
    deaf.close()


def test_the_server_takes_so_many_clients_and_no_nonsense(server):
    crowd = []
    for _ in range(20):
        crowd.append(socket.create_connection((server.address, server.port)))
        server.send([], 0.0)
    until(lambda: server.send([], 0.0) or server.clients == vrpn_server.MAX_CLIENTS)
    for one in crowd[:3]:
        one.sendall(b"GET / HTTP/1.1\r\n\r\n")
    until(lambda: server.send([], 0.0) or server.dropped == 3)
    server.send([], 10.0)  # the others have not greeted within 5 s
    assert server.clients == 0
    for one in crowd:
        one.close()


def test_a_port_that_is_taken_is_said(server):
    with pytest.raises(TrackerError, match="free port"):
        VrpnServer(port=server.port)
    with pytest.raises(TrackerError, match="this machine's"):
        VrpnServer(address="203.0.113.7", port=0)
    with pytest.raises(TrackerError, match="without @"):
        VrpnServer("a@b", port=0)


def test_turns_survive_the_journey(server):
    client = connected(server)
    turn = turn_about((1, 2, 3), 2.0)
    server.send([pose_sample(0.0, (0, 0, 0), 5, turn)], 0.0)
    (sample,) = received(server, client, 1)
    np.testing.assert_allclose(sample.pose.orientation, turn, atol=1e-15)
    client.close()
