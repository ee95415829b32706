"""Frames composited as a controller chooses, what is told to it, and the records of frames."""

from dataclasses import replace

import numpy as np
import pytest

import persp_sw as psw
from persp_sw.quality import saved_ladder
from persp_sw.quality.ladder import Point, Rung
from persp_sw.volume.phantoms import synthetic_ct
from vr_plugin.eyes import eyes_of_head
from vr_plugin.frame import FrameMaker
from vr_plugin.pacing import controller_for
from vr_plugin.pose import Pose
from vr_plugin.record import FrameClock, Times, record_of
from vr_plugin.rig import Eyes, QualityAim, RigWall
from vr_plugin.shown import Shown
from vr_plugin.steady import Steady

WALL = RigWall(psw.Wall((-1, 0, -1), (1, 0, -1), (-1, 2, -1), pixels=(64, 64), name="front"), "anaglyph")


class Rule:
    """In a controller's place: draws one quality, and keeps what it is told."""

    def __init__(self, quality=0.7):
        self.quality, self.told, self.seen, self.held = quality, [], [], None

    def next(self, features, measured=None, of=None):
        self.seen.append(features)
        self.told.append((measured, of))
        return psw.Choice(self.held or self.quality, "r", {"residual": 0.02}, budget_ms=9.0, why="steady")

    def hold(self, quality):
        self.held = quality

    def release(self):
        self.held = None


@pytest.fixture
def maker():
    volume = synthetic_ct(24)
    renderer = psw.Renderer(volume, settings=psw.Settings(quality=0.5))
    place = np.diag([0.04, 0.04, 0.04, 1.0])
    place[:3, 3] = -0.5, 0.7, -0.8
    maker = FrameMaker(renderer, [WALL], place)
    maker.make(*viewer())  # encodes and compiles
    return maker


def viewer(x=0.0):
    head = Pose((x, 1.2, 1.0))

    return head, eyes_of_head(head, Eyes())


def test_a_frame_is_drawn_with_what_was_chosen_over_what_the_user_set(maker):
    base = maker.renderer.settings
    steady = Steady(maker, Rule())
    frame = steady.make(maker.moment(*viewer()))
    assert maker.renderer.settings == replace(base, quality=0.7, residual=0.02)
    assert frame.made.quality == 0.7 and frame.made.choice.rung == "r"
    steady.base = replace(base, single_face_tangent=2.0)
    steady.make(maker.moment(*viewer()))
    assert maker.renderer.settings == replace(base, quality=0.7, residual=0.02, single_face_tangent=2.0)


def test_the_rule_is_told_what_a_frame_took_and_of_which_choice(maker):
    rule = Rule()
    steady = Steady(maker, rule)
    frame = steady.make(maker.moment(*viewer()))
    steady.drawn(frame, upload_ms=1.0, warp_ms=2.0, swap_ms=3.0)
    steady.make(maker.moment(*viewer(0.1)))
    assert rule.told[0] == (None, None)
    measured, of = rule.told[1]
    assert of is frame.made.choice
    each = frame.statistics.values()
    assert measured.ms == sum(s["composite_ms"] for s in each) > 0
    assert measured.samples == sum(s["samples"] for s in each) > 0
    assert measured.pixels == sum(len(image.pixels) for image in frame.images.values()) > 0
    assert (measured.upload_ms, measured.warp_ms, measured.swap_ms) == (1.0, 2.0, 3.0)
    assert measured.planning_ms > 0
    assert rule.seen[0] != rule.seen[1]  # features are those of the moment
    steady.make(maker.moment(*viewer(0.1)))
    assert rule.told[2] == (None, None)  # once


def test_a_frame_with_cold_caches_tells_nothing(maker):
    rule = Rule()
    steady = Steady(maker, rule)
    maker.renderer.transfer = psw.TransferFunction(
        [(0, (1, 1, 1), 0.0), (255, (1, 1, 1), 0.5)], opacity_unit=1.0
    )
    cold = steady.make(maker.moment(*viewer()))
    assert sum(s["encode_ms"] for s in cold.statistics.values()) > 0
    steady.drawn(cold)
    warm = steady.make(maker.moment(*viewer()))
    steady.drawn(warm)
    steady.make(maker.moment(*viewer()))
    assert rule.told[1] == (None, None) and rule.told[2][1] is warm.made.choice


def test_without_a_controller_settings_are_the_user_s_and_quality_can_be_held(maker):
    steady, base = Steady(maker), maker.renderer.settings
    moment = maker.moment(*viewer())
    qualities = [steady.make(moment).made.quality]
    steady.held = 1.25
    qualities.append(steady.make(moment).made.quality)
    steady.held = None
    qualities.append(steady.make(moment).made.quality)
    assert qualities == [0.5, 1.25, 0.5] and maker.renderer.settings == base


def test_held_quality_reaches_the_controller_and_is_let_go(maker):
    rule = Rule()
    steady = Steady(maker, rule)
    moment = maker.moment(*viewer())
    steady.held = 1.5
    held = steady.make(moment).made.quality
    steady.held = None
    assert (held, steady.make(moment).made.quality) == (1.5, 0.7)


def test_what_was_given_up_was_not_refined(maker):
    rule = Rule(0.5)
    rule.ladder = psw.Ladder((Rung("r", {}, (Point(0.5, 0.25), Point(1.0, 1.0))),))
    steady = Steady(maker, rule)
    steady.refinement = psw.Refinement(rule.ladder)
    moment = maker.moment(*viewer())
    given_up = psw.Cancel()
    given_up.cancel()
    for _ in range(5):
        with pytest.raises(psw.Cancelled):
            steady.make(moment, given_up, resting=True)
    assert not steady.is_refined
    frames = [steady.make(moment, resting=True) for _ in range(4)]
    assert frames[0].made.quality == pytest.approx(0.5 * np.exp(0.25))
    assert frames[-1].made.quality == 1.0 and steady.is_refined
    assert all(frame.made.refined for frame in frames)


def test_a_moment_s_regions_are_what_is_shown(maker):
    regions = psw.Regions(crop=(0, 12, 0, 23, 0, 23))
    whole = Steady(maker).make(maker.moment(*viewer()))
    cropped = Steady(maker).make(maker.moment(*viewer(), regions=regions))
    assert maker.renderer.regions is regions
    samples = [sum(s["samples"] for s in frame.statistics.values()) for frame in (whole, cropped)]
    assert 0 < samples[1] < samples[0]


def test_limits_that_leave_no_choice_need_no_controller(maker):
    assert controller_for(maker.renderer, QualityAim(60, 1, 1, 1), 60) is None
    controller = controller_for(maker.renderer, QualityAim(60, 1, 0.5, 1.5), 50)
    assert controller.target_ms == 20
    rung = controller.ladder.rungs[0]
    assert (rung.lowest, rung.highest) == (0.5, 1.5)


def test_a_measured_ladder_is_walked_unless_the_user_chose_the_sampling(maker, tmp_path, monkeypatch):
    rungs = (Rung("fast", {"residual": 0.1}, (Point(0.25, 0.1), Point(2.0, 4.0))),)
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    renderer, aim = maker.renderer, QualityAim(60, 1, 0.25, 2.0)
    key = saved_ladder.machine_key(None), saved_ladder.volume_key(renderer.volume, renderer.transfer)
    saved_ladder.save_ladder(psw.Ladder(rungs, *key, saved_ladder.program_key()))
    assert [rung.name for rung in controller_for(renderer, aim, 60).ladder.rungs] == ["fast"]
    renderer.settings = replace(renderer.settings, samples_per_interval=2)
    assert [rung.changes for rung in controller_for(renderer, aim, 60).ladder.rungs] == [{}]


def test_limits_beyond_the_measured_ladder_are_kept(maker, tmp_path, monkeypatch):
    rungs = (Rung("fast", {"residual": 0.1}, (Point(0.25, 0.1), Point(2.0, 4.0))),)
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    renderer = maker.renderer
    key = saved_ladder.machine_key(None), saved_ladder.volume_key(renderer.volume, renderer.transfer)
    saved_ladder.save_ladder(psw.Ladder(rungs, *key, saved_ladder.program_key()))
    for low, high in ((0.05, 0.2), (0.1, 4.0), (3.0, 6.0), (0.5, 1.0)):
        rung = controller_for(renderer, QualityAim(60, 1, low, high), 60).ladder.rungs[0]
        assert (rung.name, rung.lowest, rung.highest) == ("fast", pytest.approx(low), pytest.approx(high))


def record(maker, frame_ms=10.0, shown_at=None, on_display=True, stamp=5.0):
    frame = Steady(maker, Rule()).make(maker.moment(*viewer(), stamp=stamp))
    moment = frame.moment if shown_at is None else maker.moment(*viewer(shown_at), stamp=stamp + 0.005)
    times = Times(5.01, 5.02, 1.0, 2.0, 3.0, frame_ms)
    shown = Shown(frame, moment)
    return frame, record_of(7, shown, times, 10.0, on_display=on_display)


def test_a_record_says_what_was_done(maker):
    frame, r = record(maker)
    assert (r.frame, r.time_s, r.shown_s, r.frame_ms, r.target_ms) == (7, 5.01, 5.02, 10.0, 10.0)
    assert (r.upload_ms, r.warp_ms, r.swap_ms, r.budget_ms) == (1.0, 2.0, 3.0, 9.0)
    assert (r.quality, r.rung, r.why, r.refined) == (0.7, "r", "steady", False)
    assert list(r.head[:3]) == [0.0, 1.2, 1.0] and r.shown_head is None and not r.rewarped
    assert r.samples == sum(s["samples"] for s in frame.statistics.values())
    assert r.compositings == 2 and r.faces >= 2
    assert r.latency_ms == pytest.approx(20.0)


def test_a_display_s_moment_of_the_same_place_is_no_other(maker):
    frame = Steady(maker, Rule()).make(maker.moment(*viewer()))
    again = Shown(frame, maker.moment(*viewer()))
    r = record_of(0, again, Times(5.0, 5.01, 1, 2, 3, 10), 10.0, on_display=True)
    assert not r.rewarped and r.shown_head is None
    maker.room_from_world = maker.room_from_world @ np.diag([1.1, 1.1, 1.1, 1])  # the wand
    moved = record_of(
        0, Shown(frame, maker.moment(*viewer())), Times(5.0, 5.01, 1, 2, 3, 10), 10.0, on_display=True
    )
    assert moved.rewarped


def test_a_record_of_a_head_that_moved_on_has_both_poses(maker):
    _, r = record(maker, shown_at=0.05)
    assert r.rewarped and r.head[0] == 0.0 and r.shown_head[0] == 0.05
    assert r.latency_ms == pytest.approx(15.0)  # of the pose that it is shown for


@pytest.mark.parametrize(
    ("frame_ms", "missed"), [(3.0, 0), (10.0, 0), (10.9, 0), (11.2, 1), (20.0, 1), (31.2, 3)]
)
def test_refreshes_that_a_frame_came_too_late_for_are_counted(maker, frame_ms, missed):
    assert record(maker, frame_ms)[1].missed == missed


def test_a_frame_counts_from_the_end_of_the_one_that_it_follows_at_once():
    clock = FrameClock()
    assert clock.take(-0.25, 0.0, 1.0, 2.0, 3.0) == Times(-0.25, 0.0, 1.0, 2.0, 3.0, 250.0)
    assert clock.take(0.125, 0.5, 1.0, 2.0, 3.0).frame_ms == 500.0  # though it began late; and 0 is a time
    clock.pause()
    assert clock.take(2.0, 2.125, 1.0, 2.0, 3.0).frame_ms == 125.0
    assert clock.take(2.25, 2.375, 1.0, 2.0, 3.0).frame_ms == 250.0


def test_without_a_display_nothing_was_seen(maker):
    _, r = record(maker, on_display=False)
    assert r.shown_s is None and r.latency_ms is None and r.image_age_ms is None
    assert record(maker, stamp=None, shown_at=None)[1].latency_ms is None
