"""Films: their frames are the renderer's, decoded they look the same, and nothing half is left behind."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from samples import ROOT, ball, fails, result_of, run
from tolerances import FILM_DB, FILM_FLAT

import persp_sw as psw
from persp_sw.errors import FileError, MissingPackageError
from vr_plugin.cameras import Camera
from vr_plugin.commands import movie
from vr_plugin.film import files, shots
from vr_plugin.film.filming import take_film
from vr_plugin.film.flight import Flight, KeyView
from vr_plugin.film.flight_file import load_flight, save_flight
from vr_plugin.film.shots import Shot
from vr_plugin.film.turntable import turntable
from vr_plugin.stereo import StereoError, combine

needs_ffmpeg = pytest.mark.skipif(
    importlib.util.find_spec("imageio_ffmpeg") is None, reason="imageio-ffmpeg (extra movie) is not installed"
)
SIZE = (48, 40)  # of the scene


@pytest.fixture
def scene_file(scene_file: Path) -> Path:
    """That of all tests, but of a ball with a handle: one can see how it turns."""
    data = ball()
    data[10:14, 2:9, 10:20] = 200
    np.save(scene_file.with_name("ball.npy"), data)
    return scene_file


def decoded(path: Path) -> tuple[np.ndarray, dict]:
    """(n, h, w, 3) uint8, and the size, frames a second and duration that the file states."""
    from imageio_ffmpeg import get_ffmpeg_exe

    done = subprocess.run(
        [get_ffmpeg_exe(), "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"], capture_output=True
    )
    said = done.stderr.decode()
    assert done.returncode == 0, said
    width, height = map(int, re.search(r"Video: .*?, (\d+)x(\d+)", said).groups())
    hours, minutes, seconds = map(float, re.search(r"Duration: (\d+):(\d+):([\d.]+)", said).groups())
    fps = float(re.search(r"([\d.]+) fps", said).group(1))
    facts = {"size": (width, height), "fps": fps, "duration": 3600 * hours + 60 * minutes + seconds}
    return np.frombuffer(done.stdout, np.uint8).reshape(-1, height, width, 3), facts


def pictures_of(folder: Path) -> list[np.ndarray]:
    names = sorted(folder.iterdir())
    assert [name.name for name in names] == [f"frame-{i:05d}.png" for i in range(len(names))]
    return [np.asarray(Image.open(name)) for name in names]


def psnr(a: np.ndarray, b: np.ndarray) -> float:
    return 10 * np.log10(255**2 / np.mean((a.astype(float) - b.astype(float)) ** 2))


def scene_and_renderer(scene_file: Path) -> tuple[psw.Scene, psw.Renderer]:
    scene = psw.Scene.load(scene_file)
    return scene, psw.Renderer(scene.volume, scene.transfer, psw.Settings(), scene.regions)


def flight_file(folder: Path) -> Path:
    cameras = [Camera.look_at(eye, (11, 11, 11), (0, 0, 1), 0.8) for eye in ((40, -50, 35), (50, 0, 20))]
    return save_flight(folder / "flight.csv", Flight([KeyView(2.0 * k, c) for k, c in enumerate(cameras)]))


# --- frames ------------------------------------------------------------------------------------------------


def test_pictures_are_the_renderers_bit_by_bit(scene_file: Path, tmp_path: Path):
    options = ("--turntable", 120, "--frames", 4, "--tilt", 10, "--fps", 25)
    values = result_of("movie", scene_file, "-o", tmp_path / "film", *options)
    assert {"ms", "composite_ms", "warp_ms", "file_ms", "encode_ms", "compile_ms", "threads"} <= set(values)
    assert (values["frames"], values["seconds"], values["size"]) == (4, 0.16, list(SIZE))
    scene, renderer = scene_and_renderer(scene_file)
    cameras = turntable(Camera.of_view(scene.view()), (0, 0, 1), 4, 120, 10)
    shown = pictures_of(tmp_path / "film")
    assert len(shown) == 4
    for picture, camera in zip(shown, cameras, strict=True):
        image = renderer.render(psw.View.through_wall(camera.position, camera.wall(SIZE)))
        assert np.array_equal(picture, psw.images.presented(image, scene.background))
    assert psnr(shown[0], shown[3]) < 40  # it does turn


def test_the_same_scene_gives_the_same_frames_whoever_asks(scene_file: Path, tmp_path: Path):
    for name, threads in (("a", 1), ("b", 2)):
        path = flight_file(tmp_path)
        options = ("--path", path, "--frames", 3, "--threads", threads)
        result_of("movie", scene_file, "-o", tmp_path / name, *options)
    for a, b in zip(pictures_of(tmp_path / "a"), pictures_of(tmp_path / "b"), strict=True):
        assert np.array_equal(a, b)


def test_settings_reach_the_renderer(scene_file: Path, tmp_path: Path):
    options = ("--frames", 1, "--quality", 2, "--samples", 2, "--preintegrated")
    result_of("movie", scene_file, "-o", tmp_path / "film", *options)
    scene, _ = scene_and_renderer(scene_file)
    settings = psw.Settings(quality=2, samples_per_interval=2, preintegrated=True)
    renderer = psw.Renderer(scene.volume, scene.transfer, settings)
    wanted = Shot(SIZE, background=scene.background).take(renderer, Camera.of_view(scene.view()))
    (shown,) = pictures_of(tmp_path / "film")
    assert np.array_equal(shown, wanted)
    assert not np.array_equal(shown, Shot(SIZE).take(renderer, Camera.of_view(scene.view())))


def test_a_flight_takes_its_seconds_and_passes_its_key_views(scene_file: Path, tmp_path: Path):
    path = flight_file(tmp_path)
    assert result_of("movie", scene_file, "-o", tmp_path / "film", "--path", path, "--fps", 2)["frames"] == 5
    scene, renderer = scene_and_renderer(scene_file)
    flight, shown = load_flight(path), pictures_of(tmp_path / "film")
    for place in (0, -1):
        wanted = Shot(SIZE, background=scene.background).take(renderer, flight.keys[place].camera)
        assert np.array_equal(shown[place], wanted)


@pytest.mark.parametrize("layout", ["side_by_side", "top_bottom", "anaglyph", "interlaced"])
def test_two_eyes_are_laid_out_as_in_a_window(scene_file: Path, layout: str):
    scene, renderer = scene_and_renderer(scene_file)
    camera = Camera.of_view(scene.view())
    shot = Shot(SIZE, layout, 0.05, scene.background)
    frame = shot.take(renderer, camera)
    assert frame.shape == (40, 48, 3)
    eyes = {}
    for name, place in zip(("left", "right"), camera.eyes(0.05), strict=True):
        wall = camera.wall(SIZE)
        width, height = {"side_by_side": (24, 40), "top_bottom": (48, 20)}.get(layout, SIZE)
        wall = psw.Wall(wall.lower_left, wall.lower_right, wall.upper_left, (width, height))
        eyes[name] = renderer.render(psw.View.through_wall(place, wall))
    together = combine(eyes["left"], eyes["right"], layout, SIZE, background=scene.background)
    assert np.array_equal(frame, psw.images.presented(together))
    flat = Shot(SIZE, layout, 0.0, scene.background).take(renderer, camera)
    assert not np.array_equal(frame, flat)


def test_one_eye_is_filmed_alone(scene_file: Path):
    scene, renderer = scene_and_renderer(scene_file)
    camera = Camera.of_view(scene.view())
    for layout, place in zip(("left", "right"), camera.eyes(0.1), strict=True):
        image = renderer.render(psw.View.through_wall(place, camera.wall(SIZE)))
        assert np.array_equal(Shot(SIZE, layout, 0.1).take(renderer, camera), psw.images.presented(image))


def test_a_parallel_scene_turns_in_parallel(ball_file: Path):
    scene = psw.Scene.of_file(ball_file, parallel_height=30, size=SIZE)
    renderer = psw.Renderer(scene.volume, scene.transfer)
    shot = Shot(SIZE, parallel=True)
    first, side = turntable(Camera.of_view(scene.view()), (0, 0, 1), 4)[:2]
    (view,) = shot.views(first).values()
    np.testing.assert_allclose(view.eye.position, scene.view().eye.position, atol=1e-12)
    np.testing.assert_allclose(view.wall.world_from_pixel, scene.view().wall.world_from_pixel, atol=1e-9)
    assert shot.take(renderer, side).max() > 0
    with pytest.raises(StereoError, match="filmed in mono"):
        Shot(SIZE, "anaglyph", parallel=True)


def test_a_turntable_shows_all_of_the_volume_all_the_time_unless_the_eye_is_given(tmp_path: Path):
    """A long box, every voxel of it seen: no frame has any of it at its border."""
    np.save(tmp_path / "box.npy", np.full((8, 12, 60), 200, np.uint8))
    tf = [[0, 1, 1, 1, 0.5], [255, 1, 1, 1, 0.5]]
    (tmp_path / "box.json").write_text(json.dumps({"volume": "box.npy", "tf": tf}))
    options = ("--frames", 6, "--size", 64, 40, "--up", 0, 1, 0, "--axis", 0, 0, 1)
    result_of("movie", tmp_path / "box.json", *options, "-o", tmp_path / "all")
    for picture in pictures_of(tmp_path / "all"):
        assert picture.max() > 100
        assert max(edge.max() for edge in (picture[0], picture[-1], picture[:, 0], picture[:, -1])) == 0
    near = ("--eye", 30, -40, 4, "--fovy", 20)
    result_of("movie", tmp_path / "box.json", *options, *near, "-o", tmp_path / "near")
    assert pictures_of(tmp_path / "near")[0][:, 0].max() > 100


def test_layouts_of_the_command_are_those_there_are():
    assert movie.LAYOUTS == shots.LAYOUTS
    with pytest.raises(StereoError, match="a film is mono"):
        Shot(SIZE, "quad")


# --- films -------------------------------------------------------------------------------------------------


@needs_ffmpeg
@pytest.mark.parametrize("suffix", [".mp4", ".webm"])
def test_a_film_decoded_is_near_what_was_rendered(scene_file: Path, tmp_path: Path, suffix: str):
    options = ("--frames", 7, "--fps", 12.5, "--size", 160, 120)
    result_of("movie", scene_file, "-o", tmp_path / f"film{suffix}", *options)
    result_of("movie", scene_file, "-o", tmp_path / "film", *options)
    film, facts = decoded(tmp_path / f"film{suffix}")
    shown = pictures_of(tmp_path / "film")
    assert (len(film), facts["size"], facts["fps"]) == (7, (160, 120), 12.5)
    assert facts["duration"] == pytest.approx(7 / 12.5, abs=0.01)
    for frame, picture in zip(film, shown, strict=True):
        assert psnr(frame, picture) > FILM_DB
    # Frame 0 is that, and not its neighbour.
    assert psnr(film[0], shown[0]) > psnr(film[0], shown[1]) + 3


@needs_ffmpeg
@pytest.mark.parametrize("suffix", [".mp4", ".webm"])
@pytest.mark.parametrize("colour", [(255, 0, 0), (20, 200, 60), (30, 30, 250), (255, 255, 255), (0, 0, 0)])
def test_colours_stay(tmp_path: Path, suffix: str, colour: tuple):
    path = tmp_path / f"a{suffix}"
    with files.film_file(path, (64, 48), 10) as film:
        for _ in range(2):
            film.add(np.full((48, 64, 3), colour, np.uint8))
    frames, _ = decoded(path)
    assert np.abs(frames.astype(int) - colour).max() <= FILM_FLAT


@needs_ffmpeg
def test_odd_sizes_gain_a_pixel_and_are_not_scaled(tmp_path: Path):
    frame = np.zeros((31, 47, 3), np.uint8)
    frame[:, 46] = frame[30] = 255
    with files.film_file(tmp_path / "a.mp4", (47, 31), 10, crf=1) as film:
        film.add(frame)
    ((shown,), facts) = decoded(tmp_path / "a.mp4")
    assert facts["size"] == (48, 32)
    assert shown[:28, :44].max() < 40
    assert shown[31].min() > 215
    assert shown[:, 47].min() > 215


@needs_ffmpeg
def test_a_gif_moves(scene_file: Path, tmp_path: Path):
    result_of("movie", scene_file, "-o", tmp_path / "a.gif", "--frames", 5, "--fps", 10)
    with Image.open(tmp_path / "a.gif") as film:
        assert (film.n_frames, film.size, film.info["duration"]) == (5, SIZE, 100)
    film, _ = decoded(tmp_path / "a.gif")
    result_of("movie", scene_file, "-o", tmp_path / "film", "--frames", 5)
    assert psnr(film[0], pictures_of(tmp_path / "film")[0]) > 25  # 256 colours, dithered


@needs_ffmpeg
def test_a_whole_film_takes_the_old_ones_place(scene_file: Path, tmp_path: Path):
    (tmp_path / "a.mp4").write_bytes(b"old")
    result_of("movie", scene_file, "-o", tmp_path / "a.mp4", "--frames", 2)
    assert len(decoded(tmp_path / "a.mp4")[0]) == 2
    assert [p.name for p in tmp_path.glob("*.mp4")] == ["a.mp4"]
    assert not list(tmp_path.glob(".a*"))


# --- what goes wrong ---------------------------------------------------------------------------------------


@needs_ffmpeg
@pytest.mark.parametrize("error", [KeyboardInterrupt, psw.PerspSWError])
def test_an_error_leaves_no_film_and_keeps_the_old_one(scene_file: Path, tmp_path: Path, error: type):
    scene, renderer = scene_and_renderer(scene_file)
    (tmp_path / "out").mkdir()
    path = tmp_path / "out" / "a.mp4"
    path.write_bytes(b"old")
    cameras = turntable(Camera.of_view(scene.view()), (0, 0, 1), 9)

    def progress(done: int, total: int, what: str) -> None:
        if done == 5:
            raise error("enough")

    with pytest.raises(error):
        take_film(renderer, Shot(SIZE), cameras, files.film_file(path, SIZE, 10), progress)
    assert [p.name for p in path.parent.iterdir()] == ["a.mp4"]
    assert path.read_bytes() == b"old"


@needs_ffmpeg
def test_an_interrupted_process_leaves_nothing_and_says_so(ball_file: Path, tmp_path: Path):
    folder = tmp_path / "out"
    folder.mkdir()
    command = [sys.executable, "-m", "persp_sw", "movie", ball_file, "-o", folder / "a.mp4"]
    process = subprocess.Popen(
        [*map(str, command), "--frames", "20000", "--size", "64", "64"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        cwd=ROOT,
        start_new_session=True,
    )
    end = time.monotonic() + 100
    while not any(folder.iterdir()) and process.poll() is None and time.monotonic() < end:
        time.sleep(0.05)
    assert any(folder.iterdir()), process.communicate(timeout=30)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    out, errors = process.communicate(timeout=60)
    assert (process.returncode, out, errors.strip()) == (130, "", "error: interrupted")
    assert not list(folder.iterdir())


@needs_ffmpeg
def test_what_ffmpeg_refuses_is_one_clear_error(tmp_path: Path, monkeypatch):
    monkeypatch.setattr(files, "_COLOURS", ["-vf", "nonsense"])
    with (
        pytest.raises(FileError, match=r"ffmpeg says: .*nonsense"),
        files.film_file(tmp_path / "a.mp4", (64, 64), 10) as film,
    ):
        for _ in range(100):
            film.add(np.zeros((64, 64, 3), np.uint8))
    assert not list(tmp_path.iterdir())


def test_without_the_package_the_extra_is_named(scene_file: Path, tmp_path: Path, monkeypatch):
    find = importlib.util.find_spec
    monkeypatch.setattr(
        files.importlib.util, "find_spec", lambda name: None if name == "imageio_ffmpeg" else find(name)
    )
    message = fails("movie", scene_file, "-o", tmp_path / "a.mp4")
    assert "pip install 'persp-sw[movie]'" in message
    with pytest.raises(MissingPackageError):
        files.film_file(tmp_path / "a.gif", SIZE, 10)
    assert run("movie", scene_file, "-o", tmp_path / "film", "--frames", 1).exit_code == 0  # needs none


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("-o", "a.avi"), "end its name in .mp4, .webm, .gif"),
        (("-o", "none/a.mp4"), "there is no folder"),
        (("-o", "ball.npy/film"), "cannot make the folder"),
        (("-o", "a.mp4", "--fps", 0), "0.1 … 1000 frames a second"),
        (("-o", "a.mp4", "--crf", 52), "crf lies between 0 and 51 (.mp4), 63 (.webm)"),
        (("-o", "a.gif", "--crf", 1), ".gif has none"),
        (("-o", "a.mp4", "--frames", 0), "frames"),
        (("-o", "a.mp4", "--stereo", "quad"), "quad"),
        (("-o", "film", "--path", "none.csv"), "there is no flight"),
        (("-o", "film", "--path", "f.csv", "--turntable", 90), "give one or the other"),
        (("-o", "film", "--constant-speed"), "give --path"),
        (("-o", "film", "--axis", 0, 0, 0), "not all 0"),
        (("-o", "film", "--parallel", 30, "--stereo", "anaglyph"), "filmed in mono"),
    ],
)
def test_wrong_options(scene_file: Path, tmp_path: Path, monkeypatch, options, words):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(shots.Shot, "take", lambda *_: pytest.fail("the work began"))
    assert words in fails("movie", scene_file, *options)
    assert not list(tmp_path.glob("a.*"))


def test_frames_that_are_there_are_not_mixed_with_new_ones(scene_file: Path, tmp_path: Path):
    assert run("movie", scene_file, "-o", tmp_path / "film", "--frames", 2).exit_code == 0
    assert "has frames already, such as frame-0000" in fails("movie", scene_file, "-o", tmp_path / "film")
    assert len(list((tmp_path / "film").iterdir())) == 2


def test_a_folder_without_the_right_to_write(tmp_path: Path, monkeypatch):
    monkeypatch.setattr(files.os, "access", lambda path, mode: False)  # root may write anywhere
    with pytest.raises(FileError, match="permission denied"):
        files.film_file(tmp_path / "a.mp4", SIZE, 10)


def test_people_get_a_summary(scene_file: Path, tmp_path: Path):
    result = run("movie", scene_file, "-o", tmp_path / "film", "--frames", 3)
    assert result.exit_code == 0, result.output
    assert "3 frames of 48 × 40 pixels, 0.10 s at 30 a second" in result.stdout
    assert (
        json.loads(run("movie", scene_file, "-o", tmp_path / "b", "--frames", 1, "--json").stdout)["frames"]
        == 1
    )
