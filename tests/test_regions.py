"""Crop regions, slabs and clip planes: against brute force, closed forms and the reference."""

from itertools import combinations, pairwise, product

import numpy as np
import pytest
from tolerances import BORDER_SMOOTH, CLOSED_FORM, FLOAT32_IMAGE, ROUNDING
from views import DIRECTIONS, direction, face_view, random_pose, view_of

from persp_sw import Cut, Regions, Renderer, Settings, TransferFunction, View, Volume, reference
from persp_sw.errors import ViewError
from persp_sw.geometry.parts import shown_parts
from persp_sw.geometry.regions import ALL_REGIONS, CROP_FLAGS
from persp_sw.measure.exact import Slab, shown_part
from persp_sw.measure.metrics import psnr
from persp_sw.volume.phantoms import synthetic_ct

SIZE = (11, 9, 10)
CROP = (2.5, 6.25, 3, 5.75, 1.5, 7)
MASKS = [int(mask) for mask in np.random.default_rng(27).integers(0, ALL_REGIONS, 12)]
HAZE = TransferFunction([(0, (0.2, 0.4, 0.9), 0), (255, (1, 0.7, 0.4), 0.5)], 1.0)
EYE = np.array([40.0, -30.0, 25.0, 1.0])


def box_of(size=SIZE, pose=None):
    return Slab(size=size, pose=pose, opacity=0.3)


def is_shown(points, regions, volume):
    """Of (..., 3) object-space points: what the words of `Regions` say, one point at a time."""
    world = points @ volume.world_from_object[:3, :3].T + volume.world_from_object[:3, 3]
    shown = ((points >= 0) & (points <= np.array(volume.size) - 1)).all(-1)
    for plane in regions.clip:
        shown &= world @ plane[:3] + plane[3] >= 0
    for cut in regions.cut:
        distance = np.abs(world @ cut.plane[:3] + cut.plane[3]) / np.linalg.norm(cut.plane[:3])
        shown &= (distance <= cut.thickness / 2) == (cut.show == "inside")
    if regions.crop is not None:
        crop = np.array(regions.crop)
        number = (points > crop[0::2]).astype(int) + (points > crop[1::2])
        shown &= (regions.crop_flags >> (number @ [1, 3, 9])) & 1 == 1
    return shown


def all_planes(regions, volume):
    """(n, 4) object-space rows: the volume's box, and all that regions cut with."""
    rows = list(Regions(clip=regions.clip).half_spaces(volume))
    for cut in regions.cut:
        plane = np.array(cut.plane) / np.linalg.norm(cut.plane[:3])
        rows += [(plane + (0, 0, 0, side * cut.thickness / 2)) @ volume.world_from_object for side in (-1, 1)]
    if regions.crop is not None:
        rows += [(*np.eye(3)[n // 2], -x) for n, x in enumerate(regions.crop)]
    return np.array(rows)


def shown_length(volume, view, regions):
    """(height, width) world lengths of what is shown of each pixel's ray, cut at all planes."""
    inverse = np.linalg.inv(volume.world_from_object)
    eye = inverse[:3, :3] @ view.eye.position + inverse[:3, 3]
    directions = view.directions()
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    directions = directions @ inverse[:3, :3].T
    rows = all_planes(regions, volume)
    with np.errstate(divide="ignore"):
        crossings = -(rows[:, :3] @ eye + rows[:, 3]) / (directions @ rows[:, :3].T)
    far = 1e4
    ends = np.sort(np.clip(crossings, view.eye.near, far), axis=-1)
    middles = eye + directions[..., None, :] * ((ends[..., 1:] + ends[..., :-1]) / 2)[..., None]
    return (is_shown(middles, regions, volume) * np.diff(ends, axis=-1)).sum(-1)


def exact(slab, view, regions):
    """The picture of a homogeneous box, in closed form."""
    alpha = -np.expm1(-slab.transfer.extinction(100.0) * shown_length(slab.volume, view, regions))
    return alpha[..., None] * (*slab.colour, 1)


def composite(volume, transfer, view, regions, **settings):
    renderer = Renderer(volume, transfer, Settings(residual=0, **settings), regions)
    return renderer.composite(view.eye, [view.wall])


def assert_exact(slab, regions, towards, **settings):
    """All pixels of all faces are the closed form's, and the picture holds all that is shown."""
    view = view_of(slab.volume, towards)
    image = composite(slab.volume, slab.transfer, view, regions, **settings)
    for number in range(len(image.faces)):
        expected = exact(slab, face_view(image, number), regions)
        assert np.abs(image.face_pixels(number) - expected).max() < CLOSED_FORM
    if not image.faces:
        assert shown_length(slab.volume, view, regions).max() < 1e-6
    return image


def some_regions(rng, volume):
    """Random flags on random planes, slabs and clip planes of every kind, now and then degenerate."""
    high = np.array(volume.size) - 1.0
    crop = np.sort(rng.uniform(-0.2, 1.2, (3, 2)) * high[:, None], axis=1).round(rng.integers(3))

    def plane():
        normal = rng.normal(size=3) if rng.random() < 0.7 else np.eye(3)[rng.integers(3)]
        world = normal @ np.linalg.inv(volume.world_from_object[:3, :3])
        point = volume.world_from_object @ (*(high * rng.uniform(0.1, 0.9, 3)).round(1), 1)
        return (*world, -world @ point[:3])

    cuts = [
        Cut(plane(), rng.choice([0, 0.3, 2.5]) * min(volume.spacing), rng.choice(["inside", "outside"]))
        for _ in range(rng.integers(4))
    ]
    clip = [plane() for _ in range(rng.integers(3))]
    return Regions(crop.ravel(), clip, cuts, int(rng.integers(ALL_REGIONS)))


def cases(count):
    """`count` random (rng, volume, regions); half of the volumes in an oblique, mirrored pose."""
    for seed in range(count):
        rng = np.random.default_rng([3, seed])
        pose = random_pose(rng, spacing=(0.7, 1.3, 1), mirrored=True) if seed % 2 else np.eye(4)
        volume = box_of(pose=pose).volume
        yield rng, volume, some_regions(rng, volume)


# --- Parts ------------------------------------------------------------------------------------------------


def test_vtk_numbers_and_names():
    """From vtkVolumeMapper.h; and what the names mean: between the planes of how many axes."""
    assert CROP_FLAGS == {
        "subvolume": 0x0002000,
        "fence": 0x2EBFEBA,
        "inverted_fence": 0x5140145,
        "cross": 0x0417410,
        "inverted_cross": 0x7BE8BEF,
    }
    for bit, (z, y, x) in enumerate(product(range(3), repeat=3)):
        between = [x, y, z].count(1)
        assert CROP_FLAGS["fence"] >> bit & 1 == (between >= 1)
        assert CROP_FLAGS["cross"] >> bit & 1 == (between >= 2)
    assert CROP_FLAGS["fence"] ^ CROP_FLAGS["inverted_fence"] == ALL_REGIONS
    assert CROP_FLAGS["cross"] ^ CROP_FLAGS["inverted_cross"] == ALL_REGIONS


@pytest.mark.parametrize("bit", range(27))
def test_a_region_alone_is_its_box(bit):
    (part,) = shown_parts(Regions(CROP, crop_flags=1 << bit), box_of().volume, EYE)
    z, y, x = np.unravel_index(bit, (3, 3, 3))
    for axis, number in enumerate((x, y, z)):
        borders = [0, *CROP[2 * axis : 2 * axis + 2], SIZE[axis] - 1]
        assert (part.low[axis], part.high[axis]) == (borders[number], borders[number + 1])


def test_few_boxes_stand_for_many_regions():
    volume = box_of().volume

    def count(flags, crop=CROP):
        return len(shown_parts(Regions(crop, crop_flags=flags), volume, EYE))

    assert count(ALL_REGIONS) == 1
    assert count(0) == 0
    assert count("subvolume") == 1
    assert count("cross") == 5
    assert count("fence") == 7
    assert count("inverted_fence") == 8
    assert count(ALL_REGIONS ^ CROP_FLAGS["subvolume"]) == 6
    # Regions without a thickness separate nothing.
    assert count(ALL_REGIONS ^ CROP_FLAGS["subvolume"], (-1, 20, 3, 3, 1, 7)) == 1


def test_every_point_is_in_one_part_if_shown_and_in_none_if_not():
    points = np.random.default_rng(1).uniform(0, np.array(SIZE) - 1, (4000, 3))
    shown_ever = 0
    for _, volume, regions in cases(60):
        parts = shown_parts(regions, volume, EYE)
        inside = [(points @ part.half_spaces[:, :3].T + part.half_spaces[:, 3] > 0).all(1) for part in parts]
        shown = is_shown(points, regions, volume)
        np.testing.assert_array_equal(np.sum(inside, axis=0, initial=0), shown)
        for part, within in zip(parts, inside, strict=True):
            assert (points[within] >= part.low).all() and (points[within] <= part.high).all()
        shown_ever += shown.any()
    assert shown_ever > 20


def test_a_parts_box_is_as_small_as_can_be():
    """Its corners come from the vertices: all points where three planes meet and that are in the part."""
    tested = 0
    for _, volume, regions in cases(60):
        for part in shown_parts(regions, volume, EYE):
            rows = part.half_spaces / np.linalg.norm(part.half_spaces[:, :3], axis=1, keepdims=True)
            threes = rows[list(combinations(range(len(rows)), 3))]
            threes = threes[np.abs(np.linalg.det(threes[:, :, :3])) > 1e-6]
            points = np.linalg.solve(threes[:, :, :3], -threes[:, :, 3:])[..., 0]
            points = points[(points @ rows[:, :3].T + rows[:, 3] > -1e-8).all(1)]
            assert np.abs(points.min(0) - part.low).max() < 1e-6
            assert np.abs(points.max(0) - part.high).max() < 1e-6
            tested += 1
    assert tested > 60


def test_planes_through_corners_and_edges():
    """A wedge by a plane through two edges, cut through its slanted side: 0 ≤ y ≤ x ≤ 4 − y."""
    volume = box_of(size=(5, 5, 5)).volume
    (part,) = shown_parts(Regions(clip=[(1, -1, 0, 0), (-1, -1, 0, 4)]), volume, EYE)
    assert (part.low == 0).all()
    np.testing.assert_allclose(part.high, (4, 2, 4))
    assert shown_parts(Regions(clip=[(1, -1, 0, 0), (-1, 1, 0, 0)]), volume, EYE) == []


def interval(part, origin, towards):
    """First and last distance at which a ray is in a part, as the kernels have it."""
    near, far = 0.0, np.inf
    for *a, a_0 in part.half_spaces:
        offset, slope = np.dot(a, origin) + a_0, np.dot(a, towards)
        if slope == 0:
            near, far = (near, far) if offset >= 0 else (1.0, 0.0)
        elif slope > 0:
            near = max(near, -offset / slope)
        else:
            far = min(far, -offset / slope)
    return near, far


@pytest.mark.parametrize("where", ["outside", "inside", "infinity"])
def test_no_part_hides_one_that_comes_before_it(where):
    rays = 0
    for rng, volume, regions in cases(80):
        high = np.array(volume.size) - 1.0
        eye = high * (rng.uniform(0, 1, 3) if where == "inside" else rng.uniform(-3, 4, 3))
        infinite = where == "infinity"
        parts = shown_parts(regions, volume, np.append(eye, 0.0 if infinite else 1.0))
        for target in high * rng.uniform(0, 1, (12, 3)):
            origin, towards = (target + 10 * eye, -eye) if infinite else (eye, target - eye)
            met = [interval(part, origin, towards) for part in parts]
            met = [(near, far) for near, far in met if far - near > 1e-9]
            for (_, far), (near, _) in pairwise(met):
                assert near > far - 1e-9
            rays += len(met) > 1
    assert rays > 40


@pytest.mark.parametrize("infinite", [False, True])
def test_a_ray_in_a_border_is_in_one_part(infinite):
    """The eye in the plane x = 2.5 that two shown boxes have in common, looking along it."""
    regions = Regions(CROP, crop_flags=ALL_REGIONS ^ 1)
    eye, towards = np.array([2.5, -20.0, 4.5]), np.array([0.0, 1.0, 0.0])
    homogeneous = np.append(-towards, 0.0) if infinite else np.append(eye, 1.0)
    parts = shown_parts(regions, box_of().volume, homogeneous)
    assert len(parts) > 2
    lengths = [far - near for near, far in (interval(part, eye, towards) for part in parts) if far > near]
    assert sum(lengths) == SIZE[1] - 1


# --- Pictures of a homogeneous medium ---------------------------------------------------------------------


@pytest.mark.parametrize("bit", range(27))
def test_each_of_the_27_regions(bit):
    for towards in DIRECTIONS[:3]:
        image = assert_exact(box_of(), Regions(CROP, crop_flags=1 << bit), towards)
        assert image.pixels.max() > 0.05


@pytest.mark.parametrize("flags", [*CROP_FLAGS, *MASKS])
@pytest.mark.parametrize("samples", [1, 2])
def test_presets_and_random_flags(flags, samples):
    for towards in DIRECTIONS:
        regions = Regions(CROP, crop_flags=flags)
        assert_exact(box_of(), regions, towards, samples_per_interval=samples)


CUTS = {
    "inside": [((0.3, -0.5, 0.8, -2.1), 1.5, "inside")],
    "outside": [((0.3, -0.5, 0.8, -2.1), 1.5, "outside")],
    "outside, crossing": [((0.3, -0.5, 0.8, -2.1), 1.5, "outside"), ((1, 0.2, 0, -4), 0.7, "outside")],
    "outside, parallel": [((0, 0, 2, -6), 1, "outside"), ((0, 0, 1, -6.5), 1, "outside")],
    "one in another": [((0.3, 0, 1, -6), 5, "inside"), ((0.3, 0, 1, -6), 1, "outside")],
    "nothing left": [((0, 0, 1, -3), 1, "inside"), ((0, 0, 1, -6), 1, "inside")],
    "through voxel centres": [((0, 1, 0, -4), 2, "outside"), ((1, 0, 0, -5), 4, "inside")],
    "nearly along the slices": [((1e-7, 2e-6, 1, -4), 1, "outside")],
    "thin": [((0.1, 0.2, 1, -4.5), 1e-3, "inside")],
    "thin gap": [((0.1, 0.2, 1, -4.5), 1e-3, "outside")],
    "thicker than the box": [((1, 0, 0, 0), 100, "inside")],
    "beside the box": [((1, 0, 0, 5), 2, "outside")],
}


@pytest.mark.parametrize("name", CUTS)
@pytest.mark.parametrize("samples", [1, 4])
def test_slabs(name, samples):
    regions = Regions(cut=[Cut(*cut) for cut in CUTS[name]])
    for towards in DIRECTIONS:
        assert_exact(box_of(), regions, towards, samples_per_interval=samples)


def test_all_kinds_together_on_oblique_grids():
    several = 0
    for rng, volume, regions in cases(60):
        slab = box_of(pose=volume.world_from_object)
        image = assert_exact(slab, regions, direction(*rng.normal(size=3)))
        several += len(image.faces) > 0 and len(shown_parts(regions, volume, EYE)) > 1
    assert several > 15


@pytest.mark.parametrize("count", [1, 5, 40])
def test_any_number_of_clip_planes(count):
    """A polyhedron around the middle."""
    rng = np.random.default_rng(count)
    slab = box_of()
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    clip = [(*normal, 3.1 - normal @ slab.volume.centre) for normal in normals]
    for towards in DIRECTIONS[:3]:
        image = assert_exact(slab, Regions(clip=clip), towards)
        assert image.pixels.max() > 0.5


def test_slabs_without_thickness_hide_all_or_nothing():
    slab = box_of()
    view = view_of(slab.volume, DIRECTIONS[0])
    whole = composite(slab.volume, slab.transfer, view, Regions())
    inside, outside = (
        composite(slab.volume, slab.transfer, view, Regions(cut=[Cut((0.1, 0.2, 1, -4.5), 0, show)]))
        for show in ("inside", "outside")
    )
    assert not inside.faces
    np.testing.assert_array_equal(outside.pixels, whole.pixels)


def test_thickness_is_in_world_units_whatever_the_normals_length():
    slab = box_of(pose=np.diag([1, 1, 2.5, 1]))
    thick = Regions(cut=[Cut((0, 0, 7, -7 * 10), 5)])
    assert shown_parts(thick, slab.volume, EYE)[0].low[2] == pytest.approx(3)  # world 7.5 … 12.5
    assert shown_parts(thick, slab.volume, EYE)[0].high[2] == pytest.approx(5)


@pytest.mark.parametrize("tilt", [0, 1e-13, 1e-12, 1e-10, 1e-7, 1e-5])
def test_a_plane_that_all_but_lies_on_a_slice_clips_like_one_that_does(tilt):
    """Its box ends between a voxel and the next float64: float32 takes it for the voxel, and so must all."""
    size = (11, 9, 10)
    volume = Volume(np.ones(size[::-1], np.uint8))
    medium = TransferFunction([(1, (0.9, 0.6, 0.3), 0.35)], 1.0)
    regions = Regions(clip=[(tilt, 2 * tilt, 1, -4)])
    for towards in ((-0.5, -0.5, -0.7), (0.4, -0.6, -0.6), (-0.7, 0.5, 0.4)):
        view = view_of(volume, direction(*towards), distance=1.7, fovy=45, size=(96, 72))
        image = composite(volume, medium, view, regions)
        for number in range(len(image.faces)):
            rays = face_view(image, number)
            entry, leave = shown_part(volume, rays, regions)
            exact = -np.expm1(-medium.extinction(1) * (leave - entry))
            assert np.abs(image.face_pixels(number)[..., 3] - exact).max() < CLOSED_FORM


# --- Borders between parts --------------------------------------------------------------------------------


def smooth():
    z, y, x = np.indices(SIZE[::-1])
    return Volume((120 + 100 * np.sin(0.5 * x) * np.cos(0.4 * y) * np.sin(0.3 * z + 0.7)).astype(np.float32))


@pytest.mark.parametrize("plane", [(0.3, -0.5, 0.8, -2.1), (1, 0, 0, -5.3), (0, 1, 0, -4), (0, 0, 1, -4.6)])
@pytest.mark.parametrize("samples", [1, 2])
def test_two_parts_that_touch_look_as_one(plane, samples):
    """A slab of 1e-6 voxel hides nothing, but divides the volume in two."""
    volume, border = smooth(), Regions(cut=[Cut(plane, 1e-6, "outside")])
    for towards in DIRECTIONS:
        view = view_of(volume, towards)
        mode = {"samples_per_interval": samples, "single_face_tangent": 8}
        whole, halves = (composite(volume, HAZE, view, r, **mode) for r in (Regions(), border))
        assert whole.faces == halves.faces
        # A border between slices gives each part of an interval the same look-up: there the two are equal.
        across = plane[whole.faces[0].axis] == np.abs(plane[:3]).max() == 1
        bound = FLOAT32_IMAGE if across else BORDER_SMOOTH
        assert np.abs(whole.pixels - halves.pixels).max() < bound


@pytest.mark.parametrize("flags", ["cross", "inverted_fence", MASKS[0]])
def test_pictures_of_a_scan_against_the_reference(flags):
    volume = synthetic_ct(40)
    regions = Regions(
        (12, 27.5, 10.25, 29, 12, 28), [(0.4, -0.3, 1, -8)], [Cut((1, 1, 0.2, -42), 3, "outside")], flags
    )
    transfer = TransferFunction([(0, (0.2, 0.3, 0.8), 0), (120, (1, 0.6, 0.3), 0.15)], 1.0)
    for towards in DIRECTIONS[:2]:
        view = view_of(volume, towards, size=(96, 72), fovy=40)
        picture = Renderer(volume, transfer, Settings(quality=2), regions).render(view)
        assert psnr(picture, reference.render(volume, transfer, view, regions=regions)) > 38


# --- The reference ----------------------------------------------------------------------------------------


def test_the_reference_cuts_as_the_closed_form():
    for rng, volume, regions in cases(40):
        slab = box_of(pose=volume.world_from_object)
        view = view_of(volume, direction(*rng.normal(size=3)), distance=rng.choice([0.2, 1.7]), size=(20, 15))
        picture = reference.render(volume, slab.transfer, view, regions=regions)
        assert np.abs(picture - exact(slab, view, regions)).max() < ROUNDING


def test_the_reference_shows_regions_as_the_crops_of_each():
    """Without the twin's cutting: of a homogeneous box optical depths add up, region by region."""
    slab = box_of()
    view = view_of(slab.volume, DIRECTIONS[0])
    for flags in MASKS:
        length = 0
        for bit, (z, y, x) in enumerate(product(range(3), repeat=3)):
            borders = [(0, *CROP[2 * n : 2 * n + 2], SIZE[n] - 1) for n in range(3)]
            crop = [b[n + m] for b, n in zip(borders, (x, y, z), strict=True) for m in (0, 1)]
            if flags >> bit & 1:
                entry, leave = shown_part(slab.volume, view, Regions(crop))
                length += leave - entry
        picture = reference.render(slab.volume, slab.transfer, view, regions=Regions(CROP, crop_flags=flags))
        alpha = -np.expm1(-slab.transfer.extinction(100.0) * length)
        assert np.abs(picture[..., 3] - alpha).max() < ROUNDING


def test_a_ray_in_a_border_sees_what_has_a_thickness():
    slab = box_of(size=(3, 3, 3))
    view = View.look_at((2, 1, -8), (2, 1, 1), (0, 1, 0), 10, (1, 1))  # in the side x = 2
    whole, side, nothing = (
        reference.render(slab.volume, slab.transfer, view, regions=regions)[0, 0, 3]
        for regions in (Regions(), Regions((1, 2, 0, 2, 0, 2)), Regions(cut=[Cut((1, 0, 0, -2), 0)]))
    )
    assert whole == side > 0.1
    assert nothing == 0


def test_inside_and_outside_of_a_slab_are_the_whole():
    """Depths add up for any volume, if the medium is the same along the ray: here it is not, so per pixel."""
    slab, cut = box_of(), ((0.3, -0.5, 0.8, -2.1), 1.5)
    view = view_of(slab.volume, DIRECTIONS[1])
    clear = [
        1 - reference.render(slab.volume, slab.transfer, view, regions=regions)[..., 3]
        for regions in (Regions(), Regions(cut=[Cut(*cut, "inside")]), Regions(cut=[Cut(*cut, "outside")]))
    ]
    assert np.abs(clear[0] - clear[1] * clear[2]).max() < ROUNDING


# --- Work -------------------------------------------------------------------------------------------------


def test_what_is_hidden_is_not_sampled():
    """Up to the packets of 16 pixels that lie across a border, which count on both sides of it."""
    volume = Volume(np.full((40, 40, 40), 100, np.uint8))
    for towards in DIRECTIONS:
        view = view_of(volume, towards, size=(24, 18))  # so few that the view sets the pitch, not the volume

        def samples(regions, view=view):
            return composite(volume, HAZE, view, regions, quality=8).samples

        whole = samples(Regions())
        assert samples(Regions(clip=[(1, 0.2, 0.1, -25)])) < 0.75 * whole  # 45 % of the volume is left
        assert samples(Regions(cut=[Cut((1, 0.2, 0.1, -25), 4, "inside")])) < 0.3 * whole
        assert samples(Regions(cut=[Cut((1, 0.2, 0.1, -25), 20, "outside")])) < 0.75 * whole
        assert samples(Regions((13, 26, 13, 26, 13, 26), crop_flags="inverted_fence")) < 0.5 * whole  # 30 %
        assert samples(Regions(clip=[(1, 0, 0, -25), (-1, 0, 0, 24)])) == 0


def test_moving_planes_encodes_and_compiles_nothing():
    volume = synthetic_ct(32)
    renderer = Renderer(volume, HAZE)
    view = view_of(volume, DIRECTIONS[0])
    before = renderer.render(view)
    seconds, voxels = renderer.runs.encode_seconds, renderer.runs.axis(2).voxels
    for shift in np.linspace(-20, -12, 5):
        for regions in (
            Regions(clip=[(0.1, 0.2, 1, shift)]),
            Regions(cut=[Cut((0.1, 0.2, 1, shift), 3, "outside")]),
            Regions((-shift / 4, 20, 5, 20, 5, 20), crop_flags="fence"),
        ):
            renderer.regions = regions
            assert np.abs(renderer.render(view) - before).max() > 0.05
            assert renderer.last["compile_ms"] == 0
    assert renderer.runs.encode_seconds == seconds
    assert renderer.runs.axis(2).voxels is voxels


# --- What is refused --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("regions", "words"),
    [
        ({"crop_flags": "fence"}, "give crop"),
        ({"crop": CROP, "crop_flags": "hedge"}, "hedge"),
        ({"crop": CROP, "crop_flags": 1 << 27}, "27 bits"),
        ({"crop": CROP, "crop_flags": -1}, "27 bits"),
        ({"crop": CROP, "crop_flags": 2.0}, "27 bits"),
        ({"crop": CROP, "crop_flags": True}, "27 bits"),
        ({"cut": {"plane": [0, 0, 1, 0]}}, "list of slabs"),
        ({"cut": [{"plane": [0, 0, 1, 0]}]}, "thickness"),
        ({"cut": [{"plane": [0, 0, 1, 0], "thickness": 1, "fall": 2}]}, "fall"),
        ({"cut": [{"plane": [0, 0, 0, 1], "thickness": 1}]}, "normal"),
        ({"cut": [{"plane": [0, 0, 1], "thickness": 1}]}, "4 finite numbers"),
        ({"cut": [{"plane": [0, 0, 1, 0], "thickness": -1}]}, "thickness"),
        ({"cut": [{"plane": [0, 0, 1, 0], "thickness": 1, "show": "left"}]}, "left"),
    ],
)
def test_regions_that_are_none_are_refused(regions, words):
    with pytest.raises(ViewError, match=words):
        Regions(**regions)


def test_mappings_and_names_mean_the_same():
    plane = [0, 0, 2, -3]
    one = Regions(CROP, cut=[{"plane": plane, "thickness": 1, "show": "outside"}], crop_flags="CROSS")
    assert one == Regions(CROP, cut=[Cut(plane, 1, "outside")], crop_flags=0x0417410)


def test_the_closed_form_of_one_interval_refuses_regions_with_several():
    slab = box_of()
    view = view_of(slab.volume, DIRECTIONS[0])
    for regions in (Regions(CROP, crop_flags="fence"), Regions(cut=[Cut((0, 0, 1, -3), 1, "outside")])):
        with pytest.raises(ValueError, match="convex"):
            shown_part(slab.volume, view, regions)
