"""Wall files that draw in others, broken and hostile ones, and the command that converts them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from rig_texts import CALVR, CALVR_INPUT, INPUT, PVX, covise, jconf, viewport, window

from persp_sw.cli import main
from persp_sw.errors import PerspSWError
from vr_plugin.commands.rig_convert import convert
from vr_plugin.formats import import_rig
from vr_plugin.rig import Rig, RigError
from vr_plugin.rigs.file import load_rig
from vr_plugin.rigs.text import rig_to_toml


def corners(rig: Rig, name: str) -> np.ndarray:
    """Lower left, lower right and upper left of a wall."""
    wall = next(wall for wall in rig.walls if wall.name == name).wall
    return np.array([wall.lower_left, wall.lower_right, wall.upper_left])


# --- Files that draw in others ---


def test_includes_are_followed_and_missing_ones_are_said(tmp_path: Path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "more.xml").write_text(
        '<COCONFIG><LOCAL host="second"><COVER><NumScreens value="1"/></COVER></LOCAL>'
        "<INCLUDE>../main.xml</INCLUDE><INCLUDE>gone.xml</INCLUDE></COCONFIG>"
    )
    main = tmp_path / "main.xml"
    include = "<INCLUDE>sub/more.xml</INCLUDE><TRYINCLUDE>optional.xml</TRYINCLUDE>"
    main.write_text(covise(root=include + "<INCLUDE>http://site/x.xml</INCLUDE><INCLUDE>\n</INCLUDE>"))
    reading = import_rig(main)
    assert reading.rig.machines == ("wall", "second")
    assert any("more.xml:1" in note and "gone.xml" in note for note in reading.notes)
    assert any("http://site" in note for note in reading.notes)
    assert not any("optional.xml" in note for note in reading.notes)


def test_xinclude_with_a_prefix_that_nothing_binds(tmp_path: Path):
    (tmp_path / "screens.xml").write_text(
        "<ScreenConfig><Screen name='0' comment='NEW' width='500'/></ScreenConfig>"
    )
    main = tmp_path / "main.xml"
    fallback = "<xi:fallback><NumChannels value='1'/></xi:fallback>"
    xi = f"<xi:include href='screens.xml'/><xi:include href='gone.xml'>{fallback}</xi:include>"
    main.write_text(f"<COCONFIG><LOCAL host='h'><COVER>{xi}</COVER></LOCAL></COCONFIG>")
    reading = import_rig(main)
    assert np.allclose(corners(reading.rig, "NEW")[1], [0.25, -0.75, 0])
    assert not any("gone.xml" in note for note in reading.notes)


def test_what_calvr_draws_in_counts_after_its_own(tmp_path: Path):
    screen = '<ScreenConfig><Screen name="0" comment="{}" width="{}" height="500"/></ScreenConfig>'
    (tmp_path / "more.xml").write_text(screen.format("THEIRS", 3000) + "<Stereo separation='77'/>")
    main = tmp_path / "main.xml"
    main.write_text("<INCLUDE>more.xml</INCLUDE>" + screen.format("OURS", 1000))
    rig = import_rig(main, "mm").rig
    assert np.allclose(corners(rig, "OURS")[1], [0.5, -0.25, 0])
    assert rig.eyes.separation == pytest.approx(0.077)


# --- Hostile and broken files ---

_BOMB = '<?xml version="1.0"?><!DOCTYPE pvx [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]><pvx>&b;</pvx>'


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (_BOMB, "declares entities"),
        ('<pvx><!-- --><Machine Name="&lol;"/></pvx>', r":1: not well-formed XML: undefined entity"),
        ("<pvx>\n<Machine>\n</pvx>", ":3: not well-formed XML: mismatched tag"),
        ("<pvx/></everything><pvx/>", "not well-formed XML"),
        ("<a>" * 100 + "</a>" * 100, "64 levels"),
        ("<pvx>" + "<a/>" * 100_001 + "</pvx>", "100000 elements"),
        ("<pvx>" + " " * (5 << 20) + "</pvx>", "larger than 4 MiB"),
        (b"\x89PNG\0\0\0", "not a text file"),
        ("", "no XML"),
        ("config:\n{ display: { } };", "omegalib"),
        ("<html><body/></html>", "of no system whose walls are read.*html"),
        ("<pvx></pvx>", "no Machine element"),
        ("<COCONFIG/>", "without a single wall"),
        ("<LOCAL host='h'/>", "without a single wall"),
        (jconf(""), "without a single wall"),
    ],
)
def test_files_that_cannot_be_walls_are_refused(tmp_path: Path, content: str | bytes, told: str):
    path = tmp_path / "file.xml"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    with pytest.raises(RigError, match=told):
        import_rig(path)


def test_files_that_are_not_there_and_our_own_are_refused(tmp_path: Path):
    with pytest.raises(RigError, match="No such file"):
        import_rig(tmp_path / "gone.pvx")
    with pytest.raises(RigError, match="directory"):
        import_rig(tmp_path)
    (tmp_path / "rig.toml").write_text("name = 'ours'")
    with pytest.raises(RigError, match="our own format already"):
        import_rig(tmp_path / "rig.toml")


def test_old_encodings_and_a_harmless_doctype_are_read(tmp_path: Path):
    path = tmp_path / "w.pvx"
    text = PVX.replace("front", "Wände").replace("<pvx>", "<!DOCTYPE pvx>\n<pvx>")
    for encoding in ("utf-8-sig", "utf-16", "iso-8859-1"):
        path.write_bytes(text.encode(encoding))
        assert import_rig(path, "m").rig.walls[0].name == "Wände"
    text = PVX.replace("front", "€").replace('"1.0"', '"1.0" encoding="windows-1252"')
    path.write_bytes(text.encode("windows-1252"))
    assert import_rig(path, "m").rig.walls[0].name == "€"


_TEXTS = {
    "paraview.pvx": PVX,
    "opencover.xml": covise(top=INPUT.format(head="ArtHead")),
    "calvr.xml": CALVR + CALVR_INPUT,
    "juggler.jconf": jconf(
        window("a", viewport(view="Stereo"), stereo=True) + window("b", viewport(tracked=True))
    ),
}
_NUMBERS = (
    "0",
    "-1",
    "1e300",
    "nan",
    "inf",
    "0/05",
    "",
    "9" * 40,
    "1.5",
    "-0.0",
    "1_0",
    "0x10",
    "½",
    "1e7",
    "1e-300",
)


def mutated(text: str, rng: np.random.Generator) -> bytes:
    """A file with a few things wrong: cut, bytes changed, numbers replaced, pieces moved."""
    data = bytearray(text.encode())
    for _ in range(rng.integers(1, 4)):
        kind, at = rng.integers(5), int(rng.integers(len(data))) if data else 0
        if kind == 0:
            del data[at:]
        elif kind == 1 and data:
            data[at] = rng.integers(256)
        elif kind == 2:
            pieces = data.split(b'"')
            where = int(rng.integers(len(pieces)))
            pieces[where] = rng.choice(_NUMBERS).encode()
            data = bytearray(b'"'.join(pieces))
        elif kind == 3:
            length = int(rng.integers(1, 80))
            data[at:at] = data[(start := int(rng.integers(len(data) + 1))) : start + length]
        else:
            pieces = data.split(b">")
            where = int(rng.integers(len(pieces)))
            pieces[where] = rng.choice(_NUMBERS).encode() + pieces[where].lstrip(b"0123456789.-")
            data = bytearray(b">".join(pieces))
    return bytes(data)


@pytest.mark.parametrize("name", _TEXTS)
def test_mutated_files_end_in_a_rig_or_in_advice(name: str, tmp_path: Path, rng: np.random.Generator):
    path, ours = tmp_path / name, tmp_path / "rig.toml"
    ends = {"rig": 0, "refused": 0}
    for number in range(200):
        path.write_bytes(mutated(_TEXTS[name], rng))
        try:
            reading = import_rig(path, "mm" if number % 2 else None, skip_broken=number % 3 > 0)
        except PerspSWError as error:
            assert str(error)
            ends["refused"] += 1
            continue
        ours.write_text(rig_to_toml(reading.rig), encoding="utf-8")
        assert load_rig(ours).machines == reading.rig.machines  # what is converted can be used
        ends["rig"] += 1
    assert min(ends.values()) > 10


# --- The command ---


def test_convert_writes_a_rig_file_that_reads_back(tmp_path: Path):
    source, ours = tmp_path / "cave.xml", tmp_path / "rig.toml"
    source.write_text(covise(top=INPUT.format(head="ArtHead"), root="<INCLUDE>gone.xml</INCLUDE>"))
    result = CliRunner().invoke(convert, [str(source), "-o", str(ours)])
    assert result.exit_code == 0, result.output
    expected, written = import_rig(source).rig, load_rig(ours)
    assert np.array_equal(written.corners, expected.corners)
    assert [w.machine for w in written.walls] == ["wall"]
    assert written.tracker.address == "udp://5001"
    assert np.array_equal(written.tracker.room_from_tracker, expected.tracker.room_from_tracker)
    assert "# cave.xml:" in ours.read_text() and "gone.xml" in result.output


def test_convert_prints_toml_or_json(tmp_path: Path):
    source = tmp_path / "wall.pvx"
    source.write_text(PVX)
    printed = CliRunner().invoke(convert, [str(source), "--unit", "m"]).stdout
    assert printed.startswith("# Converted from ParaView's wall.pvx.") and "[[wall]]" in printed
    values = json.loads(CliRunner().invoke(convert, [str(source), "--unit", "m", "--json"]).stdout)
    assert [wall["name"] for wall in values["walls"]] == ["front", "side"]
    assert values["system"] == "ParaView" and any("Sparkle" in note for note in values["notes"])


def test_convert_refuses_what_it_cannot_do(tmp_path: Path):
    source = tmp_path / "wall.pvx"
    source.write_text(PVX)
    for arguments, told in (
        (["gone.pvx"], "No such file"),
        ([str(source)], "--unit"),
        ([str(source), "--unit", "m", "-o", str(tmp_path / "no" / "rig.toml")], "-o"),
        ([str(source), "--unit", "m", "--host", "node3"], "node1:0"),
    ):
        error = CliRunner().invoke(convert, arguments).exception
        assert isinstance(error, RigError) and told in str(error)


def test_convert_is_a_command_of_rig_and_its_errors_are_advice(tmp_path: Path):
    source, ours = tmp_path / "wall.pvx", tmp_path / "rig.toml"
    source.write_text(PVX)
    result = CliRunner().invoke(main, ["rig", "convert", str(source), "--unit", "m", "-o", str(ours)])
    assert result.exit_code == 0, result.output
    assert len(load_rig(ours).walls) == 2
    result = CliRunner().invoke(main, ["rig", "convert", str(source)])
    assert result.exit_code == 2
    assert "--unit" in result.output and "Traceback" not in result.output
