"""Flights in the preview: recorded by a key, written, and flown again until a hand takes the camera."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from samples import fails, result_of

from vr_plugin.cameras import Camera
from vr_plugin.film.flight import Flight, KeyView
from vr_plugin.film.flight_file import load_flight, save_flight
from vr_plugin.pose import Pose
from vr_plugin.preview.controller import Preview
from vr_plugin.preview.flights import SAMPLE_SECONDS, TOLERANCE, FlightLog, _apart, simplified

HOME = Camera.look_at((40, -50, 35), (11, 12, 13), (0, 0, 1), np.radians(40))
STEP = 1 / 50


class Driver:
    """A preview and a clock."""

    def __init__(self, flight: Flight | None = None):
        self.preview = Preview(HOME, extent=20.0, flight=flight)
        self.now, self.way = 7.0, []
        self.preview.advance(self.now)

    def wait(self, seconds: float) -> Camera:
        for _ in range(round(seconds / STEP)):
            self.now += STEP
            self.way.append((self.now, self.preview.advance(self.now).camera))
        return self.way[-1][1]

    def press(self, name: str) -> None:
        self.preview.key(name, True)
        self.preview.key(name, False)


def wound() -> Flight:
    """Three key views, 2 s."""
    cameras = [HOME.turned((0, 0, 1), angle).zoomed(1 - 0.2 * angle) for angle in (0.0, 0.7, 1.0)]
    return Flight([KeyView(float(k), camera) for k, camera in enumerate(cameras)])


def test_a_recorded_flight_is_what_was_flown():
    driver = Driver()
    driver.wait(1.0)
    driver.press("F9")
    assert "F9" in driver.preview.advance(driver.now).message
    driver.way.clear()
    start = driver.now
    driver.preview.key("RIGHT", True)
    driver.wait(1.5)
    driver.preview.key("RIGHT", False)
    driver.wait(1.0)
    driver.press("F9")
    (flight,) = driver.preview.flights.flown
    assert flight.duration == pytest.approx(driver.way[-1][0] - start, abs=1e-9)
    assert len(flight.keys) <= 26
    for now, camera in driver.way:
        # At the samples TOLERANCE; between two a key that goes down changes the spin by 60° a second,
        # which a cubic smooths over 0.1 s: 60° · 0.1 s / 8.
        assert _apart(flight.at(now - start), camera) < TOLERANCE + np.radians(60) * SAMPLE_SECONDS / 8


def test_a_straight_even_flight_needs_two_key_views_and_a_rest_is_kept():
    log = FlightLog()
    for number in range(200):
        share = min(max(number - 50, 0), 100) / 100
        log.see(3.0 + number * STEP, Camera(Pose((share * 9, 0, 0)), 2.0, 1.0))
    flight = log.finished()
    assert flight.duration == pytest.approx(199 * STEP)
    assert flight.keys[0].seconds == 0
    assert 4 <= len(flight.keys) < 25
    assert np.abs(flight.at(0.8).position).max() < 2 * TOLERANCE
    even = Flight([KeyView(k / 10, Camera(Pose((k, 0, 0)), 2.0, 1.0)) for k in range(50)])
    assert len(simplified(even).keys) == 2


def test_simplified_passes_all_key_views_nearly(rng):
    steps = rng.standard_normal((120, 3)).cumsum(0).cumsum(0) * 0.01
    keys = [KeyView(k / 10, Camera(Pose(place), 5.0, 1.0)) for k, place in enumerate(steps)]
    flight, fewer = Flight(keys), simplified(Flight(keys))
    assert 2 < len(fewer.keys) < 100
    for key in flight.keys:
        assert _apart(fewer.at(key.seconds), key.camera) <= TOLERANCE


def test_no_time_is_no_flight():
    driver = Driver()
    driver.press("F9")
    driver.press("F9")
    assert not driver.preview.flights.flown
    assert "no flight" in driver.preview.advance(driver.now).message
    assert FlightLog().finished() is None


def test_a_flight_is_flown_and_ends_at_its_last_view():
    driver = Driver(wound())
    driver.wait(0.5)
    np.testing.assert_allclose(
        driver.way[-1][1].position, wound().at(0.5 - STEP).position, atol=1e-9
    )  # the first frame is its first view
    assert driver.preview.advance(driver.now + STEP).moving
    driver.wait(3.0)
    assert np.array_equal(driver.way[-1][1].position, wound().keys[-1].camera.position)
    assert not driver.preview.advance(driver.now + 0.1).moving


def test_space_halts_it_and_starts_it_again():
    driver = Driver(wound())
    driver.wait(0.6)
    driver.press("SPACE")
    halted = driver.wait(1.0)
    assert np.array_equal(halted.position, driver.way[30][1].position)
    driver.press("SPACE")
    assert np.linalg.norm(driver.wait(0.5).position - halted.position) > 1
    driver.wait(5.0)
    driver.press("SPACE")  # at the end: from the start
    driver.wait(2 * STEP)
    assert np.linalg.norm(driver.way[-1][1].position - HOME.position) < 2


def test_a_hand_takes_the_camera():
    driver = Driver(wound())
    driver.wait(0.5)
    driver.preview.pointer(0, 0)
    driver.preview.button("left", True)
    driver.preview.pointer(50, 0)
    driver.preview.button("left", False)
    taken = driver.wait(2.0)
    assert np.array_equal(driver.wait(1.0).position, taken.position)
    assert np.linalg.norm(taken.position - wound().keys[-1].camera.position) > 1


def test_the_command_records_and_flies(ball_file: Path, tmp_path: Path):
    out, options = tmp_path / "out", ("--offscreen", "--size", 48, 32)
    values = result_of("view", ball_file, *options, "--frames", 20, "--turn", 3, "--press", "F9", "-o", out)
    (name,) = values["screenshots"]
    assert name == str(out / "ball-flight-001.csv")  # though nobody ended it
    flight = load_flight(name)
    assert flight.duration == pytest.approx(20 / 60)
    values = result_of("view", ball_file, *options, "--fly", name, "--frames", 3, "-o", tmp_path / "flown")
    assert len(values["pictures"]) == 3
    assert "there is no flight" in fails("view", ball_file, *options, "--fly", "none.csv")
    save_flight(tmp_path / "wound.toml", wound())
    values = result_of(
        "movie", ball_file, "-o", tmp_path / "film", "--path", tmp_path / "wound.toml", "--fps", 4
    )
    assert values["frames"] == 9
