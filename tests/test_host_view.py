"""A host's matrices become the eye and the wall that show every point at the same pixel."""

from __future__ import annotations

import numpy as np
import pytest
from pyglm import glm
from tolerances import HOST_FLOAT32_PIXELS, HOST_PIXELS
from views import random_pose, random_rotation

from persp_sw import Eye, View, Volume, Wall
from persp_sw.errors import ViewError
from vr_plugin.host_view import HostView, seen_in_world
from vr_plugin.projection import clip_from_view_space

SIZE = (320, 200)


@pytest.fixture
def volume(rng):
    return Volume(np.zeros((9, 12, 10), np.uint8), world_from_object=random_pose(rng, spacing=(1, 2, 0.5)))


def similarity(rng, scale):
    matrix = np.eye(4)
    matrix[:3, :3] = scale * random_rotation(rng)
    matrix[:3, 3] = rng.uniform(-2, 2, 3)
    return matrix


def points_in(volume, rng, count=50):
    """World points in the volume's box."""
    places = rng.uniform(0, 1, (count, 3)) * (np.array(volume.size) - 1)
    return places @ volume.world_from_object[:3, :3].T + volume.world_from_object[:3, 3]


def pixels_of(clip_from_host, host_from_world, points):
    """Where OpenGL puts world points: pixels with row 0 on top; and clip space's w."""
    clip = np.column_stack([points, np.ones(len(points))]) @ (clip_from_host @ host_from_world).T
    ndc = clip[:, :2] / clip[:, 3:]
    return (ndc * (1, -1) + 1) / 2 * SIZE, clip[:, 3]


def at(matrix, point):
    return matrix[:3, :3] @ point + matrix[:3, 3]


@pytest.mark.parametrize("scale", [1e-3, 1.0, 40.0])
def test_any_off_axis_perspective(volume, rng, scale):
    """Eyes anywhere, windows far off the axis, depths as they like: the eye and every pixel are the same."""
    for _ in range(40):
        placed = similarity(rng, scale)
        middle = at(placed, volume.centre)
        reach = scale * np.linalg.norm(volume.extent)
        eye = middle + reach * rng.normal(size=3)
        towards = (middle - eye) / np.linalg.norm(middle - eye)
        across, up = reach * np.linalg.svd(towards[None])[2][1:]
        corner = middle + rng.uniform(-1, 1) * across + rng.uniform(-1, 1) * up - (across + up) / 2
        projection, view = clip_from_view_space(
            eye, Wall(corner, corner + across, corner + up, SIZE), 0.01 * reach, 100 * reach
        )
        depths = rng.choice(["finite", "infinite", "reversed", "scaled"])
        if depths == "infinite":
            projection[2] = 0, 0, -1, -0.02 * reach
        elif depths == "reversed":
            projection[2] *= -1
        elif depths == "scaled":
            projection *= 1e-3
        ours = seen_in_world(HostView(projection, view, SIZE), placed, volume)
        assert np.abs(at(placed, ours.eye.position) - eye).max() < 1e-9 * reach
        points = points_in(volume, rng)
        pixels, w = pixels_of(projection @ view, placed, points)
        seen = ours.project(points)
        assert np.array_equal(np.isnan(seen[:, 0]), w <= 0)
        front = w > 0.05 * np.abs(w).max()
        assert np.abs(seen - pixels)[front].max(initial=0) < HOST_PIXELS


@pytest.mark.parametrize("reverse", [False, True])
def test_parallel_projections(volume, rng, reverse):
    for _ in range(20):
        towards = rng.normal(size=3)
        truth = View.parallel(volume.centre + towards, volume.centre, rng.normal(size=3), 30, SIZE)
        projection = truth.clip_from_world(-50, 80)
        projection[2] *= -1 if reverse else 1
        placed = similarity(rng, 0.1)
        view = HostView(projection, np.linalg.inv(placed), SIZE, reversed_depth=reverse)
        ours = seen_in_world(view, placed, volume)
        assert ours.eye.is_at_infinity
        assert ours.eye.position @ truth.eye.position > 1 - 1e-12
        points = points_in(volume, rng)
        assert np.abs(ours.project(points) - truth.project(points)).max() < HOST_PIXELS


def test_an_eye_very_far_away_is_at_infinity(volume):
    """And one that is merely far is not."""
    reach = float(np.linalg.norm(volume.extent))
    for distance, parallel in ((1e5, False), (1e12, True)):
        eye = volume.centre + np.array([0, 0, distance * reach])
        corners = volume.centre + reach * np.array([(-0.8, -0.5, 0), (0.8, -0.5, 0), (-0.8, 0.5, 0)])
        view = View(Eye(eye), Wall(*corners, SIZE))
        clip = view.clip_from_world((distance - 5) * reach, (distance + 5) * reach)
        ours = seen_in_world(HostView(clip, np.eye(4), SIZE), np.eye(4), volume)
        assert ours.eye.is_at_infinity == parallel
        assert np.abs(ours.project(volume.centre) - np.array(SIZE) / 2).max() < 1e-3


def test_float32_matrices_of_a_library(volume, rng):
    """PyGLM's: its lookAt and perspective place the points to a small part of a pixel."""
    reach = float(np.linalg.norm(volume.extent))
    for _ in range(10):
        eye = volume.centre + 2 * reach * rng.normal(size=3)
        view = glm.lookAt(glm.vec3(*eye), glm.vec3(*volume.centre), glm.vec3(0, 1, 0))
        projection = glm.perspective(0.6, SIZE[0] / SIZE[1], 0.1, 1000)
        ours = seen_in_world(HostView(projection, view, SIZE), np.eye(4), volume)
        truth = View.look_at(eye, volume.centre, (0, 1, 0), np.degrees(0.6), SIZE)
        points = points_in(volume, rng)
        assert np.abs(ours.project(points) - truth.project(points)).max() < HOST_FLOAT32_PIXELS


def test_the_near_distance_is_the_eyes(volume):
    view = View.look_at(volume.centre + 40, volume.centre, (0, 1, 0), 40, SIZE)
    host = HostView(view.clip_from_world(1, 99), np.eye(4), SIZE)
    assert seen_in_world(host, np.eye(4), volume, 3.5).eye.near == 3.5
    assert isinstance(seen_in_world(host, np.eye(4), volume).eye, Eye)


@pytest.mark.parametrize(
    "projection, view, pixels, said",
    [
        (np.eye(3), np.eye(4), SIZE, r"clip_from_view is a \(4, 4\) matrix"),
        (np.eye(4), np.full((4, 4), np.nan), SIZE, "view_from_host is .* finite"),
        (np.eye(4), "none", SIZE, "view_from_host"),
        (
            np.eye(4),
            np.array(glm.translate(glm.vec3(1, 2, 3))).T,
            SIZE,
            r"transposed.*\[1.0, 2.0, 3.0\].*\.T",
        ),
        (np.diag([1.0, 1, 0, 1]), np.eye(4), SIZE, "singular"),
        (np.array([[1, 0, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, -1, 0.0]]), np.eye(4), SIZE, "singular"),
        (np.zeros((4, 4)), np.eye(4), SIZE, "singular"),
        (-np.eye(4), np.eye(4), SIZE, "w < 0"),
        (np.eye(4), np.eye(4), (0, 10), "pixels"),
        (np.eye(4), np.eye(4), 7, "pixels"),
    ],
)
def test_what_is_no_view_is_refused(volume, projection, view, pixels, said):
    with pytest.raises(ViewError, match=said):
        seen_in_world(HostView(projection, view, pixels), np.eye(4), volume)
