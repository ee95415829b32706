"""`persp-sw cave` without a screen: what the loop shows, what it costs, and what it says of mistakes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import samples
from click.testing import CliRunner
from data_folder import DATA
from rigs import CONFIGS, two_walls
from tracker_samples import Script

import persp_sw as psw
from vr_plugin.commands.cave import cave
from vr_plugin.loop import Loop
from vr_plugin.pose import Pose
from vr_plugin.rigs.file import load_rig
from vr_plugin.trackers import Sample

RIG = two_walls(64)
PATH = "t,x,y,z,qx,qy,qz,qw\n" + "".join(
    f"{0.1 * n:.1f},{0.05 * n:.3f},1.6,{0.9 - 0.02 * n:.3f},0,0,0,1\n" for n in range(12)
)


@pytest.fixture
def files(tmp_path: Path, scene_file: Path) -> Path:
    (tmp_path / "rig.toml").write_text(RIG)
    (tmp_path / "path.csv").write_text(PATH)
    return tmp_path


def run(folder: Path, *options: str, rig: str = "rig.toml", code: int = 0) -> dict:
    scene = next(folder.glob("scene.json"))
    arguments = [str(folder / rig), str(scene), "--offscreen", "-o", str(folder / "out"), *options]
    result = CliRunner().invoke(cave, [*arguments, "--json"], catch_exceptions=False)
    assert result.exit_code == code, result.output
    return json.loads(result.stdout)


def test_each_wall_and_eye_has_a_picture_from_two_compositings(files):
    said = run(files, "--frames", "3", "--reference", "--quality", "2")
    assert said["walls"] == ["front", "floor"]
    assert said["compositings_per_frame"] == 2
    assert said["timed_frames"] == 3
    keys = {"ms", "composite_ms", "warp_ms", "upload_ms", "encode_ms", "compile_ms", "threads", "faces"}
    assert keys | {"intermediate_size", "samples", "runs_bytes"} <= set(said)
    assert said["head"] == [0, 1.7, 1.0]
    assert [(p["wall"], p["eye"]) for p in said["pictures"]] == [
        (wall, eye) for eye in ("left", "right") for wall in ("front", "floor")
    ]
    for picture in said["pictures"]:
        assert Path(picture["out"]).exists()
        assert picture["rms_error"] < 0.01 and picture["mean_error"] <= picture["rms_error"]
    assert Path(said["sheet"]).exists()


def test_a_recorded_path_gives_the_same_pictures_each_time(files):
    pictures = []
    for folder in ("one", "two"):
        options = ["--path", str(files / "path.csv"), "--frames", "4", "--rate", "10", "--every", "2"]
        said = run(files, *options, "-o", str(files / folder))
        written = sorted((files / folder).glob("*.png"))
        assert len(written) == 4 * 2 + 4 + 1  # two of the frames, the last one, the sheet
        pictures.append([path.read_bytes() for path in written])
    assert pictures[0] == pictures[1]
    assert pictures[0][0] != pictures[0][1]  # the head has moved between frames 2 and 4
    np.testing.assert_allclose(said["head"], [0.2, 1.6, 0.82], atol=1e-9)


def test_where_time_begins_and_how_fast_it_goes(files):
    path = str(files / "path.csv")
    said = run(files, "--path", path, "--frames", "1", "--rate", "5", "--start", "0.3")
    np.testing.assert_allclose(said["head"], [0.25, 1.6, 0.8], atol=1e-9)


def test_missing_voxels_are_said_and_no_others(files):
    data = samples.ball(dtype=np.float32)
    arguments = (
        "cave",
        files / "rig.toml",
        files / "some.npy",
        "--offscreen",
        "--frames",
        1,
        "-o",
        files / "out",
    )
    warnings = []
    for missing in (0, 2):
        data[:missing] = np.nan
        np.save(files / "some.npy", data)
        result = samples.run(*arguments, "--json")
        assert result.exit_code == 0, result.output
        assert json.loads(result.stdout)["timed_frames"] == 1
        warnings.append(result.stderr)
    assert warnings[0] == ""
    assert f"warning: {2 * 24 * 24} of 13824 voxels (8.33 %) are NaN or infinite" in warnings[1]


def test_separate_pictures_are_timed_as_well(files):
    said = run(files, "--frames", "3", "--separate")
    assert said["separate_ratio"] == pytest.approx(said["separate_ms"] / said["ms"])


def test_an_eye_outside_the_walls_is_counted(files):
    walk = "".join(
        f"{0.02 * n:.2f},{0.04 * n:.2f},1.6,0,0,0,0,1\n" for n in range(60)
    )  # out at n = 37: x > 1.5
    (files / "path.csv").write_text("t,x,y,z,qx,qy,qz,qw\n" + walk)
    said = run(files, "--path", str(files / "path.csv"), "--frames", "10", "--rate", "10")
    assert said["outside_frames"] == 3  # at 0.8, 0.9 and 1 s


def test_quality_is_the_rig_s_unless_it_is_given(files):
    (files / "rig.toml").write_text(RIG + "\n[quality]\nquality = 0.6\n")
    assert run(files, "--frames", "1")["quality"] == 0.6
    assert run(files, "--frames", "1", "--quality", "1")["quality"] == 1.0


def test_quality_follows_the_rate_and_a_trace_tells_how(files):
    limits = "\n[quality]\nquality = 1.0\nmin = 0.5\nmax = 1.5\n"
    (files / "rig.toml").write_text(RIG + limits)
    trace = files / "trace.jsonl"
    options = ["--path", str(files / "path.csv"), "--frames", "30", "--trace", str(trace)]
    # At 1000 Hz not even the warp is done in time, at 1 Hz everything is.
    for rate, least, most in (("1000", 0.5, 1.0), ("1", 1.0, 1.5)):
        said = run(files, *options, "--adapt", "--rate", rate)
        header, *frames = map(json.loads, trace.read_text().splitlines())
        assert (header["min_quality"], header["max_quality"]) == (0.5, 1.5)
        assert header["target_hz"] == float(rate) and header["scene"].endswith("scene.json")
        qualities = [frame["quality"] for frame in frames]
        assert len(frames) == 30 and said["quality"] == pytest.approx(qualities[-1], abs=1e-6)
        assert min(qualities) == pytest.approx(least) and max(qualities) == pytest.approx(most)
        assert np.abs(np.diff(np.log(qualities))).max() <= 0.25 + 1e-5
        assert all(frame["composite_ms"] > 0 and frame["warp_ms"] > 0 for frame in frames)
    steady = run(files, *options, "--rate", "1000")
    assert steady["quality"] == 1.0
    assert {json.loads(line)["quality"] for line in trace.read_text().splitlines()[1:]} == {1.0}


def test_a_trace_that_cannot_be_written_is_said_before_anything_is_drawn(files):
    scene, rig = str(files / "scene.json"), str(files / "rig.toml")
    (files / "taken").write_text("")
    options = ["--offscreen", "--trace", str(files / "taken" / "run.jsonl"), "-o", str(files / "out")]
    result = CliRunner().invoke(cave, [rig, scene, *options])
    assert isinstance(result.exception, psw.PerspSWError) and "run.jsonl" in str(result.exception)
    assert not list((files / "out").glob("*.png"))


@pytest.mark.gl
def test_both_warps_show_the_same(files):
    values = {}
    for warp in ("software", "texture"):
        said = run(files, "--frames", "1", "--warp", warp, "-o", str(files / warp))
        assert said["warp"] == warp
        values[warp] = said["pictures"]
    from PIL import Image

    for one, other in zip(values["software"], values["texture"], strict=True):
        a, b = (np.asarray(Image.open(p["out"]), int) for p in (one, other))
        assert np.abs(a - b).max() <= 2  # of 255: rounding of two encodings
        assert a.max() > 50 or one["wall"] == "floor"


@pytest.mark.parametrize(
    ("rig", "options", "words"),
    [
        ("nowhere.toml", [], "nowhere.toml"),
        ("rig.toml", ["--path", "nowhere.csv"], "nowhere.csv"),
        ("rig.toml", ["--machine", "moon"], "moon"),
        ("rig.toml", ["--unit", "mm"], "metres"),
        ("rig.toml", ["-o", "/proc/nothing/there"], "/proc/nothing"),
    ],
)
def test_mistakes_are_said(files, rig, options, words):
    scene = str(next(files.glob("scene.json")))
    arguments = [str(files / rig), scene, "--offscreen", "--frames", "1", "-o", str(files / "out"), *options]
    with pytest.raises(psw.PerspSWError, match=words):
        CliRunner().invoke(cave, arguments, catch_exceptions=False, standalone_mode=False)


def test_without_a_screen_windows_are_refused_with_advice(files, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    scene = str(next(files.glob("scene.json")))
    with pytest.raises(psw.PerspSWError, match="--offscreen"):
        CliRunner().invoke(
            cave, [str(files / "rig.toml"), scene], catch_exceptions=False, standalone_mode=False
        )


def loop_of(files: Path, tracker, wand: int | None = None) -> Loop:
    from dataclasses import replace

    rig = load_rig(files / "rig.toml")
    rig = replace(rig, tracker=replace(rig.tracker, wand=wand))
    scene = psw.Scene.load(files / "scene.json")
    return Loop(rig, psw.Renderer(scene.volume, scene.transfer), tracker)


def test_a_frame_is_of_one_head_pose(files):
    head = Pose((0.3, 1.5, 0.7))
    loop = loop_of(files, Script([Sample(0.0, 0, head)]))
    frame = loop.frame(0.0)
    np.testing.assert_allclose(frame.head.matrix, head.matrix, atol=1e-12)
    eyes = {p.eye: p.view.eye.position for p in frame.pictures}
    world_from_room = np.linalg.inv(loop.maker.room_from_world)
    for side, sign in (("left", -1), ("right", 1)):
        there = world_from_room @ (*(head.position + (sign * 0.032, 0, 0)), 1)
        np.testing.assert_allclose(eyes[side], there[:3], atol=1e-9)


def test_modes_change_while_it_runs(files):
    loop = loop_of(files, None)
    assert loop.frame(0.0).compositings == 2
    loop.toggle_mono()
    assert loop.frame(0.1).compositings == 1
    loop.toggle_mono()
    loop.swap_eyes()
    assert loop.stereo["front"].channels == ("right", "left")


def test_a_wand_moves_the_volume_clips_it_and_v_puts_it_back(files):
    def hand(x, *buttons, at=0.0):
        pose = Sample(at, 5, Pose((x, 1.2, 0.4)))
        return [pose, Sample(at, 5, kind="buttons", buttons=buttons)] if buttons else [pose]

    batches = [hand(0.0), hand(0.0, True, False, False), hand(0.25), hand(0.25, False, True, False)]
    loop = loop_of(files, Script(*batches), wand=5)
    start = loop.maker.room_from_world.copy()
    frames = [loop.frame(0.1 * n) for n in range(3)]
    moved = loop.maker.room_from_world
    np.testing.assert_allclose(moved[:3, 3] - start[:3, 3], [0.25, 0, 0], atol=1e-9)
    clipped = loop.frame(0.3)
    assert len(loop.renderer.regions.clip) == 1
    shown = [np.prod(np.ptp(f.images["left"].box, axis=0)) for f in (frames[-1], clipped)]
    assert 0 < shown[1] < 0.9 * shown[0]
    loop.put_back()
    np.testing.assert_array_equal(loop.maker.room_from_world, start)
    assert len(loop.regions.clip) == 0
    assert np.prod(np.ptp(loop.frame(0.4).images["left"].box, axis=0)) == shown[0]


@pytest.mark.skipif(not DATA.is_dir(), reason="real data are absent; set PERSP_SW_DATA")
def test_the_engine_on_four_walls_along_a_recorded_path(tmp_path):
    path, volume = DATA / "tracking/optitrack-120hz.csv.gz", DATA / "volumes/engine.nrrd"
    arguments = [
        str(CONFIGS / "cave4.toml"),
        str(volume),
        "--offscreen",
        "--frames",
        "2",
        "--path",
        str(path),
    ]
    result = CliRunner().invoke(
        cave, [*arguments, "--quality", "0.5", "--json", "-o", str(tmp_path)], catch_exceptions=False
    )
    said = json.loads(result.stdout)
    assert said["compositings_per_frame"] == 2 and len(said["pictures"]) == 8
    assert said["outside_frames"] == 0
