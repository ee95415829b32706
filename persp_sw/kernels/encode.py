"""Kernels that turn dense voxels into runs, and back.

Everything here is in standard space of one principal axis: `rows[j, k, i]`, scanlines along i. Cells lie
between neighbouring voxels; a *block* is `BLOCK` = 4 cells of one scanline pair, voxels 4m … 4m + 4 of the
scanlines j and j + 1. Blocks are kept as bits, 64 to a word: word w, bit s is block m = 64 w + s. Four cells
a bit keep the index of a scanline of 256 voxels in one word.

A block is visible if the transfer function can see a value between the smallest and the largest of its
voxels (`kernels/bounds.py`). A scanline stores the voxels of its visible blocks, packed without gaps: a run
of blocks [s, e) stores voxels 4s … 4e, the last of them shared with nobody.
"""

import numpy as np

from .._jit import bits_of, inlined_kernel, kernel, parallel_kernel, popcount, prange, trailing_zeros

BLOCK = 4  # cells in a block
WORD = 64  # blocks in a word
# Packed voxels are read in vectors that may begin before a run and end after it.
PADDING = 128

_NONE, _ONE, _TWO = np.uint64(0), np.uint64(1), np.uint64(2)
_LAST = np.uint64(WORD - 1)
_TILE = 64  # scanlines turned at a time: a cache line of 8-bit voxels
_APART = 64  # voxels between them: powers of two would share a few lines of the cache


@kernel
def _flag(low, high, other_low, other_high, first, last, flags):
    """Set the flags of blocks of which one of both lows is ≤ last and one of both highs ≥ first."""
    for m in range(np.uint64(low.shape[0])):
        begins = (low[m] <= last) | (other_low[m] <= last)
        ends = (high[m] >= first) | (other_high[m] >= first)
        flags[m] |= np.uint8(begins & ends)


@parallel_kernel
def mark_visible(low, high, first, last, visible):
    """Bits of the visible blocks, of slices or of slice pairs.

    Parameters
    ----------
    low, high
        [n_j, n_k, blocks]: bounds of the blocks of slices.
    first, last
        Of the same type: a block is visible if low ≤ last[n] and high ≥ first[n] for any n.
    visible
        uint64 [n_j, n_k, words], overwritten; [n_j, n_k − 1, words] for the slice pairs (k, k + 1).
    """
    to_other = low.shape[1] - visible.shape[1]
    words = visible.shape[2]
    for j in prange(visible.shape[0]):
        flags = np.empty(WORD * words, np.uint8)
        for k in range(visible.shape[1]):
            flags[:] = 0
            other = k + to_other
            for n in range(first.shape[0]):
                _flag(low[j, k], high[j, k], low[j, other], high[j, other], first[n], last[n], flags)
            for w in range(words):
                visible[j, k, w] = bits_of(flags[WORD * w : WORD * (w + 1)])


@kernel
def _run_ends(needed, j, k, w):
    """Bits of the last blocks of the runs of one scanline's word; a run may go on in the next word."""
    word = needed[j, k, w]
    following = word >> _ONE
    if w + 1 < needed.shape[2]:
        following |= needed[j, k, w + 1] << np.uint64(WORD - 1)
    return word & ~following


@inlined_kernel
def _visible_near(visible, j_first, j_end, k_first, k_end, w):
    """Word w of what is visible in any of these scanline pairs, which may lie beyond the volume."""
    word = _NONE
    for j in range(max(j_first, 0), min(j_end, visible.shape[0])):
        for k in range(max(k_first, 0), min(k_end, visible.shape[1])):
            word |= visible[j, k, w]
    return word


@parallel_kernel
def mark_needed(visible, pairs, reach, n_i, needed, counts, runs):
    """Blocks whose voxels scanline (j, k) must store: those of every visible block that touches it.

    Parameters
    ----------
    visible
        Bits of the visible blocks; with `pairs` those of slices k and k + 1.
    reach
        Voxels along each axis, 0 … 4, beyond a visible block that are stored, too: its gradients' neighbours.
    n_i
        Voxels of a scanline.
    needed, counts
        [n_j, n_k, words], overwritten: bits of the needed blocks, and how many voxels each word stores.
    runs
        int64 [n_j], overwritten: number of runs of the scanlines j.
    """
    last = (n_i - 2) // BLOCK  # the last block may be shorter
    words = needed.shape[2]
    for j in prange(needed.shape[0]):
        ended = 0
        for k in range(needed.shape[1]):
            k_first = k - 1 if pairs else k
            for w in range(words):
                word = _visible_near(visible, j - 1, j + 1, k_first, k + 1, w)
                if reach > 0:
                    word |= (word << _ONE) | (word >> _ONE)
                    if w > 0:
                        word |= _visible_near(visible, j - 1, j + 1, k_first, k + 1, w - 1) >> _LAST
                    if w + 1 < words:
                        word |= _visible_near(visible, j - 1, j + 1, k_first, k + 1, w + 1) << _LAST
                    word |= _visible_near(visible, j - 1 - reach, j + 1 + reach, k_first, k + 1, w)
                    word |= _visible_near(visible, j - 1, j + 1, k_first - reach, k + 1 + reach, w)
                    if w == words - 1:
                        word &= (_TWO << np.uint64(last % WORD)) - _ONE
                needed[j, k, w] = word
            for w in range(words):
                word = needed[j, k, w]
                ends = np.int64(popcount(_run_ends(needed, j, k, w)))
                count = BLOCK * np.int64(popcount(word)) + ends
                if w == last // WORD and (word >> np.uint64(last % WORD)) & _ONE:
                    count -= BLOCK + 1 - (n_i - BLOCK * last)
                counts[j, k, w] = count
                ended += ends
        runs[j] = ended


@kernel
def _copy_runs(needed, offsets, j, k, scanline, packed, unpack):
    """Copy the needed voxels of one scanline to where they are packed, or back."""
    n_i = scanline.shape[0]
    for w in range(needed.shape[2]):
        word = needed[j, k, w]
        ends = _run_ends(needed, j, k, w)
        at = offsets[j, k, w]
        while word:
            s = trailing_zeros(word)
            n = trailing_zeros(~(word >> s))
            word &= word + (_ONE << s)
            shared = np.int64((ends >> (s + n - _ONE)) & _ONE)
            begin = BLOCK * (WORD * w + np.int64(s))
            end = min(begin + BLOCK * np.int64(n) + shared, n_i)
            there, here = packed[at : at + end - begin], scanline[begin:end]
            if unpack:
                for i in range(np.uint64(end - begin)):
                    here[i] = there[i]
            else:
                for i in range(np.uint64(end - begin)):
                    there[i] = here[i]
            at += end - begin


@kernel
def _transpose_needed(plane, needed, buffer):
    """buffer[x, i] = plane[i, x] for the blocks that any scanline `needed` [x, words] needs."""
    n_i, n_x = plane.shape
    for w in range(needed.shape[1]):
        word = np.uint64(0)
        for x in range(n_x):
            word |= needed[x, w]
        while word:
            begin = BLOCK * (WORD * w + np.int64(trailing_zeros(word)))
            word &= word - _ONE
            for i in range(begin, min(begin + BLOCK + 1, n_i)):
                row = plane[i]
                for x in range(np.uint64(n_x)):
                    buffer[x, np.uint64(i)] = row[x]


@parallel_kernel
def pack_along_x(voxels, needed, offsets, packed):
    """Copy the needed voxels of `voxels` [z, y, x] for principal axis z, each word's to its offset."""
    for y in prange(needed.shape[0]):
        for z in range(needed.shape[1]):
            _copy_runs(needed, offsets, y, z, voxels[z, y], packed, False)


@parallel_kernel
def pack_along_y(voxels, needed, offsets, packed):
    """The same for principal axis x: scanlines along y, tiles of which are turned in the cache."""
    n_z, n_y, n_x = voxels.shape
    for z in prange(n_z):
        buffer = np.empty((_TILE, n_y + _APART), voxels.dtype)
        for begin in range(0, n_x, _TILE):
            end = min(begin + _TILE, n_x)
            _transpose_needed(voxels[z, :, begin:end], needed[z, begin:end], buffer)
            for x in range(begin, end):
                _copy_runs(needed, offsets, z, x, buffer[x - begin, :n_y], packed, False)


@parallel_kernel
def pack_along_z(voxels, needed, offsets, packed):
    """The same for principal axis y: scanlines along z, tiles of which are turned in the cache."""
    n_z, n_y, n_x = voxels.shape
    for y in prange(n_y):
        buffer = np.empty((_TILE, n_z + _APART), voxels.dtype)
        for begin in range(0, n_x, _TILE):
            end = min(begin + _TILE, n_x)
            _transpose_needed(voxels[:, y, begin:end], needed[begin:end, y], buffer)
            for x in range(begin, end):
                _copy_runs(needed, offsets, x, y, buffer[x - begin, :n_z], packed, False)


@parallel_kernel
def unpack(needed, offsets, packed, rows):
    """Inverse of packing: fills the stored voxels of `rows` [j, k, i], contiguous."""
    for j in prange(needed.shape[0]):
        for k in range(needed.shape[1]):
            _copy_runs(needed, offsets, j, k, rows[j, k], packed, True)


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
