"""Options of light: they reach the renderer, over the scene file's keys, and wrong ones are told."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from samples import ROOT, ball

import persp_sw as psw
from persp_sw.cli import main
from persp_sw.commands.options import open_scene

LIGHT = {"ambient": 0.1, "diffuse": 0.5, "power": 9}


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    np.save(tmp_path / "ball.npy", ball())
    keys = {
        "volume": "ball.npy", "tf": [[10, 1, 0.5, 0.2, 0], [200, 1, 0.9, 0.8, 0.5]], "size": [40, 40],
        "shade": True, "light": LIGHT, "lights": [{"direction": [1, 0, 0], "shadows": True}],
        "gradient": {"distance": 2, "colour": 0.5},
    }  # fmt: skip
    (tmp_path / "scene.json").write_text(json.dumps(keys))
    return tmp_path / "scene.json"


def look(path: Path, **given) -> psw.Look:
    return open_scene(str(path), lambda *_: None, **given).look


def test_numbers_stand_beside_those_of_the_file(scene_file: Path):
    lit = look(scene_file, specular=0.7, power=30.0).lighting
    assert (lit.ambient, lit.diffuse, lit.specular, lit.power) == (0.1, 0.5, 0.7, 30)
    assert lit.lights == (psw.Light((1, 0, 0), shadows=True),)
    modulated = look(scene_file, modulate=0.25)
    assert modulated.modulation == psw.Modulation(opacity=0.25, colour=0.5)
    assert modulated.gradient_distance == 2


def test_lights_replace_those_of_the_file_and_light_a_volume(scene_file: Path):
    given = ((0.0, 0.0, 2.0), (0.0, 1.0, 0.0))
    expected = (psw.Light((0, 0, 1), shadows=True), psw.Light((0, 1, 0), shadows=True))
    assert look(scene_file, lights=given, shadows=True).lighting.lights == expected
    volume = scene_file.parent / "ball.npy"
    assert look(volume).is_plain
    assert look(volume, lights=given[:1]).lighting == psw.Lighting(lights=[psw.Light((0, 0, 1))])
    assert look(volume, ambient=0.4).lighting == psw.Lighting(ambient=0.4)


def test_no_shade_puts_out_the_files_lights(scene_file: Path):
    assert look(scene_file, shade=False).lighting is None


LINE = "--light 1 2 3 --light -1 0 0 --shadows --ambient 0.3 --diffuse 0.6 --specular 0.1 --power 7"
OPTIONS = LINE.split()
MEANT = psw.Look(
    psw.Lighting(0.3, 0.6, 0.1, 7, lights=[psw.Light(d, shadows=True) for d in ((1, 2, 3), (-1, 0, 0))]),
    psw.Modulation(opacity=0.5),
)


def test_render_shows_what_python_does(scene_file: Path):
    volume, out = scene_file.parent / "ball.npy", scene_file.parent / "out.npy"
    given = ["render", str(volume), "-o", str(out), "--size", "40", "40", *OPTIONS, "--modulate", "0.5"]
    done = CliRunner().invoke(main, given)
    assert done.exit_code == 0, done.output
    scene = psw.Scene.of_file(volume, size=[40, 40])
    renderer = psw.Renderer(scene.volume, scene.transfer, regions=scene.regions, look=MEANT)
    np.testing.assert_array_equal(np.load(out), renderer.render(scene.view()))


@pytest.mark.parametrize("command", [["view"], ["movie"], ["cave", "room.toml"]])
def test_other_commands_pass_them_on(command, scene_file: Path, monkeypatch):
    seen = {}

    def opened(path, progress, **given):
        seen.update(given)
        raise psw.PerspSWError("seen")

    monkeypatch.setattr(f"vr_plugin.commands.{command[0]}.open_scene", opened)
    configs = ROOT / "configs"
    command = [str(configs / "cave4.toml") if one == "room.toml" else one for one in command]
    more = [] if command[0] == "movie" else ["--offscreen"]
    done = CliRunner().invoke(main, [*command, str(scene_file), *more, *OPTIONS, "--modulate", "0.5"])
    assert isinstance(done.exception, SystemExit | psw.PerspSWError), done.output
    assert seen["lights"] == ((1, 2, 3), (-1, 0, 0)) and seen["shadows"] is True
    assert [seen[name] for name in ("ambient", "diffuse", "specular", "power", "modulate")] == [
        0.3, 0.6, 0.1, 7, 0.5,
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ("--light 0 0 0", "a light's direction needs a length"),
        ("--shadows", "the headlight casts none"),
        ("--ambient -1", "ambient"),
        ("--power 0", "power"),
        ("--modulate 2", "opacity"),
        ("--no-shade --light 1 0 0", "--no-shade and --light are opposites"),
        ("--no-shade --ambient 1", "--no-shade and --ambient are opposites"),
    ],
)
def test_what_cannot_be_is_told(options: str, said: str, scene_file: Path):
    volume = scene_file.parent / "ball.npy"
    done = CliRunner().invoke(main, ["render", str(volume), "-o", str(volume) + ".png", *options.split()])
    assert done.exit_code == 2, done.output
    assert said in done.output and "Traceback" not in done.output
