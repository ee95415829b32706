"""Pictures of a preview at any size: the renderer's own, whatever the window shows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from samples import ball, fails, result_of
from tolerances import FLOAT32_IMAGE

import persp_sw as psw
from persp_sw.errors import FileError, ViewError
from persp_sw.volume.phantoms import synthetic_ct
from vr_plugin.preview.pictures import PreviewPictures
from vr_plugin.preview.screenshot import LARGEST, rendered, screenshot
from vr_plugin.preview.session import open_preview, press
from vr_plugin.preview.wanted import Wanted

SIZE = (96, 64)


@pytest.fixture(scope="module")
def scene() -> psw.Scene:
    return psw.Scene.of_volume(synthetic_ct(24), size=SIZE, background=(0.02, 0.01, 0.03), tf="fog")


def opened(scene: psw.Scene, keys: str = "", **options: object) -> tuple[Wanted, PreviewPictures]:
    preview, pictures = open_preview(scene, psw.Settings(), size=SIZE, **options)
    press(preview, keys)
    return preview.advance(0.0), pictures


@pytest.mark.parametrize("size", [None, (200, 90), (33, 71), (1, 1)])
def test_it_is_the_renderers_picture_bit_by_bit(scene: psw.Scene, size):
    wanted, pictures = opened(scene)
    pictures.draw(wanted, pictures.composite(wanted))
    image = rendered(pictures, wanted, size)
    view = psw.View.through_wall(wanted.camera.position, wanted.camera.wall(size or SIZE))
    expected = psw.Renderer(scene.volume, scene.transfer).render(view)
    assert image.shape == expected.shape
    assert np.array_equal(image, expected)


def test_a_frame_rate_has_no_say_in_it_and_is_kept(scene: psw.Scene):
    """The window's quality is coarse: the picture's is not, and the next frame's is again."""
    wanted, pictures = opened(scene, target_hz=1000.0)
    assert pictures.target_hz == 1000.0
    for _ in range(8):
        done = pictures.composite(wanted)
        pictures.drawn(wanted, done, 0.0, 1000.0)
    coarse = done.statistics["quality"]
    assert coarse < 0.9
    image = rendered(pictures, wanted, (120, 80))
    view = psw.View.through_wall(wanted.camera.position, wanted.camera.wall((120, 80)))
    assert np.array_equal(image, psw.Renderer(scene.volume, scene.transfer).render(view))
    assert pictures.target_hz == 1000.0
    after = pictures.composite(wanted).statistics
    assert (after["target_hz"], after["why"]) != (0.0, "")
    assert after["quality"] < 0.9


def test_a_held_quality_holds_for_it(scene: psw.Scene):
    wanted, pictures = opened(scene, "- - -")
    view = psw.View.through_wall(wanted.camera.position, wanted.camera.wall(SIZE))
    expected = psw.Renderer(scene.volume, scene.transfer, psw.Settings(quality=wanted.quality)).render(view)
    assert np.array_equal(rendered(pictures, wanted), expected)


def test_twice_the_size_box_filtered_is_the_picture():
    rows = [[0, 0.2, 0.3, 0.8, 0], [200, 1, 0.6, 0.3, 0.1]]
    scene = psw.Scene.of_volume(psw.Volume(ball(40)), tf=rows, size=SIZE, opacity_unit=1.0)
    wanted, pictures = opened(scene)
    once = rendered(pictures, wanted, SIZE)
    twice = rendered(pictures, wanted, (192, 128))
    box = twice.reshape(64, 2, 96, 2, 4).mean((1, 3))
    # Both sample one eye image, linearly. A mean of samples h to either side of a point errs by h / 2 times
    # the kink there, the second difference of the eye image's pixels; h is a quarter of a picture's pixel,
    # which is smaller than one of the eye image's; along two axes.
    view = psw.View.through_wall(wanted.camera.position, wanted.camera.wall(SIZE))
    eye_image = psw.Renderer(scene.volume, scene.transfer).composite(view.eye, [view.wall])
    (face,) = eye_image.faces
    assert face.size[1] < SIZE[1]
    pixels = np.asarray(eye_image.pixels).reshape(*face.size[::-1], 4)
    pixels = np.pad(pixels, ((1, 1), (1, 1), (0, 0)))
    kinks = sum(np.abs(np.diff(pixels, 2, axis)).max() for axis in (0, 1))
    bound = kinks / 8 + FLOAT32_IMAGE
    assert np.abs(box - once).max() < bound
    assert np.abs(np.roll(box, 1, 1) - once).max() > 2 * bound  # it can tell one pixel from the next


def test_several_samples_are_that_mean(scene: psw.Scene):
    wanted, pictures = opened(scene)
    twice = rendered(pictures, wanted, (192, 128)).astype(np.float64)
    expected = twice.reshape(64, 2, 96, 2, 4).mean((1, 3)).astype(np.float32)
    assert np.array_equal(rendered(pictures, wanted, SIZE, samples=2), expected)


@pytest.mark.parametrize("keys", ["5", "8", "TAB"])
def test_stereo_and_the_room_are_shown_as_in_a_window_of_that_size(scene: psw.Scene, keys: str):
    wanted, pictures = opened(scene, keys)
    preview, larger = open_preview(scene, psw.Settings(), size=(180, 120))
    press(preview, keys)
    there = preview.advance(0.0)
    image = rendered(pictures, wanted, (180, 120))
    drawn, _ = larger.draw(there, larger.composite(there))
    if keys == "TAB":  # the outside camera was made for a window of another size, the aspect is the same
        assert np.abs(image - larger.window(there, drawn)).max() < 1e-3
    else:
        assert np.array_equal(image, larger.window(there, drawn))
    assert image[..., 3].min() == 1


def test_files_hold_it(scene: psw.Scene, tmp_path: Path):
    wanted, pictures = opened(scene)
    image = rendered(pictures, wanted, (150, 300))
    assert np.array_equal(np.load(screenshot(pictures, wanted, tmp_path / "a.npy", (150, 300))), image)
    with Image.open(screenshot(pictures, wanted, tmp_path / "a.png", (150, 300))) as picture:
        assert picture.size == (150, 300)
        assert np.array_equal(np.asarray(picture), psw.images.presented(image, scene.background))


def test_the_next_frame_of_the_window_is_as_before(scene: psw.Scene):
    wanted, pictures = opened(scene)
    before = pictures.draw(wanted, pictures.composite(wanted))[0]["middle"].copy()
    rendered(pictures, wanted, (300, 300), 2)
    assert np.array_equal(pictures.draw(wanted, pictures.composite(wanted))[0]["middle"], before)


@pytest.mark.parametrize(
    ("size", "samples"), [((0, 5), 1), ((5.0, 5), 1), ((5, 5), 0), ((LARGEST + 1, 1), 1), ((LARGEST, 9), 2)]
)
def test_sizes_that_are_none(scene: psw.Scene, size, samples):
    wanted, pictures = opened(scene)
    with pytest.raises(ViewError, match=r"pixels|size"):
        rendered(pictures, wanted, size, samples)


def test_a_file_that_cannot_be_is_refused_before_the_work(scene: psw.Scene, tmp_path: Path, monkeypatch):
    wanted, pictures = opened(scene)
    monkeypatch.setattr(pictures, "for_stills", lambda: pytest.fail("the work began"))
    with pytest.raises(FileError, match="end its name in"):
        screenshot(pictures, wanted, tmp_path / "a.jpg", SIZE)


def test_the_command_writes_them_and_numbers_them(ball_file: Path, tmp_path: Path):
    options = ("--offscreen", "--size", *SIZE, "--press", "P", "--shot-size", 120, 60, "-o", tmp_path / "out")
    for number in (1, 2):
        values = result_of("view", ball_file, *options, "--shot-samples", 2)
        assert values["screenshots"] == [str(tmp_path / "out" / f"ball-view-00{number}.png")]
    with Image.open(values["screenshots"][0]) as picture:
        assert picture.size == (120, 60)
    values = result_of("view", ball_file, *options, "--shot-format", "npy")
    image = np.load(values["screenshots"][0])
    assert image.shape == (60, 120, 4)
    assert image[0, 0].tolist() == [0, 0, 0, 0]
    assert "1<=x<=16384" in fails("view", ball_file, "--offscreen", "--shot-size", 20000, 1)
