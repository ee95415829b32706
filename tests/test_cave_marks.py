"""Marks on the walls of a rig, and the wand that picks."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from rigs import two_walls
from tolerances import MARK_OPENGL, MATRIX
from tracker_samples import Script, random_pose

import persp_sw as psw
from vr_plugin.cave.wall_marks import WallMarks
from vr_plugin.cave.wall_pictures import drawer
from vr_plugin.commands.cave import cave
from vr_plugin.loop import Loop
from vr_plugin.pose import Pose
from vr_plugin.rigs.file import load_rig
from vr_plugin.trackers import Sample, Wand

RIG = two_walls(96)
BOX = psw.marks.MarkChoice(box=True, axes=True)


@pytest.fixture
def files(tmp_path: Path, scene_file: Path) -> Path:
    (tmp_path / "rig.toml").write_text(RIG)
    return tmp_path


def loop_of(files: Path, tracker: Script | None = None) -> Loop:
    rig = load_rig(files / "rig.toml")
    rig = replace(rig, tracker=replace(rig.tracker, wand=5))
    scene = psw.Scene.load(files / "scene.json")
    return Loop(rig, psw.Renderer(scene.volume, scene.transfer), tracker)


def hand(pose: Pose, *buttons: bool) -> list[Sample]:
    return [Sample(0.0, 5, pose), Sample(0.0, 5, kind="buttons", buttons=buttons)]


def test_each_wall_and_eye_shows_marks_at_their_depth(files: Path):
    loop = loop_of(files)
    frame = loop.frame(0.0)
    plain = drawer(loop.renderer, "software").draw(frame).pictures
    plain = {key: picture.copy() for key, picture in plain.items()}
    marked = drawer(loop.renderer, "software", WallMarks(loop, BOX)).draw(frame).pictures
    probe = psw.Probe.of(loop.renderer, step=min(loop.renderer.volume.spacing))
    world = BOX.in_world(loop.renderer.volume)
    for picture in frame.pictures:
        key = picture.wall.name, picture.eye
        expected = psw.marks.painted(plain[key], picture.view, world, probe)
        np.testing.assert_array_equal(marked[key], expected)
        assert (expected != plain[key]).any(-1).sum() > 50


@pytest.mark.gl
def test_pictures_drawn_by_opengl_have_them_too(files: Path):
    loop = loop_of(files)
    frame = loop.frame(0.0)
    software = drawer(loop.renderer, "software", WallMarks(loop, BOX)).draw(frame).pictures
    texture = drawer(loop.renderer, "texture", WallMarks(loop, BOX))
    try:
        for key, picture in texture.draw(frame).pictures.items():
            assert np.abs(picture - software[key]).max() < MARK_OPENGL
    finally:
        texture.close()


def test_a_wand_tells_its_ray_and_how_often_it_was_asked(rng: np.random.Generator):
    room_from_world = random_pose(rng).matrix
    room_from_world[:3, :3] *= 0.01
    wand = Wand(room_from_world, 5)
    assert wand.ray_in_world is None
    pose = random_pose(rng)
    wand.update(hand(pose, False, False, False, True), 0.0)
    origin, direction = wand.ray_in_world
    there = room_from_world @ (*(origin + 0.7 * direction), 1)
    np.testing.assert_allclose(there[:3], pose.apply(np.array([0, 0, -0.7])), atol=MATRIX)
    assert wand.picks == 1
    wand.update(hand(pose, False, False, False, True), 0.1)  # held
    assert wand.picks == 1
    wand.update(hand(pose, False, False, False, False), 0.2)
    wand.update(hand(pose, False, False, False, True), 0.3)
    assert wand.picks == 2


def test_the_wand_picks_what_it_points_at(files: Path):
    at, aside = Pose((0, 1.2, 1.0)), Pose((0.1, 1.25, 1.0))
    press, let_go = (False, False, False, True), (False,) * 4
    loop = loop_of(files, Script(hand(at, *press), hand(aside, *let_go), hand(aside, *press)))
    loop.renderer.transfer = psw.TransferFunction([(20, (1, 1, 1), 0), (20, (1, 0.5, 0), 1)], 1.0)
    marks = WallMarks(loop, psw.marks.MarkChoice())
    drawn = drawer(loop.renderer, "software", marks)
    probe = psw.Probe.of(loop.renderer)
    inverse = np.linalg.inv(loop.maker.room_from_world)

    def met(pose: Pose) -> np.ndarray:
        ends = [inverse @ (*pose.apply(np.array([0, 0, -z])), 1) for z in (0, 1)]
        return probe.first_hit(ends[0][:3], (ends[1] - ends[0])[:3]).position_world

    pictures = drawn.draw(loop.frame(0.0)).pictures
    choice = marks.marking.choice
    np.testing.assert_allclose(choice.cursor, met(at), atol=1e-9)
    assert choice.ruler is None and "value" in marks.marking.picked
    bare = drawer(loop.renderer, "software").draw(loop.frame(0.1)).pictures
    assert all((pictures[key] != bare[key]).any() for key in pictures)
    drawn.draw(loop.frame(0.2))
    np.testing.assert_allclose(marks.marking.choice.ruler, (met(at), met(aside)), atol=1e-9)
    drawn.draw(loop.frame(0.3))
    np.testing.assert_allclose(marks.marking.choice.ruler, (met(at), met(aside)), atol=1e-9)  # once a press


def test_the_command_shows_marks_and_says_what_walls_cannot(files: Path):
    def run(*options: str) -> dict:
        arguments = [files / "rig.toml", files / "scene.json", "--offscreen", "--frames", 1, "--json"]
        arguments += ["--warp", "software", "-o", files / "out", *options]
        result = CliRunner().invoke(cave, list(map(str, arguments)), catch_exceptions=False)
        return json.loads(result.stdout)

    plain = [Path(p["out"]).read_bytes() for p in run()["pictures"]]
    marked = [Path(p["out"]).read_bytes() for p in run("--box", "--cursor", 10, 10, 10)["pictures"]]
    assert all(a != b for a, b in zip(plain, marked, strict=True))
    for options in (("--legend",), ("--scale-bar",), ("--box", "--reference")):
        with pytest.raises(psw.PerspSWError, match="leave"):
            run(*options)
