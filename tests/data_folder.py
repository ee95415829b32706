"""Real volumes for tests, which are not part of the project."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

_DEFAULT = Path(__file__).resolve().parents[2] / "shared" / "data"
DATA = Path(os.environ.get("PERSP_SW_DATA") or _DEFAULT)


def volume_path(name: str) -> Path:
    """Path of a volume in the data folder; skips the test where it is absent.

    The folder is named by the environment variable PERSP_SW_DATA, else `../shared/data` beside the project.
    """
    return data_path("volumes", name)


def data_path(folder: str, name: str) -> Path:
    """Path of any file in the data folder; skips the test where it is absent."""
    path = DATA / folder / name
    if not path.is_file():
        pytest.skip(f"{path} is absent; set PERSP_SW_DATA to the data folder")
    return path
