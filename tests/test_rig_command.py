"""`persp-sw rig`: check and show."""

from __future__ import annotations

import gzip
import json
import pprint
from importlib.util import find_spec

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image
from rigs import CONFIGS, wall_keys

from persp_sw.cli import main
from vr_plugin.commands import rig as rig_command
from vr_plugin.rigs.file import rig_of_keys, rig_to_toml

CAVE = CONFIGS / "cave4.toml"


def run(*arguments: object):
    return CliRunner().invoke(main, ["rig", *map(str, arguments)])


@pytest.fixture
def path_csv(tmp_path):
    """A head that walks from the middle of the room at 1.7 m through the right wall, as a recording."""
    lines = ["t,x,y,z,qx,qy,qz,qw"] + [f"{n / 10},{2 * n / 99},1.7,0,0,0,0,1" for n in range(100)]
    path = tmp_path / "walk.csv.gz"
    path.write_bytes(gzip.compress("\n".join(lines).encode()))
    return path


@pytest.fixture
def cave_file(tmp_path):
    """The four-wall CAVE with a tracker that is the room."""
    text = CAVE.read_text()
    path = tmp_path / "cave.toml"
    path.write_text(text[: text.index("[tracker]")] + '[tracker]\nkind = "path"\naddress = "any.csv"\n')
    return path


def test_check_tells_what_is_there():
    result = run("check", CAVE)
    assert result.exit_code == 0, result.output
    for word in ("four-wall CAVE", "3 × 3 × 3 m", "optitrack-120hz.csv.gz", "hololens", "64 mm", "floor"):
        assert word in result.stdout
    assert "doubtful" not in result.output


def test_check_as_json():
    values = json.loads(run("check", CAVE, "--json").stdout)
    assert [wall["name"] for wall in values["walls"]] == ["front", "left", "right", "floor"]
    front = values["walls"][0]
    assert (
        front["size"] == [3, 3] and front["faces_eye"] and front["pixel_mm"][0] == pytest.approx(2.93, 0.001)
    )
    assert values["findings"] == [] and values["machines"] == [""]
    addresses = [recording["address"] for recording in values["recordings"]]
    assert addresses == ["optitrack-120hz.csv.gz", "hololens-200hz.csv.gz"]


def test_check_says_what_is_doubtful(tmp_path):
    turned = wall_keys(lower_left=[1, 0.7, -2], lower_right=[-1, 0.7, -2], upper_left=[1, 2.7, -2])
    path = tmp_path / "turned.toml"
    path.write_text(rig_to_toml(rig_of_keys({"wall": [turned]})))
    result = run("check", path)
    assert result.exit_code == 0
    assert result.stdout.count("turns its back") == 1 and result.stderr == ""


def test_a_broken_file_is_one_error_with_all_problems(tmp_path):
    path = tmp_path / "broken.toml"
    path.write_text('[[wall]]\nname = "a"\npixel = [3, 4]\n[eyes]\nseparation = 64\n')
    for command in ("check", "show"):
        result = run(command, path)
        assert result.exit_code == 2 and result.stdout == "" and "Traceback" not in result.stderr
        for word in ("broken.toml has 6 problems", "did you mean pixels?", "lower_left", "separation"):
            assert word in result.stderr


def test_the_picture_shows_walls_volume_and_path(tmp_path, ball_file, cave_file, path_csv):
    pytest.importorskip("vr_plugin.trackers.recording")
    out = tmp_path / "room.png"
    plain = run("show", cave_file, "-o", out)
    assert plain.exit_code == 0, plain.output
    room = np.asarray(Image.open(out)).astype(int)
    assert (room != 255).any(-1).mean() > 0.2
    full = run("show", cave_file, "-o", out, "--volume", ball_file, "--path", path_csv)
    assert full.exit_code == 0, full.output
    # It leaves the room at x = 1.5, three quarters of the way.
    assert "100 poses, 75.0 % inside the walls, 1.70 … 1.70 m high" in full.stdout
    with_more = np.asarray(Image.open(out)).astype(int)
    red = (np.abs(with_more - (220, 0, 0)).max(-1) < 30).sum() - (
        np.abs(room - (220, 0, 0)).max(-1) < 30
    ).sum()
    assert red > 100  # the path outside
    assert (np.abs(with_more - room).max(-1) > 30).mean() > 0.01  # the ball


def test_show_as_json(tmp_path, cave_file, path_csv):
    pytest.importorskip("vr_plugin.trackers.recording")
    out = tmp_path / "room.png"
    result = run("show", cave_file, "-o", out, "--path", path_csv, "--json")
    values = json.loads(result.stdout)
    assert values["out"] == str(out) and values["path"]["inside"] == 0.75
    assert values["path"]["high"] == [2, 1.7, 0]


def test_the_picture_has_a_name_by_default(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run("show", CAVE).exit_code == 0
    assert (tmp_path / "cave4-room.png").is_file()


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (("check", "none.toml"), "no rig file"),
        (("check", CAVE, "--unit", "mm"), "metres"),
        (("show", CAVE, "-o", "room.npy"), ".png"),
        (("show", CAVE, "-o", "no/such/folder/room.png"), "no folder"),
        (("show", CAVE, "--volume", "none.nrrd", "-o", "room.png"), "none.nrrd"),
    ],
)
def test_what_cannot_be_shown(arguments, word, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = run(*arguments)
    assert result.exit_code == 2 and word in result.stderr and "Traceback" not in result.stderr
    assert not list(tmp_path.iterdir())


def test_other_commands_are_there_where_their_module_is(monkeypatch):
    monkeypatch.setattr(rig_command, "_OTHERS", {"pprint": "pprint", "absent": "vr_plugin.none"})
    context = None
    assert set(rig_command.rig.list_commands(context)) == {"check", "show", "pprint"}
    assert rig_command.rig.get_command(context, "pprint") is pprint.pprint
    assert rig_command.rig.get_command(context, "absent") is None


@pytest.mark.skipif(find_spec("vr_plugin.formats") is None, reason="other systems' files cannot be read")
def test_another_systems_file_is_shown(tmp_path):
    path = tmp_path / "walls.pvx"
    path.write_text(
        '<?xml version="1.0" ?><pvx><Process Type="server"><Machine Name="m" Environment="DISPLAY=m:0" '
        'LowerLeft="-1 -1 -1" LowerRight="1 -1 -1" UpperRight="1 1 -1"/></Process></pvx>'
    )
    result = run("check", path, "--unit", "m")
    assert result.exit_code == 0, result.output
    assert "2×2" in result.stdout
