"""Scene files: what they mean, and how they fail."""

from __future__ import annotations

import json
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from samples import ball

import persp_sw as psw
from persp_sw.errors import FileError, SceneError, VolumeError
from persp_sw.scene_schema import SceneKeys

ROWS = [[0, 0, 0, 0, 0], [100, 1, 0.5, 0.2, 0.1], [200, 1, 1, 1, 0.8]]
FULL = {
    "name": "full",
    "volume": "ball.npy",
    "spacing": [1, 2, 3],
    "tf": ROWS,
    "opacity_unit": 2.5,
    "eye": [100, 20, 30],
    "centre": [11, 22, 33],
    "up": [0, 0, 1],
    "fovy": 40,
    "size": [64, 48],
    "frames": 4,
    "eye_step": [1, 0, -1],
    "step": 0.5,
    "shade": True,
    "light": {"ambient": 0.3, "headlight": [0.5, 0.4, 0.3], "model": "blinn"},
    "lights": [{"direction": [1, 2, 3]}, {"direction": [0, 0, -2], "colour": [2, 1, 0], "shadows": False}],
    "shadows": True,
    "gradient": {"distance": 1.5, "high": 0.5, "opacity": 0.8},
    "clip": [[1, 0, 0, -3]],
    "crop": [0, 20, 1, 21, 2, 22],
    "crop_flags": "fence",
    "cut": [{"plane": [0, 0, 1, -5], "thickness": 2, "show": "outside"}],
    "background": [0.1, 0.2, 0.3],
    "max_seconds": 6,
}


def written(folder: Path, keys: dict, name: str = "scene.json") -> Path:
    path = folder / name
    path.write_text(json.dumps(keys))
    return path


def test_every_key_arrives(ball_file: Path):
    scene = psw.Scene.load(written(ball_file.parent, FULL))
    assert scene.name == "full"
    assert scene.volume.data.shape == (24, 24, 24)
    assert scene.volume.spacing == (1, 2, 3)
    assert scene.transfer.to_dict() == {"tf": ROWS, "opacity_unit": 2.5}
    slab = psw.Cut((0, 0, 1, -5), 2, "outside")
    assert scene.regions == psw.Regions((0, 20, 1, 21, 2, 22), [(1, 0, 0, -3)], [slab], "fence")
    assert scene.background.tolist() == [0.1, 0.2, 0.3]
    assert (scene.frames, scene.animated, scene.step, scene.max_seconds) == (4, True, 0.5, 6)
    view, expected = scene.view(0), psw.View.look_at((100, 20, 30), (11, 22, 33), (0, 0, 1), 40, (64, 48))
    np.testing.assert_allclose(view.direction_from_pixel, expected.direction_from_pixel, atol=1e-12)
    assert view.size == (64, 48)


def test_a_scene_of_a_volume_alone_shows_all_of_it(ball_file: Path):
    scene = psw.Scene.load(written(ball_file.parent, {"volume": "ball.npy"}))
    assert (scene.name, scene.size, scene.frames, scene.animated) == ("scene", (512, 512), 1, False)
    assert scene.preset is not None
    corners = np.array(list(product((0, 23), repeat=3)), float)
    pixels = scene.view().project(corners)
    assert ((pixels > 0) & (pixels < 512)).all()
    assert np.ptp(pixels, axis=0).max() > 0.8 * 512  # and fills the picture
    eye = scene.view().eye.position - scene.volume.centre
    assert eye[0] > 0 and eye[1] < 0 and eye[2] > 0  # right, front, above


def test_a_given_eye_gets_an_angle_that_shows_all(ball_file: Path):
    scene = psw.Scene.of_file(ball_file, eye=[90, 80, 11], size=[300, 200])
    pixels = scene.view().project(np.array(list(product((0, 23), repeat=3)), float))
    assert ((pixels > 0) & (pixels < (300, 200))).all()


@pytest.mark.parametrize("size", [(400, 100), (100, 400)])
def test_wide_and_tall_pictures_show_all_too(ball_file: Path, size):
    scene = psw.Scene.of_file(ball_file, size=size)
    pixels = scene.view().project(np.array(list(product((0, 23), repeat=3)), float))
    assert ((pixels > 0) & (pixels < size)).all()


@pytest.mark.parametrize("direction", [(0, 0, 1), (0, 0, -1)])
def test_looking_along_z_needs_no_up(ball_file: Path, direction):
    scene = psw.Scene.of_file(ball_file, eye=[11.5 + 90 * d for d in direction])
    assert np.isfinite(scene.view().direction_from_pixel).all()


def test_the_eye_steps_and_the_centre_stays(ball_file: Path):
    scene = psw.Scene.of_file(ball_file, eye=[0, -90, 20], centre=[11, 11, 11], eye_step=[2, 1, 0], frames=3)
    views = scene.views()
    assert len(views) == 4  # the warm-up and three timed ones
    for frame, view in enumerate(views):
        assert view.eye.position.tolist() == [2 * frame, frame - 90, 20]
        np.testing.assert_allclose(view.project(np.array([11.0, 11, 11])), [256, 256], atol=1e-9)


def test_chosen_eye_keeps_its_choice_while_it_steps(ball_file: Path):
    scene = psw.Scene.of_file(ball_file, eye_step=[1, 0, 0], frames=2)
    first, _, last = scene.views()
    np.testing.assert_allclose(last.eye.position - first.eye.position, [2, 0, 0])


def test_toml_means_the_same(ball_file: Path):
    path = ball_file.with_name("scene.toml")
    path.write_text('volume = "ball.npy"\nfovy = 25\nsize = [40, 30]\nlight = {power = 3}\n')
    scene = psw.Scene.load(path)
    assert (scene.size, scene.keys.fovy, scene.keys.light.power) == ((40, 30), 25, 3)


def test_opacity_unit_is_one_world_unit_for_rows_only(ball_file: Path):
    fine = psw.Scene.of_file(ball_file, tf=ROWS, spacing=[0.1, 0.1, 0.1])
    assert fine.transfer.opacity_unit == 1.0
    assert psw.Scene.of_file(ball_file, tf="fog").transfer.opacity_unit is None
    assert psw.Scene.of_file(ball_file, tf="fog", opacity_unit=3).transfer.opacity_unit == 3


def test_a_transfer_function_by_name_and_by_file(ball_file: Path):
    assert psw.Scene.of_file(ball_file, tf="surface").preset.name == "surface"
    psw.TransferFunction.from_rows(ROWS, 4.0).save(ball_file.with_name("saved.json"))
    scene = psw.Scene.of_file(ball_file, tf="saved.json")
    assert scene.preset is None
    assert scene.transfer.to_dict() == {"tf": ROWS, "opacity_unit": 4.0}


def test_spacing_drops_the_whole_pose(tmp_path: Path):
    sitk = pytest.importorskip("SimpleITK")
    image = sitk.GetImageFromArray(ball())
    image.SetSpacing((2, 2, 2))
    image.SetOrigin((50, 60, 70))
    image.SetDirection((-1, 0, 0, 0, -1, 0, 0, 0, 1))
    sitk.WriteImage(image, str(tmp_path / "posed.mha"))
    posed = psw.Scene.of_file(tmp_path / "posed.mha").volume
    assert posed.world_from_object[0].tolist() == [-2, 0, 0, 50]
    plain = psw.Scene.of_file(tmp_path / "posed.mha", spacing=[1, 1, 4]).volume
    assert plain.world_from_object.tolist() == np.diag([1.0, 1, 4, 1]).tolist()
    assert plain.orientation == ""


def test_the_volume_is_read_only_when_asked_for(tmp_path: Path):
    (tmp_path / "broken.npy").write_bytes(b"no array")
    scene = psw.Scene.of_file(tmp_path / "broken.npy")
    with pytest.raises((FileError, VolumeError)):
        _ = scene.volume


def test_a_raw_file_with_what_it_does_not_say(tmp_path: Path):
    raw = tmp_path / "ball.raw"
    raw.write_bytes(b"head" + ball().astype(">u2").tobytes())
    scene = psw.Scene.of_file(raw, shape=[24, 24, 24], dtype="uint16", byte_order="big", header_bytes=4)
    assert np.array_equal(scene.volume.data, ball())


def test_a_scene_of_a_volume_in_memory():
    volume = psw.Volume(ball(), name="mine")
    scene = psw.Scene.of_volume(volume, tf=np.array(ROWS), eye=np.array([90.0, 0, 0]))
    assert scene.volume is volume
    assert scene.transfer.values.tolist() == [0, 100, 200]
    assert psw.Scene.of_volume(volume, spacing=(1, 2, 3)).volume.spacing == (1, 2, 3)
    with pytest.raises(SceneError, match="only in memory"):
        scene.save("nowhere.json")


@pytest.mark.parametrize("name", ["copy.json", "copy.toml"])
def test_saved_and_loaded_again_from_elsewhere(ball_file: Path, name: str):
    (ball_file.parent / "sub").mkdir()
    scene = psw.Scene.load(written(ball_file.parent, FULL))
    copy = ball_file.parent / "sub" / name
    scene.save(copy)
    again = psw.Scene.load(copy)
    assert again.keys.model_dump(exclude={"volume"}) == scene.keys.model_dump(exclude={"volume"})
    assert np.array_equal(again.volume.data, scene.volume.data)


@pytest.mark.parametrize(
    ("step", "samples"), [(None, None), (2, None), (1, None), (0.5, 2), (0.3, 2), (0.25, 4), (0.1, 4)]
)
def test_step_is_a_hint_for_samples(ball_file: Path, step, samples):
    keys = {} if step is None else {"step": step}
    assert psw.Scene.of_file(ball_file, **keys).samples_per_interval == samples


def test_with_keys_replaces_some(ball_file: Path):
    scene = psw.Scene.load(written(ball_file.parent, FULL)).with_keys(size=[8, 9])
    assert (scene.size, scene.frames) == ((8, 9), 4)


def test_all_problems_are_listed_at_once(ball_file: Path):
    bad = {
        "volum": "a",
        "spacing": [1, 0, "x"],
        "tf": [[3, 0, 0, 0, 1], [1, 0, 0, 0, 1]],
        "crop": [1, 2],
        "size": [0, 5.5],
        "frames": 0,
        "fovy": 180,
        "eye": [1, 2, "far"],
        "background": [0, 0, 3],
        "light": {"ambiant": 1},
        "clip": [[0, 0, 0, 1]],
        "cut": [{"plane": [0, 0, 1, 3]}],
        "crop_flags": "fenc",
    }
    with pytest.raises(SceneError) as caught:
        psw.Scene.load(written(ball_file.parent, bad))
    text = str(caught.value)
    for words in (
        "did you mean volume?",
        "volume: this key is missing",
        "spacing[1]: expected a number greater than 0; given 0",
        'spacing[2]: expected a number; given "x"',
        "tf: control points must be sorted",
        "crop: too few numbers",
        "size[0]: expected a number at least 1",
        "size[1]: expected a whole number",
        "frames: expected a number at least 1",
        "fovy: expected a number less than 180",
        "eye[2]: expected a number",
        "background[2]: expected a number at most 1",
        "light.ambiant: unknown key; did you mean ambient?",
        "clip: a clip plane",
        "cut: a cut is {plane",
        "crop_flags: crop_flags is a whole number of 27 bits",
    ):
        assert words in text
    assert "scene.json has 16 problems" in text


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("eyestep", [0, 0, 1], "did you mean eye_step?"),
        ("fov", 30, "did you mean fovy?"),
        ("zzz", 1, "the keys are volume, name"),
        ("shade", "yes", "expected true or false"),
        ("tf", "ct_bones", "did you mean ct_bone?"),
        ("tf", 7, "a preset's name"),
        ("tf", [[1, 2]], "five numbers"),
        ("eye", [float("nan"), 0, 0], "finite number"),
        ("size", [20000, 10], "at most 16384"),
        ("component", "speed", "whole number from 0"),
        ("component", -1, "whole number from 0"),
        ("byte_order", "middle", "'little' or 'big'"),
        ("frames", True, "whole number"),
        ("crop_flags", "fence", "give crop, too"),
        ("cut", 5, "expected a list"),
        ("volume", "missing.nrrd", "there is no file or folder"),
    ],
)
def test_one_problem_says_what_to_do(ball_file: Path, key, value, words):
    with pytest.raises(SceneError) as caught:
        psw.Scene.of_file(ball_file, **{key: value}) if key != "volume" else psw.Scene(
            {"volume": value}, ball_file.parent
        )
    assert words in str(caught.value)
    assert "a problem:" in str(caught.value)


def test_a_view_that_is_none_is_found_before_anything_is_read(ball_file: Path):
    with pytest.raises(SceneError, match="same point"):
        psw.Scene.of_file(ball_file, eye=[1, 2, 3], centre=[1, 2, 3])
    with pytest.raises(SceneError, match=r"frame 2.*same point"):
        psw.Scene.of_file(ball_file, eye=[1, 2, 1], centre=[1, 2, 3], eye_step=[0, 0, 1], frames=2)
    with pytest.raises(SceneError, match="parallel to the line of sight"):
        psw.Scene.of_file(ball_file, eye=[9, 2, 1], centre=[1, 2, 1], up=[2, 0, 0])


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("{", "not valid JSON"),
        ("[1, 2]", "holds a list"),
        ("3", "holds a number"),
        (b"\xff\xfe\x00", "not a text file"),
        ("", "not valid JSON"),
        ("[" * 100_000, "not valid JSON"),
    ],
)
def test_files_that_are_no_scenes(tmp_path: Path, content, words):
    path = tmp_path / "scene.json"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(SceneError, match=words):
        psw.Scene.load(path)


def test_a_missing_file_and_bad_toml(tmp_path: Path):
    with pytest.raises(SceneError, match="there is no scene file"):
        psw.Scene.load(tmp_path / "none.json")
    (tmp_path / "bad.toml").write_text("volume = ")
    with pytest.raises(SceneError, match="not valid TOML"):
        psw.Scene.load(tmp_path / "bad.toml")


def test_saving_where_one_cannot(ball_file: Path):
    with pytest.raises(SceneError, match="cannot write the scene"):
        psw.Scene.of_file(ball_file).save(ball_file.parent / "none" / "scene.json")


def test_the_contract_has_all_its_keys():
    # DESIGN, "Scene file", word for word.
    contract = (
        "volume spacing tf eye centre up fovy size frames eye_step step shade light clip crop background "
        "cut crop_flags lights shadows gradient tf2d opacity_unit name max_seconds"
    )
    assert set(contract.split()) <= set(SceneKeys.model_fields)
