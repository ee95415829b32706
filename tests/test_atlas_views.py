"""Cases of the atlas about where the eye is: each is seen to fail when what it guards is broken."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import persp_sw.compositor
import persp_sw.eye_image
import persp_sw.geometry.faces
import persp_sw.renderer
from persp_sw import Volume
from persp_sw.measure.atlas import axis_switch, obliquity, stereo, zoom
from persp_sw.measure.atlas.case import Finding, Scale
from persp_sw.measure.atlas.eye_paths import CORNERS, FACES, PAIRS, across_edge, around, through_corner
from persp_sw.measure.atlas.popping import popping, seam_contrast, seam_steps

QUICK = Scale(quick=True)


def silent(done, total, what):
    pass


def failing(findings: list[Finding], metric: str) -> bool:
    """Whether any of the findings of that metric fails."""
    of_metric = [finding for finding in findings if metric in finding.metric]
    assert of_metric
    return any(not finding.holds for finding in of_metric)


def largest(findings: list[Finding], metric: str) -> float:
    """The largest value of that metric."""
    return max(finding.value for finding in findings if metric in finding.metric)


def brighter_along_x(monkeypatch, factor):
    """Faces along x come out brighter than they should."""
    true = persp_sw.renderer.composite_eye

    def composite_eye(*arguments):
        image = true(*arguments)
        for number, face in enumerate(image.faces):
            image.face_pixels(number)[:] *= factor if face.axis == 0 else 1
        return image

    monkeypatch.setattr(persp_sw.renderer, "composite_eye", composite_eye)


# --- Measures with known answers ---------------------------------------------------------------------------


def test_a_frame_that_changes_three_times_as_much_stands_out_by_three():
    errors = [np.full((4, 4, 4), level) for level in (0.0, 0.1, 0.2, 0.5, 0.6, 0.7)]
    assert popping(errors) == pytest.approx(3)


def test_a_seam_stands_out_by_its_step():
    """Error that alternates by 0.1 from column to column, and by 0.3 across the seam."""
    columns = np.tile([0.0, 0.1], 16)
    columns[16:] = 0.4 - columns[16:]  # 0.1 | 0.4, then 0.3, 0.4 …
    error = np.tile(columns[:, None], (80, 1, 4))
    owner = np.zeros((80, 32), int)
    owner[:, 16:] = 1
    everywhere = np.ones((80, 32), bool)
    # Within 6 pixels of column 15, where the seam is: 11 steps of 0.1 a row, none in 13 columns.
    found = seam_contrast([seam_steps(error, owner, everywhere)])
    beside = np.sqrt(0.1**2 * 11 * 80 / (11 * 80 + 13 * 79))
    assert found == pytest.approx(0.3 / beside)
    assert np.isnan(seam_contrast([seam_steps(error, np.zeros_like(owner), everywhere)]))


def test_arcs_go_from_face_to_face():
    assert (len(FACES), len(PAIRS), len(CORNERS)) == (6, 12, 8)
    for one, other in PAIRS:
        arc = across_edge(one, other)
        for degrees, face in ((-40, one), (40, other)):
            assert arc.direction(degrees) @ face == np.abs(arc.direction(degrees)).max()
    for corner in CORNERS:
        arc = through_corner(corner)
        np.testing.assert_allclose(arc.direction(0), corner / np.sqrt(3))
        ends = [np.abs(arc.direction(degrees)).argmax() for degrees in (-20, 20)]
        assert ends[0] != ends[1]
    seen = {(int(np.abs(d).argmax()), d[np.abs(d).argmax()] > 0) for d in map(around().direction, range(360))}
    assert len(seen) == 6


def test_a_view_of_an_arc_looks_at_the_middle_from_its_distance():
    volume = Volume(np.zeros((9, 9, 9), np.uint8))
    view = across_edge(*PAIRS[0]).view(volume, 7.0, 2.0, 50, (32, 32))
    assert np.linalg.norm(view.eye.position - volume.centre) == pytest.approx(16)
    np.testing.assert_allclose(view.project(volume.centre), (16, 16))


def test_sharpness_is_the_share_of_contrast_kept():
    rng = np.random.default_rng(1)
    truth = rng.random((24, 24, 4))
    assert zoom.sharpness(truth, truth) == 1
    assert zoom.sharpness(0.5 + 0.4 * (truth - 0.5), truth) == pytest.approx(0.4)


def test_an_enlarged_picture_is_linear_between_its_pixels():
    ramp = np.arange(6.0)[:, None, None] + 10 * np.arange(6.0)[:, None] + np.zeros(4)
    found = zoom.enlarged(ramp, 24)
    places = np.clip((np.arange(24) + 0.5) / 4 - 0.5, 0, 5)
    np.testing.assert_allclose(found[..., 0], places[:, None] + 10 * places)
    np.testing.assert_array_equal(zoom.enlarged(ramp, 6), ramp)


# --- Each case fails when what it guards is broken ----------------------------------------------------------


def test_one_face_for_all_rays_pops():
    """As published: one axis for the whole picture, and then another."""
    stage = axis_switch._Stage("smooth", 32, 64)
    stage.renderer.settings = persp_sw.Settings(single_face_tangent=8)
    assert failing(axis_switch._pops(stage, QUICK, silent), "popping across edges, swaying")


def test_pixels_that_move_in_steps_pop(monkeypatch):
    """A pitch that changes by a twentieth in every eighth frame, and all of the picture a little."""
    stage = axis_switch._Stage("smooth", 32, 64)
    degrees = 0.1 * np.arange(12)

    def pops():
        return popping(stage.frames(across_edge(*PAIRS[0]), degrees, 2.0).errors)

    assert pops() < 1.5
    true, asked = persp_sw.geometry.faces._common_pitch, []

    def in_steps(needs):
        asked.append(needs)
        return true(needs) * (1.05 if len(asked) // 8 % 2 else 1.0)

    monkeypatch.setattr(persp_sw.geometry.faces, "_common_pitch", in_steps)
    assert pops() > 1.5


def test_seams_from_one_pixel_to_the_next_show(monkeypatch):
    stage = axis_switch._Stage("smooth", 64, 128)
    assert axis_switch._seams(stage).holds
    for module in (persp_sw.geometry.faces, persp_sw.eye_image):
        monkeypatch.setattr(module, "reach_of", lambda pitch: 1 + 1e-9)
    assert not axis_switch._seams(stage).holds


def test_one_opacity_correction_for_all_rays_thins_slanted_media(monkeypatch):
    """As published in 2001: an interval is as long for every ray as along the axis."""
    true = persp_sw.compositor.Rays

    def rays(geometry, metric, *rest):
        along = np.zeros_like(metric)
        along[2, 2] = metric[2, 2]
        return true(geometry, along, *rest)

    monkeypatch.setattr(persp_sw.compositor, "Rays", rays)
    findings = obliquity._opacity(QUICK)
    assert all(not finding.holds for finding in findings)


def test_coarse_faces_lose_against_a_plain_ray_caster(monkeypatch):
    true = obliquity.Settings
    monkeypatch.setattr(obliquity, "Settings", lambda **more: true(**{**more, "quality": 0.3}))
    assert failing(obliquity._sharp(QUICK, silent), "rms error at quality 4, surface")


def test_a_tangent_badly_chosen_is_seen(monkeypatch):
    true = obliquity.Settings
    monkeypatch.setattr(obliquity, "_SWEEP", (1.0, 3.0))

    def settings(single_face_tangent=3.0):
        return true(single_face_tangent=single_face_tangent, quality=0.15 if single_face_tangent == 3 else 1)

    monkeypatch.setattr(obliquity, "Settings", settings)
    assert failing(obliquity._sweep(QUICK, silent), "rms error at single_face_tangent")


def test_an_image_that_shrinks_before_the_eye_is_too_small(monkeypatch):
    """As published, a pixel a voxel of the nearest slice alone: close up, few are left."""
    true = persp_sw.geometry.faces._volume_pitch
    monkeypatch.setattr(persp_sw.geometry.faces, "_volume_pitch", lambda *a: 4 * true(*a))
    assert failing(zoom._costs(zoom._Way.of(QUICK)), "image at its smallest")


def test_a_picture_out_of_focus_is_not_sharp(monkeypatch):
    true = persp_sw.Renderer.warp

    def warp(self, image, view, out=None):
        picture = true(self, image, view, out)
        return sum(np.roll(picture, (v, u), (0, 1)) for v in (-1, 0, 1) for u in (-1, 0, 1)) / 9

    monkeypatch.setattr(persp_sw.Renderer, "warp", warp)
    assert failing(zoom._sharpness(zoom._Way.of(QUICK), silent), "sharpness at its least")


def test_a_fine_pitch_costs_too_much(monkeypatch):
    monkeypatch.setattr(zoom, "Settings", lambda **more: persp_sw.Settings(quality=3, **more))
    findings = zoom._costs(zoom._Way.of(QUICK))
    assert failing(findings, "samples at their most") and failing(findings, "at its largest")


def test_faces_of_different_brightness_rival(monkeypatch):
    heads = stereo._Heads(QUICK)
    assert not failing(stereo._at_seams(heads, QUICK, silent), "rivalry")
    brighter_along_x(monkeypatch, 1.3)
    assert failing(stereo._at_seams(heads, QUICK, silent), "rivalry")


def test_an_eye_out_of_place_has_wrong_disparity(monkeypatch):
    """The right eye's image is made for a place half a voxel beside it."""
    true = stereo._Heads.images

    def images(self, views, renderer=None):
        left, right = views
        eye = dataclasses.replace(right.eye, position=right.eye.position + 0.3)
        one, other = true(self, (left, type(right)(eye, right.wall)), renderer)
        return [one, dataclasses.replace(other, eye=right.eye)]

    heads = stereo._Heads(QUICK)
    assert stereo._all_around(heads, QUICK).holds
    monkeypatch.setattr(stereo._Heads, "images", images)
    assert not stereo._all_around(heads, QUICK).holds


def test_eyes_far_apart_see_things_along_different_axes(monkeypatch):
    heads = stereo._Heads(QUICK)
    assert stereo._shares(heads, QUICK).holds
    monkeypatch.setattr(stereo, "_APART", 4 * stereo._APART)
    assert not stereo._shares(heads, QUICK).holds
