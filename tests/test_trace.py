"""Traces: what is written is read again, and neither a bad disk nor a bad file does harm."""

from __future__ import annotations

import errno
import gzip
import io
import json
import math
import os
import re
import subprocess
import sys
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np
import pytest
from samples import ROOT
from traces import session, write

import persp_sw as psw
from persp_sw.errors import FileError, TraceError
from persp_sw.measure import trace as trace_module
from persp_sw.measure.trace_reading import read_trace

SUFFIXES = ("jsonl", "jsonl.gz")
# Half of the last decimal kept: 1e-6, of milliseconds 1e-4; and a float64's own rounding.
HALF = {"_s": 0.5e-6, "_ms": 0.5e-4}


def lines_of(path: Path) -> list[str]:
    data = path.read_bytes()
    return (gzip.decompress(data) if path.suffix == ".gz" else data).decode().splitlines()


# --- what is written ---------------------------------------------------------------------------------------


def test_a_line_is_compact_and_says_only_what_is_known(tmp_path: Path):
    record = psw.FrameRecord(
        7, 1.23456789, target_ms=100 / 9, quality=0.5, rung="a", missed=0, head=(0, 1.7, 0, 0, 0, 0, 1)
    )
    line = lines_of(write(tmp_path / "a.jsonl", [record]))[1]
    expected = (
        '{"frame":7,"time_s":1.234568,"head":[0.0,1.7,0.0,0.0,0.0,0.0,1.0],"target_ms":11.1111,'
        '"quality":0.5,"rung":"a"}'
    )
    assert line == expected


def test_the_header_tells_format_machine_and_what_is_given(tmp_path: Path):
    @dataclass
    class Way:
        samples: int = 2

    header = {"rig": "cave4", "settings": Way(), "size": np.array([1.5, np.nan]), "path": Path("x")}
    header |= {"format": "mine", "best": math.inf, "n": np.int64(3), "none": None}
    first = json.loads(lines_of(write(tmp_path / "deep" / "a.jsonl", [], header))[0])
    assert (first["format"], first["version"]) == ("persp_sw trace", 1)
    assert first["settings"] == {"samples": 2}
    assert first["size"] == [1.5, None]
    assert (first["path"], first["best"], first["n"], first["none"]) == ("x", None, 3, None)
    assert first["machine"]["cores"] >= 1
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\+00:00", first["started"])
    own = write(tmp_path / "b.jsonl", [], {"machine": "the cave's"})
    assert read_trace(own).header["machine"] == "the cave's"


def test_a_pose_is_seven_numbers():
    with pytest.raises(TraceError, match="a pose is"):
        psw.FrameRecord(0, 0.0, head=(0, 0, 0))
    with pytest.raises(TraceError, match="a pose is"):
        psw.FrameRecord(0, 0.0, shown_head=np.zeros((4, 4)))


def test_numpys_numbers_are_numbers(tmp_path: Path):
    record = psw.FrameRecord(
        np.int64(3), np.float64(0.5), head=np.ones(7, np.float32), missed=np.uint8(2), rewarped=np.bool_(True)
    )
    (read,) = read_trace(write(tmp_path / "a.jsonl", [record])).records()
    assert read.values() == {"frame": 3, "time_s": 0.5, "head": [1.0] * 7, "missed": 2, "rewarped": True}


# --- round trips -------------------------------------------------------------------------------------------


def random_record(random: np.random.Generator, frame: int) -> psw.FrameRecord:
    """Any fields, of any size, some of them no numbers at all; texts that JSON has to quote."""

    def number() -> float:
        odd = (0.0, -0.0, math.nan, math.inf, -math.inf)
        return float(random.choice(odd)) if random.random() < 0.1 else float(random.normal() * 10 ** size())

    def size() -> float:
        return random.uniform(-8, 9)

    def text() -> str:
        return "".join(random.choice(list('ab "\\\n\r\t\0é×\u2028\U0001f600\udc80{}'), random.integers(0, 8)))

    values: dict[str, object] = {}
    for field in fields(psw.FrameRecord):
        if random.random() < 0.3:
            continue
        kind = str(field.type).partition(" ")[0]
        if kind == "float":
            values[field.name] = number()
        elif kind == "int":
            values[field.name] = int(random.integers(-(2**53) + 1, 2**53))
        elif kind == "bool":
            values[field.name] = bool(random.integers(2))
        else:
            values[field.name] = text() if kind == "str" else [number() for _ in range(7)]
    values |= {"frame": frame, "time_s": float(random.normal() * 1e5)}
    return psw.FrameRecord(**values)


def same(name: str, value: object, kept: object) -> bool:
    """Whether a value came back as it should: rounded, or as unknown where it is no number."""
    if isinstance(value, float):
        half = next((half for end, half in HALF.items() if name.endswith(end)), HALF["_s"])
        return kept is None if not math.isfinite(value) else abs(kept - value) <= half + 1e-15 * abs(value)
    if isinstance(value, list):
        whole = all(map(math.isfinite, value))
        return all(same(name, v, k) for v, k in zip(value, kept, strict=True)) if whole else kept is None
    return type(value) is type(kept) and value == kept


@pytest.mark.parametrize("seed", range(20))
def test_any_records_come_back(tmp_path: Path, seed: int):
    random = np.random.default_rng(seed)
    records = [random_record(random, i) for i in range(40)]
    trace = read_trace(write(tmp_path / f"a.{SUFFIXES[seed % 2]}", records))
    assert not trace.cut
    assert len(trace) == len(records)
    assert trace.name.endswith(".gz") == (tmp_path / trace.name).read_bytes().startswith(b"\x1f\x8b")
    read = list(trace.records())
    for record, back in zip(records, read, strict=True):
        for name, value in asdict(record).items():
            assert same(name, value, getattr(back, name)), name
    again = read_trace(write(tmp_path / "again.jsonl", read))
    assert [r.values() for r in again.records()] == [r.values() for r in read]  # rounding settles at once


def test_columns_have_fixed_types_whatever_is_known(tmp_path: Path):
    full = session(3)
    bare = [psw.FrameRecord(i, i / 90) for i in range(2)]
    for records in (full, bare, [*full, *bare], []):
        columns = read_trace(write(tmp_path / "a.jsonl", records)).columns
        assert set(columns) == {field.name for field in fields(psw.FrameRecord)}
        for name, column in columns.items():
            assert column.shape == ((len(records), 7) if name.endswith("head") else (len(records),))
            kinds = {"frame": "i", "missed": "i", "rung": "O", "why": "O", "rewarped": "b", "refined": "b"}
            assert column.dtype.kind == kinds.get(name, "f"), name
    mixed = read_trace(write(tmp_path / "a.jsonl", [*full, *bare]))
    assert np.isnan(mixed["samples"]).tolist() == [False] * 3 + [True] * 2
    assert np.isnan(mixed["head"]).all(axis=1).tolist() == [False] * 3 + [True] * 2


# --- sessions that end badly -------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_what_was_written_before_an_interrupt_is_there(tmp_path: Path, suffix: str):
    records = session(30)
    with pytest.raises(KeyboardInterrupt), psw.TraceWriter(tmp_path / f"a.{suffix}") as writer:
        for record in records:
            writer.write(record)
        raise KeyboardInterrupt
    assert len(read_trace(tmp_path / f"a.{suffix}")) == 30


def test_a_file_cut_anywhere_has_the_frames_before_that(tmp_path: Path, caplog):
    data = write(tmp_path / "a.jsonl", session(4), {"machine": ""}).read_bytes()
    ends = [i for i, byte in enumerate(data) if byte == ord("\n")]
    cut_file = tmp_path / "cut.jsonl"
    for length in range(len(data)):
        cut_file.write_bytes(data[:length])
        caplog.clear()
        if length < ends[0]:
            with pytest.raises(TraceError, match="line 1"):
                read_trace(cut_file)
            continue
        trace = read_trace(cut_file)
        assert trace["frame"].tolist() == list(range(sum(end <= length for end in ends[1:])))
        inside = length not in ends and length - 1 not in ends
        assert trace.cut == inside
        assert [record.message for record in caplog.records] == [
            f"{cut_file} is cut off; the {len(trace)} frames before that are used"
        ] * inside


def test_a_compressed_file_cut_anywhere_has_frames_before_that(tmp_path: Path, caplog):
    data = write(tmp_path / "a.jsonl.gz", session(300)).read_bytes()
    cut_file, counts = tmp_path / "cut.jsonl.gz", []
    for length in range(len(data) // 20, len(data), len(data) // 20):
        cut_file.write_bytes(data[:length])
        caplog.clear()
        trace = read_trace(cut_file)
        assert trace.cut
        assert len(caplog.records) == 1
        assert trace["frame"].tolist() == list(range(len(trace)))
        counts.append(len(trace))
    assert counts == sorted(counts)
    assert 100 < counts[-1] <= 300


def test_a_compressed_file_cut_between_two_lines_is_told(tmp_path: Path, caplog):
    writer = psw.TraceWriter(tmp_path / "a.jsonl.gz")
    data = (tmp_path / "a.jsonl.gz").read_bytes()  # the header is there before the first frame
    writer.close()
    (tmp_path / "cut.jsonl.gz").write_bytes(data)
    trace = read_trace(tmp_path / "cut.jsonl.gz")
    assert (trace.cut, len(trace)) == (True, 0)
    assert len(caplog.records) == 1


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_killed_session_leaves_a_trace(tmp_path: Path, suffix: str, caplog):
    path = tmp_path / f"a.{suffix}"
    code = (
        "import os, sys\n"
        "import persp_sw as psw\n"
        "from traces import session\n"
        "writer = psw.TraceWriter(sys.argv[1])\n"
        "for record in session(1200): writer.write(record)\n"
        "os._exit(9)\n"
    )
    env = {**os.environ, "PYTHONPATH": f"{ROOT}{os.pathsep}{ROOT / 'tests'}"}
    done = subprocess.run([sys.executable, "-c", code, str(path)], env=env, timeout=60)
    assert done.returncode == 9
    trace = read_trace(path)
    # 64 KiB of lines, about 200 frames, were still in memory; compressed ones lie in zlib's windows, too.
    assert 400 < len(trace) < 1200
    assert trace["frame"].tolist() == list(range(len(trace)))


class FullDisk(io.RawIOBase):
    """A file on a disk with so many bytes left."""

    def __init__(self, room: int):
        self.room, self.data, self.tries = room, b"", 0

    def writable(self) -> bool:
        return True

    def write(self, data) -> int:
        self.tries += 1
        if len(self.data) + len(data) > self.room:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        self.data += bytes(data)
        return len(data)


@pytest.mark.parametrize("room", [3000, 20_000])
def test_a_full_disk_does_not_end_the_session(tmp_path: Path, monkeypatch, caplog, room: int):
    disk = FullDisk(room)
    monkeypatch.setattr(trace_module, "_opened", lambda path: io.BufferedWriter(disk, 1024))
    with psw.TraceWriter(tmp_path / "a.jsonl", {"machine": ""}) as writer:
        for record in session(200):
            writer.write(record)
        tries = disk.tries
        for record in session(50):
            writer.write(record)
        assert disk.tries == tries  # it has given up
    assert writer.failed == "No space left on device"
    assert writer.frames == 250
    assert [record.message for record in caplog.records] == [
        f"the trace {tmp_path / 'a.jsonl'} is cut off: No space left on device"
    ]
    (tmp_path / "kept.jsonl").write_bytes(disk.data)
    kept = read_trace(tmp_path / "kept.jsonl")
    assert kept["frame"].tolist() == list(range(len(kept)))
    assert len(kept) > 2


def test_a_disk_that_is_full_at_the_end_is_told(tmp_path: Path, monkeypatch, caplog):
    monkeypatch.setattr(trace_module, "_opened", lambda path: io.BufferedWriter(FullDisk(1000), 1 << 16))
    with psw.TraceWriter(tmp_path / "a.jsonl", {"machine": ""}) as writer:
        for record in session(20):
            writer.write(record)
        assert writer.failed is None
    assert writer.failed == "No space left on device"
    assert len(caplog.records) == 1
    writer.close()  # again: nothing left to do
    assert len(caplog.records) == 1


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs Linux's /dev/full")
def test_a_disk_that_is_full_at_the_start_is_an_error():
    with pytest.raises(FileError, match="cannot write the trace /dev/full: No space left on device"):
        psw.TraceWriter("/dev/full")


def test_a_file_that_cannot_be_made_is_an_error(tmp_path: Path):
    (tmp_path / "file").write_text("")
    for path in (tmp_path, tmp_path / "file" / "a.jsonl"):
        with pytest.raises(FileError, match=r"cannot write the trace .*; choose another file"):
            psw.TraceWriter(path)


# --- files that are no traces ------------------------------------------------------------------------------

HEADER = b'{"format":"persp_sw trace","version":1}\n'
GOOD = b'{"frame":0,"time_s":0.5}\n'


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "is no trace, line 1"),
        (b"\n", "is no trace, line 1"),
        (b"NRRD0004\n" + bytes(2000), "is no trace, line 1"),
        (b'{"volume": "a.nrrd"}\n', "is no trace, line 1"),
        (b"[1, 2]\n", "is no trace, line 1"),
        (HEADER[:-10], "is no trace, line 1"),
        (b'{"a":' * 100_000 + b"\n", "is no trace, line 1"),
        (HEADER + b'{"a":' * 100_000 + b"\n", "line 2: is no JSON object"),
        (b'{"format":"persp_sw trace","version":2}\n', "line 1: a trace of version 2"),
        (b'{"format":"persp_sw trace"}\n', "line 1: a trace of version None"),
        (HEADER + GOOD + b"1 2 3\n" + GOOD, "line 3: is no JSON object"),
        (HEADER + GOOD + b"\xff\xfe\n" + GOOD, "line 3: is no JSON object"),
        (HEADER + b'{"frame":0}\n', "line 2: has no time_s"),
        (HEADER + b'{"frame":null,"time_s":1}\n', "line 2: has no frame"),
        (HEADER + b'{"frame":0.5,"time_s":1}\n', "line 2: frame is not a whole number; given 0.5"),
        (HEADER + b'{"frame":true,"time_s":1}\n', "line 2: frame is not a whole number; given True"),
        (HEADER + b'{"frame":%d,"time_s":1}\n' % 2**60, "line 2: frame is not a whole number"),
        (HEADER + b'{"frame":0,"time_s":"1"}\n', "line 2: time_s is not a number; given '1'"),
        (HEADER + b'{"frame":0,"time_s":1e999}\n', "line 2: time_s is not a number; given inf"),
        (HEADER + b'{"frame":0,"time_s":NaN}\n', "line 2: time_s is not a number; given nan"),
        (HEADER + b'{"frame":0,"time_s":%s}\n' % (b"9" * 400), "line 2: time_s is not a number"),
        (HEADER + b'{"frame":0,"time_s":0,"rung":3}\n', "line 2: rung is not text; given 3"),
        (HEADER + b'{"frame":0,"time_s":0,"refined":1}\n', "line 2: refined is not true or false; given 1"),
        (HEADER + b'{"frame":0,"time_s":0,"head":[1,2]}\n', "line 2: head is not a pose of 7 numbers"),
        (
            HEADER + b'{"frame":0,"time_s":0,"head":[1,2,3,4,5,6,null]}\n',
            "line 2: head is not a pose of 7 numbers",
        ),
        (gzip.compress(HEADER + GOOD)[:-8] + bytes(8), "its compressed data are damaged"),
    ],
    ids=lambda value: value[:30] if isinstance(value, str) else "data",
)
def test_foreign_and_damaged_files_are_refused(tmp_path: Path, data: bytes, message: str):
    path = tmp_path / "a.jsonl"
    path.write_bytes(data)
    with pytest.raises(TraceError, match=re.escape(message)) as error:
        read_trace(path)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


def test_what_does_not_matter_is_no_error(tmp_path: Path, caplog):
    path = tmp_path / "a.txt"  # compressed or not is seen from the data
    more = b'{"frame":1,"time_s":1,"new_field":[{}],"quality":null,"target_ms":10}'
    path.write_bytes(gzip.compress(HEADER + b"\n" + GOOD.replace(b"\n", b"\r\n") + b"  \n" + more))
    trace = read_trace(path)
    assert trace["frame"].tolist() == [0, 1]
    assert trace["target_ms"].tolist()[1] == 10.0
    assert not trace.cut
    assert not caplog.records


def test_a_missing_file_is_an_error(tmp_path: Path):
    for path in (tmp_path / "none.jsonl", tmp_path):
        with pytest.raises(TraceError, match="cannot read the trace"):
            read_trace(path)


def test_long_files_are_read_in_pieces(tmp_path: Path, monkeypatch):
    from persp_sw.measure import trace_reading

    path = write(tmp_path / "a.jsonl", session(50))
    whole = read_trace(path)
    packed = write(tmp_path / "a.jsonl.gz", session(50))
    for size in (7, 100, 1000):
        monkeypatch.setattr(trace_reading, "_CHUNK_BYTES", size)
        for file in (path, packed):
            assert [r.values() for r in read_trace(file).records()] == [r.values() for r in whole.records()]
