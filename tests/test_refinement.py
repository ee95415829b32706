"""Refinement at rest: up the ladder to its end in bounded steps, and down again with motion."""

from itertools import pairwise
from math import exp, log

import pytest

from persp_sw.quality.controller import Choice
from persp_sw.quality.ladder import Ladder, Point, Rung
from persp_sw.quality.rest import Refinement

ONE = Ladder((Rung("all", {}, (Point(0.25, 0.1), Point(2.0, 8.0))),))
# The second rung begins within the first's costs: quality 0.5 there costs what 1.0 does here.
TWO = Ladder(
    (
        Rung("fast", {}, (Point(0.25, 0.0625), Point(1.0, 1.0), Point(2.0, 4.0))),
        Rung("fine", {"samples_per_interval": 2}, (Point(0.5, 1.0), Point(1.0, 4.0), Point(2.0, 16.0))),
    )
)
ROUNDING = 1e-12


def made(refinement, choice, resting):
    """The next choice, its image finished."""
    following = refinement.next(choice, resting)
    refinement.made(following)
    return following


def climb(refinement, choice, count):
    return [made(refinement, choice, True) for _ in range(count)]


def test_it_climbs_to_full_quality_in_no_more_images_than_promised():
    refinement, choice = Refinement(ONE), Choice(0.4, "all", why="steady")
    assert made(refinement, choice, False) is choice and not refinement.is_full
    images = climb(refinement, choice, 20)
    needed = next(n for n, image in enumerate(images, 1) if image.quality == 2.0)
    assert needed <= log(2.0 / 0.4) / refinement.step + 1
    assert refinement.is_full and images[-1].quality == 2.0
    assert {image.why for image in images} == {"refined"}


def test_no_step_is_larger_than_that_of_a_moving_picture():
    refinement = Refinement(ONE, step=0.2)
    images = [Choice(0.4, "all"), *climb(refinement, Choice(0.4, "all"), 12)]
    steps = [log(b.quality / a.quality) for a, b in pairwise(images)]
    assert max(steps) <= 0.2 + ROUNDING and min(steps) >= 0


def test_the_climb_takes_no_longer_than_promised():
    """A cost of q²: all images of a climb together over the last one's."""
    refinement = Refinement(ONE)
    costs = [image.quality**2 for image in climb(refinement, Choice(0.25, "all"), 40)]
    costs = costs[: costs.index(4.0) + 1]
    assert sum(costs) / costs[-1] <= 1 + 1 / (1 - exp(-2 * refinement.step))


def test_from_a_rung_s_end_it_goes_on_at_equal_cost_on_the_next():
    refinement, choice = Refinement(TWO), Choice(1.9, "fast")
    images = climb(refinement, choice, 3)
    assert (images[0].rung, images[0].quality) == ("fast", 2.0) and not refinement.is_full
    assert (images[1].rung, images[1].quality) == ("fine", pytest.approx(1.0))
    assert images[1].changes == {"samples_per_interval": 2}
    assert images[2].quality > images[1].quality
    assert climb(refinement, choice, 10)[-1].quality == 2.0 and refinement.is_full


def test_motion_takes_it_down_in_larger_steps_and_no_lower_than_the_controller_wants():
    refinement, choice = Refinement(ONE), Choice(0.3, "all", why="steady")
    climb(refinement, choice, 20)
    down = [made(refinement, choice, False) for _ in range(6)]
    steps = [log(a.quality / b.quality) for a, b in pairwise(down)]
    assert log(2.0 / down[0].quality) == pytest.approx(3 * refinement.step)
    assert max(steps) <= 3 * refinement.step + ROUNDING
    assert [image.why for image in down] == ["falling"] * 2 + ["steady"] * 4
    assert down[-1] is choice


def test_it_falls_back_to_the_rung_that_the_controller_is_on():
    refinement, choice = Refinement(TWO), Choice(0.5, "fast")
    climb(refinement, choice, 20)
    down = made(refinement, choice, False)
    assert down.rung == "fast" and down.quality == pytest.approx(2.0 * exp(-0.75))


def test_motion_follows_the_controller_however_it_moves():
    refinement = Refinement(ONE)
    for quality in (0.3, 1.9, 0.3, 0.25, 2.0):
        choice = Choice(quality, "all")
        assert made(refinement, choice, False) is choice


def test_quality_held_by_hand_stays_at_rest_too():
    refinement = Refinement(ONE)
    climb(refinement, Choice(0.5, "all"), 3)
    held = Choice(0.7, "all", why="held")
    assert made(refinement, held, True) is held
    off = Choice(5.0, "all", why="steady")  # beyond the ladder's end
    assert made(refinement, off, True) is off
    choice = Choice(0.5, "all")
    assert made(refinement, choice, False) is choice  # nothing to come down from


def test_a_better_choice_of_the_controller_is_where_it_starts():
    refinement = Refinement(ONE)
    climb(refinement, Choice(0.3, "all"), 1)
    assert made(refinement, Choice(1.5, "all"), True).quality == pytest.approx(1.5 * exp(0.25))


def test_from_the_very_end_of_a_rung_it_climbs_too():
    """Where a controller stays that cannot afford the next rung; equal costs must not hold it."""
    refinement = Refinement(TWO)
    images = climb(refinement, Choice(2.0, "fast", why="most"), 8)
    assert [image.rung for image in images[:2]] == ["fine", "fine"]
    assert images[1].quality > images[0].quality
    assert images[-1].quality == 2.0 and refinement.is_full


def test_an_image_that_was_given_up_does_not_count():
    refinement, choice = Refinement(ONE), Choice(0.4, "all", why="steady")
    first = refinement.next(choice, resting=True)
    assert refinement.next(choice, resting=True) == first and not refinement.is_full
    climb(refinement, choice, 5)
    up = refinement.next(choice, resting=True)  # given up
    down = made(refinement, choice, False)
    assert down.quality < up.quality
