"""The compositing kernel: runs of one principal axis to the pixels of one face of an eye image.

All in standard space (i, j, k) of the face; see DESIGN section 3 in `docs/design.md`. At distance D along k
the ray of pixel (u, v) is at i = o_i + t_i·D, j = o_j + t_j·D. For an eye at a finite place o is the eye and
t = t_0 + (u + ½, v + ½)·pitch; for an eye at infinity t is the same for all pixels and o differs. Sample
planes lie at D_q = sign·(k_q − e_k), k_q on slices and, for steep rays, between them. A plane stands
for the part of [D_q − h, D_q + h] that lies in the ray's range [D_in, D_out], so α = 1 − exp(−τ·ℓ·length)
with ℓ the world length of the ray in one slice interval: exact for a homogeneous medium. With several planes
an interval their lengths 2h are in Simpson's proportion 1 : 2, slices first; equal lengths would favour the
slices, where values are extreme, over the means between them (real CT, opaque: 45.4 instead of 42.4 dB).

Structure, after measurements (`docs/performance.md`): one scanline of the image at a time; sample planes 64
at a time, and no more once all tiles of 16 pixels are opaque; a tile finds the planes it needs by comparing
bits. In a packet (a tile on a run) the voxel rows are interpolated along j (and k) first, over contiguous
voxels; then along i; then two packets are blended as vectors. Pixels outside the run are NaN, which the table
maps to "nothing".
"""

from typing import NamedTuple

import numpy as np

from .._jit import byte_now, inlined_kernel, kernel, lean_kernel, parallel_kernel, prange, trailing_zeros
from .encode import BLOCK, packed_position
from .packet import SCRATCH, WINDOW, blend, illuminate, reach_of, sample
from .scanline import (
    BASE,
    CORNER,
    DISTANCE,
    EYE_K,
    HIGH,
    INTERVAL,
    LEAST,
    LEVEL,
    LOW,
    MIDDLE,
    NEAR,
    NUMBER,
    OFFSET_I,
    OFFSET_J,
    OFFSET_PITCH,
    ORIGIN_I,
    ORIGIN_J,
    PITCH,
    ROUNDING,
    ROW,
    ROW_WEIGHT,
    SHARE,
    SIGN,
    SLICE,
    SLICE_WEIGHT,
    SLOPE,
    STEEP,
    STEP,
    collect_planes,
    find_hits,
    new_chunk,
    plane_range,
    window,
)
from .state import (
    ALPHA,
    ENOUGH,
    LENGTH,
    LIGHT_OF_SECOND,
    LIGHT_SECTIONS,
    RAY_FAR,
    RAY_NEAR,
    SECOND,
    SECTIONS,
    TILE,
    VALUE,
)

_F = np.float32
_NONE, _ONE, _BLOCK = np.uint64(0), np.uint64(1), np.uint64(BLOCK)


class Rays(NamedTuple):
    """The rays of a face, and what of them is shown.

    face
        float64 [o_i, o_j, offset_pitch, t_0i, t_0j, pitch, e_k, sign, base, least, near, middle]: of the
        image's corner, the place of its ray at distance 0 and the tangents, with what both grow by a pixel
        (the first 0 for an eye at a finite place, the second for one at infinity); k at distance 0; which
        way along k; a distance near the volume from which depths are counted in float32; the least number of
        samples in an interval (1, 2 or 4); the world distance before which nothing is shown; and 1 where
        planes lie in the middle of equal pieces of an interval, as an `IntegralTable` wants them, else 0.
    metric
        float64 (3, 3), AᵀA of the linear part A of world_from_standard.
    half_spaces
        float64 (n, 4): shown where a·(i, j, k) + a_0 ≥ 0; the box's six included.
    limits
        float64 (2,): distances along k between which anything is composited; of `half_spaces`, too.
    share
        float64 (2,): the coarse level's share of the extinction at distance D is share[0] + share[1]·D, the
        fine level's is the rest. Both 0: the fine level only.
    """

    face: np.ndarray
    metric: np.ndarray
    half_spaces: np.ndarray
    limits: np.ndarray
    share: np.ndarray


class Tiles(NamedTuple):
    """A scanline's tiles: what they have accumulated, and room to work.

    states [tile]; strides [tile]: a tile takes the planes whose number has none of these bits, or the highest
    alone where planes lie in the middle; reach [tile,
    2]: nearest and farthest distance of any of its pixels; lanes: `SECTIONS` of 16 floats a tile, and the
    light's; ranges, slots, scratch, cells: of the tile at work.
    """

    states: np.ndarray
    strides: np.ndarray
    reach: np.ndarray
    lanes: np.ndarray
    ranges: np.ndarray
    slots: np.ndarray
    scratch: np.ndarray
    cells: np.ndarray


_FRESH, _GOING, _DONE = 0, 1, 2  # states of a tile


@kernel
def _new_tiles(number):
    return Tiles(
        np.empty(number, np.int64),
        np.empty(number, np.int64),
        np.empty((number, 2), np.float64),
        np.zeros(TILE * (number * SECTIONS + LIGHT_SECTIONS), np.float32),
        np.empty(3 * TILE, np.float64),
        np.zeros((2, 4), np.float32),
        np.empty(SCRATCH, np.float32),
        np.empty(TILE, np.int32),
    )


@lean_kernel
def _find_ranges(n, first, t_j, offset_j, face, metric, half_spaces, ranges):
    """Of each ray: nearest and farthest shown distance, and its world length in one slice interval.

    `ranges` float64 (3·n): the three one after the other; nearest > farthest where nothing is shown.
    """
    sign, pitch, offset_pitch = face[SIGN], face[PITCH], face[OFFSET_PITCH]
    t_first = face[ORIGIN_I] + (first + 0.5) * pitch
    offset_first = face[OFFSET_I] + (first + 0.5) * offset_pitch
    constant = metric[1, 1] * t_j * t_j + metric[2, 2] + 2.0 * sign * metric[1, 2] * t_j
    linear = 2.0 * (metric[0, 1] * t_j + sign * metric[0, 2])
    for l in range(np.uint64(n)):  # noqa: E741
        t_i = t_first + np.float64(l) * pitch
        # ℓ = ‖A·(t_i, t_j, sign)‖
        length = np.sqrt(constant + t_i * (linear + t_i * metric[0, 0]))
        ranges[l] = face[NEAR] / length
        ranges[np.uint64(n) + l] = np.inf
        ranges[np.uint64(2 * n) + l] = length
    for plane in range(half_spaces.shape[0]):
        a_i, a_j, a_k = half_spaces[plane, 0], half_spaces[plane, 1], half_spaces[plane, 2]
        start = a_i * offset_first + a_j * offset_j + a_k * face[EYE_K] + half_spaces[plane, 3]
        across = a_j * t_j + a_k * sign
        for l in range(np.uint64(n)):  # noqa: E741
            at_start = start + a_i * (np.float64(l) * offset_pitch)
            slope = a_i * (t_first + np.float64(l) * pitch) + across
            crossing = -at_start / slope
            nearest = ranges[l]
            farthest = ranges[np.uint64(n) + l]
            parallel = -np.inf if at_start >= 0.0 else np.inf
            enters = crossing if slope > 0.0 else parallel if slope == 0.0 else -np.inf
            leaves = crossing if slope < 0.0 else np.inf
            ranges[l] = enters if enters > nearest else nearest
            ranges[np.uint64(n) + l] = leaves if leaves < farthest else farthest


@lean_kernel
def _start_tile(n, v, pixel, base, residual, out, tiles, reach, at):
    """Take up the tile's pixels and note their ranges; `reach`: nearest and farthest of all.

    `out` holds what lies in front of them. Rays that show nothing or are opaque ask for no more.
    """
    ranges, lanes = tiles.ranges, tiles.lanes
    reach[0], reach[1] = np.inf, -np.inf
    for lane in range(n):
        l = np.uint64(lane)  # noqa: E741
        lane_at = np.uint64(at) + l
        near, far = ranges[l], ranges[np.uint64(n) + l]
        for channel in range(4):
            lanes[np.uint64(TILE * channel) + lane_at] = out[v, pixel + lane, channel]
        lanes[LENGTH + lane_at] = _F(ranges[np.uint64(2 * n) + l])
        if near < far and lanes[ALPHA + lane_at] < 1.0 - residual:
            reach[0], reach[1] = min(reach[0], near), max(reach[1], far)
            lanes[RAY_NEAR + lane_at] = _F(near - base)
            lanes[RAY_FAR + lane_at] = _F(far - base)
            lanes[ENOUGH + lane_at] = _F(1.0 - residual)
        else:
            lanes[RAY_NEAR + lane_at] = lanes[RAY_FAR + lane_at] = _F(0.0)
            lanes[ENOUGH + lane_at] = _F(-1.0)


@inlined_kernel
def _composite_packet(n, p, pixel, near, far, waiting, t_j, face, chunk, level, table, tiles, at):
    """A tile on plane p, which stands for [near, far] of each ray.

    Samples are blended two at a time. `waiting`: whether one waits for the next. Returns the samples taken,
    whether one waits now, and whether all is opaque.
    """
    planes, lanes, cells, scratch = chunk.planes, tiles.lanes, tiles.cells, tiles.scratch
    low, high = planes[LOW, p], planes[HIGH, p]
    last_cell = np.ceil(high) - 1.0
    step = planes[STEP, p]
    x_first = planes[CORNER, p] + (pixel + 0.5) * step
    x_last = x_first + (n - 1) * step + ROUNDING
    start = np.floor(min(max(x_first, low), last_cell))
    first = np.uint64(np.int64(start))
    end = np.uint64(np.int64(min(max(x_last, low), last_cell))) + _ONE
    j, k = np.uint64(planes[ROW, p]), np.uint64(planes[SLICE, p])
    weight_j, weight_k = _F(planes[ROW_WEIGHT, p]), _F(planes[SLICE_WEIGHT, p])
    path = (
        _F((face[ORIGIN_I] + (pixel + 0.5) * face[PITCH]) * level.per_voxel[0]),
        _F(face[PITCH] * level.per_voxel[0]),
        _F(t_j * level.per_voxel[1]),
        _F(face[SIGN] * level.per_voxel[2]),
        _F(max(planes[DISTANCE, p], 0.0) - face[BASE]),
        near,
        far,
    )
    ray = (
        _F(face[ORIGIN_I] + (pixel + 0.5) * face[PITCH]),
        _F(face[PITCH]),
        _F(t_j),
        _F(face[SIGN]),
    )
    share = _F(planes[SHARE, p]), _F(planes[SLOPE, p])
    light = np.uint64(TILE * SECTIONS * tiles.states.shape[0])
    y, z = planes[ROW, p] + planes[ROW_WEIGHT, p], planes[SLICE, p] + planes[SLICE_WEIGHT, p]
    span = np.uint64(WINDOW - 1) - np.uint64(2) * reach_of(table)
    samples = 0
    block = first // _BLOCK
    while block * _BLOCK < end:
        bits = window(chunk.masks, p, block)
        if bits == _NONE:
            block += np.uint64(64)
            continue
        skipped = trailing_zeros(bits)
        block += skipped
        until = block + trailing_zeros(~(bits >> skipped))
        begin, stop = max(block * _BLOCK, first), min(until * _BLOCK, end)
        while begin < stop:
            window_end = min(stop, begin + span)
            at_00 = packed_position(level.needed, level.offsets, j, k, begin)
            at_10 = packed_position(level.needed, level.offsets, j + _ONE, k, begin)
            at_01, at_11 = at_00, at_10
            if weight_k != _F(0.0):
                at_01 = packed_position(level.needed, level.offsets, j, k + _ONE, begin)
                at_11 = packed_position(level.needed, level.offsets, j + _ONE, k + _ONE, begin)
            sample(
                n, np.int64(window_end - begin) + 1, level.voxels, at_00, at_10, at_01, at_11, weight_j,
                weight_k, _F(x_first - start), _F(step), _F(low - start), _F(high - start),
                _F(last_cell - start), _F(begin - first), _F(window_end - first), path, table, scratch, cells,
                lanes, at, SECOND if waiting else VALUE,
            )  # fmt: skip
            illuminate(
                n, start, begin, window_end, (j, k), y, z, x_first, step, low, high, ray, path, share, level,
                table, scratch, cells, lanes, at, SECOND if waiting else VALUE, light,
                LIGHT_OF_SECOND if waiting else _NONE,
            )  # fmt: skip
            number = _ONE if waiting else _NONE
            tiles.slots[number, 0], tiles.slots[number, 1] = near, far
            tiles.slots[number, 2], tiles.slots[number, 3] = share
            samples += n
            begin = window_end
            if waiting and blend(n, table, tiles.slots, scratch, cells, lanes, at, light):
                return samples, False, True
            waiting = not waiting
        block = until
    return samples, waiting, False


@inlined_kernel
def _blend_last(n, table, tiles, at):
    """Blend a sample that waits for another in vain; returns whether all is opaque."""
    for l in range(np.uint64(n)):  # noqa: E741
        tiles.lanes[np.uint64(at) + SECOND + l] = _F(np.nan)
    light = np.uint64(TILE * SECTIONS * tiles.states.shape[0])
    return blend(n, table, tiles.slots, tiles.scratch, tiles.cells, tiles.lanes, at, light)


@lean_kernel
def _composite_tile(
    n, pixel, per_interval, stride_mask, reach, t_j, face, chunk, count, fine, coarse, table, tiles, at
):
    """A tile through the planes of a chunk that it hits; returns samples taken and whether it is done.

    `reach`: the nearest and the farthest distance that any of its pixels shows.
    """
    planes, nearest, farthest, base = chunk.planes, reach[0], reach[1], face[BASE]
    stride = stride_mask + 1
    samples, waiting, done = 0, False, False
    for group in range((count + 7) // 8):
        flags = chunk.hits[np.uint64(group)]
        while flags:
            p = np.uint64(8 * group) + (trailing_zeros(flags) >> np.uint64(3))
            flags &= flags - _ONE
            distance = planes[DISTANCE, p]
            half = 0.5
            if face[MIDDLE] != 0.0:
                half = stride / (4.0 * per_interval)
            elif stride < per_interval:
                on_even = np.int64(planes[NUMBER, p]) & stride == 0
                half = (1.0 if on_even else 2.0) * stride / (3.0 * per_interval)
            half *= planes[INTERVAL, p]
            if distance - half >= farthest:
                # Nothing of a finer level follows; a coarse plane reaches as far back as two fine ones.
                if planes[LEVEL, p] == 0.0:
                    continue
                done = True
                break
            if distance + half <= nearest:
                continue
            near, far = _F(distance - half - base), _F(distance + half - base)
            if planes[LEVEL, p] == 0.0:
                taken, waiting, done = _composite_packet(
                    n, p, pixel, near, far, waiting, t_j, face, chunk, fine, table, tiles, at
                )
            else:
                taken, waiting, done = _composite_packet(
                    n, p, pixel, near, far, waiting, t_j, face, chunk, coarse, table, tiles, at
                )
            samples += taken
            if done:
                break
        if done:
            break
    if waiting:
        done |= _blend_last(n, table, tiles, at)
    return samples, done


@lean_kernel
def _composite_row(v, rays, per_interval, fine, coarse, table, residual, chunk, tiles, out):
    """One scanline of the face; returns the number of samples taken."""
    face, share = rays.face, rays.share
    queue, states, strides = chunk.queue, tiles.states, tiles.strides
    t_j = face[ORIGIN_J] + (v + 0.5) * face[PITCH]
    offset_j = face[OFFSET_J] + (v + 0.5) * face[OFFSET_PITCH]
    n = tiles.cells.shape[0]  # TILE, but unknown to the compiler: a known 16 is unrolled, not vectorised
    number = states.shape[0]
    middle = face[MIDDLE] != 0.0
    planes_per_interval = 2 * per_interval if middle else per_interval
    steepest_i = max(abs(face[ORIGIN_I]), abs(face[ORIGIN_I] + number * TILE * face[PITCH]))
    for tile in range(number):
        states[tile] = _FRESH
        t_left = face[ORIGIN_I] + tile * TILE * face[PITCH]
        steepest = max(max(abs(t_left), abs(t_left + TILE * face[PITCH])), abs(t_j))
        wanted = 4 if steepest > 2.0 * STEEP else 2 if steepest > STEEP else 1
        stride = per_interval // min(max(wanted, np.int64(face[LEAST])), per_interval)
        strides[tile] = (2 * stride if middle else stride) - 1
    queue[:] = 0
    queue[0], queue[1] = plane_range(t_j, offset_j, face, rays.limits, planes_per_interval, fine)
    if share[0] != 0.0 or share[1] != 0.0:
        queue[2], queue[3] = plane_range(t_j, offset_j, face, rays.limits, planes_per_interval, coarse)
    first_live, end_live = 0, number
    samples = 0
    while first_live < end_live:
        count = collect_planes(t_j, offset_j, face, share, planes_per_interval, fine, coarse, chunk)
        if count == 0:
            break
        for tile in range(first_live, end_live):
            if states[tile] == _DONE:
                continue
            pixel, at = tile * TILE, tile * TILE * SECTIONS
            phase = (strides[tile] + 1) // 2 if middle else 0
            find_hits(pixel, count, strides[tile], phase, steepest_i, chunk)
            if states[tile] == _FRESH:
                hit = _NONE
                for group in range((count + 7) // 8):
                    hit |= chunk.hits[np.uint64(group)]
                if hit == _NONE:
                    continue
                states[tile] = _GOING
                _find_ranges(n, pixel, t_j, offset_j, face, rays.metric, rays.half_spaces, tiles.ranges)
                _start_tile(n, v, pixel, face[BASE], residual, out, tiles, tiles.reach[tile], at)
            taken, done = _composite_tile(
                n, pixel, per_interval, strides[tile], tiles.reach[tile], t_j, face, chunk, count, fine,
                coarse, table, tiles, at,
            )  # fmt: skip
            samples += taken
            if done:
                states[tile] = _DONE
        while first_live < end_live and states[first_live] == _DONE:
            first_live += 1
        while first_live < end_live and states[end_live - 1] == _DONE:
            end_live -= 1
    for tile in range(number):
        if states[tile] != _FRESH:
            at = tile * TILE * SECTIONS
            for l in range(TILE):  # noqa: E741
                for channel in range(4):
                    out[v, tile * TILE + l, channel] = tiles.lanes[at + TILE * channel + l]
    return samples


@parallel_kernel
def composite(rays, per_interval, fine, coarse, table, residual, workers, cancelled, samples, out):
    """Composite one face of an eye image behind what `out` already holds.

    Parameters
    ----------
    rays
        What is composited, and for which eye.
    per_interval
        Sample planes a slice interval at the steepest tile: 1, 2 or 4. More than 1 needs `pairs`.
    fine, coarse
        `scanline.Level`.
    table
        Transfer function: one of `tables`; integrals need `pairs` and MIDDLE, a lit one runs with its reach.
    residual
        A packet stops when all its pixels let through no more than this.
    workers
        Threads; scanlines are dealt to them in turn. The picture does not depend on it.
    cancelled
        uint8 (1,): as soon as another thread makes it other than 0, scanlines not yet begun are left as they
        are.
    samples
        int64 (height,): overwritten with the samples taken in each scanline.
    out
        float32 (height, width, 4), width a multiple of 16: linear, premultiplied; what lies in front, and
        what is composited behind it.
    """
    for worker in prange(workers):
        words = max(fine.visible.shape[2], coarse.visible.shape[2])
        chunk = new_chunk(words)
        tiles = _new_tiles(out.shape[1] // TILE)
        for v in range(worker, out.shape[0], workers):
            if byte_now(cancelled) != 0:
                samples[v] = 0
                continue
            samples[v] = _composite_row(
                v, rays, per_interval, fine, coarse, table, residual, chunk, tiles, out
            )
