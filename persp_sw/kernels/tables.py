"""Transfer functions as kernels look them up; which of them it is chooses the kernel.

They are flat, for numba hands no nested tuples to threads.
"""

from typing import NamedTuple, TypeAlias

import numpy as np


class Table(NamedTuple):
    """A transfer function; see `optics.classification.Classification`."""

    rows: np.ndarray
    origin: np.float32
    scale: np.float32


class IntegralTable(NamedTuple):
    """A transfer function's integrals; see `optics.preintegration.Preintegration`."""

    sums: np.ndarray
    beyond: np.ndarray
    origin: np.float32
    scale: np.float32
    end: np.float32
    unit: np.float32
    steps: np.float32


class LitTable(NamedTuple):
    """A `Table`, and what gradients change: a `phong.Shade`.

    rows: where magnitudes count, so many for each of them, one magnitude after the other. seen: uint8, one
    for each row of a single magnitude: whether it shows anything at any of them.
    """

    rows: np.ndarray
    origin: np.float32
    scale: np.float32
    seen: np.ndarray
    numbers: np.ndarray
    lights: np.ndarray
    shadows: np.ndarray


class LitIntegralTable(NamedTuple):
    """An `IntegralTable`, and what gradients change: a `phong.Shade`."""

    sums: np.ndarray
    beyond: np.ndarray
    origin: np.float32
    scale: np.float32
    end: np.float32
    unit: np.float32
    steps: np.float32
    places: np.ndarray
    numbers: np.ndarray
    lights: np.ndarray
    shadows: np.ndarray


AnyTable: TypeAlias = Table | IntegralTable | LitTable | LitIntegralTable
