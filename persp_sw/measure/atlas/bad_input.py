"""Voxels and transfer functions that mean nothing, and whether they are refused."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...errors import TransferFunctionError, VolumeError
from ...optics.transfer import TransferFunction
from ...volume.grid import Volume


def bad_input() -> dict[str, Callable[[], object]]:
    """What must be refused, with a message that says what is wrong."""
    white = (1.0, 1.0, 1.0)
    points = {
        "unsorted points": [(0, white, 0), (9, white, 0.5), (5, white, 1)],
        "three points at one value": [(3, white, 0), (3, white, 0.5), (3, white, 1)],
        "an opacity above 1": [(0, white, 0), (1, white, 1.5)],
        "an opacity below 0": [(0, white, -0.1), (1, white, 1)],
        "a colour above 1": [(0, (0, 2, 0), 0), (1, white, 1)],
        "a value that is NaN": [(np.nan, white, 0), (1, white, 1)],
        "an opacity that is NaN": [(0, white, np.nan), (1, white, 1)],
        "a colour that is NaN": [(0, (0, np.nan, 0), 0.2), (1, white, 1)],
        "an infinite value": [(0, white, 0), (np.inf, white, 1)],
        "no points": [],
    }
    refused: dict[str, Callable[[], object]] = {
        name: lambda rows=rows: TransferFunction(rows) for name, rows in points.items()
    }
    refused["voxels without any value"] = lambda: Volume(np.full((2, 2, 2), np.nan, np.float32))
    refused["complex voxels"] = lambda: Volume(np.zeros((2, 2, 2), complex))
    refused["no voxels"] = lambda: Volume(np.zeros((0, 2, 2), np.float32))
    return refused


def taken_without_a_word() -> list[str]:
    """Names of `bad_input` that were taken, or refused by something else than a message for the user."""
    taken = []
    for name, make in bad_input().items():
        try:
            make()
        except (TransferFunctionError, VolumeError):
            continue
        except Exception as error:
            taken.append(f"{name} ({type(error).__name__})")
        else:
            taken.append(name)
    return taken
