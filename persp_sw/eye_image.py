"""The eye image: what one eye sees of a volume, whatever the walls."""

from __future__ import annotations

import io
from dataclasses import dataclass, field, replace
from itertools import product
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from .arrays import Image, Matrix
from .errors import ViewError
from .geometry.faces import Face
from .geometry.seams import reach_of
from .geometry.view import Eye
from .volume.levels import STANDARD_AXES


@dataclass(frozen=True, eq=False)
class EyeImage:
    """What one eye sees of the volume, whatever the walls: one image for each principal direction in use.

    Attributes
    ----------
    eye
        The eye it was composited for.
    world_from_object
        The volume's pose, (4, 4).
    faces
        Geometry of each face; `face_pixels(n)` are the pixels of face n.
    pixels
        (total, 4) float32 linear premultiplied RGBA: the faces' pixels one after the other, row by row.
    samples
        Voxel samples taken to make it.
    box
        (2, 3): object-space corners of a box that holds all that can be seen in it; infinite where unknown.
    half_spaces
        (n, 4) rows, object space: all that can be seen lies where a·p + a_0 ≥ 0, too. Box and half-spaces
        tell where on a ray its colour comes from, which a scene with a depth buffer asks.
    depth
        Where its colours lie: the distance, in voxels along a face's axis and the same for all faces, at
        which eyes that have moved since see it best. None: not measured; the middle of `box` serves.
    slabs
        The same in pieces, front to back, each between two distances and with its own `depth`: what moved
        eyes are shown, with parallax. They differ from the image in `pixels`, `box` and `depth` only. Empty:
        the image itself serves them.
    """

    eye: Eye
    world_from_object: Matrix
    faces: tuple[Face, ...]
    pixels: NDArray[np.float32]
    samples: int
    box: NDArray[np.float64] = field(default_factory=lambda: np.array([[-np.inf] * 3, [np.inf] * 3]))
    half_spaces: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 4)))
    depth: float | None = None
    slabs: tuple[EyeImage, ...] = ()

    @property
    def alone(self) -> float:
        """c of the seams: how far towards a seam a face shows rays alone."""
        return 1 / reach_of(self.faces[0].pitch) if self.faces else 1.0

    def offset(self, number: int) -> int:
        """Where face `number` begins in `pixels`."""
        return sum(face.size[0] * face.size[1] for face in self.faces[:number])

    def face_pixels(self, number: int) -> Image:
        """(height, width, 4) view of face `number`; row v grows with t_j, column u with t_i."""
        width, height = self.faces[number].size
        start = self.offset(number)
        return self.pixels[start : start + width * height].reshape(height, width, 4)

    def world_from_tangents(self, number: int) -> Matrix:
        """(3, 3): world direction of the ray (t_i, t_j, 1) of face `number`; the ray starts at the eye.

        A quad with its corners at eye + world_from_tangents · (t_i, t_j, 1)·D shows the face, for any D > 0.
        For an eye at infinity: world position on slice k = 0 of (i, j, 1); those are the quad's corners.
        """
        face = self.faces[number]
        if face.parallel is not None:
            i, j, _ = STANDARD_AXES[face.axis]
            return self.world_from_object[:3, [i, j, 3]]
        matrix = self.world_from_object[:3, list(STANDARD_AXES[face.axis])].copy()
        matrix[:, 2] *= face.sign
        return matrix

    def clip_depth(self, clip_from_world: Matrix) -> float:
        """One depth z / w for a picture of all that is shown: half-way between its box's ends.

        What lies wholly before the box has less, what lies wholly behind it more. −1, the near plane's, where
        the box is not wholly in front of the eye or not known.
        """
        if not np.isfinite(self.box).all():
            return -1.0
        corners = np.array(list(product(*self.box.T, (1.0,))))
        z, w = (np.asarray(clip_from_world) @ self.world_from_object @ corners.T)[2:]
        return float((z / w).min() + (z / w).max()) / 2 if (w > 0).all() else -1.0

    def to_bytes(self) -> bytes:
        """Everything, for another process or machine; `from_bytes` gives it back bit for bit."""
        nowhere = (np.nan, np.nan)
        table = [(f.axis, f.sign, *f.origin, f.pitch, *f.size, *(f.parallel or nowhere)) for f in self.faces]
        shape = len(self.slabs), *self.pixels.shape
        buffer = io.BytesIO()
        np.savez(
            buffer,
            eye=np.array([*self.eye.position, self.eye.near, self.eye.w]),
            world_from_object=self.world_from_object,
            faces=np.array(table, np.float64).reshape(-1, 9),
            pixels=self.pixels,
            samples=np.int64(self.samples),
            box=self.box,
            half_spaces=self.half_spaces,
            slab_boxes=np.array([slab.box for slab in self.slabs]).reshape(-1, 2, 3),
            depths=np.array([np.nan if i.depth is None else i.depth for i in (self, *self.slabs)]),
            slabs=np.array([slab.pixels for slab in self.slabs], np.float32).reshape(shape),
        )
        return buffer.getvalue()

    @classmethod
    def from_bytes(cls, data: bytes) -> EyeImage:
        """Inverse of `to_bytes`; ViewError if the bytes are something else."""
        try:
            with np.load(io.BytesIO(data), allow_pickle=False) as file:
                content = {name: file[name] for name in _CONTENT}
            shapes = {name: array.shape for name, array in content.items()}
            pixels, slabs = content["pixels"], content["slabs"]
            wanted = {"eye": (5,), "world_from_object": (4, 4), "samples": (), "box": (2, 3)}
            planes = content["half_spaces"]
            fits = all(shapes[name] == shape for name, shape in wanted.items())
            fits = fits and planes.ndim == 2 and planes.shape[1] == 4
            fits = fits and slabs.shape == (len(slabs), *pixels.shape) and slabs.dtype == np.float32
            boxes = content["slab_boxes"]
            fits = fits and shapes["depths"] == (1 + len(slabs),) and boxes.shape == (len(slabs), 2, 3)
            if not (fits and pixels.ndim == 2 and pixels.shape[1] == 4 and pixels.dtype == np.float32):
                raise ValueError(f"its arrays have the shapes {shapes}")
            faces = tuple(_face(*row) for row in content["faces"].tolist())
            *position, near, w = content["eye"].tolist()
            samples = int(content["samples"])
            eye = Eye(position, near, w)
            if any((face.parallel is not None) != eye.is_at_infinity for face in faces):
                raise ValueError("its faces are another eye's")
            if np.isnan(content["box"]).any() or np.isnan(boxes).any() or not np.isfinite(planes).all():
                raise ValueError("its box or half-spaces are no numbers")
            depth, *depths = (None if np.isnan(d) else d for d in content["depths"].tolist())
            if not all(d is None or 0 < d < np.inf for d in (depth, *depths)):
                raise ValueError("it lies at impossible depths")
            image = cls(
                eye, content["world_from_object"], faces, pixels, samples, content["box"], planes, depth
            )
            layers = zip(slabs, boxes, depths, strict=True)
            layers = tuple(replace(image, pixels=p, box=b, depth=d) for p, b, d in layers)
            image = replace(image, slabs=layers)
        except (OSError, EOFError, ValueError, TypeError, KeyError, OverflowError, BadZipFile) as error:
            raise ViewError(f"these {len(data)} bytes are not an eye image: {error}") from None
        if image.offset(len(faces)) != len(pixels):
            raise ViewError("this eye image's faces do not fit its pixels; it was damaged on the way")
        return image


_CONTENT = (
    *("eye", "world_from_object", "faces", "pixels", "samples", "box", "half_spaces"),
    *("slabs", "slab_boxes", "depths"),
)


def _face(axis, sign, t_i, t_j, pitch, width, height, parallel_i, parallel_j) -> Face:
    numbers = axis in (0, 1, 2) and sign in (-1, 1) and 0 < pitch < np.inf and width >= 2 and height >= 2
    parallel = None if np.isnan(parallel_i) else (parallel_i, parallel_j)
    if not numbers or not np.isfinite([t_i, t_j, width, height, *(parallel or ())]).all():
        raise ValueError("a face of it is impossible")
    return Face(int(axis), int(sign), (t_i, t_j), pitch, (int(width), int(height)), parallel)
