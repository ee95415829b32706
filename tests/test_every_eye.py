"""Eyes inside the volume, on its sides, edges, corners and slice planes, and on the way through them."""

import numpy as np
import pytest
from exact_faces import COLOUR, VALUE, assert_covered, assert_exact
from views import random_pose

from persp_sw import Regions, Renderer, Settings, TransferFunction, View, Volume, Wall

SHAPES = [(2, 2, 2), (5, 9, 7), (17, 4, 12), (2, 2, 300)]  # x, y, z
PLACES = ["anywhere", "voxel", "slice", "side", "edge", "corner", "just inside"]
SMOOTH = TransferFunction([(0, (0.2, 0.4, 0.9), 0), (90, (0.9, 0.6, 0.3), 0.05), (255, (1, 1, 1), 0.3)])


def eye_inside(rng, place, size):
    """A random object-space eye in the box of voxel centres of a volume of that size."""
    high = np.array(size) - 1.0
    eye = high * rng.random(3)
    ends = np.where(rng.random(3) < 0.5, 0, high)
    axis = rng.integers(3)
    if place == "voxel":
        eye = np.rint(eye)
    elif place == "slice":
        eye[axis] = np.rint(eye[axis])
    elif place == "side":
        eye[axis] = ends[axis]
    elif place == "edge":
        eye = np.where(np.arange(3) == axis, eye, ends)
    elif place == "corner":
        eye = ends
    elif place == "just inside":
        eye = np.abs(ends - 10.0 ** rng.choice([-12, -9, -6, -3, -1]))
    return eye


def room_of(eye, reach=20.0, pixels=24):
    """Six walls around the eye: every direction is on one of them."""
    walls = []
    for forward in (*np.eye(3), *-np.eye(3)):
        right = np.roll(forward, 1)
        up = np.cross(right, forward)
        corners = [eye + reach * (forward + x * right + y * up) for x, y in ((-1, -1), (1, -1), (-1, 1))]
        walls.append(Wall(*corners, pixels=(pixels, pixels)))
    return walls


# --- Exact ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", SHAPES)
@pytest.mark.parametrize("place", PLACES)
def test_a_homogeneous_box_is_exact_and_covered_from_inside(place, size):
    """Every pixel of every face, all around the eye and through narrow and wide views."""
    rng = np.random.default_rng([11, *size, PLACES.index(place)])
    high = np.array(size) - 1.0
    decided = undecided = 0
    for _ in range(6):
        pose = random_pose(rng, spacing=10.0 ** rng.uniform(-1, 1, 3), mirrored=rng.random() < 0.5)
        volume = Volume(np.full(size[::-1], VALUE, np.uint8), world_from_object=pose)
        transfer = TransferFunction([(VALUE, tuple(COLOUR), 0.3)], np.mean(volume.spacing))
        eye, target = eye_inside(rng, place, size), high * rng.random(3)
        position, centre = (pose[:3, :3] @ p + pose[:3, 3] for p in (eye, target))
        near = rng.choice([0, 0, 0.3]) * np.linalg.norm(centre - position)
        view = View.look_at(position, centre, rng.normal(size=3), rng.choice([20, 80, 150]), (20, 16), near)
        walls = [view.wall] if rng.random() < 0.5 else room_of(position)
        settings = Settings(
            residual=0,
            quality=float(rng.choice([0.3, 1, 2])),
            samples_per_interval=[None, 1, 2, 4][rng.integers(4)],
            single_face_tangent=float(rng.choice([1, 3, 8])),
        )
        image = Renderer(volume, transfer, settings).composite(view.eye, walls)
        counts = assert_exact(image, volume, Regions(), transfer.extinction(VALUE))
        decided, undecided = decided + counts[0], undecided + counts[1]
        for wall in walls:
            assert_covered(image, volume, View.through_wall(view.eye, wall))
    assert decided > 10 * undecided
