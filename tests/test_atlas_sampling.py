"""Cases of the atlas about sampling, opacity, clipping, far slices and long runs: each is seen to fail once.

That they hold as things are, `test_atlas` asserts of all cases.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tolerances import CLOSED_FORM

from persp_sw import Renderer, Settings, View
from persp_sw.errors import GraphicsError
from persp_sw.geometry.parts import shown_parts
from persp_sw.kernels.composite import composite as composite_face
from persp_sw.measure.atlas import (
    clipping,
    colour_exposure,
    far_slices,
    long_runs,
    moving_plane,
    opacity_extremes,
    sharp_classification,
    texture_run,
    thin_sheets,
)
from persp_sw.measure.atlas.case import Scale
from persp_sw.measure.atlas.compositing import composite, homogeneous, view_towards
from persp_sw.measure.atlas.face_views import face_view
from persp_sw.measure.exact import Slab
from persp_sw.measure.memory import resident_bytes
from persp_sw.optics import classification as tables
from persp_sw.optics.classification import Classification
from persp_sw.sampling import Sampling
from persp_sw.warp.framebuffer import Framebuffer
from persp_sw.warp.gl_objects import Texture
from persp_sw.warp.texture import TextureWarp

QUICK = Scale(quick=True)


def no_progress(_done, _total, _what):
    """Nobody looks."""


def failing(findings):
    """The metrics that do not hold, one text; and something holds or fails at all."""
    assert findings
    return "\n".join(finding.metric for finding in findings if not finding.holds)


@pytest.fixture
def point_samples(monkeypatch):
    """No pre-integration, whatever is asked for."""

    def choose(settings: Settings, *_) -> Sampling:
        return Sampling(settings.samples_per_interval or 1, False)

    monkeypatch.setattr("persp_sw.compositor.choose_sampling", choose)


def change_tables(monkeypatch, change):
    """Every classification's extinctions go through `change`."""
    made = Classification.of.__func__

    def of(cls, transfer, volume):
        found = made(cls, transfer, volume)
        table = found.table.copy()
        table[:, 3] = change(table[:, 3])
        return replace(found, table=table)

    monkeypatch.setattr(Classification, "of", classmethod(of))


# --- What cases are made of -------------------------------------------------------------------------------


def test_the_homogeneous_picture_is_the_closed_form_of_a_slab():
    slab = Slab(size=(9, 12, 7), opacity=0.3)
    view = view_towards(slab.volume, (0.4, 0.3, 0.9), (24, 18))
    picture = homogeneous(slab.volume, slab.transfer, view)
    np.testing.assert_array_equal(picture, slab.image(view))
    image = composite(slab.volume, slab.transfer, view)
    exact = slab.image(face_view(image, 0))
    assert exact.max() > 0.5
    assert np.abs(image.face_pixels(0) - exact).max() < CLOSED_FORM


def test_concentric_errors_are_rings_and_others_are_none(rng):
    view = View.look_at((0, 0, 4.0), (0, 0, 0), (0, 1, 0), 26.0, (64, 64))
    t = view.directions()
    radius = np.hypot(t[..., 0], t[..., 1]) / np.abs(t[..., 2])
    amplitude = sharp_classification.ring_amplitude
    wave = np.cos(radius * 200)
    assert amplitude(wave, view, 0.6) == pytest.approx(np.sqrt(1 / 2), rel=0.15)
    assert amplitude(np.ones_like(wave), view, 0.6) < 1e-12
    assert amplitude(np.sign(t[..., 0]), view, 0.6) < 1e-12
    assert amplitude(rng.normal(size=wave.shape), view, 0.6) < 0.3


# --- Sharp classification ---------------------------------------------------------------------------------


def test_point_samples_have_neither_the_order_nor_the_accuracy_of_pieces(point_samples):
    for name, transfer in sharp_classification.functions().items():
        failed = failing(sharp_classification.order_findings(name, transfer, QUICK))
        assert "over that of point samples" in failed


def test_point_samples_show_rings(point_samples):
    assert "amplitude" in failing(sharp_classification.ring_findings(QUICK))


def test_point_samples_expose_hidden_colours(point_samples):
    failed = failing(colour_exposure.exposure_findings(QUICK))
    assert "across the slices" in failed
    assert "two pre-integrated samples" in failed


# --- Opacity ----------------------------------------------------------------------------------------------


def test_opacity_in_eight_bits_is_found_out(monkeypatch):
    def in_bytes(extinction):
        return -np.log1p(-np.minimum(np.rint(-np.expm1(-extinction) * 255) / 255, 1 - 1e-6))

    change_tables(monkeypatch, in_bytes)
    assert "1e-6 … 0.5 per unit" in failing(opacity_extremes.slab_findings(QUICK))
    assert "faint fog" in failing(opacity_extremes.fog_findings(QUICK))


def test_a_sheet_too_dense_is_found_out(monkeypatch):
    change_tables(monkeypatch, lambda extinction: 1.3 * extinction)
    failed = failing(thin_sheets.sheet_findings(QUICK))
    assert "faint sheets one voxel thin: error of the summed opacity" in failed


def test_a_coarse_table_is_found_out(monkeypatch):
    monkeypatch.setattr(tables, "_ENTRIES", 64)
    assert "as bytes and as floats" in failing(opacity_extremes.byte_findings(QUICK))


def test_rays_that_stop_too_early_are_found_out(monkeypatch):
    def eager(*arguments):
        before, after = arguments[:5], arguments[6:]
        return composite_face(*before, np.float32(0.1), *after)

    monkeypatch.setattr("persp_sw.compositor.composite_face", eager)
    assert "residual" in failing(opacity_extremes.termination_findings(QUICK))


# --- Clipping ---------------------------------------------------------------------------------------------


@pytest.fixture
def whole_slices(monkeypatch):
    """Every plane's offset is rounded: planes snap to slices."""

    def snapped(*arguments):
        found = []
        for part in shown_parts(*arguments):
            rows = part.half_spaces.copy()
            rows[:, 3] = np.rint(rows[:, 3])
            found.append(replace(part, half_spaces=rows))
        return found

    monkeypatch.setattr("persp_sw.planning.shown_parts", snapped)


def test_planes_that_snap_to_slices_are_found_out(whole_slices):
    assert failing([clipping.closed_form_finding("slivers", clipping.slivers(), QUICK)])
    assert failing([clipping.sliver_brightness(QUICK)])
    failed = failing(moving_plane.moving_findings(QUICK))
    assert "along slices, haze" in failed and "along slices, opaque" in failed


def test_what_shows_where_nothing_is_left_is_found_out(monkeypatch):
    monkeypatch.setattr("persp_sw.geometry.regions.Regions.planes", lambda *_: np.empty((0, 4)))
    assert failing([clipping.nothing_finding()])


# --- Far slices -------------------------------------------------------------------------------------------


def test_flicker_without_levels_of_detail_is_found_out(monkeypatch):
    from persp_sw.geometry.detail_zones import detail_zones

    monkeypatch.setattr(
        "persp_sw.compositor.detail_zones",
        lambda pitch, offset, back, _: detail_zones(pitch, offset, back, 1),
    )
    volume = far_slices.noise(40)
    failed = failing(far_slices.findings(volume, far_slices.path(volume, 3, 24), 3))
    assert "with levels of detail over that without" in failed


def test_supersampling_is_a_mean_of_finer_pixels():
    volume = far_slices.noise(6)
    (view,) = far_slices.path(volume, 1, 8)
    one, many = (far_slices.supersampled(volume, far_slices._HAZE, view, times) for times in (1, 4))
    assert one.shape == many.shape == (8, 8, 4)
    assert abs(one.mean() - many.mean()) < 0.1 * one.mean()


# --- Long runs --------------------------------------------------------------------------------------------


def walk(count=60):
    return long_runs.walk_findings(count, no_progress)


def test_frames_that_fail_are_counted(monkeypatch):
    composited = Renderer.composite
    calls = iter(range(10**6))

    def composite_most(*arguments):
        if next(calls) % 10 == 9:
            raise ValueError("every tenth")
        return composited(*arguments)

    monkeypatch.setattr(Renderer, "composite", composite_most)
    (found,) = [finding for finding in walk() if "failed" in finding.metric]
    assert not found.holds and found.value == 6


def test_numbers_that_no_picture_can_have_are_counted():
    good = np.full((2, 2, 4), 0.5, np.float32)
    assert long_runs.wrong_numbers(good) == 0
    for where, value in (((0, 0, 3), np.nan), ((0, 1, 0), np.inf), ((1, 0, 1), -0.1), ((1, 1, 2), 0.6)):
        bad = good.copy()
        bad[where] = value
        assert long_runs.wrong_numbers(bad) >= 1


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the system tells the peak only")
def test_what_the_process_holds_is_more_while_it_holds_more():
    before = resident_bytes()
    block = np.ones(2**23)  # 67 MB, of which a part may have been free before
    assert resident_bytes() - before > 0.5 * block.nbytes


def test_a_process_that_grows_is_found_out(monkeypatch):
    sizes = iter(range(10**8, 10**10, 10**6))
    monkeypatch.setattr(long_runs, "resident_bytes", lambda: next(sizes))
    assert "growth" in failing(walk())


def test_what_an_earlier_frame_leaves_behind_is_found_out(monkeypatch):
    made, kept = Classification.of.__func__, []

    def stale(cls, transfer, volume):
        kept.append(made(cls, transfer, volume))
        return kept[-2] if len(kept) > 1 else kept[0]

    monkeypatch.setattr(Classification, "of", classmethod(stale))
    assert "drawn again" in failing(walk())


@pytest.fixture
def laps(gl_context):
    """What two laps in OpenGL find; skipped where there is none."""
    return lambda: texture_run.texture_findings(15, 2, no_progress)


@pytest.mark.gl
def test_laps_in_opengl_hold(laps):
    assert failing(laps()) == ""


@pytest.mark.gl
@pytest.mark.parametrize(
    ("home", "method"), [(Texture, "delete"), (Framebuffer, "close")], ids=["textures", "framebuffers"]
)
def test_objects_that_are_never_deleted_are_found_out(laps, monkeypatch, home, method):
    monkeypatch.setattr(home, method, lambda _: None)
    failed = failing(laps())
    assert "objects more" in failed and "objects left" in failed


@pytest.mark.gl
def test_programs_that_are_made_anew_are_found_out(laps, monkeypatch):
    used = TextureWarp._use

    def use(warp, sources, options):
        warp._programs.clear()
        return used(warp, sources, options)

    monkeypatch.setattr(TextureWarp, "_use", use)
    failed = failing(laps())
    assert "objects more" in failed and "objects left" in failed


@pytest.mark.gl
def test_a_process_that_grows_in_opengl_is_found_out(laps, monkeypatch):
    sizes = iter(range(10**8, 10**10, 10**7))
    monkeypatch.setattr(texture_run, "resident_bytes", lambda: next(sizes))
    assert "growth" in failing(laps())


def test_without_opengl_laps_are_left_out_and_it_is_said(monkeypatch, caplog):
    def absent():
        raise GraphicsError("none here")

    monkeypatch.setattr(texture_run, "OffscreenContext", absent)
    assert texture_run.texture_findings(5, 2, no_progress) == []
    assert "no long run of the texture warp: none here" in caplog.text
