"""Fixtures for all tests, and a line on what they run with."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numba
import numpy as np
import pytest
from data_folder import DATA
from gl_context import clean_offscreen_context
from samples import ball

SEED = 2001


def pytest_report_header() -> str:
    """The seed, and whether real data are there."""
    return (
        f"random seed {SEED}; real data: {DATA if DATA.is_dir() else f'absent ({DATA}); set PERSP_SW_DATA'}"
    )


@pytest.fixture(autouse=True, scope="session")
def no_types_of_tests_in_the_kernels_cache() -> Iterator[None]:
    """A kernel called with a type that a test defines is kept by its name: the program cannot load it."""
    yield
    folder = Path(numba.config.CACHE_DIR)
    kept = [path for path in folder.glob("*/*.nbi") if not path.parent.name.startswith("tests_")]
    named = [path.name for path in kept if b"test_" in path.read_bytes()]
    assert not named, f"compiled for types of tests: {named}; mend that and delete {folder}"


@pytest.fixture(autouse=True, scope="session")
def no_ladders_of_the_user(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Tests neither use nor leave what `persp-sw chart` keeps for this machine."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_DATA_HOME", str(tmp_path_factory.mktemp("data")))
        yield


@pytest.fixture
def rng() -> np.random.Generator:
    """The same numbers in every run."""
    return np.random.default_rng(SEED)


@pytest.fixture
def gl_context() -> Iterator[object]:
    """A current `OffscreenContext` without OpenGL errors, before and after."""
    with clean_offscreen_context() as context:
        yield context


@pytest.fixture
def ball_file(tmp_path: Path) -> Path:
    """A ball of 24³ uint8 voxels as .npy."""
    path = tmp_path / "ball.npy"
    np.save(path, ball())
    return path


@pytest.fixture
def scene_file(ball_file: Path) -> Path:
    """A scene of that ball: small, moving, with a smooth transfer function."""
    path = ball_file.with_name("scene.json")
    keys = {
        "volume": "ball.npy",
        "tf": [[0, 0.2, 0.3, 0.8, 0], [200, 1, 0.6, 0.3, 0.4]],
        "eye": [40, -50, 35],
        "centre": [11.5, 11.5, 11.5],
        "eye_step": [1, 0, 0],
        "frames": 5,
        "size": [48, 40],
        "background": [0, 0, 1],
    }
    path.write_text(json.dumps(keys))
    return path
