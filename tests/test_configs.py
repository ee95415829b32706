"""The rigs in configs/: each reads without a finding and shows what the reference shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from data_folder import DATA
from rigs import CONFIGS, assert_same_rig
from tolerances import PICTURE_SMOOTH_DB

import persp_sw as psw
from persp_sw.measure.metrics import psnr
from vr_plugin.eyes import eyes_of_head
from vr_plugin.frame import FrameMaker
from vr_plugin.placement import corners_in_room, room_from_world
from vr_plugin.pose import Pose
from vr_plugin.rig import Rig, TrackerPlace
from vr_plugin.rigs.check import findings
from vr_plugin.rigs.file import load_rig, rig_to_toml
from vr_plugin.rigs.one_machine import rig_on_machine

# Walls that see some of the volume from where the head rests.
SEEN_BY = {
    "desktop": ("monitor",),
    "powerwall": ("bottom left", "bottom middle", "bottom right", "top left", "top middle", "top right"),
    "cave3": ("left", "front", "right"),
    "cave4": ("front", "left", "right", "floor"),
    "cube6": ("left", "front", "right", "back", "floor", "ceiling"),
    "lshape": ("front", "floor"),
    "hmd": ("left", "right"),
}
LONGER_SIDE = 48  # pixels
SMOOTH = [(0, (0.2, 0.3, 0.8), 0.0), (60, (0.9, 0.6, 0.3), 0.1), (200, (1, 1, 0.9), 0.3)]
INSIDE_SHARE = 0.99


def config(name: str) -> Rig:
    return load_rig(CONFIGS / f"{name}.toml")


def small(rig: Rig) -> Rig:
    """The same walls with few pixels."""
    walls = []
    for wall in rig.walls:
        pixels = [max(1, round(n * LONGER_SIDE / max(wall.wall.pixels))) for n in wall.wall.pixels]
        walls.append(replace(wall, wall=replace(wall.wall, pixels=pixels)))
    return replace(rig, walls=walls)


def cushion(count: int = 24) -> psw.Volume:
    """Values that fill the whole box, falling linearly from 200 in its middle to 0 on its faces."""
    x = np.abs(np.linspace(-1, 1, count))
    depth = 1 - np.maximum(np.maximum(x[:, None, None], x[None, :, None]), x[None, None, :])
    return psw.Volume((200 * depth).astype(np.uint8))


def test_every_config_is_tested():
    assert {path.stem for path in CONFIGS.glob("*.toml")} == set(SEEN_BY)


@pytest.mark.parametrize("name", SEEN_BY)
def test_a_config_is_sound_and_reads_back(name, tmp_path):
    rig = config(name)
    assert findings(rig) == []
    assert rig_on_machine(rig) is rig
    again = tmp_path / "again.toml"
    again.write_text(rig_to_toml(rig))
    assert_same_rig(load_rig(again), rig)


@pytest.mark.parametrize("name", SEEN_BY)
def test_every_wall_of_a_config_shows_what_the_reference_shows(name):
    rig = small(config(name))
    volume = cushion()
    transfer = psw.TransferFunction(SMOOTH)
    renderer = psw.Renderer(volume, transfer, psw.Settings(quality=2))
    head = rig.eyes.rest_pose
    maker = FrameMaker(renderer, rig.walls, room_from_world(rig, volume))
    frame = maker.make(head, eyes_of_head(head, rig.eyes))
    first = frame.pictures[0].eye
    pictures = [p for p in frame.pictures if p.eye == first or len(rig.walls) == 2]
    seen = []
    for picture in pictures:
        shown = renderer.warp(picture.image, picture.view)
        truth = psw.reference.render(volume, transfer, picture.view, tolerance=1e-4)
        if truth[..., 3].max() > 0:
            seen.append(picture.wall.name)
        assert psnr(shown, truth) > PICTURE_SMOOTH_DB, picture.wall.name
    assert tuple(dict.fromkeys(seen)) == SEEN_BY[name]
    assert frame.compositings == len({picture.eye for picture in frame.pictures})


def test_a_head_mounted_pair_goes_with_the_head():
    """Wherever the head is, the middle of the screens is half a metre before the nose."""
    rig = config("hmd")
    maker = FrameMaker(psw.Renderer(cushion(8)), small(rig).walls, np.eye(4))
    head = Pose((1, 2, 3), (0, np.sqrt(0.5), 0, np.sqrt(0.5)))  # looks along −x
    frame = maker.make(head, eyes_of_head(head, rig.eyes))
    assert [picture.eye for picture in frame.pictures] == ["left", "right"]
    walls = [picture.view.wall for picture in frame.pictures]
    centres = [(wall.lower_right + wall.upper_left) / 2 for wall in walls]
    np.testing.assert_allclose(np.mean(centres, 0), (0.5, 2, 3), atol=1e-12)
    assert centres[0][2] > centres[1][2]  # its left is at larger z


# --- recorded paths ---------------------------------------------------------------------------------------


def inside(points: np.ndarray, rig: Rig) -> np.ndarray:
    corners = rig.corners.reshape(-1, 3)
    return ((points > corners.min(0)) & (points < corners.max(0))).all(-1)


def heads_of(place: TrackerPlace, rows: np.ndarray) -> list[Pose]:
    return [place.room_from_head(Pose(row[:3], row[3:])) for row in rows]


def recording(name: str) -> np.ndarray:
    """(n, 7): position in metres and quaternion of every tenth sample."""
    path = DATA / "tracking" / name
    if not path.is_file():
        pytest.skip(f"{path} is absent; set PERSP_SW_DATA to the data folder")
    columns = ("x", "y", "z", "qx", "qy", "qz", "qw")
    table = np.genfromtxt(path, delimiter=",", names=True)
    return np.column_stack([table[column] for column in columns])[::10]


@pytest.mark.parametrize("name", ["optitrack-120hz.csv.gz", "hololens-200hz.csv.gz"])
def test_a_recorded_path_is_inside_the_cave_at_a_plausible_height(name):
    rig = config("cave4")
    heads = heads_of(rig.tracker_for(name), recording(name))
    eyes = np.array([eyes_of_head(head, rig.eyes) for head in heads])
    assert inside(eyes, rig).all(1).mean() >= INSIDE_SHARE
    assert ((eyes[..., 1] > 1.4) & (eyes[..., 1] < 1.9)).all(1).mean() >= INSIDE_SHARE
    upright = np.array([head.matrix[1, 1] for head in heads])
    assert (upright > np.cos(np.radians(45))).mean() >= INSIDE_SHARE


def test_the_optitrack_wearer_faces_the_front_wall_with_the_right_eye_on_the_right():
    rig = config("cave4")
    heads = heads_of(rig.tracker_for("optitrack-120hz.csv.gz"), recording("optitrack-120hz.csv.gz"))
    look = -np.mean([head.matrix[:3, 2] for head in heads], 0)
    assert np.degrees(np.arccos(-look[2] / np.linalg.norm(look))) < 10
    eyes = np.array([eyes_of_head(head, rig.eyes) for head in heads])
    assert (eyes[:, 1, 0] > eyes[:, 0, 0]).mean() >= INSIDE_SHARE


# The boxes of the two recordings, rounded outwards, as the comments of cave4.toml state them.
BOXES = {
    "optitrack-120hz.csv.gz": [(-0.384, 0.256), (0.585, 0.784), (-0.086, 0.227)],
    "hololens-200hz.csv.gz": [(-0.950, 1.970), (-0.055, 0.019), (-1.463, 2.685)],
}


def test_the_placed_recordings_are_centred_in_the_room():
    """Without the recordings: from their boxes alone."""
    rig = config("cave4")
    for name, box in BOXES.items():
        corners = np.array([[box[axis][n >> axis & 1] for axis in range(3)] for n in range(8)])
        matrix = rig.tracker_for(name).room_from_tracker
        placed = corners @ matrix[:3, :3].T + matrix[:3, 3]
        assert placed[:, 1].min() > 1.4 and placed[:, 1].max() < 1.9
        assert inside(placed.mean(0), rig)
    walk = rig.tracker_for("optitrack-120hz.csv.gz")
    box = np.array(BOXES["optitrack-120hz.csv.gz"]).T
    placed = box @ walk.room_from_tracker[:3, :3].T + walk.room_from_tracker[:3, 3]
    assert inside(placed, rig).all()


def test_the_caves_volume_stands_between_the_walls():
    for name in ("cave3", "cave4", "cube6"):
        rig = config(name)
        volume = cushion(8)
        assert inside(corners_in_room(room_from_world(rig, volume), volume), rig).all()
