"""Compositing beside the display: whole frames, newest first, refined at rest, given up when useless."""

import threading
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

import persp_sw as psw
from persp_sw.volume.phantoms import synthetic_ct
from vr_plugin.beside import Beside
from vr_plugin.eyes import eyes_of_head
from vr_plugin.loop import Loop
from vr_plugin.pacing import controller_for
from vr_plugin.pose import Pose
from vr_plugin.rest_watch import RestSettings
from vr_plugin.rig import QualityAim, Rig, RigWall
from vr_plugin.trackers import Sample

PERIOD = 1 / 60
FULL = 1.5
WAIT = 60.0


class Head:
    """A tracker whose head is wherever the test puts it."""

    def __init__(self):
        self.at = np.array([0.0, 1.2, 1.0])

    def poll(self, now):
        return [Sample(now, 0, Pose(self.at))]

    def close(self):
        pass


@pytest.fixture
def loop():
    walls = [
        RigWall(psw.Wall((-1, 0, -1), (1, 0, -1), (-1, 2, -1), pixels=(64, 64), name="front"), "anaglyph"),
        RigWall(psw.Wall((-1, 0, 1), (-1, 0, -1), (-1, 2, 1), pixels=(64, 64), name="left"), "anaglyph"),
    ]
    rig = Rig(walls, quality=QualityAim(60.0, 1.0, 0.25, FULL))
    renderer = psw.Renderer(synthetic_ct(24), settings=psw.Settings(quality=0.5))
    return Loop(rig, renderer, Head(), controller_for(renderer, rig.quality, 60.0))


class Display:
    """Shows frame after frame on a counted clock; each time compositing is waited for."""

    def __init__(self, beside):
        self.beside, self.now = beside, 0.0

    def show(self, count=1):
        for _ in range(count):
            self.now += PERIOD
            shown = self.beside.show(self.now)
            assert self.beside.wait(WAIT)
        return shown


def test_a_display_shows_the_eyes_of_one_moment_from_where_the_head_is(loop):
    with Beside(loop, PERIOD) as beside:
        display = Display(beside)
        assert display.show() is None
        for n in range(8):
            loop.tracker.at = np.array([0.05 * np.sin(n), 1.2, 1.0 - 0.03 * n])
            shown = display.show()
            eyes = eyes_of_head(shown.frame.head, loop.rig.eyes)
            for name, image in shown.frame.images.items():
                at = loop.maker.moment(shown.frame.head, eyes).sights[name].eye.position
                np.testing.assert_array_equal(image.eye.position, at)
            newest = eyes_of_head(loop.head.pose_at(display.now + PERIOD), loop.rig.eyes)
            now = loop.maker.moment(shown.moment.head, newest)
            for picture in shown.pictures:
                np.testing.assert_array_equal(picture.view.eye.position, now.sights[picture.eye].eye.position)
                assert picture.image is shown.frame.images[picture.eye]


@pytest.mark.parametrize(("fixed_to", "shift", "turn_deg"), [("head", 0.0, 1.6), ("room", 0.0038, 0.0)])
def test_walls_have_margins_for_a_head_that_moves_on(loop, fixed_to, shift, turn_deg):
    """Fog is all around: a wall is full of it up to its edges, wherever the head went since."""
    fog = psw.Volume(np.full((64, 64, 64), 200, np.uint8))
    transfer = psw.TransferFunction([(0, (1, 1, 1), 0.02), (255, (1, 1, 1), 0.02)], opacity_unit=1.0)
    wall = psw.Wall((-0.2, -0.2, -0.2), (0.2, -0.2, -0.2), (-0.2, 0.2, -0.2), pixels=(512, 512), name="wall")
    if fixed_to == "room":
        lower, across = np.array((-0.2, 0.8, -0.2)), 0.4
        corners = lower, lower + (across, 0, 0), lower + (0, across, 0)
        wall = psw.Wall(*corners, pixels=(512, 512), name="wall")
    placement = replace(loop.rig.placement, size=8.0, centre=(0.0, 1.0, 0.0))
    rig = replace(loop.rig, walls=[RigWall(wall, "left", fixed_to=fixed_to)], placement=placement)
    other = Loop(rig, psw.Renderer(fog, transfer, psw.Settings(quality=8)), Head())
    other.tracker.at = np.array([0.0, 1.0, 0.0])
    with Beside(other, PERIOD) as beside:
        display = Display(beside)
        display.show(3)
        moment, half = other.maker.moment, np.radians(turn_deg) / 2

        def moved(head, eyes, *rest, **more):
            there = Pose(head.position + (shift, 0, 0), (0, np.sin(half), 0, np.cos(half)))
            return moment(there, eyes_of_head(there, rig.eyes), *rest, **more)

        other.maker.moment = moved
        shown = beside.show(display.now + PERIOD)
        (picture,) = shown.pictures
        assert shown.frame.head.orientation[1] == shown.frame.head.position[0] == 0.0
        image = other.renderer.warp(picture.image, picture.view)
        assert image[..., 3].min() > 0.5 * image[..., 3].max()


def test_a_frame_is_new_once(loop):
    with Beside(loop, PERIOD) as beside:
        display = Display(beside)
        display.show(60)  # to full quality, at rest: no further frame is made
        loop.tracker.at = loop.tracker.at + (0.1, 0, 0)
        display.show(60)
        first, again = display.show(), display.show()
        assert again.frame is first.frame and not first.is_new and not again.is_new
        loop.steady.held = 0.6
        display.show()
        news = [display.show().is_new for _ in range(3)]
        assert news == [True, False, False]


def test_at_rest_it_refines_to_full_quality_and_then_does_nothing(loop):
    with Beside(loop, PERIOD) as beside:
        loop.steady.controller.target_ms = 0.2  # far from what a moving picture could have
        display = Display(beside)
        assert display.show(15).frame.made.quality < 0.5
        shown = display.show(60)
        assert shown.frame.made.quality == FULL and shown.frame.made.choice.why == "refined"
        at_rest = loop.renderer.last
        display.show(20)
        assert loop.renderer.last is at_rest  # nothing was composited
        whole = loop.renderer.composite(shown.frame.images["left"].eye, _walls(shown, "left"))
        error = np.abs(loop.renderer.warp(whole, _view(shown)) - loop.renderer.warp(*_seen(shown)))
        assert error.max() < 0.02  # the pitch may have stayed where it was


def test_a_scene_that_changes_ends_the_rest(loop):
    with Beside(loop, PERIOD) as beside:
        display = Display(beside)
        display.show(60)
        before = display.show().frame
        loop.regions = replace(loop.regions, crop=(0, 12, 0, 23, 0, 23))
        after = display.show(3).frame
        assert after is not before and after.moment.regions is loop.regions
        samples = [sum(s["samples"] for s in f.statistics.values()) for f in (before, after)]
        assert samples[1] < samples[0]


def _walls(shown, eye):
    return [picture.view.wall for picture in shown.pictures if picture.eye == eye]


def _view(shown):
    return next(p.view for p in shown.frame.pictures if p.eye == "left")


def _seen(shown):
    picture = next(p for p in shown.frame.pictures if p.eye == "left")
    return picture.image, picture.view


def test_motion_ends_refinement_in_bounded_steps(loop):
    with Beside(loop, PERIOD) as beside:
        display = Display(beside)
        display.show(60)
        loop.steady.controller.target_ms = 0.2  # what is wanted of a moving picture is far away
        qualities = []
        for _ in range(30):
            loop.tracker.at = loop.tracker.at + (0.01, 0, 0)
            qualities.append(display.show().frame.made.quality)
        steps = np.abs(np.diff(np.log(qualities)))
        assert qualities[0] == FULL and qualities[-1] < 0.5
        assert steps.max() <= 0.75 + 1e-9


def test_noise_of_a_tracker_is_rest_and_a_step_aside_is_not(loop):
    rng = np.random.default_rng(1)
    with Beside(loop, PERIOD) as beside:
        display = Display(beside)
        place = loop.tracker.at
        for _ in range(60):
            loop.tracker.at = place + rng.normal(scale=1e-4, size=3)
            display.show()
        shown = display.show()
        assert shown.frame.made.quality == FULL
        loop.tracker.at = place + (0.02, 0, 0)
        moved = [display.show().frame for _ in range(3)][-1]
        assert moved.made.choice.why != "refined"
        assert abs(moved.head.position[0] - place[0]) > 0.01


@contextmanager
def refinement_under_way(loop):
    """A display at rest whose refinement has begun; it goes on when told to: display, event, its cancel."""
    begun, go_on, cancels = threading.Event(), threading.Event(), []
    make = loop.steady.make

    def slow(moment, cancel, resting):
        if resting:
            cancels.append(cancel)
            begun.set()
            assert go_on.wait(WAIT)
        return make(moment, cancel, resting)

    loop.steady.make = slow
    with Beside(loop, PERIOD) as beside:
        display = Display(beside)
        while display.now + PERIOD < RestSettings().seconds:
            display.show()
        display.now += 2 * PERIOD
        beside.show(display.now)
        assert begun.wait(WAIT)
        (cancel,) = cancels
        yield display, go_on, cancel


def test_refinement_under_way_is_given_up_when_the_head_moves(loop):
    with refinement_under_way(loop) as (display, go_on, cancel):
        loop.tracker.at = loop.tracker.at + (0.05, 0, 0)
        display.now += PERIOD
        display.beside.show(display.now)
        assert cancel.is_cancelled
        go_on.set()
        assert display.show().frame.made.choice.why != "refined"


def test_a_scene_that_changes_in_every_frame_is_still_shown(loop):
    """Work for a scene that is no more is given up, but never twice without a frame between."""
    given_up = []
    make = loop.steady.make
    begun, go_on = threading.Semaphore(0), threading.Semaphore(0)

    def slow(moment, cancel, resting):
        begun.release()
        assert go_on.acquire(timeout=WAIT)
        given_up.append(cancel.is_cancelled)
        cancel.check()
        return make(moment, cancel, resting)

    loop.steady.make = slow
    with Beside(loop, PERIOD) as beside:
        beside.show(0.0)
        for n in range(1, 11):
            assert begun.acquire(timeout=WAIT)  # work for the scene before is under way
            loop.regions = replace(loop.regions)  # another object: another scene
            beside.show(n * PERIOD)
            go_on.release()
        go_on.release(100)
        assert beside.wait(WAIT)
    assert given_up[:10] == [True, False] * 5


def test_walls_keep_their_eyes_until_those_of_another_mode_are_there(loop):
    begun, go_on = threading.Event(), threading.Event()
    make = loop.steady.make

    def slow(moment, cancel, resting):
        if "middle" in moment.sights:
            begun.set()
            assert go_on.wait(WAIT)
        return make(moment, cancel, resting)

    loop.steady.make = slow
    with Beside(loop, PERIOD) as beside:
        display = Display(beside)
        display.show(40)
        loop.toggle_mono()
        for n in range(1, 4):
            shown = beside.show(display.now + n * PERIOD)
            assert {picture.eye for picture in shown.pictures} == {"left", "right"}
        assert begun.wait(WAIT)
        go_on.set()
        shown = display.show(2)
        assert {picture.eye for picture in shown.pictures} == {"middle"}
        assert {s.shown_mode for s in shown.moment.stereo.values()} == {"mono"}


def test_compositing_that_takes_longer_than_a_head_is_foreseen_loses_no_head(loop):
    make = loop.steady.make

    def slow(moment, cancel, resting):
        frame = make(moment, cancel, resting)
        return replace(frame, made=replace(frame.made, cost=psw.FrameCost(2000.0, 1.0, 1.0)))

    loop.steady.make = slow
    with Beside(loop, PERIOD) as beside:
        display = Display(beside)
        for _ in range(10):
            loop.tracker.at = loop.tracker.at + (0.01, 0, 0)
            shown = display.show()
        assert loop.head.losses == 0
        assert np.abs(shown.frame.head.position - loop.tracker.at).max() < 0.1
        assert display.show(60).frame.made.quality == FULL  # it comes to rest


def test_a_key_ends_refinement_under_way(loop):
    with refinement_under_way(loop) as (display, go_on, cancel):
        loop.steady.held = 0.4
        display.beside.show(display.now + PERIOD)
        assert cancel.is_cancelled
        go_on.set()
        assert display.show(3).frame.made.quality == 0.4


def test_what_compositing_raises_reaches_the_display(loop):
    class Broken(Exception):
        pass

    def fail(*_):
        raise Broken("no voxel was there")

    loop.steady.make = fail
    with Beside(loop, PERIOD) as beside:
        assert beside.show(0.0) is None
        assert beside.wait(WAIT)
        with pytest.raises(Broken, match="no voxel"):
            beside.show(PERIOD)


def test_closing_gives_up_what_is_composited(loop):
    begun, seen = threading.Event(), []
    make = loop.steady.make

    def endless(moment, cancel, resting):
        begun.set()
        while not cancel.is_cancelled:
            make(moment, None, resting)
        seen.append(True)
        cancel.check()

    loop.steady.make = endless
    beside = Beside(loop, PERIOD)
    beside.show(0.0)
    assert begun.wait(WAIT)
    beside.close()
    assert seen == [True]
