"""Recorded paths: both formats, by time, as a tracker that says the same for the same frame times."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest
from data_folder import data_path
from tracker_samples import assert_pose, random_pose

from vr_plugin.pose import Pose, between, turn_about
from vr_plugin.trackers import PathTracker, Recording, TrackerError
from vr_plugin.trackers.recording import MAX_SAMPLES_PER_POLL

HEADER = "t,x,y,z,qx,qy,qz,qw"


def path_of(tmp_path: Path, *lines: str, header: str = HEADER, name: str = "path.csv") -> Path:
    path = tmp_path / name
    path.write_text("\n".join([header, *lines]) + "\n")
    return path


def straight(count: int = 5, step: float = 0.25) -> Recording:
    """1 m to the right a second."""
    times = np.arange(count) * step
    return Recording(100 + times, [Pose((t, 0, 0), turn_about((0, 1, 0), t)) for t in times])


def drained(tracker: PathTracker, times: object) -> list[tuple[float, tuple[float, ...]]]:
    return [(s.stamp, tuple(s.pose.matrix.ravel())) for now in times for s in tracker.poll(float(now))]


# --- files -------------------------------------------------------------------------------------------------


def test_seconds_and_nanoseconds_are_told_apart(tmp_path):
    rows = [(0.0, 1, 2, 3), (0.005, 1.5, 2, 3), (0.010, 2, 2, 3)]
    seconds = path_of(tmp_path, *(f"{1.7e9 + t},{x},{y},{z},0,0,0,1" for t, x, y, z in rows), name="s.csv")
    header = "timestamp,x,y,z,qx,qy,qz,qw,velocity_x,roll"
    nanos = path_of(
        tmp_path, *(f"{t * 1e9},{x},{y},{z},0,0,0,1,9,9" for t, x, y, z in rows), header=header, name="ns.csv"
    )
    squeezed = tmp_path / "ns.csv.gz"
    squeezed.write_bytes(gzip.compress(nanos.read_bytes()))
    for path in (seconds, nanos, squeezed):
        recording = Recording.load(path)
        np.testing.assert_allclose(recording.times, [0, 0.005, 0.01], atol=2.5e-7)  # float64 of 1.7e9
        assert [pose.position[0] for pose in recording.poses] == [1, 1.5, 2]


def test_columns_are_found_by_name_and_gaps_left_out(tmp_path):
    lines = ["0,0,0,1,7,8,9,0.5,0", "", "nan,0,0,1,0,0,0,0.5,1", ",,,,,,,,2", "0,0,0,1,1,2,3,0.5,3"]
    recording = Recording.load(path_of(tmp_path, *lines, header="qx,qy,qz,qw,z,y,x,other,Time"))
    assert recording.times.tolist() == [0, 3]
    assert recording.poses[0].position.tolist() == [9, 8, 7]


@pytest.mark.parametrize(
    ("lines", "header", "said"),
    [
        (["0,0,0,0,0,0,0,1", "1,0,0,zero,0,0,0,1"], HEADER, "line 3: not the numbers"),
        (["0,0,0,0,0,0,0,1", "1,0,0"], HEADER, "line 3: not the numbers"),
        (["1,0,0,0,0,0,0,1", "1,0,0,0,0,0,0,1"], HEADER, "line 3: its time"),
        (["0,0,0,0,0,0,0,0"], HEADER, "no poses"),
        ([], HEADER, "no poses"),
        (["0,0,0,0,0,0,0,1"], "a,x,y,z,qx,qy,qz,w", "missing: qw, t or time"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(tmp_path, lines, header, said):
    with pytest.raises(TrackerError, match=said):
        Recording.load(path_of(tmp_path, *lines, header=header))


def test_files_that_cannot_be_read_are_said(tmp_path):
    (tmp_path / "cut.csv.gz").write_bytes(gzip.compress(HEADER.encode() * 100)[:40])
    (tmp_path / "broken.csv.gz").write_bytes(b"\x1f\x8b\x08" + bytes(40))
    (tmp_path / "binary.csv").write_bytes(bytes(range(128, 256)))
    (tmp_path / "empty.csv").write_bytes(b"")
    for name in ("cut.csv.gz", "broken.csv.gz", "binary.csv", "empty.csv", "absent.csv"):
        with pytest.raises(TrackerError, match=name):
            Recording.load(tmp_path / name)


def test_the_real_paths_are_read():
    for name, count, seconds, hz in (
        ("optitrack-120hz", 13479, 112.317, 120),
        ("hololens-200hz", 12001, 60, 200),
    ):
        recording = Recording.load(data_path("tracking", f"{name}.csv.gz"))
        assert len(recording.poses) == count
        assert recording.duration == pytest.approx(seconds, abs=0.001)
        assert 1 / np.median(np.diff(recording.times)) == pytest.approx(hz, rel=0.001)
        assert max(np.abs(pose.position).max() for pose in recording.poses) < 3


# --- by time -----------------------------------------------------------------------------------------------


def test_poses_between_two_lie_between_them():
    path = straight()
    assert_pose(path.at(0.6), Pose((0.6, 0, 0), turn_about((0, 1, 0), 0.6)))
    assert_pose(path.at(-1), path.poses[0])
    assert_pose(path.at(7, "hold"), path.poses[-1])
    assert path.period == 1.25
    assert_pose(path.at(1.25 * 3 + 0.6), path.at(0.6))


# --- as a tracker ------------------------------------------------------------------------------------------


def test_the_same_frame_times_give_the_same_samples(rng):
    recording = Recording(np.cumsum(rng.uniform(0.001, 0.02, 500)), [random_pose(rng) for _ in range(500)])
    times = 50 + np.cumsum(rng.uniform(0.005, 0.03, 400))
    one, two = (drained(PathTracker(recording), times) for _ in range(2))
    assert one == two
    # In whatever steps it is polled, each pose comes once, and in order.
    fine = drained(PathTracker(recording), np.arange(times[0], times[-1], 0.001).tolist() + [times[-1]])
    np.testing.assert_allclose([s for s, _ in fine], [s for s, _ in one], atol=1e-12)
    assert [pose for _, pose in fine] == [pose for _, pose in one]
    assert (np.diff([stamp for stamp, _ in one]) > 0).all()
    assert len(one) > 600  # it went round


def test_a_loop_comes_round_after_a_period():
    tracker = PathTracker(straight(), "loop", sensor=4)
    samples = [sample for now in np.arange(10, 13, 0.1) for sample in tracker.poll(float(now))]
    stamps = [sample.stamp for sample in samples]
    np.testing.assert_allclose(stamps, 10 + np.arange(len(stamps)) * 0.25)
    assert [sample.pose.position[0] for sample in samples[4:7]] == [1.0, 0.0, 0.25]
    assert {sample.sensor for sample in samples} == {4}


def test_a_held_end_stands_still_and_is_said_anew():
    tracker = PathTracker(straight(), "hold", start=0.0)
    assert len(tracker.poll(5.0)) == 5
    for now in (5.1, 60.0):
        (sample,) = tracker.poll(now)
        assert (sample.stamp, sample.pose.position[0]) == (now, 1.0)


def test_a_long_pause_is_skipped_not_caught_up():
    tracker = PathTracker(straight(5000, 0.01), start=0.0)
    tracker.poll(0.0)
    samples = tracker.poll(100_000.0)
    assert len(samples) <= MAX_SAMPLES_PER_POLL
    assert 100_000 - 0.011 < samples[-1].stamp <= 100_000
    assert tracker.poll(100_000.0) == []


def test_an_end_that_is_none_is_refused():
    with pytest.raises(TrackerError, match="loop, hold"):
        PathTracker(straight(), "bounce")


def test_a_path_of_one_pose_stands_still():
    tracker = PathTracker(Recording(np.array([5.0]), [Pose((1, 2, 3))]), start=0.0)
    assert [s.stamp for now in np.arange(0, 3, 0.5) for s in tracker.poll(float(now))] == [0, 1, 2]
    assert_pose(tracker.recording.at(17.3), Pose((1, 2, 3)))
    assert_pose(between(Pose(), Pose((2, 0, 0)), 0.5), Pose((1, 0, 0)))
