"""The README says only what is so: its snippet runs, its commands, options, keys and links exist."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import click
import numpy as np
import pytest
from PIL import Image
from samples import ROOT, run_snippet

from persp_sw.cli import main
from persp_sw.scene import Scene
from persp_sw.scene_schema import SceneKeys

TEXT = (ROOT / "README.md").read_text()


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", TEXT, re.DOTALL)


def test_the_python_snippet_makes_a_picture(tmp_path: Path):
    (snippet,) = blocks("python")
    assert len(snippet.strip().splitlines()) <= 12  # "ten lines" and the imports
    run_snippet(snippet, tmp_path)
    with Image.open(tmp_path / "first.png") as picture:
        assert picture.size == (400, 400)
        assert np.asarray(picture).max() > 200


def commands() -> list[str]:
    lines = "\n".join(blocks("sh")).splitlines()
    return [line.partition("#")[0].strip() for line in lines if line.startswith("persp-sw")]


@pytest.mark.parametrize("line", commands())
def test_commands_and_their_options_exist(line: str):
    _, name, *arguments = shlex.split(line)
    command = main.get_command(click.Context(main), name)
    assert command is not None, name
    # Parsing checks every option and value; nothing is run.
    command.make_context(name, arguments)


def test_make_targets_exist():
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    assert set(re.findall(r"`?make ([a-z]+)", TEXT)) <= targets


def test_every_scene_key_is_told():
    section = TEXT[TEXT.index("## Scene files") : TEXT.index("## Spaces")]
    untold = [key for key in SceneKeys.model_fields if f"`{key}`" not in section]
    assert not untold


def test_the_scene_file_shown_is_one(tmp_path: Path):
    (scene,) = blocks("json")
    np.save(tmp_path / "head.npy", np.zeros((4, 4, 4), np.uint8))
    keys = json.loads(scene) | {"volume": "head.npy"}
    (tmp_path / "scene.json").write_text(json.dumps(keys))
    assert len(Scene.load(tmp_path / "scene.json").views()) == 21


def test_links_and_files_exist():
    for target in re.findall(r"\]\(([^)]+)\)", TEXT):
        assert target.startswith("https://") or (ROOT / target).is_file(), target
    for name in ("tests/test_architecture.py", "constraints.txt"):
        assert name in TEXT
        assert (ROOT / name).is_file()


def test_the_picture_is_small():
    assert (ROOT / "docs" / "images" / "demo-side.png").stat().st_size <= 200_000


def test_the_map_names_what_is_there():
    shown = TEXT[TEXT.index("## Map of the code") : TEXT.index("## How it is tested")]
    for path in sorted((ROOT / "persp_sw").iterdir()):
        if path.suffix == ".py" and not path.name.startswith("__"):
            assert path.stem in shown, path.name
        elif path.is_dir() and (path / "__init__.py").is_file() and any(path.glob("[a-z]*.py")):
            assert f"{path.name}/" in shown, path.name
