"""How much of a directional light reaches each voxel: extinction, coarsened, swept slice by slice."""

import numpy as np

from .._jit import kernel, parallel_kernel, prange
from .dense import magnitude_at
from .phong import LOW, MAGNITUDES, NORMAL_FROM_SLOPES, PER_MAGNITUDE, PER_WEIGHT, REACH, ROWS, THICKENED


@parallel_kernel
def coarse_extinction(voxels, rows, origin, scale, last, numbers, factor, out):
    """Mean extinction around every `factor`-th voxel along each axis, by a tent that reaches to the next.

    Parameters
    ----------
    voxels
        [z, y, x]; NaN has no extinction.
    rows, origin, scale, last
        A table's rows, how values find them, and the last row of one magnitude.
    numbers
        Those of a `phong.Shade` for the axes x, y, z, as float64.
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
                    extinction = 0.0
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
                        extinction = rows[row, 3] * thicker
                    i, weight_x = x // factor, x % factor
                    for b in range(2):
                        w_y = weight_z * (weight_y if b else factor - weight_y)
                        if w_y == 0:
                            continue
                        plane[j + b, i] += w_y * (factor - weight_x) * extinction
                        weights[j + b, i] += w_y * (factor - weight_x)
                        if weight_x > 0:
                            plane[j + b, i + 1] += w_y * weight_x * extinction
                            weights[j + b, i + 1] += w_y * weight_x
        for j in range(out.shape[1]):
            for i in range(out.shape[2]):
                out[k, j, i] = plane[j, i] / weights[j, i] if weights[j, i] > 0.0 else 0.0


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
