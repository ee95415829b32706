"""The scene file's keys of light, gradient and two-dimensional transfer functions."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from samples import ball

import persp_sw as psw
from persp_sw.errors import SceneError
from persp_sw.scene_look import GradientKeys, LightKeys

BOX = {"shape": "box", "values": [10, 90], "magnitudes": [0, 30], "colour": [1, 0, 0], "opacity": 0.5}
TRIANGLE = {
    "shape": "triangle", "value": 100, "magnitudes": [5, 60], "width": 30,
    "colour": [0, 0.5, 1], "opacity": 0.8, "soft": 1.0,
}  # fmt: skip


def scene(**keys) -> psw.Scene:
    return psw.Scene.of_volume(psw.Volume(ball(), name="mine"), **keys)


def problems(**keys) -> str:
    with pytest.raises(SceneError) as caught:
        scene(**keys)
    return str(caught.value)


def test_a_scene_without_these_keys_is_plain():
    assert scene().look == psw.Look() and scene().look.is_plain
    assert scene(light={"ambient": 0.7}).look.is_plain  # waits for `shade`
    assert scene(gradient={"distance": 2}).look == psw.Look(gradient_distance=2.0)


def test_what_is_missing_of_the_light_is_as_the_dataclass_has_it():
    assert scene(shade=True).look == psw.Look(psw.Lighting())
    light = {"ambient": 0.1, "power": 5, "emissive": 0.2, "headlight": [1, 0.5, 0], "two_sided": False}
    expected = psw.Lighting(0.1, power=5, emissive=0.2, headlight=(1, 0.5, 0), two_sided=False)
    assert scene(shade=True, light=light).look.lighting == expected
    assert scene(shade=True, light={"headlight": 0, "model": "blinn"}).look.lighting.headlight == (0, 0, 0)
    assert LightKeys().model_dump() == {
        name: value for name, value in vars(psw.Lighting()).items() if name != "lights"
    } | {"headlight": 1.0}


@pytest.mark.parametrize(("default", "expected"), [(None, (False, True, False)), (True, (True, True, False))])
def test_lights_and_their_shadows(default, expected):
    lights = [
        {"direction": [1, 2, 3]},
        {"direction": [0, 0, -2], "colour": [2, 1, 0], "shadows": True},
        {"direction": [0, 1, 0], "shadows": False},
    ]
    keys = {"shade": True, "lights": lights} | ({} if default is None else {"shadows": default})
    found = scene(**keys).look.lighting.lights
    assert found == (
        psw.Light((1, 2, 3), shadows=expected[0]),
        psw.Light((0, 0, -1), (2, 1, 0), expected[1]),
        psw.Light((0, 1, 0), shadows=expected[2]),
    )


@pytest.mark.parametrize(
    ("gradient", "expected"),
    [
        ({"opacity": 1}, psw.Modulation()),
        ({"opacity": 0.5, "low": 0.1, "high": 0.2}, psw.Modulation(0.1, 0.2, 0.5)),
        ({"colour": 0.7}, psw.Modulation(opacity=0.0, colour=0.7)),
        ({"opacity": 0.3, "colour": 0.7, "low": 0.5, "high": 0.6}, psw.Modulation(0.5, 0.6, 0.3, 0.7)),
    ],
)
def test_modulation_of_what_is_named(gradient, expected):
    assert scene(gradient=gradient).look == psw.Look(None, expected)
    assert scene(gradient={**gradient, "distance": 2}).look == psw.Look(None, expected, 2.0)


def test_defaults_of_the_gradient_are_the_dataclasses():
    keys, modulation = GradientKeys(), psw.Modulation()
    assert (keys.low, keys.high, keys.distance) == (
        modulation.low,
        modulation.high,
        psw.Look().gradient_distance,
    )


def test_a_two_dimensional_function():
    function = scene(tf2d=[BOX, TRIANGLE]).transfer
    box = psw.Box((10, 90), (0, 30), (1, 0, 0), 0.5)
    triangle = psw.Triangle(100, (5, 60), 30, (0, 0.5, 1), 0.8, 1.0)
    assert function.shapes == (box, triangle)
    assert function.opacity_unit == 1.0
    assert scene(tf2d=[BOX], opacity_unit=3).transfer.opacity_unit == 3
    assert scene(tf2d=[BOX]).preset is None and scene().preset is not None
    assert isinstance(scene(tf2d=[BOX]).with_keys(tf2d=None, tf="fog").transfer, psw.TransferFunction)


@pytest.mark.parametrize("name", ["copy.json", "copy.toml"])
def test_saved_and_loaded_again(ball_file: Path, name: str):
    keys = {
        "shade": True, "light": {"specular": 0.5}, "lights": [{"direction": [1, 2, 3], "colour": [1, 0, 0]}],
        "shadows": True, "gradient": {"colour": 0.5}, "tf2d": [BOX, TRIANGLE],
    }  # fmt: skip
    first = psw.Scene.of_file(ball_file, **keys)
    first.save(ball_file.parent / name)
    again = psw.Scene.load(ball_file.parent / name)
    assert again.look == first.look and again.transfer.shapes == first.transfer.shapes
    assert not again.look.is_plain


def test_every_problem_is_told_at_once(ball_file: Path):
    bad = {
        "volume": "ball.npy",
        "shade": 1,
        "light": {"ambient": -1, "headlght": 1, "model": "gouraud", "two_sided": "yes", "headlight": [1, 2]},
        "lights": [
            {"colour": [1, 1, 1]},
            {"direction": [0, 0, 0], "shadow": True},
            {"direction": [1, 0, 0], "colour": 9999},
        ],
        "gradient": {"distance": 9, "low": -0.1, "opacity": "x"},
        "tf2d": [{"shape": "disc"}, {**BOX, "color": 1}, {**TRIANGLE, "width": 0}],
    }
    (ball_file.parent / "bad.json").write_text(json.dumps(bad))
    with pytest.raises(SceneError) as caught:
        psw.Scene.load(ball_file.parent / "bad.json")
    text = str(caught.value)
    for words in (
        "shade: expected true or false",
        "light.ambient: ambient lies between 0 and 1000; given -1",
        "light.headlght: unknown key; did you mean headlight?",
        "light.model: model is one of phong, blinn; given 'gouraud'",
        "light.two_sided: two_sided is true or false",
        "light.headlight: headlight must be 3 finite numbers",
        "lights[0].direction: this key is missing",
        "lights[1].direction: a light's direction needs a length",
        "lights[1].shadow: unknown key; did you mean shadows?",
        "lights[2].colour: a light's colour lies between 0 and 1000",
        "gradient.distance: gradient_distance lies between 0.5 and 4",
        "gradient.low: modulation's low lies between 0 and 1",
        "gradient.opacity: modulation's opacity lies between 0 and 1",
        'tf2d[0]: a shape is {"shape": "box" or "triangle"',
        "tf2d[1]: a box has no color; did you mean colour?",
        "tf2d[2]: a triangle's width",
    ):
        assert words in text, words
    assert "bad.json has 16 problems" in text


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"lights": [{"direction": [1, 0, 0]}]}, 'lights: without "shade": true nothing is lit; add it'),
        ({"shadows": True}, 'shadows: without "shade": true nothing is lit'),
        ({"shadows": True, "shade": True}, "shadows: the headlight casts none; give lights, too"),
        ({"tf2d": [BOX], "tf": "fog"}, "tf2d: it takes the place of tf; give one of the two"),
        ({"tf2d": []}, "tf2d: expected at least 1; given []"),
        ({"tf2d": BOX}, "tf2d: expected a list"),
        ({"gradient": {"low": 0.1}}, "gradient: low and high do nothing without opacity or colour"),
        ({"gradient": {"low": 0.5, "opacity": 1}}, "gradient: modulation's low is below its high"),
        ({"gradient": 2}, "gradient: expected keys and values {…}; given 2"),
        ({"light": {"zzz": 1}}, "light.zzz: unknown key; the keys are ambient, diffuse"),
    ],
)
def test_one_problem_says_what_to_do(keys, words):
    text = problems(**keys)
    assert words in text and "a problem:" in text
