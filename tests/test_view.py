"""Eyes, walls, views and regions: what is refused at the door, and that projection is the rays' inverse."""

import numpy as np
import pytest

from persp_sw import Eye, Regions, View, Wall
from persp_sw.errors import ViewError

GOOD = {"eye": (0, 0, 5), "centre": (0, 0, 0), "up": (0, 1, 0), "fovy_deg": 40, "size": (10, 8)}


@pytest.mark.parametrize(
    "change, message",
    [
        ({"size": (10, 0)}, "pixels"),
        ({"size": (10,)}, "pixels"),
        ({"size": "ab"}, "pixels"),
        ({"size": (10.5, 3)}, "pixels"),
        ({"size": (np.inf, 3)}, "pixels"),
        ({"size": (100000, 3)}, "pixels"),
        ({"fovy_deg": "40"}, "fovy"),
        ({"fovy_deg": None}, "fovy"),
        ({"fovy_deg": 180}, "fovy"),
        ({"fovy_deg": np.nan}, "fovy"),
        ({"eye": (0, 0, 0)}, "same point"),
        ({"eye": (0, np.nan, 0)}, "eye"),
        ({"up": (0, 0, 1)}, "parallel"),
        ({"up": (0, 0, 0)}, "parallel"),
        ({"centre": "abc"}, "centre"),
        ({"near": -1}, "near"),
        ({"near": "1"}, "near"),
    ],
)
def test_impossible_cameras_are_refused(change, message):
    View.look_at(**GOOD)
    with pytest.raises(ViewError, match=message):
        View.look_at(**{**GOOD, **change})


def test_a_wall_seen_edge_on_and_a_wall_without_area_are_refused():
    wall = Wall((-1, -1, 0), (1, -1, 0), (-1, 1, 0), (4, 4))
    with pytest.raises(ViewError, match="edge-on"):
        View.through_wall((5, 3, 0), wall)
    with pytest.raises(ViewError, match="one line"):
        Wall((0, 0, 0), (1, 0, 0), (2, 0, 0), (4, 4))


@pytest.mark.parametrize(
    "regions",
    [{"clip": 5}, {"clip": "abc"}, {"clip": [(0, 0, 0, 1)]}, {"clip": [(1, 2)]}, {"crop": (1, 0, 0, 5, 0, 5)},
     {"crop": (0, 5)}, {"crop": (0, np.nan, 0, 5, 0, 5)}],
)  # fmt: skip
def test_impossible_regions_are_refused(regions):
    with pytest.raises(ViewError):
        Regions(**regions)


def test_projection_is_the_pixel_whose_ray_meets_the_point():
    view = View.look_at((3, 2, 9), (0.5, 0, 1), (0.1, 1, 0), 50, (32, 20))
    points = view.eye.position + view.directions() * 2.7
    column, row = np.meshgrid(np.arange(32) + 0.5, np.arange(20) + 0.5)
    np.testing.assert_allclose(view.project(points), np.stack([column, row], -1), atol=1e-9)
    assert np.isnan(view.project(view.eye.position - view.directions()[0, 0])).all()
    assert Eye((0, 0, 0)).near == 0
