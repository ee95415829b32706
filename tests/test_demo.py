"""The demo, and the scan it shows."""

from __future__ import annotations

import base64
import importlib.util
import json
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest
from data_folder import volume_path
from PIL import Image
from samples import run

import persp_sw as psw
from persp_sw.errors import FileError, MissingPackageError
from persp_sw.volume import examples
from persp_sw.volume.ssdf import read_ssdf

needs_visvis = pytest.mark.skipif(
    importlib.util.find_spec("visvis") is None, reason="visvis is not installed"
)
VIEWS = ["front", "side", "diagonal", "top", "close"]


# --- the file format ---------------------------------------------------------------------------------------


def ssdf(path: Path, array: np.ndarray, block: int = 1000) -> Path:
    """Written as pyssdf writes: zlib blocks in base64, each ended by a semicolon."""
    raw = array.tobytes()
    blocks = [base64.encodebytes(zlib.compress(raw[i : i + block])) for i in range(0, len(raw), block)]
    content = "".join(block.decode().replace("\n", "") + ";" for block in blocks)
    shape = "x".join(map(str, array.shape))
    path.write_text(
        f"# made by hand\nscale = 62.5\nname = 'a name'\nvol = array {shape} {array.dtype} {content}\n"
        "few = array 3 float32 1.5,2,-3\nnested = dict:\n  inner = array 2 uint8 1,2\n"
    )
    return path


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.float32])
def test_ssdf_arrays_in_several_blocks(tmp_path: Path, rng, dtype):
    array = rng.integers(0, 100, (11, 13, 17)).astype(dtype)
    values = read_ssdf(ssdf(tmp_path / "a.ssdf", array))
    assert values["vol"].dtype == dtype
    assert np.array_equal(values["vol"], array)
    assert values["scale"] == 62.5
    assert values["name"] == "'a name'"
    assert values["few"].tolist() == [1.5, 2, -3]
    assert "inner" not in values


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("vol = array 2x2 uint8 !!!;", "damaged"),
        ("vol = array 2x2 uint8 AAAA;", "damaged"),
        ("vol = array 2x2 nonsense 1,2,3,4", "damaged"),
        ("vol = array twoxtwo uint8 1,2,3,4", "damaged"),
        ("vol = array 2x2 uint8 1,2,3", "should be 2x2 = 4 numbers, it has 3"),
        ("nothing at all", "no line `name = value`"),
        ("", "no line"),
        (b"\xff\x00\xfe", "not an SSDF text file"),
        (None, "cannot read"),
    ],
)
def test_files_that_are_no_ssdf(tmp_path: Path, content, words):
    path = tmp_path / "a.ssdf"
    if content is not None:
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(FileError, match=words):
        read_ssdf(path)


# --- the scan ----------------------------------------------------------------------------------------------


@needs_visvis
def test_the_stent_is_read_without_importing_visvis():
    volume = examples.stent()
    assert "visvis" not in sys.modules
    assert volume.size == (128, 128, 256)
    assert volume.data.dtype == np.int16
    assert volume.value_range == (0, 2000)
    # The same scan with its values in whole numbers: half a level of rounding apart.
    same = psw.load(volume_path("stent.nrrd")).data.astype(int)
    assert np.abs(volume.data - same).max() <= 1


@needs_visvis
def test_the_scan_has_a_name_that_stands_for_a_file(tmp_path: Path, monkeypatch):
    volume = examples.stent()
    assert np.array_equal(psw.load("stent.demo").data, volume.data)
    assert psw.load("stent.demo", spacing=(1, 2, 3)).spacing == (1, 2, 3)
    scene = psw.Scene.of_file("stent.demo", tf="ct_bone")
    assert scene.name == "stent"
    (tmp_path / "sub").mkdir()
    scene.save(tmp_path / "sub" / "scene.toml")
    assert np.array_equal(psw.Scene.load(tmp_path / "sub" / "scene.toml").volume.data, volume.data)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "stent.demo").write_bytes(b"a file of that name is a file")
    with pytest.raises(FileError, match="unknown kind of file"):
        psw.load("stent.demo")


def test_without_visvis_the_extra_is_named(monkeypatch, tmp_path: Path):
    monkeypatch.setattr(examples.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(MissingPackageError):
        examples.stent()
    result = run("demo", "-o", tmp_path / "out")
    assert result.exit_code == 2
    assert "pip install 'persp-sw[demo]'" in result.stderr
    assert "--volume FILE" in result.stderr


# --- the command -------------------------------------------------------------------------------------------


@needs_visvis
def test_the_demo_writes_and_measures(tmp_path: Path):
    result = run("demo", "-o", tmp_path / "new" / "out", "--size", 64, "--json")
    assert result.exit_code == 0, result.output
    values = json.loads(result.stdout)
    assert [row["view"] for row in values["views"]] == VIEWS
    for row in values["views"]:
        assert {"faces", "samples", "ms", "psnr", "psnr_covered", "mean_signed_error"} <= set(row)
        # Wires thinner than a pixel of so small a picture: here only that both show the same thing.
        assert row["psnr"] > 24
        for key in ("picture", "reference", "error_map"):
            with Image.open(row[key]) as picture:
                assert picture.size[0] == 64
                assert np.asarray(picture).max() > 0
    assert len(list((tmp_path / "new" / "out").iterdir())) == 3 * len(VIEWS)


def test_the_demo_shows_another_volume(ball_file: Path, tmp_path: Path):
    result = run("demo", "-o", tmp_path / "out", "--size", 24, "--volume", ball_file)
    assert result.exit_code == 0, result.output
    for words in ("ball, 24 × 24 × 24 voxels", "PSNR", "diagonal", f"are in {tmp_path / 'out'}/"):
        assert words in result.stdout
    assert "close" not in result.stdout


def test_a_folder_that_cannot_be(tmp_path: Path):
    (tmp_path / "file").touch()
    result = run("demo", "-o", tmp_path / "file")
    assert result.exit_code == 2
    assert "cannot make the folder" in result.stderr
