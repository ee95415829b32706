"""Where a volume stands in the room."""

from __future__ import annotations

import numpy as np
import pytest
from rigs import rig_of
from tolerances import MATRIX
from views import random_pose

import persp_sw as psw
from vr_plugin.placement import corners_in_room, room_from_world
from vr_plugin.rigs.similarity import flaw_of


def volume_of(pose=None, size=(5, 9, 17), **others) -> psw.Volume:
    return psw.Volume(np.zeros(size[::-1], np.uint8), world_from_object=pose, **others)


def test_a_patient_stands_upright_and_faces_the_viewer():
    matrix = room_from_world(rig_of(), volume_of())[:3, :3]
    matrix = matrix / np.cbrt(np.linalg.det(matrix))
    for lps, room in (((1, 0, 0), (1, 0, 0)), ((0, 1, 0), (0, 0, -1)), ((0, 0, 1), (0, 1, 0))):
        np.testing.assert_allclose(matrix @ lps, room, atol=MATRIX)


def test_a_file_whose_axes_run_the_other_way_stands_no_other_way():
    """RAS axes in an LPS world: the voxels' y runs to the nose, towards the viewer; x to the right hand."""
    volume = volume_of(np.diag([-2.0, -2, 2, 1]), orientation="RAS")
    corners = corners_in_room(room_from_world(rig_of(), volume), volume)
    along_x, along_y, along_z = corners[[1, 2, 4]] - corners[0]
    assert along_x[0] < 0 and along_y[2] > 0 and along_z[1] > 0
    for edge in (along_x, along_y, along_z):
        assert np.count_nonzero(np.abs(edge) > 1e-12) == 1


def test_any_pose_is_placed_by_a_similarity_of_the_right_size_and_place(rng):
    rig = rig_of(world={"size": 1.3, "centre": [0.1, 1.2, -0.3]})
    for mirrored in (False, True):
        volume = volume_of(random_pose(rng, spacing=(1, 2, 0.5), mirrored=mirrored))
        matrix = room_from_world(rig, volume)
        assert flaw_of(matrix) is None  # so not mirrored, whatever the file
        corners = corners_in_room(matrix, volume)
        np.testing.assert_allclose(corners.mean(0), (0.1, 1.2, -0.3), atol=1e-9)
        edges = np.linalg.norm(corners[[1, 2, 4]] - corners[0], axis=1)
        assert edges.max() == pytest.approx(1.3) and edges.argmax() == 1  # 8 · 2, above 4 · 1 and 16 · 0.5


def test_by_default_a_metre_long_in_the_middle_at_eye_height():
    rig = rig_of(eyes={"rest_pose": {"position": [0.5, 1.1, 2]}})
    corners = corners_in_room(room_from_world(rig, volume_of()), volume_of())
    np.testing.assert_allclose(corners.mean(0), (0, 1.1, -2), atol=1e-9)
    assert np.ptp(corners, axis=0).max() == pytest.approx(1)


def test_the_rigs_own_matrix_is_taken_as_it_is():
    rows = [[0, 0, 0.001, 1], [0.001, 0, 0, 2], [0, 0.001, 0, 3], [0, 0, 0, 1]]
    assert room_from_world(rig_of(world={"room_from_world": rows}), volume_of()).tolist() == rows


def test_a_single_voxel_has_a_place_too():
    volume = psw.Volume(np.ones((1, 1, 1), np.uint8), (2, 2, 2))
    matrix = room_from_world(rig_of(), volume)
    assert np.isfinite(matrix).all()
    assert np.cbrt(np.linalg.det(matrix[:3, :3])) == pytest.approx(0.5)
