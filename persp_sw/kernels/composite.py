"""The compositing kernel: runs of one principal axis to the pixels of one face of an eye image.

All in standard space (i, j, k) of the face; see DESIGN section 3 in `docs/design.md`. Pixel (u, v) has the
tangents t = t_0 + (u + ½, v + ½)·pitch; at distance D along k its ray is at i = e_i + t_i·D, j = e_j + t_j·D.
Sample planes lie at D_q = sign·(k_q − e_k), k_q on slices and, for steep rays, between them. A plane stands
for the part of [D_q − h/2, D_q + h/2] that lies in the ray's range [D_in, D_out], so α = 1 − exp(−τ·ℓ·length)
with ℓ the world length of the ray in one slice interval: exact for a homogeneous medium.

Structure, after measurements: one scanline of the image at a time; its planes' runs are projected to tiles of
16 pixels, so that a tile knows its planes front to back and empty space costs nothing; a tile stays in the
first-level cache until its pixels are opaque. In a packet (a tile on a plane) the voxel rows are interpolated
along j (and k) first, over contiguous voxels; then along i; then all 16 pixels are blended as vectors. Blocks
that are not visible read as NaN, which the table maps to "nothing".

The kernel is split in small functions: as one function it compiles three times as long.
"""

import numpy as np

from .._jit import bits_from_float, float_from_bits, kernel, parallel_kernel, prange, trailing_zeros
from .encode import BLOCK, WORD, packed_position

TILE = 16  # pixels in a packet: one 512-bit vector of floats
LINE_PADDING = 4 * TILE  # voxel rows are interpolated 16 at a time, beyond their ends

# Columns of `planes`, one row for each sample plane that meets the scanline.
_DISTANCE, _ROW, _ROW_WEIGHT, _SLICE, _SLICE_WEIGHT, _INDEX = range(6)
PLANE_COLUMNS = 6

# Sections of 16 in `lanes`, the state of a packet's pixels.
_R, _G, _B, _A = 0, 16, 32, 48
_SAMPLE_R, _SAMPLE_G, _SAMPLE_B, _SAMPLE_TAU = 64, 80, 96, 112
_NEAR, _FAR, _LENGTH, _ENOUGH, _VALUE = 128, 144, 160, 176, 192
LANES = 208

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
def _ray_range(half_spaces, eye, t_i, t_j, sign):
    """Distances along k between which the ray is in all half-spaces, not before the eye; in > out if none."""
    near = 0.0
    far = np.inf
    for plane in range(half_spaces.shape[0]):
        a_i, a_j, a_k, a_0 = half_spaces[plane]
        at_eye = a_i * eye[0] + a_j * eye[1] + a_k * eye[2] + a_0
        slope = a_i * t_i + a_j * t_j + a_k * sign
        if slope > 0.0:
            near = max(near, -at_eye / slope)
        elif slope < 0.0:
            far = min(far, -at_eye / slope)
        elif at_eye < 0.0:
            far = -1.0
    return near, far


@kernel
def _interval_length(metric, t_i, t_j, sign):
    """World length ‖A·(t_i, t_j, sign)‖ of a ray in one slice interval; metric = AᵀA."""
    squared = metric[0, 0] * t_i * t_i + metric[1, 1] * t_j * t_j + metric[2, 2]
    squared += 2.0 * (metric[0, 1] * t_i * t_j + sign * (metric[0, 2] * t_i + metric[1, 2] * t_j))
    return np.sqrt(squared)


@kernel
def _collect_planes(t_j, eye, sign, size_k, per_interval, box, planes):
    """Fill `planes` with those that scanline t_j may need, front to back; returns their number."""
    low_j, high_j, low_k, high_k = box[2], box[3], box[4], box[5]
    # The distances at which the scanline's sheet is in the box, as far as j and k tell.
    near, far = 0.0, np.inf
    if t_j != 0.0:
        one, other = (low_j - eye[1]) / t_j, (high_j - eye[1]) / t_j
        near, far = max(near, min(one, other)), min(far, max(one, other))
    elif eye[1] < low_j or eye[1] > high_j:
        return 0
    one, other = sign * (low_k - eye[2]), sign * (high_k - eye[2])
    near, far = max(near, min(one, other)), min(far, max(one, other))
    if near > far:
        return 0
    first_k = 0.0 if sign > 0 else size_k - 1.0
    base = sign * (first_k - eye[2])
    last = (size_k - 1) * per_interval
    q_first = max(np.int64(np.ceil((near - 0.5 - base) * per_interval)), 0)
    q_last = min(np.int64(np.floor((far + 0.5 - base) * per_interval)), last)
    count = 0
    for q in range(q_first, q_last + 1):
        distance = base + q / per_interval
        k = first_k + sign * (q / per_interval)
        j = min(max(eye[1] + t_j * distance, low_j), high_j)
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
def _assign_tiles(plane, p, visible, face, box, per_interval, tile_steps, hits, counts):
    """Append plane number p to the hits of all tiles that its visible runs may reach."""
    distance = plane[_DISTANCE]
    eye_i, t_0, pitch = face[0], face[4], face[6]
    tiles = counts.shape[0]
    row, slice_ = np.int64(plane[_ROW]), np.int64(plane[_SLICE])
    stride_index = np.int64(plane[_INDEX])
    first_block = np.int64(box[0]) // BLOCK
    last_block = np.int64(box[1] - 1e-9) // BLOCK
    # Pixels whose range begins or ends within half an interval read the nearest voxel of the box.
    beyond = 0.5 * max(abs(t_0), abs(t_0 + tiles * TILE * pitch)) + 0.01
    for w in range(visible.shape[2]):
        word = visible[row, slice_, w]
        while word:
            s = trailing_zeros(word)
            n = trailing_zeros(~(word >> s))
            word = word & (word + (_ONE << s))
            begin = WORD * w + np.int64(s)
            end = begin + np.int64(n)
            if distance > 1e-6:
                x_begin, x_end = np.float64(BLOCK * begin), np.float64(BLOCK * end)
                if begin <= first_block:
                    x_begin -= beyond
                if end > last_block:
                    x_end += beyond
                scale = 1.0 / (distance * pitch)
                u_begin = (x_begin - eye_i) * scale - t_0 / pitch - 0.51
                u_end = (x_end - eye_i) * scale - t_0 / pitch - 0.49
                tile_begin = np.int64(min(max(np.floor(u_begin / TILE), 0.0), np.float64(tiles)))
                tile_end = np.int64(min(max(np.floor(u_end / TILE) + 1.0, 0.0), np.float64(tiles)))
            else:
                tile_begin, tile_end = 0, tiles
            for tile in range(tile_begin, tile_end):
                c = counts[tile]
                on_step = stride_index % (per_interval // tile_steps[tile]) == 0
                if on_step and (c == 0 or hits[tile, c - 1] != p):
                    hits[tile, c] = p
                    counts[tile] = c + 1


@kernel
def _lerp_rows(voxels, p0, p1, weight, line, to, count):
    """line[to …] = rows at p0 and p1 interpolated, whole vectors of 16."""
    for c in range(0, count, TILE):
        for l in range(TILE):  # noqa: E741
            a = _F(voxels[np.uint64(p0 + c + l)])
            b = _F(voxels[np.uint64(p1 + c + l)])
            line[np.uint64(to + c + l)] = a + weight * (b - a)


@kernel
def _lerp_four_rows(voxels, p00, p01, p10, p11, weight_j, weight_k, line, to, count):
    """The same between two slices: p00, p01 rows j, j + 1 of the first, p10, p11 of the second."""
    for c in range(0, count, TILE):
        for l in range(TILE):  # noqa: E741
            a = _F(voxels[np.uint64(p00 + c + l)])
            b = _F(voxels[np.uint64(p01 + c + l)])
            near = a + weight_j * (b - a)
            a = _F(voxels[np.uint64(p10 + c + l)])
            b = _F(voxels[np.uint64(p11 + c + l)])
            far = a + weight_j * (b - a)
            line[np.uint64(to + c + l)] = near + weight_k * (far - near)


@kernel
def _fill_line(plane, visible, needed, offsets, voxels, m_first, m_last, line):
    """Interpolate blocks m_first … m_last of a plane's scanline to `line`; NaN where not visible.

    line[0] is voxel BLOCK·m_first. Returns False if no block is visible; `line` is then untouched.
    """
    j, k = np.int64(plane[_ROW]), np.int64(plane[_SLICE])
    weight_j, weight_k = _F(plane[_ROW_WEIGHT]), _F(plane[_SLICE_WEIGHT])
    between = plane[_SLICE_WEIGHT] != 0.0
    filled = 0  # line[:filled] is done
    found = False
    for w in range(m_first // WORD, m_last // WORD + 1):
        word = visible[j, k, w]
        if w == m_first // WORD:
            word = (word >> np.uint64(m_first % WORD)) << np.uint64(m_first % WORD)
        if w == m_last // WORD:
            unused = np.uint64(WORD - 1 - m_last % WORD)
            word = (word << unused) >> unused
        while word:
            s = trailing_zeros(word)
            n = trailing_zeros(~(word >> s))
            word = word & (word + (_ONE << s))
            begin = BLOCK * (WORD * w + np.int64(s) - m_first)
            count = BLOCK * np.int64(n) + 1
            if filled < begin:
                for i in range(filled, begin):
                    line[np.uint64(i)] = _NAN
            p0 = packed_position(needed, offsets, j, k, w, s)
            p1 = packed_position(needed, offsets, j + 1, k, w, s)
            if between:
                p2 = packed_position(needed, offsets, j, k + 1, w, s)
                p3 = packed_position(needed, offsets, j + 1, k + 1, w, s)
                _lerp_four_rows(voxels, p0, p1, p2, p3, weight_j, weight_k, line, begin, count)
            else:
                _lerp_rows(voxels, p0, p1, weight_j, line, begin, count)
            filled = begin + count
            found = True
    if found:
        for i in range(filled, BLOCK * (m_last - m_first + 1) + 1):
            line[np.uint64(i)] = _NAN
    return found


@kernel
def _sample(line, x_0, step, x_low, x_high, last_cell, lanes):
    """Values at x_0 + l·step along the line, clamped to [x_low, x_high]."""
    for l in range(TILE):  # noqa: E741
        x = x_0 + _F(l) * step
        x = x if x > x_low else x_low
        x = x if x < x_high else x_high
        cell = min(np.int32(x), last_cell)
        a = line[np.uint32(cell)]
        b = line[np.uint32(cell + np.int32(1))]
        lanes[np.uint64(_VALUE + l)] = a + (x - _F(cell)) * (b - a)


@kernel
def _classify(table, origin, scale, lanes):
    """Colour and extinction of the lanes' values; returns whether any has extinction."""
    last = _F(table.shape[0] - 1)
    total = _F(0.0)
    for l in range(TILE):  # noqa: E741
        value = lanes[np.uint64(_VALUE + l)]
        entry = (value - origin) * scale + _F(1.5)
        entry = entry if entry > _F(1.0) else _F(1.0)
        entry = entry if entry < last else last
        row = np.uint32(np.int32(entry)) if value == value else np.uint32(0)  # NaN: nothing
        lanes[np.uint64(_SAMPLE_R + l)] = table[row, 0]
        lanes[np.uint64(_SAMPLE_G + l)] = table[row, 1]
        lanes[np.uint64(_SAMPLE_B + l)] = table[row, 2]
        extinction = table[row, 3]
        lanes[np.uint64(_SAMPLE_TAU + l)] = extinction
        total += extinction
    return total > _F(0.0)


@kernel
def _blend(near, far, lanes):
    """Front-to-back OVER of the samples, which stand for [near, far] of each ray; True if all are opaque."""
    least = _F(1.0)
    for l in range(TILE):  # noqa: E741
        begin = lanes[np.uint64(_NEAR + l)]
        end = lanes[np.uint64(_FAR + l)]
        begin = begin if begin > near else near
        end = end if end < far else far
        length = end - begin
        length = length if length > _F(0.0) else _F(0.0)
        # α = 1 − 2^y without cancellation: 2^y = 2^n·(1 + q), |q| small.
        y = lanes[np.uint64(_SAMPLE_TAU + l)] * lanes[np.uint64(_LENGTH + l)] * length * _MINUS_LOG2E
        y = y if y > _F(-126.0) else _F(-126.0)
        shifted = y + _ROUNDER
        n = bits_from_float(shifted) - bits_from_float(_ROUNDER)
        f = y - (shifted - _ROUNDER)
        q = f * (_C1 + f * (_C2 + f * (_C3 + f * (_C4 + f * (_C5 + f * (_C6 + f * _C7))))))
        power = float_from_bits((n + np.int32(127)) << np.int32(23))
        alpha = (_F(1.0) - power) - power * q
        accumulated = lanes[np.uint64(_A + l)]
        share = (_F(1.0) - accumulated) * alpha
        lanes[np.uint64(_R + l)] += share * lanes[np.uint64(_SAMPLE_R + l)]
        lanes[np.uint64(_G + l)] += share * lanes[np.uint64(_SAMPLE_G + l)]
        lanes[np.uint64(_B + l)] += share * lanes[np.uint64(_SAMPLE_B + l)]
        accumulated += share
        lanes[np.uint64(_A + l)] = accumulated
        missing = accumulated - lanes[np.uint64(_ENOUGH + l)]
        least = least if least < missing else missing
    return least >= _F(0.0)


@kernel
def _start_tile(t_j, t_first, face, metric, half_spaces, base, residual, lanes):
    """Clear the tile's pixels and find their ranges; returns the nearest and farthest distance of all."""
    sign, pitch = face[3], face[6]
    nearest, farthest = np.inf, -np.inf
    for l in range(TILE):  # noqa: E741
        t_i = t_first + l * pitch
        near, far = _ray_range(half_spaces, face[:3], t_i, t_j, sign)
        for channel in (_R, _G, _B, _A):
            lanes[channel + l] = _F(0.0)
        length = _interval_length(metric, t_i, t_j, sign)
        near = max(near, face[9] / length)
        lanes[_LENGTH + l] = _F(length)
        if near < far:
            nearest, farthest = min(nearest, near), max(farthest, far)
            lanes[_NEAR + l] = _F(near - base)
            lanes[_FAR + l] = _F(far - base)
            lanes[_ENOUGH + l] = _F(1.0 - residual)
        else:
            lanes[_NEAR + l] = _F(0.0)
            lanes[_FAR + l] = _F(0.0)
            lanes[_ENOUGH + l] = _F(-1.0)
    return nearest, farthest


@kernel
def _composite_tile(
    t_j, t_first, step, face, metric, box, half_spaces, planes, hits, count,
    visible, pairs, needed, offsets, voxels, table, origin, scale, residual, line, lanes,
):  # fmt: skip
    """One tile of 16 pixels through all its planes; returns the number of samples taken."""
    base = face[7]
    nearest, farthest = _start_tile(t_j, t_first, face, metric, half_spaces, base, residual, lanes)
    half = 0.5 / step
    samples = 0
    last_cell = np.floor(box[1] - 1e-9)
    for h in range(count):
        plane = planes[hits[h]]
        distance = plane[_DISTANCE]
        if distance - half >= farthest:
            break
        if distance + half <= nearest:
            continue
        x_first = face[0] + t_first * distance
        x_step = face[6] * distance
        x_last = x_first + (TILE - 1) * x_step
        x_low = min(max(min(x_first, x_last), box[0]), box[1])
        x_high = min(max(max(x_first, x_last), box[0]), box[1])
        m_first = np.int64(min(x_low, last_cell)) // BLOCK
        m_last = np.int64(min(x_high, last_cell)) // BLOCK
        seen = pairs if plane[_SLICE_WEIGHT] != 0.0 else visible
        if not _fill_line(plane, seen, needed, offsets, voxels, m_first, m_last, line):
            continue
        start = np.float64(BLOCK * m_first)
        _sample(
            line, _F(x_first - start), _F(x_step), _F(box[0] - start), _F(box[1] - start),
            np.int32(last_cell - start), lanes,
        )  # fmt: skip
        samples += TILE
        if not _classify(table, origin, scale, lanes):
            continue
        if _blend(_F(distance - half - base), _F(distance + half - base), lanes):
            break
    return samples


@kernel
def _composite_row(
    v, face, metric, box, half_spaces, size_k, per_interval, visible, pairs, needed, offsets, voxels,
    table, origin, scale, residual, planes, tile_steps, hits, counts, line, lanes, out,
):  # fmt: skip
    """One scanline of the face; returns the number of samples taken."""
    pitch = face[6]
    t_j = face[5] + (v + 0.5) * pitch
    tiles = out.shape[1] // TILE
    for tile in range(tiles):
        counts[tile] = 0
        t_left, t_right = face[4] + tile * TILE * pitch, face[4] + (tile + 1) * TILE * pitch
        steepest = max(max(abs(t_left), abs(t_right)), abs(t_j))
        tile_steps[tile] = min(
            max(4 if steepest > 3.0 else 2 if steepest > 1.5 else 1, face[8]), per_interval
        )
    count = _collect_planes(t_j, face[:3], face[3], size_k, per_interval, box, planes)
    for p in range(count):
        seen = pairs if planes[p, _SLICE_WEIGHT] != 0.0 else visible
        _assign_tiles(planes[p], p, seen, face, box, per_interval, tile_steps, hits, counts)
    samples = 0
    for tile in range(tiles):
        first = tile * TILE
        if counts[tile] == 0:
            out[v, first : first + TILE] = _F(0.0)
            continue
        samples += _composite_tile(
            t_j, face[4] + (first + 0.5) * pitch, tile_steps[tile], face, metric, box, half_spaces, planes,
            hits[tile], counts[tile], visible, pairs, needed, offsets, voxels, table, origin, scale, residual,
            line, lanes,
        )  # fmt: skip
        for l in range(TILE):  # noqa: E741
            out[v, first + l, 0] = lanes[_R + l]
            out[v, first + l, 1] = lanes[_G + l]
            out[v, first + l, 2] = lanes[_B + l]
            out[v, first + l, 3] = lanes[_A + l]
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
        line = np.empty(BLOCK * WORD * visible.shape[2] + LINE_PADDING, np.float32)
        lanes = np.empty(LANES, np.float32)
        tiles = out.shape[1] // TILE
        most = (size_k - 1) * per_interval + 1
        planes = np.empty((most, PLANE_COLUMNS), np.float64)
        tile_steps = np.empty(tiles, np.int64)
        hits = np.empty((tiles, most), np.int64)
        counts = np.empty(tiles, np.int64)
        for v in range(worker, out.shape[0], workers):
            samples[v] = _composite_row(
                v, face, metric, box, half_spaces, size_k, per_interval, visible, pairs, needed, offsets,
                voxels, table, origin, scale, residual, planes, tile_steps, hits, counts, line, lanes, out,
            )  # fmt: skip
