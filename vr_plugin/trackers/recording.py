"""Recorded paths: a CSV file of poses, by time or as a tracker."""

from __future__ import annotations

import csv
import gzip
import io
import zlib
from pathlib import Path

import numpy as np

from ..pose import Pose, between
from .sample import Sample, TrackerError

TIMES = ("t", "time", "timestamp")
COLUMNS = ("x", "y", "z", "qx", "qy", "qz", "qw")
ENDS = ("loop", "hold")
MAX_SAMPLES_PER_POLL = 1024
# No tracker makes steps of 1000 s, none of 1000 ns.
NANOSECONDS_FROM = 1000.0


class Recording:
    """A path of one sensor.

    Parameters
    ----------
    times
        (n,) seconds, ascending; kept relative to the first.
    poses
        n poses.
    name
        For messages.

    Raises
    ------
    TrackerError
        No pose, or times that do not ascend.
    """

    def __init__(self, times: np.ndarray, poses: list[Pose], name: str = "recording"):
        times = np.asarray(times, np.float64)
        if not len(poses) or times.shape != (len(poses),):
            raise TrackerError(f"{name}: no poses in it")
        if not np.isfinite(times).all() or not (np.diff(times) > 0).all():
            raise TrackerError(f"{name}: its times do not ascend")
        self.name, self.poses, self.first_time = name, tuple(poses), float(times[0])
        self.times = times - times[0]

    @classmethod
    def load(cls, path: str | Path) -> Recording:
        """Read `.csv` or `.csv.gz`.

        The first line names the columns: a time (`t`, `time` or `timestamp`), x, y, z, qx, qy, qz, qw; others
        are left alone. Times are seconds, or nanoseconds where they step by 1000 and more. Lines whose pose
        is empty or NaN are gaps.

        Raises
        ------
        TrackerError
            A file that cannot be read, with the line's number.
        """
        path = Path(path)
        lines = _lines(path)
        header = [name.strip().lower() for name in lines[0]] if lines else []
        time_name = next((name for name in TIMES if name in header), None)
        missing = [name for name in COLUMNS if name not in header] + (
            [] if time_name else [" or ".join(TIMES)]
        )
        if missing:
            raise TrackerError(
                f"{path}: a recorded path names its columns in its first line; missing: {', '.join(missing)}"
            )
        wanted = [header.index(name) for name in (time_name, *COLUMNS)]
        rows = []
        for number, line in enumerate(lines[1:], 2):
            if not line:
                continue
            try:
                row = [float(line[i] or "nan") for i in wanted]
            except (ValueError, IndexError):
                raise TrackerError(f"{path}, line {number}: not the numbers that line 1 names") from None
            if np.isfinite(row).all() and any(row[4:]):
                rows.append((number, row))
        times = np.array([row[0] for _, row in rows])
        wrong = np.flatnonzero(np.diff(times) <= 0)
        if len(wrong):
            raise TrackerError(f"{path}, line {rows[wrong[0] + 1][0]}: its time is not after the line before")
        if len(times) > 1 and np.median(np.diff(times)) >= NANOSECONDS_FROM:
            times = times * 1e-9
        return cls(times, [Pose(row[1:4], row[4:]) for _, row in rows], str(path))

    @property
    def duration(self) -> float:
        """Seconds from the first pose to the last."""
        return float(self.times[-1])

    @property
    def period(self) -> float:
        """Seconds of one turn of a loop: the duration and one median step more."""
        return self.duration + (float(np.median(np.diff(self.times))) if len(self.times) > 1 else 1.0)

    def at(self, seconds: float, end: str = "loop") -> Pose:
        """The pose so many seconds after the first, between the two recorded beside it.

        `end`: "loop" starts again after the last, "hold" stays there. Before the first it is the first.
        """
        if end == "loop":
            seconds = seconds % self.period if seconds >= 0 else 0.0
        i = int(np.searchsorted(self.times, seconds, side="right")) - 1
        if i < 0 or i >= len(self.poses) - 1:
            return self.poses[max(i, 0)]
        share = (seconds - self.times[i]) / (self.times[i + 1] - self.times[i])
        return between(self.poses[i], self.poses[i + 1], float(share))

    def since(self, last: float, now: float, end: str = "loop") -> list[tuple[float, Pose]]:
        """Poses recorded in (last, now], in seconds after the first; the latest 1024 of more."""
        if end == "hold" or now < self.period:
            return self._piece(last, now, 0.0)
        laps = range(
            max(int(last // self.period), int(now // self.period) - 1, 0), int(now // self.period) + 1
        )
        found = [pair for lap in laps for pair in self._piece(last, now, lap * self.period)]
        return found[-MAX_SAMPLES_PER_POLL:]

    def _piece(self, last: float, now: float, shift: float) -> list[tuple[float, Pose]]:
        first, stop = np.searchsorted(self.times, [last - shift, now - shift], side="right")
        first = max(first, stop - MAX_SAMPLES_PER_POLL)
        return [(shift + float(self.times[i]), self.poses[i]) for i in range(first, stop)]


class PathTracker:
    """Replays a recording as if its tracker were there.

    What a poll brings depends on nothing but the times of this poll and the one before: the same frame times
    give the same samples.

    Parameters
    ----------
    end
        "loop" or "hold".
    sensor
        Number that samples carry.
    start
        Time of the first pose on the polls' clock; None: the first poll's.
    """

    def __init__(self, recording: Recording, end: str = "loop", sensor: int = 0, start: float | None = None):
        if end not in ENDS:
            raise TrackerError(f"the end of a recorded path is one of {', '.join(ENDS)}; given {end!r}")
        self.recording, self.end, self.sensor, self.start = recording, end, sensor, start
        self._last = -np.inf

    @property
    def status(self) -> str:
        """What is replayed, and how long it is."""
        return f"replaying {self.recording.name} ({self.recording.duration:.1f} s, then {self.end})"

    def poll(self, now: float) -> list[Sample]:
        """The poses of the time since the last poll. A held end is said again at every poll."""
        if self.start is None:
            self.start = now
        seconds = now - self.start
        # One that has ended and holds is a tracker that stands still, not one that is lost.
        if self.end == "hold" and self._last >= self.recording.duration:
            return [Sample(now, self.sensor, self.recording.poses[-1])]
        found = self.recording.since(self._last, seconds, self.end)
        self._last = max(self._last, seconds)
        return [Sample(self.start + at, self.sensor, pose) for at, pose in found]

    def close(self) -> None:
        """Nothing to let go."""


def _lines(path: Path) -> list[list[str]]:
    try:
        data = path.read_bytes()
        if data[:2] == b"\x1f\x8b":
            data = gzip.decompress(data)
        return list(csv.reader(io.StringIO(data.decode("utf-8-sig"))))
    except (OSError, EOFError, zlib.error, UnicodeDecodeError, csv.Error) as error:
        raise TrackerError(f"{path}: cannot be read as a recorded path ({error})") from None
