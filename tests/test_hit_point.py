"""Where rays see what they see of a piece, and gradients there: twins, both kernels, and what it gains."""

from dataclasses import dataclass

import lit_twins
import numpy as np
import pytest
import twins
from test_composite import samples_in_packet
from test_lit import LOOKS, rendered
from test_packet_lit import LIGHT, level_of, lines
from test_packets import KINDS
from tolerances import HIT_PART, HIT_SHARE, LIT_PIECE_TWIN, PACKET_SLOPES
from views import DIRECTIONS, view_of

from persp_sw import Lighting, Look, Regions, Renderer, Settings, TransferFunction, Volume, reference
from persp_sw._jit import kernel
from persp_sw.kernels import hit_point, hit_point_vector
from persp_sw.kernels.packet_preintegrated_portable import STEPS
from persp_sw.kernels.state import (
    COSINE,
    LENGTH,
    LIGHT_SECTIONS,
    NEIGHBOURS,
    RAY_FAR,
    RAY_NEAR,
    SECOND,
    SECOND_END,
    TILE,
    VALUE,
    VALUE_END,
)
from persp_sw.kernels.tables import LitIntegralTable
from persp_sw.measure.cases import eye_path, transfer_for
from persp_sw.optics.classification import Classification
from persp_sw.optics.preintegration import Preintegration
from persp_sw.volume.gradient import FAINTEST, largest_magnitude, world_from_differences
from persp_sw.volume.levels import STANDARD_AXES, standard_rows
from persp_sw.volume.phantoms import synthetic_ct

AT = np.uint64(0)
HITS, SLOPES = LIGHT + COSINE, LIGHT + NEIGHBOURS
_vector_hits, _portable_hits = hit_point_vector.find_hit_points, hit_point.find_hit_points
_vector_slopes, _portable_slopes = hit_point_vector.find_slopes_at, hit_point.find_slopes_at


@kernel
def vector_hits(path, share, table, lanes, section):
    _vector_hits(TILE, path, share, table, lanes, AT, section, HITS)


@kernel
def portable_hits(path, share, table, lanes, section):
    _portable_hits(TILE, path, share, table, lanes, AT, section, HITS)


@kernel
def vector_slopes(start, begin, end, cell, y, z, x, step, low, high, path, level, lanes):
    _vector_slopes(TILE, start, begin, end, cell, y, z, x, step, low, high, path, level, lanes, HITS, SLOPES)


@kernel
def portable_slopes(start, begin, end, cell, y, z, x, step, low, high, path, level, lanes):
    _portable_slopes(
        TILE, start, begin, end, cell, y, z, x, step, low, high, path, level, lanes, HITS, SLOPES
    )


FIND_HITS = {"vector": vector_hits, "portable": portable_hits}
FIND_SLOPES = {"vector": vector_slopes, "portable": portable_slopes}


# --- The place --------------------------------------------------------------------------------------------


def test_places_are_where_the_sums_have_grown_so_far(rng):
    for _ in range(20):
        table = rng.random((int(rng.integers(3, 400)), 4)).astype(np.float32)
        table[rng.random(len(table)) < 0.4, 3] = 0
        table[0, 3], table[-1, 3] = 0, 0.5
        places = Preintegration.of(table).places
        passed = np.append(0, np.cumsum(table[:, 3].astype(float)))
        grown = np.interp(places, np.arange(len(passed)), passed)
        np.testing.assert_allclose(grown[:-1], np.linspace(0, passed[-1], STEPS + 1), atol=2e-4)
        rows = np.minimum(places[1:STEPS].astype(int), len(table) - 1)
        assert (table[rows, 3] > 0).all()
        assert places[STEPS] == places[STEPS + 1]


def integral_table(table):
    integrals = Preintegration.of(table)
    f, none = np.float32, np.zeros(0, np.float32)
    numbers = f(0), f(1), f(integrals.end), f(integrals.unit), f(integrals.steps)
    return LitIntegralTable(
        integrals.sums, integrals.beyond, *numbers, integrals.places, none, np.zeros((0, 13), f),
        np.zeros(1, np.uint16),
    )  # fmt: skip


@dataclass
class Pieces:
    """Sixteen pieces of rays and the borders of rows where they begin and end."""

    lanes: np.ndarray
    path: tuple
    share: tuple
    section: np.uint64

    @classmethod
    def random(cls, rng, last_row, section):
        lanes = np.full(int(LIGHT) + TILE * LIGHT_SECTIONS, np.nan, np.float32)
        near, far = 2.5, 3.5
        lines(lanes, LENGTH, 1)[0] = rng.uniform(0.5, 2, TILE)
        lines(lanes, RAY_NEAR, 1)[0] = rng.uniform(near - 0.5, near + 0.4, TILE)
        lines(lanes, RAY_FAR, 1)[0] = rng.uniform(far - 0.4, far + 0.5, TILE)
        borders = np.sort(rng.integers(-40, last_row + 40, (2, TILE)), axis=0)
        borders[1] = np.maximum(borders[1], borders[0] + 16)
        flipped = rng.random(TILE) < 0.5
        borders[:, flipped] = borders[::-1, flipped]
        lines(lanes, section, 1)[0] = borders[0]
        lines(lanes, SECOND_END if section == SECOND else VALUE_END, 1)[0] = borders[1]
        return cls(lanes, tuple(np.float32([0, 0, 0, 1, 3.0, near, far])), (0.7, 0.05), section)

    def found(self, kind, table):
        """Distances from the plane."""
        lanes, share = self.lanes.copy(), tuple(np.float32(self.share))
        FIND_HITS[kind](self.path, share, integral_table(table), lanes, self.section)
        result = lines(lanes, HITS, 1)[0].copy()
        lines(lanes, HITS, 1)[0] = np.nan
        np.testing.assert_array_equal(lanes, self.lanes)
        return result

    def expected(self, table):
        ends = SECOND_END if self.section == SECOND else VALUE_END
        borders = np.array([lines(self.lanes, at, 1)[0] for at in (self.section, ends)]).astype(int)
        lengths, nears, fars = (
            lines(self.lanes, at, 1)[0].astype(float) for at in (LENGTH, RAY_NEAR, RAY_FAR)
        )
        result = []
        for lane in range(TILE):
            one, other = borders[:, lane]
            covered = table[np.clip(np.arange(min(one, other), max(one, other)), 1, len(table) - 1), 3]
            covered = (covered if other > one else covered[::-1]).astype(float)
            begin, end = max(nears[lane], self.path[5]), min(fars[lane], self.path[6])
            share = self.share[0] + self.share[1] * (begin + end) / 2
            depth = covered.mean() * lengths[lane] * (end - begin) * share
            part = twins.hit_place(covered, depth) if covered.any() else 0.5
            result.append(begin + part * (end - begin) - self.path[4])
        return np.array(result)


@pytest.mark.parametrize("section", [VALUE, SECOND])
@pytest.mark.parametrize("thick", [0.01, 1.0, 30.0])
@pytest.mark.parametrize("kind", KINDS)
def test_hit_points_equal_the_twin(kind, thick, section, rng):
    """Rows before and after the table, too; of at least 16 rows a piece."""
    for _ in range(30):
        table = rng.uniform(0.5, 1, (120, 4)).astype(np.float32) * np.float32([1, 1, 1, thick])
        table[0] = 0
        pieces = Pieces.random(rng, 120, section)
        np.testing.assert_allclose(pieces.found(kind, table), pieces.expected(table), atol=HIT_PART)


@pytest.mark.parametrize("kind", KINDS)
def test_the_share_of_extinction_is_right_for_all_depths(kind, rng):
    for thick in (1e-6, 0.1, 1.0, 2.0, 3.0, 5.0, 10.0, 60.0):
        table = np.ones((200, 4), np.float32) * np.float32([1, 1, 1, thick])
        table[0] = 0
        pieces = Pieces.random(rng, 150, VALUE)
        np.testing.assert_allclose(pieces.found(kind, table), pieces.expected(table), atol=HIT_SHARE)


@pytest.mark.parametrize("kind", KINDS)
def test_where_nothing_is_seen_the_place_is_the_middle_of_what_is_left(kind, rng):
    table = np.zeros((50, 4), np.float32)
    pieces = Pieces.random(rng, 50, VALUE)
    lines(pieces.lanes, VALUE, 1)[0, :3] = np.nan
    begins, ends = (np.clip(lines(pieces.lanes, at, 1)[0], *pieces.path[5:]) for at in (RAY_NEAR, RAY_FAR))
    np.testing.assert_allclose(pieces.found(kind, table), (begins + ends) / 2 - pieces.path[4], atol=1e-6)


# --- Gradients there --------------------------------------------------------------------------------------


@pytest.mark.parametrize("wide", [False, True])
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
@pytest.mark.parametrize("kind", KINDS)
def test_slopes_at_hit_points_equal_the_twin(kind, dtype, wide, rng):
    beyond = 0
    for _ in range(30):
        shape = (*rng.integers(2, 9, 2), 100)
        data = rng.integers(0, 256, shape).astype(dtype)
        if dtype == np.float32:
            data[rng.random(shape) < 0.005] = np.nan
        width = int(rng.integers(34, 60) if wide else rng.integers(1, 28))
        begin = int(rng.choice([0, rng.integers(1, 98 - width), 99 - width]))
        j, k = (int(rng.integers(0, n - 1)) for n in shape[1::-1])
        y, z = j + rng.random(), k + rng.random()
        x, step = begin - rng.integers(0, 64) / 64, rng.integers(1, 64 * (width + 2) // (TILE - 1) + 2) / 64
        path = tuple(np.float32([*rng.integers(-64, 64, 2) / 64 / (1, 64), *rng.normal(size=2), 0, 0, 0]))
        ahead = (rng.integers(-32, 32, TILE) / 64).astype(np.float32)
        factor = tuple(rng.choice([1.0, 2.0], 3))
        lanes = np.full(int(LIGHT) + TILE * LIGHT_SECTIONS, -7.5, np.float32)
        lines(lanes, HITS, 1)[0] = ahead
        FIND_SLOPES[kind](
            float(begin), np.uint64(begin), np.uint64(begin + width), (np.uint64(j), np.uint64(k)), y, z, x,
            step, 0.0, 99.0, path, level_of(data, 1.0, factor), lanes,
        )  # fmt: skip
        found = lines(lanes, SLOPES, 3).copy()
        lane = np.arange(TILE)
        places = np.column_stack([
            x + step * lane + (path[0] + path[1] * lane) * ahead, y + path[2] * ahead, z + path[3] * ahead
        ])  # fmt: skip
        column = np.floor(np.clip(x + step * lane, begin, begin + width - 0.001))
        cells = np.column_stack([column, np.full(TILE, j), np.full(TILE, k)])
        beyond += (places != np.clip(places, cells, cells + 1)).any(0)
        places = np.clip(places, cells, cells + 1)
        for l in range(TILE):  # noqa: E741
            around = data[tuple(slice(max(int(c) - 1, 0), int(c) + 3) for c in cells[l, ::-1])].astype(float)
            expected = lit_twins.slopes(data, places[l], 1.0) / factor
            if np.isfinite(around).all():
                np.testing.assert_allclose(found[:, l], expected, atol=256 * PACKET_SLOPES)
            elif np.isnan(data[tuple(slice(int(c), int(c) + 2) for c in cells[l, ::-1])]).any():
                assert np.isnan(found[:, l]).any()
        lines(lanes, SLOPES, 3)[:], lines(lanes, HITS, 1)[:] = -7.5, -7.5
        assert (lanes == -7.5).all()
    assert (beyond > 10).all()


# --- Pictures ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("samples", [1, 2])
@pytest.mark.parametrize("look", ["headlight", "lights"])
def test_lit_pieces_equal_their_twin(look, samples, rng):
    """Where no gradient is faint: there, a little further on, a normal may be another."""
    z, y, x = np.indices((9, 10, 11))
    volume = Volume((14 * np.sqrt((x + 3) ** 2 + (y + 4) ** 2 + (z + 2.0) ** 2)).astype(np.float32))
    look, transfer = LOOKS[look], TransferFunction([(0, (1, 0.7, 0.4), 0.1), (255, (1, 0.7, 0.4), 0.9)], 1.0)
    regions = Regions(crop=(0, 8.9, 1.2, 9, 0, 8))
    low, high = regions.box(volume)
    classification = Classification.of(transfer, volume)
    largest = largest_magnitude(volume, 1.0)
    for towards in DIRECTIONS[:5]:
        view = view_of(volume, towards, distance=1.5, size=(10, 8))
        mode = {"samples_per_interval": samples, "preintegrated": True, "single_face_tangent": 8}
        image = rendered(volume, transfer, view, look, regions, **mode)
        eye = np.linalg.solve(volume.world_from_object, (*image.eye.position, 1))[:3]
        for number, face in enumerate(image.faces):
            axes = list(STANDARD_AXES[face.axis])
            linear = volume.world_from_object[:3, axes]
            rows, pixels = standard_rows(volume, face.axis), image.face_pixels(number)
            for v, u in rng.integers(0, pixels.shape[:2], (20, 2)):
                t = np.array(face.origin) + (np.array([u, v]) + 0.5) * face.pitch
                sight = -(linear @ [*t, face.sign])
                sight /= np.linalg.norm(sight)

                def lit(place, cell, colour, rows=rows, axes=axes, sight=sight):
                    place = np.clip(place, cell, np.array(cell) + 1.0)
                    slopes = lit_twins.slopes(rows.transpose(1, 0, 2), place, 1.0)
                    gradient = world_from_differences(volume)[:, axes] @ slopes
                    factor, shine = lit_twins.phong(look.lighting, gradient, sight, FAINTEST * largest)
                    return colour * factor + shine

                expected = twins.preintegrated_pixel(
                    rows, (*eye[axes], face.sign, *t, 0.0), np.column_stack([low, high])[axes].ravel(),
                    regions.half_spaces(volume)[:, [*axes, 3]], linear.T @ linear,
                    samples_in_packet(face, u, v, samples), classification.table, classification.origin,
                    classification.scale, lit,
                )  # fmt: skip
                assert np.abs(pixels[v, u] - expected).max() < LIT_PIECE_TWIN, (number, u, v)


def test_surfaces_are_lit_where_they_are_hit():
    """A hard surface, magnified: 36.4 dB lit in the middle of pieces, 38.6 dB where they are hit."""
    volume = synthetic_ct(128)
    view = eye_path(volume, "corner", (96, 96), frames=0)[0]
    transfer, look = transfer_for("ct", "surface", volume), Look(Lighting())
    truth = reference.render(volume, transfer, view, look=look, tolerance=1e-3)
    settings = Settings(quality=4, residual=0, samples_per_interval=1, preintegrated=True)
    picture = Renderer(volume, transfer, settings, look=look).render(view)
    assert truth[..., 3].max() > 0.99
    assert -10 * np.log10(np.mean((picture - truth) ** 2)) > 38
