"""What a frame asks for, known before it is drawn, against what drawing it took."""

import numpy as np
import pytest

import persp_sw as psw
from persp_sw.measure.cave import SEPARATION, four_walls, placed
from persp_sw.quality.features import features_of
from persp_sw.volume.phantoms import constant

FOG = psw.TransferFunction([(0, (1, 1, 1), 0.001), (2, (1, 1, 1), 0.001)], opacity_unit=1.0)


def renderer(**settings):
    """Of a volume that is visible throughout and never opaque: every sample in the box is taken."""
    volume = placed(constant((40, 40, 40), 1.0))
    return psw.Renderer(volume, FOG, psw.Settings(samples_per_interval=1, preintegrated=False, **settings))


def eyes_at(position):
    return [psw.Eye(np.add(position, (side * SEPARATION / 2, 0, 0))) for side in (-1, 1)]


@pytest.mark.parametrize(
    "position", [(0, 1.6, 1.3), (0.3, 1.5, 0.7), (0.1, 1.6, 0.35), (0.05, 1.55, -0.1), (0.9, 1.2, 0.6)]
)
def test_planned_samples_and_pixels_are_those_taken(position):
    one, walls = renderer(level_of_detail=False), four_walls(1024)
    eyes = eyes_at(position)
    planned = one.features(eyes, walls)
    images = [one.composite(eye, walls) for eye in eyes]
    assert planned.pixels == sum(len(image.pixels) for image in images)
    assert planned.faces == sum(len(image.faces) for image in images)
    taken = sum(image.samples for image in images)
    # A packet of 16 pixels that meets the box is sampled throughout, a steep one twice an interval; faces of
    # an eye inside are 40 pixels wide and take 64.
    assert 0.4 * taken <= planned.samples <= 1.1 * taken


def test_planned_samples_grow_as_those_taken_do():
    one, walls = renderer(level_of_detail=False), four_walls(1024)
    ratios = []
    for z in np.linspace(1.4, 0.6, 9):
        eyes = eyes_at((0, 1.6, z))
        planned = one.features(eyes, walls).samples
        ratios.append(sum(one.composite(eye, walls).samples for eye in eyes) / planned)
    assert np.ptp(np.log(ratios)) < 0.2


def test_features_are_of_quality_one_whatever_is_set():
    walls, eyes = four_walls(256), eyes_at((0, 1.6, 1.0))
    expected = renderer().features(eyes, walls)
    assert renderer(quality=0.3).features(eyes, walls).samples == expected.samples
    assert renderer(intermediate_size=64).features(eyes, walls).pixels == expected.pixels


def test_another_transfer_function_is_another_scene():
    one, walls, eyes = renderer(), four_walls(64), eyes_at((0, 1.6, 1.0))
    before = one.features(eyes, walls).scene
    one.settings = psw.Settings(quality=0.5)
    assert one.features(eyes, walls).scene == before
    one.transfer = psw.editing.with_opacity(FOG, 0, 0.002)
    assert one.features(eyes, walls).scene != before


def test_an_eye_that_sees_nothing_asks_for_nothing():
    one = renderer()
    away = psw.View.look_at((0, 0, 9), (0, 0, 20), (0, 1, 0), 40, (64, 64))
    assert one.features([away.eye], [away.wall]).shows_nothing
    assert features_of([]).shows_nothing


def test_an_eye_at_infinity_asks_for_the_box():
    one = renderer(level_of_detail=False)
    eye, wall = psw.Eye.at_infinity((0, 0, 1)), four_walls(256)[0]
    planned = one.features([eye], [wall])
    taken = one.composite(eye, [wall]).samples
    assert planned.samples == pytest.approx(taken, rel=0.3)
