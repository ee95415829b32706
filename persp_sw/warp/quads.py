"""The faces of an eye image as quads in the world, and what a shader must know to draw them.

A face is a rectangle in a plane of slices at any distance D from the eye (DESIGN section 3). An ordinary
matrix clip_from_world shows it; drawn for the eye that the image was made for, the picture is the same for
every D. Only an eye that has moved since sees the plane itself; see `moved`.

A quad is not handed to OpenGL as such, for the near and far planes of a wall would clip it, and clipped quads
of several faces may crack. Instead the quads are clipped to the window here, in float64, and the shader gets
the window's points as they lie in each face; so one polygon without depth serves all faces at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Matrix
from ..errors import ViewError
from ..eye_image import EyeImage
from ..geometry.faces import Face
from ..geometry.placement import beyond_eye
from ..volume.levels import STANDARD_AXES
from .moved import distance_of, shift_of

Array = NDArray[np.float64]

# Inside a window where |x| ≤ w and |y| ≤ w, which implies w ≥ 0: rows · (x, y, w) ≥ 0.
_WINDOW = np.array([[1, 0, 1], [-1, 0, 1], [0, 1, 1], [0, -1, 1.0]])
# Rows (x, y, w) of a matrix are those of parallel rays if so nearly dependent.
_PARALLEL = 1e-12


@dataclass(frozen=True, eq=False)
class Shown:
    """What of the quads one window shows.

    Attributes
    ----------
    outline
        (n ≤ 8, 2) corners of a convex polygon in normalized device coordinates that holds all quads.
    face_from_ndc
        (faces, 3, 3): window point (x, y, 1) to (u, v, 1) of each face up to a factor, positive where the
        face is in front of the eye. Pixel centres of a face are whole numbers, counted from its middle.
    depth_from_object
        (2, 4): object xyz1, relative to `Quads.base`, to clip z and w.
    """

    outline: Array
    face_from_ndc: Array
    depth_from_object: Array


class Quads:
    """Where the faces of an eye image lie.

    Attributes
    ----------
    middles
        (faces, 2): tangents (voxels, for an eye at infinity) of each face's middle.
    base
        Object xyz from which rays start: the eye, or the origin where they are parallel.
    start_from_face, object_from_face
        (faces, 3, 3): face point (u, v, 1), counted from its middle, to the object-space point on its ray
        with D = 0, relative to `base`, and to the ray's direction a unit of D. The point of a ray in slice k
        has D = |k − e_k|.
    """

    def __init__(self, image: EyeImage):
        self.image = image
        faces, pose = image.faces, image.world_from_object
        at_infinity = image.eye.is_at_infinity
        self._base_world = pose[:3, 3] if at_infinity else image.eye.position
        self.base = np.linalg.solve(pose, np.append(self._base_world, 1))[:3]
        if at_infinity:
            self.base = np.zeros(3)
        self.middles = np.array([_middle(face) for face in faces]).reshape(-1, 2)
        self.start_from_face = np.array([_start(face) for face in faces]).reshape(-1, 3, 3)
        self.object_from_face = np.array([_direction(face) for face in faces]).reshape(-1, 3, 3)
        self._distance = distance_of(image)

    @property
    def bounded(self) -> bool:
        """Whether it is known where on a ray its colour comes from."""
        return bool(np.isfinite(self.image.box).all())

    def shift(self, clip_from_world: Matrix) -> Array | None:
        """How far (object xyz) a matrix's eye is from the image's own; None where rays are parallel.

        Raises
        ------
        ViewError
            As `shown`.
        """
        rows = _checked(clip_from_world)[[0, 1, 3]]
        size = np.prod(np.linalg.norm(rows[:, :3], axis=1))
        if self.image.eye.is_at_infinity or abs(np.linalg.det(rows[:, :3])) <= _PARALLEL * size:
            return None
        return shift_of(self.image, -np.linalg.solve(rows[:, :3], rows[:, 3]))

    def shown(self, clip_from_world: Matrix) -> Shown | None:
        """What a window shows of the quads; None if nothing.

        Raises
        ------
        ViewError
            No (4, 4) matrix of finite numbers.
        """
        clip = _checked(clip_from_world)
        shift = self.shift(clip)
        flat = clip[[0, 1, 3]] @ self._world_from_face(shift)  # (faces, 3, 3) to (x, y, w)
        scale = np.linalg.norm(flat, axis=1).prod(-1)
        edge_on = np.abs(np.linalg.det(flat)) <= 1e-12 * scale
        if not len(flat) or edge_on.all():
            return None
        flat[edge_on] = np.eye(3)  # never in front: see below
        polygons = [
            _in_window(corners @ matrix.T)
            for corners, matrix, skip in zip(self._corners(), flat, edge_on, strict=True)
            if not skip
        ]
        points = np.concatenate(polygons)
        if not len(points):
            return None
        if len(polygons) > 1:
            (left, low), (right, high) = points.min(0), points.max(0)
            points = np.array([(left, low), (right, low), (right, high), (left, high)])
        inverse = np.linalg.inv(flat)
        inverse[edge_on] = 0
        # The point of no meaning but size: so that float32 holds the numbers whatever the world's unit.
        inverse /= np.abs(inverse).max((1, 2), initial=1e-300, keepdims=True)
        depth = clip[2:]
        linear = depth[:, :3] @ self.image.world_from_object[:3, :3]
        start = depth[:, :3] @ self._base_world + depth[:, 3]
        return Shown(points, inverse, np.column_stack([linear, start]))

    def _world_from_face(self, shift: Array | None) -> Array:
        """(faces, 4, 3): face points (u, v, 1) to where the quads lie, all at one distance."""
        distance = self._distance if shift is None else beyond_eye(self._distance, self.image.faces, shift)
        points = self.start_from_face + distance * self.object_from_face
        matrices = np.zeros((len(points), 4, 3))
        matrices[:, :3] = self.image.world_from_object[:3, :3] @ points
        matrices[:, :3, 2] += self._base_world
        matrices[:, 3, 2] = 1
        return matrices

    def _corners(self) -> Array:
        """(faces, 4, 3): corners of each face, half a pixel beyond the centres of its outermost pixels."""
        signs = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
        sizes = np.array([face.size for face in self.image.faces])[:, None] / 2
        return np.concatenate([signs * sizes, np.ones((len(sizes), 4, 1))], -1)


def _middle(face: Face) -> tuple[float, float]:
    (t_i, t_j), (width, height) = face.origin, face.size
    return t_i + width / 2 * face.pitch, t_j + height / 2 * face.pitch


def _in_object(face: Face, standard: Array) -> Array:
    """Rows i, j, k of standard space as rows x, y, z."""
    rows = np.empty((3, 3))
    rows[list(STANDARD_AXES[face.axis])] = standard
    return rows


def _spread(face: Face, last: float) -> Array:
    """Standard-space (t_i, t_j, last) of a face point."""
    t_i, t_j = _middle(face)
    return np.array([[face.pitch, 0, t_i], [0, face.pitch, t_j], [0, 0, last]])


def _start(face: Face) -> Array:
    return _in_object(face, np.zeros((3, 3)) if face.parallel is None else _spread(face, 0))


def _direction(face: Face) -> Array:
    if face.parallel is None:
        return _in_object(face, _spread(face, face.sign))
    constant = np.zeros((3, 3))
    constant[:, 2] = *face.parallel, face.sign
    return _in_object(face, constant)


def _checked(matrix: Matrix) -> Matrix:
    try:
        matrix = np.asarray(matrix, np.float64)
    except (TypeError, ValueError):
        matrix = np.empty(0)
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
        raise ViewError(f"clip_from_world is a (4, 4) matrix of finite numbers; given {matrix!r}")
    return matrix


def _in_window(corners: Array) -> Array:
    """(n, 2) normalized device coordinates of a polygon (x, y, w), clipped to the window."""
    outside = (corners @ _WINDOW.T < 0).any(0)
    for row in _WINDOW[outside]:
        side = corners @ row
        if (side >= 0).all():
            continue
        kept = []
        for n in range(len(corners)):
            a, b = side[n - 1], side[n]
            if (a >= 0) != (b >= 0):
                kept.append(corners[n - 1] + a / (a - b) * (corners[n] - corners[n - 1]))
            if b >= 0:
                kept.append(corners[n])
        corners = np.array(kept).reshape(-1, 3)
    w = corners[:, 2:]
    return corners[:, :2] / np.where(w > 0, w, 1)
