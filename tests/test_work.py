"""Work that is not done: what is hidden, empty, or behind a part that lets nothing through."""

from __future__ import annotations

import numpy as np
import pytest
from views import DIRECTIONS, view_of

from persp_sw import Eye, Regions, Renderer, Settings, TransferFunction, Volume, compositor
from persp_sw.kernels.scanline import Level, plane_range
from persp_sw.measure.cave import four_walls, placed
from persp_sw.volume.phantoms import synthetic_ct

# Fog below 200; above it opaque within a voxel.
ROWS = [(0, (0, 0, 1), 0), (150, (0, 1, 0), 0.05), (200, (1, 0, 0), 0.05), (201, (1, 0, 0), 0.9999)]
FOG = TransferFunction(ROWS, 1.0)


def samples(volume, regions=None, towards=(0.1, 0.05, 1), fovy=12, **settings):
    """A view so narrow that all it shows lies behind the front side's middle."""
    view = view_of(volume, np.array(towards) / np.linalg.norm(towards), distance=2.5, fovy=fovy)
    renderer = Renderer(volume, FOG, Settings(**settings), regions)
    return renderer.composite(view.eye, [view.wall]).samples


@pytest.mark.parametrize("axis", range(3))
def test_what_a_wall_hides_is_not_sampled(axis):
    noise = np.random.default_rng(0).integers(20, 150, (64, 64, 64)).astype(np.uint8)
    walled = noise.copy()
    walled[-5:] = 255
    alone = np.zeros_like(walled)
    alone[-5:] = 255
    alone[:2, ::63, ::63] = 150  # so that what can be seen, which bounds the face, is the same box
    towards = np.roll([0.1, 0.05, 1], axis + 1)  # on the wall's side
    hidden, wall, open_ = (
        samples(Volume(np.ascontiguousarray(np.moveaxis(data, 0, 2 - axis))), towards=towards)
        for data in (walled, alone, noise)
    )
    assert 0 < hidden <= 1.05 * wall
    assert open_ > 5 * hidden


@pytest.mark.parametrize("towards", DIRECTIONS)
def test_empty_space_around_the_volume_costs_no_sample(towards):
    data = np.zeros((25, 25, 25), np.uint8)  # whole blocks of 4 cells, and so is what surrounds it
    data[2:-2, 2:-2, 2:-2] = np.random.default_rng(1).integers(20, 150, (21, 21, 21))
    padded = Volume(np.pad(data, 16), world_from_object=translation(-16))
    view = view_of(Volume(data), towards)
    tight, loose = (Renderer(v, FOG).composite(view.eye, [view.wall]) for v in (Volume(data), padded))
    # Fewer, where a tile beside the box looks up its border.
    assert 0.95 * tight.samples < loose.samples <= tight.samples


def translation(by):
    pose = np.eye(4)
    pose[:3, 3] = by
    return pose


def test_parts_behind_an_opaque_part_are_not_sampled():
    """A slab is left out of a block: the part in front of it is opaque, the fog behind is not looked at."""
    data = np.random.default_rng(0).integers(20, 150, (64, 64, 64)).astype(np.uint8)
    fog = Volume(data)
    walled = data.copy()
    walled[-8:] = 255
    gap = {"plane": (0, 0, 1, -40), "thickness": 10.0, "show": "outside"}
    cut = Regions(cut=[gap])
    front = Regions(cut=[gap], clip=[(0, 0, 1, -40)])
    both, alone = (samples(Volume(walled), regions) for regions in (cut, front))
    assert 0 < both <= 1.05 * alone
    assert samples(fog, cut) > 5 * both


# --- Planes -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("per_interval", [1, 2, 4])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_planes_of_a_scanline_are_those_whose_interval_meets_what_is_seen(sign, per_interval, rng):
    slices, factor = 40, np.array([1.0, 2.0, 2.0])
    none = np.zeros((1, 1, 1), np.uint64)
    met = 0
    for _ in range(200):
        j_0, j_1 = np.sort(rng.uniform(0, 30, 2))
        k_0, k_1 = np.sort(rng.uniform(0, slices - 1, 2))
        t_j, offset_j, e_k = rng.uniform(-0.5, 0.5), rng.uniform(-5, 65), 39 - sign * rng.uniform(0, 99)
        limits = np.array([rng.uniform(0, 60), rng.uniform(60, 150)])
        level = Level(
            none, none, none, none.astype(np.int64), np.zeros(64, np.uint8), factor, 1 / factor,
            np.array([0, 30.0, 0, 30, 0, slices - 1]), np.array([j_0, j_1, k_0, k_1]), slices, 31,
        )  # fmt: skip
        face = np.zeros(11)
        face[6], face[7] = e_k, sign
        first, end = plane_range(t_j, offset_j, face, limits, per_interval, level)
        # The scanline's sheet is seen at these distances, found by trying many.
        tried = np.linspace(limits[0], limits[1], 4001)
        j, k = (offset_j + t_j * tried) / factor[1], (e_k + sign * tried) / factor[2]
        seen = tried[(j >= j_0) & (j <= j_1) & (k >= k_0) & (k <= k_1)]
        wanted = set()
        for q in range((slices - 1) * per_interval + 1):
            slice_ = q / per_interval if sign > 0 else slices - 1 - q / per_interval
            distance = sign * (slice_ * factor[2] - e_k)
            if (np.abs(seen - distance) < factor[2] / 2).any():
                wanted.add(q)
        met += len(wanted)
        assert wanted <= set(range(first, end))
        assert end - first <= len(wanted) + 2 if wanted else end - first <= 2 * per_interval
    assert met > 300 * per_interval


def test_what_zones_and_faces_have_in_common_is_prepared_once(monkeypatch):
    made = []
    level = compositor._level
    monkeypatch.setattr(compositor, "_level", lambda _, *which: made.append(which) or level(_, *which))
    renderer = Renderer(placed(synthetic_ct(64)), FOG, Settings(quality=0.25))
    image = renderer.composite(Eye((0.05, 1.5, -0.2)), four_walls(64))
    assert len(image.faces) == 6
    assert {number for _, number, *_ in made} >= {0, 1}  # zones blend each two levels
    assert len(made) == len(set(made))
