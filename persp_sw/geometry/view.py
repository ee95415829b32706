"""Eye, wall and view: where one looks from and what one looks through."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..arrays import Matrix, Points, Vector, number, vector
from ..errors import ViewError


@dataclass(frozen=True, eq=False)
class Eye:
    """A point in the world from which rays start, or a direction from which all of them come.

    Parameters
    ----------
    position
        World xyz. For an eye at infinity the direction towards it; kept as a unit vector.
    near
        Nothing nearer to the eye than this, measured along the ray in world units, is shown (≥ 0). From
        infinity everything is shown, and this is 0.
    w
        The fourth homogeneous coordinate: 1, or 0 for an eye at infinity, the parallel projection.
    """

    position: Vector
    near: float = 0.0
    w: float = 1.0

    def __post_init__(self):
        position = vector(self.position, "the eye's position", ViewError)
        near = number(self.near, "the near distance", ViewError, 0)
        if number(self.w, "an eye's w", ViewError) not in (0, 1):
            raise ViewError(f"an eye's w is 1, or 0 for an eye at infinity; given {self.w!r}")
        if self.w == 0:
            if near:
                raise ViewError(f"an eye at infinity has no near distance; given {near}: use a clip plane")
            length = np.linalg.norm(position)
            if length == 0:
                raise ViewError("the direction towards an eye at infinity is not zero")
            if abs(length - 1) > 1e-12:  # a unit vector keeps its bits
                position = position / length
        object.__setattr__(self, "position", position)
        object.__setattr__(self, "near", near)

    @classmethod
    def at_infinity(cls, towards: Vector) -> Eye:
        """An eye infinitely far away in the world direction `towards`: all its rays run along −`towards`."""
        return cls(towards, 0.0, 0.0)

    @property
    def is_at_infinity(self) -> bool:
        """Whether all rays are parallel."""
        return self.w == 0


@dataclass(frozen=True, eq=False)
class Wall:
    """A flat rectangular (or sheared) display in the world.

    Parameters
    ----------
    lower_left, lower_right, upper_left
        World xyz of three corners.
    pixels
        Width and height in pixels. Pixel (column, row) has its centre at (column + 0.5, row + 0.5); row 0 is
        on top.

    Source: Kooima, *Generalized perspective projection* (three corners, any orientation).
    """

    lower_left: Vector
    lower_right: Vector
    upper_left: Vector
    pixels: tuple[int, int]
    name: str = ""

    def __post_init__(self):
        for corner in ("lower_left", "lower_right", "upper_left"):
            object.__setattr__(self, corner, vector(getattr(self, corner), f"the wall's {corner}", ViewError))
        object.__setattr__(self, "pixels", _checked_pixels(self.pixels))
        across, up = self.lower_right - self.lower_left, self.upper_left - self.lower_left
        if np.linalg.norm(np.cross(across, up)) <= 1e-9 * np.linalg.norm(across) * np.linalg.norm(up):
            raise ViewError("a wall's three corners must not lie on one line")

    @property
    def world_from_pixel(self) -> Matrix:
        """(3, 3): maps (column, row, 1) to world xyz on the wall; columns per pixel, rows downwards."""
        width, height = self.pixels
        across = (self.lower_right - self.lower_left) / width
        down = (self.lower_left - self.upper_left) / height
        return np.column_stack([across, down, self.upper_left])


def _checked_pixels(pixels: tuple[int, int]) -> tuple[int, int]:
    try:
        width, height = (int(n) for n in pixels)
        whole = (width, height) == tuple(pixels)
    except (TypeError, ValueError, OverflowError):
        raise ViewError(f"a wall's pixels are [width, height]; given {pixels!r}") from None
    if not whole or not (1 <= width <= 16384 and 1 <= height <= 16384):
        raise ViewError(f"a wall has 1 … 16384 whole pixels a side; given {pixels!r}")
    return width, height


@dataclass(frozen=True, eq=False)
class View:
    """One eye looking through one wall: all that a picture depends on besides the scene.

    Attributes
    ----------
    direction_from_pixel
        (3, 3): the world direction (not normalised) of the ray through pixel point (column, row, 1) starts at
        the eye and reaches the wall at length 1. Linear in the pixel: this is the whole projection. For an
        eye at infinity, the rays' one unit direction; they pass the wall at `wall.world_from_pixel`.
    """

    eye: Eye
    wall: Wall
    direction_from_pixel: Matrix = field(init=False)

    def __post_init__(self):
        matrix = self.wall.world_from_pixel
        if self.eye.is_at_infinity:
            matrix[:, 2] = 0
        matrix[:, 2] -= self.eye.position
        scale = np.prod(np.linalg.norm(matrix, axis=0))
        if abs(np.linalg.det(matrix)) <= 1e-12 * scale:
            raise ViewError(
                f"the eye {self.eye.position.tolist()} lies in the plane of wall {self.wall.name!r}: "
                "it sees the wall edge-on; move the eye off the wall"
            )
        if self.eye.is_at_infinity:
            matrix[:, :2] = 0
        object.__setattr__(self, "direction_from_pixel", matrix)

    @classmethod
    def through_wall(cls, eye: Eye | Vector, wall: Wall) -> View:
        """The view of `eye` through `wall`; `eye` may be given as its position alone."""
        return cls(eye if isinstance(eye, Eye) else Eye(eye), wall)

    @classmethod
    def look_at(
        cls,
        eye: Vector,
        centre: Vector,
        up: Vector,
        fovy_deg: float,
        size: tuple[int, int],
        near: float = 0.0,
    ) -> View:
        """A symmetric perspective view, as of a camera.

        Parameters
        ----------
        eye, centre, up
            World xyz: where the camera stands, the point in the middle of the picture, the direction upwards.
        fovy_deg
            Full vertical opening angle, degrees, 0 < fovy < 180. Pixels are square.
        size
            Width and height of the picture in pixels.

        Raises
        ------
        ViewError
            Eye and centre coincide, `up` is parallel to the line of sight, or a number out of range.
        """
        fovy_deg = number(fovy_deg, "fovy (degrees)", ViewError, 1e-6, 180 - 1e-6)
        position, forward, distance, right, up = _line_of_sight(eye, centre, up)
        # The wall stands at the centre, so that its size and the scene's are alike whatever the unit.
        half_height = distance * np.tan(np.radians(fovy_deg) / 2)
        wall = _upright_wall(position + forward * distance, right, up, half_height, size)
        return cls(Eye(position, near), wall)

    @classmethod
    def parallel(cls, eye: Vector, centre: Vector, up: Vector, height: float, size: tuple[int, int]) -> View:
        """A parallel view, as of a camera infinitely far away on the line from `centre` through `eye`.

        Parameters
        ----------
        eye, centre, up
            As for `look_at`; of the eye only the direction matters.
        height
            World length that the picture's height shows, > 0. Pixels are square.
        size
            Width and height of the picture in pixels.

        Raises
        ------
        ViewError
            As `look_at`.
        """
        height = number(height, "the height of a parallel view", ViewError, 1e-300)
        position, forward, distance, right, up = _line_of_sight(eye, centre, up)
        wall = _upright_wall(position + forward * distance, right, up, height / 2, size)
        return cls(Eye.at_infinity(-forward), wall)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.wall.pixels

    @property
    def viewport_from_world(self) -> Matrix:
        """(3, 4): world xyz1 to homogeneous pixel coordinates; w is > 0 in front of the eye.

        The point's ray meets the wall at (x / w, y / w); w grows linearly with the distance from the wall's
        parallel plane through the eye and is 1 on the wall. For an eye at infinity it is 1 everywhere.
        """
        if self.eye.is_at_infinity:
            matrix = self.wall.world_from_pixel
            corner = matrix[:, 2].copy()
            matrix[:, 2] = self.eye.position
            inverse = np.linalg.inv(matrix)
            affine = np.column_stack([inverse, -inverse @ corner])
            affine[2] = 0, 0, 0, 1
            return affine
        inverse = np.linalg.inv(self.direction_from_pixel)
        return np.column_stack([inverse, -inverse @ self.eye.position])

    def clip_from_world(self, near: float, far: float) -> Matrix:
        """(4, 4): world xyz1 to OpenGL's clip space: the wall's corners to x, y = ±w, with y up.

        Parameters
        ----------
        near, far
            World distances that depths z = −w and z = w stand for, near < far: from the eye along the wall's
            normal, near > 0; for an eye at infinity from the wall along the rays, of either sign.
        """
        width, height = self.size
        column, row, w = self.viewport_from_world
        near, far = number(near, "the near distance", ViewError), number(far, "the far distance", ViewError)
        if not near < far or (near <= 0 and not self.eye.is_at_infinity):
            raise ViewError(f"depths need 0 < near < far; given near {near} and far {far}")
        last = np.array([0, 0, 0, 1.0])
        if self.eye.is_at_infinity:
            away = -self.eye.position
            distance = np.append(away, -away @ self.wall.lower_left)
            depth = (2 * distance - (near + far) * last) / (far - near)
        else:
            # w is 1 on the wall and grows linearly with the distance.
            near, far = near / self.wall_distance, far / self.wall_distance
            depth = ((far + near) * w - 2 * far * near * last) / (far - near)
        return np.array([2 / width * column - w, w - 2 / height * row, depth, w])

    @property
    def wall_distance(self) -> float:
        """World distance of the eye, which is at a point, from the wall's plane."""
        wall = self.wall
        normal = np.cross(wall.lower_right - wall.lower_left, wall.upper_left - wall.lower_left)
        return float(abs((self.eye.position - wall.lower_left) @ normal) / np.linalg.norm(normal))

    def project(self, points: Points) -> Points:
        """Pixel coordinates (..., 2) of world points (..., 3); NaN for points not in front of the eye."""
        matrix = self.viewport_from_world
        homogeneous = np.asarray(points, np.float64) @ matrix[:, :3].T + matrix[:, 3]
        w = homogeneous[..., 2:]
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(w > 0, homogeneous[..., :2] / w, np.nan)

    def directions(self) -> Points:
        """(height, width, 3) world directions of all pixel centres' rays, reaching the wall at length 1.

        All the same unit vector for an eye at infinity.
        """
        return self._pixel_centres() @ self.direction_from_pixel.T

    def starts(self) -> Points:
        """(height, width, 3) world points on all pixel centres' rays: the eye, or on the wall from infinity.

        From infinity, rays show what lies on either side of the wall.
        """
        if self.eye.is_at_infinity:
            return self._pixel_centres() @ self.wall.world_from_pixel.T
        return np.broadcast_to(self.eye.position, (*self.size[::-1], 3))

    def _pixel_centres(self) -> Points:
        width, height = self.size
        column, row = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
        return np.stack([column, row, np.ones_like(row)], -1)


def _line_of_sight(eye: Vector, centre: Vector, up: Vector) -> tuple[Points, Points, float, Points, Points]:
    """The eye, the unit vector to the centre, its distance, and unit vectors to the right and up."""
    position = vector(eye, "the eye's position", ViewError)
    forward = vector(centre, "the view's centre", ViewError) - position
    up = vector(up, "the up direction", ViewError)
    distance = np.linalg.norm(forward)
    if distance == 0:
        raise ViewError(f"eye and centre are the same point {position.tolist()}; move one of them")
    forward /= distance
    right = np.cross(forward, up)
    if np.linalg.norm(right) <= 1e-9 * np.linalg.norm(up):
        raise ViewError(f"up {up.tolist()} is parallel to the line of sight; choose another up")
    right /= np.linalg.norm(right)
    return position, forward, float(distance), right, np.cross(right, forward)


def _upright_wall(
    middle: Points, right: Points, up: Points, half_height: float, size: tuple[int, int]
) -> Wall:
    """A wall of square pixels about `middle`."""
    width, height = _checked_pixels(size)
    half_width = half_height * width / height
    corners = [
        middle + sx * half_width * right + sy * half_height * up for sx, sy in ((-1, -1), (1, -1), (-1, 1))
    ]
    return Wall(*corners, pixels=size)
