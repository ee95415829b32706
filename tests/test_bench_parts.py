"""What the benchmark is made of: cases, turns, statistics, kept references, equal accuracy, fronts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import persp_sw as psw
from persp_sw import reference
from persp_sw.errors import FileError, PerspSWError
from persp_sw.measure import cases, chart, equal_accuracy, modes, truth
from persp_sw.measure.metrics import psnr
from persp_sw.measure.timing import Times, time_in_turn
from persp_sw.volume import phantoms

# --- cases -------------------------------------------------------------------------------------------------


def test_every_fixed_case_has_its_name_and_its_place():
    made = cases.fixed_cases(["ct16"], sizes=(32, 48))
    assert len(made) == len({case.name for case in made}) == 3 * 3 * 2
    assert made[0].name == "ct16-fog-front-32"
    stage = made[-1].open()
    assert stage.volume.size == (16, 16, 16)
    assert stage.views[-1].size == (48, 48)
    assert len(stage.views) == cases.FRAMES + 1


def test_the_eye_moves_and_is_where_the_view_says():
    volume = phantoms.synthetic_ct(16)
    box = np.zeros(3), np.full(3, 15.0)
    for look in cases.LOOKS:
        eyes = np.array([view.eye.position for view in cases.eye_path(volume, look, (8, 8))])
        assert len(np.unique(eyes, axis=0)) == len(eyes)
        inside = ((eyes > box[0]) & (eyes < box[1])).all(1)
        assert inside.all() if look == "inside" else not inside.any()


@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint16", "float32"])
@pytest.mark.parametrize("function", cases.FUNCTIONS)
def test_transfer_functions_suit_every_range_of_values(dtype: str, function: str):
    volume = phantoms.synthetic_ct(16, dtype=dtype)
    transfer = cases.transfer_for("ct16", function, volume)
    low, high = volume.value_range
    assert transfer.opacity(low) == 0
    assert transfer.opacity(high) > (0.01 if function == "fog" else 0.99)
    same = cases.transfer_for("ct16", function, phantoms.synthetic_ct(16))
    assert transfer.opacities == pytest.approx(same.opacities, abs=1e-3)


def test_resampling_keeps_place_and_what_is_linear():
    volume = phantoms.linear((5, 9, 3), 2.0, (1.0, -0.5, 4.0), np.diag([1.0, 2.0, 3.0, 1.0]))
    finer = cases.resampled(volume, 17)
    assert finer.size == (9, 17, 5)
    assert finer.extent == pytest.approx(volume.extent)
    assert finer.centre == pytest.approx(volume.centre)
    z, y, x = np.indices((5, 17, 9)) / 2
    assert finer.data == pytest.approx(2 + x - 0.5 * y + 4 * z)
    other = cases.resampled(volume, (3, 5, 9))
    assert other.size == (3, 5, 9)
    assert other.extent == pytest.approx(volume.extent)
    z, y, x = np.indices((9, 5, 3)) * np.array([1 / 4, 2, 2])[:, None, None, None]
    assert other.data == pytest.approx(2 + x - 0.5 * y + 4 * z)


def test_volumes_are_found_by_the_beginning_of_their_name(tmp_path: Path):
    np.save(tmp_path / "engine-ct.npy", phantoms.synthetic_ct(8).data)
    (tmp_path / "engine.txt").write_text("no volume")
    assert cases.default_volumes(tmp_path) == ["engine", "ct256"]
    assert cases.volume_named("engine", tmp_path).size == (8, 8, 8)
    assert cases.volume_named("engine@12", tmp_path).size == (12, 12, 12)
    (case, *_) = cases.fixed_cases([str(tmp_path / "engine-ct.npy")], None)
    assert case.open().volume.size == (8, 8, 8)


def test_the_data_folder_is_given_or_named_by_the_environment(tmp_path: Path, monkeypatch):
    monkeypatch.delenv(cases.DATA_VARIABLE, raising=False)
    assert cases.data_folder(None) is None
    (tmp_path / "volumes").mkdir()
    monkeypatch.setenv(cases.DATA_VARIABLE, str(tmp_path))
    assert cases.data_folder(None) == tmp_path / "volumes"
    with pytest.raises(FileError, match="no data folder"):
        cases.data_folder(tmp_path / "nowhere")


@pytest.mark.parametrize("name", ["nowhere", "ct16@1", "ct16@x"])
def test_volumes_that_are_none(name: str):
    with pytest.raises(PerspSWError, match=r"ct128|N ≥ 2"):
        cases.fixed_cases([name])


# --- turns and statistics ----------------------------------------------------------------------------------


class Recorder:
    """A contestant that notes what it is asked for."""

    def __init__(self, name: str, notes: list[str]):
        self.name, self.notes = name, notes

    def prepare(self, view):
        self.notes.append(f"{self.name} prepares {view}")

    def draw(self, view):
        self.notes.append(f"{self.name}{view}")
        return {"ms": float(view), "warp_ms": 1.0}


def test_turns_alternate_and_follow_the_path():
    notes: list[str] = []
    contestants = [Recorder("a", notes), Recorder("b", notes)]
    times = time_in_turn(contestants, [0, 1, 2], seconds=0.0, rounds=3)
    assert [note for note in notes if "prepares" not in note] == ["a1", "b1", "b2", "a2", "a1", "b1"]
    assert notes[0] == "a prepares 0"
    assert [frame["ms"] for frame in times[0].frames] == [1, 2, 1]


def test_statistics():
    times = Times([{"ms": float(n), "warp_ms": 2.0} for n in range(101)])
    figures = times.figures()
    assert (figures["ms"], figures["ms_p95"], figures["ms_p99"], figures["ms_min"]) == (50, 95, 99, 0)
    assert figures["warp_ms"] == figures["warp_ms_p99"] == 2
    assert figures["frames"] == 101


# --- kept references ---------------------------------------------------------------------------------------


@pytest.fixture
def small():
    """A scene to cast: volume, transfer function, view, regions."""
    volume = phantoms.synthetic_ct(16)
    transfer = cases.transfer_for("ct16", "ramp", volume)
    return volume, transfer, cases.eye_path(volume, "front", (24, 20))[0], psw.Regions()


def test_a_reference_is_cast_once(tmp_path: Path, small):
    truths = truth.Truths(tmp_path / "kept")
    first, again = truths.of(*small), truths.of(*small)
    assert truths.cast == 1
    assert np.array_equal(first, again)
    exact = reference.render(*small[:3], tolerance=truth.TOLERANCE)
    assert first == pytest.approx(exact, abs=1e-7)
    (kept,) = (tmp_path / "kept").iterdir()
    kept.write_bytes(kept.read_bytes()[:100])  # as an interrupted copy leaves it
    assert np.array_equal(truths.of(*small), first)
    assert truths.cast == 2


def test_a_reference_is_known_by_all_it_depends_on(small):
    volume, transfer, view, regions = small
    other = volume.data.copy()
    other[3, 4, 5] += 1
    eye = psw.Eye(view.eye.position, near=1.0)
    parallel = [
        psw.View.parallel(view.eye.position, centre, (0, 1, 0), height, (24, 20))
        for centre, height in [(volume.centre, 20.0), (volume.centre, 21.0)]
    ]
    step = view.eye.position + parallel[0].wall.lower_right - parallel[0].wall.lower_left
    aside = psw.View.parallel(step, step - view.eye.position + volume.centre, (0, 1, 0), 20.0, (24, 20))
    variants = [
        small,
        (psw.Volume(other), transfer, view, regions),
        (psw.Volume(volume.data.astype(np.float32)), transfer, view, regions),
        (volume.with_spacing((1, 1, 2)), transfer, view, regions),
        (volume, psw.TransferFunction(transfer.points, 2.0), view, regions),
        (volume, cases.transfer_for("ct16", "fog", volume), view, regions),
        (volume, transfer, psw.View(eye, view.wall), regions),
        (volume, transfer, cases.eye_path(volume, "front", (24, 20))[1], regions),
        (volume, transfer, cases.eye_path(volume, "front", (24, 21))[0], regions),
        (volume, transfer, view, psw.Regions(crop=(0, 9, 0, 9, 0, 9))),
        (volume, transfer, view, psw.Regions(clip=[(1, 0, 0, -3)])),
        *((volume, transfer, other, regions) for other in (*parallel, aside)),
        (volume, transfer, view, psw.Regions(cut=[psw.Cut((1, 0, 0, -3), 2)])),
        (volume, transfer, view, psw.Regions([1, 2, 1, 2, 1, 2])),
        (volume, transfer, view, psw.Regions([1, 2, 1, 2, 1, 2], crop_flags="fence")),
        (volume, transfer, view, regions, psw.Look(psw.Lighting())),
        (volume, transfer, view, regions, psw.Look(psw.Lighting(lights=(psw.Light((0, 0, 1)),)))),
        (volume, transfer, view, regions, psw.Look(None, psw.Modulation())),
        (volume, psw.TransferFunction2D([psw.Box((0, 9), (0, 9), (1, 1, 1), 0.5)]), view, regions),
        (volume, psw.TransferFunction2D([psw.Box((0, 9), (0, 9), (1, 1, 1), 0.4)]), view, regions),
    ]
    assert len({truth.key_of(*variant) for variant in variants}) == len(variants)
    assert truth.key_of(*small) == truth.key_of(*small)


def test_the_folder_for_references_must_be_one(tmp_path: Path):
    (tmp_path / "file").write_text("")
    with pytest.raises(FileError, match="--cache"):
        truth.Truths(tmp_path / "file")


# --- equal accuracy ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("quality", [0.3, 1.0, 1.9, 7.5])
def test_the_quality_of_an_accuracy_is_found_to_two_percent(quality: float):
    found, value = equal_accuracy.lowest_quality(lambda q: 40 + 20 * np.log10(q), 40 + 20 * np.log10(quality))
    assert quality * (1 - 1e-12) <= found <= 1.025 * quality
    assert value == 40 + 20 * np.log10(found)


def test_an_accuracy_out_of_reach_is_given_up_early():
    asked: list[float] = []

    def saturating(quality: float) -> float:
        asked.append(quality)
        return 40 - 5 / quality**4

    assert equal_accuracy.lowest_quality(saturating, 60) is None
    assert max(asked) < 5
    asked.clear()
    assert equal_accuracy.lowest_quality(saturating, 60, lambda: len(asked) == 2) is None
    assert len(asked) == 2


def test_settings_equal_to_a_peer_are_accurate_and_no_more(small):
    volume, transfer, view, _ = small
    exact = reference.render(volume, transfer, view)
    renderer = psw.Renderer(volume, transfer)
    plain = psnr(renderer.render(view), exact)
    found = equal_accuracy.search(renderer, psw.Settings(), view, exact, plain + 3)
    assert found.reached
    assert found.psnr >= plain + 3
    assert found.settings.quality > 1
    renderer.settings = found.settings
    assert psnr(renderer.render(view), exact) == found.psnr
    missed = equal_accuracy.search(renderer, psw.Settings(), view, exact, 200.0)
    assert not missed.reached
    assert plain < missed.psnr < 200


def test_switches_change_one_thing_and_unknown_ones_are_left_out():
    base = psw.Settings(quality=2.0)
    table = {"no skipping": {"skip_empty": False}, "of a later version": {"nonsense": 1}}
    assert modes.available(table, base) == {"no skipping": psw.Settings(quality=2.0, skip_empty=False)}
    for made in (modes.available(modes.MODES, base), modes.available(modes.ABLATIONS, base)):
        assert len(set(made.values())) == len(made) >= 3
        assert base not in made.values()


# --- fronts ------------------------------------------------------------------------------------------------


def point(mode: str, ms: float, accuracy: float) -> dict:
    return {"renderer": "persp_sw", "case": "c", "threads": 2, "mode": mode, "ms": ms, "psnr": accuracy}


def test_time_at_an_accuracy_is_the_fastest_modes():
    rows = [point("a", 1, 30), point("a", 4, 40), point("a", 5, 39), point("b", 3, 35), point("b", 48, 55)]
    assert chart.time_at(35, rows) == pytest.approx(2)  # half way of log 1 … log 4, faster than b's 3
    assert chart.time_at(45, rows) == pytest.approx(12)  # half way of log 3 … log 48: only b gets there
    assert chart.time_at(20, rows) == 1
    assert chart.time_at(56, rows) is None
    peers = [{**point("", 20, accuracy), "renderer": "other"} for accuracy in (35, 60)]
    for peer in peers:
        del peer["mode"]
    reached, missed = chart.figures([*rows, *peers])
    assert reached["ratio"] == pytest.approx(10)
    assert missed["equal_ms"] is missed["ratio"] is None
