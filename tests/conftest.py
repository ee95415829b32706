"""What all tests share: a seeded generator, small volumes on disk, and the folder of real data."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

SEED = 2001
ROOT = Path(__file__).resolve().parent.parent
DATA = Path(os.environ.get("PERSP_SW_DATA") or ROOT.parent / "shared" / "data")


def pytest_report_header() -> str:
    """The seed, and whether real data are there."""
    return (
        f"random seed {SEED}; real data: {DATA if DATA.is_dir() else f'absent ({DATA}); set PERSP_SW_DATA'}"
    )


@pytest.fixture
def rng() -> np.random.Generator:
    """The same numbers in every run."""
    return np.random.default_rng(SEED)


@pytest.fixture
def real_volume() -> Callable[[str], Path]:
    """Path of a real volume by its file name; skips the test, saying so, where it is absent."""

    def find(name: str) -> Path:
        path = DATA / "volumes" / name
        if not path.is_file():
            pytest.skip(f"real data absent: {path}; set PERSP_SW_DATA")
        return path

    return find


def ball(count: int = 24, dtype: type = np.uint8, top: float = 200.0) -> np.ndarray:
    """(count, count, count) voxels: `top` in the middle, falling linearly to 0 at the faces."""
    grid = np.linspace(-1, 1, count)
    radius = np.sqrt(grid[:, None, None] ** 2 + grid[None, :, None] ** 2 + grid[None, None, :] ** 2)
    return (np.clip(1 - radius, 0, 1) * top).astype(dtype)


@pytest.fixture
def ball_file(tmp_path: Path) -> Path:
    """A ball of 24³ uint8 voxels as .npy."""
    path = tmp_path / "ball.npy"
    np.save(path, ball())
    return path
