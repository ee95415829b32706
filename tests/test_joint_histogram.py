"""The joint histogram against single voxels counted one by one."""

import numpy as np
import pytest
from test_gradients import POSES, pose

from persp_sw import reference
from persp_sw.errors import TransferFunctionError
from persp_sw.optics.joint_histogram import JointHistogram
from persp_sw.volume.grid import Volume


def noise(name="sheared", size=(7, 6, 11), dtype=np.uint8, nan=0):
    rng = np.random.default_rng(6)
    data = rng.integers(0, 200, size[::-1]).astype(dtype)
    if nan:
        data.flat[rng.permutation(data.size)[:nan]] = np.nan
    return Volume(data, world_from_object=pose(name))


def brute_force(volume, bins, largest):
    z, y, x = (n.ravel() for n in np.indices(volume.data.shape))
    world = np.stack([x, y, z], -1) @ volume.world_from_object[:3, :3].T + volume.world_from_object[:3, 3]
    # A NaN beside a voxel makes its gradient 0; one at the voxel itself hides it.
    padded = np.pad(np.isfinite(volume.data), 1, constant_values=True)
    good = np.isfinite(volume.data)
    for axis in range(3):
        for shift in (-1, 1):
            good &= np.roll(padded, shift, axis)[1:-1, 1:-1, 1:-1]
    values = volume.data.ravel()[good.ravel()].astype(float)
    lengths = np.linalg.norm(reference.gradients(volume, world), axis=-1)[good.ravel()]
    edges = [np.linspace(*volume.value_range, bins[0] + 1), np.linspace(0, largest, bins[1] + 1)]
    return np.histogram2d(values, np.minimum(lengths, largest), edges)[0]


@pytest.mark.parametrize("name", POSES)
def test_counts_are_those_of_single_voxels(name):
    volume = noise(name)
    bins = 37, 23  # widths that no value and hardly a magnitude falls on the border of
    histogram = JointHistogram.of(volume, bins)
    truth = brute_force(volume, bins, histogram.magnitudes[1])
    assert histogram.counts.sum() == volume.data.size
    assert np.abs(histogram.counts - truth).sum() <= 2  # one voxel may round to the other side of a border
    assert histogram.values == volume.value_range
    assert truth[:, -1].any()  # the largest magnitude ends the last bin


def test_slabs_leave_no_seam(monkeypatch):
    whole = JointHistogram.of(noise(), (16, 16))
    for slices in (1, 3, 100):
        monkeypatch.setattr("persp_sw.optics.joint_histogram._SLICES", slices)
        np.testing.assert_array_equal(JointHistogram.of(noise(), (16, 16)).counts, whole.counts)


def test_voxels_without_a_gradient_are_not_counted():
    volume = noise("rotated", dtype=np.float32, nan=9)
    histogram = JointHistogram.of(volume, (20, 20))
    truth = brute_force(volume, (20, 20), histogram.magnitudes[1])
    assert 0 < histogram.counts.sum() == truth.sum() < volume.data.size - 9


def test_magnitudes_above_the_largest_asked_for_are_in_the_last_bin():
    volume = noise()
    all_of_them = JointHistogram.of(volume, (8, 64))
    half = JointHistogram.of(volume, (8, 32), all_of_them.magnitudes[1] / 2)
    np.testing.assert_array_equal(half.counts[:, :-1], all_of_them.counts[:, :31])
    assert half.counts.sum() == volume.data.size


@pytest.mark.parametrize("largest", [None, 50.0])
def test_progress_comes_to_its_end(largest):
    seen = []
    JointHistogram.of(noise(), (8, 8), largest, lambda *what: seen.append(what))
    total = 22 if largest is None else 11
    assert seen[-1] == (total, total, "joint histogram")
    assert [done for done, *_ in seen] == sorted({done for done, *_ in seen})


def test_volumes_with_nothing_to_count():
    flat = JointHistogram.of(Volume(np.full((5, 5, 5), 3, np.uint8)), (4, 4))
    assert flat.counts[0, 0] == flat.counts.sum() == 125 and flat.magnitudes[1] > 0
    assert not JointHistogram.of(Volume(np.arange(16, dtype=np.uint8).reshape(1, 4, 4)), (4, 4)).counts.any()


@pytest.mark.parametrize(("bins", "largest"), [((0, 4), None), ((4, 5000), None), ((4, 4), 0), ((4, 4), -1)])
def test_what_makes_no_histogram_is_refused(bins, largest):
    with pytest.raises(TransferFunctionError, match="lies between"):
        JointHistogram.of(noise(), bins, largest)
