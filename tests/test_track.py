"""`persp-sw track`: what it prints, how it serves, how it fails."""

from __future__ import annotations

import json
import os
import pty
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from samples import ROOT
from tracker_samples import until

from persp_sw.errors import PerspSWError
from vr_plugin.commands.track import line_of, track, yaw_pitch_roll
from vr_plugin.pose import Pose, multiply, turn_about
from vr_plugin.trackers import Sample
from vr_plugin.trackers.statistics import MAX_SENSORS, Statistics
from vr_plugin.trackers.vrpn_client import VrpnClient

ROWS = [f"{i / 100},{i / 10},1.7,0,0,0,0,1" for i in range(5)]


@pytest.fixture
def path_file(tmp_path: Path) -> Path:
    path = tmp_path / "walk.csv"
    path.write_text("\n".join(["t,x,y,z,qx,qy,qz,qw", *ROWS]))
    return path


def run(*arguments: object) -> Result:
    return CliRunner().invoke(track, [str(argument) for argument in arguments])


def test_help_teaches():
    text = run("--help").stdout
    for word in ("Examples:", "Tracker0@cave-host", "dtrack:0.0.0.0:5000", "--serve", "127.0.0.1:3883"):
        assert word in text


def test_the_program_knows_the_command():
    result = subprocess.run(
        [sys.executable, "-m", "persp_sw", "track", "--help"],
        capture_output=True,
        text=True,
        cwd=ROOT,
        timeout=60,
    )
    assert "Print what a tracker at ADDRESS tells" in result.stdout


def test_json_lines_are_the_recorded_poses(path_file):
    result = run(path_file, "--json", "--hold", "--seconds", 0.06)
    assert result.exit_code == 0, result.output
    lines = [json.loads(line) for line in result.stdout.splitlines()]
    assert [line["position"][0] for line in lines[:5]] == [0, 0.1, 0.2, 0.3, 0.4]
    assert lines[0].keys() == {"stamp", "sensor", "kind", "position", "orientation"}
    np.testing.assert_allclose(np.diff([line["stamp"] for line in lines[:5]]), 0.01, atol=1e-9)


def test_buttons_and_axes_have_lines_too():
    assert line_of(Sample(1.0, 2, kind="buttons", buttons=(True, False))) == {
        "stamp": 1.0, "sensor": 2, "kind": "buttons", "buttons": (True, False),
    }  # fmt: skip
    assert line_of(Sample(1.0, 2, kind="axes", axes=(0.5,)))["axes"] == (0.5,)
    assert line_of(Sample(1.0, 2, kind="lost")) == {"stamp": 1.0, "sensor": 2, "kind": "lost"}


def test_the_table_shows_sensors_poses_and_rate(path_file):
    result = run(path_file, "--hold", "--seconds", 0.3)
    assert result.exit_code == 0
    row = re.search(r"^ *0 +pose +\+0.400 \+1.700 \+0.000 +\+0.0 +[+-]0.0 +\+0.0 +(\d+)", result.stdout, re.M)
    assert row, result.stdout
    assert int(row[1]) > 0
    assert "replaying" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nonsense"], "no tracker is addressed like 'nonsense'"),
        (["absent.csv"], "absent.csv: cannot be read"),
        (["dtrack:127.0.0.1:0", "--seconds", "0.05"], "nothing was heard within 0.05 s: waiting"),
        (["--serve", "absent.csv"], "absent.csv"),
        (["--serve", "mouse", "--listen", "127.0.0.1:x"], "no port"),
        (["--serve", "mouse", "--listen", "203.0.113.7:0"], "cannot listen"),
    ],
)
def test_what_a_user_can_mend_is_said(arguments, said):
    result = run(*arguments)
    assert isinstance(result.exception, PerspSWError)
    assert said in str(result.exception)


@pytest.mark.parametrize("arguments", [[], ["a.csv", "--serve", "b.csv"], ["a.csv", "--seconds", "0"]])
def test_wrong_use_is_told(arguments):
    result = run(*arguments)
    assert result.exit_code == 2
    assert "Usage" in result.stderr


def served(process: subprocess.Popen, port: int, count: int, wand: int | None = None) -> list[Sample]:
    """What a client hears of a server in another process."""
    client = VrpnClient(("Head",), "127.0.0.1", port, wand)
    found: list[Sample] = []

    def step() -> bool:
        assert process.poll() is None
        found.extend(client.poll(time.monotonic()))
        return len(found) >= count

    try:
        until(step, 60)
    finally:
        client.close()
    return found


def test_a_recording_is_served_to_clients(path_file):
    command = [
        sys.executable,
        "-m",
        "persp_sw",
        "track",
        "--serve",
        path_file,
        "--listen",
        ":0",
        "--name",
        "Head",
    ]
    with subprocess.Popen([*command, "--json"], cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        try:
            said = json.loads(process.stdout.readline())
            device, _, port = said["address"].rpartition(":")
            assert device == "Head@127.0.0.1"
            found = served(process, int(port), 20)
        finally:
            process.terminate()
    assert {round(sample.pose.position[0], 3) for sample in found} == {0, 0.1, 0.2, 0.3, 0.4}


def test_the_mouse_of_a_terminal_is_served():
    command = [
        sys.executable,
        "-m",
        "persp_sw",
        "track",
        "--serve",
        "mouse",
        "--listen",
        ":0",
        "--name",
        "Head",
    ]
    ours, theirs = pty.openpty()
    with subprocess.Popen(
        [*command, "--json", "--wand", "1"], cwd=ROOT, stdin=theirs, stdout=theirs
    ) as process:
        os.close(theirs)
        try:
            text = b""
            while b"}" not in text or b"\x1b[?1006h" not in text:
                text += os.read(ours, 1000)
            port = int(re.search(rb":(\d+)\"", text)[1])
            assert served(process, port, 1)[0].pose.position.tolist() == [0, 1.7, 0]
            os.write(ours, b"\x1b[<64;10;10M")  # the wheel: ahead
            until(lambda: served(process, port, 1)[0].pose.position[2] < -0.05)
            process.send_signal(signal.SIGINT)  # Ctrl-C ends it, without a complaint
            assert process.wait(30) == 0
            assert b"\x1b[?1002l" in os.read(ours, 1000)
        finally:
            process.terminate()
            os.close(ours)


# --- figures -----------------------------------------------------------------------------------------------


def test_rate_and_latency_are_those_of_the_last_seconds():
    statistics = Statistics()
    for i in range(1000):
        statistics.add([Sample(i / 100 - 0.004 - 0.1 * (i % 5 == 0), 3, Pose())], i / 100)
    one = statistics.sensors[3, "pose"]
    assert one.rate_hz(9.99) == pytest.approx(100, rel=0.01)
    assert one.latency_s(9.99) == pytest.approx(0.004)
    assert one.count == 1000
    assert one.latency_s(20.0) is None
    assert one.rate_hz(20.0) == 0


def test_of_very_many_sensors_the_rest_is_counted_only():
    statistics = Statistics()
    statistics.add([Sample(0.0, i, Pose()) for i in range(10_000)], 0.0)
    assert (len(statistics.sensors), statistics.samples) == (MAX_SENSORS, 10_000)


def test_angles_are_yaw_pitch_and_roll(rng):
    for yaw, pitch, roll in rng.uniform(-80, 80, (20, 3)):
        turn = turn_about((0, 1, 0), np.deg2rad(yaw))
        turn = multiply(turn, turn_about((1, 0, 0), np.deg2rad(pitch)))
        turn = multiply(turn, turn_about((0, 0, 1), np.deg2rad(roll)))
        np.testing.assert_allclose(yaw_pitch_roll(Pose((0, 0, 0), turn)), (yaw, pitch, roll), atol=1e-9)
