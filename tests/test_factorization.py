"""The paper's matrices, and that our tangents are the same rays."""

import numpy as np
import pytest
from tolerances import MATRIX
from views import random_pose

from persp_sw import View, Volume
from persp_sw.errors import ViewError
from persp_sw.geometry.factorization import factorize, viewport_from_world
from persp_sw.geometry.sight import tangents
from persp_sw.volume.levels import STANDARD_AXES


def random_view(rng):
    """A random pose and a view from outside; returns the matrices and the object-space eye."""
    pose = random_pose(rng, spacing=rng.uniform(0.5, 2, 3), mirrored=rng.random() < 0.5, shear=0.2)
    volume = Volume(np.zeros((20, 30, 25), np.uint8), world_from_object=pose)
    away = rng.normal(size=3)
    eye = volume.centre + 90 * away / np.linalg.norm(away)
    view = View.look_at(eye, volume.centre + rng.normal(size=3), rng.normal(size=3), 50, (320, 200))
    matrix = viewport_from_world(view) @ pose
    return volume, view, matrix, np.linalg.solve(pose, (*eye, 1))[:3]


def relative(a, b):
    return np.abs(a - b).max() / np.abs(b).max()


@pytest.mark.parametrize("seed", range(5))
def test_the_product_is_the_viewing_matrix_in_rows_x_y_w(seed):
    rng = np.random.default_rng(seed)
    for _ in range(100):
        _, _, matrix, eye = random_view(rng)
        for axis in range(3):
            f = factorize(matrix, axis, scale=rng.uniform(0.5, 3), size=rng.uniform(10, 500, 2))
            assert relative(f.eye[:3] / f.eye[3], eye[list(STANDARD_AXES[axis])]) < MATRIX
            product = f.viewport_from_intermediate @ f.intermediate_from_object
            assert relative(product[[0, 1, 3]], matrix[[0, 1, 3]]) < MATRIX
            assert np.linalg.matrix_rank(f.intermediate_from_object) == 3  # so row z cannot hold


@pytest.mark.parametrize("seed", range(5))
def test_projection_and_warp_may_be_permuted(seed):
    """Section 2.4: w02 = w12 = 0, and w32 = 0, which the paper does not ask for but needs."""
    rng = np.random.default_rng(seed)
    project = np.diag([1.0, 1, 0, 1])
    for _ in range(100):
        _, _, matrix, _ = random_view(rng)
        for axis in range(3):
            f = factorize(matrix, axis)
            warp = matrix @ f.standard_from_object.T @ np.linalg.inv(f.deformed_from_standard)
            assert np.abs(warp[[0, 1, 3], 2]).max() < MATRIX * np.abs(warp).max()
            one, other = project @ warp, warp @ project
            assert relative(other[[0, 1, 3]], one[[0, 1, 3]]) < MATRIX


def test_any_point_through_the_base_plane_lands_where_direct_projection_puts_it(rng):
    for _ in range(50):
        volume, view, matrix, _ = random_view(rng)
        points = rng.uniform(0, np.array(volume.size) - 1, (40, 3))
        world = points @ volume.world_from_object[:3, :3].T + volume.world_from_object[:3, 3]
        direct = view.project(world)
        for axis in range(3):
            f = factorize(matrix, axis, scale=1.7, size=(300, 200))
            base = f.intermediate_from_object @ np.column_stack([points, np.ones(40)]).T
            base /= base[3]  # a pixel of the intermediate image
            at = f.viewport_from_intermediate @ base
            np.testing.assert_allclose((at[:2] / at[3]).T, direct, atol=1e-7)


def test_tangents_are_the_papers_base_plane_seen_from_the_eye(rng):
    """Base plane point = eye + tangent · distance of the base plane: a scale and a shift apart."""
    for _ in range(50):
        volume, _, matrix, eye = random_view(rng)
        points = rng.uniform(0, np.array(volume.size) - 1, (40, 3))
        for axis in range(3):
            f = factorize(matrix, axis)
            base = f.intermediate_from_object @ np.column_stack([points, np.ones(40)]).T
            base = (base[:2] / base[3]).T
            e = eye[list(STANDARD_AXES[axis])]
            sign = 1 if e[2] < 0 else -1
            t = tangents(points - eye, axis, sign)[:, :2]
            np.testing.assert_allclose(base, e[:2] + t * (sign * -e[2]), atol=1e-6)


def test_an_eye_in_the_base_plane_is_refused():
    view = View.look_at((50, 50, 0), (5, 5, 5), (0, 1, 0), 40, (32, 32))
    matrix = viewport_from_world(view)
    matrix[np.abs(matrix) < 1e-15] = 0
    f = factorize(matrix, 0)
    assert np.isfinite(f.viewport_from_intermediate).all()
    exact = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [0, 1, 0, -5]])
    with pytest.raises(ViewError, match="base plane"):
        factorize(exact, 2)
