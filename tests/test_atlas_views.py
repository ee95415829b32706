"""Cases of the atlas about where the eye is: each is seen to fail when what it guards is broken."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import persp_sw.compositor
import persp_sw.geometry.faces
import persp_sw.renderer
from persp_sw import Volume
from persp_sw.measure.atlas import axis_switch, obliquity, stereo, zoom
from persp_sw.measure.atlas.case import Finding, Scale
from persp_sw.measure.atlas.eye_paths import CORNERS, FACES, PAIRS, across_edge, around, through_corner
from persp_sw.measure.atlas.popping import popping, seam_contrast

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
    found = seam_contrast(error, owner, everywhere)
    beside = np.sqrt(0.1**2 * 11 * 80 / (11 * 80 + 13 * 79))
    assert found == pytest.approx(0.3 / beside)
    assert np.isnan(seam_contrast(error, np.zeros_like(owner), everywhere))


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


# --- Each case fails when what it guards is broken ----------------------------------------------------------


def test_a_face_of_its_own_brightness_pops(monkeypatch):
    """As it falls short of its goal anyway: by how much more."""
    stage = axis_switch._Stage("smooth", 32, 64)
    before = largest(axis_switch._pops(stage, QUICK, silent), "popping across edges, walking")
    brighter_along_x(monkeypatch, 1.2)
    assert largest(axis_switch._pops(stage, QUICK, silent), "popping across edges, walking") > 1.5 * before


def test_seams_left_open_show(monkeypatch):
    stage = axis_switch._Stage("smooth", 64, 96)
    assert axis_switch._seams(stage).holds
    monkeypatch.setattr(persp_sw.compositor, "close_seams", lambda faces, images: None)
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


def test_a_pixel_a_voxel_of_the_nearest_slice_alone_fails_close_up(monkeypatch):
    """As published: the intermediate image shrinks to nothing before the eye."""
    monkeypatch.setattr(
        persp_sw.geometry.faces,
        "_volume_pitch",
        lambda geometry, sight: 1 / max(sight.nearest, 0.0 if geometry.inside else sight.nearest, 1e-3),
    )
    assert failing(zoom.run(QUICK, silent), "sharpness at its least")


def test_a_fine_pitch_costs_too_much(monkeypatch):
    monkeypatch.setattr(zoom, "Settings", lambda **more: persp_sw.Settings(quality=3, **more))
    findings = zoom._costs(zoom._Way.of(QUICK))
    assert failing(findings, "samples at their most") and failing(findings, "at its largest")


def test_faces_of_different_brightness_rival(monkeypatch):
    """As it falls short of its goal anyway: by how much more."""
    heads = stereo._Heads(QUICK)
    before = largest(stereo._at_switches(heads, QUICK, silent), "rivalry")
    brighter_along_x(monkeypatch, 1.3)
    assert largest(stereo._at_switches(heads, QUICK, silent), "rivalry") > 1.5 * before


def test_an_eye_out_of_place_has_wrong_disparity(monkeypatch):
    """The right eye's image is made for a place half a voxel beside it."""
    true, asked = stereo._Heads.image, []

    def image(self, view, previous=None):
        asked.append(view)
        beside = 0.3 * (len(asked) % 2)
        moved = dataclasses.replace(view.eye, position=view.eye.position + (beside, beside, beside))
        return dataclasses.replace(true(self, type(view)(moved, view.wall), previous), eye=view.eye)

    heads = stereo._Heads(QUICK)
    assert stereo._all_around(heads, QUICK).holds
    monkeypatch.setattr(stereo._Heads, "image", image)
    assert not stereo._all_around(heads, QUICK).holds


def test_eyes_that_lag_behind_each_other_are_counted(monkeypatch):
    """A memory that is far too good keeps an eye's faces long after the other's have changed."""
    heads = stereo._Heads(QUICK)
    assert stereo._shares(heads, QUICK).holds
    true, asked = persp_sw.Renderer.plan, []

    def plan(self, eye, walls, previous=None):
        asked.append(None)
        first_eye = len(asked) % 2  # the left one remembers nothing, the right one only its first frame
        return true(self, eye, walls, None) if first_eye or len(asked) <= 2 else _PLANS[0]

    _PLANS = []
    views = heads.views(around(), 0.0)
    _PLANS.append(true(heads.renderer, views[1].eye, [views[1].wall]))
    monkeypatch.setattr(persp_sw.Renderer, "plan", plan)
    assert not stereo._shares(heads, QUICK).holds
