"""Kernels that turn dense voxels into runs, and back.

Everything here is in standard space of one principal axis: `rows[j, k, i]`, scanlines along i. Cells lie
between neighbouring voxels; a *block* is `BLOCK` = 4 cells of one scanline pair, voxels 4m … 4m + 4 of the
scanlines j and j + 1. Blocks are kept as bits, 64 to a word: word w, bit s is block m = 64 w + s. Four cells
a bit keep the index of a scanline of 256 voxels in one word.

A block is visible if the transfer function can see a value between the smallest and the largest of its
voxels. A scanline stores the voxels of its visible blocks, packed without gaps: a run of blocks [s, e) stores
voxels 4s … 4e, the last of them shared with nobody.
"""

import numpy as np

from .._jit import inlined_kernel, kernel, parallel_kernel, popcount, prange, trailing_zeros

BLOCK = 4  # cells in a block
WORD = 64  # blocks in a word

_ONE, _TWO = np.uint64(1), np.uint64(2)


@parallel_kernel
def block_bounds(rows, low, high):
    """Smallest and largest voxel of every block, NaN left out.

    `rows` [j, k, i]; `low` and `high` [n_j − 1, n_k, blocks] of the same type come filled with the type's
    largest and smallest number, which all-NaN blocks keep.
    """
    n_i = rows.shape[2]
    for j in prange(low.shape[0]):
        for k in range(low.shape[1]):
            for m in range(low.shape[2]):
                smallest = low[j, k, m]
                largest = high[j, k, m]
                for i in range(BLOCK * m, min(BLOCK * m + BLOCK + 1, n_i)):
                    for row in range(j, j + 2):
                        voxel = rows[row, k, i]
                        if voxel < smallest:
                            smallest = voxel
                        if voxel > largest:
                            largest = voxel
                low[j, k, m] = smallest
                high[j, k, m] = largest


@kernel
def _is_visible(low, high, seen, origin, scale):
    """Whether any table entry that an interpolated value in [low, high] may fetch has extinction.

    `seen[n]`: number of entries with extinction before entry n. Entry of a value: round((value − origin)·
    scale) + 1, clamped. float32 interpolation overshoots by a few roundings of the value, and the entry's
    own arithmetic errs by less than 0.01 for up to 4096 entries; a whole entry more on each side, the simple
    rule, would make air visible wherever a ramp begins at its value.
    """
    if not low <= high:
        return False
    last = seen.shape[0] - 2
    slack = 0.01 + 1e-6 * max(abs(low), abs(high)) * scale
    first_entry = min(max((low - origin) * scale + 1.5 - slack, 1.0), np.float64(last))
    last_entry = min(max((high - origin) * scale + 1.5 + slack, 1.0), np.float64(last))
    return seen[np.int64(last_entry) + 1] > seen[np.int64(first_entry)]


@parallel_kernel
def mark_visible_cells(low, high, seen, origin, scale, visible):
    """Bits of the visible blocks of single slices: `visible` [n_j − 1, n_k, words], overwritten."""
    for j in prange(visible.shape[0]):
        for k in range(visible.shape[1]):
            for w in range(visible.shape[2]):
                word = np.uint64(0)
                for m in range(WORD * w, min(WORD * (w + 1), low.shape[2])):
                    if _is_visible(np.float64(low[j, k, m]), np.float64(high[j, k, m]), seen, origin, scale):
                        word |= _ONE << np.uint64(m - WORD * w)
                visible[j, k, w] = word


@parallel_kernel
def mark_visible_pairs(low, high, seen, origin, scale, visible):
    """Bits of the visible blocks of slice pairs (k, k + 1): `visible` [n_j − 1, n_k − 1, words]."""
    for j in prange(visible.shape[0]):
        for k in range(visible.shape[1]):
            for w in range(visible.shape[2]):
                word = np.uint64(0)
                for m in range(WORD * w, min(WORD * (w + 1), low.shape[2])):
                    smallest = np.float64(min(low[j, k, m], low[j, k + 1, m]))
                    largest = np.float64(max(high[j, k, m], high[j, k + 1, m]))
                    if _is_visible(smallest, largest, seen, origin, scale):
                        word |= _ONE << np.uint64(m - WORD * w)
                visible[j, k, w] = word


@parallel_kernel
def mark_needed(visible, pairs, needed):
    """Blocks whose voxels scanline (j, k) must store: those of every visible block that touches it.

    `needed` [n_j, n_k, words]; `pairs`: the blocks of `visible` span slices k and k + 1.
    """
    for j in prange(needed.shape[0]):
        for k in range(needed.shape[1]):
            k_first = max(k - 1, 0) if pairs else k
            for w in range(needed.shape[2]):
                word = np.uint64(0)
                for row in range(max(j - 1, 0), min(j + 1, visible.shape[0])):
                    for slice_ in range(k_first, min(k + 1, visible.shape[1])):
                        word |= visible[row, slice_, w]
                needed[j, k, w] = word


@kernel
def run_ends(needed, j, k, w):
    """Bits of the last blocks of the runs of one scanline's word; a run may go on in the next word."""
    word = needed[j, k, w]
    following = word >> _ONE
    if w + 1 < needed.shape[2]:
        following |= needed[j, k, w + 1] << np.uint64(WORD - 1)
    return word & ~following


@parallel_kernel
def count_voxels(needed, n_i, counts, runs):
    """Voxels stored and runs ended in every word of every scanline; both [n_j, n_k, words], int64."""
    last = (n_i - 2) // BLOCK  # the last block may be shorter
    for j in prange(needed.shape[0]):
        for k in range(needed.shape[1]):
            for w in range(needed.shape[2]):
                word = needed[j, k, w]
                ends = np.int64(popcount(run_ends(needed, j, k, w)))
                count = BLOCK * np.int64(popcount(word)) + ends
                if w == last // WORD and (word >> np.uint64(last % WORD)) & _ONE:
                    count -= BLOCK + 1 - (n_i - BLOCK * last)
                counts[j, k, w] = count
                runs[j, k, w] = ends


@parallel_kernel
def pack(rows, needed, offsets, voxels):
    """Copy the needed voxels of `rows` [j, k, i] to `voxels`; word (j, k, w) starts at its offset."""
    n_i = rows.shape[2]
    for j in prange(needed.shape[0]):
        for k in range(needed.shape[1]):
            for w in range(needed.shape[2]):
                word = needed[j, k, w]
                ends = run_ends(needed, j, k, w)
                at = offsets[j, k, w]
                while word:
                    s = trailing_zeros(word)
                    word &= word - _ONE
                    first = BLOCK * (WORD * w + np.int64(s))
                    extra = np.int64((ends >> s) & _ONE)
                    for i in range(first, min(first + BLOCK + extra, n_i)):
                        voxels[at] = rows[j, k, i]
                        at += 1


@parallel_kernel
def unpack(needed, offsets, voxels, rows, stored):
    """Inverse of `pack`: fills the stored voxels of `rows` [j, k, i] and sets `stored` (bool) there."""
    n_i = rows.shape[2]
    for j in prange(needed.shape[0]):
        for k in range(needed.shape[1]):
            for w in range(needed.shape[2]):
                word = needed[j, k, w]
                ends = run_ends(needed, j, k, w)
                at = offsets[j, k, w]
                while word:
                    s = trailing_zeros(word)
                    word &= word - _ONE
                    first = BLOCK * (WORD * w + np.int64(s))
                    extra = np.int64((ends >> s) & _ONE)
                    for i in range(first, min(first + BLOCK + extra, n_i)):
                        rows[j, k, i] = voxels[at]
                        stored[j, k, i] = True
                        at += 1


@inlined_kernel
def packed_position(needed, offsets, j, k, i):
    """Where voxel i of scanline (j, k) stands in the packed voxels; its block must be stored. All uint64."""
    block = i >> _TWO
    w, s = block >> np.uint64(6), block & np.uint64(WORD - 1)
    word = needed[j, k, w]
    before = word & ((_ONE << s) - _ONE)
    ends = before & ~(word >> _ONE)
    stored = (popcount(before) << _TWO) + popcount(ends) + (i & np.uint64(BLOCK - 1))
    return offsets[j, k, w] + np.int64(stored)


@kernel
def bounding_box(visible, box):
    """Lowest and highest visible block as `box` = [j0, j1, k0, k1, m0, m1], inclusive; j0 > j1 if none."""
    box[0::2] = 1 << 60
    box[1::2] = -1
    for j in range(visible.shape[0]):
        for k in range(visible.shape[1]):
            for w in range(visible.shape[2]):
                word = visible[j, k, w]
                if word:
                    box[0] = min(box[0], j)
                    box[1] = max(box[1], j)
                    box[2] = min(box[2], k)
                    box[3] = max(box[3], k)
                    box[4] = min(box[4], WORD * w + np.int64(trailing_zeros(word)))
                    top = word
                    for shift in (1, 2, 4, 8, 16, 32):
                        top |= top >> np.uint64(shift)
                    box[5] = max(box[5], WORD * w + np.int64(popcount(top)) - 1)
