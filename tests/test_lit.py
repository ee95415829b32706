"""Lit pictures: their plain twin, invariants, and the float64 reference."""

from dataclasses import replace

import lit_twins
import numpy as np
import pytest
import twins
from test_composite import poses, smooth_volume
from tolerances import FLOAT32_LIT, LIT_TWIN
from views import DIRECTIONS, random_rotation, view_of

from persp_sw import (
    Light,
    Lighting,
    Look,
    Modulation,
    Regions,
    Renderer,
    Settings,
    TransferFunction,
    View,
    Volume,
    reference,
)
from persp_sw.optics.classification import Classification
from persp_sw.volume.gradient import FAINTEST, largest_magnitude, world_from_differences
from persp_sw.volume.levels import STANDARD_AXES, standard_rows

HAZE = TransferFunction([(60, (0.2, 0.4, 0.9), 0), (255, (1, 0.7, 0.4), 0.5)], 1.0)
LIGHTS = (Light((1, 2, 3), (1, 0.6, 0.2)), Light((-2, -1, 1), (0.1, 0.3, 1)))
LOOKS = {
    "headlight": Look(Lighting()),
    "lights": Look(Lighting(headlight=0.3, lights=LIGHTS, emissive=0.1, power=7.5)),
    "one side, blinn": Look(Lighting(lights=LIGHTS, two_sided=False, model="blinn", power=50)),
    "modulated, wide": Look(Lighting(), Modulation(0.02, 0.2, 0.8, 0.5), 1.5),
    "modulated alone": Look(None, Modulation(0.0, 0.2, 1.0, 1.0), 2.0),
}


def rendered(volume, transfer, view, look, regions=None, **settings):
    renderer = Renderer(volume, transfer, Settings(residual=0, **settings), regions, look=look)
    return renderer.composite(view.eye, [view.wall])


def lit_by(volume, look, table, axes, rows, ray):
    """What light makes of samples on a ray of a face, for `twins.composite_pixel`."""
    linear = volume.world_from_object[:3, axes]
    sight = -(linear @ ray) / np.linalg.norm(linear @ ray)
    largest = largest_magnitude(volume, look.gradient_distance)
    data = rows.transpose(1, 0, 2)  # [k, j, i]

    def lit(place, entry):
        slopes = lit_twins.slopes(data, place, look.gradient_distance)
        gradient = world_from_differences(volume)[:, axes] @ slopes
        thicker, tint = lit_twins.thickness(look.modulation, np.linalg.norm(gradient), largest)
        factor, shine = lit_twins.phong(look.lighting, gradient, sight, FAINTEST * largest, tint)
        *colour, tau = table[entry].astype(float)
        return np.array(colour) * factor + shine, tau * thicker

    return lit


@pytest.mark.parametrize("samples", [1, 2])
@pytest.mark.parametrize("look", LOOKS)
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_lit_pixels_equal_their_twin(dtype, look, samples, rng):
    for name, pose in poses(rng).items():
        volume = smooth_volume(dtype=dtype, world_from_object=pose)
        transfer = HAZE.with_unit(1.0)
        classification = Classification.of(transfer, volume)
        view = view_of(volume, rng.normal(size=3), size=(40, 30))
        image = rendered(volume, transfer, view, LOOKS[look], samples_per_interval=samples)
        for number, face in enumerate(image.faces):
            axes = list(STANDARD_AXES[face.axis])
            pixels, rows = image.face_pixels(number), standard_rows(volume, face.axis)
            eye = (np.linalg.inv(volume.world_from_object) @ [*view.eye.position, 1])[:3][axes]
            linear = volume.world_from_object[:3, axes]
            box = np.array([v for n in np.array(volume.size)[axes] for v in (0.0, n - 1.0)])
            sides = [(*side * unit, far) for unit, n in zip(np.eye(3), box[1::2], strict=True)
                     for side, far in ((1, 0.0), (-1, n))]  # fmt: skip
            for v, u in rng.integers(0, pixels.shape[:2], (8, 2)):
                t = np.array(face.origin) + (np.array([u, v]) + 0.5) * face.pitch
                ray = np.array([*t, face.sign])
                expected = twins.composite_pixel(
                    rows, (*eye, face.sign, *t, 0.0), box, sides, linear.T @ linear, samples,
                    classification.table, classification.origin, classification.scale, 0,
                    lit_by(volume, LOOKS[look], classification.table, axes, rows, ray),
                )  # fmt: skip
                assert np.abs(pixels[v, u] - expected).max() < LIT_TWIN, (name, number, u, v)


@pytest.mark.parametrize("preintegrated", [False, True])
def test_all_ambient_light_is_none(preintegrated):
    volume = smooth_volume()
    view = view_of(volume, DIRECTIONS[1])
    plain = rendered(volume, HAZE, view, None, preintegrated=preintegrated).pixels
    for lighting in (Lighting(1, 0, 0), Lighting(0, 0, 0, emissive=1), Lighting(1, headlight=0)):
        lit = rendered(volume, HAZE, view, Look(lighting), preintegrated=preintegrated).pixels
        assert np.abs(lit - plain).max() < FLOAT32_LIT
        np.testing.assert_array_equal(lit[..., 3], plain[..., 3])


def sparse(rng):
    """Nearly all neighbours of what is seen are not seen themselves."""
    data = np.zeros((14, 15, 150), np.uint8)
    data[rng.random(data.shape) < 0.02] = 200
    return Volume(data)


def wavy(_rng):
    """Rays see things a little beyond the cells they are sampled in."""
    z, y, x = np.indices((20, 22, 40))
    return Volume((120 + 100 * np.sin(0.5 * x + 6) * np.cos(0.4 * y) * np.sin(0.3 * z)).astype(np.uint8))


@pytest.mark.parametrize("reach", [1.0, 1.3, 4.0])
@pytest.mark.parametrize("preintegrated", [False, True])
@pytest.mark.parametrize("made", [sparse, wavy])
def test_skipping_and_packing_change_no_lit_pixel(made, preintegrated, reach, rng):
    volume = made(rng)
    transfer = TransferFunction([(90, (1, 0.5, 0.2), 0), (255, (1, 1, 1), 0.9)], 1.0)
    for towards in (DIRECTIONS[0], DIRECTIONS[2], DIRECTIONS[3]):
        view = view_of(volume, towards, distance=0.8)
        image, *others = (
            rendered(
                volume, transfer, view, Look(Lighting(), None, reach),
                preintegrated=preintegrated, skip_empty=skip, pack_runs=pack,
            )
            for skip, pack in ((True, True), (True, False), (False, False))
        )  # fmt: skip
        assert image.pixels[..., 3].max() > 0.3
        np.testing.assert_array_equal(image.pixels, others[0].pixels)
        if [face.size for face in image.faces] == [face.size for face in others[1].faces]:
            np.testing.assert_array_equal(image.pixels, others[1].pixels)


@pytest.mark.parametrize("look", LOOKS)
def test_the_lit_reference_is_what_finer_sampling_tends_to(look):
    volume = smooth_volume(dtype=np.float32, world_from_object=np.diag([1, 0.7, 1.4, 1.0]))
    view = view_of(volume, DIRECTIONS[1], size=(32, 24))
    truth = reference.render(volume, HAZE, view, look=LOOKS[look], tolerance=1e-4)
    errors = []
    for samples in (1, 4):
        settings = Settings(quality=4, residual=0, samples_per_interval=samples)
        picture = Renderer(volume, HAZE, settings, look=LOOKS[look]).render(view)
        errors.append(np.sqrt(np.mean((picture - truth) ** 2)))
    assert truth[..., :3].max() > 0.2
    assert errors[1] < 0.7 * errors[0]
    assert errors[1] < 0.01


def test_light_that_turns_with_the_volume_gives_the_same_picture(rng):
    turn = np.eye(4)
    turn[:3, :3] = random_rotation(rng)
    volume = smooth_volume()
    turned = smooth_volume(world_from_object=turn)
    look = LOOKS["lights"]
    lights = tuple(replace(one, direction=tuple(turn[:3, :3] @ one.direction)) for one in LIGHTS)
    turned_look = replace(look, lighting=replace(look.lighting, lights=lights))
    eye, up = volume.centre + (14, -9, 11), np.array([0.0, 0, 1])
    view = View.look_at(eye, volume.centre, up, 45, (40, 30))
    turned_view = View.look_at(
        turn[:3, :3] @ eye, turn[:3, :3] @ volume.centre, turn[:3, :3] @ up, 45, (40, 30)
    )
    one = Renderer(volume, HAZE, look=look).render(view)
    other = Renderer(turned, HAZE, look=turned_look).render(turned_view)
    assert np.abs(one - other).max() < FLOAT32_LIT
    fixed = Renderer(turned, HAZE, look=look).render(turned_view)
    assert np.abs(one - fixed).max() > 0.05


def test_what_is_cut_away_still_has_a_say_in_gradients():
    """A crop is a knife, not an eraser: the surface it leaves is lit as what was there is."""
    volume = smooth_volume((20, 20, 20))
    view = view_of(volume, DIRECTIONS[0], size=(32, 24))
    regions = Regions(clip=[(0.2, 0.1, -1, 9.3)])
    truth = reference.render(volume, HAZE, view, regions=regions, look=LOOKS["lights"], tolerance=1e-4)
    settings = Settings(quality=4, residual=0, samples_per_interval=4)
    picture = Renderer(volume, HAZE, settings, regions, look=LOOKS["lights"]).render(view)
    assert np.sqrt(np.mean((picture - truth) ** 2)) < 0.01


def test_missing_voxels_have_no_gradient_and_nothing_spreads():
    data = smooth_volume(dtype=np.float32).data.copy()
    data[4, 5, 6] = np.nan
    image = rendered(Volume(data), HAZE, view_of(Volume(data), DIRECTIONS[0]), LOOKS["lights"])
    assert np.isfinite(image.pixels).all()


def test_lights_and_looks_change_without_encoding_anew():
    volume = smooth_volume((20, 20, 20))
    view = view_of(volume, DIRECTIONS[0])
    renderer = Renderer(volume, HAZE, look=LOOKS["headlight"])
    first, runs = renderer.render(view), renderer.runs.axis(0)
    renderer.look = LOOKS["lights"]
    assert not np.array_equal(renderer.render(view), first)
    assert renderer.runs.axis(0) is runs
    renderer.look = None
    plain = renderer.render(view)
    assert renderer.runs.axis(0) is runs
    np.testing.assert_array_equal(plain, Renderer(volume, HAZE).render(view))
