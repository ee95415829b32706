"""What one scanline of a face meets: sample planes with something visible, and which of them a tile needs.

Planes are taken `CHUNK` at a time. A tile finds its planes by comparing bits: the blocks under its pixels
with the plane's mask of visible blocks. (Projecting every run to its tiles instead took 25 ns a run.)
"""

from typing import NamedTuple

import numpy as np

from .._jit import inlined_kernel, kernel, lean_kernel, popcount, prefetch
from .encode import WORD
from .state import TILE

STEEP = 1.5  # tangents beyond this take 2 samples in an interval, beyond twice this 4
ROUNDING = 0.01  # voxels that float32 may place a pixel too far along i
CHUNK = 64  # sample planes looked at together; a multiple of 8

# `face`, see `composite.composite`.
(
    OFFSET_I, OFFSET_J, OFFSET_PITCH, ORIGIN_I, ORIGIN_J, PITCH, EYE_K, SIGN, BASE, LEAST, NEAR, MIDDLE,
) = range(12)  # fmt: skip

# Rows of `planes`, one column for each sample plane of the chunk that is not empty: its number in its level,
# counted front to back; its distance; in the level's voxels, the scanline and slice before it and the weights
# of those behind, i of the image's corner, how far apart pixels are along i, and the part of the box along i;
# how many voxels of the volume one slice interval of the level is; 0 for the fine level, 1 for the coarse;
# its share of the extinction at distance BASE, and how that grows with the distance; how far a ray of tangent
# 1 goes along i, in the level's voxels, in one of its slice intervals.
(
    NUMBER, DISTANCE, ROW, ROW_WEIGHT, SLICE, SLICE_WEIGHT, CORNER, STEP, LOW, HIGH, INTERVAL, LEVEL, SHARE,
    SLOPE, SLANT,
) = range(15)  # fmt: skip
PLANE_ROWS = 15

_ONE = np.uint64(1)
_BITS = np.uint64(WORD - 1)
_EIGHT = np.uint64(8)
_LINE = 64  # voxels, a cache line where they are bytes


class Level(NamedTuple):
    """The runs of one principal axis of one level of detail.

    visible, pairs, needed, offsets, voxels: see `volume.runs.AxisRuns`. factor: float64 (3,), voxels of the
    volume that one voxel of the level is, along i, j and k; per_voxel: 1 / factor. box: float64 [i0, i1, j0,
    j1, k0, k1], the shown
    part in the level's voxels; look-ups along i and j are clamped to it. seen: float64 [j0, j1, k0, k1], the
    part of it with anything visible. slices, columns: how many along k and i.
    """

    visible: np.ndarray
    pairs: np.ndarray
    needed: np.ndarray
    offsets: np.ndarray
    voxels: np.ndarray
    factor: np.ndarray
    per_voxel: np.ndarray
    box: np.ndarray
    seen: np.ndarray
    slices: np.int64
    columns: np.int64


class Chunk(NamedTuple):
    """Sample planes of a scanline that are looked at together.

    queue: int64 [next fine plane, end, next coarse plane, end]. planes: float64 [PLANE_ROWS, CHUNK]. masks:
    uint64 [words + 1, CHUNK], the visible blocks of each plane's scanline, then zeros. hits: uint64, a byte
    for each plane, 1 where the tile at work may meet it; flags: the same bytes.
    """

    queue: np.ndarray
    planes: np.ndarray
    masks: np.ndarray
    hits: np.ndarray
    flags: np.ndarray


@kernel
def new_chunk(words):
    """Room for a chunk of scanlines of so many words of blocks."""
    hits = np.zeros(CHUNK // 8, np.uint64)
    planes, masks = np.empty((PLANE_ROWS, CHUNK), np.float64), np.empty((words + 1, CHUNK), np.uint64)
    return Chunk(np.empty(4, np.int64), planes, masks, hits, hits.view(np.uint8))


@lean_kernel
def plane_range(t_j, offset_j, face, limits, per_interval, level):
    """First sample plane of a level that scanline t_j may need, front to back, and the one after the last.

    limits: the distances between which it is wanted.
    """
    near, far = limits[0], limits[1]
    low_j, high_j = level.seen[0] * level.factor[1], level.seen[1] * level.factor[1]
    interval = level.factor[2]
    sign, e_k = face[SIGN], face[EYE_K]
    # The distances at which the scanline's sheet is in what can be seen, as far as j and k tell.
    if t_j != 0.0:
        one, other = (low_j - offset_j) / t_j, (high_j - offset_j) / t_j
        near, far = max(near, min(one, other)), min(far, max(one, other))
    elif offset_j < low_j or offset_j > high_j:
        return 0, 0
    one, other = sign * (level.seen[2] * interval - e_k), sign * (level.seen[3] * interval - e_k)
    near, far = max(near, min(one, other)), min(far, max(one, other))
    if near > far:
        return 0, 0
    base = sign * ((0.0 if sign > 0 else (level.slices - 1.0) * interval) - e_k)
    first = max(np.int64(np.ceil(((near - base) / interval - 0.5) * per_interval)), 0)
    last = min(
        np.int64(np.floor(((far - base) / interval + 0.5) * per_interval)), (level.slices - 1) * per_interval
    )
    return first, last + 1


@inlined_kernel
def _plane_distance(q, face, spacing, level):
    """Distance and slice coordinate, in the level's voxels, of a level's sample plane q."""
    first_k = 0.0 if face[SIGN] > 0 else level.slices - 1.0
    k = first_k + face[SIGN] * (q * spacing)
    return face[SIGN] * (k * level.factor[2] - face[EYE_K]), k


@inlined_kernel
def _next_middle(q, per_interval, face):
    """The next plane, `q` or later, that is the middle of a piece for LEAST samples an interval or more.

    With m samples those are the odd multiples of per_interval / 2m.
    """
    return q + 1 if q & (per_interval // np.int64(face[LEAST]) - 1) == 0 else q


@inlined_kernel
def _prefetch_row(level, j, k):
    """Ask for the voxels of a scanline, all of them: a miss of the second-level cache takes 100 ns."""
    last = np.uint64(level.needed.shape[2] - 1)
    end = level.offsets[j, k, last] + np.int64(popcount(level.needed[j, k, last]) << np.uint64(2))
    for at in range(level.offsets[j, k, 0], end + _LINE, _LINE):
        prefetch(level.voxels, at)


@inlined_kernel
def _place_plane(p, q, number, share, slope, t_j, offset_j, face, spacing, level, chunk):
    """Note sample plane q of a level in column p if anything in its scanline is visible; returns whether."""
    planes, masks = chunk.planes, chunk.masks
    distance, k = _plane_distance(q, face, spacing, level)
    ahead = max(distance, 0.0)
    unclamped = (offset_j + t_j * ahead) * level.per_voxel[1]
    j = min(max(unclamped, level.box[2]), level.box[3])
    first_row, slice_ = min(np.floor(j), np.ceil(level.box[3]) - 1.0), np.floor(k)
    at_j, at_k = np.uint64(np.int64(first_row)), np.uint64(np.int64(slice_))
    words = np.uint64(level.visible.shape[2])
    seen = np.uint64(0)
    for w in range(words):
        mask = level.pairs[at_j, at_k, w] if k != slice_ else level.visible[at_j, at_k, w]
        masks[w, p] = mask
        seen |= mask
    if seen == np.uint64(0):
        return False
    for w in range(words, np.uint64(masks.shape[0])):
        masks[w, p] = np.uint64(0)
    _prefetch_row(level, at_j, at_k)
    _prefetch_row(level, at_j + _ONE, at_k)
    planes[NUMBER, p] = q
    planes[DISTANCE, p] = distance
    planes[ROW, p] = first_row
    planes[ROW_WEIGHT, p] = j - first_row
    planes[SLICE, p] = slice_
    planes[SLICE_WEIGHT, p] = k - slice_
    if face[MIDDLE] != 0.0:  # the scalar there is followed along the ray, so it must be on the ray
        planes[ROW_WEIGHT, p] = unclamped - first_row
        planes[SLICE_WEIGHT, p] += face[SIGN] * (ahead - distance) * level.per_voxel[2]
    planes[CORNER, p] = (face[OFFSET_I] + face[ORIGIN_I] * ahead) * level.per_voxel[0]
    planes[STEP, p] = (face[OFFSET_PITCH] + face[PITCH] * ahead) * level.per_voxel[0]
    planes[LOW, p] = level.box[0]
    planes[HIGH, p] = level.box[1]
    planes[INTERVAL, p] = level.factor[2]
    planes[LEVEL, p] = number
    planes[SHARE, p] = share + slope * face[BASE]
    planes[SLOPE, p] = slope
    planes[SLANT, p] = level.factor[2] * level.per_voxel[0]
    return True


@lean_kernel
def collect_planes(t_j, offset_j, face, share, per_interval, fine, coarse, chunk):
    """Take the next sample planes, front to back, empty ones left out; returns their number.

    `share`: see `composite.composite`.
    """
    queue, spacing = chunk.queue, 1.0 / per_interval
    count = np.uint64(0)
    while count < np.uint64(CHUNK):
        if face[MIDDLE] != 0.0:
            queue[0] = _next_middle(queue[0], per_interval, face)
            queue[2] = _next_middle(queue[2], per_interval, face)
        fine_next, coarse_next = np.inf, np.inf
        if queue[0] < queue[1]:
            fine_next, _ = _plane_distance(queue[0], face, spacing, fine)
        if queue[2] < queue[3]:
            coarse_next, _ = _plane_distance(queue[2], face, spacing, coarse)
        if fine_next <= coarse_next:
            if fine_next == np.inf:
                break
            q = queue[0]
            queue[0] += 1
            if _place_plane(
                count, q, 0.0, 1.0 - share[0], -share[1], t_j, offset_j, face, spacing, fine, chunk
            ):
                count += _ONE
        else:
            q = queue[2]
            queue[2] += 1
            if _place_plane(count, q, 1.0, share[0], share[1], t_j, offset_j, face, spacing, coarse, chunk):
                count += _ONE
    return np.int64(count)


@inlined_kernel
def window(masks, p, block):
    """64 bits of plane p's mask, from `block` on."""
    w, s = block >> np.uint64(6), block & _BITS
    return (masks[w, p] >> s) | ((masks[w + _ONE, p] << _ONE) << (_BITS - s))


@lean_kernel
def find_hits(pixel, count, stride_mask, phase, steepest, chunk):
    """Set the flags of the chunk's planes that a tile may meet.

    pixel: the tile's first; `stride_mask`: it takes the planes whose number has `phase` in these bits;
    `steepest`: the face's largest tangent along i. A ray whose range begins or ends within half an interval
    of the plane reads the box's border there, though it is outside.
    """
    # Slices of one dimension, or the loop does not become vectors.
    planes, masks, flags = chunk.planes, chunk.masks, chunk.flags
    number, corner, step, slant = planes[NUMBER], planes[CORNER], planes[STEP], planes[SLANT]
    low, high, words = planes[LOW], planes[HIGH], masks[0]
    centre, across = pixel + 0.5, np.float64(TILE - 1)
    for p in range(np.uint64(count)):
        last_cell = np.ceil(high[p]) - 1.0
        x_first = corner[p] + centre * step[p]
        x_last = x_first + across * step[p] + ROUNDING
        beyond = 0.5 * steepest * slant[p] + ROUNDING
        reached = (x_last >= low[p] - beyond) & (x_first <= high[p] + beyond)
        reached &= (np.int64(number[p]) & stride_mask) == phase
        begin = np.uint64(np.int64(min(max(x_first, low[p]), last_cell))) >> np.uint64(2)
        end = np.uint64(np.int64(min(max(x_last, low[p]), last_cell))) >> np.uint64(2)
        blocks = min(end - begin, _BITS)  # without the first
        bits = (words[p] >> (begin & _BITS)) & ((np.uint64(2) << blocks) - _ONE)
        # A window of more than 64 blocks, or in another word, may hold more than these bits tell.
        flags[p] = np.uint8(reached & ((bits != np.uint64(0)) | (end > _BITS)))
    if masks.shape[0] > 2:
        for p in range(np.uint64(count)):
            if flags[p]:
                last_cell = np.ceil(high[p]) - 1.0
                x_first = corner[p] + centre * step[p]
                x_last = x_first + across * step[p] + ROUNDING
                begin = np.uint64(np.int64(min(max(x_first, low[p]), last_cell))) >> np.uint64(2)
                end = np.uint64(np.int64(min(max(x_last, low[p]), last_cell))) >> np.uint64(2)
                bits = window(masks, p, begin) & ((np.uint64(2) << min(end - begin, _BITS)) - _ONE)
                flags[p] = np.uint8((bits != np.uint64(0)) | (end - begin > _BITS))
    for p in range(np.uint64(count), (np.uint64(count) + _EIGHT - _ONE) // _EIGHT * _EIGHT):
        flags[p] = np.uint8(0)
