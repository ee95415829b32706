"""Marks, windows and picks on the command line and in scene files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from samples import fails, result_of, run
from tolerances import FLOAT32_IMAGE

import persp_sw as psw
from persp_sw.errors import SceneError
from persp_sw.volume.phantoms import synthetic_ct

m = psw.marks
CURSOR, RULER = (12.0, 10.0, 9.0), (2.0, 3.0, 4.0, 20.0, 15.0, 12.0)


def picture(path: Path, *options: object) -> np.ndarray:
    out = path.with_name("out.npy")
    result = run("render", path, "--warp", "software", "-o", out, *options)
    assert result.exit_code == 0, result.output
    return np.load(out)


@pytest.mark.parametrize(
    ("options", "choice"),
    [
        (["--box"], {"box": True}),
        (["--axes"], {"axes": True}),
        (["--scale-bar"], {"scale_bar": True}),
        (["--legend"], {"legend": True}),
        (["--cursor", *CURSOR], {"cursor": CURSOR}),
        (["--cursor", *CURSOR, "--planes"], {"cursor": CURSOR, "planes": True}),
        (["--ruler", *RULER], {"ruler": (RULER[:3], RULER[3:])}),
    ],
)
def test_options_show_marks_as_python_does(scene_file: Path, options: list, choice: dict):
    plain, marked = picture(scene_file), picture(scene_file, *options)
    scene = psw.Scene.load(scene_file)
    renderer = psw.Renderer(scene.volume, scene.transfer, regions=scene.regions)
    view = scene.view(scene.frames)
    expected = m.with_marks(
        renderer.render(view), renderer, view, m.MarkChoice(**choice), background=scene.background
    )
    np.testing.assert_allclose(marked, expected, atol=FLOAT32_IMAGE)
    changed = np.abs(marked - plain).max(-1) > 0.02
    assert 10 < changed.sum() < 0.8 * changed.size


def test_planes_need_a_cursor(scene_file: Path):
    assert "--cursor" in fails("render", scene_file, "--planes")


def test_the_error_is_that_of_the_picture_without_marks(scene_file: Path):
    plain = result_of("render", scene_file, "--reference", "-o", scene_file.with_name("a.png"))
    marked = result_of("render", scene_file, "--reference", "--box", "-o", scene_file.with_name("b.png"))
    assert marked["psnr"] == pytest.approx(plain["psnr"], abs=1e-6)


def test_a_window_replaces_the_transfer_function(scene_file: Path):
    scene = psw.Scene.load(scene_file, window=[100, 120])
    assert psw.window_of(scene.transfer) == pytest.approx((100, 120))
    assert scene.preset is None and scene.transfer.opacity_unit is None
    renderer = psw.Renderer(scene.volume, psw.window_level(100, 120))
    shown = picture(scene_file, "--window", 100, 120)
    np.testing.assert_allclose(shown, renderer.render(scene.view(scene.frames)), atol=FLOAT32_IMAGE)
    with pytest.raises(SceneError, match="window"):
        psw.Scene.load(scene_file, window=[100, -1])
    assert "window" in fails("render", scene_file, "--window", 100, 0)


def test_pick_tells_what_python_does(tmp_path: Path):
    volume = synthetic_ct(24)
    np.save(tmp_path / "body.npy", volume.data)
    options = ("--preset", "surface", "--size", 60, 50)
    told = result_of("pick", tmp_path / "body.npy", 31, 24, *options)
    scene = psw.Scene.of_volume(volume, tf="surface", size=(60, 50))
    expected = psw.Probe(volume, scene.transfer).pick(scene.view(0), (31.5, 24.5))
    assert told["hit"] is True and told["unit"] == "units"
    assert told["value"] == pytest.approx(expected.value)
    assert told["depth"] == pytest.approx(expected.distance)
    np.testing.assert_allclose(told["position_world"], expected.position_world)
    np.testing.assert_allclose(told["position_object"], expected.position_object)
    words = run("pick", tmp_path / "body.npy", 31, 24, *options).stdout
    assert f"{expected.value:.6g}" in words and m.position_text(volume, expected.position_world) in words
    cropped = result_of("pick", tmp_path / "body.npy", 31, 24, *options, "--clip", 0, 0, 1, -1e3)
    assert cropped["hit"] is False and "value" not in cropped
    assert "nothing" in run("pick", tmp_path / "body.npy", 0, 0, *options).stdout
    assert "0 … 59 across" in fails("pick", tmp_path / "body.npy", 60, 0, *options)
    assert "threshold" in fails("pick", tmp_path / "body.npy", 3, 3, *options, "--threshold", 2)
    assert "Examples:" in run("pick", "--help").stdout


def test_positions_of_patients_are_told_by_their_directions():
    data = np.zeros((4, 4, 4))
    head = psw.Volume(data, orientation="LPS")
    assert m.position_text(head, (12.5, -3.0, 40.25)) == "L 12.5 A 3 S 40.2 mm"
    assert m.position_text(head, (-1.0, 2.0, -7.0)) == "R 1 P 2 I 7 mm"
    assert m.position_text(psw.Volume(data), (1.0, -2.0, 3.5)) == "1 -2 3.5 units"
