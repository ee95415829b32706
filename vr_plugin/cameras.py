"""A camera and the exact moves it can make: orbit, zoom, pan, fly. No time and no input devices in here."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

import persp_sw as psw
from persp_sw.errors import PerspSWError

from .eyes import EyePair
from .pose import Pose, Vector, multiply, quaternion_of, turn_about

RIGHT, UP, BACK = np.eye(3)  # a camera's own axes: it looks along −z
STEEPEST = np.radians(89.5)  # straight down, a turntable would not know right from left


class CameraError(PerspSWError):
    """Numbers that make no camera."""


@dataclass(frozen=True, eq=False)
class Camera:
    """Where one looks from, what is in the middle of the picture, and how wide the picture is.

    Parameters
    ----------
    pose
        world_from_camera. The camera looks along its −z axis; x is right, y up.
    distance
        To the pivot, the point in the middle of the picture about which orbits go, > 0, world units.
    fovy
        Full vertical opening angle, radians, 0 < fovy < π.

    Raises
    ------
    CameraError
        A distance or an angle out of range.
    """

    pose: Pose
    distance: float
    fovy: float

    def __post_init__(self):
        if not (0 < self.distance < np.inf and 0 < self.fovy < np.pi):
            raise CameraError(
                f"a camera has a distance above 0 and an opening angle of 0 … π; given {self.distance}, "
                f"{self.fovy}"
            )

    @classmethod
    def look_at(cls, eye: Vector, pivot: Vector, up: Vector, fovy: float) -> Camera:
        """The camera at `eye` with `pivot` in the middle and `up` upwards in the picture; world xyz.

        Where the line of sight is along `up`, any horizontal direction is to the right.
        """
        eye, pivot, up = (np.asarray(v, np.float64) for v in (eye, pivot, up))
        distance = float(np.linalg.norm(eye - pivot))
        if distance == 0:
            raise CameraError(f"eye and pivot are the same point {eye.tolist()}; move one of them")
        back = (eye - pivot) / distance
        right = np.cross(up, back)
        if np.linalg.norm(right) <= 1e-9 * np.linalg.norm(up):
            right = np.cross(np.eye(3)[np.argmin(np.abs(back))], back)
        right /= np.linalg.norm(right)
        rotation = np.column_stack([right, np.cross(back, right), back])
        return cls(Pose(eye, quaternion_of(rotation)), distance, fovy)

    @classmethod
    def of_view(cls, view: psw.View) -> Camera:
        """The camera whose picture is `view`'s, if that is symmetric; its pivot is on the view's wall.

        A parallel view, which no place sees, becomes a narrow one that shows as much of its wall.
        """
        wall = view.wall
        across, upwards = wall.lower_right - wall.lower_left, wall.upper_left - wall.lower_left
        middle, height = wall.lower_left + (across + upwards) / 2, np.linalg.norm(upwards)
        if view.eye.is_at_infinity:
            eye = middle + view.eye.position * height / (2 * np.tan(np.radians(15)))
        else:
            eye = view.eye.position
        fovy = 2 * np.arctan(height / 2 / np.linalg.norm(middle - eye))
        return cls.look_at(eye, middle, upwards, float(fovy))

    @property
    def position(self) -> Vector:
        """World xyz."""
        return self.pose.position

    @property
    def axes(self) -> np.ndarray:
        """(3, 3): rows are the world directions right, up and back."""
        return self.pose.matrix[:3, :3].T

    @property
    def pivot(self) -> Vector:
        """World xyz of the point in the middle of the picture."""
        return self.pose.apply(-self.distance * BACK)

    @property
    def half_height(self) -> float:
        """Half of what the picture shows vertically at the pivot, world units."""
        return float(self.distance * np.tan(self.fovy / 2))

    def wall(self, pixels: tuple[int, int], name: str = "view") -> psw.Wall:
        """The picture as a wall: square pixels, through the pivot, facing the camera.

        What lies on it has no parallax: through it, two eyes see the pivot in one place.
        """
        width, height = pixels
        right, up, _ = self.axes
        across, upwards = right * self.half_height * width / height, up * self.half_height
        corners = [self.pivot + x * across + y * upwards for x, y in ((-1, -1), (1, -1), (-1, 1))]
        return psw.Wall(*corners, pixels=pixels, name=name)

    def eyes(self, separation: float) -> EyePair:
        """Two eyes, `separation` of the camera's distance apart (a share, not a length), level with it."""
        half = self.axes[0] * (separation * self.distance / 2)
        return EyePair(self.position - half, self.position + half)

    def point_at(self, across: float, upwards: float) -> Vector:
        """World xyz of a point on the wall, in half heights of the picture from its middle."""
        right, up, _ = self.axes
        return self.pivot + self.half_height * (across * right + upwards * up)

    def turned(self, axis: Vector, angle: float, about: Vector | None = None) -> Camera:
        """Turned by `angle` radians, right-handed, around the world `axis` through `about` (the pivot)."""
        quaternion = turn_about(axis, angle)
        turn = Pose(orientation=quaternion)
        about = self.pivot if about is None else about
        position = about + turn.apply(self.position - about)
        return replace(self, pose=Pose(position, multiply(quaternion, self.pose.orientation)))

    def on_turntable(self, azimuth: float, elevation: float, up: Vector) -> Camera:
        """Orbit by angles: to the right around `up`, and upwards; never over the top.

        Distance and pivot stay; what was level stays level.
        """
        camera = self.turned(up, azimuth)
        room = STEEPEST * np.array([-1, 1]) - camera.steepness(up)
        elevation = float(np.clip(elevation, min(room[0], 0), max(room[1], 0)))
        return camera.turned(camera.axes[0], -elevation)

    def on_trackball(self, rightwards: float, upwards: float) -> Camera:
        """Orbit by angles in the camera's own directions; there is no up and no end."""
        angle = np.hypot(rightwards, upwards)
        if angle == 0:
            return self
        right, up, _ = self.axes
        return self.turned(rightwards * up - upwards * right, angle)

    def steepness(self, up: Vector) -> float:
        """Angle of the camera above the pivot's horizon, radians."""
        up = np.asarray(up, np.float64)
        return float(np.arcsin(np.clip(self.axes[2] @ up / np.linalg.norm(up), -1, 1)))

    def levelled(self, up: Vector) -> Camera:
        """The same eye and pivot, with `up` upwards."""
        return self.look_at(self.position, self.pivot, up, self.fovy)

    def zoomed(self, factor: float, towards: Vector | None = None) -> Camera:
        """Nearer (factor < 1) or farther: all distances from `towards` (the pivot) times `factor` > 0.

        What is seen at `towards` stays where it is in the picture, and a pivot is never passed.
        """
        towards = self.pivot if towards is None else towards
        position = towards + factor * (self.position - towards)
        return replace(self, pose=Pose(position, self.pose.orientation), distance=self.distance * factor)

    def panned(self, across: float, upwards: float) -> Camera:
        """Shifted so that what lies on the wall moves by so many half heights of the picture."""
        return self.moved((-across * self.half_height, -upwards * self.half_height, 0.0))

    def moved(self, offset: Vector) -> Camera:
        """Shifted by `offset` in the camera's own axes, world units; the pivot goes along."""
        return replace(self, pose=Pose(self.pose.apply(offset), self.pose.orientation))

    def looking(self, rightwards: float, upwards: float, up: Vector) -> Camera:
        """Turned where it stands, by angles; the pivot goes along. Never over the top."""
        camera = self.turned(up, -rightwards, self.position)
        room = STEEPEST * np.array([-1, 1]) + camera.steepness(up)
        upwards = float(np.clip(upwards, min(room[0], 0), max(room[1], 0)))
        return camera.turned(camera.axes[0], upwards, self.position)
