"""Which samples count: against a closed form and a plain walk in numpy, and as a bound on the compositor."""

from __future__ import annotations

import numpy as np
import pytest

import persp_sw as psw
from persp_sw.eye_image import EyeImage
from persp_sw.geometry.faces import Face
from persp_sw.measure import waste
from persp_sw.volume import phantoms
from persp_sw.volume.levels import STANDARD_AXES

GREY = (0.5, 0.5, 0.5)


def eye_image(volume: psw.Volume, eye: psw.Eye, *faces: Face) -> EyeImage:
    """Faces without a picture: the count needs their geometry alone."""
    return EyeImage(eye, volume.world_from_object, faces, np.zeros((0, 4), np.float32), 0)


def facing_slab(count: int, opacity: float):
    """A slab of `count` slices before an eye on its z axis, and a wall that shows the middle of it."""
    volume = phantoms.constant((41, 41, count), 1.0)
    transfer = psw.TransferFunction([(0.0, GREY, 0.0), (1.0, GREY, opacity)], 1.0)
    eye = psw.Eye((20.0, 20.0, -100.0))
    wall = psw.View.look_at(eye.position, (20, 20, 0), (0, 1, 0), 6, (64, 64)).wall
    half = np.tan(np.radians(3))
    face = Face(2, 1, (-0.16, -0.16), 0.01, (32, 32))  # the whole slab and more
    t = (np.arange(32) + 0.5) * 0.01 - 0.16
    shown = np.count_nonzero(np.abs(t) < half) ** 2
    return volume, transfer, eye_image(volume, eye, face), wall, shown


def test_all_of_a_thin_medium_counts_where_a_wall_shows_it():
    volume, transfer, image, wall, shown = facing_slab(9, 0.01)
    assert 0 < shown < 32 * 32
    count = waste.samples_that_count(image, [wall], volume, transfer, psw.Settings())
    assert count == shown * 9
    twice = psw.Settings(samples_per_interval=2)
    assert waste.samples_that_count(image, [wall], volume, transfer, twice) == shown * 17


def test_what_is_hidden_does_not_count():
    volume, transfer, image, wall, shown = facing_slab(41, 0.3)
    # The first slice stands for half an interval: 0.7^(n − ½) is left after n samples (slants aside, which
    # change a length by 0.3 %), and the first n with at most 0.005 is ⌈½ + ln 0.005 / ln 0.7⌉ = 16.
    settings = psw.Settings(residual=0.005)
    assert waste.samples_that_count(image, [wall], volume, transfer, settings) == shown * 16


def test_what_is_invisible_or_cut_away_does_not_count():
    volume, transfer, image, wall, shown = facing_slab(9, 0.01)
    nothing = psw.TransferFunction([(0.0, GREY, 0.5), (0.5, GREY, 0.0)], 1.0)
    assert waste.samples_that_count(image, [wall], volume, nothing, psw.Settings()) == 0
    regions = psw.Regions(clip=[(0, 0, 1, -3.25)])  # slice 3 stands for 2.5 … 3.5
    count = waste.samples_that_count(image, [wall], volume, transfer, psw.Settings(), regions)
    assert count == shown * 6
    empty = eye_image(volume, image.eye)
    assert waste.samples_that_count(empty, [wall], volume, transfer, psw.Settings()) == 0


def test_of_large_faces_a_part_is_counted(monkeypatch):
    volume, transfer, image, wall, _ = facing_slab(9, 0.01)
    exact = waste.samples_that_count(image, [wall], volume, transfer, psw.Settings())
    rays = []

    def count_samples(tangents, *rest):
        rays.append(len(tangents))
        kernel(tangents, *rest)

    kernel = waste.count_samples
    monkeypatch.setattr(waste, "count_samples", count_samples)
    monkeypatch.setattr(waste, "RAYS", 256)  # every second pixel of 32 × 32 each way
    part = waste.samples_that_count(image, [wall], volume, transfer, psw.Settings())
    assert part == exact  # of 10 × 10 pixels shown, 5 × 5 are looked at
    assert rays == [25]


def walk(volume, transfer, eye, axis, sign, tangent, steps, settings, regions):
    """One ray, plainly: numpy, one sample after the other."""
    axes = list(STANDARD_AXES[axis])
    object_from_world = np.linalg.inv(volume.world_from_object)
    start = (object_from_world @ np.append(eye.position, 1))[:3]
    way = np.zeros(3)
    way[axes] = *tangent, sign
    length = np.linalg.norm(volume.world_from_object[:3, :3] @ way)
    near, far = eye.near / length, np.inf
    for plane in regions.half_spaces(volume):
        offset, slope = plane[:3] @ start + plane[3], plane[:3] @ way
        if slope > 0:
            near = max(near, -offset / slope)
        elif slope < 0:
            far = min(far, -offset / slope)
    top = volume.size[axis] - 1
    first = sign * ((0 if sign > 0 else top) - start[axis])
    light, count = 1.0, 0
    for q in range(top * steps + 1):
        distance = first + q / steps
        part = min(distance + 0.5 / steps, far) - max(distance - 0.5 / steps, near)
        if part > 0 and light > settings.residual:
            value = trilinear(volume, start + way * distance)
            if transfer.opacity(value) > 0:
                count += 1
                light *= np.exp(-transfer.extinction(value) * length * part)
    return count


def trilinear(volume, at):
    at = np.clip(at, 0, np.array(volume.size) - 1.0)
    low = np.minimum(np.floor(at).astype(int), np.array(volume.size) - 2)
    (x, y, z), (a, b, c) = low, at - low
    cell = volume.data[z : z + 2, y : y + 2, x : x + 2].astype(np.float64)
    cell = cell[0] * (1 - c) + cell[1] * c
    cell = cell[0] * (1 - b) + cell[1] * b
    return cell[0] * (1 - a) + cell[1] * a


@pytest.mark.parametrize(("axis", "sign"), [(0, 1), (1, -1), (2, 1), (2, -1)])
def test_against_a_plain_walk(rng, axis: int, sign: int):
    pose = np.eye(4)
    pose[:3, :3] = [[1.0, 0.2, 0.0], [0.0, 1.5, 0.1], [0.0, 0.0, -0.8]]
    volume = psw.Volume(rng.integers(0, 256, (7, 9, 8)).astype(np.uint8), world_from_object=pose)
    points = [(60, GREY, 0.0), (90, GREY, 0.2), (90, GREY, 0.6), (200, GREY, 0.0)]
    transfer = psw.TransferFunction(points, 1.0)
    regions = psw.Regions(crop=(0.5, 6.75, 1, 7, 0, 6), clip=[(0.3, 0.5, 0.2, -1.5)])
    middle = (np.array(volume.size) - 1) / 2
    start = middle + rng.uniform(-1, 1, 3)
    start[axis] = middle[axis] - sign * 6.0
    eye = psw.Eye(pose[:3, :3] @ start, near=2.0)
    settings = psw.Settings(residual=0.05, samples_per_interval=2)
    face = Face(axis, sign, (-3.2, -3.2), 0.4, (16, 16))
    image = eye_image(volume, eye, face)
    directions = image.world_from_tangents(0)
    wall = psw.View.look_at(eye.position, eye.position + directions[:, 2], (0.3, 0.5, 0.7), 175, (9, 9)).wall
    expected = 0
    for v in range(16):
        for u in range(16):
            tangent = (np.array([u, v]) + 0.5) * 0.4 - 3.2
            steepest = np.abs(tangent).max()
            steps = 4 if steepest > 3 else 2
            expected += walk(volume, transfer, eye, axis, sign, tangent, steps, settings, regions)
    assert expected > 90
    count = waste.samples_that_count(image, [wall], volume, transfer, settings, regions)
    assert count == expected


@pytest.mark.parametrize("opacity", [0.02, 1.0])
def test_the_compositor_takes_at_least_what_counts(opacity: float):
    volume = phantoms.synthetic_ct(32)
    transfer = psw.TransferFunction([(100, GREY, 0.0), (130, GREY, opacity)], 1.0)
    view = psw.View.look_at((60, 40, 70), volume.centre, (0, 1, 0), 35, (64, 64))
    settings = psw.Settings()
    renderer = psw.Renderer(volume, transfer, settings)
    image = renderer.composite(view.eye, [view.wall])
    count = waste.samples_that_count(image, [view.wall], volume, transfer, settings)
    assert 0 < count <= image.samples
