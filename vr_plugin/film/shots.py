"""One frame of a film: what a camera sees, in mono or stereo, as people see it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import persp_sw as psw

from ..cameras import Camera
from ..stereo import StereoError, combine, eye_size, eyes_of

# Those that are one picture; `stereo.MODES` has more.
LAYOUTS = ("mono", "left", "right", "side_by_side", "top_bottom", "interlaced", "anaglyph")


@dataclass(frozen=True, eq=False)
class Shot:
    """How frames are taken.

    Parameters
    ----------
    size
        Width and height of a frame, pixels. Side by side and top–bottom squeeze each eye's picture into half
        of it, as displays for them stretch it again.
    layout
        One of `LAYOUTS`.
    separation
        Of the eyes, as a share of the distance to the pivot, which both see in one place.
    background
        (3,) linear, behind the volume.
    near
        World units before the eyes in which nothing is shown.
    parallel
        Parallel projection, along the camera's axis.

    Raises
    ------
    StereoError
        Another layout, or two eyes at infinity.
    """

    size: tuple[int, int]
    layout: str = "mono"
    separation: float = 1 / 30
    background: tuple[float, float, float] = (0.0, 0.0, 0.0)
    near: float = 0.0
    parallel: bool = False

    def __post_init__(self):
        if self.layout not in LAYOUTS:
            raise StereoError(f"a film is {', '.join(LAYOUTS)}; given {self.layout!r}")
        if self.parallel and self.layout != "mono":
            raise StereoError("eyes at infinity see no depth: a parallel projection is filmed in mono")

    def views(self, camera: Camera) -> dict[str, psw.View]:
        """The views whose pictures make a frame, by the names of their eyes."""
        wall = camera.wall(self.size)
        pixels = eye_size(self.layout, self.size)
        wall = psw.Wall(wall.lower_left, wall.lower_right, wall.upper_left, pixels, wall.name)
        if self.parallel:
            return {"middle": psw.View.through_wall(psw.Eye.at_infinity(camera.axes[2]), wall)}
        left, right = camera.eyes(self.separation)
        places = {"left": left, "middle": camera.position, "right": right}
        return {
            name: psw.View.through_wall(psw.Eye(places[name], self.near), wall)
            for name in eyes_of(self.layout)
        }

    def take(self, renderer: psw.Renderer, camera: Camera) -> NDArray[np.uint8]:
        """The frame, (height, width, 3) sRGB; of a renderer, a camera and nothing else."""
        pictures = {name: renderer.render(view) for name, view in self.views(camera).items()}
        if len(pictures) == 1:
            (picture,) = pictures.values()
        else:
            picture = combine(
                pictures["left"], pictures["right"], self.layout, self.size, background=self.background
            )
        return psw.images.presented(picture, self.background)
