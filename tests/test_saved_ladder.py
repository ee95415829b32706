"""The ladder of a machine, volume and transfer function: kept, found, and refused where it does not fit."""

from __future__ import annotations

import json
import logging
import os
import time
from pathlib import Path

import numpy as np
import pytest

import persp_sw as psw
from persp_sw._jit import max_threads
from persp_sw.errors import FileError
from persp_sw.quality import saved_ladder
from persp_sw.quality.ladder import Ladder, Point, Rung
from persp_sw.quality.saved_ladder import ladder_for, machine_key, program_key, save_ladder, volume_key
from persp_sw.volume import phantoms

RUNG = Rung("1 sample", {"samples_per_interval": 1}, (Point(0.25, 1.0, 30.0), Point(2.0, 8.0, 50.0)))
FUNCTION = psw.TransferFunction([(0, (0, 0, 0), 0), (255, (1, 1, 1), 0.5)])


@pytest.fixture
def renderer() -> psw.Renderer:
    return psw.Renderer(phantoms.synthetic_ct(16), FUNCTION, psw.Settings(threads=1))


@pytest.fixture
def ladder(renderer: psw.Renderer) -> Ladder:
    """Of this renderer, machine and program."""
    volume = volume_key(renderer.volume, renderer.transfer)
    return Ladder((RUNG,), machine_key(1), volume, program_key())


def lines(caplog) -> list[str]:
    return [record.getMessage() for record in caplog.records if record.levelno >= logging.WARNING]


def test_a_saved_ladder_is_found_again(renderer, ladder, tmp_path: Path, monkeypatch, caplog):
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    assert ladder_for(renderer) == Ladder.default()
    path = save_ladder(ladder)
    assert path.parent == tmp_path / "persp_sw" / "ladders"
    assert ladder_for(renderer) == psw.ladder_for(renderer) == ladder
    assert lines(caplog) == []


def test_without_the_variable_it_is_in_the_users_own_folder(monkeypatch, tmp_path: Path):
    monkeypatch.delenv("XDG_DATA_HOME", raising=False)
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    assert saved_ladder.default_folder() == tmp_path / ".local" / "share" / "persp_sw" / "ladders"


def test_another_volume_function_or_number_of_threads_has_no_ladder(renderer, ladder, tmp_path: Path, caplog):
    save_ladder(ladder, tmp_path)
    others = [
        psw.Renderer(phantoms.synthetic_ct(18), FUNCTION, renderer.settings),
        psw.Renderer(renderer.volume, psw.TransferFunction([(0, (0, 0, 0), 0), (255, (1, 1, 1), 0.4)])),
        psw.Renderer(renderer.volume, FUNCTION, psw.Settings(threads=None)),
    ]
    assert machine_key(None) == machine_key(max_threads()) != machine_key(max_threads() + 1)
    lit = psw.Renderer(renderer.volume, FUNCTION, renderer.settings, look=psw.Look(psw.Lighting()))
    shapes = psw.TransferFunction2D([psw.Box((40, 200), (0, 90), (1, 0.5, 0.2), 0.3)])
    others = [lit, psw.Renderer(renderer.volume, shapes, renderer.settings), *others]
    for other in others if max_threads() > 1 else others[:-1]:
        assert ladder_for(other, tmp_path) == Ladder.default()
    assert lines(caplog) == []
    renderer.regions = psw.Regions(crop=(0, 9, 0, 9, 0, 9))  # moves from frame to frame
    assert ladder_for(renderer, tmp_path) == ladder


def test_what_a_volume_is_known_by():
    data = phantoms.synthetic_ct(16).data
    other = data.copy()
    other[3, 4, 5] += 1
    pose = np.diag([1.0, 1.0, 2.0, 1.0])
    turned = np.diag([-1.0, -1.0, 1.0, 1.0])
    turned[:3, 3] = 5
    function = FUNCTION.with_unit(1.0)
    different = [
        (psw.Volume(data), function),
        (psw.Volume(other), function),
        (psw.Volume(data.astype(np.uint16)), function),
        (psw.Volume(data, world_from_object=pose), function),
        (psw.Volume(data[:-1]), function),
        (psw.Volume(data), psw.TransferFunction(FUNCTION.points, 2.0)),
        (psw.Volume(data), psw.TransferFunction([(0, (0, 0, 0), 0), (255, (1, 0, 1), 0.5)], 1.0)),
    ]
    box = psw.Box((40, 200), (0, 90), (1, 0.5, 0.2), 0.3)
    different += [(psw.Volume(data), psw.TransferFunction2D([box], unit)) for unit in (1.0, 2.0)]
    light, shadow = psw.Light((1, 2, 3)), psw.Light((1, 2, 3), shadows=True)
    looks = [psw.Lighting(), psw.Lighting(lights=(light,)), psw.Lighting(lights=(shadow,))]
    different += [(psw.Volume(data), function, psw.Look(lighting)) for lighting in looks]
    different += [(psw.Volume(data), function, psw.Look(None, psw.Modulation()))]
    different += [(psw.Volume(data), function, psw.Look(looks[0], None, 2.0))]
    assert len({volume_key(*pair) for pair in different}) == len(different)
    same = [
        (psw.Volume(data, name="again"), FUNCTION),
        (psw.Volume(data, world_from_object=turned), function),
        (psw.Volume(data), function, psw.Look()),
    ]
    assert {volume_key(*pair) for pair in same} == {volume_key(*different[0])}


def test_a_light_may_move_and_shine_otherwise():
    """The hand on the light is not to change the ladder under the controller."""
    one = psw.Look(psw.Lighting(lights=(psw.Light((1, 2, 3)),)))
    other = psw.Look(psw.Lighting(0.4, 0.5, 0.1, lights=(psw.Light((3, 2, -1), (1, 0, 0)),)))
    volume = phantoms.synthetic_ct(16)
    assert volume_key(volume, FUNCTION, one) == volume_key(volume, FUNCTION, other)


def test_of_a_large_volume_a_part_is_hashed(monkeypatch):
    """Work, not time: what is copied for hashing has no more than 128³ voxels."""
    volume = psw.Volume(np.zeros((300, 200, 100), np.uint8))
    hashed = []
    kept = np.ascontiguousarray
    monkeypatch.setattr(saved_ladder.np, "ascontiguousarray", lambda a: hashed.append(a.size) or kept(a))
    volume_key(volume, FUNCTION)
    assert hashed == [75 * 67 * 100]


def test_the_ladder_of_another_program_is_said_and_not_used(renderer, ladder, tmp_path, monkeypatch, caplog):
    save_ladder(ladder, tmp_path)
    monkeypatch.setattr(saved_ladder, "program_key", lambda: "a later one")
    assert ladder_for(renderer, tmp_path) == Ladder.default()
    (line,) = lines(caplog)
    assert "another version" in line and "persp-sw chart" in line


def test_the_program_is_known_by_its_sources(tmp_path: Path, monkeypatch):
    (tmp_path / "kernels").mkdir()
    source = tmp_path / "kernels" / "fast.py"
    monkeypatch.setattr(saved_ladder, "_PACKAGE", tmp_path)
    keys = []
    for text in ("a", "b", "a"):
        source.write_text(text)
        keys.append(program_key.__wrapped__())
    assert keys[0] == keys[2] != keys[1]
    monkeypatch.setattr(saved_ladder._jit, "VECTORS", not saved_ladder._jit.VECTORS)
    assert program_key.__wrapped__() != keys[0]


def test_age_alone_makes_nothing_stale(renderer, ladder, tmp_path: Path):
    path = save_ladder(ladder, tmp_path)
    long_ago = time.time() - 3e8
    os.utime(path, (long_ago, long_ago))
    assert ladder_for(renderer, tmp_path) == ladder


@pytest.mark.parametrize(
    "content",
    [b"", b"{", b"[]", b"\xff\xfe\x00", b"[" * 100_000, b'{"format": 2}', b'{"format": 2, "rungs": [{}]}'],
)
def test_a_damaged_file_is_named_once_and_stops_nothing(
    renderer, ladder, tmp_path: Path, caplog, content: bytes
):
    path = save_ladder(ladder, tmp_path)
    path.write_bytes(content)
    assert ladder_for(renderer, tmp_path) == Ladder.default()
    (line,) = lines(caplog)
    assert path.name in line
    assert "\n" not in line


@pytest.mark.parametrize(
    "change",
    [
        {"changes": {"threads": -1}},
        {"changes": {"quality": 1}},
        {"changes": {"colour": 1}},
        {"changes": None},
        {"points": [{"quality": 1.0, "cost": 1.0}]},
        {"points": [{"quality": 1.0, "cost": float("nan")}, {"quality": 2.0, "cost": 2.0}]},
        {"points": [{"quality": "1", "cost": 1.0}, {"quality": 2.0, "cost": 2.0}]},
    ],
)
def test_a_file_edited_by_hand_stops_nothing(renderer, ladder, tmp_path: Path, caplog, change: dict):
    path = save_ladder(ladder, tmp_path)
    content = json.loads(path.read_text())
    content["rungs"][0] |= change
    path.write_text(json.dumps(content))
    assert ladder_for(renderer, tmp_path) == Ladder.default()
    assert len(lines(caplog)) == 1


def test_a_file_that_cannot_be_read_stops_nothing(renderer, ladder, tmp_path: Path, monkeypatch, caplog):
    save_ladder(ladder, tmp_path)

    whole = Path.read_text

    def refuse(self, *arguments, **options):
        if self.suffix == ".json":
            raise PermissionError(13, "Permission denied", str(self))
        return whole(self, *arguments, **options)

    monkeypatch.setattr(Path, "read_text", refuse)
    assert ladder_for(renderer, tmp_path) == Ladder.default()
    assert "Permission denied" in lines(caplog)[0]


def test_a_folder_that_cannot_be_written_to_is_named(ladder, tmp_path: Path):
    (tmp_path / "file").write_text("")
    with pytest.raises(FileError, match="cannot keep the ladder in"):
        save_ladder(ladder, tmp_path / "file")
