"""Marks: where they are, and what they look like through a volume whose light is known."""

from __future__ import annotations

import numpy as np
import pytest
from tolerances import MARK_FLOAT32, MARK_INK
from views import DIRECTIONS, random_pose, view_of

import persp_sw as psw
from persp_sw.errors import TransferFunctionError, ViewError
from persp_sw.volume.phantoms import constant, synthetic_ct

m = psw.marks
FOG = psw.TransferFunction([(0, (1, 0.5, 0.2), 0.3)], 1.0)
TAU = -np.log(0.7)


def patient(rng: np.random.Generator, orientation: str = "LPS") -> psw.Volume:
    pose = random_pose(rng, spacing=(1, 2, 0.5))
    return psw.Volume(np.zeros((9, 6, 12)), world_from_object=pose, orientation=orientation)


def ends(lines) -> np.ndarray:
    return np.array([(line.start, line.end) for line in lines])


def in_object(volume: psw.Volume, points: np.ndarray) -> np.ndarray:
    inverse = np.linalg.inv(volume.world_from_object)
    return np.asarray(points) @ inverse[:3, :3].T + inverse[:3, 3]


# --- Where they are -----------------------------------------------------------------------------------------


def test_the_box_has_the_edges_of_the_voxel_centres(rng: np.random.Generator):
    volume = patient(rng)
    edges = in_object(volume, ends(m.bounding_box(volume).lines))
    assert len(edges) == 12
    corners, counts = np.unique(np.round(edges.reshape(-1, 3), 6), axis=0, return_counts=True)
    assert len(corners) == 8 and (counts == 3).all()
    np.testing.assert_allclose(corners[[0, -1]], [(0, 0, 0), (11, 5, 8)], atol=1e-6)
    assert ((np.abs(np.diff(edges, axis=1)) > 1e-9).sum(-1) == 1).all()


def test_axes_start_at_the_first_voxel_in_red_green_blue(rng: np.random.Generator):
    volume = patient(rng)
    marks = m.axes(volume)
    for axis, line in enumerate(marks.lines):
        start, end = in_object(volume, [line.start, line.end])
        np.testing.assert_allclose(start, 0, atol=1e-9)
        assert end[axis] > volume.size[axis] - 1
        np.testing.assert_allclose(np.delete(end, axis), 0, atol=1e-9)
        assert int(np.argmax(line.colour)) == axis
    assert [label.text for label in marks.labels] == ["x", "y", "z"]


@pytest.mark.parametrize(("orientation", "opposite"), [("LPS", "RAI"), ("RIA", "LSP")])
def test_patients_letters_stand_at_their_sides(rng: np.random.Generator, orientation: str, opposite: str):
    volume = patient(rng, orientation)
    labels = {label.text: in_object(volume, label.point) for label in m.orientation_letters(volume).labels}
    last = np.array(volume.size) - 1
    assert set(labels) == set(orientation + opposite)
    for axis in range(3):
        assert labels[orientation[axis]][axis] > last[axis]
        assert labels[opposite[axis]][axis] < 0
        for place in (labels[orientation[axis]], labels[opposite[axis]]):
            np.testing.assert_allclose(np.delete(place, axis), np.delete(last / 2, axis), atol=1e-9)
    assert not m.orientation_letters(constant((4, 4, 4), 1.0)).labels


def test_a_cursor_opens_around_its_point(rng: np.random.Generator):
    volume = patient(rng)
    at = np.array([3.0, 4.0, 2.5])
    matrix = volume.world_from_object
    point = matrix[:3, :3] @ at + matrix[:3, 3]
    marks = m.cursor(volume, point)
    lines = in_object(volume, ends(marks.lines))
    assert len(lines) == 6 and not marks.sheets
    for (start, end), axis in zip(lines, np.repeat(range(3), 2), strict=True):
        for place in (start, end):
            np.testing.assert_allclose(np.delete(place, axis), np.delete(at, axis), atol=1e-9)
        assert end[axis] == pytest.approx(0, abs=1e-9) or end[axis] == pytest.approx(volume.size[axis] - 1)
        gap = abs(start[axis] - at[axis]) * volume.spacing[axis]
        assert gap == pytest.approx(0.03 * max(volume.extent))
    outside = m.cursor(volume, matrix[:3, :3] @ (30.0, 4.0, -9.0) + matrix[:3, 3])
    assert in_object(volume, ends(outside.lines))[..., 0].max() == pytest.approx(11)
    with pytest.raises(ViewError, match="a cursor"):
        m.cursor(volume, (0, np.nan, 0))


def test_a_cursors_planes_cut_the_box_at_its_point(rng: np.random.Generator):
    volume = patient(rng)
    at = np.array([3.0, 4.0, 2.5])
    matrix = volume.world_from_object
    marks = m.cursor(volume, matrix[:3, :3] @ at + matrix[:3, 3], planes=True)
    assert len(marks.sheets) == 12
    areas = np.zeros(3)
    for sheet in marks.sheets:
        far = in_object(volume, sheet.corner + sheet.edges.sum(0)) - at
        axis = int(np.argmin(np.abs(far)))
        assert far[axis] == pytest.approx(0, abs=1e-9)
        assert int(np.argmax(sheet.colour)) == axis
        areas[axis] += np.linalg.norm(np.cross(*sheet.edges))
    x, y, z = volume.extent
    np.testing.assert_allclose(areas, (y * z, x * z, x * y), rtol=1e-9)


def views_of_bars(volume: psw.Volume):
    yield view_of(volume, DIRECTIONS[0], size=(300, 200)), volume.centre
    yield view_of(volume, DIRECTIONS[1], size=(120, 200)), volume.centre + 5 * DIRECTIONS[1]
    towards = volume.centre + DIRECTIONS[2]
    yield psw.View.parallel(towards, volume.centre, (0, 1, 0), 37.0, (300, 200)), volume.centre
    corners = volume.centre + np.array([(-20, -9, -30), (31, -9, -30), (-20, 22, -30)])
    wall = psw.Wall(*corners, pixels=(510, 310))
    yield psw.View.through_wall(volume.centre + (14, 2, 20), wall), volume.centre


@pytest.mark.parametrize("number", range(4))
def test_a_scale_bar_is_as_long_as_it_says_at_its_depth(number: int):
    volume = constant((30, 20, 25), 1.0)
    view, pivot = list(views_of_bars(volume))[number]
    marks = m.scale_bar(view, pivot, "mm")
    bar = marks.lines[0]
    length = np.linalg.norm(bar.end - bar.start)
    assert marks.labels[0].text == m.length_text(length, "mm")
    mantissa = length / 10 ** np.floor(np.log10(length * (1 + 1e-9)))
    assert min(abs(mantissa - step) for step in (1, 2, 5)) < 1e-9
    # A ruler of that length at the pivot has as many pixels.
    across = view.wall.lower_right - view.wall.lower_left
    across = across / np.linalg.norm(across)
    place = view.project(np.array([pivot, pivot + length * across]))
    pixels = view.project(np.array([bar.start, bar.end]))
    assert np.linalg.norm(pixels[1] - pixels[0]) == pytest.approx(np.linalg.norm(place[1] - place[0]))
    w = view.viewport_from_world[2]
    assert w @ (*bar.start, 1) == pytest.approx(w @ (*pivot, 1))
    # The longest such that is no more than a fifth of the picture.
    share = (pixels[1] - pixels[0])[0] / view.size[0]
    assert 0.2 / 2.5 <= share <= 0.2 * (1 + 1e-9)
    assert (pixels > 0).all() and (pixels < view.size).all()


def test_a_scale_bar_behind_the_eye_is_refused():
    view = view_of(constant((8, 8, 8), 1.0), DIRECTIONS[0])
    with pytest.raises(ViewError, match="behind it"):
        m.scale_bar(view, 2 * view.eye.position, "mm")


def test_a_ruler_tells_the_distance():
    marks = m.ruler((1, 2, 3), (4, 6, 15), "mm")
    assert marks.labels[0].text == "13 mm"
    np.testing.assert_allclose(marks.labels[0].point, (2.5, 4, 9))
    assert {line.veiled for line in marks.lines} == {True, False}


@pytest.mark.parametrize(
    ("most", "length"), [(1, 1), (1.99, 1), (2, 2), (4.9, 2), (73, 50), (0.0031, 0.002), (1e-9, 1e-9)]
)
def test_round_lengths(most: float, length: float):
    assert m.round_length(most) == pytest.approx(length, rel=1e-12)


def test_ticks_are_round_and_within():
    assert m.ticks(-0.2, 10, 5) == [0, 2, 4, 6, 8, 10]
    assert m.ticks(-1000, 3000, 5) == [-1000, 0, 1000, 2000, 3000]
    assert m.ticks(3, 3, 5) == [3]
    assert all(len(m.ticks(0, high, 6)) <= 7 for high in np.geomspace(1e-3, 1e3, 50))


def test_numbers_for_people():
    numbers = (0, 1350, 12.5, 0.02, 99.96, 2e6, -600, 1 / 3)
    assert [m.short(n) for n in numbers] == ["0", "1350", "12.5", "0.02", "100", "2e+06", "-600", "0.333"]


def test_choices_name_their_marks(rng: np.random.Generator):
    volume = patient(rng)
    view = view_of(volume, DIRECTIONS[0])
    assert not m.MarkChoice()
    assert not m.MarkChoice().of_view(volume, view).lines
    every = m.MarkChoice(
        box=True,
        axes=True,
        scale_bar=True,
        cursor=tuple(volume.centre),
        planes=True,
        ruler=((0, 0, 0), (1, 0, 0)),
    )
    marks = every.of_view(volume, view)
    assert len(marks.lines) == 12 + 3 + 3 + 6 + 12 + 2
    assert {label.text for label in marks.labels} >= {"x", "L", "S", "1 mm"}
    assert len(every.in_world(volume).lines) == len(marks.lines) - 3


# --- Legends and windows ------------------------------------------------------------------------------------


def test_a_legend_has_the_functions_colours():
    transfer = psw.TransferFunction(
        [(10, (0, 0.2, 0.9), 0), (40, (0.7, 0.3, 0), 0.1), (40, (0, 1, 0), 0.5), (90, (1, 1, 1), 0.9)], 1.0
    )
    legend = m.legend(transfer, (0.0, 200.0), 150)
    bar = legend.picture[slice(*legend.rows), slice(*legend.columns)]
    assert bar.shape[0] == len(legend.values) == 150
    assert (np.diff(legend.values) < 0).all()
    assert legend.values[0] == pytest.approx(98, abs=1) and legend.values[-1] == pytest.approx(2, abs=1)
    middle = bar[:, bar.shape[1] // 2]
    marked = (
        np.abs(legend.values[:, None] - transfer.values).min(1) < 0.5
    )  # borders lie beside, not on, colours
    assert marked.any()
    np.testing.assert_allclose(middle[:, :3], transfer.colour(legend.values), atol=1e-7)
    np.testing.assert_array_equal(middle[:, 3], 1)
    # The curve is the wider the more opaque.
    curve = legend.picture[slice(*legend.rows), : legend.columns[0] - 1, 0]
    ink = (curve > 0.2).sum(1)
    opaque, faint = ink[np.argmin(abs(legend.values - 89))], ink[np.argmin(abs(legend.values - 39))]
    assert opaque > 2 * faint > 0
    assert ink[np.argmin(abs(legend.values - 5))] == 0


@pytest.mark.parametrize("palette", [(0, 0, 0), (1, 1, 1)])
@pytest.mark.parametrize("values", [(0.0, 1.0), (5.0, 5.0), (-3e4, 3e4), (200.0, 300.0)])
def test_legends_of_any_range(values: tuple[float, float], palette: tuple):
    legend = m.legend(FOG, values, 40, palette=m.Palette.over(palette))
    assert np.isfinite(legend.picture).all()
    assert (legend.picture[..., :3] <= legend.picture[..., 3:] + 1e-6).all()
    assert legend.picture[..., 3].max() == 1


def test_a_window_is_a_ramp_between_its_borders():
    transfer = psw.window_level(40, 400, opacity=0.3, opacity_unit=2.0)
    values = [-200, -160, -60, 40, 240, 300]
    expected = np.clip((np.array(values) + 160) / 400, 0, 1)
    np.testing.assert_allclose(transfer.colour(values), np.repeat(expected[:, None], 3, 1), atol=1e-12)
    np.testing.assert_allclose(transfer.opacity(values), 0.3 * expected, atol=1e-12)
    assert transfer.opacity_unit == 2.0
    assert psw.window_of(transfer) == pytest.approx((40, 400))
    assert psw.CT_WINDOWS["lung"] == (-600, 1500)
    for wrong in ({"width": 0}, {"width": -5}, {"level": np.nan}):
        with pytest.raises(TransferFunctionError, match="window"):
            psw.window_level(**{"level": 0, "width": 1, **wrong})


def test_legends_of_windows_mark_their_borders():
    legend = m.legend(psw.window_level(0, 100), (-1000.0, 1000.0), 120, 12)
    right = legend.picture[slice(*legend.rows), legend.columns[1] + 5, 1]
    rows = np.flatnonzero(right > 0.8)
    for value in (-50, 50):
        assert np.abs(rows - np.argmin(abs(legend.values - value))).min() <= 1


# --- What they look like ------------------------------------------------------------------------------------


def parallel(volume: psw.Volume, size=(60, 40), height=40.0):
    return psw.View.parallel(volume.centre + (0, 0, 1), volume.centre, (0, 1, 0), height, size)


@pytest.mark.parametrize("depth", [-20.0, 0.0, 6.0, 30.0])
def test_a_line_in_fog_has_the_colour_of_the_formula(depth: float):
    """(1 − a)·V + a·(F + T·c), all of which are known in a homogeneous box: behind it, in it, before it."""
    volume = constant((20, 20, 20), 1.0)
    view = parallel(volume)
    image = psw.Renderer(volume, FOG, psw.Settings(residual=0)).render(view)
    colour, a = np.array([0.1, 0.9, 0.4]), 0.6
    z = volume.centre[2] + depth
    line = m.Line(np.array([2.0, 9.5, z]), np.array([15.0, 9.5, z]), tuple(colour), 3.0, a)
    probe = psw.Probe(volume, FOG, residual=0)
    out = m.painted(image, view, m.Marks(lines=[line]), probe)
    before = np.clip(19 - z, 0, 19)
    clear = np.exp(-TAU * before)
    front = (1 - clear) * np.array([1, 0.5, 0.2])
    row, columns = 20, slice(23, 35)  # their centres are within a pixel of the line's middle
    expected = (1 - a) * image[row, columns] + a * np.append(front + clear * colour, 1)
    np.testing.assert_allclose(out[row, columns], expected, atol=MARK_FLOAT32)


def test_a_mark_is_seen_in_perspective_through_what_is_before_it():
    """Nothing of the formula is used: the fog in front, cut, over the mark, over the fog behind."""
    volume = constant((20, 20, 20), 1.0)
    view = psw.View.look_at((35, 12, 40), volume.centre, (0, 1, 0), 30, (61, 41))
    image = psw.Renderer(volume, FOG, psw.Settings(residual=0)).render(view)
    start, end = np.array([3.0, 4.0, 12.0]), np.array([17.0, 15.0, 5.0])
    line = m.Line(start, end, (0.0, 0.3, 1.0), 3.0)
    out = m.painted(image, view, m.Marks(lines=[line]), psw.Probe(volume, FOG, residual=0))
    shares = np.linspace(0, 1, 20001)[:, None]
    points = start + shares * (end - start)
    places = view.project(points)
    compared = 0
    for row, column in np.argwhere(out[..., 2] > image[..., 2] + 0.02):
        away = np.linalg.norm(places - (column + 0.5, row + 0.5), axis=1)
        point = points[np.argmin(away)]
        if away.min() > 0.9 or not 100 < np.argmin(away) < 19900:  # the soft rim, the ends
            continue
        length = np.linalg.norm(point - view.eye.position)
        way = (point - view.eye.position) / length
        entry = np.min([(p - view.eye.position) / way for p in (np.zeros(3), np.full(3, 19.0))], 0).max()
        clear = np.exp(-TAU * (length - entry))
        expected = (1 - clear) * np.array([1, 0.5, 0.2]) + clear * np.array(line.colour)
        np.testing.assert_allclose(out[row, column, :3], expected, atol=MARK_INK)
        compared += 1
    assert compared > 8


def test_pictures_change_where_marks_are_and_nowhere_else():
    volume = synthetic_ct(24)
    view = view_of(volume, DIRECTIONS[0], size=(90, 70))
    renderer = psw.Renderer(volume)
    image = renderer.render(view)
    kept = image.copy()
    line = m.Line(*np.array([(0.0, 0, 0), (23.0, 23, 23)]), (1.0, 1.0, 1.0), 2.0)
    out = m.painted(image, view, m.Marks(lines=[line]), psw.Probe.of(renderer))
    np.testing.assert_array_equal(image, kept)
    a, b = view.project(np.array([line.start, line.end]))
    rows, columns = np.indices(image.shape[:2]) + 0.5
    along = (b - a) / np.linalg.norm(b - a)
    off = abs((columns - a[0]) * along[1] - (rows - a[1]) * along[0])
    np.testing.assert_array_equal(out[off > 1.5], image[off > 1.5])
    changed = (out != image).any(-1)
    assert changed[off < 0.5].sum() > 20  # not where all is opaque before it
    np.testing.assert_array_equal(m.painted(image, view, m.Marks(), None), image)


@pytest.mark.parametrize("turn", np.linspace(0, np.pi, 9))
def test_a_line_covers_its_width_times_its_length(turn: float):
    volume = constant((40, 40, 40), 1.0)
    view = parallel(volume, (80, 80))
    half = 12 * np.array([np.cos(turn), np.sin(turn), 0])
    line = m.Line(volume.centre - half, volume.centre + half, (1.0, 1.0, 1.0), 2.5)
    out = m.painted(np.zeros((80, 80, 4)), view, m.Marks(lines=[line]), None)
    assert out[..., 3].sum() == pytest.approx(2.5 * 24 * 2, rel=0.03)
    assert out.max() == 1


def test_a_cursors_planes_are_painted_once_everywhere():
    volume = constant((20, 20, 20), 1.0)
    view = view_of(volume, DIRECTIONS[2], size=(80, 60))
    plane = [s for s in m.cursor(volume, (7, 9, 12), planes=True).sheets if np.argmax(s.colour) == 0]
    out = m.painted(np.zeros((60, 80, 4)), view, m.Marks(sheets=plane), None)
    ways = view.directions()
    at = view.eye.position + ways * ((7 - view.eye.position[0]) / ways[..., :1])
    inside = ((at[..., 1:] > 0) & (at[..., 1:] < 19)).all(-1)
    np.testing.assert_allclose(out[..., 3], inside * plane[0].opacity, atol=1e-6)
    assert 100 < inside.sum() < inside.size


def test_nearer_pieces_of_planes_lie_over_farther_ones():
    volume = constant((20, 20, 20), 1.0)
    opaque = [
        m.Sheet(s.corner, s.edges, tuple(np.eye(3)[np.argmax(s.colour)]), 1.0)
        for s in m.cursor(volume, (7, 9, 12), planes=True).sheets
    ]
    for towards in DIRECTIONS[:5]:
        view = view_of(volume, towards, size=(40, 30))
        out = m.painted(np.zeros((30, 40, 4)), view, m.Marks(sheets=opaque[::-1]), None)
        ways, eye = view.directions(), view.eye.position
        with np.errstate(divide="ignore", invalid="ignore"):
            distances = np.array([(at - eye[n]) / ways[..., n] for n, at in enumerate((7, 9, 12))])
        points = eye + ways * distances[..., None]
        seen = (distances > 0) & ((points >= -1e-9) & (points <= 19 + 1e-9)).all(-1)
        distances[~seen] = np.inf
        nearest = np.argmin(distances, 0)
        clearly = seen.any(0) & (np.partition(distances, 1, 0)[1] > distances.min(0) + 0.01)
        assert (clearly & (seen.sum(0) > 1)).sum() > 50
        np.testing.assert_array_equal(np.argmax(out[..., :3], -1)[clearly], nearest[clearly])


def test_eyes_inside_and_on_marks_see_what_is_before_them():
    volume = constant((20, 20, 20), 1.0)
    every = m.MarkChoice(box=True, axes=True, cursor=(7, 9, 12), planes=True, ruler=((1, 1, 1), (18, 18, 18)))
    for eye in ((7, 9, 12), (7, 9, 2), (0, 0, 0), (10, 0, 0), (10, 10, 10)):
        for towards in DIRECTIONS[:4]:
            view = psw.View.look_at(eye, np.add(eye, towards), (0.1, 1, 0.2), 80, (40, 30))
            marks = every.of_view(volume, view)
            out = m.painted(np.zeros((30, 40, 4)), view, marks, psw.Probe(volume, FOG))
            assert np.isfinite(out).all()
            assert out.min() >= 0 and out[..., :3].max() <= 1 + 1e-5


def test_what_is_behind_the_eye_is_not_painted():
    line = m.Line(np.array([10, 10, -5.0]), np.array([11, 10, -5.0]), (1.0, 1.0, 1.0))
    label = m.Label(np.array([10, 10, -5.0]), "behind", (1.0, 1.0, 1.0))
    edges = np.array([(8.0, 0, 0), (0, 8.0, 0)])
    sheet = m.Sheet(np.array([6, 6, -5.0]), edges, (1.0, 1.0, 1.0), 1.0)
    for marks in (m.Marks(lines=[line]), m.Marks(labels=[label]), m.Marks([sheet])):
        for target, painted in ((-5, True), (5, False)):
            view = psw.View.look_at((10, 10, 0), (10, 10, target), (0, 1, 0), 80, (40, 30))
            assert m.painted(np.zeros((30, 40, 4)), view, marks, None).any() == painted


def test_a_cursor_on_the_box_has_fewer_planes_pieces():
    volume = constant((20, 20, 20), 1.0)
    marks = m.cursor(volume, (0, 30, 5), planes=True)
    assert len(marks.sheets) == 2 + 2 + 1
    view = view_of(volume, DIRECTIONS[1], size=(40, 30))
    assert m.painted(np.zeros((30, 40, 4)), view, marks, psw.Probe(volume, FOG)).any()


def test_tones_along_a_line_are_in_perspective():
    view = psw.View.look_at((0, 0, 10), (0, 0, 0), (0, 1, 0), 60, (101, 61))
    points = np.linspace((-3, -1, 8), (8, 2, -40), 9)
    shares = np.linspace(0, 1, 9)
    tones = np.stack([shares, 1 - shares, 0 * shares], -1)
    line = m.VeiledLine(points, shares, tones, 3.0, 1.0)
    image = np.zeros((61, 101, 4), np.float32)
    m.paint(image, view, m.Veiled(lines=[line]))
    for share in np.linspace(0.02, 0.9, 30):
        column, row = view.project(points[0] + share * (points[-1] - points[0]))
        near = [view.project(points[0] + s * (points[-1] - points[0])) for s in (share - 0.01, share + 0.01)]
        slope = 0.02 / np.linalg.norm(near[1] - near[0])  # of the share, a pixel
        assert image[int(row), int(column), 3] == 1
        assert image[int(row), int(column), 0] == pytest.approx(share, abs=0.75 * slope + 1e-3)


def test_words_stand_at_their_point_and_are_dimmed():
    volume = constant((20, 20, 20), 1.0)
    view = parallel(volume, (120, 80))
    probe = psw.Probe(volume, FOG, residual=0)
    points = {
        name: volume.centre + (4, -3, z) for name, z in (("before", 30), ("inside", 0), ("behind", -30))
    }
    pictures = {}
    for name, point in points.items():
        label = m.Label(point, "H", (1.0, 1.0, 1.0), (1.0, 1.0, 1.0), letter=12)
        pictures[name] = m.painted(np.zeros((80, 120, 4)), view, m.Marks(labels=[label]), probe)
    clear = np.exp(-TAU * 9.5)
    alpha = pictures["before"][..., 3]
    rows, columns = np.nonzero(alpha)
    column, row = view.project(points["before"])
    assert abs(columns.mean() + 0.5 - column) <= 1 and abs(rows.mean() + 0.5 - row) <= 2
    expected = alpha[..., None] * (clear + (1 - clear) * np.array([1, 0.5, 0.2]))
    np.testing.assert_allclose(pictures["inside"][..., :3], expected, atol=MARK_FLOAT32)
    np.testing.assert_array_equal(pictures["inside"][..., 3], alpha)
    np.testing.assert_allclose(pictures["behind"][..., 1], 0.5 * alpha, atol=2e-3)
    cut = m.painted(np.zeros((80, 120, 4)), view, m.Marks(labels=[
        m.Label(volume.centre + (30, 20, 0), "corner", (1.0, 1.0, 1.0)),
        m.Label(volume.centre - (900, 20, 0), "away", (1.0, 1.0, 1.0)),
    ]), None)  # fmt: skip
    assert cut[:20, -20:].any() and not cut[:, :40].any()
