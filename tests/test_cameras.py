"""Cameras and their moves: what must stay the same, what must be exact, and that frames do not matter."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from tolerances import MATRIX, ROUNDING

import persp_sw as psw
from vr_plugin.cameras import STEEPEST, Camera, CameraError
from vr_plugin.preview.navigation import (
    DISTANCES,
    ORBIT_PER_HEIGHT,
    SPEED_PER_NOTCH,
    SPIN_PER_SECOND,
    STYLES,
    ZOOM_PER_NOTCH,
    Navigator,
)

UP = np.array([0.0, 0.0, 1.0])
SIZE = (320, 200)


@pytest.fixture
def camera() -> Camera:
    return Camera.look_at((40, -50, 35), (11, 12, 13), UP, np.radians(40))


def pixel(camera: Camera, point: np.ndarray) -> np.ndarray:
    return psw.View.through_wall(camera.position, camera.wall(SIZE)).project(point)


def angle_between(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))


# --- the camera --------------------------------------------------------------------------------------------


def test_look_at_is_the_view_of_that_name(camera: Camera):
    view = psw.View.look_at((40, -50, 35), (11, 12, 13), UP, 40, SIZE)
    ours = psw.View.through_wall(camera.position, camera.wall(SIZE))
    np.testing.assert_allclose(ours.direction_from_pixel, view.direction_from_pixel, atol=MATRIX)
    again = Camera.of_view(view)
    np.testing.assert_allclose(again.pose.matrix, camera.pose.matrix, atol=MATRIX)
    assert (again.distance, again.fovy) == pytest.approx((camera.distance, camera.fovy), abs=MATRIX)


def test_a_parallel_view_becomes_a_camera_that_shows_as_much(camera: Camera):
    view = psw.View.parallel((40, -50, 35), (11, 12, 13), UP, 25, SIZE)
    ours = Camera.of_view(view)
    assert 2 * ours.half_height == pytest.approx(25, abs=MATRIX)
    np.testing.assert_allclose(ours.pivot, (11, 12, 13), atol=MATRIX)
    assert angle_between(ours.axes[2], view.eye.position) < MATRIX


def test_look_at_from_straight_above_is_a_camera():
    camera = Camera.look_at((0, 0, 5), (0, 0, 0), UP, 1.0)
    np.testing.assert_allclose(camera.axes @ camera.axes.T, np.eye(3), atol=MATRIX)
    np.testing.assert_allclose(camera.axes[2], UP, atol=MATRIX)


@pytest.mark.parametrize(
    "values", [((0, 0, 0), (0, 0, 0), 1.0), ((1, 0, 0), (0, 0, 0), 0.0), ((1, 0, 0), (0, 0, 0), np.pi)]
)
def test_impossible_cameras_are_refused(values: tuple):
    eye, pivot, fovy = values
    with pytest.raises(CameraError):
        Camera.look_at(eye, pivot, UP, fovy)


def test_the_pivot_has_no_parallax_and_nearer_things_stand_before_the_screen(camera: Camera):
    eyes = camera.eyes(1 / 30)
    assert np.linalg.norm(eyes.right - eyes.left) == pytest.approx(camera.distance / 30, rel=ROUNDING)
    wall = camera.wall(SIZE)
    left, right = (psw.View.through_wall(eye, wall) for eye in eyes)
    middle = np.array(SIZE) / 2
    np.testing.assert_allclose([left.project(camera.pivot), right.project(camera.pivot)], [middle] * 2)
    # By similar triangles: at depth z, separation · (z − distance) / z on the screen.
    for depth in (0.5, 0.8, 2.0, 1e6):
        point = camera.position - camera.axes[2] * (depth * camera.distance)
        expected = 1 / 30 * camera.distance * (1 - 1 / depth) * SIZE[1] / (2 * camera.half_height)
        shift = right.project(point) - left.project(point)
        np.testing.assert_allclose(shift, (expected, 0), atol=1e-6)


# --- orbit -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("angles", [(0.7, 0.3), (-2.0, -0.4), (9.0, 0.0)])
def test_a_turntable_keeps_distance_pivot_and_level_and_turns_by_the_angles(camera: Camera, angles: tuple):
    azimuth, elevation = angles
    turned = camera.on_turntable(azimuth, elevation, UP)
    np.testing.assert_allclose(turned.pivot, camera.pivot, atol=MATRIX)
    assert np.linalg.norm(turned.position - camera.pivot) == pytest.approx(camera.distance, rel=MATRIX)
    assert turned.axes[0] @ UP == pytest.approx(0, abs=MATRIX)  # level
    assert turned.axes[1] @ UP > 0  # not upside down
    assert turned.steepness(UP) - camera.steepness(UP) == pytest.approx(elevation, abs=MATRIX)
    before, after = (c.axes[2][:2] for c in (camera, turned))
    turn = np.arctan2(before[0] * after[1] - before[1] * after[0], before @ after)
    assert np.cos(turn - azimuth) == pytest.approx(1, abs=MATRIX)


def test_a_turntable_never_goes_over_the_top(camera: Camera):
    for way in (5.0, -5.0):
        over = camera.on_turntable(0, way, UP)
        assert over.steepness(UP) == pytest.approx(np.sign(way) * STEEPEST, abs=1e-9)
        assert over.on_turntable(0, way, UP).steepness(UP) == pytest.approx(over.steepness(UP), abs=1e-9)
        assert over.on_turntable(0, -way, UP).steepness(UP) == pytest.approx(
            -np.sign(way) * STEEPEST, abs=1e-9
        )


def test_a_trackball_keeps_distance_and_pivot_and_goes_over_the_top(camera: Camera):
    turned = camera
    for _ in range(8):
        turned = turned.on_trackball(0.0, np.pi / 4)
        np.testing.assert_allclose(turned.pivot, camera.pivot, atol=MATRIX)
        assert np.linalg.norm(turned.position - camera.pivot) == pytest.approx(camera.distance, rel=MATRIX)
    np.testing.assert_allclose(turned.pose.matrix, camera.pose.matrix, atol=1e-9)  # once around
    assert camera.on_trackball(0.0, np.pi).axes[1] @ UP < 0
    assert camera.on_trackball(0.0, 0.0) is camera


def test_small_turns_of_both_orbits_are_the_same(camera: Camera):
    level = Camera.look_at((40, -50, 13), (11, 12, 13), UP, 0.7)
    one, two = level.on_turntable(1e-5, 1e-5, UP), level.on_trackball(1e-5, 1e-5)
    np.testing.assert_allclose(one.axes, two.axes, atol=2e-10)  # second order: 1e-5²


# --- zoom, pan ---------------------------------------------------------------------------------------------


def test_zoom_towards_the_pivot_never_crosses_it(camera: Camera):
    zoomed = camera
    for _ in range(100):  # to 2e-10 of the distance
        zoomed = zoomed.zoomed(0.8)
        assert (zoomed.position - camera.pivot) @ camera.axes[2] > 0
        np.testing.assert_allclose(zoomed.pivot, camera.pivot, atol=MATRIX)
    np.testing.assert_allclose(camera.zoomed(0.5).position, (camera.position + camera.pivot) / 2, atol=MATRIX)


def test_zoom_towards_a_point_keeps_it_under_the_pointer(camera: Camera):
    point = camera.point_at(0.9, -0.6)
    expected = np.array([0.9 * SIZE[1] / 2 + SIZE[0] / 2, SIZE[1] / 2 + 0.6 * SIZE[1] / 2])
    for factor in (0.3, 0.9, 2.5):
        np.testing.assert_allclose(pixel(camera.zoomed(factor, point), point), expected, atol=1e-8)


def test_pan_moves_what_is_at_the_pivot_by_so_many_pixels(camera: Camera):
    moved = camera.panned(0.5, 0.25)
    shift = pixel(moved, camera.pivot) - pixel(camera, camera.pivot)
    np.testing.assert_allclose(shift, (0.5 * SIZE[1] / 2, -0.25 * SIZE[1] / 2), atol=1e-8)
    np.testing.assert_array_equal(moved.axes, camera.axes)


# --- looking around ----------------------------------------------------------------------------------------


def test_looking_around_turns_the_camera_where_it_stands(camera: Camera):
    looked = camera.looking(0.4, 0.2, UP)
    np.testing.assert_allclose(looked.position, camera.position, atol=MATRIX)
    assert camera.steepness(UP) - looked.steepness(UP) == pytest.approx(0.2, abs=MATRIX)
    assert -looked.axes[2] @ camera.axes[0] > 0  # rightwards
    assert looked.axes[0] @ UP == pytest.approx(0, abs=MATRIX)
    assert abs(camera.looking(0, 9, UP).steepness(UP)) == pytest.approx(STEEPEST, abs=1e-9)


# --- in time -----------------------------------------------------------------------------------------------


def navigator(camera: Camera, style: str = "turntable") -> Navigator:
    hand = Navigator(camera, 3 * UP, 20.0)
    hand.style = style
    return hand


def run(hand: Navigator, seconds: float, frames: int) -> Camera:
    for _ in range(frames):
        hand.advance(seconds / frames)
    return hand.camera


def test_a_drag_over_the_height_goes_half_around_and_what_is_seen_follows(camera: Camera):
    hand = navigator(camera)
    front = camera.point_at(0, 0) + camera.axes[2]  # of what is at the pivot
    hand.turn(0.1, 0.0)
    run(hand, 2.0, 50)
    assert hand.at_rest
    assert pixel(hand.camera, front)[0] > pixel(camera, front)[0] + 1
    expected = camera.on_turntable(-0.1 * ORBIT_PER_HEIGHT, 0, UP)  # half around for a height
    np.testing.assert_allclose(hand.camera.pose.matrix, expected.pose.matrix, atol=1e-9)
    hand.reset()
    hand.turn(0.0, 0.1)
    assert pixel(run(hand, 2.0, 50), front)[1] > pixel(camera, front)[1] + 1
    assert hand.camera.steepness(UP) - camera.steepness(UP) == pytest.approx(0.1 * ORBIT_PER_HEIGHT)


def test_in_flight_a_drag_turns_by_what_the_picture_shows(camera: Camera):
    hand = navigator(camera, "fly")
    hand.turn(0.0, 0.25)
    turned = run(hand, 2.0, 50)
    np.testing.assert_allclose(turned.position, camera.position, atol=MATRIX)
    assert angle_between(turned.axes[2], camera.axes[2]) == pytest.approx(0.25 * camera.fovy, rel=1e-9)


@pytest.mark.parametrize("style", STYLES)
def test_every_frame_rate_makes_the_same_moves(camera: Camera, style: str):
    def at(frames: int) -> Camera:
        hand = navigator(camera, style)
        hand.turn(0.3, 0.0)
        hand.wheel(2.0)
        return run(hand, 0.1, frames)

    few, many = at(2), at(64)
    np.testing.assert_allclose(few.pose.matrix, many.pose.matrix, atol=1e-9)
    assert angle_between(few.axes[2], camera.axes[2]) > 0.01  # under way …
    assert few.distance == pytest.approx(many.distance)


def test_a_drag_is_carried_out_smoothly_and_wholly(camera: Camera):
    hand = navigator(camera)
    hand.turn(0.5, 0.0)
    turns = []
    for _ in range(60):
        before = hand.camera.axes[2] * (1, 1, 0)
        turns.append(angle_between(before, hand.advance(1 / 60).axes[2] * (1, 1, 0)))
    assert all(b <= a + 1e-5 for a, b in pairwise(turns))  # what is left at last is below a pixel
    assert sum(turns) == pytest.approx(0.5 * ORBIT_PER_HEIGHT, rel=1e-9)
    assert hand.at_rest


def test_flights_are_speed_times_time(camera: Camera):
    hand = navigator(camera, "fly")
    hand.speed = 0.25
    hand.hold((0, 0, -1))
    run(hand, 2.0, 47)
    hand.hold((0, 0, 0))
    run(hand, 3.0, 31)
    way = hand.camera.position - camera.position
    np.testing.assert_allclose(way, -camera.axes[2] * (0.25 * 20.0 * 2.0), atol=1e-9)
    assert hand.at_rest


def test_flights_at_every_frame_rate_are_the_same(camera: Camera):
    ends = []
    for frames in (1, 7, 200):
        hand = navigator(camera, "fly")
        hand.hold((1, 0.5, -1))
        ends.append(run(hand, 0.2, frames).position)
    np.testing.assert_allclose(ends[1:], [ends[0]] * 2, atol=1e-9)
    full = hand.speed * 20.0 * 0.2 * 1.5
    assert 0.1 * full < np.linalg.norm(ends[0] - camera.position) < full  # it does not start at once


def test_arrow_keys_spin_by_rate_times_time(camera: Camera):
    hand = navigator(camera)
    hand.hold((0, 0, 0), (1, 0))
    run(hand, 1.0, 20)
    hand.hold((0, 0, 0), (0, 0))
    run(hand, 3.0, 60)
    expected = camera.on_turntable(SPIN_PER_SECOND, 0, UP)
    np.testing.assert_allclose(hand.camera.pose.matrix, expected.pose.matrix, atol=1e-9)


def test_the_wheel_zooms_an_orbit_and_speeds_a_flight(camera: Camera):
    hand = navigator(camera)
    hand.wheel(3)
    assert run(hand, 2.0, 40).distance == pytest.approx(camera.distance / ZOOM_PER_NOTCH**3)
    hand.style = "fly"
    speed = hand.speed
    hand.wheel(2)
    hand.wheel(-1)
    assert hand.speed == pytest.approx(speed * SPEED_PER_NOTCH)
    assert hand.at_rest


def test_the_wheel_keeps_what_is_under_the_pointer_all_the_way(camera: Camera):
    hand = navigator(camera)
    point = camera.point_at(0.5, 0.5)
    at = pixel(camera, point)
    hand.wheel(6, 0.5, 0.5)
    for _ in range(30):
        hand.advance(1 / 60)
        np.testing.assert_allclose(pixel(hand.camera, point), at, atol=1e-6)


def test_zoom_stops_near_the_pivot_and_far_away(camera: Camera):
    hand = navigator(camera)
    for notches, limit in ((500, DISTANCES[0]), (-1000, DISTANCES[1])):
        hand.wheel(notches)
        assert run(hand, 3.0, 100).distance == pytest.approx(limit * 20.0)


def test_a_pan_follows_the_pointer(camera: Camera):
    hand = navigator(camera)
    hand.pan(0.1, -0.2)
    shift = pixel(run(hand, 2.0, 30), camera.pivot) - pixel(camera, camera.pivot)
    np.testing.assert_allclose(shift, (0.1 * SIZE[1], -0.2 * SIZE[1]), atol=1e-6)


def test_reset_ends_all_that_is_under_way(camera: Camera):
    hand = navigator(camera, "fly")
    hand.turn(1, 1)
    hand.hold((1, 1, 1))
    hand.advance(0.3)
    assert not hand.at_rest
    hand.reset()
    assert hand.camera is camera
    hand.advance(1.0)
    np.testing.assert_array_equal(hand.camera.pose.matrix, camera.pose.matrix)


def test_a_style_that_knows_an_up_levels_the_camera(camera: Camera):
    hand = navigator(camera, "trackball")
    hand.turn(0.3, 0.1)
    hand.turn(-0.1, 0.2)
    tilted = run(hand, 1.0, 3).turned(hand.camera.axes[2], 0.4)
    hand.camera = tilted
    hand.style = "turntable"
    assert hand.camera.axes[0] @ UP == pytest.approx(0, abs=MATRIX)
    np.testing.assert_allclose(hand.camera.position, tilted.position)
    np.testing.assert_allclose(hand.camera.pivot, tilted.pivot, atol=MATRIX)
