"""What a preview wants drawn: the words between its controller and whoever draws."""

from __future__ import annotations

from dataclasses import dataclass

import persp_sw as psw

from ..cameras import Camera
from ..eyes import EyePair
from ..pose import Pose
from ..stereo import Stereo
from .edits import Edits


@dataclass(frozen=True, eq=False)
class Wanted:
    """What is to be drawn now.

    Attributes
    ----------
    camera
        In the volume's world; of the outside view in the room.
    size
        Of the window, pixels.
    outside
        The room from outside instead of the volume.
    stereo
        How the window shows the eyes.
    eyes
        Of the camera, in the volume's world; `separation` is their distance as a share of the pivot's.
    head, head_eyes
        In the room; None without one.
    quality, preset
        What the pictures should be like; quality None: what the frame rate allows, and at rest all that there
        is; preset None: the scene's own transfer function.
    edits
        What has been edited of the scene.
    overlay, help
        Which texts lie over the picture.
    volume_outside
        Whether the outside view shows the volume itself, not only its box.
    style, speed
        How the camera is moved: one of `STYLES`; extents a second.
    message
        A line for the user, for a few seconds; "" mostly.
    moving
        Whether this differs from what was wanted before, or the next moment will.
    path_runs
        Whether the recorded head moves; None without a recording.
    marks
        Box, axes, cursor and so on.
    picked
        What was picked last, for people; "" if nothing.
    window
        Level and width of a grey ramp instead of the preset's transfer function; None: that.
    """

    camera: Camera
    size: tuple[int, int]
    outside: bool
    stereo: Stereo
    separation: float
    eyes: EyePair
    head: Pose | None
    head_eyes: EyePair | None
    quality: float | None
    preset: str | None
    edits: Edits
    overlay: bool
    help: bool
    volume_outside: bool
    style: str
    speed: float
    message: str
    moving: bool
    path_runs: bool | None
    marks: psw.marks.MarkChoice
    picked: str
    window: tuple[float, float] | None

    @property
    def eye_images(self) -> tuple[object, ...]:
        """What eye images depend on: two moments of which it is equal differ in texts alone."""
        head = (*self.head.position.tolist(), *self.head.orientation.tolist()) if self.outside else ()
        inside = (self.camera, self.size, self.stereo, self.separation, self.quality, self.preset)
        return (*inside, self.outside, self.volume_outside and self.outside, *head, self.edits)

    def differs_by_edits_alone(self, eye_images: tuple[object, ...]) -> bool:
        """Whether eye images are others than those, and nothing but edits is the reason."""
        mine = self.eye_images
        return mine != eye_images and mine[:-1] == eye_images[:-1]
