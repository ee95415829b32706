"""The program from outside: what it prints, what it writes, how it fails."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import click
import numpy as np
import pytest
from click.testing import CliRunner, Result
from conftest import ROOT, ball
from PIL import Image

import persp_sw as psw
from persp_sw import cli
from persp_sw.optics import presets

# DESIGN, "Command line", word for word.
CONTRACT = {
    "ms",
    "composite_ms",
    "warp_ms",
    "encode_ms",
    "compile_ms",
    "threads",
    "faces",
    "intermediate_size",
}
CONTRACT |= {"samples", "runs_bytes"}


def run(*arguments: object) -> Result:
    return CliRunner().invoke(cli.main, [str(argument) for argument in arguments])


def spawn(*arguments: object, **options) -> subprocess.CompletedProcess:
    """A real process, for what a runner inside this one cannot show."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **options.pop("env", {})}
    command = [sys.executable, "-m", "persp_sw", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, env=environment, timeout=120, **options)


def result_of(*arguments: object) -> dict:
    """The one JSON object on stdout; nothing on stderr."""
    result = run(*arguments, "--json")
    assert result.exit_code == 0, result.output
    assert result.stderr == ""
    return json.loads(result.stdout)


def fails(*arguments: object, code: int = 2) -> str:
    """The message of a run that must fail: one line `error: …`, no traceback, nothing on stdout."""
    result = run(*arguments)
    assert result.exit_code == code, result.output
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    message = result.stderr[result.stderr.index("error: ") :]
    return message


@pytest.fixture
def scene_file(ball_file: Path) -> Path:
    """A small moving scene with a smooth transfer function."""
    path = ball_file.with_name("scene.json")
    keys = {
        "volume": "ball.npy",
        "tf": [[0, 0.2, 0.3, 0.8, 0], [200, 1, 0.6, 0.3, 0.4]],
        "eye": [40, -50, 35],
        "centre": [11.5, 11.5, 11.5],
        "eye_step": [1, 0, 0],
        "frames": 5,
        "size": [48, 40],
        "background": [0, 0, 1],
    }
    path.write_text(json.dumps(keys))
    return path


# --- help and start-up -------------------------------------------------------------------------------------


def test_help_teaches_and_lists_all_commands():
    result = run("--help")
    assert result.exit_code == 0
    for word in ("info", "render", "demo", "Examples:", "Exit codes:", "persp-sw render"):
        assert word in result.stdout


@pytest.mark.parametrize("command", ["info", "render", "demo"])
def test_each_command_has_examples(command):
    result = run(command, "--help")
    assert result.exit_code == 0
    assert "Examples:" in result.stdout
    assert f"persp-sw {command}" in result.stdout


def test_help_loads_neither_numba_nor_readers():
    code = (
        "import sys\n"
        "from persp_sw.cli import main\n"
        "for arguments in (['--help'], ['info', '--help'], ['render', '--help'], ['demo', '--help']):\n"
        "    try: main(arguments)\n"
        "    except SystemExit: pass\n"
        "print(sorted({'numba', 'SimpleITK', 'tifffile', 'OpenGL'} & set(sys.modules)), file=sys.stderr)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        timeout=60,
    )
    assert done.stderr.strip() == "[]"


def test_version():
    assert run("--version").stdout == f"persp-sw, version {psw.__version__}\n"


# --- info --------------------------------------------------------------------------------------------------


def test_info_counts(ball_file: Path):
    values = result_of("info", ball_file)
    assert values["size"] == [24, 24, 24]
    assert values["dtype"] == "uint8"
    assert values["spacing"] == [1, 1, 1]
    assert values["extent"] == [23, 23, 23]
    assert values["value_range"] == [0, float(ball().max())]
    assert values["nonfinite"] == 0
    assert values["preset"] in presets.NAMES
    assert [axis["axis"] for axis in values["axes"]] == ["x", "y", "z"]
    for axis in values["axes"]:
        assert axis["dense_bytes"] == 24**3
        assert axis["bytes"] == axis["voxels_bytes"] + axis["index_bytes"]
        assert 0 < axis["mean_length"] <= 24
        assert axis["runs"] > 0


def test_info_for_people(ball_file: Path):
    result = run("info", ball_file)
    assert result.exit_code == 0
    for words in ("24 × 24 × 24 voxels", "uint8", "not stated", "mean length", "dense", "%"):
        assert words in result.stdout


def test_info_says_missing_values_and_orientation(tmp_path: Path):
    sitk = pytest.importorskip("SimpleITK")
    data = ball(dtype=np.float32)
    data[3, 4, 5] = np.nan
    image = sitk.GetImageFromArray(data)
    image.SetDirection((-1, 0, 0, 0, -1, 0, 0, 0, 1))
    sitk.WriteImage(image, str(tmp_path / "ball.nii.gz"))
    values = result_of("info", tmp_path / "ball.nii.gz")
    assert values["nonfinite"] == 1
    assert values["orientation"] == "RAS"
    result = run("info", tmp_path / "ball.nii.gz")
    assert "1 NaN or infinite (transparent)" in result.stdout
    assert "x to right, y to anterior, z to superior" in result.stdout
    assert "warning: 1 of 13824 voxels" in result.stderr


def test_info_of_a_volume_one_voxel_thick(tmp_path: Path):
    np.save(tmp_path / "thin.npy", np.arange(48, dtype=np.uint8).reshape(1, 6, 8))
    assert result_of("info", tmp_path / "thin.npy")["axes"] == []
    assert "one voxel thick" in run("info", tmp_path / "thin.npy").stdout


def test_info_of_a_scene_uses_its_transfer_function(scene_file: Path):
    assert result_of("info", scene_file)["preset"] is None


def test_options_that_choose_among_volumes(tmp_path: Path):
    raw = tmp_path / "a.raw"
    raw.write_bytes(b"12" + ball().astype(">i2").tobytes())
    options = ("--shape", 24, 24, 24, "--dtype", "int16", "--byte-order", "big", "--header-bytes", 2)
    values = result_of("info", raw, *options, "--spacing", 1, 2, 3)
    assert values["spacing"] == [1, 2, 3]
    assert values["value_range"] == [0, float(ball().max())]


# --- render ------------------------------------------------------------------------------------------------


def test_render_writes_the_last_frame(scene_file: Path, tmp_path: Path):
    values = result_of("render", scene_file, "-o", tmp_path / "out.npy")
    assert set(values) >= CONTRACT
    assert values["timed_frames"] == 5
    assert values["size"] == [48, 40]
    scene = psw.Scene.load(scene_file)
    expected = psw.Renderer(scene.volume, scene.transfer).render(scene.view(5))
    written = np.load(tmp_path / "out.npy")
    assert written.dtype == np.float32
    assert np.array_equal(written, expected)


def test_render_stops_early_but_not_before_three_frames(scene_file: Path, tmp_path: Path):
    keys = json.loads(scene_file.read_text()) | {"max_seconds": 1e-9}
    scene_file.write_text(json.dumps(keys))
    values = result_of("render", scene_file, "-o", tmp_path / "out.npy")
    assert values["timed_frames"] == 3
    scene = psw.Scene.load(scene_file)
    expected = psw.Renderer(scene.volume, scene.transfer).render(scene.view(5))  # still the last frame's
    assert np.array_equal(np.load(tmp_path / "out.npy"), expected)


def test_a_still_scene_is_its_view_timed_three_times(ball_file: Path, tmp_path: Path):
    values = result_of("render", ball_file, "--size", 32, 24, "-o", tmp_path / "a.png")
    assert values["timed_frames"] == 3
    assert values["preset"] in presets.NAMES
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size == (32, 24)


def test_a_png_is_over_the_scenes_background(scene_file: Path, tmp_path: Path):
    assert run("render", scene_file, "-o", tmp_path / "a.png").exit_code == 0
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.getpixel((0, 0)) == (0, 0, 255)


def test_reference_beside_the_picture(scene_file: Path, tmp_path: Path):
    values = result_of("render", scene_file, "-o", tmp_path / "out.npy", "--reference", "--quality", 4)
    assert {"psnr", "psnr_covered", "max_error", "mean_signed_error", "ssim"} <= set(values)
    assert values["psnr"] > 38  # the goal for smooth transfer functions
    assert values["ssim"] > 0.98
    scene = psw.Scene.load(scene_file)
    truth = psw.reference.render(scene.volume, scene.transfer, scene.view(5))
    np.testing.assert_allclose(np.load(tmp_path / "out-reference.npy"), truth, atol=2e-5)
    assert sorted(path.name for path in tmp_path.glob("out*")) == [
        "out-error.png",
        "out-reference.npy",
        "out.npy",
    ]
    assert values["error_map"] == str(tmp_path / "out-error.png")


def test_render_for_people(scene_file: Path, tmp_path: Path):
    result = run("render", scene_file, "-o", tmp_path / "a.png", "--reference")
    assert result.exit_code == 0
    for words in ("ms a frame", "samples", "PSNR", "signed mean", "a-error.png", "own transfer function"):
        assert words in result.stdout


def test_the_default_name_is_beside_nobody_elses(ball_file: Path, tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert result_of("render", ball_file, "--size", 16, 16)["out"] == "ball-render.png"
    assert (tmp_path / "ball-render.png").is_file()


def test_options_replace_the_scenes_keys(scene_file: Path, tmp_path: Path):
    out = tmp_path / "a.npy"
    options = ("--eye", -40, -50, 11, "--centre", 11, 11, 11, "--up", 0, 1, 0, "--fovy", 20, "--frames", 4)
    values = result_of("render", scene_file, "-o", out, *options, "--size", 20, 10, "--preset", "fog")
    assert (values["timed_frames"], values["size"], values["preset"]) == (4, [20, 10], "fog")


def test_a_saved_transfer_function_is_relative_to_here(ball_file: Path, tmp_path: Path, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    psw.TransferFunction([(0, (1, 1, 1), 0.0), (200, (1, 1, 1), 0.5)]).save("tf.json")
    values = result_of("render", ball_file, "--tf", "tf.json", "--size", 16, 16, "-o", "a.png")
    assert values["preset"] is None


def test_settings_reach_the_renderer(scene_file: Path, tmp_path: Path):
    out = tmp_path / "a.npy"
    coarse = result_of("render", scene_file, "-o", out, "--quality", 0.5, "--threads", 1)
    fine = result_of("render", scene_file, "-o", out, "--quality", 2, "--samples", 2)
    assert coarse["threads"] == 1
    assert fine["samples_per_interval"] == 2
    assert fine["samples"] > 4 * coarse["samples"]


# --- failures ----------------------------------------------------------------------------------------------


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
        (("--eye", 11.5, 11.5, 11.5, "--centre", 0, 0, 0), "inside the visible part"),
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


def test_a_traceback_for_who_asks(ball_file: Path, monkeypatch):
    monkeypatch.setenv("PERSP_SW_DEBUG", "1")
    result = spawn("info", ball_file.with_name("none.nrrd"))
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


# --- other packages' commands ------------------------------------------------------------------------------


def test_other_packages_add_commands(monkeypatch):
    @click.command()
    def spin() -> None:
        """Turn round and round."""
        click.echo("spinning")

    points = {"spin": SimpleNamespace(load=lambda: spin), "bad": SimpleNamespace(load=lambda: 1 / 0)}
    monkeypatch.setattr(cli, "_others", lambda: points)
    listing = run("--help").stdout
    assert "Turn round and round." in listing
    assert "(cannot be loaded: division by zero)" in listing
    assert run("spin").stdout == "spinning\n"
