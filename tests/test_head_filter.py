"""Where a head will be: order of the prediction, outliers, loss, coming back."""

from __future__ import annotations

import logging

import numpy as np
import pytest
from data_folder import data_path
from tolerances import PREDICTION_ORDER
from tracker_samples import assert_pose, pose_sample

from vr_plugin.pose import Pose, between, turn_about
from vr_plugin.trackers import FilterSettings, HeadFilter, PathTracker, Recording, Sample

REST = Pose((0, 1.7, 0), turn_about((0, 1, 0), 0.3))
SETTINGS = FilterSettings()
AXIS = np.array([1.0, 2.0, -0.5]) / np.linalg.norm([1.0, 2.0, -0.5])


def fed(*samples: Sample, **settings: float) -> HeadFilter:
    head = HeadFilter(REST, settings=FilterSettings(**settings))
    head.add(samples)
    return head


def steady(t: float) -> Pose:
    """1.2 m/s and 2 rad/s: what the filter assumes."""
    return Pose((1 + t, 1.7, -0.6 * t), turn_about(AXIS, 2 * t))


def swaying(t: float) -> Pose:
    """A head that walks in a curve and shakes."""
    position = (0.3 * np.sin(2 * t), 1.7 + 0.05 * np.sin(5 * t), 0.4 * np.cos(1.3 * t))
    return Pose(position, turn_about(AXIS, 0.5 * np.sin(3 * t)))


def turned(a: Pose, b: Pose) -> float:
    return 2 * np.arccos(min(abs(a.orientation @ b.orientation), 1.0))


def samples_of(motion: object, times: object) -> list[Sample]:
    return [Sample(float(t), 0, motion(float(t))) for t in times]


# --- prediction --------------------------------------------------------------------------------------------


def test_steady_motion_is_predicted_exactly():
    head = fed(*samples_of(steady, np.arange(0, 1, 1 / 120)))
    last = 119 / 120
    for ahead in (-0.05, -0.001, 0.0, 0.02, 0.05, 0.1):
        assert_pose(head.pose_at(last + ahead), steady(last + ahead), atol=1e-9)


def test_the_error_falls_with_the_square_of_the_times():
    steps = np.array([0.08, 0.04, 0.02, 0.01, 0.005])
    places, turns = [], []
    for step in steps:
        errors = []
        for end in np.arange(1.0, 4.0, 0.37):
            head = fed(*samples_of(swaying, end - step * np.arange(12, -1, -1)), baseline=step / 2)
            pose = head.pose_at(end + step)
            errors.append(
                (
                    np.linalg.norm(pose.position - swaying(end + step).position),
                    turned(pose, swaying(end + step)),
                )
            )
        place, turn = np.sqrt(np.mean(np.square(errors), 0))
        places.append(place)
        turns.append(turn)
    for errors in (places, turns):
        order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
        assert order == pytest.approx(2, abs=PREDICTION_ORDER)
    # ½·a·L·(L + b), root mean square over accelerations of up to 1.2 + 1.25 + 0.7 m/s².
    assert places[-1] <= 0.5 * 2.1 * steps[-1] * 2 * steps[-1]


def test_prediction_beats_the_last_sample():
    ahead, plain, predicted = 0.04, [], []
    for end in np.arange(1.0, 5.0, 0.11):
        head = fed(*samples_of(swaying, end - np.arange(30, -1, -1) / 120))
        true = swaying(end + ahead).position
        predicted.append(np.linalg.norm(head.pose_at(end + ahead).position - true))
        plain.append(np.linalg.norm(swaying(end).position - true))
    assert np.mean(predicted) < 0.25 * np.mean(plain)


def test_prediction_helps_on_a_real_path():
    recording = Recording.load(data_path("tracking", "hololens-200hz.csv.gz"))
    head, tracker, ahead = HeadFilter(REST), PathTracker(recording, start=0.0), 0.03
    plain, predicted = [], []
    for now in np.arange(0, 15, 1 / 60):
        head.add(tracker.poll(float(now)))
        true = recording.at(now + ahead)
        predicted.append(np.linalg.norm(head.pose_at(now + ahead).position - true.position))
        plain.append(np.linalg.norm(recording.at(now).position - true.position))
    assert head.outliers == 0
    assert np.median(predicted) < 0.3 * np.median(plain)


def test_noise_of_a_fast_tracker_is_not_blown_up(rng):
    sigma, ahead, errors = 0.0005, 0.05, []
    for _ in range(100):
        head = fed(*(pose_sample(i / 500, rng.normal(0, sigma, 3)) for i in range(40)))
        errors.append(head.pose_at(39 / 500 + ahead).position)
    # σ·√((1 + L/b)² + (L/b)²), 3.2 σ at b = 30 ms; 36 σ from one sample to the next.
    assert np.sqrt(np.mean(np.square(errors))) < 4 * sigma


def test_nobody_is_predicted_far():
    head = fed(*samples_of(steady, np.arange(0, 1, 0.01)))
    assert_pose(head.pose_at(0.99 + 0.3), steady(0.99 + SETTINGS.look_ahead), atol=1e-9)


def test_speed_is_not_measured_across_a_gap():
    head = fed(pose_sample(0.0, (0, 1.7, 0)), pose_sample(0.4, (1, 1.7, 0)))
    assert head.pose_at(0.45).position[0] == 1.0


def test_samples_of_others_and_other_kinds_are_ignored():
    head = fed(pose_sample(0.0, (9, 9, 9), sensor=1), Sample(0.0, 0, kind="lost"))
    assert head.state_at(0.0) == "waiting"
    assert_pose(head.pose_at(0.0), REST)


def test_samples_out_of_order_are_counted_not_taken():
    head = fed(pose_sample(1.0), pose_sample(0.9, (0.1, 0, 0)), pose_sample(1.0, (0.1, 0, 0)))
    assert head.late == 2
    assert not head.pose_at(1.0).position.any()


def test_a_clock_that_is_set_back_does_not_freeze_the_head():
    head = fed(*samples_of(steady, np.arange(100, 101, 0.01)))
    head.add(samples_of(steady, np.arange(0, 1, 0.01)))
    assert_pose(head.pose_at(1.0), steady(1.0), atol=1e-9)


# --- outliers ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("wrong", [Pose((3, 0, 0)), Pose((0, 0, 0), turn_about((0, 1, 0), 2.5))])
def test_single_outliers_are_left_out(wrong):
    samples = [pose_sample(i / 100) for i in range(100)]
    for i in (30, 31, 60, 61, 62, 63):
        samples[i] = Sample(i / 100, 0, wrong)
    head = HeadFilter(REST)
    for sample in samples:
        head.add([sample])
        assert_pose(head.pose_at(sample.stamp), Pose())
    assert head.outliers == 6
    assert head.losses == 0


def test_a_new_place_that_persists_is_gone_to_smoothly():
    head = fed(*(pose_sample(i / 100) for i in range(100)))
    shown = []
    for i in range(100, 200):
        head.add([pose_sample(i / 100, (2, 0, 0))])
        shown.append(head.pose_at(i / 100 + 0.02).position[0])
    assert shown[: SETTINGS.persist - 1] == [0.0] * (SETTINGS.persist - 1)
    # Smoothstep's steepest is 1.5 of its mean; the picture is shown 20 ms after the sample.
    steps = np.diff([0.0, *shown])
    assert steps.min() >= 0
    assert steps.max() <= 1.5 * 2 * 0.03 / SETTINGS.back
    assert shown[SETTINGS.persist + 31] == 2.0
    assert head.outliers == SETTINGS.persist


def test_outliers_that_disagree_never_persist(rng):
    head = fed(pose_sample(0.0))
    for i in range(1, 200):
        head.add([pose_sample(i / 1000, rng.normal(size=3) * 50)])
    assert not head.pose_at(0.2).position.any()


def test_a_fast_head_is_no_outlier():
    recording = Recording.load(data_path("tracking", "optitrack-120hz.csv.gz"))
    head = HeadFilter(REST)
    head.add(PathTracker(recording, "hold", start=0.0).poll(0.0))
    head.add(Sample(float(t), 0, pose) for t, pose in zip(recording.times, recording.poses, strict=True))
    assert head.outliers == 0


# --- loss --------------------------------------------------------------------------------------------------


def test_a_lost_head_is_held_then_fades_to_rest(caplog):
    there = Pose((1, 1.5, 0.5))
    head = fed(*(Sample(i / 100, 0, there) for i in range(101)))
    s = SETTINGS
    with caplog.at_level(logging.WARNING, "persp_sw"):
        for after in (0.0, 0.2, s.hold):
            assert_pose(head.pose_at(1 + after), there)
        assert not caplog.records
        assert_pose(head.pose_at(1 + s.hold + s.fade / 2), between(there, REST, 0.5))
        assert_pose(head.pose_at(1 + s.hold + s.fade), REST)
        for time in np.arange(3, 60, 0.1):
            assert_pose(head.pose_at(time), REST)
    assert len(caplog.records) == head.losses == 1
    assert "lost" in caplog.text
    states = [head.state_at(1 + age) for age in (0.0, 0.3, 1.0, 5.0)]
    assert states == ["tracked", "held", "fading", "lost"]


def test_a_head_that_comes_back_is_gone_to_smoothly(caplog):
    head = fed(*(pose_sample(i / 100, (1, 1.5, 0.5)) for i in range(101)))
    shown = [head.pose_at(t) for t in np.arange(1, 10, 0.01)]
    for i in range(1000, 1100):
        head.add([pose_sample(i / 100, (-1, 1.6, 0.2))])
        shown.append(head.pose_at(i / 100))
    steps = np.linalg.norm(np.diff([pose.position for pose in shown], axis=0), axis=1)
    way = np.linalg.norm(np.subtract((-1, 1.6, 0.2), REST.position))
    assert steps.max() <= 1.5 * way * 0.01 / SETTINGS.back * 1.01
    np.testing.assert_allclose(shown[-1].position, (-1, 1.6, 0.2))
    assert [record.getMessage().rpartition(" ")[2] for record in caplog.records] == ["pose", "back"]


def test_a_short_gap_is_no_loss(caplog):
    head = fed(*samples_of(steady, np.arange(0, 1, 0.01)))
    head.pose_at(1.3)
    head.add(samples_of(steady, np.arange(1.35, 1.6, 0.01)))
    assert_pose(head.pose_at(1.6), steady(1.6), atol=1e-9)
    assert head.losses == 0
    assert not caplog.records
