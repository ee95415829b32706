"""Packets, 16 neighbouring pixels on one sample plane: which kernels sample and blend them.

A `Table` classifies the scalar in a plane; an `IntegralTable` takes the mean over the scalars on the piece of
the ray that the plane stands for. `composite` is compiled for the one or the other.
"""

from typing import NamedTuple

import numpy as np

from .._jit import VECTORS, inlined_kernel, kernel_by_type
from . import packet_portable

if VECTORS:
    from . import packet_preintegrated_vector as integrated
    from . import packet_vector as classified
else:
    from . import packet_portable as classified
    from . import packet_preintegrated_portable as integrated

WINDOW = packet_portable.WINDOW
SCRATCH = 4 * packet_portable.SCRATCH  # floats; four lines of a packet's voxels


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


def sample(
    n, width, voxels, at_00, at_10, at_01, at_11, weight_j, weight_k, x, step, low, high, last_cell,
    begin, end, path, table, scratch, cells, lanes, at, section,
):  # fmt: skip
    """What a plane contributes to `section` of the tile at `at`: see `packet_portable.sample` for a `Table`,
    `packet_preintegrated_portable.sample` for an `IntegralTable`. Compiled code only.
    """
    raise NotImplementedError


def blend(n, table, slots, scratch, cells, lanes, at):
    """Lay two samples of each pixel under what is there, front to back; true if no pixel lets enough light
    through to go on. See `packet_portable.blend`. Compiled code only.
    """
    raise NotImplementedError


@inlined_kernel
def _sample_classified(
    n, width, voxels, at_00, at_10, at_01, at_11, weight_j, weight_k, x, step, low, high, last_cell,
    begin, end, path, table, scratch, cells, lanes, at, section,
):  # fmt: skip
    classified.sample(
        n, width, voxels, at_00, at_10, at_01, at_11, weight_j, weight_k, x, step, low, high, last_cell,
        begin, end, scratch, cells, lanes, at + np.int64(section),
    )  # fmt: skip


@inlined_kernel
def _blend_classified(n, table, slots, scratch, cells, lanes, at):
    return classified.blend(n, table.rows, table.origin, table.scale, slots, scratch, cells, lanes, at)


def _is_integral(table):
    return table.instance_class is IntegralTable


@kernel_by_type(sample)
def _choose_sample(
    n, width, voxels, at_00, at_10, at_01, at_11, weight_j, weight_k, x, step, low, high, last_cell,
    begin, end, path, table, scratch, cells, lanes, at, section,
):  # fmt: skip
    return integrated.sample if _is_integral(table) else _sample_classified


@kernel_by_type(blend)
def _choose_blend(n, table, slots, scratch, cells, lanes, at):
    return integrated.blend if _is_integral(table) else _blend_classified
