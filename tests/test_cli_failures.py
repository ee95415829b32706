"""How the program fails: one clear message, the right exit code, never a traceback unasked."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from samples import ROOT, ball, fails, run, spawn

from persp_sw.commands.output import console


def test_a_missing_file(tmp_path: Path):
    assert "no file or folder" in fails("render", tmp_path / "none.nrrd")
    assert "no file or folder" in fails("info", tmp_path / "none.nrrd")
    assert "no scene file" in fails("render", tmp_path / "none.json")


def test_a_text_file_called_nrrd(tmp_path: Path):
    (tmp_path / "a.nrrd").write_text("this is no volume at all\n")
    for command in ("info", "render"):
        assert "a.nrrd" in fails(command, tmp_path / "a.nrrd")


def test_all_voxels_missing(tmp_path: Path):
    np.save(tmp_path / "nan.npy", np.full((4, 4, 4), np.nan, np.float32))
    assert "NaN or infinite" in fails("render", tmp_path / "nan.npy")


def test_some_voxels_missing_is_a_warning(tmp_path: Path):
    data = ball(dtype=np.float32)
    data[:2] = np.inf
    np.save(tmp_path / "some.npy", data)
    result = run("render", tmp_path / "some.npy", "--size", 16, 16, "-o", tmp_path / "a.png", "--json")
    assert result.exit_code == 0
    assert "some.npy" in json.loads(result.stdout)["volume"]
    values = run("render", tmp_path / "some.npy", "--size", 16, 16, "-o", tmp_path / "a.png")
    assert f"warning: {2 * 24 * 24} of 13824 voxels" in values.stderr


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--size", 100_000, 100_000), "size[0]: expected a number at most 16384"),
        (("--size", 0, 5), "size[0]"),
        (("--quality", 0), "quality lies between"),
        (("--quality", "nan"), "quality lies between"),
        (("--threads", 0), "threads lies between"),
        (("--threads", 9999), "threads lies between"),
        (("--residual", 2), "residual lies between"),
        (("--preset", "ct_bones"), "did you mean ct_bone?"),
        (("--eye", 1, 1, 1, "--centre", 1, 1, 1), "same point"),
        (("--fovy", 180), "fovy"),
        (("--background", 2, 0, 0), "background[0]"),
        (("--frame", 9), "frame"),
        (("--component", 3), "component"),
        (("--series", 3), "series"),
        (("--spacing", 1, 1, 0), "spacing[2]"),
    ],
)
def test_wrong_options(ball_file: Path, tmp_path: Path, options, words):
    assert words in fails("render", ball_file, "-o", tmp_path / "a.png", *options)
    assert not (tmp_path / "a.png").exists()


@pytest.mark.parametrize("name", ["a.jpg", "none/a.png", "."])
def test_an_output_that_cannot_be_is_refused_before_the_work(
    ball_file: Path, tmp_path: Path, name, monkeypatch
):
    monkeypatch.setattr("persp_sw.renderer.Renderer.__init__", lambda *_: pytest.fail("the work began"))
    assert "picture" in fails("render", ball_file, "-o", tmp_path / name)


def test_a_bad_scene_lists_all_its_problems(scene_file: Path):
    scene_file.write_text('{"volume": "ball.npy", "fovi": 3, "frames": 0, "size": [1, 2, 3]}')
    message = fails("render", scene_file)
    for words in ("3 problems", "did you mean fovy?", "frames: ", "size: expected 2 numbers"):
        assert words in message


@pytest.mark.parametrize(
    "arguments", [("rendr",), ("render",), ("info", "a", "b"), ("render", "a", "--qualty", "1")]
)
def test_usage_errors(arguments):
    assert fails(*arguments)


def test_our_own_faults_are_one_line_and_code_1(ball_file: Path, monkeypatch):
    monkeypatch.delenv("PERSP_SW_DEBUG", raising=False)
    monkeypatch.setattr("persp_sw.scene.Scene.of_file", lambda *_, **__: 1 / 0)
    message = fails("info", ball_file, code=1)
    assert "fault of the program: ZeroDivisionError" in message
    assert "PERSP_SW_DEBUG=1" in message
    assert message.count("\n") == 1


def test_a_traceback_for_who_asks(ball_file: Path):
    result = spawn("info", ball_file.with_name("none.nrrd"), PERSP_SW_DEBUG="1")
    assert result.returncode == 2
    assert "Traceback" in result.stderr


def test_interrupted(ball_file: Path, monkeypatch):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("persp_sw.scene.Scene.of_file", interrupt)
    assert fails("info", ball_file, code=130) == "error: interrupted\n"


def test_too_little_memory_is_the_users_to_mend(ball_file: Path, monkeypatch):
    def exhaust(*_, **__):
        raise MemoryError("Unable to allocate 7 EiB")

    monkeypatch.setattr("persp_sw.scene.Scene.of_file", exhaust)
    assert "not enough memory: Unable to allocate 7 EiB" in fails("info", ball_file)


# --- real processes ----------------------------------------------------------------------------------------


def test_a_process_prints_one_json_object(ball_file: Path):
    result = spawn("info", ball_file, "--json")
    assert (result.returncode, result.stderr) == (0, "")
    assert json.loads(result.stdout)["size"] == [24, 24, 24]


def test_a_process_fails_with_one_line(tmp_path: Path):
    result = spawn("render", tmp_path / "none.nrrd", "--json")
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr.startswith("error: ")
    assert "Traceback" not in result.stderr


def test_tables_leave_a_broken_pipe_to_the_program():
    with pytest.raises(BrokenPipeError):  # rich's own answer would be to exit with 1
        console().on_broken_pipe()


def test_a_reader_that_leaves_is_no_error(ball_file: Path):
    command = f"{sys.executable} -m persp_sw info {ball_file}; echo code $? >&2"
    done = subprocess.run(
        ["bash", "-c", f"({command}) | true"],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"},
        timeout=60,
    )
    assert done.stderr in ("code 141\n", "code 0\n")  # 0 where the pipe took it all before `true` left
