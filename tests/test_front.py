"""The front of time against accuracy, and the search for what is on it: with made-up costs, no clock."""

from __future__ import annotations

from collections import Counter

import pytest

from persp_sw.measure.front import Space, Trial, Way, front, near_front, search
from persp_sw.measure.modes import OPTIONS, SAMPLING
from persp_sw.settings import Settings

QUALITIES = (0.25, 0.5, 1.0, 2.0, 4.0)
SPACE = Space(
    {"coarse": {"samples_per_interval": 1}, "fine": {"samples_per_interval": 2}, "bad": {}},
    {
        "levels": {"flat": {"level_of_detail": False}},
        "end": {"late": {"residual": 0.0}, "early": {"residual": 0.1}},
    },
    QUALITIES,
)


def test_the_front_is_what_nothing_beats(rng):
    ms, accuracy = rng.integers(1, 20, (2, 60)).astype(float)
    unbeaten = {
        (m, a)
        for m, a in zip(ms, accuracy, strict=True)
        if not any((m2 <= m and a2 >= a) and (m2 < m or a2 > a) for m2, a2 in zip(ms, accuracy, strict=True))
    }
    kept = front(ms, accuracy)
    assert [(ms[n], accuracy[n]) for n in kept] == sorted(unbeaten)


def test_the_front_of_a_few_points():
    ms = [3, 1, 2, 2, 5, 4]
    accuracy = [30, 10, 20, 25, 30, 40]
    assert front(ms, accuracy) == [1, 3, 0, 5]
    assert front([], []) == []
    # 20 dB in 2 are beaten by 25 in as much, but not by a tenth of the time; 30 in 5 by 40 in 4.
    assert near_front(ms, accuracy, slack=1.1) == [0, 1, 2, 3, 5]
    assert near_front(ms, accuracy, slack=1.7) == [0, 1, 2, 3, 4, 5]


class Planted:
    """A scene in which one combination is best, and notes of what was tried."""

    def __init__(self):
        self.tried: Counter[tuple[Way, float]] = Counter()

    def __call__(self, way: Way, quality: float) -> Trial:
        self.tried[way, quality] += 1
        ms, psnr = quality**1.5, 30 + 20 * quality**0.5
        if way.sampling == "fine":
            ms, psnr = 2 * ms, psnr + 5
        if way.sampling == "bad":
            ms, psnr = 10 * ms, psnr - 20
        if "flat" in way.varied:  # better for low qualities, nothing but slow above
            ms, psnr = (ms, psnr + 3) if quality < 1 else (3 * ms, psnr)
        if "late" in way.varied and way.sampling == "fine":  # the planted one
            ms, psnr = 0.7 * ms, psnr + 10
        picture = (way.sampling, quality, "flat" in way.varied, "late" in way.varied)
        return Trial(ms, psnr, picture)  # ending early changes no pixel here


def test_the_search_finds_the_planted_best():
    scene = Planted()
    found = search(SPACE, scene)
    assert all((Way(name), quality) in found for name in SPACE.sampling for quality in QUALITIES)
    assert {(Way("fine", ("late",)), quality) for quality in (1.0, 2.0, 4.0)} <= set(found)
    # One option on top of another, where both help.
    assert {(Way("fine", ("flat", "late")), quality) for quality in (0.25, 0.5)} <= set(found)
    assert set(scene.tried.values()) == {1}


def test_the_search_leaves_out_what_is_of_no_use():
    scene = Planted()
    found = search(SPACE, scene)
    assert len(set(found)) == len(found)
    assert not [way for way, _ in scene.tried if way.sampling == "bad" and way.varied]
    assert not [way for way, _ in found if "early" in way.varied]  # the same picture
    assert (Way("coarse", ("flat",)), 4.0) not in found
    assert len(scene.tried) < 3 * 2 * 3 * len(QUALITIES)  # all combinations


def test_everything_on_the_front_of_what_was_tried_is_measured():
    scene = Planted()
    found = search(SPACE, scene)
    points = {key: Planted()(*key) for key in scene.tried}
    keys = list(points)
    best = [keys[n] for n in front([points[k].ms for k in keys], [points[k].psnr for k in keys])]
    assert set(best) <= set(found)


def test_a_way_sets_all_that_a_chart_varies():
    space = Space(SAMPLING, OPTIONS, (1.0,))
    varied = {name for option in OPTIONS.values() for changes in option.values() for name in changes}
    for sampling in SAMPLING:
        plain = space.changes(Way(sampling))
        assert set(plain) == varied | {"samples_per_interval", "preintegrated"}
        for option in OPTIONS.values():
            for name in option:
                changed = space.changes(Way(sampling, (name,)))
                assert [key for key in plain if plain[key] != changed[key]] == list(option[name])
        for key in varied:
            assert plain[key] == getattr(Settings(), key)


@pytest.mark.parametrize("way", [Way("1 sample"), Way("1 sample", ("no levels of detail", "residual 0.02"))])
def test_names(way: Way):
    assert way.name in ("1 sample", "1 sample, no levels of detail, residual 0.02")
