"""The float64 ray caster that judges everything else.

It shares no kernel and no factorization with what it judges, and has no sampling distance: along a ray the
interpolated scalar is a cubic polynomial inside each cell, so every ray is cut where it crosses a voxel plane
and where the scalar crosses a control point of the transfer function. On each piece that remains extinction
and colour are smooth, and Gauss's rule, halved until nothing changes, converges fast; a step of the transfer
function falls between pieces and cannot be missed, however thin the shell it lights.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ._jit import kernel, max_threads, parallel_kernel, prange, set_threads
from .errors import SettingsError
from .geometry.regions import Regions
from .geometry.view import View
from .optics.transfer import MAX_OPACITY, TransferFunction
from .volume.grid import Volume

MAX_HALVINGS = 30  # a smooth piece is halved at most so often
_ATTEMPTS = 3  # a pixel whose changes add up to more than the tolerance is cast again, 16 times finer
_PIXELS_A_BAND = 8192  # between two calls of `progress`
_OPAQUE_DEPTH = -np.log(1e-9)  # a ray stops at transmittance 1e-9

# Columns of the table of pieces: on one piece 1 − opacity and colour are linear in value − reference value.
_VALUE, _CLEAR, _SLOPE, _RGB, _RGB_SLOPE, _COLUMNS = 0, 1, 2, 3, 6, 9
# Columns of a ray's accumulator.
_DEPTH, _CHANGE, _STATES = 3, 4, 5

# What a plane is for, see `_planes_of`.
_KEEP, _INSIDE, _OUTSIDE, _CROP, _SECOND = range(5)

_MIN_CLEAR = 1 - MAX_OPACITY
_ROOT15 = np.sqrt(15.0)


@dataclass(frozen=True)
class Convergence:
    """How far a reference picture had settled.

    Attributes
    ----------
    tolerance
        What was asked for.
    worst_change
        Largest sum, over all pieces of one ray, of the change that the last halving made to the pixel's RGBA.
        The rule is of sixth order, so the error left is usually far below it.
    unconverged
        Pixels whose sum still exceeds the tolerance.
    """

    tolerance: float
    worst_change: float
    unconverged: int


def render(
    volume: Volume,
    transfer: TransferFunction,
    view: View,
    *,
    regions: Regions | None = None,
    tolerance: float = 1e-5,
    threads: int | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> NDArray[np.float64]:
    """The converged picture of a volume: emission and absorption along the ray of every pixel centre.

    Parameters
    ----------
    volume
        Any voxel type and any affine pose. Nothing lies outside the box of voxel centres; a cell (8 voxels)
        with a NaN corner is transparent; a volume one voxel thick along an axis gives an empty picture.
    transfer
        Scalars are interpolated trilinearly, then classified. Opacities without a unit hold over the volume's
        smallest spacing.
    view
        The eye may stand anywhere, inside the volume too; its near distance is measured along the ray.
    regions
        Crop, clip planes and slabs; None: the whole volume.
    tolerance
        Largest change of a pixel's RGBA that one more halving of all its pieces may make, 1e-12 … 0.1.
    threads
        1 … the processor's cores; None: all. The picture does not depend on it.
    progress
        Called as progress(rows done, rows, "reference") between bands of rows, where Ctrl-C works too.

    Returns
    -------
    (height, width, 4) float64, linear, premultiplied, row 0 on top, without background.

    Warns
    -----
    RuntimeWarning
        Some pixels have not converged; `render_with_report` tells how many without warning.

    Raises
    ------
    SettingsError
        Tolerance or threads out of range.

    Accuracy
    --------
    Each pixel within about `tolerance`, usually 1e-3 of it; never better than about 1e-12. A ray stops at
    transmittance 1e-9. Takes 4 bytes a voxel besides the volume.

    Source: Max, *Optical models for direct volume rendering*, 1995, section 4; the rule on a piece is the
    three-stage Gauss method, Hairer, Nørsett and Wanner, *Solving Ordinary Differential Equations I*, II.7.
    """
    image, convergence = render_with_report(
        volume, transfer, view, regions=regions, tolerance=tolerance, threads=threads, progress=progress
    )
    if convergence.unconverged:
        warnings.warn(
            f"{convergence.unconverged} pixels of the reference picture have not converged to {tolerance:g}; "
            f"the worst still changed by {convergence.worst_change:.1g}",
            RuntimeWarning,
            stacklevel=2,
        )
    return image


def render_with_report(
    volume: Volume,
    transfer: TransferFunction,
    view: View,
    *,
    regions: Regions | None = None,
    tolerance: float = 1e-5,
    threads: int | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> tuple[NDArray[np.float64], Convergence]:
    """As `render`, and how far the picture had settled."""
    if not 1e-12 <= tolerance <= 0.1:
        raise SettingsError(f"tolerance lies between 1e-12 and 0.1; given {tolerance!r}")
    if threads is not None and not 1 <= threads <= max_threads():
        raise SettingsError(f"threads lies between 1 and {max_threads()}; given {threads!r}")
    regions = regions or Regions()
    width, height = view.size
    states = np.zeros((height, width, _STATES))
    if min(volume.size) > 1:
        set_threads(threads or max_threads())
        _cast_in_bands(volume, transfer, view, regions, tolerance, states, progress)
    change = states[..., _CHANGE]
    report = Convergence(tolerance, float(change.max()), int(np.count_nonzero(change > tolerance)))
    image = states[..., :4].copy()
    image[..., 3] = -np.expm1(-states[..., _DEPTH])
    return image, report


def _cast_in_bands(volume, transfer, view, regions, tolerance, states, progress) -> None:
    height, width, _ = states.shape
    transfer = transfer.with_unit(min(volume.spacing))
    table = _pieces_of(transfer)
    object_from_world = np.linalg.inv(volume.world_from_object)
    starts = view.starts() @ object_from_world[:3, :3].T + object_from_world[:3, 3]
    near = -np.inf if view.eye.is_at_infinity else float(view.eye.near)
    world_directions = view.directions()
    world_directions /= np.linalg.norm(world_directions, axis=-1, keepdims=True)
    directions = world_directions @ object_from_world[:3, :3].T  # objects' units a world unit along the ray
    data = volume.data.astype(np.float32, copy=False)  # exact for all voxel types, and one kernel for all
    planes, kinds = _planes_of(regions, volume)
    rows = max(1, _PIXELS_A_BAND // width)
    for first in range(0, height, rows):
        last = min(first + rows, height)
        _cast_band(
            data,
            starts[first:last].reshape(-1, 3),
            directions[first:last].reshape(-1, 3),
            near,
            planes,
            kinds,
            regions.crop_flags,
            table,
            transfer.opacity_unit,
            float(tolerance),
            states[first:last].reshape(-1, _STATES),
        )
        if progress is not None:
            progress(last, height, "reference")


def _planes_of(regions: Regions, volume: Volume):
    """All planes that bound or divide what is shown, and what each is for.

    Returns
    -------
    planes
        (n, 4) rows in object space.
    kinds
        (n,): _KEEP, shown only where a·p + a_0 ≥ 0; _INSIDE and _OUTSIDE, the first of a slab's two rows, of
        which both or not both must be ≥ 0; _CROP, the first of an axis' two rows a·p − x0 and a·p − x1, the
        axes in the order x, y, z; _SECOND, the second of the two.
    """
    pose = volume.world_from_object
    rows, kinds = [], []
    for axis, unit in enumerate(np.eye(3)):
        rows += [(*unit, 0.0), (*-unit, volume.size[axis] - 1.0)]
        kinds += [_KEEP, _KEEP]
    for plane in regions.clip:
        rows.append(np.array(plane) @ pose)
        kinds.append(_KEEP)
    for cut in regions.cut:
        plane, reach = np.array(cut.plane), cut.thickness / 2 * np.linalg.norm(cut.plane[:3])
        rows += [(plane + (0, 0, 0, reach)) @ pose, ((0, 0, 0, reach) - plane) @ pose]
        kinds += [_INSIDE if cut.show == "inside" else _OUTSIDE, _SECOND]
    for axis, unit in enumerate(np.eye(3)):
        if regions.crop is not None:
            rows += [(*unit, -x) for x in regions.crop[2 * axis : 2 * axis + 2]]
            kinds += [_CROP, _SECOND]
    return np.array(rows, np.float64), np.array(kinds)


def _pieces_of(transfer: TransferFunction):
    """The table of a transfer function's pieces, on which opacity and colour are linear: three arrays.

    Returns
    -------
    breaks
        (n,) distinct ascending values. Piece i holds from breaks[i - 1] (included) to breaks[i].
    pieces
        (n + 1, 9): reference value; 1 − opacity there; its slope; colour there; its slope.
    visible_before
        (n + 2,): how many of the pieces 0 … i - 1 are not wholly transparent.
    """
    nodes = np.column_stack([transfer.values, transfer.colours, transfer.opacities])
    rows = [(-np.inf, nodes[0], nodes[0])]  # (from value, node at the piece's start, node at its end)
    for start, end in pairwise(nodes):
        if start[0] == end[0]:
            continue  # a step: its two pieces meet at one break
        rows.append((start[0], start, end))
        if min(start[4], end[4]) < MAX_OPACITY < max(start[4], end[4]):
            # Opacity is held at MAX_OPACITY, which bends it where it crosses that.
            bend = start + (end - start) * ((MAX_OPACITY - start[4]) / (end[4] - start[4]))
            if start[0] < bend[0] < end[0]:
                rows[-1:] = [(start[0], start, bend), (bend[0], bend, end)]
    rows.append((nodes[-1, 0], nodes[-1], nodes[-1]))

    pieces = np.zeros((len(rows), _COLUMNS))
    for piece, (_, start, end) in zip(pieces, rows, strict=True):
        width = end[0] - start[0]
        clear = 1 - np.minimum([start[4], end[4]], MAX_OPACITY)
        piece[_VALUE], piece[_CLEAR], piece[_RGB : _RGB + 3] = start[0], clear[0], start[1:4]
        if width > 0:
            piece[_SLOPE] = (clear[1] - clear[0]) / width
            piece[_RGB_SLOPE : _RGB_SLOPE + 3] = (end[1:4] - start[1:4]) / width
    breaks = np.array([row[0] for row in rows[1:]])
    visible = (pieces[:, _CLEAR] < 1) | (pieces[:, _SLOPE] != 0)
    return breaks, pieces, np.append(0, np.cumsum(visible))


@parallel_kernel
def _cast_band(data, starts, directions, near, planes, kinds, crop_flags, table, unit, tolerance, states):
    for pixel in prange(len(directions)):
        eye, direction, state = starts[pixel], directions[pixel], states[pixel]
        ends = np.empty(len(planes) + 2)
        count = _cut_ray(eye, direction, near, planes, kinds, ends)
        piece_tolerance = tolerance / 32
        for _ in range(_ATTEMPTS):
            state[:] = 0.0
            for n in range(count - 1):
                middle = 0.5 * (ends[n] + ends[n + 1])
                if ends[n] < ends[n + 1] and _is_shown(eye, direction, middle, planes, kinds, crop_flags):
                    _cast_ray(data, eye, direction, ends[n], ends[n + 1], table, unit, piece_tolerance, state)
            if state[_CHANGE] <= tolerance:
                break
            piece_tolerance /= 16


@kernel
def _at(eye, direction, distance, plane):
    """a·p + a_0 on the ray; the eye's where the ray runs along the plane, which no rounding then disturbs."""
    offset = plane[0] * eye[0] + plane[1] * eye[1] + plane[2] * eye[2] + plane[3]
    slope = plane[0] * direction[0] + plane[1] * direction[1] + plane[2] * direction[2]
    return offset + slope * distance if slope != 0 else offset


@kernel
def _cut_ray(eye, direction, near, planes, kinds, ends):
    """Fill `ends` with the distances at which the ray may begin or cease to be shown, ascending; how many."""
    entry, leave = near, np.inf
    count = 0
    for k in range(len(planes)):
        plane = planes[k]
        slope = plane[0] * direction[0] + plane[1] * direction[1] + plane[2] * direction[2]
        crossing = -_at(eye, direction, 0.0, plane) / slope if slope != 0 else -np.inf
        if kinds[k] != _KEEP:
            ends[count] = crossing
            count += 1
        elif slope > 0:
            entry = max(entry, crossing)
        elif slope < 0:
            leave = min(leave, crossing)
        elif _at(eye, direction, 0.0, plane) < 0:
            return 0
    if not entry < leave:
        return 0
    for n in range(count):
        ends[n] = min(max(ends[n], entry), leave)
    ends[count], ends[count + 1] = entry, leave
    count += 2
    for n in range(1, count):  # insertion sort: a handful of numbers
        value, m = ends[n], n - 1
        while m >= 0 and ends[m] > value:
            ends[m + 1] = ends[m]
            m -= 1
        ends[m + 1] = value
    return count


@kernel
def _is_shown(eye, direction, distance, planes, kinds, crop_flags):
    """Whether slabs and crop show the ray's point at a distance; what only keeps one side is not asked.

    A ray in a border is in the slab or the box, if that has a thickness.
    """
    region, weight = 0, 1
    for k in range(len(planes)):
        kind = kinds[k]
        if kind in (_KEEP, _SECOND):
            continue
        first = _at(eye, direction, distance, planes[k])
        second = _at(eye, direction, distance, planes[k + 1])
        if kind == _CROP:
            region += weight * (0 if first < 0 else 1 if second < 0 or second == 0 < first else 2)
            weight *= 3
        elif (first >= 0 and second >= 0 and first + second > 0) != (kind == _INSIDE):
            return False
    return weight == 1 or (crop_flags >> region) & 1 == 1


@kernel
def _first_plane(position, step, count):
    """Cell that holds `position`, and the voxel plane through which a ray leaves it."""
    cell = min(max(int(np.floor(position)), 0), count - 2)
    return cell, cell + (1 if step > 0 else 0)


@kernel
def _reach(plane, eye, step):
    """Distance at which the ray reaches a voxel plane."""
    return (plane - eye) / step if step != 0 else np.inf


@kernel
def _cast_ray(data, eye, direction, entry, leave, table, unit, tolerance, state):
    """Front to back through the cells between two distances; adds to `state`."""
    nz, ny, nx = data.shape
    ex, ey, ez = eye[0], eye[1], eye[2]
    dx, dy, dz = direction[0], direction[1], direction[2]
    i, plane_i = _first_plane(ex + entry * dx, dx, nx)
    j, plane_j = _first_plane(ey + entry * dy, dy, ny)
    k, plane_k = _first_plane(ez + entry * dz, dz, nz)
    forth_i, forth_j, forth_k = 1 if dx > 0 else -1, 1 if dy > 0 else -1, 1 if dz > 0 else -1
    # Each crossing is computed afresh from its plane, so that nothing adds up along the ray.
    reach_i, reach_j, reach_k = _reach(plane_i, ex, dx), _reach(plane_j, ey, dy), _reach(plane_k, ez, dz)
    here = entry
    while here < leave and state[_DEPTH] < _OPAQUE_DEPTH:
        there = min(min(reach_i, reach_j), min(reach_k, leave))
        if there > here:
            # The axes' steps may have left the grid by a rounding; the interpolant goes on smoothly.
            ci, cj, ck = min(max(i, 0), nx - 2), min(max(j, 0), ny - 2), min(max(k, 0), nz - 2)
            start = (ex + here * dx - ci, ey + here * dy - cj, ez + here * dz - ck)
            length = there - here
            way = (length * dx, length * dy, length * dz)
            _cast_cell(data, (ci, cj, ck), start, way, table, length / unit, tolerance, state)
            here = there
        if reach_i <= there:
            i += forth_i
            plane_i += forth_i
            reach_i = _reach(plane_i, ex, dx)
        if reach_j <= there:
            j += forth_j
            plane_j += forth_j
            reach_j = _reach(plane_j, ey, dy)
        if reach_k <= there:
            k += forth_k
            plane_k += forth_k
            reach_k = _reach(plane_k, ez, dz)


@kernel
def _piece_at(breaks, value):
    """Number of breaks at or below `value`: the piece that holds there."""
    low, high = 0, len(breaks)
    while low < high:
        middle = (low + high) // 2
        if breaks[middle] <= value:
            low = middle + 1
        else:
            high = middle
    return low


@kernel
def _cast_cell(data, cell, start, way, table, length, tolerance, state):
    """The part of a ray inside one cell: from `start`, in the cell's own coordinates, on by `way`.

    `length` is the part's length in opacity units.
    """
    breaks, pieces, visible_before = table
    i, j, k = cell
    x, y, z = start
    dx, dy, dz = way
    v000, v100 = np.float64(data[k, j, i]), np.float64(data[k, j, i + 1])
    v010, v110 = np.float64(data[k, j + 1, i]), np.float64(data[k, j + 1, i + 1])
    v001, v101 = np.float64(data[k + 1, j, i]), np.float64(data[k + 1, j, i + 1])
    v011, v111 = np.float64(data[k + 1, j + 1, i]), np.float64(data[k + 1, j + 1, i + 1])
    total = v000 + v100 + v010 + v110 + v001 + v101 + v011 + v111
    if total != total:
        return  # a NaN corner
    lowest = min(min(min(v000, v100), min(v010, v110)), min(min(v001, v101), min(v011, v111)))
    highest = max(max(max(v000, v100), max(v010, v110)), max(max(v001, v101), max(v011, v111)))
    first, last = _piece_at(breaks, lowest), _piece_at(breaks, highest)
    if visible_before[first] == visible_before[last + 1]:
        return  # no value in the cell is visible

    # The trilinear interpolant as a sum of products of x, y and z; the differences of equal corners are 0
    # exactly, so that a constant cell stays constant and a value on a step stays on its side.
    ax, ay, az = v100 - v000, v010 - v000, v001 - v000
    bxy, bxz, byz = (v110 - v100) - ay, (v101 - v100) - az, (v011 - v010) - az
    g = (v111 - v101) - (v110 - v100) - byz
    # On the ray, a cubic in s = 0 … 1.
    k0 = v000 + x * (ax + y * (bxy + z * g) + z * bxz) + y * (ay + z * byz) + z * az
    k1 = (
        dx * (ax + y * bxy + z * (bxz + y * g))
        + dy * (ay + x * bxy + z * (byz + x * g))
        + dz * (az + x * bxz + y * (byz + x * g))
    )
    k2 = dx * dy * (bxy + z * g) + dx * dz * (bxz + y * g) + dy * dz * (byz + x * g)
    cubic = (k0, k1, k2, dx * dy * dz * g)

    if first == last:
        _integrate(cubic, 0.0, 1.0, pieces[first], length, tolerance, state)
        return
    # Between its extrema the cubic is monotonic and crosses the breaks one after the other.
    turn, other_turn = _extrema(cubic)
    here = 0.0
    for part in range(3):
        there = turn if part == 0 else other_turn if part == 1 else 1.0
        if there > here:
            _cast_monotonic(cubic, here, there, breaks, pieces, length, tolerance, state)
            here = there


@kernel
def _extrema(cubic):
    """The two places in 0 … 1, ascending, where the cubic's derivative is zero; 0 stands for none."""
    _, k1, k2, k3 = cubic
    a, b, c = 3 * k3, 2 * k2, k1
    discriminant = b * b - 4 * a * c
    if not discriminant > 0:
        return 0.0, 0.0
    # The form that does not cancel; a quotient by zero is infinite or NaN and fails the test below.
    q = -0.5 * (b + np.copysign(np.sqrt(discriminant), b))
    one, two = q / a, c / q
    one = one if 0 < one < 1 else 0.0
    two = two if 0 < two < 1 else 0.0
    return min(one, two), max(one, two)


@kernel
def _value(cubic, s):
    k0, k1, k2, k3 = cubic
    return ((k3 * s + k2) * s + k1) * s + k0


@kernel
def _cast_monotonic(cubic, start, end, breaks, pieces, length, tolerance, state):
    """Cut a monotonic part where the value crosses the breaks, and integrate between."""
    from_value, to_value = _value(cubic, start), _value(cubic, end)
    piece, last = _piece_at(breaks, from_value), _piece_at(breaks, to_value)
    here = start
    while piece != last:
        crossed = piece if piece < last else piece - 1
        there = _crossing(cubic, here, end, breaks[crossed], to_value > from_value)
        _integrate(cubic, here, there, pieces[piece], length, tolerance, state)
        piece += 1 if piece < last else -1
        here = there
    _integrate(cubic, here, end, pieces[piece], length, tolerance, state)


@kernel
def _crossing(cubic, low, high, target, rising):
    """Where the cubic, monotonic between low and high, takes the value: Newton's method kept in a bracket."""
    s = 0.5 * (low + high)
    for _ in range(100):
        excess = _value(cubic, s) - target
        if excess == 0:
            return s
        if (excess > 0) == rising:
            high = s
        else:
            low = s
        better = s - excess / ((3 * cubic[3] * s + 2 * cubic[2]) * s + cubic[1])
        if not low < better < high:
            better = 0.5 * (low + high)
        if abs(better - s) <= 1e-16 or high - low <= 1e-16:
            return better
        s = better
    return s


@kernel
def _integrate(cubic, start, end, piece, length, tolerance, state):
    """Add the light of one smooth piece, halving until one halving more changes the pixel by ≤ tolerance."""
    if not end > start or (piece[_SLOPE] == 0 and piece[_CLEAR] == 1):
        return
    colour_varies = piece[_RGB_SLOPE] != 0 or piece[_RGB_SLOPE + 1] != 0 or piece[_RGB_SLOPE + 2] != 0
    # Panel number `index` of 2^level; after the second half of a panel its whole is done.
    level, index, width = 0, 0, end - start
    while not (level == 0 and index == 1):
        here, half = start + index * width, 0.5 * width
        depth, moment = _panel(cubic, here, width, piece, length, colour_varies)
        depth_1, moment_1 = _panel(cubic, here, half, piece, length, colour_varies)
        depth_2, moment_2 = _panel(cubic, here + half, half, piece, length, colour_varies)
        depth_12 = depth_1 + depth_2
        moment_12 = moment_1 + np.exp(-depth_1) * moment_2
        opacity = -np.expm1(-depth_12)
        opacity_change = opacity + np.expm1(-depth)
        change = abs(opacity_change)
        for c in range(3):
            colour_change = piece[_RGB + c] * opacity_change + piece[_RGB_SLOPE + c] * (moment_12 - moment)
            change = max(change, abs(colour_change))
        transmittance = np.exp(-state[_DEPTH])
        if change * transmittance > tolerance and level < MAX_HALVINGS:
            level += 1
            index *= 2
            width = half
            continue
        for c in range(3):
            state[c] += transmittance * (piece[_RGB + c] * opacity + piece[_RGB_SLOPE + c] * moment_12)
        state[_DEPTH] += depth_12
        state[_CHANGE] += change * transmittance
        if state[_DEPTH] > _OPAQUE_DEPTH:
            return
        index += 1
        while level > 0 and index % 2 == 0:
            level -= 1
            index //= 2
            width *= 2


@kernel
def _panel(cubic, start, width, piece, length, colour_varies):
    """One panel by the three-stage Gauss rule.

    Returns its optical depth D and ∫ (value − reference value) dα over it, α = 1 − exp(−depth so far). The
    colour is linear in the value, so these two give it: colour · (1 − exp(−D)) + slope · integral.
    """
    inward = _ROOT15 / 10
    v1 = _value(cubic, start + (0.5 - inward) * width) - piece[_VALUE]
    v2 = _value(cubic, start + 0.5 * width) - piece[_VALUE]
    v3 = _value(cubic, start + (0.5 + inward) * width) - piece[_VALUE]
    t1 = _extinction(piece, v1) * (length * width)
    t2 = _extinction(piece, v2) * (length * width)
    t3 = _extinction(piece, v3) * (length * width)
    depth = (5 * t1 + 8 * t2 + 5 * t3) / 18
    if not colour_varies or not depth > 0:
        return depth, 0.0
    # Depths up to the three nodes.
    d1 = t1 * (5 / 36) + t2 * (2 / 9 - _ROOT15 / 15) + t3 * (5 / 36 - _ROOT15 / 30)
    d2 = t1 * (5 / 36 + _ROOT15 / 24) + t2 * (2 / 9) + t3 * (5 / 36 - _ROOT15 / 24)
    d3 = t1 * (5 / 36 + _ROOT15 / 30) + t2 * (2 / 9 + _ROOT15 / 15) + t3 * (5 / 36)
    # About the mean value, so that a constant value is exact at any depth.
    mean = (5 * t1 * v1 + 8 * t2 * v2 + 5 * t3 * v3) / (18 * depth)
    e1, e2, e3 = 5 * t1 * np.exp(-d1), 8 * t2 * np.exp(-d2), 5 * t3 * np.exp(-d3)
    spread = (e1 * (v1 - mean) + e2 * (v2 - mean) + e3 * (v3 - mean)) / 18
    return depth, spread - mean * np.expm1(-depth)


@kernel
def _extinction(piece, value):
    """Per opacity unit, at a value relative to the piece's reference."""
    clear = piece[_CLEAR] + piece[_SLOPE] * value
    return -np.log(min(max(clear, _MIN_CLEAR), 1.0))
