"""Pictures with shadows against the reference and geometry; when shadows are made."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_shadows import CLOUD, POSES, WHITE, blobs, lit_from
from tolerances import SHADOW_OWN, SHADOW_PICTURE, SHADOW_SOFT
from views import DIRECTIONS, random_pose, view_of

from persp_sw import (
    Cut,
    Light,
    Lighting,
    Look,
    Modulation,
    Regions,
    Renderer,
    Settings,
    TransferFunction,
    View,
    Volume,
    reference,
    renderer,
)
from persp_sw.optics.shadows import Shadows
from persp_sw.optics.transfer2d import Box, TransferFunction2D

TWO = (Light((1, 0.9, 0.8), (1, 0.8, 0.4), True), Light((-2, -1, 1), (0.1, 0.3, 0.8), True))
SHADED = Look(Lighting(headlight=0.2, lights=TWO))


def without_shadows(look):
    lights = tuple(replace(light, shadows=False) for light in look.lighting.lights)
    return replace(look, lighting=replace(look.lighting, lights=lights))


FINE = {"quality": 4, "samples_per_interval": 4, "level_of_detail": False}


def picture(volume, transfer, view, look, regions=None, **settings):
    settings = Settings(residual=0, **FINE | settings)
    return Renderer(volume, transfer, settings, regions, look=look).render(view)


def rms(difference):
    return float(np.sqrt(np.mean(difference**2)))


def assert_shadowed_right(view, volume, transfer=CLOUD, look=SHADED, regions=None, **settings):
    truth = reference.render(volume, transfer, view, regions=regions, look=look, tolerance=1e-2)
    ours = picture(volume, transfer, view, look, regions, **settings)
    plain = picture(volume, transfer, view, without_shadows(look), regions, **settings)
    changed = rms(plain - truth)
    assert changed > 0.002
    assert rms(ours - truth) < max(SHADOW_PICTURE, 0.1 * changed) and rms(ours - truth) < 0.65 * changed
    np.testing.assert_allclose(ours[..., 3], plain[..., 3], rtol=0, atol=1e-6)  # shadows hide nothing


@pytest.mark.parametrize("pose", [*POSES, "mirrored"])
@pytest.mark.parametrize("towards", [DIRECTIONS[1], DIRECTIONS[3], DIRECTIONS[4]])
def test_shadowed_pictures_equal_the_reference(towards, pose, rng):
    poses = POSES | {"mirrored": {"mirrored": True, "spacing": (1, 0.8, 1.2)}}
    turned = np.eye(4) if pose == "identity" else random_pose(rng, **poses[pose])
    volume = blobs(world_from_object=turned)
    assert_shadowed_right(view_of(volume, towards, size=(24, 18)), volume)


def test_an_eye_inside_sees_shadows_too():
    volume = blobs()
    view = View.look_at((7.2, 7, 6.4), (4.7, 4.8, 4.2), (0, 0, 1), 70, (20, 16))
    assert_shadowed_right(view, volume)


@pytest.mark.parametrize("offset", [0.0, 1.3, 4.0])
def test_shadows_begin_where_they_are_told_to(offset):
    volume = blobs(spacing=(1, 0.7, 1.2))
    look = replace(SHADED, lighting=replace(SHADED.lighting, shadow_offset=offset))
    assert_shadowed_right(view_of(volume, DIRECTIONS[1], size=(24, 18)), volume, look=look)


def test_pictures_of_what_is_cut():
    volume = blobs()
    view = view_of(volume, DIRECTIONS[1], size=(24, 18))
    regions = Regions(clip=[(-0.3, -0.2, -1, 11.2)], cut=[Cut((1, 0.2, 0, -11.1), 1.5, "outside")])
    assert_shadowed_right(view, volume, regions=regions)


def test_shadows_of_two_dimensional_functions_and_modulation():
    volume = blobs()
    view = view_of(volume, DIRECTIONS[1], size=(24, 18))
    soft = TransferFunction2D([Box((40, 270), (0, 110), (1, 0.5, 0.2), 0.8, 1.0)], 1.0)
    assert_shadowed_right(view, volume, soft)
    assert_shadowed_right(view, volume, look=replace(SHADED, modulation=Modulation(0, 0.3, 0.8)))


def test_coarser_samples_and_levels_are_shadowed_alike():
    """Quality 0.25: coarse levels look up the same shadows, at the same places of the volume."""
    volume = blobs(finer=2)
    view = view_of(volume, DIRECTIONS[1], size=(24, 18))
    renderer = Renderer(volume, CLOUD, Settings(residual=0, quality=0.25), look=SHADED)
    coarse, fine = renderer.render(view), picture(volume, CLOUD, view, SHADED)
    assert any(renderer.detail.store(level).bytes for level in range(1, len(renderer.detail)))
    plain = picture(volume, CLOUD, view, without_shadows(SHADED))
    both = Renderer(volume, CLOUD, renderer.settings, look=without_shadows(SHADED)).render(view) - coarse
    assert rms(both - (plain - fine)) < 0.4 * rms(plain - fine)


# --- A ball over a plane ----------------------------------------------------------------------------------

BALL, RADIUS, PLANE = np.array([14.0, 11.0, 12.0]), 4.0, 3.25
SUN = np.array([1.0, 0.2, 1.6]) / np.linalg.norm([1.0, 0.2, 1.6])


@pytest.mark.parametrize("factor", [1, 2])
def test_a_ball_darkens_the_plane_below_it_where_geometry_says(factor, monkeypatch):
    z, y, x = np.indices((20, 23, 24))
    distance = np.sqrt((x - BALL[0]) ** 2 + (y - BALL[1]) ** 2 + (z - BALL[2]) ** 2)
    depth = np.maximum(RADIUS - distance, PLANE - z)
    volume = Volume(np.clip(128 + 40 * depth, 0, 255).astype(np.uint8))
    opaque = TransferFunction([(127, WHITE, 0), (130, WHITE, 1)], 0.5)
    view = View.parallel((11.5, 11, 60), (11.5, 11, 0), (0, 1, 0), 20, (48, 48))
    look = lit_from(SUN, ambient=0.2, diffuse=0.8, specular=0.0, shadow_offset=2.0)
    made = renderer.Shadows
    monkeypatch.setattr(renderer, "Shadows", lambda *of: made(*of, factor))
    image = picture(volume, opaque, view, look, preintegrated=False)
    plain = picture(volume, opaque, view, without_shadows(look), preintegrated=False)
    places = view.starts() * (1, 1, 0) + (0, 0, PLANE)
    beside = np.hypot(*(places - BALL)[..., :2].transpose(2, 0, 1)) > RADIUS + 0.7
    away = places - BALL
    off = np.linalg.norm(away - (away @ SUN)[..., None] * SUN, axis=-1)  # light's line from the ball's middle
    soft = SHADOW_SOFT * np.sqrt(factor)
    dark, bright = beside & (off < RADIUS - soft), beside & (off > RADIUS + soft)
    inner = np.abs(places - (11.5, 11, PLANE)).max(-1) < 9
    assert dark.sum() > 15 and (bright & inner).sum() > 600
    assert image[dark][:, :3].max() < 0.2 + 0.05
    assert np.abs(image - plain)[bright & inner].max() < SHADOW_OWN * factor**1.5
    assert np.median(np.abs(image - plain)[bright & inner]) < SHADOW_OWN
    assert np.abs(plain[bright & inner][:, :3] - (0.2 + 0.8 * SUN[2])).max() < 0.01


# --- When they are made -----------------------------------------------------------------------------------


def test_shadows_are_made_anew_when_what_casts_them_changes_and_only_then(monkeypatch):
    made = []

    class Counted(Shadows):
        def __init__(self, *of):
            made.append(of)
            super().__init__(*of)

    monkeypatch.setattr(renderer, "Shadows", Counted)
    volume = blobs()
    mine = Renderer(volume, CLOUD, Settings(residual=0), look=without_shadows(SHADED))
    views = [view_of(volume, towards, size=(12, 9)) for towards in DIRECTIONS]
    mine.render(views[0])
    assert not made  # no light asks for any
    mine.look = replace(SHADED, lighting=None)
    mine.render(views[0])
    assert not made

    def drawn(count):
        pictures = [mine.render(view) for view in views[:3]]
        assert len(made) == count
        fresh = Renderer(volume, mine.transfer, mine.settings, mine.regions, look=mine.look)
        np.testing.assert_array_equal(pictures[0], fresh.render(views[0]))
        del made[count:]

    mine.look = SHADED
    drawn(1)
    mine.settings = replace(mine.settings, quality=0.5)
    drawn(1)
    mine.transfer = TransferFunction([(60, WHITE, 0), (255, WHITE, 0.5)], 1.0)
    drawn(2)
    mine.regions = Regions(clip=[(-1, 0, 0, 9)])
    drawn(3)
    mine.look = replace(SHADED, lighting=replace(SHADED.lighting, lights=TWO[:1]))
    drawn(4)
    mine.look = without_shadows(SHADED)
    drawn(4)


def test_time_spent_on_shadows_counts_as_encoding():
    volume = blobs()
    mine = Renderer(volume, CLOUD, look=without_shadows(SHADED))
    view = view_of(volume, DIRECTIONS[1], size=(12, 9))
    mine.render(view)
    mine.render(view)
    assert mine.last["encode_ms"] == 0
    mine.look = SHADED
    mine.render(view)
    assert mine.last["encode_ms"] > 0
    mine.render(view)
    assert mine.last["encode_ms"] == 0


def test_a_light_that_finds_nothing_in_its_way_is_as_without_shadows():
    volume = blobs()
    for towards in DIRECTIONS[:3]:
        view = view_of(volume, towards, size=(24, 18))
        clear = TransferFunction([(40, WHITE, 0), (255, WHITE, 1e-6)], 1.0)
        one, other = (picture(volume, clear, view, look) for look in (SHADED, without_shadows(SHADED)))
        assert one.max() > 0
        np.testing.assert_allclose(one, other, rtol=2e-5, atol=1e-12)
