"""Sessions: what a preview shows, saved as a scene file and restored, bit by bit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from samples import ball, fails, result_of
from tolerances import FLOAT32_IMAGE

import persp_sw as psw
from persp_sw.errors import SceneError
from vr_plugin.preview.controller import Preview
from vr_plugin.preview.pictures import PreviewPictures
from vr_plugin.preview.saved_view import SavedView
from vr_plugin.preview.session import open_preview, press
from vr_plugin.preview.session_file import save_session, session_of

SIZE = (96, 64)
FULL = {
    "tf": [[0, 0.2, 0.3, 0.8, 0], [200, 1, 0.6, 0.3, 0.4]],
    "opacity_unit": 2.5,
    "clip": [[0.1, 0.2, 1.0, -3.3]],
    "crop": [0.0, 20.0, 1.5, 22.0, 0.0, 23.0],
    "crop_flags": "subvolume",
    "cut": [{"plane": [0.3, 0.1, 1.0, -9.0], "thickness": 1.1, "show": "outside"}],
    "light": {"ambient": 0.3, "power": 7.0},
    "background": [0.1, 0.0, 0.2],
    "eye": [40.3, -50.1, 35.7],
    "centre": [11.5, 11.5, 11.1],
    "up": [0.0, 0.1, 1.0],
    "fovy": 33.3,
    "step": 0.5,
    "frames": 4,
    "eye_step": [1.0, 0.0, 0.0],
    "spacing": [1.0, 1.1, 0.9],
    "max_seconds": 2.0,
}


@pytest.fixture
def scene(ball_file: Path) -> psw.Scene:
    data = ball()
    data[10:14, 2:9, 10:20] = 200
    np.save(ball_file, data)
    return psw.Scene.of_file(ball_file, **FULL)


def opened(scene: psw.Scene, **options: object) -> tuple[Preview, PreviewPictures]:
    return open_preview(scene, psw.Settings(), presets=("fog", "surface"), **{"size": SIZE, **options})


def moved(preview: Preview, keys: str = "") -> None:
    """By hand, so that no number of its camera is a round one; then keys."""
    now = 0.0
    preview.advance(now)
    preview.pointer(10, 10)
    preview.button("left", True)
    preview.pointer(37, 21)
    preview.button("left", False)
    preview.wheel(1.5)
    for _ in range(200):
        now += 0.05
        preview.advance(now)
    press(preview, keys)


def shown(preview: Preview, pictures: PreviewPictures) -> np.ndarray:
    wanted = preview.advance(1e6)
    return pictures.window(wanted, pictures.draw(wanted, pictures.composite(wanted))[0]).copy()


KEYS = ["", "8 X ] ] - -", "5 X", "8 M", "T", "F", ". O", ". . V", "TAB 5"]


@pytest.mark.parametrize("suffix", ["toml", "json"])
@pytest.mark.parametrize("keys", KEYS)
def test_a_restored_session_shows_the_same_bits(scene: psw.Scene, tmp_path: Path, keys: str, suffix: str):
    preview, pictures = opened(scene)
    moved(preview, keys)
    picture = shown(preview, pictures)
    path = tmp_path / f"a.session.{suffix}"
    session_of(scene, preview, pictures).save(path)
    again = psw.Scene.load(path)
    restored, its_pictures = opened(again, size=None)
    assert restored.size == SIZE
    assert np.array_equal(shown(restored, its_pictures), picture)
    before, after = preview.advance(1e6), restored.advance(1e6)
    for name in ("outside", "stereo", "separation", "quality", "overlay", "volume_outside", "style", "speed"):
        assert getattr(after, name) == getattr(before, name), name
    assert np.array_equal(after.camera.pose.matrix, before.camera.pose.matrix)
    # Saved again it is the same, key by key.
    twice = session_of(again, restored, its_pictures)
    keys_of = lambda s: s.keys.model_dump(exclude={"volume"}, exclude_none=True)  # noqa: E731
    assert keys_of(twice) == keys_of(again)


def test_all_keys_of_the_scene_stay_that_are_not_the_views(scene: psw.Scene, tmp_path: Path):
    preview, pictures = opened(scene)
    moved(preview)
    shown(preview, pictures)
    path = save_session(tmp_path, "ball", scene, preview, pictures)
    keys = psw.Scene.load(path).keys
    for name in set(FULL) - {"eye", "centre", "up", "fovy"}:
        assert getattr(keys, name) == getattr(scene.keys, name), name
    assert np.array_equal(psw.Scene.load(path).volume.data, scene.volume.data)
    assert psw.Scene.load(path).volume.spacing == (1, 1.1, 0.9)


def test_render_gives_the_same_picture(scene: psw.Scene, tmp_path: Path):
    preview, pictures = opened(scene)
    moved(preview)
    wanted = preview.advance(1e6)
    picture = pictures.draw(wanted, pictures.composite(wanted))[0]["middle"].copy()
    assert picture[..., 3].max() > 0.3
    # Neither may time a moving eye.
    calm = scene.with_keys(eye_step=None)
    path = save_session(tmp_path, "ball", calm, preview, pictures)
    values = result_of("render", path, "-o", tmp_path / "a.npy", "--samples", 1)
    assert values["size"] == list(SIZE)
    options = psw.Settings(samples_per_interval=1)
    expected = psw.Renderer(scene.volume, scene.transfer, options, scene.regions)
    expected = expected.render(psw.View.through_wall(wanted.camera.position, wanted.camera.wall(SIZE)))
    np.testing.assert_allclose(np.load(tmp_path / "a.npy"), expected, atol=FLOAT32_IMAGE)


def test_a_preset_that_was_chosen_is_saved_by_name(scene: psw.Scene, tmp_path: Path):
    preview, pictures = opened(scene)
    moved(preview, ".")
    shown(preview, pictures)
    keys = session_of(scene, preview, pictures).keys
    assert (keys.tf, keys.opacity_unit) == ("fog", None)


LIT = psw.Look(
    psw.Lighting(
        0.1, 0.7, 0.4, 12.5, lights=(psw.Light((1, 2, 3), (1, 0.9, 0.5), True), psw.Light((0, 0, 1)))
    ),
    psw.Modulation(0.01, 0.3, 0.5, 0.25),
    1.5,
)
EDITED = {
    "a function": {"transfer": psw.TransferFunction([(3, (0.1, 1, 0), 0.0), (90, (1, 1, 0), 0.7)], 0.8)},
    "shapes": {
        "transfer": psw.TransferFunction2D([psw.Box((20, 250), (1, 90), (1, 0.5, 0.2), 0.6, 0.5)], 1.0)
    },
    "a look": {"look": LIT},
    "regions": {
        "regions": psw.Regions(
            crop=(1, 9, 2, 8, 3, 7.5),
            crop_flags="fence",
            clip=[(1, 0, 0, -2.25)],
            cut=[psw.Cut((0, 1, 0, -5), 2)],
        )
    },
}


@pytest.mark.parametrize("edit", EDITED)
@pytest.mark.parametrize("keys", ["", "."])
def test_what_hands_edited_is_saved(scene: psw.Scene, tmp_path: Path, edit: str, keys: str):
    preview, pictures = opened(scene)
    moved(preview, keys)
    preview.choices.edits = replace(preview.choices.edits, **EDITED[edit])
    picture = shown(preview, pictures)
    session_of(scene, preview, pictures).save(tmp_path / "a.session.toml")
    again = psw.Scene.load(tmp_path / "a.session.toml")
    assert np.array_equal(shown(*opened(again)), picture)
    unedited, pictures = opened(scene)
    moved(unedited, keys)
    assert not np.array_equal(shown(unedited, pictures), picture)
    if edit == "a look":
        assert again.look == LIT
        assert psw.Scene.keys_of_look(LIT) == psw.Scene.keys_of_look(again.look)


def test_marks_are_saved_and_restored(scene: psw.Scene, tmp_path: Path):
    preview, pictures = opened(scene)
    choice = psw.marks.MarkChoice(box=True, legend=True, cursor=(1.5, 2, 3), ruler=((0, 0, 0), (1, 2, 2.5)))
    preview.marking.choice = choice
    session_of(scene, preview, pictures).save(tmp_path / "a.session.toml")
    again, _ = opened(psw.Scene.load(tmp_path / "a.session.toml"))
    assert again.marking.choice == choice


def test_a_key_that_is_edited_afterwards_counts(scene: psw.Scene, tmp_path: Path):
    preview, pictures = opened(scene)
    moved(preview)
    session = session_of(scene, preview, pictures)
    saved = SavedView.of_scene(session)
    assert np.array_equal(saved.camera_of(session).position, preview.inside.camera.position)
    edited = session.with_keys(eye=[60.0, 0.0, 0.0])
    np.testing.assert_allclose(saved.camera_of(edited).position, (60, 0, 0), atol=1e-12)
    edited = session.with_keys(fovy=None, parallel_height=20.0)
    assert np.linalg.norm(saved.camera_of(edited).position - preview.inside.camera.position) > 1


def test_a_parallel_scene_becomes_what_the_preview_makes_of_it(ball_file: Path):
    scene = psw.Scene.of_file(ball_file, parallel_height=30.0)
    preview, pictures = opened(scene)
    session = session_of(scene, preview, pictures)
    assert session.keys.parallel_height is None
    assert session.keys.fovy == pytest.approx(30)
    picture = shown(preview, pictures)
    assert np.array_equal(shown(*opened(session)), picture)


def test_sessions_are_numbered_and_never_overwritten(scene: psw.Scene, tmp_path: Path):
    preview, pictures = opened(scene)
    names = [save_session(tmp_path, "ball", scene, preview, pictures).name for _ in range(3)]
    assert names == [f"ball-00{number}.session.toml" for number in (1, 2, 3)]


def test_the_file_is_for_people_too(scene: psw.Scene, tmp_path: Path):
    preview, pictures = opened(scene)
    text = save_session(tmp_path, "ball", scene, preview, pictures).read_text()
    assert "\n[view]\n" in text
    assert "\n[light]\n" in text
    assert 'stereo = "mono"' in text


def test_a_volume_in_memory_cannot_be_saved(tmp_path: Path):
    scene = psw.Scene.of_volume(psw.Volume(ball()), size=SIZE)
    preview, pictures = opened(scene)
    with pytest.raises(SceneError, match="only in memory"):
        save_session(tmp_path, "ball", scene, preview, pictures)


@pytest.mark.parametrize(
    ("view", "words"),
    [
        ({"stero": "mono"}, "view.stero"),
        ({"stereo": "holographic"}, "view.stereo"),
        ({"quality": 99}, "view.quality"),
        ({"camera": {"position": [1, 2, 3]}}, "view.camera.orientation"),
        ({"speed": 0}, "view.speed"),
    ],
)
def test_a_wrong_view_is_said(ball_file: Path, tmp_path: Path, view: dict, words: str):
    scene = psw.Scene.of_file(ball_file, view=view)
    with pytest.raises(SceneError, match=words):
        opened(scene)
    assert scene.view(0) is not None  # who only renders need not care


def test_the_keys_of_the_preview_write_and_restore_them(scene: psw.Scene, tmp_path: Path):
    scene.save(tmp_path / "ball.toml")
    out = tmp_path / "out"
    options = ("--offscreen", "-o", out)
    values = result_of("view", tmp_path / "ball.toml", *options, "--size", *SIZE, "--press", "8 - F5 O")
    (session,) = values["screenshots"]
    assert session == str(out / "ball-001.session.toml")
    first = np.asarray(Image.open(values["pictures"][0]))
    values = result_of("view", session, *options)
    assert values["compositings"] == 2
    assert values["quality"] == pytest.approx(2**-0.5)
    assert np.array_equal(np.asarray(Image.open(values["pictures"][0])), first)
    values = result_of("view", session, *options, "--stereo", "mono", "--quality", 1, "--size", 40, 30)
    assert (values["compositings"], values["quality"]) == (1, 1)
    with Image.open(values["pictures"][0]) as picture:
        assert picture.size == (40, 30)


def test_a_folder_that_fails_does_not_end_the_preview(scene: psw.Scene, tmp_path: Path, monkeypatch):
    scene.save(tmp_path / "ball.toml")
    monkeypatch.setattr(psw.Scene, "save", lambda self, path: (_ for _ in ()).throw(SceneError("disk full")))
    from samples import run

    result = run(
        "view", tmp_path / "ball.toml", "--offscreen", "--size", *SIZE, "--press", "F5", "-o", tmp_path
    )
    assert result.exit_code == 0
    assert "warning: disk full" in result.stderr
    assert "there is no scene file" in fails("view", tmp_path / "none.session.toml", "--offscreen")
