"""The ladder of settings: data, interpolation, files; and walking it."""

import json

import numpy as np
import pytest
from recorded_costs import SCENES, settling

import persp_sw as psw
from persp_sw.errors import SettingsError
from persp_sw.measure.replay import Disturbance, replay
from persp_sw.quality.controller import FrameTimeController
from persp_sw.quality.ladder import Ladder, Point, Rung

ONE = Rung("one", {"samples_per_interval": 1}, (Point(0.5, 1.0), Point(1.0, 4.0), Point(2.0, 8.0)))
TWO = Rung("two", {"samples_per_interval": 2}, (Point(0.5, 5.0), Point(2.0, 20.0)))


def test_cost_is_a_power_of_quality_between_points_and_beyond():
    assert ONE.cost_at(0.5) == pytest.approx(1)
    assert ONE.cost_at(0.5**0.5) == pytest.approx(2)
    assert ONE.cost_at(2**0.5) == pytest.approx(4 * 2**0.5)
    assert ONE.cost_at(0.25) == pytest.approx(0.25)
    assert ONE.cost_at(4.0) == pytest.approx(16)


@pytest.mark.parametrize("quality", np.geomspace(0.5, 2, 7))
def test_quality_of_a_cost_is_the_inverse(quality):
    assert ONE.quality_at(ONE.cost_at(quality)) == pytest.approx(quality)


def test_quality_stays_on_the_rung():
    assert ONE.quality_at(0.01) == 0.5
    assert ONE.quality_at(100.0) == 2.0


def test_the_built_in_ladder_changes_quality_alone():
    (rung,) = Ladder.default().rungs
    base = psw.Settings(samples_per_interval=2, threads=1)
    assert rung.settings(base, 0.6) == psw.Settings(quality=0.6, samples_per_interval=2, threads=1)
    assert (rung.lowest, rung.highest) == (0.05, 8.0)
    assert rung.cost_at(2.0) == pytest.approx(4.0)  # pixels


def test_limits_cut_rungs_and_drop_those_outside():
    ladder = Ladder((ONE, TWO)).limited(0.7, 1.5)
    assert [(rung.lowest, rung.highest) for rung in ladder.rungs] == [(0.7, 1.5)] * 2
    assert ladder.rungs[0].cost_at(1.0) == pytest.approx(4.0)
    with pytest.raises(SettingsError, match="widen the limits"):
        Ladder((ONE,)).limited(3.0, 4.0)


def test_limits_drop_what_then_goes_beyond_no_other():
    """Two ways of equal quality, the second cheaper: cut alike, it would begin and end below the first."""
    slow = Rung("slow", {}, (Point(0.25, 1.0), Point(1.0, 8.0)))
    fast = Rung("fast", {"residual": 0.02}, (Point(0.9, 6.0), Point(2.0, 20.0)))
    assert Ladder((slow, fast)).limited(0.95, 1.0).rungs[0].name == "slow"
    assert len(Ladder((slow, fast)).limited(0.5, 2.0).rungs) == 2


@pytest.mark.parametrize(
    ("rungs", "said"),
    [
        ((), "no rung"),
        ((Rung("a", {}, (Point(1, 1),)),), "fewer than two"),
        ((Rung("a", {}, (Point(1, 1), Point(2, 1))),), "cost must ascend"),
        ((Rung("a", {}, (Point(2, 1), Point(1, 2))),), "quality must ascend"),
        ((Rung("a", {}, (Point(1, -1), Point(2, 1))),), "positive"),
        ((Rung("a", {"colour": 1}, (Point(1, 1), Point(2, 2))),), "colour"),
        ((Rung("a", {}, (Point(1, 1), Point(20, 2))),), "quality"),
        ((ONE, ONE), "one name"),
        ((TWO, ONE), "do not ascend in cost"),
    ],
)
def test_what_is_no_ladder_is_refused(rungs, said):
    with pytest.raises(SettingsError, match=said):
        Ladder(rungs)


def test_a_saved_ladder_comes_back_for_its_machine_and_volume_alone(tmp_path):
    ladder = Ladder((ONE, TWO), "Some CPU, 2 cores", "head / CT.nrrd 256x256x128", "of today")
    path = ladder.save(tmp_path / "new folder")
    assert Ladder.load(path.parent, ladder.machine, ladder.volume) == ladder
    assert list(path.parent.iterdir()) == [path]
    assert Ladder.load(path.parent, ladder.machine, "other") == Ladder.default()
    assert Ladder.load(tmp_path / "absent", ladder.machine, ladder.volume) == Ladder.default()


def test_a_file_of_another_machine_is_not_used(tmp_path):
    other = Ladder((ONE,), "other", "v").save(tmp_path)
    other.rename(Ladder((ONE,), "m", "v").save(tmp_path))
    assert Ladder.load(tmp_path, "m", "v") == Ladder.default()


def test_names_that_differ_in_punctuation_alone_have_files_of_their_own(tmp_path):
    paths = {Ladder((ONE,), "m", volume).save(tmp_path) for volume in ("a b", "a/b", "a_b")}
    assert len(paths) == 3


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"format": 2, "rungs": 3}', '{"format": 2, "rungs": [{}]}']
)
def test_a_file_that_is_no_ladder_is_named(tmp_path, text):
    path = Ladder((ONE,), "m", "v").save(tmp_path)
    path.write_text(text)
    with pytest.raises(SettingsError, match="delete it"):
        Ladder.load(tmp_path, "m", "v")


def test_a_ladder_of_another_version_is_not_used(tmp_path):
    path = Ladder((ONE,), "m", "v").save(tmp_path)
    path.write_text(json.dumps({**json.loads(path.read_text()), "format": 99}))
    assert Ladder.load(tmp_path, "m", "v") == Ladder.default()


def two_rungs():
    """The two recorded ways to sample fog, as a chart of a viewer at rest would have them."""
    scene = SCENES["fog"]
    rungs = []
    for mode, low, high in (("1 sample", 0.25, 1.41), ("2 samples", 0.71, 2.0)):
        kept = [q for q in scene.qualities if low <= q <= high]
        points = tuple(Point(q, scene.cost(1.0, mode, q).ms) for q in kept)
        rungs.append(Rung(mode, scene.changes[mode], points))
    return Ladder(tuple(rungs))


@pytest.mark.parametrize("time", [0.5, 4.75, 9.5])
def test_the_controller_climbs_where_time_is_left_and_comes_down(time):
    scene = SCENES["fog"]
    target = scene.cost(time, "2 samples", 1.3).ms
    heavy = lambda frame: 3 if 200 <= frame < 400 else 1  # noqa: E731
    controller = FrameTimeController(target, two_rungs(), quality=0.5)
    trace = replay(scene, controller, 600, time=lambda _: time, disturbance=Disturbance(machine=heavy))
    assert trace.rung[0] == trace.rung[390] == "1 sample"
    assert trace.rung[190] == trace.rung[590] == "2 samples"
    for start in (0, 200, 400):
        assert abs(trace.clean_ms[start + 190] / target - 1) <= 0.1
    changes = sum(a != b for a, b in zip(trace.rung, trace.rung[1:], strict=False))
    assert changes == 3


def test_what_the_next_rung_costs_at_least_must_fit():
    scene = SCENES["fog"]
    low, high = (
        Rung(mode, scene.changes[mode], tuple(Point(q, scene.cost(1.0, mode, q).ms) for q in qualities))
        for mode, qualities in (("1 sample", (0.25, 0.5, 0.71)), ("2 samples", (1.41, 2.0)))
    )
    target = (low.points[-1].cost * high.points[0].cost) ** 0.5
    trace = replay(scene, FrameTimeController(target, Ladder((low, high))), 300, time=lambda _: 1.0)
    assert set(trace.rung[20:]) == {"1 sample"}
    assert set(trace.why[20:]) == {"most"}


def test_between_two_rungs_it_stays_on_one():
    scene, ladder = SCENES["fog"], two_rungs()
    rng = np.random.default_rng(3)
    # Every target from the second rung's start to the first one's end, where either would do.
    for target in np.linspace(ladder.rungs[1].points[0].cost, ladder.rungs[0].points[-1].cost, 5):
        draws = np.exp(0.1 * rng.normal(size=1000))
        trace = replay(
            scene,
            FrameTimeController(target, ladder, quality=0.7),
            1000,
            time=lambda _: 1.0,
            disturbance=Disturbance(noise=lambda frame, draws=draws: draws[frame]),
        )
        assert len(set(trace.rung[300:])) == 1
        assert settling(trace, target, 300) == 0
