"""`persp-sw bench`, `chart` and `warmup` from outside."""

from __future__ import annotations

import importlib
import json
import multiprocessing
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from samples import ROOT, fails, result_of, run

import persp_sw as psw
from persp_sw import reference
from persp_sw.errors import GraphicsError, MissingPackageError, ViewError
from persp_sw.measure import bench, peers
from persp_sw.measure.chart import Chart, ladder_of
from persp_sw.measure.metrics import compare
from persp_sw.measure.textures import texture_rows

BRIEF = ("--seconds", 0.01, "--threads", 1)


@pytest.fixture(autouse=True)
def references_elsewhere(tmp_path: Path, monkeypatch):
    """The user's cache is left alone."""
    monkeypatch.setattr("persp_sw.measure.truth.default_cache", lambda: tmp_path / "references")


# --- bench -------------------------------------------------------------------------------------------------


def test_a_row_tells_time_work_memory_and_error(scene_file: Path):
    (row,) = result_of("bench", scene_file, *BRIEF)["rows"]
    scene = psw.Scene.load(scene_file)
    view = scene.views()[-1]
    renderer = psw.Renderer(scene.volume, scene.transfer, psw.Settings(threads=1))
    expected = compare(renderer.render(view), reference.render(scene.volume, scene.transfer, view))
    assert row["psnr"] == pytest.approx(expected["psnr"], abs=1e-3)
    assert row["mean_signed_error"] == pytest.approx(expected["mean_signed_error"], abs=1e-7)
    assert row["ssim"] == pytest.approx(expected["ssim"], abs=1e-5)
    assert row["samples"] == renderer.last["samples"]
    assert row["runs_bytes"] == renderer.last["runs_bytes"]
    assert row["waste"] == pytest.approx(row["samples"] / row["needed_samples"], rel=1e-3)
    assert row["samples_per_second"] == pytest.approx(1e3 * row["samples"] / row["composite_ms"])
    assert row["ms_min"] <= row["ms"] <= row["ms_p95"] <= row["ms_p99"]
    assert row["frames"] >= 5
    assert row["encode_ms"] > 0
    assert row["peak_bytes"] > 50e6  # the interpreter with numba, at least
    assert {"compile_ms", "warp_ms_p95", "psnr_covered", "dense_bytes", "faces"} <= set(row)


def test_fixed_cases_settings_and_table(tmp_path: Path):
    out = tmp_path / "new" / "result.json"
    choice = ("--volume", "ct16", "--function", "ramp", "--view", "front", "--size", 32, "--size", 48)
    result = run("bench", *choice, *BRIEF, "--quality", 1, "--quality", 3, "-o", out)
    assert result.exit_code == 0, result.output
    for words in ("ct16-ramp-front-32", "q 3", "PSNR", "waste", "peak MB"):
        assert words in result.stdout
    values = json.loads(out.read_text())
    rows = values["rows"]
    assert [(row["size"][0], row["quality"]) for row in rows] == [(32, 1), (32, 3), (48, 1), (48, 3)]
    assert rows[1]["psnr"] > rows[0]["psnr"]
    assert rows[3]["psnr"] > rows[2]["psnr"]
    assert values["machine"]["cores"] >= 1
    assert values["machine"]["versions"]["persp_sw"] == psw.__version__


def test_what_cannot_be_rendered_is_a_row(scene_file: Path, monkeypatch):
    whole = psw.Renderer.composite

    def composite(self, eye, walls):
        if walls[0].pixels[0] == 48:
            raise ViewError("not from here")
        return whole(self, eye, walls)

    monkeypatch.setattr(psw.Renderer, "composite", composite)
    refused, drawn = result_of("bench", scene_file, *BRIEF, "--size", 48, "--size", 40)["rows"]
    assert refused["error"] == "not from here"
    assert "error" not in drawn
    result = run("bench", scene_file, *BRIEF, "--size", 48)
    assert result.exit_code == 0
    assert "not from here" in result.stderr


def test_ctrl_c_keeps_what_is_done(scene_file: Path, tmp_path: Path, monkeypatch):
    whole, calls = bench.measure, []

    def measure(case, plan):
        calls.append(case)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return whole(case, plan)

    monkeypatch.setattr(bench, "measure", measure)
    out = tmp_path / "result.json"
    result = run("bench", scene_file, *BRIEF, "--size", 24, "--size", 32, "--size", 40, "-o", out, "--json")
    assert result.exit_code == 130
    assert "interrupted" in result.stderr
    for values in (json.loads(result.stdout), json.loads(out.read_text())):
        assert values["interrupted"]
        assert [row["size"] for row in values["rows"]] == [[24, 24]]


def test_ablations_are_told_against_the_default(scene_file: Path):
    rows = result_of("bench", scene_file, *BRIEF, "--ablate")["rows"]
    assert rows[0]["switch"] == "default"
    assert (rows[0]["time_ratio"], rows[0]["sample_ratio"], rows[0]["psnr_change"]) == (1, 1, 0)
    by_name = {row["switch"]: row for row in rows}
    assert by_name["no skipping"]["psnr_change"] == 0  # skipping changes no bit
    assert by_name["no skipping"]["sample_ratio"] > 1
    assert by_name["4 samples an interval"]["sample_ratio"] > by_name["2 samples an interval"]["sample_ratio"]
    table = run("bench", scene_file, *BRIEF, "--ablate").stdout
    assert "no termination" in table
    assert "change dB" in table


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--volume", "nowhere"), "there is no volume 'nowhere'"),
        (("--volume", "ct16", "--match", "["), "no regular expression"),
        (("--volume", "ct16", "--match", "xyz"), "no case matches 'xyz'; there are ct16-fog-front-512"),
        (("--data", "/nowhere"), "no data folder"),
        (("--volume", "ct16", "--threads", 1000), "threads lies between 1 and"),
        (("--volume", "ct16", "--quality", 100), "quality lies between"),
        (("--volume", "ct16", "--seconds", 0), "--seconds lies between"),
        (("--ablate", "--peer", "vtk"), "leave --peer out"),
        (("nowhere.json",), "nowhere.json"),
        (("scene.json", "--volume", "ct16"), "leave them out with SCENE"),
        (("--volume", "ct16", "-o", "/proc/nowhere/x.json"), "cannot write"),
        (("--volume", "ct16", "--cache", "/proc/nowhere"), "--cache"),
    ],
)
def test_mistakes_are_told(arguments: tuple, words: str):
    assert words in fails("bench", *arguments)


# --- peers -------------------------------------------------------------------------------------------------


class Copycat:
    """A peer that shows what we show at quality 2, and takes its time."""

    name = "copycat"

    def __init__(self, threads: int):
        self.threads = threads

    def open(self, stage):
        self.renderer = psw.Renderer(stage.volume, stage.transfer, psw.Settings(quality=2.0, threads=1))

    def prepare(self, view):
        pass

    def draw(self, view):
        return {"ms": 1000.0}

    def picture(self, view):
        return self.renderer.render(view)

    def close(self):
        self.renderer = None


def test_time_at_equal_accuracy(scene_file: Path, monkeypatch):
    monkeypatch.setattr(peers, "peers_named", lambda names, threads: [Copycat(n) for n in threads])
    values = result_of("bench", scene_file, *BRIEF, "--peer", "vtk")
    plain, peer, equal = values["rows"]
    assert (plain["quality"], peer["renderer"], equal["equal_to"]) == (1, "copycat", "copycat")
    assert peer["ms"] == 1000
    assert equal["psnr"] >= peer["psnr"] > plain["psnr"]
    (row,) = values["equal_accuracy"]
    assert row["reached"]
    assert row["ratio"] == pytest.approx(1000 / equal["ms"])
    assert row["plain_ratio"] == pytest.approx(1000 / plain["ms"])
    table = run("bench", scene_file, *BRIEF, "--peer", "vtk").stdout
    assert "at equal accuracy" in table
    assert "= copycat" in table


def test_a_peer_that_fails_or_dies_leaves_a_row(scene_file: Path, monkeypatch):
    monkeypatch.setitem(peers.KINDS, "vtk-fixed", {"mapper": "fixed", "nonsense": 1})
    ours, failed = result_of("bench", scene_file, *BRIEF, "--peer", "vtk-fixed")["rows"]
    assert ours["psnr"] > 20
    assert "nonsense" in failed["error"] or "vtk" in failed["error"]
    assert multiprocessing.active_children() == []


def test_a_peer_without_its_package_is_told(monkeypatch):
    monkeypatch.setattr(peers.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(MissingPackageError, match="bench"):
        peers.peers_named(["vtk"], [1])


@pytest.mark.gl
def test_vtk_shows_the_same_scene(scene_file: Path):
    pytest.importorskip("vtkmodules")
    rows = result_of("bench", scene_file, *BRIEF, "--peer", "vtk")["rows"]
    found = {row["renderer"]: row for row in rows}
    if "error" in found["vtk-gpu"]:
        pytest.skip(found["vtk-gpu"]["error"])
    # 8 bits a channel are 59 dB; what VTK's mappers really reach, `vtk_scene` tells.
    assert 45 < found["vtk-gpu"]["psnr"] < 70
    assert 30 < found["vtk-fixed"]["psnr"] < 60
    assert found["vtk-fixed"]["ms"] > 0


def test_both_mappers_make_a_group():
    pytest.importorskip("vtkmodules")
    named = peers.peers_named(["vtk", "vtk-gpu"], [1, 2])
    assert [(p.name, p.threads) for p in named] == [
        ("vtk-fixed", 1),
        ("vtk-fixed", 2),
        ("vtk-gpu", 1),
        ("vtk-gpu", 2),
    ]


# --- chart -------------------------------------------------------------------------------------------------


CHART = ("--threads", 1, "--seconds", 0.01)


@pytest.fixture
def ladders(tmp_path: Path, monkeypatch) -> Path:
    """The folder of ladders, not the user's."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    return tmp_path / "data" / "persp_sw" / "ladders"


@pytest.mark.parametrize("name", ["chart", "chart.png", "new/chart.svg", "chart.pdf"])
def test_the_chart_shows_all_points(scene_file: Path, tmp_path: Path, ladders: Path, monkeypatch, name: str):
    pytest.importorskip("matplotlib")
    monkeypatch.setattr(peers, "peers_named", lambda names, threads: [Copycat(n) for n in threads])
    out = tmp_path / name
    choice = ("--quality", 2, "--quality", 1, *CHART, "--peer", "vtk")
    values = result_of("chart", scene_file, *choice, "-o", out)
    ours = [row for row in values["rows"] if "mode" in row]
    assert {row["mode"] for row in ours} >= {"1 sample", "2 samples", "4 samples", "pre-integrated"}
    assert {row["quality"] for row in ours} == {1, 2}
    assert all(row["ms"] > 0 and 0 < row["ssim"] <= 1 and row["psnr"] > 20 for row in ours)
    best = [row for row in ours if row["on_front"]]
    for row in ours:
        beaten = [b for b in best if b["ms"] <= row["ms"] and b["psnr"] >= row["psnr"]]
        assert beaten == [row] if row["on_front"] else beaten
    (equal,) = values["equal_accuracy"]
    assert equal["ratio"] > 1
    with Image.open(out.with_suffix(".png")) as picture:
        assert len(np.unique(np.asarray(picture.convert("RGB")).reshape(-1, 3), axis=0)) > 50
    text = out.with_suffix(".svg").read_text()
    for words in ("scene", "copycat", "4 samples", "front", "PSNR, dB", "SSIM", "ms a frame, 1 thread"):
        assert words in text
    assert json.loads(out.with_suffix(".json").read_text()) == values
    assert out.with_suffix(".pdf").exists() == (name == "chart.pdf")
    suffixes = (".png", ".svg", *([".pdf"] if name == "chart.pdf" else []), ".json")
    assert values["files"] == [str(out.with_suffix(suffix)) for suffix in suffixes]
    # From quality 1 on it would be a ladder without its lower end.
    assert not ladders.exists()
    assert "0.5 to 2" in values["ladders"][0]["why_not"]


def test_the_chart_keeps_the_ladder_that_a_session_finds(scene_file: Path, tmp_path: Path, ladders: Path):
    pytest.importorskip("matplotlib")
    qualities = ("--quality", 0.25, "--quality", 0.5, "--quality", 1, "--quality", 2)
    values = result_of("chart", scene_file, *qualities, *CHART, "-o", tmp_path / "chart")
    (kept,) = values["ladders"]
    scene = psw.Scene.load(scene_file)
    renderer = psw.Renderer(scene.volume, scene.transfer, psw.Settings(threads=1))
    found = psw.ladder_for(renderer)
    assert list(ladders.iterdir()) == [Path(kept["file"])]
    assert [rung.name for rung in found.rungs] == [rung["name"] for rung in kept["rungs"]]
    ours = {(row["mode"], row["quality"]): row for row in values["rows"] if "mode" in row}
    for rung in found.rungs:
        assert rung.changes == next(row["changes"] for (mode, _), row in ours.items() if mode == rung.name)
        for point in rung.points[1:-1]:  # ends may lie between measured points
            row = ours[rung.name, point.quality]
            assert (point.cost, point.psnr) == pytest.approx((row["composite_ms"], row["psnr"]))
    controller = psw.FrameTimeController(20.0, found)
    view = scene.views()[0]
    choice = controller.next(renderer.features([view.eye], [view.wall]))
    settings = choice.apply(psw.Settings(threads=1, samples_per_interval=4))
    assert settings.samples_per_interval == dict(found.rungs[0].changes)["samples_per_interval"]
    assert settings.threads == 1


def test_the_charts_table(scene_file: Path, tmp_path: Path, ladders: Path):
    pytest.importorskip("matplotlib")
    result = run("chart", scene_file, "--quality", 0.5, "--quality", 2, *CHART, "-o", tmp_path / "a.png")
    assert result.exit_code == 0, result.output
    assert "q 0.5, 2 samples" in result.stdout
    for words in ("a.png", "a.svg", "a.json", "the ladder for steady frames", str(ladders)):
        assert words in result.stdout.replace("\n", "")
    alone = run("chart", scene_file, "--quality", 1, *CHART, "-o", tmp_path / "a.png")
    assert "no ladder was kept" in alone.stdout


def _row(mode, quality, ms, psnr, **changes):
    changes = changes or {"residual": 0.01}
    return {"mode": mode, "quality": quality, "composite_ms": ms, "psnr": psnr, "changes": changes}


def test_two_views_make_one_ladder():
    one = [_row("a", 0.5, 1.0, 30.0), _row("a", 2.0, 4.0, 40.0), _row("b", 1.0, 2.0, 60.0)]
    two = [_row("a", 0.5, 4.0, 20.0), _row("a", 2.0, 9.0, 50.0), {"renderer": "peer"}]
    ladder = ladder_of([Chart(rows, [], "v") for rows in (one, two)], psw.Settings(threads=1))
    (rung,) = ladder.rungs
    assert (ladder.volume, rung.name, rung.changes) == ("v", "a", {"residual": 0.01})
    found = [value for point in rung.points for value in (point.quality, point.cost, point.psnr)]
    assert found == pytest.approx([0.5, 2.0, 25.0, 2.0, 6.0, 45.0])


def test_what_flickers_in_motion_is_no_rung():
    still = {"level_of_detail": False}
    rows = [_row("a", 0.5, 1.0, 30.0), _row("a", 2.0, 4.0, 40.0)]
    rows += [_row("a, no levels of detail", q, ms, 60.0 + q, **still) for q, ms in ((0.5, 1.0), (2.0, 4.0))]
    ladder = ladder_of([Chart(rows, [], "v")], psw.Settings(threads=1))
    assert [rung.name for rung in ladder.rungs] == ["a"]


@pytest.mark.gl
def test_texture_formats_have_their_times_and_errors(gl_context, scene_file: Path):
    scene = psw.Scene.load(scene_file)
    renderer = psw.Renderer(scene.volume, scene.transfer)
    rows = texture_rows(renderer, scene.views()[0])
    assert [row["texture"] for row in rows] == ["float32", "float16", "rgba8"]
    assert rows[0]["max_error"] < rows[1]["max_error"] < rows[2]["max_error"]
    assert all(row["upload_ms"] > 0 and row["draw_ms"] > 0 for row in rows)


def test_without_opengl_there_are_no_texture_formats(scene_file: Path, monkeypatch):
    def refuse(*_):
        raise GraphicsError("no OpenGL here")

    monkeypatch.setattr("persp_sw.measure.textures.OffscreenContext", refuse)
    scene = psw.Scene.load(scene_file)
    assert texture_rows(psw.Renderer(scene.volume, scene.transfer), scene.views()[0]) == []


def test_a_chart_of_what_cannot_be_rendered_is_a_mistake(scene_file: Path, tmp_path: Path, monkeypatch):
    def refuse(self, eye, walls):
        raise ViewError("not from here")

    monkeypatch.setattr(psw.Renderer, "composite", refuse)
    assert "not from here" in fails("chart", scene_file, "-o", tmp_path / "a.png")
    assert ".png, .svg" in fails("chart", scene_file, "-o", tmp_path / "a.jpg")
    (tmp_path / "b.svg").mkdir()
    assert "b.svg" in fails("chart", scene_file, "-o", tmp_path / "b")


@pytest.mark.parametrize("error", [KeyboardInterrupt, ViewError("not from here"), RuntimeError("a fault")])
@pytest.mark.parametrize("fails_at", ["measure.chart.chart_of", "measure.plot.draw"])
def test_a_chart_that_breaks_off_leaves_files_as_they_were(
    scene_file: Path, tmp_path: Path, ladders: Path, monkeypatch, fails_at: str, error: BaseException
):
    pytest.importorskip("matplotlib")
    module, name = f"persp_sw.{fails_at}".rsplit(".", 1)
    whole, calls = getattr(importlib.import_module(module), name), []

    def second_fails(*arguments):
        calls.append(arguments)
        if len(calls) == 2:
            raise error
        return whole(*arguments)

    monkeypatch.setattr(f"persp_sw.{fails_at}", second_fails)
    out = tmp_path / "out"
    out.mkdir()
    (out / "a.png").write_text("an earlier one")
    sizes = ("--size", 24, "--size", 32)
    result = run("chart", scene_file, *sizes, "--quality", 1, *CHART, "-o", out / "a.png")
    assert result.exit_code == {KeyboardInterrupt: 130}.get(error, 2 if isinstance(error, ViewError) else 1)
    assert len(calls) == 2
    assert [path.name for path in out.iterdir()] == ["a.png"]
    assert (out / "a.png").read_bytes() == b"an earlier one"


@pytest.mark.parametrize("before", [None, "an earlier one"])
def test_a_bench_that_cannot_begin_leaves_its_file_as_it_was(tmp_path: Path, before: str | None):
    out = tmp_path / "new" / "result.json"
    if before:
        out.parent.mkdir()
        out.write_text(before)
    assert "no case matches" in fails("bench", "--volume", "ct16", "--match", "xyz", "-o", out)
    assert (out.read_text() if out.exists() else None) == before


# --- warmup ------------------------------------------------------------------------------------------------


def test_warming_up_leaves_nothing_to_compile(monkeypatch):
    drawn = []
    whole = psw.Renderer.render

    def render(self, view):
        image = whole(self, view)
        drawn.append((self.volume.data.dtype.name, self.settings.samples_per_interval, self.last["faces"]))
        return image

    monkeypatch.setattr(psw.Renderer, "render", render)
    values = result_of("warmup")
    assert {name for name, _, _ in drawn} == {"uint8", "int16", "uint16", "float32"}
    assert {samples for _, samples, _ in drawn} == {None, 4}
    assert values["ms"] > sum(step["ms"] for step in values["steps"]) * 0.99
    assert result_of("warmup")["compile_ms"] == 0
    assert "nothing had to be compiled" in run("warmup", "--type", "uint8", "--reference").stdout


def test_the_extra_brings_what_the_commands_need():
    text = (ROOT / "pyproject.toml").read_text()
    assert 'bench = ["vtk>=' in text
    assert "matplotlib" in text
