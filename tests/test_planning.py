"""Plans: made once a frame, good for every quality, and never composited once they are out of date."""

import numpy as np
import pytest

import persp_sw as psw
from persp_sw import planning
from persp_sw.measure.cave import eye_pair, four_walls, placed
from persp_sw.volume.phantoms import synthetic_ct

FOG = psw.TransferFunction([(0, (1, 1, 1), 0), (40, (1, 1, 1), 0), (255, (1, 1, 1), 0.05)], 1 / 31)
BONE = psw.TransferFunction([(0, (1, 1, 1), 0), (110, (1, 1, 1), 0), (255, (1, 1, 1), 0.9)], 1 / 31)
EYES = [*eye_pair(0), psw.Eye((0.05, 1.5, -0.2)), psw.Eye.at_infinity((0.2, 0.1, 1))]
VOLUME = placed(synthetic_ct(32))


def assert_same(one: psw.EyeImage, other: psw.EyeImage):
    assert one.faces == other.faces
    assert one.samples == other.samples
    np.testing.assert_array_equal(one.pixels, other.pixels)
    np.testing.assert_array_equal(one.box, other.box)


@pytest.mark.parametrize("eye", EYES)
def test_one_plan_serves_every_quality(eye):
    renderer, walls = psw.Renderer(VOLUME, FOG), four_walls(128)
    before = renderer.composite(psw.Eye(eye.position, eye.near, eye.w), walls)
    for previous in (None, before):
        plan = renderer.plan(eye, walls, previous)
        for settings in (
            psw.Settings(),
            psw.Settings(quality=0.3),
            psw.Settings(quality=2, max_intermediate=64),
            psw.Settings(intermediate_size=48),
        ):
            renderer.settings = settings
            assert_same(renderer.composite_plan(plan), renderer.composite(eye, walls, previous))
            assert renderer.features_of_plans([plan]) == renderer.features([eye], walls, [previous])


def test_a_frame_plans_each_eye_once(monkeypatch):
    planned = []
    needs_of = planning.needs_of
    monkeypatch.setattr(planning, "needs_of", lambda *a: planned.append(a) or needs_of(*a))
    renderer, walls = psw.Renderer(VOLUME, FOG), four_walls(128)
    plans = [renderer.plan(eye, walls) for eye in EYES[:2]]
    features = renderer.features_of_plans(plans)
    renderer.settings = psw.Settings(quality=0.5)
    images = [renderer.composite_plan(plan) for plan in plans]
    assert len(planned) == 2
    assert features.faces == sum(len(image.faces) for image in images)


@pytest.mark.parametrize(
    "change",
    [
        lambda renderer: setattr(renderer, "regions", psw.Regions(crop=(8, 20, 0, 31, 4, 31))),
        lambda renderer: setattr(renderer, "transfer", BONE),
        lambda renderer: setattr(renderer, "settings", psw.Settings(skip_empty=False)),
        lambda renderer: setattr(renderer, "settings", psw.Settings(single_face_tangent=8)),
    ],
    ids=["regions", "transfer", "skipping", "tangent"],
)
def test_a_plan_that_is_out_of_date_is_made_anew(change):
    renderer, walls, eye = psw.Renderer(VOLUME, FOG), four_walls(128), psw.Eye((0.2, 1.7, 0.75))
    plan = renderer.plan(eye, walls)
    old = renderer.composite_plan(plan)
    change(renderer)
    new, fresh = renderer.composite_plan(plan), renderer.composite(eye, walls)
    assert old.faces != fresh.faces  # else the test could not fail
    assert_same(new, fresh)


def test_a_plan_of_an_eye_that_sees_nothing():
    renderer = psw.Renderer(VOLUME, FOG)
    away = psw.View.look_at((0, 0, 9), (0, 0, 20), (0, 1, 0), 40, (64, 64))
    plan = renderer.plan(away.eye, [away.wall])
    assert renderer.features_of_plans([plan]).shows_nothing
    assert renderer.composite_plan(plan).faces == ()
    assert renderer.composite_plan(renderer.plan(EYES[0], [])).faces == ()
