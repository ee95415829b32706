"""What two eyes see of one point: disparity on every wall against plain geometry, by both warps."""

from __future__ import annotations

import numpy as np
import pytest
from test_frame import cave

import persp_sw as psw
from vr_plugin.cave.wall_pictures import SoftwareDrawer, TextureDrawer
from vr_plugin.eyes import eyes_of_head
from vr_plugin.frame import FrameMaker
from vr_plugin.pose import Pose, turn_about
from vr_plugin.rig import Eyes

# The centroid of a bright voxel's footprint: its tent is symmetric along the ray's planes but for perspective
# across one voxel, 1/64 of the depth here, of a footprint of some 5 pixels; the bilinear look-up of the eye
# image, four pixels a voxel, spreads evenly.
CENTROID_PIXELS = 0.15

VOXEL = 16


def marker_maker() -> FrameMaker:
    """One bright voxel in the middle of 33³, a metre of volume in the middle of the room."""
    data = np.zeros((2 * VOXEL + 1,) * 3, np.uint8)
    data[VOXEL, VOXEL, VOXEL] = 255
    volume = psw.Volume(data)
    transfer = psw.TransferFunction([(0, (1, 1, 1), 0), (255, (1, 1, 1), 0.2)])
    renderer = psw.Renderer(volume, transfer, psw.Settings(quality=4, samples_per_interval=4))
    matrix = np.diag([1 / 32, 1 / 32, 1 / 32, 1.0])
    matrix[:3, 3] = np.array([0, 1.5, 0]) - 0.5
    return FrameMaker(renderer, cave(pixels=256).walls, matrix)


def centroid(picture: np.ndarray) -> np.ndarray:
    weight = picture[..., 3].astype(float)
    rows, columns = np.indices(weight.shape) + 0.5
    return np.array([(columns * weight).sum(), (rows * weight).sum()]) / weight.sum()


def on_wall(eye: np.ndarray, point: np.ndarray, wall: psw.Wall) -> np.ndarray:
    """Pixel (column, row) where the line from the eye through the point meets the wall; NaN: behind it."""
    across, up = wall.lower_right - wall.lower_left, wall.upper_left - wall.lower_left
    a, b, t = np.linalg.solve(np.column_stack([across, up, eye - point]), eye - wall.lower_left)
    width, height = wall.pixels
    return np.array([a * width, (1 - b) * height]) if t > 0 else np.full(2, np.nan)


@pytest.mark.parametrize("warp", ["software", pytest.param("texture", marks=pytest.mark.gl)])
def test_a_point_is_where_geometry_says_for_both_eyes(warp):
    maker = marker_maker()
    drawer = TextureDrawer() if warp == "texture" else SoftwareDrawer(maker.renderer)
    point = np.array([0, 1.5, 0.0])
    seen = {}
    try:
        for position, turn in (((0.2, 1.7, 1.2), 0.0), ((1.1, 1.4, 0.6), 0.7), ((-0.3, 2.4, 0.5), -0.4)):
            head = Pose(position, turn_about((0, 1, 0), turn))
            right = np.array([np.cos(turn), 0, -np.sin(turn)])
            eyes = {"left": position - 0.032 * right, "right": position + 0.032 * right}
            frame = maker.make(head, eyes_of_head(head, Eyes()))
            pictures = drawer.draw(frame).pictures
            found = {}
            for picture in frame.pictures:
                expected = on_wall(eyes[picture.eye], point, picture.wall.wall)
                inside = (expected > 12).all() and (expected < 244).all()
                if not inside:
                    continue
                at = centroid(pictures[picture.wall.name, picture.eye])
                assert np.abs(at - expected).max() < CENTROID_PIXELS, (picture.wall.name, picture.eye)
                found.setdefault(picture.wall.name, {})[picture.eye] = at, expected
            for wall, both in found.items():
                if len(both) == 2:
                    measured, geometric = (both["left"][n][0] - both["right"][n][0] for n in (0, 1))
                    assert abs(measured - geometric) < CENTROID_PIXELS
                    seen[wall] = max(seen.get(wall, 0.0), abs(geometric))
    finally:
        drawer.close()
    assert seen["front"] > 2  # pixels: there is something to measure
    assert len(seen) >= 2
