"""Single rays through the dense volume: what lies in front of a point, and where a ray first meets something.

A picture takes millions of samples, marks and picks some thousands of rays: here accuracy counts, so all is
float64. A ray is cut into pieces no longer than a step; on each the value runs linearly from end to end, and
the piece has the transfer function's mean over these values (pre-integration), so that a thin shell of
values between two samples is not missed.
"""

import numpy as np

from .._jit import kernel, parallel_kernel, prange
from .dense import magnitude_at, value_at

# Columns of `sums`, and of a ray.
_EXTINCTION = 3
_NEAR, _FAR = 6, 7
# Of `gradient`, after the nine numbers of world_from_differences.
REACH, PER_MAGNITUDE, LOW, PER_WEIGHT, THICKENED, COLOURED, GRADIENT = 9, 10, 11, 12, 13, 14, 15
# A hit is looked for again in pieces so many times shorter.
FINER = 16
# Table entries. Between values nearer than this, the difference of two sums has no digits left.
_ALIKE = 1e-6


@kernel
def _value_on(voxels, ray, distance):
    """The value at a distance along a ray."""
    x, y, z = ray[0] + distance * ray[3], ray[1] + distance * ray[4], ray[2] + distance * ray[5]
    return value_at(voxels, x, y, z)


@kernel
def _piece(voxels, ray, sums, gradient, middle, here, there, mean):
    """mean[0 … 3]: extinction · colour and extinction of a piece of a ray between two places in the table."""
    table, thickened, coloured = 0, 1.0, 1.0
    if gradient[REACH] > 0:
        x, y, z = ray[0] + middle * ray[3], ray[1] + middle * ray[4], ray[2] + middle * ray[5]
        magnitude = magnitude_at(voxels, x, y, z, gradient, gradient[REACH])
        table = min(int(magnitude * gradient[PER_MAGNITUDE] + 0.5), sums.shape[0] - 1)
        weight = min(max((magnitude - gradient[LOW]) * gradient[PER_WEIGHT], 0.0), 1.0)
        thickened = 1 - gradient[THICKENED] + gradient[THICKENED] * weight
        coloured = 1 - gradient[COLOURED] + gradient[COLOURED] * weight
    extinction = thickened * max(_mean(sums[table], _EXTINCTION, here, there), 0.0)
    mean[_EXTINCTION] = extinction
    if extinction > 0:
        for n in range(3):
            mean[n] = thickened * coloured * _mean(sums[table], n, here, there)


@kernel
def _row_of(sums, entry):
    """The row of the table that a place in it, counted in rows from its first one's beginning, belongs to."""
    return min(max(int(np.floor(entry)), 0), sums.shape[0] - 2)


@kernel
def _mean(sums, column, one, other):
    """Mean of a column of the table between two places in it."""
    first, last = _row_of(sums, one), _row_of(sums, other)
    if first == last or abs(other - one) < _ALIKE:
        return sums[first + 1, column] - sums[first, column]
    # The first and the last row go on for ever.
    from_ = sums[first, column] + (one - first) * (sums[first + 1, column] - sums[first, column])
    to = sums[last, column] + (other - last) * (sums[last + 1, column] - sums[last, column])
    return (to - from_) / (other - one)


@kernel
def _part_of(ray, rows, first, end):
    """Nearest and farthest distance of a ray within the half-spaces rows[first:end], and its own range."""
    near, far = ray[_NEAR], ray[_FAR]
    for n in range(first, end):
        height = rows[n, 0] * ray[0] + rows[n, 1] * ray[1] + rows[n, 2] * ray[2] + rows[n, 3]
        rise = rows[n, 0] * ray[3] + rows[n, 1] * ray[4] + rows[n, 2] * ray[5]
        if rise > 0:
            near = max(near, -height / rise)
        elif rise < 0:
            far = min(far, -height / rise)
        elif height < 0:
            return 0.0, 0.0
    return near, far


@parallel_kernel
def composite_rays(voxels, sums, origin, scale, gradient, rows, ends, rays, step, residual, out):
    """Colour and opacity from the beginning of each ray to its end.

    Parameters
    ----------
    voxels
        [z, y, x], at least two along each axis.
    sums
        (m, n + 1, 4) float64, of each magnitude that is told apart: cumulative over the table's rows from its
        second on, extinction times colour, and extinction. Value v lies (v − origin)·scale + ½ rows from the
        beginning.
    gradient
        (GRADIENT,) float64: the gradient in the world of slopes along the voxel axes (nine numbers, row by
        row), and voxels to its neighbours, 0 where nothing asks for it; magnitudes told apart a unit;
        modulation as `Modulation` has it: low, 1 / (high − low), of opacity, of colour.
    rows, ends
        Half-spaces (m, 4) of convex parts, front to back as seen by every ray; part n has those from
        ends[n − 1] on up to ends[n].
    rays
        (r, 8) float64: where distance 0 is and the step of distance 1, both in voxel index coordinates; the
        nearest and the farthest distance.
    step
        Longest piece, in the rays' unit of distance.
    residual
        A ray ends where no more than this transparency is left.
    out
        (r, 4) float64: premultiplied colour and opacity; overwritten.
    """
    for r in prange(rays.shape[0]):
        ray, mean = rays[r], np.zeros(4)
        red = green = blue = 0.0
        clear = 1.0
        first = 0
        for part in range(ends.shape[0]):
            near, far = _part_of(ray, rows, first, ends[part])
            first = ends[part]
            if not (far > near and clear > residual):
                continue
            count = int(np.ceil((far - near) / step))
            length = (far - near) / count
            here = (_value_on(voxels, ray, near) - origin) * scale + 0.5
            for n in range(count):
                there = (_value_on(voxels, ray, near + (n + 1) * length) - origin) * scale + 0.5
                if here == here and there == there:
                    _piece(voxels, ray, sums, gradient, near + (n + 0.5) * length, here, there, mean)
                    if mean[_EXTINCTION] > 0:
                        through = np.exp(-mean[_EXTINCTION] * length)
                        share = clear * (1 - through) / mean[_EXTINCTION]
                        red += share * mean[0]
                        green += share * mean[1]
                        blue += share * mean[2]
                        clear *= through
                        if clear <= residual:
                            break
                here = there
        out[r, 0], out[r, 1], out[r, 2], out[r, 3] = red, green, blue, 1 - clear


@parallel_kernel
def hit_rays(voxels, sums, origin, scale, gradient, rows, ends, rays, step, threshold, out):
    """Where each ray's opacity first reaches a threshold.

    Parameters
    ----------
    threshold
        0 < threshold < 1.
    out
        (r, 3) float64: distance, the value there, opacity; NaN where it never does. Overwritten.

    Other parameters as of `composite_rays`.
    """
    enough = 1 - threshold
    for r in prange(rays.shape[0]):
        ray, mean = rays[r], np.zeros(4)
        out[r, 0] = out[r, 1] = out[r, 2] = np.nan
        clear = 1.0
        first = 0
        for part in range(ends.shape[0]):
            near, far = _part_of(ray, rows, first, ends[part])
            first = ends[part]
            if not far > near or clear <= enough:
                continue
            count = int(np.ceil((far - near) / step))
            length = (far - near) / count
            before = clear  # what was left a piece before
            here = (_value_on(voxels, ray, near) - origin) * scale + 0.5
            for n in range(count):
                there = (_value_on(voxels, ray, near + (n + 1) * length) - origin) * scale + 0.5
                begin = near + n * length
                after = clear * _through(voxels, ray, sums, gradient, begin, length, here, there, mean)
                if after <= enough:
                    # A sample behind a surface tells only that it lies in this piece or the one before.
                    start = max(n - 1, 0)
                    after = before if n else clear
                    fine = length / FINER
                    begin = near + start * length
                    one = (_value_on(voxels, ray, begin) - origin) * scale + 0.5
                    for m in range((n + 1 - start) * FINER):
                        if m == (n - start) * FINER:
                            clear = after
                        end = (_value_on(voxels, ray, begin + (m + 1) * fine) - origin) * scale + 0.5
                        at = begin + m * fine
                        through = _through(voxels, ray, sums, gradient, at, fine, one, end, mean)
                        if after * through <= enough:
                            part_of_it = np.log(after / enough) / -np.log(through) if through > 0 else 0.0
                            distance = begin + (m + part_of_it) * fine
                            out[r, 0], out[r, 2] = distance, threshold
                            out[r, 1] = _value_on(voxels, ray, distance)
                            after = 0.0
                            break
                        after *= through
                        one = end
                    if after == 0:
                        clear = 0.0
                        break
                before, clear, here = clear, after, there


@kernel
def _through(voxels, ray, sums, gradient, begin, length, here, there, mean):
    """Transparency of a piece of a ray."""
    if here == here and there == there:
        _piece(voxels, ray, sums, gradient, begin + 0.5 * length, here, there, mean)
        return np.exp(-mean[_EXTINCTION] * length)
    return 1.0
