"""What one scanline of a face meets: the sample planes with something visible, and which of them a tile needs.

Planes are taken `CHUNK` at a time. A tile finds its planes by comparing bits: the blocks under its pixels
with the plane's mask of visible blocks. (Projecting every run to its tiles instead took 25 ns a run.)
"""

import numpy as np

from .._jit import inlined_kernel, kernel
from .encode import WORD
from .state import TILE

STEEP = 1.5  # tangents beyond this take 2 samples in an interval, beyond twice this 4
CHUNK = 64  # sample planes looked at together; a multiple of 8

# `face`, see `composite.composite`.
(OFFSET_I, OFFSET_J, OFFSET_PITCH, ORIGIN_I, ORIGIN_J, PITCH, EYE_K, SIGN, BASE, LEAST, NEAR) = range(11)

# Rows of `planes`, one column for each sample plane of the chunk that is not empty: its number, counted front
# to back; its distance; scanline and slice before it and the weights of those behind; i of the image's corner
# and how far apart pixels are along i.
NUMBER, DISTANCE, ROW, ROW_WEIGHT, SLICE, SLICE_WEIGHT, CORNER, STEP = range(8)
PLANE_ROWS = 8

_ONE = np.uint64(1)
_BITS = np.uint64(WORD - 1)
_EIGHT = np.uint64(8)


@kernel
def plane_range(t_j, offset_j, face, size_k, per_interval, box):
    """First sample plane that scanline t_j may need, counted front to back, and the one after its last."""
    low_j, high_j, low_k, high_k = box[2], box[3], box[4], box[5]
    sign, e_k = face[SIGN], face[EYE_K]
    # The distances at which the scanline's sheet is in the box, as far as j and k tell.
    near, far = 0.0, np.inf
    if t_j != 0.0:
        one, other = (low_j - offset_j) / t_j, (high_j - offset_j) / t_j
        near, far = max(near, min(one, other)), min(far, max(one, other))
    elif offset_j < low_j or offset_j > high_j:
        return 0, 0
    one, other = sign * (low_k - e_k), sign * (high_k - e_k)
    near, far = max(near, min(one, other)), min(far, max(one, other))
    if near > far:
        return 0, 0
    base = sign * ((0.0 if sign > 0 else size_k - 1.0) - e_k)
    first = max(np.int64(np.ceil((near - 0.5 - base) * per_interval)), 0)
    last = min(np.int64(np.floor((far + 0.5 - base) * per_interval)), (size_k - 1) * per_interval)
    return first, last + 1


@kernel
def collect_planes(first, end, t_j, offset_j, face, size_k, per_interval, box, visible, pairs, planes, masks):
    """Fill `planes` and `masks` with sample planes first … end − 1, empty ones left out; returns their number.

    `masks` uint64 [CHUNK, words + 1]: the visible blocks of the plane's scanline, then a word of zeros.
    """
    low_j, high_j = box[2], box[3]
    last_row = np.ceil(high_j) - 1.0
    sign, e_k = face[SIGN], face[EYE_K]
    first_k = 0.0 if sign > 0 else size_k - 1.0
    spacing = 1.0 / per_interval
    words = visible.shape[2]
    count = 0
    for q in range(first, end):
        k = first_k + sign * (q * spacing)
        distance = sign * (k - e_k)
        j = offset_j + t_j * max(distance, 0.0)
        j = min(max(j, low_j), high_j)
        row, slice_ = min(np.floor(j), last_row), np.floor(k)
        p, at_j, at_k = np.uint64(count), np.uint64(row), np.uint64(slice_)
        seen = np.uint64(0)
        for w in range(np.uint64(words)):
            mask = pairs[at_j, at_k, w] if k != slice_ else visible[at_j, at_k, w]
            masks[p, w] = mask
            seen |= mask
        if seen:
            planes[NUMBER, p] = q
            planes[DISTANCE, p] = distance
            planes[ROW, p] = row
            planes[ROW_WEIGHT, p] = j - row
            planes[SLICE, p] = slice_
            planes[SLICE_WEIGHT, p] = k - slice_
            planes[CORNER, p] = face[OFFSET_I] + face[ORIGIN_I] * max(distance, 0.0)
            planes[STEP, p] = face[OFFSET_PITCH] + face[PITCH] * max(distance, 0.0)
            count += 1
    return count


@inlined_kernel
def window(masks, p, block):
    """64 bits of plane p's mask, from `block` on."""
    w, s = block >> np.uint64(6), block & _BITS
    return (masks[p, w] >> s) | ((masks[p, w + _ONE] << _ONE) << (_BITS - s))


@kernel
def find_hits(pixel, count, stride_mask, box, beyond, planes, masks, hits):
    """Which planes of the chunk a tile may meet: `hits` uint8 (CHUNK) is 1 for those, 0 for the others.

    pixel: the tile's first; `stride_mask`: it takes the planes whose number has none of these bits; `beyond`:
    how far outside the box along i its pixels still read the box's border.
    """
    low, high = box[0] - beyond, box[1] + beyond
    last_cell = np.ceil(box[1]) - 1.0
    many = masks.shape[1] > 2
    centre, across = pixel + 0.5, np.float64(TILE - 1)
    for p in range(np.uint64(count)):
        x_first = planes[CORNER, p] + centre * planes[STEP, p]
        x_last = x_first + across * planes[STEP, p]
        reached = (x_last >= low) & (x_first <= high)
        reached &= (np.int64(planes[NUMBER, p]) & stride_mask) == 0
        begin = np.uint64(np.int64(min(max(x_first, box[0]), last_cell))) >> np.uint64(2)
        end = np.uint64(np.int64(min(max(x_last, box[0]), last_cell))) >> np.uint64(2)
        bits = window(masks, p, begin) if many else masks[p, np.uint64(0)] >> begin
        blocks = min(end - begin, _BITS)  # without the first
        bits &= (np.uint64(2) << blocks) - _ONE
        # A window of more than 64 blocks may hold more than these bits tell.
        hits[p] = np.uint8(reached & ((bits != np.uint64(0)) | (end - begin > _BITS)))
    for p in range(np.uint64(count), (np.uint64(count) + _EIGHT - _ONE) // _EIGHT * _EIGHT):
        hits[p] = np.uint8(0)
