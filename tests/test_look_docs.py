"""docs/look.md says only what is so: its snippet runs, its commands and options exist."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import click
import numpy as np
import pytest
from PIL import Image
from samples import ROOT, run_snippet

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
