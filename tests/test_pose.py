"""Poses: turns against known ones, products against matrices."""

from __future__ import annotations

import numpy as np
import pytest

from vr_plugin.pose import Pose, PoseError, between, quaternion_of, rotation_of, turn_about


def random_pose(rng) -> Pose:
    return Pose(rng.normal(size=3), rng.normal(size=4))


def test_a_quarter_turn_about_y_takes_x_to_minus_z():
    pose = Pose((1, 2, 3), turn_about((0, 1, 0), np.pi / 2))
    np.testing.assert_allclose(pose.apply([1, 0, 0]), [1, 2, 2], atol=1e-15)


def test_products_and_inverses_are_those_of_matrices(rng):
    for _ in range(50):
        a, b = random_pose(rng), random_pose(rng)
        np.testing.assert_allclose((a @ b).matrix, a.matrix @ b.matrix, atol=1e-14)
        np.testing.assert_allclose((a @ a.inverse()).matrix, np.eye(4), atol=1e-14)
        np.testing.assert_allclose(Pose.from_matrix(a.matrix).matrix, a.matrix, atol=1e-12)


def test_a_quaternion_is_found_for_every_turn(rng):
    turns = [turn_about(axis, np.pi) for axis in np.eye(3)] + list(rng.normal(size=(50, 4)))
    for turn in turns:
        rotation = rotation_of(turn / np.linalg.norm(turn))
        np.testing.assert_allclose(rotation_of(quaternion_of(rotation)), rotation, atol=1e-12)


def test_between_goes_the_short_way_at_constant_speed():
    a, b = Pose((0, 0, 0)), Pose((2, 0, 0), -turn_about((0, 1, 0), 1.0))  # the same turn, other sign
    for share in (0.0, 0.25, 1.0, 1.5):
        pose = between(a, b, share)
        np.testing.assert_allclose(pose.position, [2 * share, 0, 0], atol=1e-15)
        np.testing.assert_allclose(
            rotation_of(pose.orientation), rotation_of(turn_about((0, 1, 0), share)), atol=1e-12
        )
    np.testing.assert_allclose(between(a, a, 0.5).matrix, np.eye(4), atol=1e-15)


@pytest.mark.parametrize(
    ("position", "orientation"),
    [((0, 0, np.nan), (0, 0, 0, 1)), ((0, 0, 0), (0, 0, 0, 0)), ((0, 0), (0, 0, 0, 1))],
)
def test_what_is_no_pose_is_refused(position, orientation):
    with pytest.raises(PoseError, match="given"):
        Pose(position, orientation)


def test_a_matrix_that_scales_or_mirrors_is_no_pose():
    for matrix in (np.diag([2.0, 2, 2, 1]), np.diag([-1.0, 1, 1, 1]), np.eye(3)):
        with pytest.raises(PoseError):
            Pose.from_matrix(matrix)
