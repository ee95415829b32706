"""Count the samples of a ray that matter, slowly and in float64: what a compositor cannot do without."""

import numpy as np

from .._jit import kernel, parallel_kernel, prange
from .dense import value_at

# `face`: float64, see `count_samples`.
E_I, E_J, E_K, SIGN, NEAR, RESIDUAL, OPACITY_UNIT, MAX_OPACITY = range(8)


@kernel
def _opacity(value, points):
    """Piecewise linear, constant beyond the ends; at a step the later point holds; 0 for NaN."""
    last = points.shape[0] - 1
    if value < points[0, 0]:
        return points[0, 1]
    if value >= points[last, 0]:
        return points[last, 1]
    for n in range(last - 1, -1, -1):
        if value >= points[n, 0]:
            weight = (value - points[n, 0]) / (points[n + 1, 0] - points[n, 0])
            return points[n, 1] * (1.0 - weight) + points[n + 1, 1] * weight
    return 0.0


@kernel
def _count_ray(t_i, t_j, steps, length, face, half_spaces, points, rows):
    """Samples of one ray that are visible and not hidden."""
    eye_i, eye_j, eye_k, sign = face[E_I], face[E_J], face[E_K], face[SIGN]
    first, last = face[NEAR] / length, np.inf
    for h in range(half_spaces.shape[0]):
        a, b, c = half_spaces[h, 0], half_spaces[h, 1], half_spaces[h, 2]
        offset = a * eye_i + b * eye_j + c * eye_k + half_spaces[h, 3]
        slope = a * t_i + b * t_j + c * sign
        if slope > 0.0:
            first = max(first, -offset / slope)
        elif slope < 0.0:
            last = min(last, -offset / slope)
        elif offset < 0.0:
            return 0
    if first >= last:
        return 0
    n_k = rows.shape[1]
    base = sign * ((0.0 if sign > 0 else n_k - 1.0) - eye_k)
    half = 0.5 / steps
    transparency, count = 1.0, 0
    for q in range((n_k - 1) * steps + 1):
        distance = base + q / steps
        part = min(distance + half, last) - max(distance - half, first)
        if part <= 0.0:
            continue
        if transparency <= face[RESIDUAL]:
            break
        value = value_at(rows, eye_i + t_i * distance, eye_k + sign * distance, eye_j + t_j * distance)
        opacity = _opacity(value, points)
        if opacity > 0.0:
            count += 1
            per_unit = np.log1p(-min(opacity, face[MAX_OPACITY])) / face[OPACITY_UNIT]
            transparency *= np.exp(per_unit * length * part)
    return count


@parallel_kernel
def count_samples(tangents, steps, lengths, face, half_spaces, points, rows, counts):
    """For each ray, the samples that show something and that nothing before them hides.

    Parameters
    ----------
    tangents
        float64 (n, 2), t_i and t_j.
    steps
        int64 (n,): samples a slice interval.
    lengths
        float64 (n,): world length of a slice interval along the ray.
    face
        float64 [e_i, e_j, e_k, sign, near, residual, opacity_unit, max_opacity]: the eye in standard space,
        which way along k, world distance before which nothing is shown, the transparency that hides, the
        world length that opacities hold for, and what opacities are limited to.
    half_spaces
        float64 (m, 4), standard space: shown where a·(i, j, k) + a_0 ≥ 0 for all.
    points
        float64 (p, 2): value and opacity of the transfer function's control points, ascending.
    rows
        Voxels [j, k, i], at least 2 along each axis.
    counts
        int64 (n,): overwritten.
    """
    for n in prange(len(counts)):
        counts[n] = _count_ray(
            tangents[n, 0], tangents[n, 1], steps[n], lengths[n], face, half_spaces, points, rows
        )
