"""The compositing kernel: runs of one principal axis to the pixels of one face of an eye image.

All in standard space (i, j, k) of the face; see DESIGN section 3 in `docs/design.md`. Pixel (u, v) has the
tangents t = t_0 + (u + ½, v + ½)·pitch; at distance D along k its ray is at i = e_i + t_i·D, j = e_j + t_j·D.
Sample planes lie at D_q = sign·(k_q − e_k), k_q on slices and, for steep rays, between them. A plane stands
for the part of [D_q − h, D_q + h] that lies in the ray's range [D_in, D_out], so α = 1 − exp(−τ·ℓ·length)
with ℓ the world length of the ray in one slice interval: exact for a homogeneous medium. With several planes
an interval their lengths 2h are in Simpson's proportion 1 : 2, slices first; equal lengths would favour the
slices, where values are extreme, over the means between them (real CT, opaque: 45.4 instead of 42.4 dB).

Structure, after measurements: one scanline of the image at a time; its planes' runs are projected to tiles of
16 pixels, so that a tile knows its planes front to back and empty space costs nothing; a tile stays in the
first-level cache until its pixels are opaque. In a packet (a tile on a plane) the voxel rows are interpolated
along j (and k) first, over contiguous voxels; then along i; then all 16 pixels are blended as vectors. Blocks
that are not visible read as NaN, which the table maps to "nothing".

The kernel is split in small functions: as one function it compiles three times as long.
"""

import numpy as np

from .._jit import kernel, parallel_kernel, power_of_two, prange, trailing_zeros
from .encode import BLOCK, WORD, packed_position

TILE = 16  # pixels in a packet: one 512-bit vector of floats
CHUNK = 32  # voxel rows are interpolated so many at a time, beyond their ends

# Columns of `planes`, one row for each sample plane that meets the scanline.
_DISTANCE, _ROW, _ROW_WEIGHT, _SLICE, _SLICE_WEIGHT, _INDEX = range(6)
PLANE_COLUMNS = 6

# Columns of `runs`, one row for each visible run of blocks of those planes: its plane, its first and last
# voxel, and where the first stands in the packed voxels for scanlines (j, k), (j + 1, k), (j, k + 1) and
# (j + 1, k + 1).
_PLANE, _BEGIN, _END, _AT_00, _AT_10, _AT_01, _AT_11 = range(7)
RUN_COLUMNS = 7

# Sections of 16 in `lanes`, the state of a packet's pixels.
_SECTIONS = 15
_R, _G, _B, _A, _SAMPLE_R, _SAMPLE_G, _SAMPLE_B, _SAMPLE_TAU = (np.uint64(TILE * n) for n in range(8))
_NEAR, _FAR, _LENGTH, _ENOUGH, _LEFT, _RIGHT, _WEIGHT = (np.uint64(TILE * n) for n in range(8, _SECTIONS))
LANES = TILE * _SECTIONS

_F = np.float32
_ONE = np.uint64(1)
_NAN = _F(np.nan)
_ROUNDER = _F(12582912.0)  # 1.5·2^23: adding it leaves the nearest integer in the low bits
_MINUS_LOG2E = _F(-1.4426950408889634)
# 2^f − 1 = f·(c1 + f·(c2 + …)), |f| ≤ ½, the Taylor series of exp(f·ln 2); remainder below 6e-9.
_C1, _C2, _C3, _C4 = (
    _F(0.6931471805599453),
    _F(0.2402265069591007),
    _F(0.0555041086648216),
    _F(0.009618129107628),
)
_C5, _C6, _C7 = _F(0.0013333558146428), _F(0.000154035303933816), _F(1.5252733804059841e-05)


@kernel
def _collect_planes(t_j, e_j, e_k, sign, size_k, per_interval, box, planes):
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
        row = min(np.floor(j), np.floor(high_j - 1e-9))
        slice_ = np.floor(k)
        planes[count, _DISTANCE] = distance
        planes[count, _ROW] = row
        planes[count, _ROW_WEIGHT] = j - row
        planes[count, _SLICE] = slice_
        planes[count, _SLICE_WEIGHT] = k - slice_
        planes[count, _INDEX] = q
        count += 1
    return count


@kernel
def _collect_runs(
    planes, count, face, box, per_interval, tile_steps, visible, pairs, needed, offsets, runs, hits, counts
):  # fmt: skip
    """List the visible runs of all planes, and for each tile the first run of every plane that it may meet.

    `hits` [tile, n]: rows of `runs`, front to back; `counts` [tile].
    """
    e_i, t_0, pitch = face[0], face[4], face[6]
    tiles = counts.shape[0]
    first_block = np.int64(box[0]) // BLOCK
    last_block = np.int64(box[1] - 1e-9) // BLOCK
    # Pixels whose range begins or ends within half an interval read the nearest voxel of the box.
    beyond = 0.5 * max(abs(t_0), abs(t_0 + tiles * TILE * pitch)) + 0.01
    r = 0
    for p in range(count):
        distance = planes[p, _DISTANCE]
        j, k = np.int64(planes[p, _ROW]), np.int64(planes[p, _SLICE])
        q = np.int64(planes[p, _INDEX])
        between = planes[p, _SLICE_WEIGHT] != 0.0
        scale = 1.0 / (max(distance, 1e-6) * pitch * TILE)
        for w in range(visible.shape[2]):
            word = pairs[j, k, w] if between else visible[j, k, w]
            while word:
                s = trailing_zeros(word)
                n = trailing_zeros(~(word >> s))
                word = word & (word + (_ONE << s))
                begin = WORD * w + np.int64(s)
                end = begin + np.int64(n)
                runs[r, _PLANE] = p
                runs[r, _BEGIN] = BLOCK * begin
                runs[r, _END] = BLOCK * end
                runs[r, _AT_00] = packed_position(needed, offsets, j, k, w, s)
                runs[r, _AT_10] = packed_position(needed, offsets, j + 1, k, w, s)
                if between:
                    runs[r, _AT_01] = packed_position(needed, offsets, j, k + 1, w, s)
                    runs[r, _AT_11] = packed_position(needed, offsets, j + 1, k + 1, w, s)
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
                    if on_step and (c == 0 or runs[hits[tile, c - 1], _PLANE] != p):
                        hits[tile, c] = r
                        counts[tile] = c + 1
                r += 1
    return r


@kernel
def _fill_line(r, count, runs, weight_j, weight_k, voxels, first, last, line):
    """Interpolate voxels first … last at (j + weight_j, k + weight_k) to `line`; NaN where not visible.

    r: the plane's first run that may matter; `count`: number of runs. Returns False if none of its runs
    reaches the voxels; `line` is then undefined.
    """
    plane = runs[r, _PLANE]
    filled = first
    while r < count and runs[r, _PLANE] == plane and runs[r, _BEGIN] <= last:
        begin = max(runs[r, _BEGIN], first)
        end = min(runs[r, _END], last)
        if begin <= end:
            for i in range(filled - first, begin - first):
                line[np.uint64(i)] = _NAN
            skipped = begin - runs[r, _BEGIN]
            p00, p10 = runs[r, _AT_00] + skipped, runs[r, _AT_10] + skipped
            to = begin - first
            # Whole vectors: what is read beyond the run is overwritten below or not used.
            length = (end - begin + CHUNK) // CHUNK * CHUNK
            if weight_k == _F(0.0):
                for i in range(length):
                    a, b = _F(voxels[np.uint64(p00 + i)]), _F(voxels[np.uint64(p10 + i)])
                    line[np.uint64(to + i)] = a + weight_j * (b - a)
            else:
                p01, p11 = runs[r, _AT_01] + skipped, runs[r, _AT_11] + skipped
                for i in range(length):
                    a, b = _F(voxels[np.uint64(p00 + i)]), _F(voxels[np.uint64(p10 + i)])
                    near = a + weight_j * (b - a)
                    a, b = _F(voxels[np.uint64(p01 + i)]), _F(voxels[np.uint64(p11 + i)])
                    far = a + weight_j * (b - a)
                    line[np.uint64(to + i)] = near + weight_k * (far - near)
            filled = end + 1
        r += 1
    for i in range(filled - first, last + 1 - first):
        line[np.uint64(i)] = _NAN
    return filled > first


@kernel
def _sample(n, line, x_0, step, x_low, x_high, last_cell, cells, lanes):
    """Voxels on both sides of x_0 + l·step along the line, clamped to [x_low, x_high], and the weight."""
    for l in range(np.uint64(n)):  # noqa: E741
        x = x_0 + _F(l) * step
        x = x if x > x_low else x_low
        x = x if x < x_high else x_high
        cell = np.floor(x)
        cell = cell if cell < last_cell else last_cell
        cells[l] = np.int32(cell)
        lanes[_WEIGHT + l] = x - cell
    for l in range(np.uint64(n)):  # noqa: E741
        cell = np.uint64(np.uint32(cells[l]))
        lanes[_LEFT + l] = line[cell]
        lanes[_RIGHT + l] = line[cell + _ONE]


@kernel
def _classify(n, table, origin, scale, cells, lanes):
    """Colour and extinction of the lanes' values; returns whether any has extinction."""
    last = _F(table.shape[0] - 1)
    for l in range(np.uint64(n)):  # noqa: E741
        left = lanes[_LEFT + l]
        value = left + lanes[_WEIGHT + l] * (lanes[_RIGHT + l] - left)
        entry = (value - origin) * scale + _F(1.5)
        entry = entry if entry > _F(1.0) else _F(1.0)
        entry = entry if entry < last else last
        entry = entry if value == value else _F(0.0)  # NaN: nothing
        cells[l] = np.int32(entry)
    opaque = False
    for l in range(np.uint64(n)):  # noqa: E741
        row = np.uint64(np.uint32(cells[l]))
        lanes[_SAMPLE_R + l] = table[row, 0]
        lanes[_SAMPLE_G + l] = table[row, 1]
        lanes[_SAMPLE_B + l] = table[row, 2]
        extinction = table[row, 3]
        lanes[_SAMPLE_TAU + l] = extinction
        opaque |= extinction > _F(0.0)
    return opaque


@kernel
def _blend(n, near, far, lanes):
    """Front-to-back OVER of the samples, which stand for [near, far] of each ray; True if all are opaque."""
    going = False
    for l in range(np.uint64(n)):  # noqa: E741
        begin = lanes[_NEAR + l]
        end = lanes[_FAR + l]
        begin = begin if begin > near else near
        end = end if end < far else far
        length = end - begin
        length = length if length > _F(0.0) else _F(0.0)
        # α = 1 − 2^y without cancellation: 2^y = 2^n·(1 + q), |q| small.
        y = lanes[_SAMPLE_TAU + l] * lanes[_LENGTH + l] * length * _MINUS_LOG2E
        y = y if y > _F(-126.0) else _F(-126.0)
        shifted = y + _ROUNDER
        f = y - (shifted - _ROUNDER)
        q = f * (_C1 + f * (_C2 + f * (_C3 + f * (_C4 + f * (_C5 + f * (_C6 + f * _C7))))))
        power = power_of_two(shifted)
        alpha = (_F(1.0) - power) - power * q
        accumulated = lanes[_A + l]
        share = (_F(1.0) - accumulated) * alpha
        lanes[_R + l] += share * lanes[_SAMPLE_R + l]
        lanes[_G + l] += share * lanes[_SAMPLE_G + l]
        lanes[_B + l] += share * lanes[_SAMPLE_B + l]
        accumulated += share
        lanes[_A + l] = accumulated
        going |= accumulated < lanes[_ENOUGH + l]
    return not going


@kernel
def _find_ranges(n, t_first, t_j, face, metric, half_spaces, ranges):
    """Of each ray: nearest and farthest shown distance, and its world length in one slice interval.

    `ranges` float64 (3·n): the three one after the other; nearest > farthest where nothing is shown.
    """
    e_i, e_j, e_k, sign, pitch, near = face[0], face[1], face[2], face[3], face[6], face[9]
    constant = metric[1, 1] * t_j * t_j + metric[2, 2] + 2.0 * sign * metric[1, 2] * t_j
    linear = 2.0 * (metric[0, 1] * t_j + sign * metric[0, 2])
    for l in range(np.uint64(n)):  # noqa: E741
        t_i = t_first + np.float64(l) * pitch
        # ℓ = ‖A·(t_i, t_j, sign)‖
        length = np.sqrt(constant + t_i * (linear + t_i * metric[0, 0]))
        ranges[l] = near / length
        ranges[np.uint64(n) + l] = np.inf
        ranges[np.uint64(2 * n) + l] = length
    for plane in range(half_spaces.shape[0]):
        a_i, a_j, a_k = half_spaces[plane, 0], half_spaces[plane, 1], half_spaces[plane, 2]
        at_eye = a_i * e_i + a_j * e_j + a_k * e_k + half_spaces[plane, 3]
        across = a_j * t_j + a_k * sign
        parallel = -np.inf if at_eye >= 0.0 else np.inf
        for l in range(np.uint64(n)):  # noqa: E741
            slope = a_i * (t_first + np.float64(l) * pitch) + across
            crossing = -at_eye / slope
            nearest = ranges[l]
            farthest = ranges[np.uint64(n) + l]
            enters = crossing if slope > 0.0 else parallel if slope == 0.0 else -np.inf
            leaves = crossing if slope < 0.0 else np.inf
            ranges[l] = enters if enters > nearest else nearest
            ranges[np.uint64(n) + l] = leaves if leaves < farthest else farthest


@kernel
def _start_tile(n, base, residual, ranges, lanes):
    """Clear the tile's pixels and note their ranges; returns the nearest and farthest distance of all."""
    nearest, farthest = np.inf, -np.inf
    for lane in range(n):
        l = np.uint64(lane)  # noqa: E741
        near, far = ranges[l], ranges[np.uint64(n) + l]
        lanes[_R + l] = lanes[_G + l] = lanes[_B + l] = lanes[_A + l] = _F(0.0)
        lanes[_LENGTH + l] = _F(ranges[np.uint64(2 * n) + l])
        if near < far:
            nearest, farthest = min(nearest, near), max(farthest, far)
            lanes[_NEAR + l] = _F(near - base)
            lanes[_FAR + l] = _F(far - base)
            lanes[_ENOUGH + l] = _F(1.0 - residual)
        else:
            lanes[_NEAR + l] = lanes[_FAR + l] = _F(0.0)
            lanes[_ENOUGH + l] = _F(-1.0)
    return nearest, farthest


@kernel
def _composite_tile(
    n, t_j, t_first, per_interval, most_per_interval, face, metric, box, half_spaces, planes, tile, hits,
    count, runs, run_count, voxels, table, origin, scale, residual, ranges, line, cells, lanes,
):  # fmt: skip
    """One tile of n pixels through all its planes; returns the number of samples taken."""
    base = face[7]
    _find_ranges(n, t_first, t_j, face, metric, half_spaces, ranges)
    nearest, farthest = _start_tile(n, base, residual, ranges, lanes)
    stride = most_per_interval // per_interval
    last_cell = np.floor(box[1] - 1e-9)
    samples = 0
    for h in range(count):
        r = hits[tile, h]
        p = runs[r, _PLANE]
        distance = planes[p, _DISTANCE]
        half = 0.5
        if per_interval > 1:
            on_even = (np.int64(planes[p, _INDEX]) // stride) % 2 == 0
            half = (1.0 if on_even else 2.0) / (3.0 * per_interval)
        if distance - half >= farthest:
            break
        if distance + half <= nearest:
            continue
        x_first = face[0] + t_first * distance
        x_step = face[6] * distance
        x_last = x_first + (n - 1) * x_step
        first = np.int64(min(max(min(x_first, x_last), box[0]), last_cell))
        last = np.int64(max(min(max(x_first, x_last), last_cell), box[0])) + 1
        weight_j, weight_k = _F(planes[p, _ROW_WEIGHT]), _F(planes[p, _SLICE_WEIGHT])
        if not _fill_line(r, run_count, runs, weight_j, weight_k, voxels, first, last, line):
            continue
        _sample(
            n, line, _F(x_first - first), _F(x_step), _F(box[0] - first), _F(box[1] - first),
            _F(last_cell - first), cells, lanes,
        )  # fmt: skip
        samples += n
        if not _classify(n, table, origin, scale, cells, lanes):
            continue
        if _blend(n, _F(distance - half - base), _F(distance + half - base), lanes):
            break
    return samples


@kernel
def _composite_row(
    v, face, metric, box, half_spaces, size_k, per_interval, visible, pairs, needed, offsets, voxels,
    table, origin, scale, residual, planes, runs, tile_steps, hits, counts, ranges, line, cells,
    lanes, out,
):  # fmt: skip
    """One scanline of the face; returns the number of samples taken."""
    pitch = face[6]
    t_j = face[5] + (v + 0.5) * pitch
    n = cells.shape[0]  # TILE, unknown to the compiler: a known 16 is unrolled before it can be vectorised
    tiles = out.shape[1] // TILE
    for tile in range(tiles):
        counts[tile] = 0
        t_left, t_right = face[4] + tile * TILE * pitch, face[4] + (tile + 1) * TILE * pitch
        steepest = max(max(abs(t_left), abs(t_right)), abs(t_j))
        wanted = 4 if steepest > 3.0 else 2 if steepest > 1.5 else 1
        tile_steps[tile] = min(max(wanted, np.int64(face[8])), per_interval)
    count = _collect_planes(t_j, face[1], face[2], face[3], size_k, per_interval, box, planes)
    run_count = _collect_runs(
        planes,
        count,
        face,
        box,
        per_interval,
        tile_steps,
        visible,
        pairs,
        needed,
        offsets,
        runs,
        hits,
        counts,
    )
    samples = 0
    for tile in range(tiles):
        first = tile * TILE
        if counts[tile] == 0:
            for l in range(TILE):  # noqa: E741
                for channel in range(4):
                    out[v, first + l, channel] = _F(0.0)
            continue
        samples += _composite_tile(
            n, t_j, face[4] + (first + 0.5) * pitch, tile_steps[tile], per_interval, face, metric, box, half_spaces, planes,
            tile, hits, counts[tile], runs, run_count, voxels, table, origin, scale, residual, ranges, line,
            cells, lanes,
        )  # fmt: skip
        for l in range(TILE):  # noqa: E741
            for channel in range(4):
                out[v, first + l, channel] = lanes[TILE * channel + l]
    return samples


@parallel_kernel
def composite(
    face, metric, box, half_spaces, size_k, per_interval, visible, pairs, needed, offsets, voxels,
    table, origin, scale, residual, workers, samples, out,
):  # fmt: skip
    """Composite one face of an eye image.

    Parameters
    ----------
    face
        float64 [e_i, e_j, e_k, sign, t_0i, t_0j, pitch, base, least, near]: the eye, which way along k, the
        tangents of the image's corner, the pixel pitch, a distance near the volume from which depths are
        counted in float32, the least number of samples in an interval (1, 2 or 4), and the world distance
        from the eye before which nothing is shown.
    metric
        float64 (3, 3), AᵀA of the linear part A of world_from_standard.
    box
        float64 [i0, i1, j0, j1, k0, k1] of the shown voxel centres; look-ups are clamped to it.
    half_spaces
        float64 (n, 4): shown where a·(i, j, k) + a_0 ≥ 0; the box's six included.
    size_k
        Number of slices.
    per_interval
        Sample planes a slice interval at the steepest tile: 1, 2 or 4. More than 1 needs `pairs`.
    visible, pairs, needed, offsets, voxels
        Arrays of `volume.runs.AxisRuns`.
    table, origin, scale
        Of `optics.classification.Classification`; origin and scale float32.
    residual
        A packet stops when all its pixels let through no more than this.
    workers
        Threads; scanlines are dealt to them in turn. The picture does not depend on it.
    samples
        int64 (height,): overwritten with the samples taken in each scanline.
    out
        float32 (height, width, 4), width a multiple of 16; overwritten. Linear, premultiplied.
    """
    for worker in prange(workers):
        line = np.empty(BLOCK * WORD * visible.shape[2] + 2 * CHUNK, np.float32)
        lanes = np.empty(LANES, np.float32)
        ranges = np.empty(3 * TILE, np.float64)
        cells = np.empty(TILE, np.int32)
        tiles = out.shape[1] // TILE
        most = (size_k - 1) * per_interval + 1
        planes = np.empty((most, PLANE_COLUMNS), np.float64)
        runs = np.empty((most * (WORD // 2 * visible.shape[2] + 1), RUN_COLUMNS), np.int64)
        tile_steps = np.empty(tiles, np.int64)
        hits = np.empty((tiles, most), np.int64)
        counts = np.empty(tiles, np.int64)
        for v in range(worker, out.shape[0], workers):
            samples[v] = _composite_row(
                v, face, metric, box, half_spaces, size_k, per_interval, visible, pairs, needed, offsets,
                voxels, table, origin, scale, residual, planes, runs, tile_steps, hits, counts, ranges, line,
                cells, lanes, out,
            )  # fmt: skip
