"""Flights: through their key views, smoothly, the same in every frame of reference; files that come back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tolerances import FLIGHT_FILE, FLIGHT_SPEED, FLIGHT_TWIN

from vr_plugin.cameras import Camera
from vr_plugin.film.flight import Flight, FlightError, KeyView
from vr_plugin.film.flight_file import load_flight, save_flight
from vr_plugin.film.turntable import turntable
from vr_plugin.pose import Pose, multiply, rotation_of, turn_about

TIMES = (0.5, 1.0, 3.0, 3.4, 6.0)


def random_turn(rng: np.random.Generator) -> np.ndarray:
    turn = rng.standard_normal(4)
    return turn / np.linalg.norm(turn)


def random_flight(rng: np.random.Generator, times: tuple[float, ...] = TIMES) -> Flight:
    return Flight(
        [
            KeyView(
                seconds,
                Camera(
                    Pose(rng.uniform(-50, 50, 3), random_turn(rng)), rng.uniform(1, 9), rng.uniform(0.3, 2)
                ),
            )
            for seconds in times
        ]
    )


def numbers(camera: Camera) -> np.ndarray:
    """All that a camera's picture depends on, as numbers that are continuous in it."""
    return np.concatenate([camera.pose.matrix[:3].ravel(), [camera.distance, camera.fovy]])


def test_it_passes_through_its_key_views_bit_by_bit(rng):
    flight = random_flight(rng)
    for key in flight.keys:
        assert flight.at(key.seconds - TIMES[0]) is key.camera
    assert flight.at(-9) is flight.keys[0].camera
    assert flight.at(99) is flight.keys[-1].camera
    assert flight.duration == 5.5


def test_place_and_orientation_are_continuous_with_their_first_derivatives(rng):
    flight = random_flight(rng)
    step = 1e-4
    for seconds in np.array(TIMES)[1:-1] - TIMES[0]:
        before, here, after = (numbers(flight.at(seconds + k * step)) for k in (-1, 0, 1))
        far_before, far_after = (numbers(flight.at(seconds + k * step)) for k in (-2, 2))
        # One-sided differences of second order; a cubic through such keys has third derivatives below 1e5.
        left = (3 * here - 4 * before + far_before) / (2 * step)
        right = (-3 * here + 4 * after - far_after) / (2 * step)
        np.testing.assert_allclose(left, right, atol=1e5 * step**2)
        assert np.abs(right).max() > 1  # it moves there, so a halt would be no answer


def test_quaternions_stay_unit_and_rooms_right_handed(rng):
    flight = random_flight(rng)
    for seconds in np.linspace(0, flight.duration, 97):
        turn = flight.at(seconds).pose.orientation
        assert abs(np.linalg.norm(turn) - 1) < 1e-12


def test_one_orientation_stays_and_a_straight_line_is_one(rng):
    turn = random_turn(rng)
    eyes = [(k, 2 * k, -k) for k in (0.0, 1, 2, 3)]
    keys = [KeyView(k, Camera(Pose(eye, turn), 5.0, 1.0)) for k, eye in enumerate(eyes)]
    flight = Flight(keys)
    for seconds in np.linspace(0, 3, 31):
        camera = flight.at(seconds)
        np.testing.assert_allclose(camera.pose.orientation, turn, atol=1e-15)
        np.testing.assert_allclose(camera.position, seconds * np.array([1, 2, -1]), atol=1e-12)
        assert (camera.distance, camera.fovy) == pytest.approx((5, 1), abs=1e-12)


def test_a_steady_turn_stays_steady_and_takes_the_shorter_way():
    angles = np.radians([0, 100, 200, 300])
    turns = [turn_about((0, 0, 1), angle) for angle in angles]
    turns[2] = -turns[2]  # the same orientation
    flight = Flight([KeyView(k, Camera(Pose((0, 0, 0), turn), 1.0, 1.0)) for k, turn in enumerate(turns)])
    for seconds in np.linspace(0, 3, 31):
        wanted = rotation_of(turn_about((0, 0, 1), np.radians(100 * seconds)))
        np.testing.assert_allclose(flight.at(seconds).pose.matrix[:3, :3], wanted, atol=1e-12)


def test_turning_and_shifting_all_key_views_turns_and_shifts_the_flight(rng):
    flight, turn, shift = random_flight(rng), random_turn(rng), rng.uniform(-9, 9, 3)
    moved = Pose(shift, turn)
    keys = [KeyView(s, Camera(moved @ c.pose, c.distance, c.fovy)) for s, c in flight.keys]
    other = Flight(keys)
    for seconds in np.linspace(0, flight.duration, 57):
        camera = flight.at(seconds)
        wanted = numbers(Camera(moved @ camera.pose, camera.distance, camera.fovy))
        np.testing.assert_allclose(numbers(other.at(seconds)), wanted, atol=FLIGHT_TWIN)


def test_slower_time_is_the_same_way(rng):
    flight = random_flight(rng)
    slow = Flight([KeyView(3 * s, c) for s, c in flight.keys])
    for seconds in np.linspace(0, flight.duration, 41):
        np.testing.assert_allclose(
            numbers(slow.at(3 * seconds)), numbers(flight.at(seconds)), atol=FLIGHT_TWIN
        )


def test_one_key_view_stays():
    flight = random_flight(np.random.default_rng(1), (2.0,))
    assert (flight.duration, flight.eye_way) == (0, 0)
    assert flight.at(0) is flight.at(7) is flight.keys[0].camera
    assert flight.times(1).tolist() == [0]
    assert flight.times(3, constant_speed=True).tolist() == [0, 0, 0]


def test_times_are_even_and_speed_can_be(rng):
    flight = random_flight(rng)
    np.testing.assert_allclose(flight.times(12), np.linspace(0, 5.5, 12))
    times = flight.times(400, constant_speed=True)
    assert (times[0], times[-1]) == (0, 5.5)
    steps = np.linalg.norm(np.diff([flight.at(seconds).position for seconds in times], axis=0), axis=-1)
    assert np.abs(steps / steps.mean() - 1).max() < FLIGHT_SPEED
    assert steps.sum() == pytest.approx(flight.eye_way, rel=1e-3)  # chords of another length
    evenly = np.linalg.norm(np.diff([flight.at(t).position for t in flight.times(400)], axis=0), axis=-1)
    assert evenly.max() > 3 * evenly.min()  # so this flight is a test


def test_a_rest_takes_no_time_at_constant_speed():
    turn = turn_about((0, 1, 0), 0.0)
    eyes = ((0.0, 0, 0), (10.0, 0, 0), (10.0, 0, 0), (20.0, 0, 0))
    flight = Flight([KeyView(k, Camera(Pose(eye, turn), 1.0, 1.0)) for k, eye in enumerate(eyes)])
    eyes = np.array([flight.at(seconds).position for seconds in flight.times(50, constant_speed=True)])
    steps = np.linalg.norm(np.diff(eyes, axis=0), axis=-1)
    # The eye rests by swinging beyond and back: at both turning points a step is shorter.
    assert (np.abs(steps / np.median(steps) - 1) > FLIGHT_SPEED).sum() <= 2


@pytest.mark.parametrize(
    ("times", "words"),
    [((), "no key views"), ((0, 0), "must ascend"), ((1, 0), "must ascend"), ((0, np.inf), "must ascend")],
)
def test_key_views_that_are_no_flight(times, words):
    camera = Camera(Pose(), 1.0, 1.0)
    with pytest.raises(FlightError, match=words):
        Flight([KeyView(seconds, camera) for seconds in times])


# --- files -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".csv", ".json", ".toml"])
def test_a_saved_flight_comes_back(tmp_path: Path, rng, suffix: str):
    flight = random_flight(rng)
    again = load_flight(save_flight(tmp_path / f"a{suffix}", flight))
    assert [key.seconds for key in again.keys] == list(TIMES)
    for key, wanted in zip(again.keys, flight.keys, strict=True):
        np.testing.assert_allclose(numbers(key.camera), numbers(wanted.camera), atol=FLIGHT_FILE)


def test_columns_may_come_in_any_order_among_others(tmp_path: Path):
    path = tmp_path / "a.csv"
    path.write_text(
        "note,fovy,seconds,eye_x,eye_y,eye_z,centre_x,centre_y,centre_z,up_x,up_y,up_z\n"
        "start,60,0,1,2,3,1,2,0,0,1,0\n\n"
        "end,90,2.5,1,2,5,1,2,0,0,1,0\n"
    )
    flight = load_flight(path)
    assert flight.duration == 2.5
    last = flight.keys[-1].camera
    np.testing.assert_allclose(last.position, (1, 2, 5))
    np.testing.assert_allclose(last.pivot, (1, 2, 0), atol=1e-12)
    assert last.fovy == pytest.approx(np.pi / 2)


KEY = '"seconds": 0, "eye": [0, 0, 9], "centre": [0, 0, 0], "up": [0, 1, 0]'


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.txt", "", "ends in .csv, .json, .toml"),
        ("none.csv", None, "there is no flight"),
        ("a.csv", b"\xff\xfe\x00", "not a text file"),
        ("a.csv", "", "the first line names the columns; missing: seconds, eye_x"),
        ("a.csv", "seconds,eye_x\n", "missing: eye_y"),
        ("a.json", "{", "not valid JSON"),
        ("a.toml", "key =", "not valid TOML"),
        ("a.json", "[1]", "no list `key`"),
        ("a.json", '{"key": [3]}', "no list `key`"),
        ("a.json", '{"key": []}', "no key views"),
        ("a.json", f'{{"key": [{{{KEY}}}]}}', "key 1: a key view has seconds, eye"),
        ("a.json", f'{{"key": [{{{KEY}, "fovy": 180}}]}}', "between 0 and 180"),
        ("a.json", f'{{"key": [{{{KEY}, "fovy": "wide"}}]}}', "fovy is a finite number"),
        ("a.json", f'{{"key": [{{{KEY.replace("[0, 1, 0]", "[0, 0, 1]")}, "fovy": 9}}]}}', "another up"),
        ("a.json", f'{{"key": [{{{KEY.replace("[0, 0, 9]", "[0, 9]")}, "fovy": 9}}]}}', "eye is three"),
    ],
)
def test_files_that_hold_no_flight(tmp_path: Path, name: str, content, words: str):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(FlightError, match=words):
        load_flight(path)


def test_a_wrong_row_is_named_and_all_key_views_are_looked_at(tmp_path: Path):
    path = save_flight(tmp_path / "a.csv", random_flight(np.random.default_rng(3)))
    lines = path.read_text().splitlines()
    path.write_text("\n".join([lines[0], lines[1].replace(",", ",x", 1), *lines[2:]]))
    with pytest.raises(FlightError, match="line 2"):
        load_flight(path)
    cells = [line.split(",") for line in lines]
    path.write_text("\n".join([lines[0], *(",".join([*row[:-1], "200"]) for row in cells[1:3])]))
    with pytest.raises(FlightError, match=r"(?s)line 2: fovy.*line 3: fovy"):
        load_flight(path)


def test_a_flight_that_cannot_be_written(tmp_path: Path, rng):
    for name, words in (("none/a.csv", "cannot write the flight"), ("a.txt", "ends in .csv")):
        with pytest.raises(FlightError, match=words):
            save_flight(tmp_path / name, random_flight(rng))


# --- turntables --------------------------------------------------------------------------------------------

HOME = Camera.look_at((40, -50, 35), (11, 12, 13), (0, 0, 1), np.radians(40))


def test_a_turntable_keeps_pivot_and_distance_and_does_not_repeat_its_first_view():
    cameras = turntable(HOME, (0, 0, 2), 8)
    assert cameras[0] is HOME or np.array_equal(cameras[0].pose.matrix, HOME.pose.matrix)
    offsets = np.array([camera.position - HOME.pivot for camera in cameras])
    np.testing.assert_allclose(offsets[:, 2], offsets[0, 2])
    angles = np.unwrap(np.arctan2(offsets[:, 1], offsets[:, 0]))
    np.testing.assert_allclose(np.degrees(np.diff(angles)), 45)
    for camera in cameras:
        np.testing.assert_allclose(camera.pivot, HOME.pivot, atol=1e-12)


def test_a_part_of_a_turn_ends_with_its_last_view():
    cameras = turntable(HOME, (0, 0, 1), 4, degrees=-90)
    wanted = HOME.turned((0, 0, 1), np.radians(-90))
    np.testing.assert_allclose(cameras[-1].pose.matrix, wanted.pose.matrix, atol=1e-12)
    assert len(turntable(HOME, (0, 0, 1), 1, degrees=90)) == 1


def test_tilt_looks_down_on_the_turntable():
    up = (0, 0, 1)
    assert np.degrees(turntable(HOME, up, 3, tilt=25)[1].steepness(up) - HOME.steepness(up)) == pytest.approx(
        25
    )


@pytest.mark.parametrize(("axis", "degrees"), [((0, 0, 0), 9), ((0, 0, np.nan), 9), ((0, 0, 1), np.inf)])
def test_a_turntable_without_an_axis(axis, degrees):
    with pytest.raises(FlightError, match="an axis of three numbers"):
        turntable(HOME, axis, 3, degrees)


def test_quaternions_multiply_as_matrices_do(rng):
    a, b = random_turn(rng), random_turn(rng)
    np.testing.assert_allclose(rotation_of(multiply(a, b)), rotation_of(a) @ rotation_of(b), atol=1e-12)
