"""What one scanline of a face meets: its sample planes, their visible runs, and which tiles those reach.

Done once a scanline, so that packets need no search: finding a run's voxels for every packet took 113 ns, for
every scanline and plane it leaves 12.5 ns a packet.
"""

import numpy as np

from .._jit import kernel, trailing_zeros
from .encode import BLOCK, WORD, packed_position

TILE = 16  # pixels in a packet: one 512-bit vector of floats
STEEP = 1.5  # tangents beyond this take 2 samples in an interval, beyond twice this 4

# `face`, see `composite.composite`.
E_I, E_J, E_K, SIGN, ORIGIN_I, ORIGIN_J, PITCH, BASE, LEAST, NEAR = range(10)

# Columns of `planes`, one row for each sample plane that meets the scanline.
DISTANCE, ROW, ROW_WEIGHT, SLICE, SLICE_WEIGHT, INDEX = range(6)
PLANE_COLUMNS = 6

# Columns of `runs`, one row for each visible run of blocks of those planes: its plane, its first and last
# voxel, and where the first stands in the packed voxels for scanlines (j, k), (j + 1, k), (j, k + 1) and
# (j + 1, k + 1).
PLANE, BEGIN, END, AT_00, AT_10, AT_01, AT_11 = range(7)
RUN_COLUMNS = 7

_ONE = np.uint64(1)


@kernel
def collect_planes(t_j, e_j, e_k, sign, size_k, per_interval, box, planes):
    """Fill `planes` with those that scanline t_j may need, front to back; returns their number."""
    low_j, high_j, low_k, high_k = box[2], box[3], box[4], box[5]
    # The distances at which the scanline's sheet is in the box, as far as j and k tell.
    near, far = 0.0, np.inf
    if t_j != 0.0:
        one, other = (low_j - e_j) / t_j, (high_j - e_j) / t_j
        near, far = max(near, min(one, other)), min(far, max(one, other))
    elif e_j < low_j or e_j > high_j:
        return 0
    one, other = sign * (low_k - e_k), sign * (high_k - e_k)
    near, far = max(near, min(one, other)), min(far, max(one, other))
    if near > far:
        return 0
    first_k = 0.0 if sign > 0 else size_k - 1.0
    base = sign * (first_k - e_k)
    last = (size_k - 1) * per_interval
    q_first = max(np.int64(np.ceil((near - 0.5 - base) * per_interval)), 0)
    q_last = min(np.int64(np.floor((far + 0.5 - base) * per_interval)), last)
    count = 0
    for q in range(q_first, q_last + 1):
        distance = base + q / per_interval
        k = first_k + sign * (q / per_interval)
        j = min(max(e_j + t_j * distance, low_j), high_j)
        row = min(np.floor(j), np.ceil(high_j) - 1.0)
        slice_ = np.floor(k)
        planes[count, DISTANCE] = distance
        planes[count, ROW] = row
        planes[count, ROW_WEIGHT] = j - row
        planes[count, SLICE] = slice_
        planes[count, SLICE_WEIGHT] = k - slice_
        planes[count, INDEX] = q
        count += 1
    return count


@kernel
def collect_runs(
    planes, count, face, box, per_interval, tile_steps, visible, pairs, needed, offsets, runs, hits, counts
):  # fmt: skip
    """List the visible runs of all planes, and for each tile the first run of every plane that it may meet.

    `hits` [tile, n]: rows of `runs`, front to back; `counts` [tile].
    """
    e_i, t_0, pitch = face[E_I], face[ORIGIN_I], face[PITCH]
    tiles = counts.shape[0]
    first_block = np.int64(box[0]) // BLOCK
    last_block = np.int64(np.ceil(box[1]) - 1.0) // BLOCK
    # Pixels whose range begins or ends within half an interval read the nearest voxel of the box.
    beyond = 0.5 * max(abs(t_0), abs(t_0 + tiles * TILE * pitch)) + 0.01
    r = 0
    for p in range(count):
        distance = planes[p, DISTANCE]
        j, k = np.int64(planes[p, ROW]), np.int64(planes[p, SLICE])
        q = np.int64(planes[p, INDEX])
        between = planes[p, SLICE_WEIGHT] != 0.0
        scale = 1.0 / (max(distance, 1e-6) * pitch * TILE)
        for w in range(visible.shape[2]):
            word = pairs[j, k, w] if between else visible[j, k, w]
            while word:
                s = trailing_zeros(word)
                n = trailing_zeros(~(word >> s))
                word = word & (word + (_ONE << s))
                begin = WORD * w + np.int64(s)
                end = begin + np.int64(n)
                runs[r, PLANE] = p
                runs[r, BEGIN] = BLOCK * begin
                runs[r, END] = BLOCK * end
                runs[r, AT_00] = packed_position(needed, offsets, j, k, w, s)
                runs[r, AT_10] = packed_position(needed, offsets, j + 1, k, w, s)
                if between:
                    runs[r, AT_01] = packed_position(needed, offsets, j, k + 1, w, s)
                    runs[r, AT_11] = packed_position(needed, offsets, j + 1, k + 1, w, s)
                tile_begin, tile_end = 0, tiles
                if distance > 1e-6:
                    x_begin = BLOCK * begin - (beyond if begin <= first_block else 0.01)
                    x_end = BLOCK * end + (beyond if end > last_block else 0.01)
                    u_begin = (x_begin - e_i - t_0 * distance) * scale - 0.5 / TILE
                    u_end = (x_end - e_i - t_0 * distance) * scale - 0.5 / TILE
                    tile_begin = np.int64(min(max(np.floor(u_begin), 0.0), np.float64(tiles)))
                    tile_end = np.int64(min(max(np.floor(u_end) + 1.0, 0.0), np.float64(tiles)))
                for tile in range(tile_begin, tile_end):
                    c = counts[tile]
                    on_step = q % (per_interval // tile_steps[tile]) == 0
                    if on_step and (c == 0 or runs[hits[tile, c - 1], PLANE] != p):
                        hits[tile, c] = r
                        counts[tile] = c + 1
                r += 1
    return r
