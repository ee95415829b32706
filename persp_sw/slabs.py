"""Where on their rays an eye image's colours lie, and the image cut into slabs between distances.

A head that has moved sees a point at distance z, shown at D, off by its shift times |1/z − 1/D|. So all is
done in inverse distances: a coarse image is composited in equal steps of them, and slabs are cut at equal
ones, which makes the largest error least, 1/K of one plane's.

Where a slab lies between its cuts is a matter of what can be seen to be wrong. Let Δ_n be what step n adds to
the image, at inverse distance x_n, and the slabs lie at X_k. A small shift s moves step n by s·(x_n − X_k)
too little, so the picture's error is s·Σ_n (x_n − X_k(n))·∇Δ_n: its square, summed over the image, is least
for X from K linear equations. Opacity alone, the obvious weight, puts a ball on its front, where nothing has
an edge that could be seen to move: measured on surfaces 4 to 7 dB worse.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .arrays import Image
from .eye_image import EyeImage
from .geometry.faces import Face
from .geometry.placement import box_between, depth_range
from .kernels.state import TILE

Array = NDArray[np.float64]

# composite(faces, images, nearest, farthest): behind what the images hold; returns the samples taken.
Composite = Callable[[Sequence[Face], Sequence[Image], float, float], int]

# Steps of the look for one plane and for slabs. Each is a call of the kernel a face, some 0.3 ms; four times
# as many for one plane make 0.1 dB; slabs want two of their own, or lie where steps happen to be cut.
_STEPS, _STEPS_FOR_SLABS = 8, 16
_COARSE = 64  # pixels of the longest side of a coarse image
# A step that adds less than this part of the opacity is empty: slabs are cut where there is something.
_EMPTY = 1e-4
# How much slabs are held in their middle, against how much their contrast pulls: only where there is none.
_HELD = 1e-3
# What is hidden is kept where a shift by this part of the nearest depth could uncover it, and else left out.
_UNCOVERED = 1 / 8
# What is seen may be as flat as one plane; steps of depth must not be.
_FLAT = 1e-6
_BLOCK = 8  # pixels; two are a tile


@dataclass(frozen=True, eq=False)
class DepthProfile:
    """What of an eye image lies where.

    Attributes
    ----------
    eye
        Object xyz.
    edges
        (n + 1,) inverse distances, 1 / voxels, falling: the steps, front to back. What lies before the first
        or behind the last is in the first or last step.
    opacity
        (n,) what each step adds to the image's opacity, summed over coarse pixels.
    contrast
        (n, n): Σ ∇Δ_m · ∇Δ_n over coarse pixels and channels.
    samples
        Voxel samples that looking took.
    """

    eye: Array
    edges: Array
    opacity: Array
    contrast: Array
    samples: int

    @classmethod
    def of(cls, image: EyeImage, steps: int, composite: Composite) -> DepthProfile:
        """Measured by compositing a coarse image; of an image with faces, of an eye at a point."""
        eye = np.linalg.solve(image.world_from_object, np.append(image.eye.position, 1))[:3]
        nearest, farthest = depth_range(image.faces, eye, image.box)
        farthest = max(farthest, (1 + _FLAT) * nearest)
        edges = np.linspace(1 / nearest, 1 / farthest, steps + 1)
        coarser = max(max(max(face.size) for face in image.faces) / _COARSE, 1.0)
        faces = [_coarse(face, coarser) for face in image.faces]
        images = [np.zeros((*face.size[::-1], 4), np.float32) for face in faces]
        samples, sums, slopes = 0, [0.0], [_slopes(images)]
        for near, far in _ends(edges):
            samples += composite(faces, images, near, far)
            sums.append(sum(float(pixels[..., 3].sum(dtype=np.float64)) for pixels in images))
            slopes.append(_slopes(images))
        added = np.diff(slopes, axis=0)
        return cls(eye, edges, np.diff(sums), (added @ added.T).astype(np.float64), samples)

    def cuts(self, count: int) -> Array:
        """(count + 1,) falling inverse distances between which slabs lie: equal pieces, no empty ends."""
        held = np.flatnonzero(self.opacity > _EMPTY * self.opacity.sum())
        first, last = (held[0], held[-1]) if len(held) else (0, len(self.opacity) - 1)
        return np.linspace(self.edges[first], self.edges[last + 1], count + 1)

    def depths(self, cuts: Array) -> list[float]:
        """The distance of the slab between each two cuts, front to back; see above. Between its cuts."""
        count, inner = len(cuts) - 1, cuts[1:-1]
        low, high = np.append(inner, -np.inf), np.append(np.inf, inner)
        steps = np.column_stack([self.edges[1:], self.edges[:-1]])
        # Of step n in slab k: where it begins and ends, and how much of the step that is.
        begin, end = (np.clip(side[None], low[:, None], high[:, None]) for side in steps.T)
        share = (end - begin) / (steps[:, 1] - steps[:, 0])
        wanted = (share * (begin + end) / 2).sum(0)
        pulls = share @ self.contrast @ share.T
        held = (_HELD * np.trace(pulls) / count or 1.0) * np.eye(count)
        middles = (cuts[1:] + cuts[:-1]) / 2
        places = np.linalg.solve(pulls + held, share @ self.contrast @ wanted + held @ middles)
        return (1 / np.clip(places, cuts[1:], cuts[:-1])).tolist()


def placed(image: EyeImage, composite: Composite) -> EyeImage:
    """The image, not composited yet, with the depth at which eyes that have moved see it best."""
    profile = DepthProfile.of(image, _STEPS, composite)
    return replace(image, depth=profile.depths(profile.cuts(1))[0], samples=image.samples + profile.samples)


def in_slabs(image: EyeImage, count: int, residual: float, composite: Composite) -> EyeImage:
    """The image composited as slabs, and as a whole, which is what they make one over the other.

    A slab holds what lies in it though it be hidden, near the edges of what hides it: a moved eye sees behind
    them. What is hidden by more than that, to `residual`, is left out.
    """
    profile = DepthProfile.of(image, _STEPS_FOR_SLABS, composite)
    cuts = profile.cuts(count)
    farther = 1 - profile.edges[-1] / profile.edges[0]
    margin = int(np.ceil(_UNCOVERED * farther / image.faces[0].pitch))
    samples, slabs, whole = profile.samples, [], image.pixels
    for (near, far), depth in zip(_ends(cuts), profile.depths(cuts), strict=True):
        box = box_between(image.faces, profile.eye, image.box, near, far)
        slab = replace(image, pixels=np.zeros_like(whole), box=box, depth=depth)
        images = [slab.face_pixels(number) for number in range(len(image.faces))]
        hidden = [_hidden(image.face_pixels(number), residual, margin) for number in range(len(images))]
        for pixels, where in zip(images, hidden, strict=True):
            pixels[where, 3] = 1
        samples += composite(image.faces, images, near, far)
        for pixels, where in zip(images, hidden, strict=True):
            pixels[where] = 0
        whole += (1 - whole[:, 3:]) * slab.pixels
        slabs.append(slab)
    depth = profile.depths(profile.cuts(1))[0]
    return replace(image, depth=depth, samples=image.samples + samples, slabs=tuple(slabs))


def _ends(cuts: Array) -> list[tuple[float, float]]:
    """The distances between which slabs or steps lie: all of them, from the eye to infinity."""
    ends = [0.0, *(1 / cuts[1:-1]).tolist(), np.inf]
    return list(pairwise(ends))


def _coarse(face: Face, factor: float) -> Face:
    """The same rectangle, or a little more, with fewer pixels."""
    width, height = (int(np.ceil(pixels / factor)) for pixels in face.size)
    return replace(face, pitch=face.pitch * factor, size=(-(-width // TILE) * TILE, max(height, 2)))


def _slopes(images: Sequence[Image]) -> Image:
    """Differences of neighbouring pixels of all images, one after the other."""
    pairs = [(p[1:] - p[:-1], p[:, 1:] - p[:, :-1]) for p in images]
    return np.concatenate([slopes.ravel() for pair in pairs for slopes in pair])


def _hidden(pixels: Image, residual: float, margin: int) -> NDArray[np.bool_]:
    """Where a face is opaque, and so is all that is up to `margin` pixels away; outside of it nothing is.

    Decided for blocks of pixels at once, so a little less than that.
    """
    height, width = pixels.shape[:2]
    reach = -(-margin // _BLOCK)
    rows, columns = -(-height // _BLOCK), -(-width // _BLOCK)
    seen = np.ones((rows * _BLOCK, columns * _BLOCK), bool)
    seen[:height, :width] = pixels[..., 3] < 1 - residual
    if seen.all():
        return np.zeros((height, width), bool)
    blocks = seen.reshape(rows, _BLOCK, columns * _BLOCK).any(1).reshape(rows, columns, _BLOCK).any(2)
    counts = np.pad(blocks, ((reach + 1, reach), (reach + 1, reach)), constant_values=True)
    counts[0] = counts[:, 0] = False
    counts = counts.cumsum(0).cumsum(1)
    size = 2 * reach + 1
    near = counts[size:, size:] - counts[:-size, size:] - counts[size:, :-size] + counts[:-size, :-size]
    return np.repeat(np.repeat(near == 0, _BLOCK, 0), _BLOCK, 1)[:height, :width]
