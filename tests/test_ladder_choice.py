"""Which ways become rungs, and from where to where: curves whose crossings one can work out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from recorded_costs import SCENES

from persp_sw.errors import SettingsError
from persp_sw.measure.replay import replay
from persp_sw.quality.controller import FrameTimeController
from persp_sw.quality.ladder import Ladder, Point
from persp_sw.quality.ladder_choice import ladder_from_points

QUALITIES = 2.0 ** np.arange(-2, 3)
CHANGES = {name: {"samples_per_interval": n} for name, n in (("a", 1), ("b", 2), ("c", 4))}


def way(name, costs, accuracies, qualities=QUALITIES):
    """Points of one way for `ladder_from_points`."""
    rows = zip(qualities, costs, accuracies, strict=False)
    return [(name, CHANGES.get(name, {}), Point(float(q), float(c), float(p))) for q, c, p in rows]


def accuracy_at(ladder: Ladder, cost: float) -> float:
    """PSNR of the rung that is best at a cost, between its points as a straight line over log(cost)."""
    found = []
    for rung in ladder.rungs:
        if cost >= rung.points[0].cost * (1 - 1e-9):
            costs, accuracies = zip(*((p.cost, p.psnr) for p in rung.points), strict=True)
            found.append(np.interp(np.log(cost), np.log(costs), accuracies))
    return max(found, default=-np.inf)


# 6 and 8 dB a doubling: they cross at cost 8.
A = way("a", (1, 4, 16, 64, 256), (30, 42, 54, 66, 78))
B = way("b", (2, 8, 32, 128, 512), (32, 48, 64, 80, 96))


def test_rungs_change_where_the_curves_cross_and_overlap_there():
    ladder = ladder_from_points([*B, *A], "machine", "volume", "program")
    assert (ladder.machine, ladder.volume, ladder.program) == ("machine", "volume", "program")
    assert [rung.name for rung in ladder.rungs] == ["a", "b"]
    assert [rung.changes for rung in ladder.rungs] == [CHANGES["a"], CHANGES["b"]]
    one, two = ladder.rungs
    assert one.points[:2] == (Point(0.25, 1.0, 30.0), Point(0.5, 4.0, 42.0))
    assert one.points[-1].cost == pytest.approx(8 * 1.25, rel=0.03)  # a cell of the comparison is 1.6 %
    assert two.points[0].cost == pytest.approx(8 / 1.25, rel=0.03)
    assert two.points[-1] == Point(4.0, 512.0, 96.0)
    # On the way's own curve, between its points.
    assert one.points[-1].psnr == pytest.approx(30 + 6 * np.log2(one.points[-1].cost))
    assert one.points[-1].quality == pytest.approx(0.25 * one.points[-1].cost ** 0.5)


def test_points_in_any_order_make_the_same_ladder(rng):
    points = [*A, *B]
    shuffled = [points[n] for n in rng.permutation(len(points))]
    assert ladder_from_points(shuffled) == ladder_from_points(points)


def test_what_is_hardly_better_makes_no_rung():
    hardly = way("b", (4, 16, 64, 256), (42.05, 54.05, 66.05, 78.05), QUALITIES[1:])  # 0.3 dB · octaves
    assert [rung.name for rung in ladder_from_points([*A, *hardly]).rungs] == ["a"]
    clearly = way("b", (4, 16, 64, 256), (42.4, 54.4, 66.4, 78.4), QUALITIES[1:])  # 2.4
    assert [rung.name for rung in ladder_from_points([*A, *clearly]).rungs] == ["a", "b"]


def test_a_way_that_is_best_in_two_stretches_makes_two_rungs():
    between = way("b", (4, 16, 64), (45, 57, 67), (0.5, 1, 2))
    ladder = ladder_from_points([*A, *between])
    assert [rung.name for rung in ladder.rungs] == ["a", "b", "a (2)"]
    one, _, again = ladder.rungs
    assert one.changes == again.changes == CHANGES["a"]
    assert one.lowest < one.highest < again.lowest < again.highest


def test_a_gap_is_kept_and_stayed_below():
    far = way("b", (1000, 4000), (90, 99), (1, 2))
    ladder = ladder_from_points([*A, *far])
    one, two = ladder.rungs
    assert one.points[-1] == Point(4.0, 256.0, 78.0)
    assert two.points[0] == Point(1.0, 1000.0, 90.0)


def test_points_that_are_worse_than_others_of_their_way_are_left_out():
    noisy = way("a", (1, 5, 4, 64, 60), (30, 41, 54, 66, 78))  # the second and fourth took too long
    (rung,) = ladder_from_points(noisy).rungs
    assert [point.quality for point in rung.points] == [0.25, 1.0, 4.0]
    coarse = way("a", (1, 4, 5, 16), (30, 42, 43, 54), (0.25, 0.5, 0.4, 1))  # the third is good by chance
    (rung,) = ladder_from_points(coarse).rungs
    assert [point.quality for point in rung.points] == [0.25, 0.5, 1.0]


def test_a_perfect_picture_is_a_point_like_others():
    (rung,) = ladder_from_points(way("a", (1, 4), (40, np.inf))).rungs
    assert np.isfinite(rung.points[-1].psnr)


@pytest.mark.parametrize(
    "points",
    [
        [],
        way("a", (1,), (30,)),
        way("a", (1, 4), (30, 20)),  # slower, and no better
        [*way("a", (1,), (30,)), *way("b", (2,), (40,))],
    ],
)
def test_points_that_make_no_ladder(points):
    with pytest.raises(SettingsError, match="no ladder"):
        ladder_from_points(points)


def test_points_without_accuracy_are_refused():
    with pytest.raises(SettingsError, match="no PSNR"):
        ladder_from_points([("a", {}, Point(1.0, 1.0)), ("a", {}, Point(2.0, 2.0))])


@pytest.mark.parametrize("seed", range(20))
def test_any_points_make_a_ladder_at_least_as_good_as_any_way_alone(seed: int):
    rng = np.random.default_rng(seed)
    points, curves = [], []
    for number in range(rng.integers(1, 6)):
        costs = rng.uniform(0.5, 4) * np.cumprod(rng.uniform(1.2, 3, 6))
        accuracies = rng.uniform(20, 40) + np.cumsum(rng.uniform(0.5, 8, 6))
        points += way(f"way {number}", costs, accuracies, np.geomspace(0.25, 4, 6))
        curves.append((np.log(costs), accuracies))
    ladder = ladder_from_points(points)  # that it ascends, `Ladder` checks
    low, high = np.log(ladder.rungs[0].points[0].cost), max(start[-1] for start, _ in curves)
    costs = np.linspace(low, high, 300)
    ours = np.array([accuracy_at(ladder, cost) for cost in np.exp(costs)])
    octaves = (high - low) / np.log(2)
    for start, accuracies in curves:
        alone = np.interp(costs, start, accuracies)
        usable = costs >= start[0]
        gain = np.where(usable, ours - alone, 0).mean() * octaves
        # It may forgo 0.5 dB · octaves for each of the changes it does not make.
        assert gain > -0.5 * len(curves)


def test_the_controller_walks_it():
    """The recorded fog: two ways measured at one place, walked along the path with their recorded costs."""
    scene = SCENES["fog"]
    points = []
    for mode, bonus in (("1 sample", 0.0), ("2 samples", 6.0)):
        for quality in scene.qualities:
            # What is known of their accuracy: a second sample adds more than its time where quality is high.
            accuracy = 40 + 20 * np.log10(quality) + bonus * (quality > 0.9)
            points.append(
                (mode, scene.changes[mode], Point(quality, scene.cost(1.0, mode, quality).ms, accuracy))
            )
    ladder = ladder_from_points(points)
    assert [rung.name for rung in ladder.rungs] == ["1 sample", "2 samples"]
    one, two = ladder.rungs
    assert two.points[0].cost < one.points[-1].cost  # they overlap
    for rung in (one, two):
        target = rung.cost_at((rung.lowest * min(rung.highest, 2.0)) ** 0.5)
        if rung is two:
            target = max(target, 1.1 * one.points[-1].cost)
        controller = FrameTimeController(target, ladder, quality=0.5)
        trace = replay(scene, controller, 300, time=lambda _: 1.0)
        assert abs(np.median(trace.clean_ms[200:]) / target - 1) <= 0.1
        assert set(trace.rung[200:]) == {rung.name}
