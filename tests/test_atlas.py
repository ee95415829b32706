"""The stability atlas: its frame, that every case holds at small sizes, and that each can fail."""

from __future__ import annotations

import dataclasses
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageDraw
from samples import fails, run
from tolerances import FLOAT32_PICTURE, PLAIN_ORDER

from persp_sw import Regions, Renderer, TransferFunction, View, Volume, compositor, planning
from persp_sw.geometry.faces import Face
from persp_sw.geometry.view import Eye
from persp_sw.measure.atlas import catalogue, eye_positions, plain, shapes, values
from persp_sw.measure.atlas.case import Case, Finding, Scale, Strip, in_parts
from persp_sw.measure.atlas.outcome import outcome_of
from persp_sw.measure.atlas.page import number_text, with_unit, write_page, write_pictures
from persp_sw.measure.atlas.strips import strip_rgb
from persp_sw.measure.exact import Ramp, Slab
from persp_sw.optics import classification, transfer
from persp_sw.optics.classification import Classification
from persp_sw.volume import grid
from persp_sw.volume.phantoms import linear
from persp_sw.warp import software

QUICK = Scale(quick=True)
ABOUT = {"quick": True, "machine": {"processor": "one", "cores": 1, "versions": {"persp_sw": "0"}}}


def quiet(done: int, total: int, what: str) -> None:
    """Progress that nobody watches."""


def by_metric(findings: list[Finding]) -> dict[str, Finding]:
    assert len({finding.metric for finding in findings}) == len(findings)
    return {finding.metric: finding for finding in findings}


# --- Every case -------------------------------------------------------------------------------------------


_STABILITY = (Path(__file__).parents[1] / "docs/stability.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("case", catalogue.CASES, ids=lambda case: case.name)
def test_every_finding_holds_at_small_sizes(case: Case):
    findings = case.run(QUICK, quiet)
    assert findings
    by_metric(findings)
    assert any(finding.single_axis is not None for finding in findings) == (case.name != "long-runs")
    assert [(f.metric, f.value, f.bound, f.derived) for f in findings if not f.holds] == []
    if case.name != "long-runs":  # which says how long
        told = {finding.metric for finding in findings if with_unit(finding) in _STABILITY}
        assert told == {finding.metric for finding in findings}


def test_the_catalogue_can_be_named_and_read():
    names = [case.name for case in catalogue.CASES]
    assert len(set(names)) == len(names)
    for case in catalogue.CASES:
        assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", case.name)
        assert case.title and case.what.endswith(".") and len(case.what) > 80


def test_parts_follow_one_another_and_progress_hears_of_each():
    heard = []

    def part(name: str, count: int):
        def measured(scale: Scale) -> list[Finding]:
            heard.append((name, scale))
            return [Finding(f"{name} {n}", n, 9.0, "nine") for n in range(count)]

        return measured

    parts = {"one": part("one", 2), "none": part("none", 0), "two": part("two", 1)}
    found = in_parts(parts, QUICK, lambda *said: heard.append(said))
    assert [finding.metric for finding in found] == ["one 0", "one 1", "two 0"]
    said = [(0, 3, "one"), (1, 3, "none"), (2, 3, "two"), (3, 3, "done")]
    assert heard == [said[0], ("one", QUICK), said[1], ("none", QUICK), said[2], ("two", QUICK), said[3]]


# --- Findings ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "bound", "at_least", "holds"),
    [
        (1.0, 1.0, False, True),
        (1.1, 1.0, False, False),
        (1.0, 1.0, True, True),
        (0.9, 1.0, True, False),
        (math.nan, 1.0, False, False),
        (math.nan, 1.0, True, False),
        (math.inf, 1.0, False, False),
        (math.inf, 1.0, True, True),
    ],
)
def test_a_finding_holds_on_the_good_side_of_its_bound_only(value, bound, at_least, holds):
    assert Finding("m", value, bound, "given", at_least=at_least).holds is holds


def test_an_exception_ends_its_case_and_is_told():
    def breaks(scale, progress):
        raise ValueError("out of\nluck")

    outcome = outcome_of(Case("broken", "Broken", "It breaks.", breaks), QUICK, quiet)
    assert outcome.fault == "ValueError: out of luck"
    assert not outcome.holds


# --- The plain ray caster ---------------------------------------------------------------------------------


@pytest.mark.parametrize("samples", [1, 7, None])
def test_the_plain_ray_caster_is_exact_where_nothing_varies(samples):
    slab = Slab((9, 6, 12))
    view = View.look_at((20, 15, -14), slab.volume.centre, (0, 1, 0), 40, (24, 20))
    regions = Regions(clip=[(1, 0.3, -0.2, -2)])
    picture = plain.cast(slab.volume, slab.transfer, view, regions, samples=samples)
    assert picture.dtype == np.float32 and picture.shape == (20, 24, 4)
    assert picture.any()
    assert np.abs(picture - slab.image(view, regions)).max() < FLOAT32_PICTURE


def test_the_plain_ray_caster_is_of_second_order():
    ramp = Ramp(opacities=(0.05, 0.05))
    view = View.look_at((30, 25, -30), ramp.volume.centre, (0, 1, 0), 35, (24, 20))
    counts = np.array([4, 8, 16, 32, 64])
    truth = ramp.image(view)
    errors = [np.abs(plain.cast(ramp.volume, ramp.transfer, view, samples=n) - truth).mean() for n in counts]
    slope = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert abs(slope - 2) < PLAIN_ORDER


def test_the_plain_ray_caster_takes_a_sample_for_each_interval_of_its_main_axis(monkeypatch):
    volume = linear((11, 9, 7), 0, (1, 1, 1))
    transfer_function = TransferFunction([(0, (1, 1, 1), 0.1)], 1.0)
    view = View.parallel((5, 4, -20), (5, 4, 3), (0, 1, 0), 4, (3, 3))
    taken = []
    looked_up = plain.interpolated
    monkeypatch.setattr(
        plain, "interpolated", lambda volume, places: taken.append(len(places)) or looked_up(volume, places)
    )
    plain.cast(volume, transfer_function, view)
    assert sum(taken) == 9 * 6
    taken.clear()
    plain.cast(volume, transfer_function, view, per_interval=2)
    assert sum(taken) == 9 * 12


def test_cells_with_a_voxel_without_value_are_unknown_and_transparent():
    data = np.full((5, 5, 5), 3.0, np.float32)
    data[2, 2, 2] = np.nan
    volume = Volume(data)
    places = np.array([(1.5, 2.5, 1.1), (2, 2, 1), (0.5, 0.5, 0.5), (3.5, 1, 1), (4, 4, 4)])
    np.testing.assert_array_equal(plain.interpolated(volume, places), [np.nan, np.nan, 3, 3, 3])
    view = View.parallel((2, 2, -9), (2, 2, 2), (0, 1, 0), 4, (16, 16))
    alpha = plain.cast(volume, TransferFunction([(3, (1, 1, 1), 0.5)], 1.0), view)[..., 3]
    assert np.abs(alpha[8, 8] - (1 - 0.5**2)) < FLOAT32_PICTURE  # two of four cells are left
    assert np.abs(alpha[1, 1] - (1 - 0.5**4)) < FLOAT32_PICTURE


def test_interpolation_reproduces_a_linear_field(rng):
    volume = linear((5, 7, 9), 2.0, (1.0, -0.5, 0.25))
    places = rng.random((200, 3)) * (4, 6, 8)
    np.testing.assert_allclose(plain.interpolated(volume, places), 2 + places @ (1, -0.5, 0.25), atol=1e-12)


# --- Pictures and pages -----------------------------------------------------------------------------------


def picture(*rgba: float, size: tuple[int, int] = (10, 12)) -> np.ndarray:
    return np.full((*size, 4), rgba, np.float32)


def test_a_strip_shows_ours_the_reference_and_the_difference():
    ours, truth = picture(1, 0, 0, 1), picture(0, 0, 1, 1)
    ours[:, :6] = truth[:, :6]
    rgb = strip_rgb(Strip("red and blue", ours, truth, gain=1))
    width = 12 * 20  # ten rows are shown 20 times as high
    assert rgb.shape[1] == 4 * 8 + 3 * width
    middle = rgb[22 + 100]
    panels = [middle[8 + n * (8 + width) :][:width].astype(int) for n in range(3)]
    assert (panels[0][: width // 2] == (0, 0, 255)).all() and (panels[0][width // 2 :] == (255, 0, 0)).all()
    assert (panels[1] == (0, 0, 255)).all()
    assert panels[2][: width // 2].max() <= 4 and panels[2][width // 2 :].min() > 100
    assert strip_rgb(Strip("alone", ours)).shape[1] == 2 * 8 + width


def test_the_font_has_all_letters_of_the_captions(monkeypatch: pytest.MonkeyPatch):
    captions, draw = {}, ImageDraw.ImageDraw.text

    def text(self, place, caption, *rest, **more):
        captions[caption] = more.get("font") or self.getfont()
        return draw(self, place, caption, *rest, **more)

    monkeypatch.setattr(ImageDraw.ImageDraw, "text", text)
    strip_rgb(Strip("", picture(1, 0, 0, 1), picture(0, 1, 0, 1), gain=1e4))
    assert {"ours", "reference", "difference times 10000"} <= set(captions)
    for caption, font in captions.items():
        no_glyph = bytes(font.getmask("\uffff"))
        assert all(bytes(font.getmask(letter)) != no_glyph for letter in caption)


def test_a_given_difference_is_shown_in_place_of_the_computed_one():
    ours = picture(0.5, 0.5, 0.5, 1)
    shown = [strip_rgb(Strip("", ours, ours, error)) for error in (None, picture(0, 0, 0, 1))]
    assert shown[0].shape == shown[1].shape
    assert shown[1][100, -100].sum() > shown[0][100, -100].sum() + 300


def test_the_shear_warp_of_2001_is_shown_beside_with_its_own_difference():
    ours, truth = picture(1, 0, 0, 1), picture(0, 0, 1, 1)
    rgb = strip_rgb(Strip("three", ours, truth, gain=1, single_axis=picture(0, 1, 0, 1)))
    width = 12 * 20
    assert rgb.shape[1] == 6 * 8 + 5 * width
    panels = [rgb[22 + 100, 8 + n * (8 + width) :][:width].astype(int) for n in range(5)]
    assert (panels[3] == (0, 255, 0)).all()
    assert panels[4].min() > 100  # it differs everywhere
    alike = strip_rgb(Strip("equal", ours, truth, gain=1, single_axis=truth))
    assert alike[22 + 100, 8 + 4 * (8 + width) :][:width].max() <= 4


def test_what_is_no_number_is_magenta():
    ours = picture(0.5, 0.5, 0.5, 1)
    ours[3, 4] = math.nan
    rgb = strip_rgb(Strip("a hole", ours, picture(0.5, 0.5, 0.5, 1)))
    assert (rgb[22 + 3 * 20 + 10, 8 + 4 * 20 + 10] == (255, 0, 255)).all()


STRIP = Strip("a strip of <both> | one", picture(1, 0, 0, 1), picture(0, 1, 0, 1))


def some_findings(scale, progress):
    progress(0, 1, "some")
    return [
        Finding("first <metric> | a", 0.25, 0.5, "1.5 × a plain ray caster", ray_caster=0.3, strips=[STRIP]),
        Finding("second", 30.0, 38.0, "a goal", "dB", at_least=True, strips=[STRIP], single_axis=21.54),
        Finding("third", math.nan, 1.0, "one", single_axis=math.nan),
        Finding("pixels lost", 3, 4, "four", "pixels"),
    ]


SOME = Case("some-case", "Some <case>", "What it is & why.", some_findings)


def interrupted(scale, progress):
    raise KeyboardInterrupt


def all_well(scale, progress):
    return [Finding("m", float(scale.pick(1, 2)), 3.0, "three")]


WELL = Case("well", "All well", "It is well.", all_well)
BROKEN = Case("broken", "Broken", "It breaks.", lambda scale, progress: [][0])
INTERRUPTED = Case("interrupted", "Interrupted", "Ctrl-C.", interrupted)


def test_the_page_tells_all_and_escapes_it(tmp_path: Path):
    outcomes = [outcome_of(case, QUICK, quiet) for case in (SOME, BROKEN)]
    pictures = write_pictures(outcomes[0], tmp_path) | write_pictures(outcomes[1], tmp_path)
    assert pictures == {STRIP: "some-case-1.png"}  # of two findings, written once
    page, markdown, report = (path.read_text() for path in write_page(outcomes, pictures, ABOUT, tmp_path))
    with Image.open(tmp_path / "some-case-1.png") as shown:
        assert shown.mode == "RGB"

    assert "| case | metric | value | bound | ray caster | 2001 | verdict |" in markdown
    assert "| some-case | first <metric> \\| a | 0.25 | ≤ 0.5 | 0.3 |  | holds |" in markdown
    assert "| some-case | second (dB) | 30 | ≥ 38 |  | 21.5 | **fails** |" in markdown
    assert "| some-case | pixels lost | 3 | ≤ 4 |  |  | holds |" in markdown  # names its unit
    assert "| some-case | third | nan | ≤ 1 |  | n/a | **fails** |" in markdown
    assert "| broken | broke off: IndexError: list index out of range |" in markdown
    assert "2 of 4 findings of 2 cases hold. 1 broke off." in markdown
    assert markdown.count("(some-case-1.png)") == 1
    assert markdown.count("1.5 × a plain ray caster") == 1

    assert "first &lt;metric&gt; | a" in page and "<metric>" not in page and "<both>" not in page
    assert page.count('src="some-case-1.png"') == 1
    assert page.count("<th>2001</th>") == 2  # in the overview and in the case
    assert page.count('<td class="number">21.5</td>') == 2
    assert 'class="fails"' in page and "Some &lt;case&gt;" in page

    entries = json.loads(report)["cases"]
    assert [entry["holds"] for entry in entries] == [True, False, False, True, False]
    assert entries[0]["ours"] == 0.25 and entries[0]["pictures"] == ["some-case-1.png"]
    assert entries[2]["ours"] is None
    assert [entry["single_axis"] for entry in entries] == [None, 21.54, None, None, None]
    assert "IndexError" in entries[4]["fault"]


@pytest.mark.parametrize(
    ("value", "text"),
    [(0, "0"), (41.236, "41.2"), (1.5e-7, "1.5e-07"), (20000, "20000"), (2048.4, "2048"), (1e9, "1e+09")],
)
def test_numbers_have_three_digits(value, text):
    assert number_text(value) == text


# --- The command ------------------------------------------------------------------------------------------


@pytest.fixture
def small_atlas(monkeypatch, tmp_path: Path) -> Path:
    """An atlas of three cases that take no time; the folder to write to."""
    monkeypatch.setattr(catalogue, "CASES", (SOME, WELL, BROKEN))
    return tmp_path / "atlas"


def test_the_command_writes_pictures_pages_and_json(small_atlas: Path):
    result = run("atlas", "--case", "well", "--case", "some-case", "-o", small_atlas)
    assert result.exit_code == 0  # findings that fall short are no fault of the program
    for word in ("some-case", "second", "≥ 38", "2001", "21.5", "fails", "atlas.html"):
        assert word in result.stdout
    names = {path.name for path in small_atlas.iterdir()}
    assert names == {"atlas.html", "atlas.md", "atlas.json", "some-case-1.png"}


def test_json_keeps_the_contract(small_atlas: Path):
    result = run("atlas", "--case", "some-case", "--case", "well", "--quick", "--json", "-o", small_atlas)
    assert result.exit_code == 0 and result.stderr == ""
    report = json.loads(result.stdout)
    assert report["quick"] is True and report["holds"] is False
    assert len(report["cases"]) == 5
    for entry in report["cases"]:
        assert {"name", "metric", "bound", "ours", "holds"} <= set(entry)
    assert report["cases"][4]["ours"] == 1  # of the quick scale
    written = json.loads((small_atlas / "atlas.json").read_text())
    assert written["cases"] == report["cases"]


def test_strict_tells_by_its_exit_code(small_atlas: Path):
    assert run("atlas", "--strict", "--case", "well", "-o", small_atlas).exit_code == 0
    assert run("atlas", "--strict", "--case", "some-case", "-o", small_atlas).exit_code == 1


def test_a_case_that_breaks_off_leaves_the_others(small_atlas: Path):
    result = run("atlas", "-o", small_atlas)
    assert result.exit_code == 1
    assert "Traceback" not in result.output
    assert "IndexError" in result.stdout
    assert "All well" in (small_atlas / "atlas.md").read_text()


def test_an_interrupted_atlas_leaves_what_it_had_found(small_atlas: Path, monkeypatch):
    monkeypatch.setattr(catalogue, "CASES", (WELL, INTERRUPTED, SOME))
    result = run("atlas", "-o", small_atlas)
    assert result.exit_code == 130
    assert "interrupted" in result.stderr and "Traceback" not in result.output
    text = (small_atlas / "atlas.md").read_text()
    assert "All well" in text and "Some" not in text


def test_an_unknown_case_is_told_with_the_nearest(small_atlas: Path):
    assert "did you mean some-case?" in fails("atlas", "--case", "somecase", "-o", small_atlas)
    assert "some-case, well, broken" in fails("atlas", "--case", "xyz", "-o", small_atlas)
    assert not small_atlas.exists()


def test_a_folder_that_cannot_be_is_told(small_atlas: Path):
    small_atlas.write_text("a file")
    assert "-o" in fails("atlas", "-o", small_atlas)


def test_cases_are_listed():
    result = run("atlas", "--list")
    assert result.exit_code == 0
    for case in catalogue.CASES:
        assert re.search(rf"^{case.name} +{re.escape(case.title)}$", result.stdout, re.MULTILINE)


# --- Each case can fail -----------------------------------------------------------------------------------


@pytest.fixture
def few(monkeypatch):
    """Cases with fewer places and scenes, for what shows at one of them."""
    places, scenes = eye_positions.places, values.scenes
    monkeypatch.setattr(eye_positions, "places", lambda n: places(n)[0:3:2])
    monkeypatch.setattr(values, "scenes", lambda n: scenes(n)[0:4:3])


def failing(case: Case) -> set[str]:
    """Metrics of a case that fail as the code is now."""
    return {finding.metric for finding in case.run(QUICK, quiet) if not finding.holds}


JUMP = "jump in a step of 1e-6 voxel beyond the reference's, rays to their end"


def test_slices_snapped_to_the_eye_make_pictures_jump(few, monkeypatch):
    exact = Face.rays

    def snapped(face, eye):
        return exact(face, np.array([eye[0], eye[1], np.floor(eye[2])]))

    monkeypatch.setattr(Face, "rays", snapped)
    assert {JUMP, "the same where rays stop early, as by default"} <= failing(eye_positions.CASE)


def test_an_eye_in_the_box_that_sees_nothing_is_found(few, monkeypatch):
    needs = planning.needs_of
    monkeypatch.setattr(
        planning, "needs_of", lambda geometry, *rest: [] if geometry.inside else needs(geometry, *rest)
    )
    assert {
        "frames with less than half of the reference's mean alpha",
        "lowest PSNR of the faces at a place",
    } <= failing(eye_positions.CASE)


def test_a_picture_with_holes_is_found(few, monkeypatch):
    class WithHoles(Renderer):
        def render(self, view, out=None):
            image = super().render(view, out)
            if (view.eye.position == np.rint(view.eye.position)).all():
                image[3, 3] = np.nan
            return image

    monkeypatch.setattr(eye_positions, "Renderer", WithHoles)
    assert "numbers that are NaN or infinite" in failing(eye_positions.CASE)


def test_slices_of_another_thickness_are_found(monkeypatch):
    rays = compositor.Rays
    monkeypatch.setattr(compositor, "Rays", lambda geometry, metric, *rest: rays(geometry, np.eye(3), *rest))
    assert {
        "homogeneous box: largest error of a face's pixel over its bound",
        "waves: RMS error of faces over a plain ray caster's, worst view of all shapes",
    } <= failing(shapes.CASE)


def test_a_volume_that_comes_out_mirrored_is_found(monkeypatch):
    exact = software._tangents

    def right_handed(face, object_from_world, *rest):
        matrix = exact(face, object_from_world, *rest)
        return np.diag((np.sign(np.linalg.det(object_from_world)), 1, 1)) @ matrix

    monkeypatch.setattr(software, "_tangents", right_handed)
    assert "the same body stored mirrored or along other axes: largest change" in failing(shapes.CASE)


def test_places_in_float32_are_found(monkeypatch):
    checked = Eye.__post_init__

    def rounded(eye):
        checked(eye)
        object.__setattr__(eye, "position", eye.position.astype(np.float32).astype(np.float64))

    monkeypatch.setattr(Eye, "__post_init__", rounded)
    assert "1e6 metres from the origin, voxels of 1 mm: largest change" in failing(shapes.CASE)


def test_a_silent_flat_volume_that_shows_is_found(monkeypatch):
    class Silent(Renderer):
        def __init__(self, volume, *rest):
            super().__init__(Volume(np.repeat(volume.data, 2, 0)), *rest)

    monkeypatch.setattr(shapes, "Renderer", Silent)
    largest, silent = shapes.flat_volumes()
    assert largest > 0 and silent > 0


def test_negative_values_that_are_cut_off_are_found(few, monkeypatch):
    told_apart = classification._told_apart
    monkeypatch.setattr(
        classification, "_told_apart", lambda *given: tuple(np.maximum(told_apart(*given), 0.0))
    )
    assert "RMS error of faces over a plain ray caster's, worst of all values and functions" in failing(
        values.CASE
    )


def test_voxels_without_value_that_nobody_counts_are_found(monkeypatch):
    monkeypatch.setattr(grid, "_checked_voxels", lambda data: (np.nan_to_num(data), 0))
    assert values.miscounted(values.with_gaps(values.field(24))) > 10


@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
def test_a_value_that_is_none_and_shows_is_found(few, monkeypatch):
    exact = Classification.of

    def shown(function, volume):
        right = exact(function, volume)
        table = right.table.copy()
        table[0] = np.nan
        return dataclasses.replace(right, table=table)

    monkeypatch.setattr(Classification, "of", shown)
    assert "numbers that are NaN or infinite" in failing(values.CASE)


def test_one_value_with_another_opacity_is_found(few, monkeypatch):
    exact = Classification.of

    def denser(function, volume):
        right = exact(function, volume)
        return dataclasses.replace(right, table=right.table * np.float32(1.0001))

    monkeypatch.setattr(Classification, "of", denser)
    assert "volumes of one value: largest error of a face's pixel over its bound" in failing(values.CASE)


def test_denormals_that_are_no_numbers_are_found(monkeypatch):
    checked = grid._checked_voxels

    def without_denormals(data):
        return checked(np.where((data != 0) & (np.abs(data) < 1e-37), np.nan, data))

    monkeypatch.setattr(grid, "_checked_voxels", without_denormals)
    assert values.change_by_denormals(24, 32) > 0


def test_functions_that_nobody_checks_are_found(monkeypatch):
    monkeypatch.setattr(transfer, "_check_points", lambda rows: None)
    taken = " ".join(values.taken_without_a_word())
    for name in ("unsorted points", "three points", "above 1", "NaN", "infinite"):
        assert name in taken
