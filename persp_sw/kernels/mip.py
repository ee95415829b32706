"""Kernel that makes a coarser volume; weights come from `volume/mip.py`."""

import numpy as np

from .._jit import kernel, parallel_kernel, prange

TAPS = 5  # finer voxels that a coarse one may depend on, along one axis
_F = np.float32


@kernel
def first_tap(m, stride):
    """The finer voxel of the first weight of coarse voxel m: 2m − 3 where voxels are halved, m where not."""
    return stride * m - 3 * (stride - 1)


@kernel
def _add_row(row, weight, sums):
    for x in range(np.uint64(row.shape[0])):
        sums[x] += weight * _F(row[x])


@kernel
def _add_row_with_holes(row, weight, sums, shares):
    for x in range(np.uint64(row.shape[0])):
        voxel = _F(row[x])
        there = voxel == voxel
        sums[x] += weight * (voxel if there else _F(0.0))
        shares[x] += weight if there else _F(0.0)


@parallel_kernel
def coarsen(fine, strides, weights_z, weights_y, weights_x, holes, whole, coarse):
    """Weighted means of the voxels around each coarse one.

    Parameters
    ----------
    fine
        [z, y, x], contiguous.
    strides
        int64 (3,), for z, y and x: 2 where voxels are halved, else 1.
    weights_z, weights_y, weights_x
        float32 [coarse voxels, `TAPS`]: of finer voxels from `first_tap` on; 0 beyond the volume.
    holes
        Whether there may be NaN. They are left out of the means, which are NaN only where nothing is left.
    whole
        Whether to round to the nearest integer, of two to the even one.
    coarse
        [z, y, x] of the type of `fine`; overwritten.
    """
    n_x = fine.shape[2]
    stride_z, stride_y, stride_x = strides[0], strides[1], strides[2]
    margin = -first_tap(0, stride_x)
    for z in prange(coarse.shape[0]):
        # Room on both sides for the taps of the first and last voxel along x, which weigh nothing there.
        sums = np.zeros(n_x + 2 * TAPS, np.float32)
        shares = np.ones(n_x + 2 * TAPS, np.float32)
        sums_inside, shares_inside = sums[margin : margin + n_x], shares[margin : margin + n_x]
        for y in range(coarse.shape[1]):
            sums[:] = _F(0.0)
            if holes:
                shares[:] = _F(0.0)
            for tap_z in range(TAPS):
                for tap_y in range(TAPS):
                    weight = weights_z[z, tap_z] * weights_y[y, tap_y]
                    if weight > _F(0.0):
                        row = fine[first_tap(z, stride_z) + tap_z, first_tap(y, stride_y) + tap_y]
                        if holes:
                            _add_row_with_holes(row, weight, sums_inside, shares_inside)
                        else:
                            _add_row(row, weight, sums_inside)
            for x in range(coarse.shape[2]):
                total, share = _F(0.0), _F(0.0)
                for tap in range(TAPS):
                    at = np.uint64(stride_x * x + tap)
                    total += weights_x[x, tap] * sums[at]
                    share += weights_x[x, tap] * shares[at]
                mean = total / share if holes else total
                coarse[z, y, x] = np.rint(mean) if whole else mean
