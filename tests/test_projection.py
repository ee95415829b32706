"""Off-axis projection: a wall's corners land in the picture's corners, as the renderer's views have it."""

from __future__ import annotations

import numpy as np
import pytest

import persp_sw as psw
from vr_plugin.projection import clip_from_view_space

CORNER_TOLERANCE = 1e-10


def random_wall(rng, sheared: bool = False) -> psw.Wall:
    right, up = np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]
    low = rng.normal(size=3)
    width, height = rng.uniform(0.5, 4, 2)
    lean = 0.4 * right if sheared else 0
    return psw.Wall(low, low + width * right, low + height * (up + lean), (400, 300))


def front_of(wall: psw.Wall, rng) -> np.ndarray:
    across, up = wall.lower_right - wall.lower_left, wall.upper_left - wall.lower_left
    normal = np.cross(across, up) / np.linalg.norm(np.cross(across, up))
    return (
        wall.lower_left + rng.uniform(-1, 2) * across + rng.uniform(-1, 2) * up + rng.uniform(0.1, 3) * normal
    )


@pytest.mark.parametrize("sheared", [False, True])
def test_corners_of_the_wall_are_corners_of_the_picture(rng, sheared):
    for _ in range(100):
        wall = random_wall(rng, sheared)
        eye = front_of(wall, rng)
        projection, view = clip_from_view_space(eye, wall, 0.05, 50.0)
        corners = [wall.lower_left, wall.lower_right, wall.upper_left]
        corners.append(wall.lower_right + wall.upper_left - wall.lower_left)
        for corner, expected in zip(corners, [(-1, -1), (1, -1), (-1, 1), (1, 1)], strict=True):
            x, y, _, w = projection @ view @ [*corner, 1]
            assert w > 0
            np.testing.assert_allclose([x / w, y / w], expected, atol=CORNER_TOLERANCE)


def test_points_land_where_the_renderer_sees_them(rng):
    for _ in range(50):
        wall = random_wall(rng)
        eye = front_of(wall, rng)
        projection, view = clip_from_view_space(eye, wall, 0.05, 50.0)
        point = eye + (wall.lower_left + rng.uniform(-0.5, 1.5, 3) - eye) * rng.uniform(0.2, 3)
        column, row = psw.View.through_wall(eye, wall).project(point)
        if np.isnan(column):
            continue
        x, y, _, w = projection @ view @ [*point, 1]
        np.testing.assert_allclose(
            [(x / w + 1) / 2 * 400, (1 - y / w) / 2 * 300], [column, row], rtol=1e-9, atol=1e-7
        )


def test_depth_runs_from_minus_one_to_one(rng):
    wall = psw.Wall((-1, -1, -2), (1, -1, -2), (-1, 1, -2), (100, 100))
    projection, view = clip_from_view_space(np.zeros(3), wall, 0.5, 8.0)
    for depth, expected in ((0.5, -1.0), (8.0, 1.0)):
        _, _, z, w = projection @ view @ [0, 0, -depth, 1]
        assert z / w == pytest.approx(expected, abs=1e-12)


def test_a_wall_seen_from_behind_is_still_a_window():
    wall = psw.Wall((-1, -1, 0), (1, -1, 0), (-1, 1, 0), (100, 100))
    projection, view = clip_from_view_space(np.array([0.2, 0.1, -1.5]), wall, 0.1, 10)
    for corner, expected in (((-1, -1, 0), (-1, -1)), ((1, -1, 0), (1, -1)), ((-1, 1, 0), (-1, 1))):
        x, y, _, w = projection @ view @ [*corner, 1]
        assert w > 0
        np.testing.assert_allclose([x / w, y / w], expected, atol=CORNER_TOLERANCE)
