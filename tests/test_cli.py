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
from dicom_writer import dicom, slice_tags
from PIL import Image
from samples import ROOT, ball, fails, result_of, run

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


# --- help and start-up -------------------------------------------------------------------------------------


def test_help_teaches_and_lists_all_commands():
    result = run("--help")
    assert result.exit_code == 0
    for word in ("info", "render", "demo", "Examples:", "Exit codes:", "persp-sw render"):
        assert word in result.stdout


@pytest.mark.parametrize(
    "command", ["info", "render", "demo", "bench", "chart", "atlas", "trace", "papers", "warmup"]
)
def test_each_command_has_examples(command):
    result = run(command, "--help")
    assert result.exit_code == 0
    assert "Examples:" in result.stdout
    assert f"persp-sw {command}" in result.stdout


def test_help_loads_neither_numba_nor_readers():
    code = (
        "import sys\n"
        "from persp_sw.cli import main\n"
        "commands = ('info', 'render', 'demo', 'bench', 'chart', 'atlas', 'trace', 'papers', 'warmup')\n"
        "for arguments in (['--help'], *([name, '--help'] for name in commands)):\n"
        "    try: main(arguments)\n"
        "    except SystemExit: pass\n"
        "heavy = {'numba', 'SimpleITK', 'tifffile', 'OpenGL', 'vtkmodules', 'matplotlib'}\n"
        "print(sorted(heavy & set(sys.modules)), file=sys.stderr)\n"
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


def test_components_by_number_and_their_length(tmp_path: Path):
    sitk = pytest.importorskip("SimpleITK")
    vectors = np.stack([ball(dtype=np.float32) * factor for factor in (3, 4)], -1)
    sitk.WriteImage(sitk.GetImageFromArray(vectors, isVector=True), str(tmp_path / "v.nrrd"))
    high = float(ball(dtype=np.float32).max())
    for component, factor in (("0", 3), ("1", 4), ("magnitude", 5)):
        values = result_of("info", tmp_path / "v.nrrd", "--component", component)
        assert values["value_range"][1] == pytest.approx(factor * high, rel=1e-6)


@pytest.fixture
def two_series(tmp_path: Path) -> Path:
    """A DICOM folder with a series of 4 slices and one of 3."""
    folder = tmp_path / "dicom"
    folder.mkdir()
    for uid, count, description in (("1.2.3.100", 4, "thin"), ("1.2.3.200", 3, "[thick]")):
        for z in range(count):
            tags = slice_tags(z, (0, 0, 2 * z), uid=uid, description=description, number=count)
            dicom(folder / f"{uid}-{z}", np.full((5, 6), 1000 + z, np.int16), tags)
    return folder


def test_info_lists_the_series_of_a_folder(two_series: Path):
    values = result_of("info", two_series)
    assert [(one["number"], one["slices"], one["uid"]) for one in values["series"]] == [
        (1, 3, "1.2.3.200"),
        (2, 4, "1.2.3.100"),
    ]
    listing = run("info", two_series)
    assert listing.exit_code == 0
    for words in ("holds 2 series; choose one with --series N", "[thick]", "6 × 5", "1.2.3.100"):
        assert words in listing.stdout


@pytest.mark.parametrize("series", ["2", "1.2.3.100"])
def test_one_series_is_chosen_by_number_or_uid(two_series: Path, series):
    values = result_of("info", two_series, "--series", series)
    assert values["size"] == [6, 5, 4]
    assert values["orientation"] == "LPS"


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


def test_regions_by_option(scene_file: Path, tmp_path: Path):
    out = tmp_path / "a.npy"
    whole = result_of("render", scene_file, "-o", out)["samples"]
    box = ("--crop", 6, 17.5, 6, 17.5, 6, 17.5)
    for flags in ("fence", 0x2EBFEBA, "0x2ebfeba"):
        fence = result_of("render", scene_file, "-o", out, *box, "--crop-flags", flags)["samples"]
        assert fence not in (whole, 0)
    slab = result_of("render", scene_file, "-o", out, "--cut", 0, 0, 1, -12, 2, "inside")["samples"]
    assert 0 < slab < whole
    nothing = ("--clip", 0, 0, 1, -12, "--clip", 0, 0, -1, 11)
    assert result_of("render", scene_file, "-o", out, *nothing)["samples"] == 0
    assert "27 bits" in fails("render", scene_file, *box, "--crop-flags", "hedge")


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


@pytest.mark.parametrize("size", [48, 200])
def test_the_eye_images_size_may_be_asked_for(scene_file, tmp_path, size):
    values = result_of("render", scene_file, "-o", tmp_path / "a.png", "--intermediate", size)
    assert size - 4 <= max(values["intermediate_size"]) <= -(-size // 16) * 16
    message = fails("render", scene_file, "-o", tmp_path / "a.png", "--intermediate", 5000)
    assert "intermediate_size lies between 16 and 4096" in message
