"""docs/rig-files.md says what rig files really are."""

from __future__ import annotations

import re

import pytest
from pydantic import BaseModel
from samples import ROOT

from vr_plugin.rig import STEREO_MODES, TRACKER_KINDS
from vr_plugin.rigs.file import load_rig
from vr_plugin.rigs.problems import _models
from vr_plugin.rigs.schema import RigKeys

TEXT = (ROOT / "docs" / "rig-files.md").read_text()
SNIPPETS = re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL)


def keys_of(model: type[BaseModel]) -> set[str]:
    """All keys of a table and of those in it."""
    found = set(model.model_fields)
    for field in model.model_fields.values():
        for inner in _models(field.annotation):
            found |= keys_of(inner)
    return found


def test_every_key_is_explained():
    words = set(re.findall(r"\w+", " ".join(re.findall(r"`([^`]*)`", TEXT.replace("```", "")))))
    assert keys_of(RigKeys) - words == set()
    assert {*STEREO_MODES, *TRACKER_KINDS} - words == set()


@pytest.mark.parametrize("snippet", SNIPPETS)
def test_the_examples_are_sound(snippet, tmp_path, caplog):
    path = tmp_path / "rig.toml"
    path.write_text(snippet)
    assert load_rig(path).walls[0].name == "screen"


def test_there_are_examples():
    assert len(SNIPPETS) == 2
