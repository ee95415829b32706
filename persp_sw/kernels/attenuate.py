"""How much of a directional light reaches each voxel: extinction, coarsened, swept slice by slice."""

import numpy as np

from .._jit import kernel, parallel_kernel, prange
from .dense import magnitude_at
from .phong import LOW, MAGNITUDES, NORMAL_FROM_SLOPES, PER_MAGNITUDE, PER_WEIGHT, REACH, ROWS, THICKENED

_NEXT_TO_NOTHING = 1e-300  # it has a logarithm


@parallel_kernel
def coarse_extinction(voxels, rows, origin, scale, last, numbers, factor, length, out):
    """Extinction around every `factor`-th voxel along each axis, from the mean of what passes.

    The mean is weighed by a tent that reaches to the next. Of extinctions themselves a corner of something
    opaque would make all of a coarse voxel opaque.

    Parameters
    ----------
    voxels
        [z, y, x]; NaN has no extinction.
    rows, origin, scale, last
        A table's rows, how values find them, and the last row of one magnitude.
    numbers
        Those of a `phong.Shade` for the axes x, y, z, as float64.
    length
        World length over which light is to pass: a coarse voxel's.
    out
        float32 [z, y, x], overwritten: ⌈(n − 1) / factor⌉ + 1 along an axis of n voxels.
    """
    n_z, n_y, n_x = voxels.shape
    matrix = numbers[NORMAL_FROM_SLOPES:]
    graded = numbers[THICKENED] != 0.0 or numbers[MAGNITUDES] > 1.0
    for k in prange(out.shape[0]):
        plane = np.zeros((out.shape[1], out.shape[2]))
        weights = np.zeros((out.shape[1], out.shape[2]))
        for z in range(max(factor * (k - 1) + 1, 0), min(factor * (k + 1), n_z)):
            weight_z = factor - abs(z - factor * k)
            for y in range(n_y):
                j, weight_y = y // factor, y % factor
                for x in range(n_x):
                    value = np.float64(voxels[z, y, x])
                    passes = 1.0
                    if value == value:
                        row = int(min(max((value - origin) * scale + 1.5, 1.0), float(last)))
                        thicker = 1.0
                        if graded:
                            m = magnitude_at(voxels, float(x), float(y), float(z), matrix, numbers[REACH])
                            share = min(max((m - numbers[LOW]) * numbers[PER_WEIGHT], 0.0), 1.0)
                            thicker = 1.0 - numbers[THICKENED] + numbers[THICKENED] * share
                            skipped = min(
                                np.floor(m * numbers[PER_MAGNITUDE] + 0.5), numbers[MAGNITUDES] - 1.0
                            )
                            row += int(skipped) * int(numbers[ROWS])
                        if rows[row, 3] > 0.0:
                            passes = np.exp(-length * thicker * rows[row, 3])
                    i, weight_x = x // factor, x % factor
                    for b in range(2):
                        w_y = weight_z * (weight_y if b else factor - weight_y)
                        if w_y == 0:
                            continue
                        plane[j + b, i] += w_y * (factor - weight_x) * passes
                        weights[j + b, i] += w_y * (factor - weight_x)
                        if weight_x > 0:
                            plane[j + b, i + 1] += w_y * weight_x * passes
                            weights[j + b, i + 1] += w_y * weight_x
        for j in range(out.shape[1]):
            for i in range(out.shape[2]):
                mean = plane[j, i] / weights[j, i] if weights[j, i] > 0.0 else 1.0
                out[k, j, i] = -np.log(max(mean, _NEXT_TO_NOTHING)) / length


@kernel
def _leaves_after(place, shift, last):
    """Part of a step of `shift` after which the border 0 or `last` is passed; 1 or more: it is not."""
    if shift > 0.0:
        return (last - place) / shift
    return place / -shift if shift < 0.0 else np.inf


@kernel
def sweep(extinction, from_end, shift_a, shift_b, length, out):
    """Part of a light that reaches each voxel.

    Parameters
    ----------
    extinction
        float32 [slice, a, b], per world unit; slices across the axis that is nearest to the light's.
    from_end
        Whether the light comes from the last slice.
    shift_a, shift_b
        Voxels, at most 1, that a ray towards the light goes along a and b while it goes one slice.
    length
        World length of that.
    out
        float32, of the same shape, overwritten: 1 where the light enters. Between slices the depth is the
        trapezoid rule's; what reaches a slice is interpolated there, which softens shadows as they go.
    """
    slices, n_a, n_b = extinction.shape
    passed = np.empty((n_a, n_b), np.float32)  # what leaves the slice before for the one at work
    half = 0.5 * length
    for number in range(slices):
        s = slices - 1 - number if from_end else number
        for a in range(n_a):
            place_a = a + shift_a
            row = min(max(int(np.floor(place_a)), 0), n_a - 2)
            weight_a = place_a - row
            after_a = _leaves_after(float(a), shift_a, n_a - 1.0)
            for b in range(n_b):
                after = min(after_a, _leaves_after(float(b), shift_b, n_b - 1.0))
                if number == 0:
                    out[s, a, b] = 1.0
                elif after < 1.0:
                    out[s, a, b] = np.exp(-extinction[s, a, b] * length * after)
                else:
                    place_b = b + shift_b
                    column = min(max(int(np.floor(place_b)), 0), n_b - 2)
                    weight_b = place_b - column
                    near = passed[row, column] * (1.0 - weight_b) + passed[row, column + 1] * weight_b
                    far = passed[row + 1, column] * (1.0 - weight_b) + passed[row + 1, column + 1] * weight_b
                    reaching = near * (1.0 - weight_a) + far * weight_a
                    out[s, a, b] = reaching * np.exp(-extinction[s, a, b] * half)
        for a in range(n_a):
            for b in range(n_b):
                passed[a, b] = out[s, a, b] * np.exp(-extinction[s, a, b] * half)


@parallel_kernel
def light_beside(left, passing, out):
    """Give what is dense some of the light that reaches what is thinner around it.

    A surface lies between voxels that light reaches and voxels inside, whose own darkness would show on it in
    steps, voxel by voxel, wherever light grazes it.

    Parameters
    ----------
    left
        float32 [slice, a, b], as `sweep` leaves it.
    passing
        float32, of the same shape: the part of light that passes a voxel.
    out
        float32, of the same shape, overwritten. Of the 26 neighbours each counts by the fourth power of how
        much more passes it, times ½ at a face, ¼ at an edge, ⅛ at a corner. Their mean replaces a voxel's
        light where that sums up to 1, half of a clear side, and in part where it is less. So nothing changes
        where extinction does not, and next to nothing in clouds: lower powers bring light into these.
    """
    slices, n_a, n_b = left.shape
    for s in prange(slices):
        for a in range(n_a):
            for b in range(n_b):
                mine, gained, weights = np.float64(left[s, a, b]), 0.0, 0.0
                if passing[s, a, b] < 1.0:
                    for i in range(max(s - 1, 0), min(s + 2, slices)):
                        for j in range(max(a - 1, 0), min(a + 2, n_a)):
                            share = (1.0 if i == s else 0.5) * (1.0 if j == a else 0.5)
                            for k in range(max(b - 1, 0), min(b + 2, n_b)):
                                more = np.float64(passing[i, j, k]) - np.float64(passing[s, a, b])
                                if more > 0.0:
                                    weight = share * (1.0 if k == b else 0.5) * more**4
                                    gained += weight * (left[i, j, k] - mine)
                                    weights += weight
                out[s, a, b] = mine + gained / max(weights, 1.0)
