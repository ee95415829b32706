"""Where the eye images lie in depth, for heads that move on: measured once in a while, and kept."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

import persp_sw as psw

# Measuring takes as long as a small image; so once in so many images of an eye,
_EVERY = 30
# or when it has moved by more than this part of the depth (along an axis, in voxels), or sees something else.
_MOVED = 0.05


# Images after which another clip plane counts: a dragged one is another in each frame.
_CLIPPED = 5


@dataclass
class _Known:
    """A depth; where it was measured, of which faces and regions; how many images ago."""

    depth: float
    eye: np.ndarray
    faces: frozenset[tuple[int, int]]
    regions: psw.Regions
    images: int


class KeptDepths:
    """Composites eye images of `Settings.depth_slabs` 1 without measuring the depth anew each time.

    Parameters
    ----------
    renderer
        Its settings are taken as they are at each call, and left so.
    """

    def __init__(self, renderer: psw.Renderer):
        self._renderer = renderer
        self._known: dict[str, _Known] = {}

    def composite(self, name: str, eye: psw.Eye, make: Callable[[], psw.EyeImage]) -> psw.EyeImage:
        """What `make` composites for the eye of that name, with a depth where settings ask for one."""
        settings, known = self._renderer.settings, self._known.get(name)
        if settings.depth_slabs != 1:
            return make()
        if known is None or known.images >= _EVERY or self._is_elsewhere(known, eye):
            return self._measured(name, eye, make)
        self._renderer.settings = replace(settings, depth_slabs=0)
        try:
            image = make()
        finally:
            self._renderer.settings = settings
        known.images = _EVERY if _faces(image) != known.faces else known.images + 1
        return replace(image, depth=known.depth) if image.faces else image

    def _measured(self, name: str, eye: psw.Eye, make: Callable[[], psw.EyeImage]) -> psw.EyeImage:
        due = name in self._known and self._known[name].images >= _EVERY
        image = make()
        if image.depth is None:  # it shows nothing
            self._known.pop(name, None)
            return image
        known = _Known(image.depth, eye.position, _faces(image), self._renderer.regions, 0)
        self._known[name] = known
        if not due:  # both eyes at once, that is; the next time they take turns
            known.images = list(self._known).index(name) * (_EVERY // 2)
        return image

    def _is_elsewhere(self, known: _Known, eye: psw.Eye) -> bool:
        if known.regions is not self._renderer.regions and known.images >= _CLIPPED:
            return True
        linear = self._renderer.volume.world_from_object[:3, :3]
        shift = np.linalg.solve(linear, eye.position - known.eye)
        return bool(np.abs(shift).max() > _MOVED * known.depth)


def _faces(image: psw.EyeImage) -> frozenset[tuple[int, int]]:
    return frozenset((face.axis, face.sign) for face in image.faces)
