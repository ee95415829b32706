"""Frame-time control in use: late measurements, budgets, holding quality, other scenes, errors."""

from dataclasses import replace

import numpy as np
import pytest
from recorded_costs import LIMITS, SCENES, settling

import persp_sw as psw
from persp_sw.errors import SettingsError
from persp_sw.measure.replay import Disturbance, replay
from persp_sw.quality.controller import FrameTimeController
from persp_sw.quality.features import FrameCost, SceneFeatures

SETTLED = 10  # frames
STEP = 200  # the frame of it


def still(time):
    return lambda frame: time


def test_late_measurements_do_no_harm():
    scene = SCENES["fog"]
    target = 4 * scene.cost(2.5, "", 0.3).ms
    controller = FrameTimeController(target)
    waiting, quality = [], []
    for frame in range(400):
        measured, of = waiting.pop(0) if len(waiting) > 2 else (None, None)
        choice = controller.next(scene.features(2.5), measured, of)
        cost = scene.cost(2.5, choice.rung, choice.quality)
        waiting.append((replace(cost, ms=cost.ms * (4 if frame >= STEP else 1)), choice))
        quality.append(choice.quality)
    final = 4 * scene.cost(2.5, "", quality[-1]).ms / target
    assert abs(final - 1) <= 0.1
    assert np.ptp(np.log(quality[-100:])) <= 0.02


def test_a_late_measurement_counts_for_the_choice_it_was_drawn_with():
    scene = SCENES["fog"]
    controller, waiting, off = FrameTimeController(10.0), [], []
    for frame in range(120):
        controller.hold(0.5 if frame % 2 else 1.5)
        measured, of = waiting.pop(0) if len(waiting) > 1 else (None, None)
        choice = controller.next(scene.features(2.5), measured, of)
        cost = scene.cost(2.5, choice.rung, choice.quality)
        waiting.append((cost, choice))
        off.append(abs(np.log((choice.expected_ms or np.inf) / cost.ms)))
    # The two costs differ by a factor of more than 2.
    assert max(off[60:]) < 0.1


def test_the_budget_is_what_upload_warp_and_swap_leave():
    controller = FrameTimeController(16.0)
    scene = SCENES["fog"]
    assert controller.budget_ms == 16.0
    measured = None
    for _ in range(60):
        choice = controller.next(scene.features(2.5), measured)
        cost = scene.cost(2.5, choice.rung, choice.quality)
        measured = replace(cost, upload_ms=1.0, warp_ms=4.0, swap_ms=1.0)
    assert controller.budget_ms == choice.budget_ms == 10.0
    assert cost.ms == pytest.approx(10.0, rel=0.1)
    for _ in range(20):
        controller.next(scene.features(2.5), replace(cost, warp_ms=100.0))
    assert controller.budget_ms == pytest.approx(1.6)


def test_planning_is_part_of_what_compositing_may_take():
    scene, target = SCENES["fog"], 10.0
    controller, measured = FrameTimeController(target), None
    for _ in range(100):
        choice = controller.next(scene.features(2.5), measured)
        cost = scene.cost(2.5, choice.rung, choice.quality)
        measured = replace(cost, planning_ms=3.0)
    assert cost.ms + 3.0 == pytest.approx(target, rel=0.1)
    assert choice.expected_ms == pytest.approx(cost.ms + 3.0, rel=0.1)


def test_a_held_quality_stays_and_control_goes_on_from_it():
    scene = SCENES["fog"]
    controller = FrameTimeController(scene.cost(2.5, "", 1.0).ms)
    replay(scene, controller, 50, time=still(2.5))
    controller.hold(3.0)
    held = replay(scene, controller, 50, time=still(2.5))
    assert controller.held
    assert (held.quality == 3.0).all()
    assert set(held.why) == {"held"}
    controller.release()
    after = replay(scene, controller, 50, time=still(2.5))
    assert after.quality[0] <= LIMITS[1]
    assert after.quality[-1] == pytest.approx(1.0, rel=0.1)
    controller.hold()
    locked = replay(scene, controller, 50, time=still(2.5), disturbance=Disturbance(machine=lambda frame: 4))
    assert (locked.quality == after.quality[-1]).all()


def test_another_scene_is_learnt_anew():
    fog, bone = SCENES["fog"], SCENES["bone"]
    target = bone.cost(2.5, "", 1.2).ms
    controller = FrameTimeController(target)
    replay(fog, controller, 200, time=still(2.5))
    trace = replay(bone, controller, 200, time=still(2.5))
    assert settling(trace, target, 0) <= SETTLED


def test_another_scene_is_believed_at_once():
    """Where samples are not counted, a time alone would have to be confirmed by the next."""
    scene, moved = SCENES["fog"], {}
    for name in ("fog", "another"):
        controller = FrameTimeController(scene.cost(2.5, "", 1.5).ms)
        measured, quality = None, []
        for frame in range(120):
            features = replace(scene.features(2.5), scene=name if frame >= 100 else "fog")
            choice = controller.next(features, measured)
            measured = FrameCost(scene.cost(2.5, "", choice.quality).ms * (2 if frame >= 100 else 1))
            quality.append(choice.quality)
        moved[name] = int(np.argmax(np.array(quality[100:]) < 0.95 * quality[99]))
    assert moved == {"fog": 2, "another": 1}


def test_frames_that_show_nothing_teach_nothing():
    scene = SCENES["fog"]
    controller = FrameTimeController(scene.cost(2.5, "", 1.0).ms)
    replay(scene, controller, 50, time=still(2.5))
    before = controller.next(scene.features(2.5))
    nothing = SceneFeatures(0, 0, 0, scene.name)
    for _ in range(100):
        choice = controller.next(nothing, FrameCost(0.01))
        assert (choice.why, choice.quality) == ("nothing", before.quality)
    assert controller.next(scene.features(2.5), FrameCost(0.01)).quality == before.quality


def test_a_choice_makes_settings():
    choice = FrameTimeController(10.0, quality=0.7).next(SceneFeatures(1e6, 1e4))
    base = psw.Settings(threads=1, intermediate_size=64)
    assert choice.apply(base) == psw.Settings(quality=0.7, threads=1)


@pytest.mark.parametrize(
    "options",
    [
        {"target_ms": 0},
        {"target_ms": float("nan")},
        {"min_quality": 0.01},
        {"min_quality": 2.0, "max_quality": 1.0},
        {"min_quality": 1.0, "max_quality": 1.0},
        {"max_step": 0},
        {"quality": -1},
    ],
)
def test_numbers_out_of_range_are_refused(options):
    with pytest.raises(SettingsError):
        FrameTimeController(**{"target_ms": 10.0, **options})


def test_costs_that_cannot_be_are_refused():
    for ms in (-1.0, float("nan"), float("inf")):
        with pytest.raises(SettingsError, match="ms"):
            FrameCost(ms)
