"""`persp-sw trace` from outside."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from samples import ROOT, fails, result_of, run
from traces import LIMITS, session, write

import persp_sw as psw


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A long session, a short one at another target, one that says next to nothing, one without frames."""
    folder = tmp_path_factory.mktemp("traces")
    write(folder / "long.jsonl.gz", session(), LIMITS)
    write(folder / "short.jsonl", session(60, hz=30.0), LIMITS)
    write(folder / "bare.jsonl", [psw.FrameRecord(0, 0.0)])
    write(folder / "empty.jsonl", [])
    return folder


def picture(path: Path) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def colours(pixels: np.ndarray) -> int:
    return len(np.unique(pixels.reshape(-1, 3), axis=0))


def test_figures_and_picture_of_a_session(folder: Path, tmp_path: Path, monkeypatch):
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    result = run("trace", folder / "long.jsonl.gz")
    assert result.exit_code == 0, result.output
    assert result.stderr == ""
    for words in (
        "long.jsonl.gz",
        "within ± 10 %",
        "p50, p95, p99",
        "6, 2",
        "11.11",
        "the picture is trace.png",
    ):
        assert words in result.stdout
    assert colours(picture(tmp_path / "trace.png")) > 100


def test_the_picture_says_what_is_in_it(folder: Path, tmp_path: Path):
    pytest.importorskip("matplotlib")
    out = tmp_path / "deep" / "a.svg"
    assert run("trace", folder / "long.jsonl.gz", folder / "short.jsonl", "-o", out).exit_code == 0
    text = out.read_text()
    words = [
        "long.jsonl.gz",
        "short.jsonl",
        "of 11.1 ms",
        "of 33.3 ms",
        "6 missed",
        "0 missed",
        "target ± 10 %",
    ]
    words += ["3 beyond, up to", "compositing", "budget of compositing", "limits", "rung 2 samples"]
    words += ["rung 1 sample", "at rest, refined", "latency of the head", "age of the eye image", "seconds"]
    for word in words:
        assert word in text, word
    assert text.count(">Hz<") == 2  # other targets, other scales


def test_traces_of_one_target_share_their_scales(folder: Path, tmp_path: Path):
    pytest.importorskip("matplotlib")
    files = [folder / "long.jsonl.gz"] * 4  # a second row of columns
    assert run("trace", *files, "-o", tmp_path / "a.svg").exit_code == 0
    text = (tmp_path / "a.svg").read_text()
    assert text.count(">frame, ms<") == 2
    assert text.count(">Hz<") == 2
    assert text.count(">seconds<") == 4
    assert text.count(">budget of compositing<") == 1


def test_a_frame_that_says_nothing_can_be_drawn(folder: Path, tmp_path: Path):
    pytest.importorskip("matplotlib")
    for files in (["bare.jsonl"], ["bare.jsonl", "long.jsonl.gz"]):
        result = run("trace", *(folder / file for file in files), "-o", tmp_path / "a.svg")
        assert result.exit_code == 0, result.output
    assert ">quality<" in (tmp_path / "a.svg").read_text()


def test_a_spike_shows_in_the_picture(tmp_path: Path):
    pytest.importorskip("matplotlib")
    flat = [psw.FrameRecord(i, i / 90, frame_ms=10.0, target_ms=11.0) for i in range(5400)]
    write(tmp_path / "flat.jsonl", flat)
    flat[2700] = psw.FrameRecord(2700, 30.0, frame_ms=20.0, target_ms=11.0)
    write(tmp_path / "spike.jsonl", flat)
    for name in ("flat", "spike"):
        # Of both, so that the scales are the same.
        files = (tmp_path / f"{name}.jsonl", tmp_path / "spike.jsonl")
        assert run("trace", *files, "-o", tmp_path / f"{name}.png").exit_code == 0
    one, other = picture(tmp_path / "flat.png"), picture(tmp_path / "spike.png")
    left = one.shape[1] * 2 // 5  # the first trace, but for its legend
    changed = (one[80:, :left] != other[80:, :left]).any(axis=2)
    columns = np.flatnonzero(
        changed.sum(axis=0) > 50
    )  # below are 10 ms, drawn a row of pixels higher or lower
    assert 1 <= len(columns) <= 8


def test_json_for_programs(folder: Path, tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    values = result_of("trace", folder / "long.jsonl.gz", folder / "bare.jsonl")
    assert values["out"] is None
    assert list(tmp_path.iterdir()) == []
    long, bare = values["traces"]
    assert long["file"] == str(folder / "long.jsonl.gz")
    assert long["header"]["min_quality"] == 0.25
    assert (long["frames"], long["missed"], long["cut"]) == (1500, 6, False)
    assert 0 < long["within"] < 1
    assert bare["frame_ms_p50"] is None
    pytest.importorskip("matplotlib")
    values = result_of("trace", folder / "long.jsonl.gz", "-o", tmp_path / "b.png")
    assert values["out"] == str(tmp_path / "b.png")
    assert colours(picture(tmp_path / "b.png")) > 100


def test_files_of_the_same_name_are_told_apart(folder: Path, tmp_path: Path, monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    other = write(tmp_path / "short.jsonl", session(30))
    result = run("trace", folder / "short.jsonl", other)
    assert str(other) in result.stdout
    assert str(folder / "short.jsonl") in result.stdout


def test_mistakes_are_one_line(folder: Path, tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scene = tmp_path / "scene.json"
    scene.write_text('{"volume": "a.nrrd"}')
    for arguments, words in (
        ((scene,), "scene.json is no trace, line 1"),
        ((tmp_path / "none",), "cannot read the trace"),
        ((folder / "empty.jsonl",), "no frames"),
        ((folder / "short.jsonl", "-o", "a.jpg"), "drawn as .png, .svg, .pdf; given 'a.jpg'"),
        ((folder / "short.jsonl", "-o", scene / "a.png"), "cannot write"),
    ):
        message = fails("trace", *arguments)
        assert words in message
        assert message.count("\n") == 1
    assert list(tmp_path.iterdir()) == [scene]  # no empty pictures


def test_without_matplotlib_there_are_figures(folder: Path, tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    result = run("trace", folder / "short.jsonl")
    assert result.exit_code == 0
    assert "frames a second" in result.stdout
    assert "warning: the picture of a trace needs the package matplotlib: pip install" in result.stderr
    assert "persp-sw[bench]" in fails("trace", folder / "short.jsonl", "-o", "a.png")
    assert list(tmp_path.iterdir()) == []


def test_a_cut_trace_is_told(folder: Path, tmp_path: Path):
    data = (folder / "short.jsonl").read_bytes()
    (tmp_path / "cut.jsonl").write_bytes(data[:-30])
    result = run("trace", tmp_path / "cut.jsonl", "--json")
    assert '"cut": true, "frames": 59' in result.stdout
    assert "warning: " in result.stderr
    assert "is cut off; the 59 frames before that are used" in result.stderr


def test_the_documents_table_has_every_field():
    text = (ROOT / "docs" / "steady-frames.md").read_text()
    table = text[text.index("| field |") :].split("\n\n")[0]
    rows = [re.findall(r"`(\w+)`", line.split("|")[1]) for line in table.splitlines()[2:]]
    assert [name for row in rows for name in row] == list(psw.FrameRecord.__dataclass_fields__)
