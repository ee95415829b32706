"""What of a box an eye sees through its walls, and how finely: the bounds that faces are planned from.

Compiled, because planning in numpy took 24 ms for four walls around an eye inside, more than compositing.
Direction n is principal axis a = n // 2, downwards if n is even, upwards if odd; its axes i, j, k are the
object axes a + 1, a + 2 and a, modulo 3.
"""

import numpy as np

from .._jit import kernel

# A side's four corners, one more for each plane of a window and of a pyramid; as many again for rounding.
MAX_CORNERS = 24

# Columns of `bounds`.
COUNT, LOW_I, HIGH_I, LOW_J, HIGH_J, NEAREST, FARTHEST, STEEPEST, SUM_X, SUM_Y, SUM_Z = range(11)
BOUND_COLUMNS = 11
WHOLE, OWN = 0, 1


@kernel
def _clip(polygon, count, normal_x, normal_y, normal_z, out):
    """The part of a convex polygon where n·p ≥ 0 (Sutherland, Hodgman 1974); returns its corners' number."""
    kept = 0
    for a in range(count):
        b = a + 1 if a + 1 < count else 0
        at_a = normal_x * polygon[a, 0] + normal_y * polygon[a, 1] + normal_z * polygon[a, 2]
        at_b = normal_x * polygon[b, 0] + normal_y * polygon[b, 1] + normal_z * polygon[b, 2]
        if at_a >= 0.0 and kept < MAX_CORNERS:
            out[kept] = polygon[a]
            kept += 1
        if (at_a >= 0.0) != (at_b >= 0.0) and kept < MAX_CORNERS:
            share = at_a / (at_a - at_b)
            for c in range(3):
                out[kept, c] = polygon[a, c] + (polygon[b, c] - polygon[a, c]) * share
            kept += 1
    return kept


@kernel
def _include(polygon, count, direction, metric, bounds):
    """Widen the bounds of one direction by a polygon's corners."""
    k = direction // 2
    i, j = (k + 1) % 3, (k + 2) % 3
    sign = 1.0 if direction % 2 else -1.0
    for a in range(count):
        distance = sign * polygon[a, k]
        bounds[NEAREST] = min(bounds[NEAREST], distance)
        bounds[FARTHEST] = max(bounds[FARTHEST], distance)
        if distance <= 0.0:
            continue
        bounds[COUNT] += 1.0
        t_i, t_j = polygon[a, i] / distance, polygon[a, j] / distance
        bounds[LOW_I], bounds[HIGH_I] = min(bounds[LOW_I], t_i), max(bounds[HIGH_I], t_i)
        bounds[LOW_J], bounds[HIGH_J] = min(bounds[LOW_J], t_j), max(bounds[HIGH_J], t_j)
        squared = 0.0
        for c in range(3):
            bounds[SUM_X + c] += polygon[a, c]
            for d in range(3):
                squared += metric[c, d] * polygon[a, c] * polygon[a, d]
        bounds[STEEPEST] = max(bounds[STEEPEST], np.sqrt(squared) / distance)


@kernel
def bound_sight(sides, windows, metric, reach, polygon, spare, bounds):
    """Bounds, in each of six directions, of what each window shows of some convex polygons.

    Parameters
    ----------
    sides
        float64 (n, 4, 3): corners of the box's sides, relative to the eye.
    windows
        float64 (views, 4, 3): inward normals of the planes through the eye and a wall's edges.
    metric
        float64 (3, 3), AᵀA of the linear part A of world_from_object.
    reach
        Up to which tangents rays count as a direction's own, ≥ 1; at 1 each ray is one direction's.
    polygon, spare
        float64 (MAX_CORNERS, 3): scratch.
    bounds
        float64 (views, 6, 2, BOUND_COLUMNS), overwritten, for all that is seen and for the direction's own
        rays: number of corners before the eye; their least and largest
        tangents t_i and t_j; least and largest distance D of all corners; largest world length of a ray
        to a corner, in units of D; sum of the corners before the eye.
    """
    for view in range(windows.shape[0]):
        for direction in range(6):
            for which in range(2):
                bound = bounds[view, direction, which]
                bound[:] = 0.0
                bound[LOW_I] = bound[LOW_J] = bound[NEAREST] = np.inf
                bound[HIGH_I] = bound[HIGH_J] = bound[FARTHEST] = -np.inf
        for s in range(sides.shape[0]):
            for direction in range(-1, 6):
                polygon[:4] = sides[s]
                count = 4
                for edge in range(4):
                    normal = windows[view, edge]
                    count = _clip(polygon, count, normal[0], normal[1], normal[2], spare)
                    polygon[:count] = spare[:count]
                if count == 0:
                    break
                if direction < 0:
                    for each in range(6):
                        _include(polygon, count, each, metric, bounds[view, each, WHOLE])
                    continue
                k = direction // 2
                sign = 1.0 if direction % 2 else -1.0
                for across in range(1, 3):
                    for side in range(2):
                        c = (k + across) % 3
                        towards = 1.0 if side else -1.0
                        normal_x = sign * reach if k == 0 else towards if c == 0 else 0.0
                        normal_y = sign * reach if k == 1 else towards if c == 1 else 0.0
                        normal_z = sign * reach if k == 2 else towards if c == 2 else 0.0
                        count = _clip(polygon, count, normal_x, normal_y, normal_z, spare)
                        polygon[:count] = spare[:count]
                _include(polygon, count, direction, metric, bounds[view, direction, OWN])


@kernel
def _part_in_box(low, high, x, y, z):
    """How much of the ray from the origin along (x, y, z), up to where it leaves the box, is in it: 0 … 1."""
    near, far = 0.0, np.inf
    for c in range(3):
        along = x if c == 0 else y if c == 1 else z
        if along == 0.0:
            if low[c] > 0.0 or high[c] < 0.0:
                return 0.0
            continue
        one, other = low[c] / along, high[c] / along
        near, far = max(near, min(one, other)), min(far, max(one, other))
    return 1.0 - near / far if near < far else 0.0


@kernel
def _pixel_size(matrix, direction, x, y, z):
    """Smaller singular value of ∂t/∂pixel, tangents in a direction, of the ray (x, y, z) = matrix · pixel."""
    k = direction // 2
    i, j = (k + 1) % 3, (k + 2) % 3
    sign = 1.0 if direction % 2 else -1.0
    along = sign * (x if k == 0 else y if k == 1 else z)
    t_i = (x if i == 0 else y if i == 1 else z) / along
    t_j = (x if j == 0 else y if j == 1 else z) / along
    a = (matrix[i, 0] - t_i * sign * matrix[k, 0]) / along
    b = (matrix[i, 1] - t_i * sign * matrix[k, 1]) / along
    c = (matrix[j, 0] - t_j * sign * matrix[k, 0]) / along
    d = (matrix[j, 1] - t_j * sign * matrix[k, 1]) / along
    squares, determinant = a * a + b * b + c * c + d * d, abs(a * d - b * c)
    largest = np.sqrt(
        0.5 * (squares + np.sqrt(max(squares * squares - 4.0 * determinant * determinant, 0.0)))
    )
    return determinant / largest if largest > 0.0 else 0.0


@kernel
def _quantile(values, weights, quantile):
    """Of weighted values; linear between the middles of their weights."""
    order = np.argsort(values)
    wanted = quantile * weights.sum()
    passed, before = 0.0, values[order[0]]
    middle_before = 0.0
    for at in order:
        middle = passed + 0.5 * weights[at]
        if middle >= wanted:
            if middle <= middle_before:
                return values[at]
            part = (wanted - middle_before) / (middle - middle_before)
            return before + part * (values[at] - before)
        passed, before, middle_before = passed + weights[at], values[at], middle
    return before


@kernel
def measure_pixels(matrices, sizes, low, high, only, reach, quantile, middles, values, weights, counts, out):
    """How finely each view shows the box in each direction: a low quantile over a grid of its pixels.

    Pixels count by how much of their ray is in the box, and fade out beyond a direction's own rays: so the
    quantile has no steps where a pixel of the grid leaves either.

    Parameters
    ----------
    matrices
        float64 (views, 3, 3): direction of the ray through pixel point (column, row, 1), from the eye.
    sizes
        float64 (views, 2): width and height in pixels.
    low, high
        float64 (3,): the box, relative to the eye.
    only
        The direction whose face shows all rays; −1 where each ray is that of the direction whose own it is.
    reach
        > 1: see `bound_sight`.
    quantile
        0 … 1.
    middles
        float64 (views, 6, 3): a ray to the middle of what is seen in each direction, taken where no pixel of
        the grid shows the box; zeros where nothing is seen.
    values, weights, counts
        float64 (6, grid²) twice, and int64 (6,): scratch.
    out
        float64 (views, 6), overwritten: the smaller singular value of ∂t/∂pixel; 0 where nothing is seen.
    """
    grid = np.int64(np.sqrt(values.shape[1]) + 0.5)
    least = 1.0 / reach
    for view in range(matrices.shape[0]):
        m = matrices[view]
        counts[:] = 0
        for v in range(grid):
            row = (v + 0.5) / grid * sizes[view, 1]
            for u in range(grid):
                column = (u + 0.5) / grid * sizes[view, 0]
                x = m[0, 0] * column + m[0, 1] * row + m[0, 2]
                y = m[1, 0] * column + m[1, 1] * row + m[1, 2]
                z = m[2, 0] * column + m[2, 1] * row + m[2, 2]
                inside = _part_in_box(low, high, x, y, z)
                if inside <= 0.0:
                    continue
                largest = max(abs(x), abs(y), abs(z))
                for k in range(3):
                    along = x if k == 0 else y if k == 1 else z
                    direction = 2 * k + (1 if along > 0.0 else 0)
                    if only < 0:
                        weight = inside * (abs(along) / largest - least)
                    else:
                        weight = inside if direction == only and along != 0.0 else 0.0
                    if weight > 0.0:
                        values[direction, counts[direction]] = _pixel_size(m, direction, x, y, z)
                        weights[direction, counts[direction]] = weight
                        counts[direction] += 1
        for direction in range(6):
            n = counts[direction]
            x, y, z = middles[view, direction]
            out[view, direction] = 0.0
            if n > 0:
                out[view, direction] = _quantile(values[direction, :n], weights[direction, :n], quantile)
            elif x != 0.0 or y != 0.0 or z != 0.0:
                out[view, direction] = _pixel_size(m, direction, x, y, z)
