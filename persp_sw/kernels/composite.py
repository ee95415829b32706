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

The kernel is split in small functions, as one it compiles longer: `scanline` finds what there is
to sample, `packet` samples and blends it, and this file walks the picture.
"""

import numpy as np

from .._jit import kernel, parallel_kernel, prange
from .encode import BLOCK, WORD
from .packet import (
    ALPHA,
    BLUE,
    CHUNK,
    ENOUGH,
    GREEN,
    LANES,
    LENGTH,
    RAY_FAR,
    RAY_NEAR,
    RED,
    blend,
    classify,
    fill_line,
    sample,
)
from .scanline import (
    BASE,
    DISTANCE,
    E_I,
    E_J,
    E_K,
    INDEX,
    LEAST,
    NEAR,
    ORIGIN_I,
    ORIGIN_J,
    PITCH,
    PLANE,
    PLANE_COLUMNS,
    ROW_WEIGHT,
    RUN_COLUMNS,
    SIGN,
    SLICE_WEIGHT,
    STEEP,
    TILE,
    collect_planes,
    collect_runs,
)

_F = np.float32


@kernel
def _find_ranges(n, t_first, t_j, face, metric, half_spaces, ranges):
    """Of each ray: nearest and farthest shown distance, and its world length in one slice interval.

    `ranges` float64 (3·n): the three one after the other; nearest > farthest where nothing is shown.
    """
    e_i, e_j, e_k, sign, pitch, near = face[E_I], face[E_J], face[E_K], face[SIGN], face[PITCH], face[NEAR]
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
        lanes[RED + l] = lanes[GREEN + l] = lanes[BLUE + l] = lanes[ALPHA + l] = _F(0.0)
        lanes[LENGTH + l] = _F(ranges[np.uint64(2 * n) + l])
        if near < far:
            nearest, farthest = min(nearest, near), max(farthest, far)
            lanes[RAY_NEAR + l] = _F(near - base)
            lanes[RAY_FAR + l] = _F(far - base)
            lanes[ENOUGH + l] = _F(1.0 - residual)
        else:
            lanes[RAY_NEAR + l] = lanes[RAY_FAR + l] = _F(0.0)
            lanes[ENOUGH + l] = _F(-1.0)
    return nearest, farthest


@kernel
def _composite_tile(
    n, t_j, t_first, per_interval, most_per_interval, face, metric, box, half_spaces, planes, tile, hits,
    count, runs, run_count, voxels, table, origin, scale, residual, ranges, line, cells, lanes,
):  # fmt: skip
    """One tile of n pixels through all its planes; returns the number of samples taken."""
    base = face[BASE]
    _find_ranges(n, t_first, t_j, face, metric, half_spaces, ranges)
    nearest, farthest = _start_tile(n, base, residual, ranges, lanes)
    stride = most_per_interval // per_interval
    last_cell = np.ceil(box[1]) - 1.0
    samples = 0
    for h in range(count):
        r = hits[tile, h]
        p = runs[r, PLANE]
        distance = planes[p, DISTANCE]
        half = 0.5
        if per_interval > 1:
            on_even = (np.int64(planes[p, INDEX]) // stride) % 2 == 0
            half = (1.0 if on_even else 2.0) / (3.0 * per_interval)
        if distance - half >= farthest:
            break
        if distance + half <= nearest:
            continue
        x_first = face[E_I] + t_first * distance
        x_step = face[PITCH] * distance
        x_last = x_first + (n - 1) * x_step
        first = np.int64(min(max(min(x_first, x_last), box[0]), last_cell))
        last = np.int64(max(min(max(x_first, x_last), last_cell), box[0])) + 1
        weight_j, weight_k = _F(planes[p, ROW_WEIGHT]), _F(planes[p, SLICE_WEIGHT])
        if not fill_line(r, run_count, runs, weight_j, weight_k, voxels, first, last, line):
            continue
        sample(
            n, line, _F(x_first - first), _F(x_step), _F(max(box[0], first) - first),
            _F(min(box[1], last) - first), _F(last - 1 - first), cells, lanes,
        )  # fmt: skip
        samples += n
        if not classify(n, table, origin, scale, cells, lanes):
            continue
        if blend(n, _F(distance - half - base), _F(distance + half - base), lanes):
            break
    return samples


@kernel
def _composite_row(
    v, face, metric, box, half_spaces, size_k, per_interval, visible, pairs, needed, offsets, voxels,
    table, origin, scale, residual, planes, runs, tile_steps, hits, counts, ranges, line, cells,
    lanes, out,
):  # fmt: skip
    """One scanline of the face; returns the number of samples taken."""
    pitch = face[PITCH]
    t_j = face[ORIGIN_J] + (v + 0.5) * pitch
    n = cells.shape[0]  # TILE, unknown to the compiler: a known 16 is unrolled before it can be vectorised
    tiles = out.shape[1] // TILE
    for tile in range(tiles):
        counts[tile] = 0
        t_left, t_right = face[ORIGIN_I] + tile * TILE * pitch, face[ORIGIN_I] + (tile + 1) * TILE * pitch
        steepest = max(max(abs(t_left), abs(t_right)), abs(t_j))
        wanted = 4 if steepest > 2.0 * STEEP else 2 if steepest > STEEP else 1
        tile_steps[tile] = min(max(wanted, np.int64(face[LEAST])), per_interval)
    count = collect_planes(t_j, face[E_J], face[E_K], face[SIGN], size_k, per_interval, box, planes)
    run_count = collect_runs(
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
            n, t_j, face[ORIGIN_I] + (first + 0.5) * pitch, tile_steps[tile], per_interval, face, metric, box,
            half_spaces, planes, tile, hits, counts[tile], runs, run_count, voxels, table, origin, scale,
            residual, ranges, line, cells, lanes,
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
        float64 [i0, i1, j0, j1, k0, k1] of the shown voxel centres; look-ups along i and j are clamped to it.
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
