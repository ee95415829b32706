"""Kernels for the smallest and largest voxels of blocks and bricks, computed once per volume.

A block is `encode.BLOCK` = 4 cells of the scanlines j and j + 1 in one slice, a brick 4³ cells; both share
their outer voxels with their neighbours. Whatever the principal axis, voxels are read in memory's order, rows
of x at a time, so that the loops become vectors. A comparison with NaN is false, so NaN moves no bound;
what holds nothing else keeps `none_low` > `none_high`, which no voxel reaches.

Rows are handed on as one-dimensional slices: indexed where they lie, the compiler does not see that they are
contiguous and apart (256³ 8-bit, two cores: 12 instead of 3 ms).
"""

import numpy as np

from .._jit import kernel, parallel_kernel, prange
from .encode import BLOCK


@kernel
def _widen(low, high, a, b, c, d, e):
    """Widen the bounds, one for each place of the rows, to those of five rows of voxels."""
    for x in range(np.uint64(low.shape[0])):
        smallest, largest = low[x], high[x]
        voxel = a[x]
        smallest, largest = voxel if voxel < smallest else smallest, voxel if voxel > largest else largest
        voxel = b[x]
        smallest, largest = voxel if voxel < smallest else smallest, voxel if voxel > largest else largest
        voxel = c[x]
        smallest, largest = voxel if voxel < smallest else smallest, voxel if voxel > largest else largest
        voxel = d[x]
        smallest, largest = voxel if voxel < smallest else smallest, voxel if voxel > largest else largest
        voxel = e[x]
        smallest, largest = voxel if voxel < smallest else smallest, voxel if voxel > largest else largest
        low[x], high[x] = smallest, largest


@kernel
def _rows(first, n):
    """First to fifth voxel of the block that begins at `first`, the last of n repeated."""
    last = n - 1
    return first, min(first + 1, last), min(first + 2, last), min(first + 3, last), min(first + 4, last)


@kernel
def _add_pairs(low, high):
    """Widen bounds at x to those at x and x + 1."""
    for x in range(np.uint64(low.shape[0] - 1)):
        here, beyond = low[x], low[x + np.uint64(1)]
        low[x] = beyond if beyond < here else here
        here, beyond = high[x], high[x + np.uint64(1)]
        high[x] = beyond if beyond > here else here


@kernel
def _bound_two(a, b, none_low, none_high, low, high):
    """Bounds of two rows of voxels at each of their places."""
    for x in range(np.uint64(a.shape[0])):
        voxel, other = a[x], b[x]
        smallest = voxel if voxel < none_low else none_low
        low[x] = other if other < smallest else smallest
        largest = voxel if voxel > none_high else none_high
        high[x] = other if other > largest else largest


@kernel
def _bound_fives(low, high, block_low, block_high):
    """Bounds of blocks from those of voxels, of which the row holds `BLOCK` more than there are."""
    for m in range(np.uint64(block_low.shape[0])):
        x = np.uint64(BLOCK) * m
        smallest, largest = low[x], high[x]
        for n in range(np.uint64(1), np.uint64(BLOCK + 1)):
            below, above = low[x + n], high[x + n]
            smallest = below if below < smallest else smallest
            largest = above if above > largest else largest
        block_low[m], block_high[m] = smallest, largest


@parallel_kernel
def bound_blocks_along_x(voxels, none_low, none_high, low, high):
    """Bounds of the blocks of principal axis z.

    Parameters
    ----------
    voxels
        [z, y, x], contiguous.
    none_low, none_high
        Of the voxels' type: more than the largest and less than the smallest of them, or these themselves.
    low, high
        [n_y − 1, n_z, blocks]; overwritten.
    """
    n_z, n_y, n_x = voxels.shape
    for y in prange(n_y - 1):
        smallest = np.empty(n_x + BLOCK, voxels.dtype)
        largest = np.empty(n_x + BLOCK, voxels.dtype)
        for z in range(n_z):
            _bound_two(voxels[z, y], voxels[z, y + 1], none_low, none_high, smallest[:n_x], largest[:n_x])
            smallest[n_x:] = none_low
            largest[n_x:] = none_high
            _bound_fives(smallest, largest, low[y, z], high[y, z])


@parallel_kernel
def bound_blocks_along_y(voxels, none_low, none_high, low, high):
    """Bounds of the blocks of principal axis x: `low`, `high` [n_z − 1, n_x, blocks]; see above."""
    n_z, n_y, n_x = voxels.shape
    blocks = low.shape[2]
    for z in prange(n_z - 1):
        smallest = np.full((blocks, n_x), none_low)
        largest = np.full((blocks, n_x), none_high)
        for m in range(blocks):
            a, b, c, d, e = _rows(BLOCK * m, n_y)
            for sheet in (voxels[z], voxels[z + 1]):
                _widen(smallest[m], largest[m], sheet[a], sheet[b], sheet[c], sheet[d], sheet[e])
        for x in range(n_x):
            for m in range(np.uint64(blocks)):
                low[z, x, m] = smallest[m, x]
                high[z, x, m] = largest[m, x]


@parallel_kernel
def bound_blocks_along_z(voxels, none_low, none_high, low, high):
    """Bounds of the blocks of principal axis y: `low`, `high` [n_x − 1, n_y, blocks]; see above."""
    n_z, n_y, n_x = voxels.shape
    blocks = low.shape[2]
    for y in prange(n_y):
        smallest = np.full((blocks, n_x), none_low)
        largest = np.full((blocks, n_x), none_high)
        for m in range(blocks):
            a, b, c, d, e = _rows(BLOCK * m, n_z)
            _widen(
                smallest[m], largest[m], voxels[a, y], voxels[b, y], voxels[c, y], voxels[d, y], voxels[e, y]
            )
            _add_pairs(smallest[m], largest[m])
        for x in range(n_x - 1):
            for m in range(np.uint64(blocks)):
                low[x, y, m] = smallest[m, x]
                high[x, y, m] = largest[m, x]


@parallel_kernel
def bound_bricks(voxels, none_low, none_high, low, high):
    """Bounds of bricks: `low`, `high` [bricks along z, y, x]; see above."""
    n_z, n_y, n_x = voxels.shape
    for block_z in prange(low.shape[0]):
        smallest = np.empty(n_x + BLOCK, voxels.dtype)
        largest = np.empty(n_x + BLOCK, voxels.dtype)
        for block_y in range(low.shape[1]):
            smallest[:] = none_low
            largest[:] = none_high
            a, b, c, d, e = _rows(BLOCK * block_y, n_y)
            for z in range(BLOCK * block_z, min(BLOCK * block_z + BLOCK + 1, n_z)):
                sheet = voxels[z]
                _widen(smallest[:n_x], largest[:n_x], sheet[a], sheet[b], sheet[c], sheet[d], sheet[e])
            _bound_fives(smallest, largest, low[block_z, block_y], high[block_z, block_y])
