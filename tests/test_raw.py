"""Raw files, whose shape the caller states, and numpy's .npy."""

import pickle

import numpy as np
import pytest
from volume_files import SIZE, marked, refused, where_marked

from persp_sw.volume.files import load


@pytest.mark.parametrize("name", ["v.raw", "v.bin", "v.dat", "v"])
@pytest.mark.parametrize("order", ["little", "big"])
def test_raw(tmp_path, name, order):
    path = tmp_path / name
    path.write_bytes(b"header" + marked("<u2" if order == "little" else ">u2").tobytes())
    volume = load(path, shape=SIZE, dtype="uint16", byte_order=order, header_bytes=6, spacing=(1, 2, 3))
    assert volume.data.dtype == np.uint16 and volume.size == SIZE and volume.orientation == ""
    assert np.array_equal(volume.data, marked("u2"))
    assert where_marked(volume).tolist() == [5, 2, 9]  # index (5, 1, 3) times spacing
    assert volume.data.flags.carray


def test_raw_refusals(tmp_path):
    path = tmp_path / "v.raw"
    path.write_bytes(marked().tobytes())
    refused(path, "shape=", "dtype=")
    refused(path, "dtype= is not given", shape=SIZE)
    refused(path, "shape= is not given", dtype="int16")
    refused(path, "420 bytes", "7×6×4 voxels of int16 need 336", shape=(7, 6, 4), dtype="int16")
    refused(path, "424", "header_bytes=", shape=SIZE, dtype="int16", header_bytes=4)
    refused(path, "three whole numbers", shape=(7, 6), dtype="int16")
    refused(path, "three whole numbers", shape=(7, 6, 0), dtype="int16")
    refused(path, "three whole numbers", shape=(7, 6, 2.5), dtype="int16")
    refused(path, "three whole numbers", shape=7, dtype="int16")
    refused(path, "complex64", shape=SIZE, dtype="complex64")
    refused(path, "nonsense", shape=SIZE, dtype="nonsense")
    refused(path, "'middle'", shape=SIZE, dtype="int16", byte_order="middle")
    refused(path, "-1", shape=SIZE, dtype="int16", header_bytes=-1)


@pytest.mark.parametrize("dtype", ["u1", "<i2", ">i2", "<u2", "<f4", ">f4", "<f8", "i1", "?", "<i4", "<u8"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_npy(tmp_path, dtype, order):
    data = marked("i8") % 100
    np.save(tmp_path / "v.npy", np.asarray(data.astype(dtype), order=order))
    volume = load(tmp_path / "v.npy")
    assert np.array_equal(volume.data, data.astype(dtype)) and volume.size == SIZE
    kept = {
        "u1": "u1",
        "<i2": "i2",
        ">i2": "i2",
        "<u2": "u2",
        "i1": "i2",
        "?": "u1",
        "<i4": "i2",
        "<u8": "i2",
    }
    assert volume.data.dtype == np.dtype(kept.get(dtype, "f4"))
    assert volume.data.flags.carray


class Grenade:
    def __reduce__(self):
        return pytest.fail, ("a pickle was executed",)


def test_npy_refusals(tmp_path):
    path = tmp_path / "v.npy"
    np.save(path, np.array([{}, []], object), allow_pickle=True)
    refused(path, "Python objects")
    path.write_bytes(pickle.dumps(Grenade()))
    refused(path, "not a .npy array")  # and not executed
    for array in (
        np.zeros((4, 4)),
        np.zeros((2, 3, 3, 3)),
        np.zeros((2, 2, 2), complex),
        np.zeros(5, "i4,f4"),
    ):
        np.save(path, array)
        refused(path, "[z, y, x]")
    np.save(path, marked())
    path.write_bytes(path.read_bytes()[:-2])
    refused(path, "truncated")
