"""Packets, 16 neighbouring pixels on one sample plane: which kernels sample, light and blend them.

A `Table` classifies the scalar in a plane; an `IntegralTable` takes the mean over the scalars on the piece of
the ray that the plane stands for; lit ones do the same and look at gradients, too. `composite` is compiled
for each of them when it is first used.
"""

import numpy as np

from .._jit import VECTORS, inlined_kernel, kernel_by_type
from . import packet_portable
from .packet_lit import light_up, shows_classified, shows_integrated
from .phong import REACH
from .tables import IntegralTable, LitIntegralTable, LitTable

if VECTORS:
    from . import packet_preintegrated_vector as integrated
    from . import packet_vector as classified
else:
    from . import packet_portable as classified
    from . import packet_preintegrated_portable as integrated

WINDOW = packet_portable.WINDOW
SCRATCH = 4 * packet_portable.SCRATCH  # floats; four lines of a packet's voxels


def sample(
    n, width, voxels, at_00, at_10, at_01, at_11, weight_j, weight_k, x, step, low, high, last_cell,
    begin, end, path, table, scratch, cells, lanes, at, section,
):  # fmt: skip
    """What a plane contributes to `section` of the tile at `at`: see `packet_portable.sample` for a `Table`,
    `packet_preintegrated_portable.sample` for an `IntegralTable`. Compiled code only.
    """
    raise NotImplementedError


def reach_of(table):
    """Cells beyond those of a packet's window that it looks at. Compiled code only."""
    raise NotImplementedError


def shows(n, table, cells, lanes, at, section):
    """Whether any of a packet's samples shows anything to a ray that goes on; `table`: a lit one. Compiled
    code only.
    """
    raise NotImplementedError


def illuminate(
    n, start, begin, end, cell, y, z, x, step, low, high, ray, path, share, level, table, scratch, cells,
    lanes, at, section, light, sample_at,
):  # fmt: skip
    """Find what gradients change of the samples in `section`, if a `table` asks for it and they show
    anything; see `packet_lit.light_up`. Compiled code only.
    """
    raise NotImplementedError


def blend(n, table, slots, scratch, cells, lanes, at, light):
    """Lay two samples of each pixel under what is there, front to back; true if no pixel lets enough light
    through to go on. See `packet_portable.blend`; `light`: where the light's sections begin. Compiled code
    only.
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
def _blend_classified(n, table, slots, scratch, cells, lanes, at, light):
    return classified.blend(n, table.rows, table.origin, table.scale, slots, scratch, cells, lanes, at)


@inlined_kernel
def _blend_integrated(n, table, slots, scratch, cells, lanes, at, light):
    return integrated.blend(n, table, slots, scratch, cells, lanes, at)


@inlined_kernel
def _blend_lit(n, table, slots, scratch, cells, lanes, at, light):
    last = table.seen.shape[0] - 1
    return classified.blend_lit(
        n, table.rows, table.origin, table.scale, last, slots, scratch, cells, lanes, at, light
    )


@inlined_kernel
def _blend_lit_integrated(n, table, slots, scratch, cells, lanes, at, light):
    return integrated.blend_lit(n, table, slots, scratch, cells, lanes, at, light)


@inlined_kernel
def _no_reach(table):
    return np.uint64(0)


@inlined_kernel
def _lit_reach(table):
    return np.uint64(np.ceil(table.numbers[REACH]))


@inlined_kernel
def _no_light(
    n, start, begin, end, cell, y, z, x, step, low, high, ray, path, share, level, table, scratch, cells,
    lanes, at, section, light, sample_at,
):  # fmt: skip
    return


@inlined_kernel
def _light(
    n, start, begin, end, cell, y, z, x, step, low, high, ray, path, share, level, table, scratch, cells,
    lanes, at, section, light, sample_at,
):  # fmt: skip
    if shows(n, table, cells, lanes, np.uint64(at), section):
        light_up(
            n, start, begin, end, cell, y, z, x, step, low, high, ray, path, share, level, table, scratch,
            cells, lanes, np.uint64(at), section, light, sample_at,
        )  # fmt: skip


def _by_kind(table, classified, integrated, lit, lit_integrated):
    kinds = {IntegralTable: integrated, LitTable: lit, LitIntegralTable: lit_integrated}
    return kinds.get(table.instance_class, classified)


@kernel_by_type(sample)
def _choose_sample(
    n, width, voxels, at_00, at_10, at_01, at_11, weight_j, weight_k, x, step, low, high, last_cell,
    begin, end, path, table, scratch, cells, lanes, at, section,
):  # fmt: skip
    return _by_kind(table, _sample_classified, integrated.sample, _sample_classified, integrated.sample)


@kernel_by_type(reach_of)
def _choose_reach(table):
    return _by_kind(table, _no_reach, _no_reach, _lit_reach, _lit_reach)


@kernel_by_type(shows)
def _choose_shows(n, table, cells, lanes, at, section):
    return shows_integrated if table.instance_class is LitIntegralTable else shows_classified


@kernel_by_type(illuminate)
def _choose_light(
    n, start, begin, end, cell, y, z, x, step, low, high, ray, path, share, level, table, scratch, cells,
    lanes, at, section, light, sample_at,
):  # fmt: skip
    return _by_kind(table, _no_light, _no_light, _light, _light)


@kernel_by_type(blend)
def _choose_blend(n, table, slots, scratch, cells, lanes, at, light):
    return _by_kind(table, _blend_classified, _blend_integrated, _blend_lit, _blend_lit_integrated)
