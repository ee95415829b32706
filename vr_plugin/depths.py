"""Where the eye images lie in depth, for heads that move on: measured once in a while, and kept."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

import persp_sw as psw

# Measuring takes as long as a small image; so once in so many images of an eye,
_EVERY = 30
# or when it has moved by more than this part of the depth (along an axis, in voxels).
_MOVED = 0.05


@dataclass
class _Known:
    depth: float
    eye: np.ndarray  # world position it was measured for
    images: int  # since


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
        if known is None or known.images >= _EVERY or self._moved(known, eye):
            image = make()
            if image.depth is None:  # it shows nothing
                self._known.pop(name, None)
            else:
                # Eyes that begin together take turns afterwards: no frame measures both.
                begun = 0 if known else len(self._known) * (_EVERY // 2)
                self._known[name] = _Known(image.depth, eye.position, begun)
            return image
        self._renderer.settings = replace(settings, depth_slabs=0)
        try:
            image = make()
        finally:
            self._renderer.settings = settings
        known.images += 1
        return replace(image, depth=known.depth) if image.faces else image

    def _moved(self, known: _Known, eye: psw.Eye) -> bool:
        linear = self._renderer.volume.world_from_object[:3, :3]
        shift = np.linalg.solve(linear, eye.position - known.eye)
        return bool(np.abs(shift).max() > _MOVED * known.depth)
