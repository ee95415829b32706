"""TIFF stacks: axes, spacing, folders, compression without optional packages, and refusals."""

import numpy as np
import pytest
import tifffile
from PIL import Image
from volume_files import MARK, marked, refused, where_marked

from persp_sw.volume.files import load

STACK = {"photometric": "minisblack"}


@pytest.mark.parametrize("dtype", ["u1", "<u2", ">u2", "<f4", "<i2"])
@pytest.mark.parametrize("compression", [None, "zlib"])
@pytest.mark.parametrize("metadata", [None, {}])
def test_many_pages(tmp_path, dtype, compression, metadata):
    data = (marked("i8") % 251).astype(dtype)
    path = tmp_path / "v.tif"
    tifffile.imwrite(
        path,
        data,
        compression=compression,
        metadata=metadata,
        byteorder=dtype[0] if dtype[0] == ">" else None,
        **STACK,
    )
    volume = load(path)
    assert np.array_equal(volume.data, data) and volume.data.dtype == np.dtype(dtype).newbyteorder("=")
    assert volume.spacing == (1, 1, 1) and volume.orientation == ""


def test_pages_written_one_by_one(tmp_path):
    with tifffile.TiffWriter(tmp_path / "v.tiff") as file:
        for plane in marked():
            file.write(plane, contiguous=False, metadata=None)
    calls = []
    assert np.array_equal(load(tmp_path / "v.tiff", progress=lambda *c: calls.append(c)).data, marked())
    assert (5, 5, "reading TIFF") in calls


def test_imagej_spacing(tmp_path):
    """2 and 4 pixels per µm are 0.5 and 0.25 µm a pixel; the spacing of slices is stated."""
    path = tmp_path / "v.tif"
    metadata = {"spacing": 3.0, "unit": "um", "axes": "ZYX"}
    tifffile.imwrite(path, marked("u2"), imagej=True, resolution=(2, 4), metadata=metadata)
    volume = load(path)
    assert volume.spacing == pytest.approx((0.5, 0.25, 3))
    assert where_marked(volume) == pytest.approx((2.5, 0.25, 9))


def test_ome_spacing(tmp_path):
    sizes = {"PhysicalSizeX": 0.5, "PhysicalSizeY": 0.25, "PhysicalSizeZ": 3000.0}
    units = {"PhysicalSizeXUnit": "µm", "PhysicalSizeYUnit": "µm", "PhysicalSizeZUnit": "nm"}
    path = tmp_path / "v.ome.tif"
    tifffile.imwrite(path, marked("u2"), metadata={"axes": "ZYX", **sizes, **units}, **STACK)
    assert load(path).spacing == pytest.approx((0.5, 0.25, 3))  # 3000 nm in the unit of x
    tifffile.imwrite(path, marked("u2"), metadata={"axes": "ZYX", "PhysicalSizeX": 0.5}, **STACK)
    assert load(path).spacing == pytest.approx((0.5, 0.5, 0.5))


@pytest.mark.parametrize(
    ("unit", "spacing"),
    [("INCH", (0.254, 0.127, 0.254)), ("CENTIMETER", (0.1, 0.05, 0.1)), ("NONE", (1, 0.5, 1))],
)
def test_resolution_tags(tmp_path, unit, spacing):
    path = tmp_path / "v.tif"
    tifffile.imwrite(path, marked("u2"), resolution=(100, 200), resolutionunit=unit, metadata=None, **STACK)
    assert load(path).spacing == pytest.approx(spacing)


@pytest.mark.parametrize("spacing", ["0", "nan"])
def test_bad_spacing(tmp_path, spacing):
    path = tmp_path / "v.tif"
    tifffile.imwrite(path, marked("u2"), imagej=True, metadata={"spacing": float(spacing), "axes": "ZYX"})
    refused(path, "spacing", "spacing=(x, y, z)")


def test_hyperstack(tmp_path):
    data = np.arange(2 * 5 * 3 * 6 * 7, dtype="u2").reshape(2, 5, 3, 6, 7)
    path = tmp_path / "v.tif"
    tifffile.imwrite(path, data, imagej=True, metadata={"axes": "TZCYX"})
    refused(path, "2 frames and 3 components")
    assert np.array_equal(load(path, frame=1, component=2).data, data[1, :, 2])
    tifffile.imwrite(path, data[:, :, 0], imagej=True, metadata={"axes": "TZYX"})
    refused(path, "2 frames")
    assert np.array_equal(load(path, frame=0).data, data[0, :, 0])
    tifffile.imwrite(path, data[:, 0, 0], imagej=True, metadata={"axes": "TYX"})
    assert load(path).size == (7, 6, 2)  # no Z: the frames are slices


def test_colour(tmp_path):
    data = np.arange(5 * 6 * 7 * 3, dtype="u2").reshape(5, 6, 7, 3).astype("u1")
    path = tmp_path / "v.tif"
    tifffile.imwrite(path, data, photometric="rgb")
    refused(path, "3 components")
    assert np.array_equal(load(path, component=1).data, data[..., 1])


def test_one_page(tmp_path):
    tifffile.imwrite(tmp_path / "v.tif", marked("u2")[0])
    assert load(tmp_path / "v.tif").size == (7, 6, 1)


def test_folder_in_natural_order(tmp_path):
    for z in range(12):
        plane = np.full((6, 7), z, "u2")
        plane[MARK[1], MARK[0]] = 900 if z == 10 else z
        tifffile.imwrite(tmp_path / f"slice {z}.tif", plane, resolution=(10, 10), resolutionunit="CENTIMETER")
    (tmp_path / "notes.txt").write_text("not a page")
    calls = []
    volume = load(tmp_path, progress=lambda *c: calls.append(c))
    assert volume.data[:, 0, 0].tolist() == list(range(12))  # slice 10 is after slice 9
    assert where_marked(volume) == pytest.approx((5, 1, 10))  # 10 pixels per cm: 1 mm
    assert calls[-1] == (12, 12, "reading TIFF") and volume.name == tmp_path.name


def test_folder_refusals(tmp_path):
    for z in range(3):
        tifffile.imwrite(tmp_path / f"{z}.tif", marked("u2")[z])
    tifffile.imwrite(tmp_path / "3.tif", marked("u2")[0, :5])
    assert "3.tif" in refused(tmp_path, "(5, 7)", "unlike 0.tif")
    tifffile.imwrite(tmp_path / "3.tif", marked("u2")[0].astype("u1"))
    assert "3.tif" in refused(tmp_path, "uint8")
    tifffile.imwrite(tmp_path / "3.tif", marked("u2"), **STACK)
    assert "3.tif" in refused(tmp_path, "5 pages")


def test_folder_of_colour(tmp_path):
    for z in range(3):
        tifffile.imwrite(
            tmp_path / f"{z}.tif", np.full((6, 7, 3), (z, 10 + z, 20 + z), "u1"), photometric="rgb"
        )
    refused(tmp_path, "3 components")
    assert load(tmp_path, component=1).data[:, 0, 0].tolist() == [10, 11, 12]


@pytest.mark.parametrize("dtype", ["u1", "u2", "f4"])
def test_lzw_needs_no_optional_package(tmp_path, dtype):
    data = marked(dtype) if dtype != "u1" else (marked() % 256).astype("u1")
    pages = [Image.fromarray(plane) for plane in data]
    path = tmp_path / "v.tif"
    pages[0].save(path, save_all=True, append_images=pages[1:], compression="tiff_lzw")
    volume = load(path)
    assert np.array_equal(volume.data, data) and volume.data.dtype == np.dtype(dtype)


def test_several_images(tmp_path):
    with tifffile.TiffWriter(tmp_path / "v.tif") as file:
        for i in range(3):
            file.write(marked("u2")[i, :, : 7 - i], contiguous=False, metadata=None)
    refused(tmp_path / "v.tif", "3 images of their own")


@pytest.mark.parametrize("keep", [0.1, 0.3, 0.5, 0.7, 0.9])
@pytest.mark.parametrize("how", ["plain", "imagej", "zlib"])
def test_truncated(tmp_path, keep, how, capfd):
    path = tmp_path / "v.tif"
    options = {
        "plain": {"metadata": None, **STACK},
        "imagej": {"imagej": True, "metadata": {"axes": "ZYX"}},
        "zlib": {"compression": "zlib", "metadata": None, **STACK},
    }[how]
    data = np.random.default_rng(1).integers(0, 60000, (5, 60, 70), "u2")
    tifffile.imwrite(path, data, **options)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(keep * len(whole))])
    refused(path, "truncated or damaged")
    assert capfd.readouterr() == ("", "")  # tifffile's log stays off the terminal
