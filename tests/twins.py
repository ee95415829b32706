"""Plain-numpy twins of the kernels: slow, obvious, and written from the formulas, not from the kernels."""

import numpy as np

BLOCK = 4
WORD = 64


def block_bounds(rows):
    """(low, high) [n_j − 1, n_k, blocks] of voxels 4m … 4m + 4 of scanlines j and j + 1, NaN left out."""
    n_j, n_k, n_i = rows.shape
    blocks = -(-(n_i - 1) // BLOCK)
    low, high = np.empty((2, n_j - 1, n_k, blocks))
    for m in range(blocks):
        part = rows[:, :, BLOCK * m : BLOCK * m + BLOCK + 1].astype(float)
        smallest = np.where(np.isnan(part), np.inf, part).min(-1)
        largest = np.where(np.isnan(part), -np.inf, part).max(-1)
        low[..., m] = np.minimum(smallest[:-1], smallest[1:])
        high[..., m] = np.maximum(largest[:-1], largest[1:])
    return low, high


def brick_bounds(data):
    """(low, high) [z, y, x] of bricks of 4³ cells, voxels 4m … 4m + 4 along each axis, NaN left out."""
    counts = [-(-(n - 1) // BLOCK) for n in data.shape]
    low, high = np.empty((2, *counts))
    for brick in np.ndindex(*counts):
        voxels = data[tuple(slice(BLOCK * m, BLOCK * m + BLOCK + 1) for m in brick)].astype(float)
        low[brick] = np.where(np.isnan(voxels), np.inf, voxels).min()
        high[brick] = np.where(np.isnan(voxels), -np.inf, voxels).max()
    return low, high


def entries(values, origin, scale, last):
    """Table row of each value: nearest entry, 1 … last."""
    return np.clip(np.floor((values - origin) * scale + 1.5), 1, last).astype(int)


def visible_blocks(low, high, table, origin, scale, largest=None):
    """Whether an entry from that of `low` to that of `high` has extinction, values a rounding wider.

    `largest`: magnitude of values that float32 rounds; of the bounds themselves where not given.
    """
    last = len(table) - 1
    result = np.zeros(low.shape, bool)
    largest = max(np.abs(low).max(), np.abs(high).max()) if largest is None else largest
    rounding = 0.01 / scale + 1e-6 * largest if scale else 0
    for index in np.ndindex(low.shape):
        if low[index] <= high[index]:
            first = entries(low[index] - rounding, origin, scale, last)
            end = entries(high[index] + rounding, origin, scale, last)
            result[index] = (table[first : end + 1, 3] > 0).any()
    return result


def stored_voxels(visible, shape, pairs):
    """bool [j, k, i]: the voxels that a visible block touches."""
    stored = np.zeros(shape, bool)
    for j, k, m in zip(*np.nonzero(visible), strict=True):
        stored[j : j + 2, k : k + (2 if pairs else 1), BLOCK * m : BLOCK * m + BLOCK + 1] = True
    return stored


def bits(words, blocks):
    """bool [..., blocks] of packed words."""
    m = np.arange(blocks)
    return (words[..., m // WORD] >> (m % WORD).astype(np.uint64)) & np.uint64(1) != 0


def halving(n, far):
    """[coarse, n] weights of one axis of n voxels whose box ends at `far`, from what they must do.

    A coarse voxel is the mean of the interpolant over [2m − 1, 2m + 1] in the box; the last is what makes the
    mean over the box right.
    """

    def integral(values, begin, end):
        """∫ of the linear interpolant of the values: it is linear between the knots."""
        knots = np.unique(np.clip([begin, *range(len(values)), end], begin, end))
        at = np.interp(knots, range(len(values)), values)
        return ((at[1:] + at[:-1]) / 2 * np.diff(knots)).sum()

    count = int(np.ceil(far / 2)) + 1
    weights = np.zeros((count, n))
    for voxel, unit in enumerate(np.eye(n)):
        for m in range(count - 1):
            begin, end = max(2 * m - 1, 0), min(2 * m + 1, far)
            weights[m, voxel] = integral(unit, begin, end) / (end - begin)
        without_last = 2 * integral(weights[:, voxel], 0, far / 2)
        of_last = 2 * integral(np.eye(count)[-1], 0, far / 2)
        weights[-1, voxel] = (integral(unit, 0, far) - without_last) / of_last
    return weights


def coarsen(data, weights):
    """Weighted means [z, y, x], NaN left out; `weights` for x, y, z, each [coarse, fine]."""
    there = ~np.isnan(data)
    x, y, z = weights
    means = np.einsum("Zz,Yy,Xx,zyx->ZYX", z, y, x, np.where(there, data, 0.0), optimize=True)
    shares = np.einsum("Zz,Yy,Xx,zyx->ZYX", z, y, x, there.astype(float), optimize=True)
    return np.divide(means, shares, out=np.full(means.shape, np.nan), where=shares > 1e-12)


def ray_range(face, half_spaces, metric):
    """(near, far, world length a slice interval) of the ray `face`, near ≥ far: none."""
    e, sign, t, near_world = np.array(face[:3]), face[3], np.array(face[4:6]), face[6]
    direction = np.array([*t, sign])
    length = np.sqrt(direction @ metric @ direction)
    near, far = near_world / length, np.inf
    for *a, a_0 in half_spaces:
        at_eye, slope = np.dot(a, e) + a_0, np.dot(a, direction)
        if slope > 0:
            near = max(near, -at_eye / slope)
        elif slope < 0:
            far = min(far, -at_eye / slope)
        elif at_eye < 0:
            near = np.inf
    return near, far, length


def composite_pixel(
    rows, face, box, half_spaces, metric, per_interval, table, origin, scale, residual, lit=None
):
    """One pixel of a face, float64: `face` = (eye i j k, sign, t_i, t_j, near). rows [j, k, i].

    `lit`: given a sample's place (i, j, k), what light makes of it; see `lit_twins`.
    """
    e, sign, t = np.array(face[:3]), face[3], np.array(face[4:6])
    near, far, length = ray_range(face, half_spaces, metric)
    n_j, n_k, n_i = rows.shape
    planes = np.arange((n_k - 1) * per_interval + 1)
    result = np.zeros(4)
    for q in planes if sign > 0 else planes[::-1]:
        k = q / per_interval
        # Simpson's weights 1 4 1, 2 … of the interval, halved to both sides; alone, a slice stands for all.
        half = 1 / 2 if per_interval == 1 else (1 if q % 2 == 0 else 2) / (3 * per_interval)
        distance = sign * (k - e[2])
        weight = min(distance + half, far) - max(distance - half, near)
        if weight <= 0:
            continue
        i, j = np.clip(e[:2] + t * distance, box[[0, 2]], box[[1, 3]])
        i0, j0, k0 = min(int(i), n_i - 2), min(int(j), n_j - 2), min(int(k), n_k - 2)
        cell = rows[j0 : j0 + 2, k0 : k0 + 2, i0 : i0 + 2].astype(float)
        if k == k0:
            cell = cell[:, 0]
        elif k == k0 + 1:
            cell = cell[:, 1]
        else:
            cell = cell[:, 0] + (k - k0) * (cell[:, 1] - cell[:, 0])
        row = cell[0] + (j - j0) * (cell[1] - cell[0])
        value = row[0] + (i - i0) * (row[1] - row[0])
        if np.isnan(value):
            continue
        entry = entries(value, origin, scale, len(table) - 1)
        if lit:
            colour, tau = lit((i, j, k), entry)
        else:
            *colour, tau = table[entry].astype(float)
        share = (1 - result[3]) * -np.expm1(-tau * length * weight)
        result += share * np.array([*colour, 1])
        if residual and result[3] >= 1 - residual:
            break
    return result


def preintegrated_pixel(rows, face, box, half_spaces, metric, per_interval, table, origin, scale, lit=None):
    """As `composite_pixel`, pre-integrated: a piece's opacity is that of the mean of the table's rows between
    its ends', its colour the mean, weighted by extinction, over the first part of them (see `seen_part`).

    `lit`: given the place (i, j, k) where the mean of what is seen of a piece lies, and its colour, what
    light makes of it.
    """
    e, sign, t = np.array(face[:3]), face[3], np.array(face[4:6])
    near, far, length = ray_range(face, half_spaces, metric)
    result = np.zeros(4)
    pieces = (np.arange((rows.shape[1] - 1) * per_interval) + 0.5) / per_interval
    for k in pieces if sign > 0 else pieces[::-1]:
        distance, half = sign * (k - e[2]), 0.5 / per_interval
        begin, end = max(distance - half, near), min(distance + half, far)
        if begin >= end:
            continue
        ahead = max(distance, 0.0)
        i, j = e[:2] + t * ahead
        i0, j0 = np.floor(np.clip([i, j], box[[0, 2]], box[[1, 3]])).astype(int)
        i0, j0, k0 = min(i0, int(np.ceil(box[1])) - 1), min(j0, int(np.ceil(box[3])) - 1), int(k)
        cell = rows[j0 : j0 + 2, k0 : k0 + 2, i0 : i0 + 2].astype(float)
        if np.isnan(cell).any():
            continue

        def scalar(i, j, k, cell=cell, i0=i0, j0=j0, k0=k0):
            weights = [np.array([1 - w, w]) for w in (j - j0, k - k0, i - i0)]
            return np.einsum("jki,j,k,i->", cell, *weights)

        at = np.array([i, j, e[2] + sign * ahead])
        gradient = [
            (scalar(*(at + d)) - scalar(*(at - d))) / 2 for d in np.eye(3)
        ]  # exact: it is multilinear
        ends = scalar(*at) + np.dot(gradient, [*t, sign]) * (np.array([begin, end]) - ahead)
        rising = ends[1] >= ends[0]
        ends = np.clip(np.sort(ends), cell.min(), cell.max())
        first, last = np.floor((ends - origin) * scale + 1.5).astype(int)
        covered = table[np.clip(np.arange(first, last + 1), 1, len(table) - 1)].astype(float)
        depth = covered[:, 3].mean() * length * (end - begin)
        if depth:
            covered = covered if rising else covered[::-1]
            colour = seen_part(covered, depth) @ covered[:, :3]
            if lit:
                hit = begin + (end - begin) * hit_place(covered[:, 3], depth)
                colour = lit(e + np.array([*t, sign]) * hit, (i0, j0, k0), colour)
            result += (1 - result[3]) * -np.expm1(-depth) * np.array([*colour, 1])
    return result


def mean_depth(depth):
    """The optical depth, as a share of all, where exp(−x) has its mean place, x = 0 … depth."""
    return 0.5 - depth / 12 if depth < 1e-3 else 1 / depth - 1 / np.expm1(depth)


def seen_part(rows, depth):
    """Shares of rows (r, g, b, τ), front to back, in a piece's colour: parts of their extinction, in all 1.

    So many from the front that their mean place is where exp(−x) has it.
    """
    passed = np.concatenate([[0], np.cumsum(rows[:, 3])])
    taken = np.clip(passed[-1] * 2 * mean_depth(depth) - passed[:-1], 0, rows[:, 3])
    return taken / taken.sum()


def hit_place(extinctions, depth):
    """Where along a piece, 0 … 1, the mean place of what is seen of it lies; rows front to back."""
    passed = np.concatenate([[0], np.cumsum(extinctions)])
    wanted = passed[-1] * mean_depth(depth)
    row = np.searchsorted(passed, wanted, side="right") - 1
    return (row + (wanted - passed[row]) / extinctions[row]) / len(extinctions)


def warp_pixel(direction, faces, alone):
    """An object-space direction looked up in `faces`: list of (axes, sign, origin, pitch, image).

    A single one shows all rays. Each of several counts by how much of the largest component is along its own
    axis, beyond the share `alone`.
    """
    total, counted = np.zeros(4), 0.0
    for (i, j, k), sign, origin, pitch, image in faces:
        along = sign * direction[k]
        count = 1.0 if len(faces) == 1 else along / np.abs(direction).max() - alone
        if along <= 0 or count <= 0:
            continue
        u, v = (np.array([direction[i], direction[j]]) / along - origin) / pitch - 0.5
        height, width = image.shape[:2]
        if not (0 <= u <= width - 1 and 0 <= v <= height - 1):
            continue
        left, top = min(int(u), width - 2), min(int(v), height - 2)
        weights = np.outer([1 - (v - top), v - top], [1 - (u - left), u - left])
        total += count * np.einsum("yx,yxc->c", weights, image[top : top + 2, left : left + 2].astype(float))
        counted += count
    return total / counted if counted else total


def clip_polygon(polygon, normals):
    """The part of a convex polygon where n·p ≥ 0 for all normals (Sutherland, Hodgman 1974)."""
    for normal in normals:
        inside = polygon @ normal
        kept = []
        for a, b, da, db in zip(
            polygon, np.roll(polygon, -1, axis=0), inside, np.roll(inside, -1), strict=True
        ):
            if da >= 0:
                kept.append(a)
            if (da >= 0) != (db >= 0):
                kept.append(a + (b - a) * (da / (da - db)))
        polygon = np.array(kept).reshape(-1, 3)
    return polygon


def pyramid_normals(axis, sign, reach):
    """Inward normals of the rays with tangents up to `reach` in a direction, `sign` along `axis`."""
    normals = []
    for other in ((axis + 1) % 3, (axis + 2) % 3):
        for towards in (-1, 1):
            normal = np.zeros(3)
            normal[axis], normal[other] = sign * reach, towards
            normals.append(normal)
    return np.array(normals)


def seen_corners(sides, matrix, size):
    """Corners of polygons' parts inside a window whose pixel (column, row, 1) looks along `matrix` · it."""
    width, height = size
    corners = np.array([[0, 0, 1], [width, 0, 1], [width, height, 1], [0, height, 1]]) @ matrix.T
    normals = np.cross(corners, np.roll(corners, -1, axis=0))
    normals *= np.sign(normals @ (matrix @ (width / 2, height / 2, 1)))[:, None]
    return [part for side in sides if len(part := clip_polygon(side, normals))]


def pixel_sizes(matrix, size, low, high, axis, sign, reach, grid, step=1e-6):
    """∂t/∂pixel's smaller singular value, by differences, and weight of a grid's pixels that show the box.

    `reach`: up to which tangents the direction's own rays fade; None: all rays are shown.
    """
    others = [(axis + 1) % 3, (axis + 2) % 3]
    result = []
    for v, u in np.ndindex(grid, grid):
        pixel = np.array([(u + 0.5) / grid * size[0], (v + 0.5) / grid * size[1], 1])
        ray = matrix @ pixel
        along = sign * ray[axis]
        with np.errstate(divide="ignore", invalid="ignore"):
            planes = np.sort([low / ray, high / ray], axis=0)
        near, far = max(planes[0].max(), 0), planes[1].min()
        weight = 1 - near / far if near < far else 0
        if reach is not None:
            weight *= max(along / np.abs(ray).max() - 1 / reach, 0)
        if along <= 0 or weight == 0:
            continue
        moved = [matrix @ (pixel + step * delta) for delta in np.eye(3)[:2]]
        columns = [(m[others] / (sign * m[axis]) - ray[others] / along) / step for m in moved]
        result.append((np.linalg.svd(np.array(columns).T, compute_uv=False)[-1], weight))
    return result


def weighted_quantile(pairs, quantile):
    """Of (value, weight) pairs, linear between the middles of their weights."""
    values, weights = np.array(sorted(pairs)).T
    passed = np.cumsum(weights) - weights / 2
    return np.interp(quantile * weights.sum(), passed, values)
