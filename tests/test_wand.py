"""What a hand does to a volume: rigid while it holds, about the hand when it scales, planes in world."""

from __future__ import annotations

import numpy as np
import pytest
from tolerances import MATRIX
from tracker_samples import pose_sample, random_pose

from vr_plugin.pose import Pose, turn_about
from vr_plugin.trackers import Bindings, Sample, Wand


def similarity(rng: np.random.Generator) -> np.ndarray:
    matrix = random_pose(rng).matrix
    matrix[:3, :3] *= rng.uniform(0.001, 0.01)
    return matrix


def buttons(*pressed: int, sensor: int = 0) -> Sample:
    return Sample(0.0, sensor, kind="buttons", buttons=tuple(i in pressed for i in range(4)))


def axes(*values: float) -> Sample:
    return Sample(0.0, 0, kind="axes", axes=values)


def hand(pose: Pose, stamp: float = 0.0, sensor: int = 0) -> Sample:
    return Sample(stamp, sensor, pose)


def apply(matrix: np.ndarray, point: object) -> np.ndarray:
    return matrix[:3, :3] @ np.asarray(point) + matrix[:3, 3]


def test_a_grabbed_volume_is_rigid_with_the_hand(rng):
    for _ in range(10):
        start = similarity(rng)
        wand, first = Wand(start), random_pose(rng)
        wand.update([hand(first), buttons(0)], 0.0)
        assert wand.grabbed
        np.testing.assert_allclose(wand.room_from_world, start, atol=MATRIX)
        for i in range(1, 20):
            now = random_pose(rng)
            assert wand.update([hand(now, i / 60)], i / 60)
            relation = now.inverse().matrix @ wand.room_from_world
            np.testing.assert_allclose(relation, first.inverse().matrix @ start, atol=MATRIX)
        released = wand.room_from_world
        wand.update([buttons()], 1.0)
        assert not wand.update([hand(random_pose(rng), 1.0)], 1.0)
        assert not wand.grabbed
        np.testing.assert_array_equal(wand.room_from_world, released)
        scales = [np.cbrt(np.linalg.det(m[:3, :3])) for m in (start, released)]
        assert scales[1] == pytest.approx(scales[0], rel=1e-10)


def test_a_hand_that_comes_back_where_it_grabbed_leaves_all_as_it_was(rng):
    start, first = similarity(rng), random_pose(rng)
    wand = Wand(start)
    samples = [hand(first), buttons(0)]
    samples += [hand(random_pose(rng), i / 100) for i in range(1, 50)] + [hand(first, 0.5), buttons()]
    for i, sample in enumerate(samples):
        wand.update([sample], i / 100)
    np.testing.assert_allclose(wand.room_from_world, start, atol=MATRIX)


def test_scaling_leaves_the_point_in_the_hand_where_it_is(rng):
    start, at = similarity(rng), random_pose(rng)
    world_point = apply(np.linalg.inv(start), at.position)
    wand = Wand(start)
    wand.update([hand(at), axes(0.0, 1.0)], 0.0)
    for i in range(1, 61):
        assert wand.update([], i / 60)
        np.testing.assert_allclose(apply(wand.room_from_world, world_point), at.position, atol=MATRIX)
    # A second at full deflection: exp(1). Axes and turn stay.
    np.testing.assert_allclose(wand.room_from_world[:3, :3], np.e * start[:3, :3], rtol=1e-9)
    wand.update([axes(0.0, -1.0)], 1.0)
    for i in range(61, 121):
        wand.update([], i / 60)
    np.testing.assert_allclose(wand.room_from_world, start, atol=1e-9)


def test_frames_do_not_matter_to_scaling(rng):
    start = similarity(rng)
    ends = []
    for rate in (20, 60, 200):
        wand = Wand(start)
        wand.update([hand(Pose((1, 1, 1))), axes(0.7, 0.6)], 0.0)
        for i in range(1, 2 * rate + 1):
            wand.update([], i / rate)
        ends.append(wand.room_from_world[:3, :3])
    for end in ends[1:]:
        np.testing.assert_allclose(end, ends[0], rtol=1e-9, atol=1e-12)


def test_the_scale_has_limits_and_axes_a_dead_zone(rng):
    start = similarity(rng)
    for axis, factor in ((1.0, 50.0), (-1.0, 0.02)):
        wand = Wand(start)
        wand.update([hand(Pose()), axes(0.0, axis)], 0.0)
        for i in range(1, 1000):
            wand.update([], i / 10)
        np.testing.assert_allclose(wand.room_from_world[:3, :3], factor * start[:3, :3], rtol=1e-9)
    wand = Wand(start)
    wand.update([hand(Pose()), axes(0.14, -0.14)], 0.0)
    assert not wand.update([], 0.1)


def test_the_turning_axis_turns_about_the_vertical_through_the_middle(rng):
    start, centre = similarity(rng), rng.normal(size=3) * 100
    wand = Wand(start, centre_world=centre, bindings=Bindings(dead_zone=0.0))
    wand.update([axes(1.0)], 0.0)
    for i in range(1, 101):
        wand.update([], i * np.pi / 200)
    np.testing.assert_allclose(apply(wand.room_from_world, centre), apply(start, centre), atol=MATRIX)
    quarter = Pose((0, 0, 0), turn_about((0, 1, 0), np.pi / 2)).matrix[:3, :3]
    np.testing.assert_allclose(wand.room_from_world[:3, :3], quarter @ start[:3, :3], atol=MATRIX)


def test_grabbing_and_scaling_at_once_keep_the_hold(rng):
    start, at = similarity(rng), random_pose(rng)
    grip = apply(np.linalg.inv(start), at.position)
    wand = Wand(start)
    wand.update([hand(at), buttons(0), axes(0.0, 1.0)], 0.0)
    for i in range(1, 30):
        at = random_pose(rng)
        wand.update([hand(at, i / 60)], i / 60)
        np.testing.assert_allclose(apply(wand.room_from_world, grip), at.position, atol=1e-9)
    scales = [np.cbrt(np.linalg.det(m[:3, :3])) for m in (start, wand.room_from_world)]
    assert scales[1] / scales[0] == pytest.approx(np.exp(29 / 60))


def test_the_clip_plane_goes_through_the_hand_and_keeps_what_it_points_to(rng):
    for _ in range(10):
        start, at = similarity(rng), random_pose(rng)
        wand = Wand(start)
        assert wand.clip_planes == ()
        wand.update([hand(at), buttons(1)], 0.0)
        (plane,) = wand.clip_planes
        assert np.linalg.norm(plane[:3]) == pytest.approx(1, abs=1e-12)
        scale = np.cbrt(np.linalg.det(start[:3, :3]))
        for ahead in (-0.2, 0.0, 0.3):
            sideways = rng.normal(size=2)
            room = at.apply((*sideways, -ahead))
            distance = plane @ [*apply(np.linalg.inv(start), room), 1]
            assert distance == pytest.approx(ahead / scale, abs=1e-6)  # world units; 1e3 of them a metre
        assert wand.update([hand(random_pose(rng), 0.01)], 0.01)
        moved = wand.clip_plane
        wand.update([buttons()], 0.02)
        assert not wand.update([hand(random_pose(rng), 0.03)], 0.03)
        assert wand.clip_plane is moved


def test_a_plane_stays_in_the_volume_when_this_is_moved(rng):
    wand = Wand(similarity(rng))
    wand.update([hand(random_pose(rng)), buttons(1), buttons(), buttons(0)], 0.0)
    plane = wand.clip_plane
    wand.update([hand(random_pose(rng), 0.01)], 0.01)
    assert wand.clip_plane is plane  # in world, which moves with the volume


def test_reset_puts_all_back_even_while_grabbed(rng):
    start = similarity(rng)
    wand = Wand(start)
    wand.update([hand(random_pose(rng)), buttons(0, 1), hand(random_pose(rng), 0.01)], 0.0)
    assert wand.update([buttons(0, 1, 2)], 0.02)
    np.testing.assert_array_equal(wand.room_from_world, start)
    assert wand.clip_planes == ()
    wand.update([hand(random_pose(rng), 0.03)], 0.03)
    np.testing.assert_array_equal(wand.room_from_world, start)


def test_a_reset_from_outside_takes_the_volume_out_of_the_hand(rng):
    start = similarity(rng)
    wand = Wand(start)
    wand.update([hand(random_pose(rng)), buttons(0), hand(random_pose(rng), 0.01)], 0.0)
    wand.reset()
    assert not wand.update([hand(random_pose(rng), 0.02)], 0.02)
    np.testing.assert_array_equal(wand.room_from_world, start)


def test_a_hand_that_was_not_seen_takes_hold_anew(rng):
    start = similarity(rng)
    wand = Wand(start)
    wand.update([hand(Pose()), buttons(0)], 0.0)
    wand.update([hand(Pose((5, 5, 5)), 2.0)], 2.0)
    np.testing.assert_allclose(wand.room_from_world, start, atol=MATRIX)
    wand.update([hand(Pose((5, 6, 5)), 2.01)], 2.01)
    np.testing.assert_allclose(wand.room_from_world[:3, 3], start[:3, 3] + (0, 1, 0), atol=MATRIX)


def test_others_and_buttons_without_a_hand_do_nothing(rng):
    wand = Wand(similarity(rng), sensor=1)
    samples = [pose_sample(0.0, sensor=0), buttons(0, 1), axes(1.0, 1.0), buttons(0, 1, sensor=1)]
    assert not wand.update(samples, 0.0)
    assert not wand.update([], 0.1)
    assert not wand.grabbed


def test_bindings_choose_buttons(rng):
    wand = Wand(similarity(rng), bindings=Bindings(grab=3, clip=None, reset=None, scale_axis=None))
    assert not wand.update([hand(Pose()), buttons(0, 1, 2), axes(0.0, 1.0)], 0.0)
    wand.update([buttons(3)], 0.1)
    assert wand.grabbed
