"""Depths of eye images in a loop: measured once in a while, by turns, and when the eye has moved."""

from dataclasses import replace

import numpy as np
import pytest

import persp_sw as psw
from persp_sw.volume.phantoms import synthetic_ct
from vr_plugin.depths import KeptDepths

WALL = psw.Wall((-40, 60, -40), (40, 60, -40), (-40, 60, 40), pixels=(64, 64))


@pytest.fixture
def scene():
    renderer = psw.Renderer(synthetic_ct(24), settings=psw.Settings(quality=0.5, depth_slabs=1))
    return renderer, KeptDepths(renderer)


def images(scene, positions, names=("left", "right")):
    """Composite each position for each name: the images, and which of them had their depth measured."""
    renderer, depths = scene
    made, measured = [], []
    for position in positions:
        for name in names:
            eye = psw.Eye(np.asarray(position, float))

            def make(eye=eye):
                image = renderer.composite(eye, [WALL])
                measured.append(image.depth is not None)
                return image

            made.append(depths.composite(name, eye, make))
    return made, np.reshape(measured, (-1, len(names)))


def test_an_eye_at_rest_is_measured_now_and_then_and_never_both_at_once(scene):
    made, measured = images(scene, [(12, -30, 12)] * 100)
    assert measured[0].all() and not measured[1:].all(1).any()
    assert (measured.sum(0) <= 100 / 30 + 2).all() and (measured.sum(0) >= 3).all()
    assert {image.depth for image in made} == {made[0].depth}  # one eye's, and the same one


def test_an_image_is_what_it_would_be_but_for_its_depth(scene):
    made, _ = images(scene, [(12, -30, 12)] * 3, ("left",))
    for image in made:
        np.testing.assert_array_equal(image.pixels, made[0].pixels)
        assert image.depth == made[0].depth


def test_an_eye_that_moves_is_measured_again(scene):
    made, measured = images(scene, [(12, -30, 12), (12.1, -30, 12), (12, -34, 12), (12, -34, 12)], ("left",))
    assert measured[:, 0].tolist() == [True, False, True, False]
    assert made[2].depth == pytest.approx(made[0].depth + 4, rel=0.05)


def test_other_settings_are_left_alone(scene):
    renderer, _ = scene
    for slabs in (0, 2):
        renderer.settings = replace(renderer.settings, depth_slabs=slabs)
        made, _ = images(scene, [(12, -30, 12)] * 3, ("left",))
        assert {len(image.slabs) for image in made} == {slabs}
    renderer.settings = replace(renderer.settings, depth_slabs=1)
    images(scene, [(12, -30, 12)] * 3, ("left",))
    assert renderer.settings.depth_slabs == 1


def test_where_nothing_is_seen_there_is_no_depth(scene):
    renderer, depths = scene
    away = psw.Wall((-40, -60, -40), (40, -60, -40), (-40, -60, 40), pixels=(64, 64))
    eye = psw.Eye((12.0, -30.0, 12.0))
    for wall in (away, WALL, away):
        image = depths.composite("left", eye, lambda wall=wall: renderer.composite(eye, [wall]))
        assert (image.depth is not None) == bool(image.faces) == (wall is WALL)


def test_eyes_that_moved_together_take_turns_again(scene):
    walk = [(12, -30, 12)] * 3 + [(12, -36, 12)] * 90
    _, measured = images(scene, walk)
    assert measured[3].all() and not measured[4:].all(1).any()
    assert (measured[4:].sum(0) >= 2).all()


def test_other_faces_and_other_regions_are_measured_anew(scene):
    renderer, depths = scene
    inside = psw.Eye(renderer.volume.centre)
    measured = []

    def look(wall):
        def make():
            image = renderer.composite(inside, [wall])
            measured.append(image.depth is not None)
            return image

        return depths.composite("left", inside, make)

    back = psw.Wall((40, -60, -40), (-40, -60, -40), (40, -60, 40), pixels=(64, 64))
    for wall in (WALL, WALL, back, back, back):
        look(wall)
    # The image that shows other faces has the old depth, the next one its own.
    assert measured == [True, False, False, True, False]
    renderer.regions = replace(renderer.regions, crop=(0, 12, 0, 23, 0, 23))
    measured.clear()
    for _ in range(8):
        look(back)
    assert measured.count(True) == 1
