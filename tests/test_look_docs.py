"""docs/look.md says only what is so: its snippet runs, its commands and options exist."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import click
import numpy as np
import pytest
from PIL import Image
from samples import ROOT, ball, result_of, run_snippet

from persp_sw.cli import main

TEXT = (ROOT / "docs" / "look.md").read_text()
(COMMANDS,) = re.findall(r"```sh\n(.*?)```", TEXT, re.DOTALL)


@pytest.mark.parametrize("line", COMMANDS.splitlines())
def test_commands_and_their_options_exist(line: str):
    _, name, *arguments = shlex.split(line, comments=True)
    main.get_command(click.Context(main), name).make_context(name, arguments)


def test_the_snippet_makes_a_picture(tmp_path: Path):
    (snippet,) = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    run_snippet(snippet, tmp_path)
    with Image.open(tmp_path / "lit.png") as picture:
        assert picture.size == (128, 128)
        assert np.asarray(picture).max() > 100


def test_the_scene_beside_vtk_can_be_drawn(tmp_path: Path):
    (scene,) = re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL)
    (name,) = re.findall(r"persp-sw bench (\S+) --peer vtk", TEXT)
    assert name in scene and "engine.nrrd" in scene
    np.save(tmp_path / "engine.npy", ball())
    (tmp_path / name).write_text(scene.replace("engine.nrrd", "engine.npy"))
    result_of("render", tmp_path / name, "-o", tmp_path / "engine-lit.png")
    with Image.open(tmp_path / "engine-lit.png") as picture:
        assert picture.size == (256, 256) and np.asarray(picture).max() > 100
