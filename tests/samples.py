"""Small things that many tests need."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from click.testing import CliRunner, Result

from persp_sw.cli import main

ROOT = Path(__file__).resolve().parent.parent


def ball(count: int = 24, dtype: type = np.uint8, top: float = 200.0) -> np.ndarray:
    """(count, count, count) voxels: `top` in the middle, falling linearly to 0 at the faces."""
    grid = np.linspace(-1, 1, count)
    radius = np.sqrt(grid[:, None, None] ** 2 + grid[None, :, None] ** 2 + grid[None, None, :] ** 2)
    return (np.clip(1 - radius, 0, 1) * top).astype(dtype)


def run(*arguments: object) -> Result:
    """The program, run inside this process."""
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def result_of(*arguments: object) -> dict:
    """The one JSON object on stdout of a run that succeeds and says nothing else."""
    result = run(*arguments, "--json")
    assert result.exit_code == 0, result.output
    assert result.stderr == ""
    return json.loads(result.stdout)


def fails(*arguments: object, code: int = 2) -> str:
    """The message of a run that must fail: `error: …`, no traceback, nothing on stdout."""
    result = run(*arguments)
    assert result.exit_code == code, result.output
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    return result.stderr[result.stderr.index("error: ") :]


def run_snippet(snippet: str, folder: Path) -> None:
    """A program of the documentation, run in a folder as a user would: it succeeds and warns of nothing."""
    program = folder / "snippet.py"
    program.write_text(snippet)
    done = subprocess.run(
        [sys.executable, "-W", "error", program],
        cwd=folder,
        env={"PYTHONPATH": str(ROOT), "PATH": "", "HOME": str(Path.home())},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr


def spawn(*arguments: object, **environment: str) -> subprocess.CompletedProcess:
    """The program in a process of its own, for what a run in this one cannot show."""
    return subprocess.run(
        [sys.executable, "-m", "persp_sw", *map(str, arguments)],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
        timeout=120,
    )
