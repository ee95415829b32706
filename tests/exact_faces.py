"""Every pixel of every face against the closed form of a homogeneous box, and that faces cover their rays."""

import numpy as np
from tolerances import CLOSED_FORM

from persp_sw import EyeImage
from persp_sw.measure.exact import shown_part
from persp_sw.volume.levels import STANDARD_AXES
from persp_sw.warp.software import warp_eye_image

VALUE, COLOUR = 100, np.array([0.9, 0.6, 0.3])


def exact_face(image, number, volume, regions, extinction):
    """(pixels, bound, decided) of a homogeneous box on a face, in float64 from the face's tangents.

    bound: every plane adds half a unit in the last place of 1, 3e-8, and the ends of a ray, counted from the
    volume's front, err by 1.2e-7 of the way through it. decided: not where a ray is so nearly parallel to a
    side, at so small a distance, that float64 cannot tell to 1e-7 voxel where the two meet, if at all.
    """
    face = image.faces[number]
    axes = list(STANDARD_AXES[face.axis])
    inverse = np.linalg.inv(volume.world_from_object)
    eye = (inverse[:3, :3] @ image.eye.position + inverse[:3, 3])[axes]
    u, v = np.meshgrid(*(np.arange(n) + 0.5 for n in face.size))
    direction = np.stack(
        [face.origin[0] + u * face.pitch, face.origin[1] + v * face.pitch, np.full(u.shape, face.sign)], -1
    )
    length = np.linalg.norm(direction @ volume.world_from_object[:3, axes].T, axis=-1)
    near, far = image.eye.near / length, np.full(u.shape, np.inf)
    decided = np.ones(u.shape, bool)
    for plane in regions.half_spaces(volume)[:, [*axes, 3]]:
        offset, slope = plane[:3] @ eye + plane[3], direction @ plane[:3]
        size = np.abs(plane[:3]) @ np.abs(eye) + abs(plane[3])
        spread = np.abs(direction) @ np.abs(plane[:3])
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = -offset / slope
            met = (size + np.abs(crossing) * spread) * 1e-15 < 1e-7 * np.abs(slope)
            never = (np.abs(crossing) > 1e9) & (abs(offset) > 1e-12 * size)
            decided &= met | never
        near = np.where(slope > 0, np.maximum(near, crossing), near)
        far = np.where(slope < 0, np.minimum(far, crossing), far)
        far = np.where((slope == 0) & (offset < 0), -np.inf, far)
    way = np.maximum(far - near, 0)
    alpha = -np.expm1(-extinction * length * way)
    planes = 4 * max(volume.size)
    bound = CLOSED_FORM + 3e-8 * planes + (1 - alpha) * extinction * length * 1.2e-7 * max(volume.size)
    return alpha[..., None] * np.append(COLOUR, 1), bound, decided


def assert_exact(image, volume, regions, extinction):
    """Every pixel of every face that float64 can decide; returns how many there were, and how many not."""
    decided_pixels = undecided_pixels = 0
    for number in range(len(image.faces)):
        expected, bound, decided = exact_face(image, number, volume, regions, extinction)
        error = np.abs(image.face_pixels(number) - expected).max(-1)
        assert (error < bound)[decided].all(), (image.eye, image.faces[number], error[decided].max())
        decided_pixels += decided.sum()
        undecided_pixels += (~decided).sum()
    return decided_pixels, undecided_pixels


def assert_covered(image, volume, view, regions=None):
    """Each of the view's rays that meets what is shown by a millionth of a voxel finds pixels to look up."""
    ones = EyeImage(image.eye, image.world_from_object, image.faces, np.ones_like(image.pixels), 0)
    picture = warp_eye_image(ones, view)[..., 3]
    entry, leave = shown_part(volume, view, regions)
    assert (picture[leave - entry > 1e-6 * min(volume.spacing)] > 0.999).all()
