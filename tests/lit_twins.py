"""Plain-numpy twins of gradients, Phong's model and shadows, written from `optics.lighting`."""

import numpy as np


def trilinear(data, place):
    """data[c, b, a] at a place (a, b, c), clamped to the voxels."""
    place = np.clip(place, 0, np.array(data.shape[::-1]) - 1.0)
    cell = np.minimum(place.astype(int), np.array(data.shape[::-1]) - 2)
    x, y, z = ([1 - w, w] for w in place - cell)
    part = data[tuple(slice(c, c + 2) for c in cell[::-1])].astype(float)
    return np.einsum("zyx,z,y,x->", part, z, y, x)


def slopes(data, place, reach):
    """Central differences a voxel along each axis; neighbours beyond the voxels lie where they end."""
    found = []
    for axis in range(3):
        last = data.shape[2 - axis] - 1.0
        low, high = max(place[axis] - reach, 0), min(place[axis] + reach, last)
        ends = []
        for at in (low, high):
            moved = np.array(place, float)
            moved[axis] = at
            ends.append(trilinear(data, moved))
        found.append((ends[1] - ends[0]) / (high - low))
    found = np.array(found)
    return found if np.isfinite(found).all() else np.zeros(3)


def phong(lighting, gradient, sight, floor, tint=1.0, left=None):
    """(factor of the colour, what is added) for a gradient and the direction to the eye, both world."""
    if lighting is None:
        return np.full(3, tint), np.zeros(3)
    left = np.ones(len(lighting.lights)) if left is None else left
    square = gradient @ gradient
    normal = -gradient / np.sqrt(square + floor**2)
    facing = normal @ sight
    if lighting.two_sided and facing < 0:
        normal, facing = -normal, -facing
    factor = np.full(3, lighting.emissive + lighting.ambient)
    shine = np.zeros(3)
    lights = [(sight, lighting.headlight, 1.0)]
    lights += [
        (light.direction, light.colour, part) for light, part in zip(lighting.lights, left, strict=True)
    ]
    for towards, colour, part in lights:
        towards, colour = np.array(towards), np.array(colour)
        factor = factor + lighting.diffuse * part * max(normal @ towards, 0) * colour
        mirrored = 2 * facing * normal - normal @ normal * sight
        glance = mirrored @ towards
        if lighting.model == "blinn":
            glance = normal @ (towards + sight) / np.linalg.norm(towards + sight)
        if facing > 0 and glance > 0:
            shine = shine + lighting.specular * part * glance**lighting.power * colour
    return factor * tint, shine


def thickness(modulation, magnitude, largest):
    """(factor of the extinction, factor of the colour before it is lit)."""
    if modulation is None:
        return 1.0, 1.0
    weight = np.clip((magnitude / largest - modulation.low) / (modulation.high - modulation.low), 0, 1)
    return (
        1 - modulation.opacity + modulation.opacity * weight,
        1 - modulation.colour + modulation.colour * weight,
    )


def swept(extinction, from_end, shift, length):
    """What is left of a light at [slice, a, b]: trapezoid between slices, bilinear where a ray meets one."""
    slices, n_a, n_b = extinction.shape
    left = np.ones(extinction.shape)
    order = range(slices - 1, -1, -1) if from_end else range(slices)
    before = None
    for s in order:
        for a, b in np.ndindex(n_a, n_b):
            if before is None:
                continue
            after = 1.0
            for place, step, last in zip((a, b), shift, (n_a - 1, n_b - 1), strict=True):
                if step:
                    after = min(after, (last - place) / step if step > 0 else place / -step)
            if after < 1:
                left[s, a, b] = np.exp(-extinction[s, a, b] * length * after)
                continue
            plane = (left[before] * np.exp(-extinction[before] * length / 2))[None].repeat(2, 0)
            came = trilinear(plane, (b + shift[1], a + shift[0], 0))
            left[s, a, b] = came * np.exp(-extinction[s, a, b] * length / 2)
        before = s
    return left


def coarse(extinction, factor, length):
    """Extinctions [z, y, x] around every `factor`-th voxel, whose part of light that passes `length` is the
    mean of the voxels' parts, weighed by a tent that reaches to the next."""
    passing = np.exp(-length * extinction)
    for axis in range(3):
        n = passing.shape[axis]
        count = -(-(n - 1) // factor) + 1
        distance = np.abs(np.arange(count)[:, None] * factor - np.arange(n))
        weights = np.maximum(factor - distance, 0).astype(float)
        weights /= weights.sum(1, keepdims=True)
        passing = np.moveaxis(np.tensordot(weights, passing, (1, axis)), 0, axis)
    return -np.log(passing) / length


def beside(left, passing):
    """Each voxel's light, replaced in part by that of neighbours that more light passes."""
    result = left.copy()
    for place in np.ndindex(left.shape):
        weights, gained = 0.0, 0.0
        for step in np.ndindex(3, 3, 3):
            other = tuple(np.array(place) + step - 1)
            if min(other) < 0 or any(np.array(other) >= left.shape):
                continue
            more = max(passing[other] - passing[place], 0)
            weight = 0.5 ** np.abs(np.array(step) - 1).sum() * more**4
            weights += weight
            gained += weight * left[other]
        if weights > 0:
            share = min(weights, 1)
            result[place] += share * (gained / weights - left[place])
    return result
