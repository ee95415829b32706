"""NIfTI and ANALYZE files: poses by hand and against ITK, rescaling, and refusals."""

import gzip
import struct

import numpy as np
import pytest
from volume_files import MARKED, SIZE, itk, marked, nifti2_header, nifti_header, refused, where_marked

from persp_sw.volume.files import load

# In RAS the marker, voxel (5, 1, 3), lies at (2·5 + 1, 3·1 + 2, 4·3 + 3) = (11, 5, 15),
# in LPS at (-11, -5, 15).
SFORM = np.array([[2, 0, 0, 1], [0, 3, 0, 2], [0, 0, 4, 3.0]])


def write(path, header, data=None, gap=b""):
    body = bytes(header) + gap + (marked() if data is None else data).tobytes()
    path.write_bytes(gzip.compress(body) if path.name.endswith("gz") else body)
    return path


@pytest.mark.parametrize("name", ["v.nii", "v.nii.gz"])
@pytest.mark.parametrize("order", ["<", ">"])
def test_sform(tmp_path, name, order):
    path = write(tmp_path / name, nifti_header(sform=SFORM, order=order), marked(order + "i2"))
    volume = load(path)
    assert where_marked(volume) == pytest.approx((-11, -5, 15)) and volume.orientation == "RAS"
    assert volume.data.dtype == np.int16 and volume.spacing == (2, 3, 4) and volume.data.flags.carray
    data, matrix = itk(path)
    assert np.array_equal(volume.data, data) and np.allclose(volume.world_from_object, matrix, atol=1e-5)


def test_nifti2(tmp_path):
    """SimpleITK does not read these."""
    for order in "<>":
        path = write(tmp_path / "v.nii", nifti2_header(sform=SFORM, order=order), marked(order + "i2"))
        assert where_marked(load(path)) == pytest.approx((-11, -5, 15))
        assert np.array_equal(load(path).data, marked()) and load(path).orientation == "RAS"


@pytest.mark.parametrize(
    ("axes", "world", "letters"),
    [
        ([[-2, 0, 0], [0, 3, 0], [0, 0, 4]], (9, -5, 15), "LAS"),  # mirrored: R = 1 - 10
        ([[0, 3, 0], [0, 0, 4], [-2, 0, 0]], (-4, -14, -7), "IRA"),  # R = 1 + 3·1, A = 2 + 4·3, S = 3 - 2·5
        ([[1.2, -2.4, 0], [1.6, 1.8, 0], [0, 0, 4]], (-4.6, -11.8, 15), "ALS"),  # turned by 53°
    ],
)
def test_sform_directions(tmp_path, axes, world, letters):
    sform = np.column_stack([axes, (1, 2, 3)])
    path = write(tmp_path / "v.nii", nifti_header(sform=sform))
    volume = load(path)
    assert where_marked(volume) == pytest.approx(world, abs=1e-5) and volume.orientation == letters
    assert np.allclose(volume.world_from_object, itk(path)[1], atol=1e-5)


def test_sheared_sform(tmp_path):
    """ITK refuses it; a volume's pose may be sheared."""
    sform = np.array([[2, 1, 0, 1], [0, 3, 0, 2], [0, 0, 4, 3.0]])
    volume = load(write(tmp_path / "v.nii", nifti_header(sform=sform)))
    assert where_marked(volume) == pytest.approx((-12, -5, 15))  # R = 2·5 + 1·1 + 1


@pytest.mark.parametrize("qfac", [1, -1])
@pytest.mark.parametrize(
    "quatern", [(0, 0, 0), (0, 0, np.sqrt(0.5)), (0.5, 0.5, 0.5), (0.1, -0.2, 0.3), (1, 0, 0)]
)
def test_qform(tmp_path, qfac, quatern):
    header = nifti_header(pixdim=(qfac, 2, 3, 4), quatern=quatern, offset=(1, 2, 3))
    path = write(tmp_path / "v.nii", header)
    volume = load(path)
    assert np.allclose(volume.world_from_object, itk(path)[1], atol=1e-5)
    assert (np.linalg.det(volume.world_from_object[:3, :3]) > 0) == (qfac > 0)
    if quatern == (0, 0, 0):
        assert where_marked(volume) == pytest.approx((-11, -5, 3 + 12 * qfac))
    if quatern[2] == np.sqrt(0.5):  # a quarter turn from R to A: R = 1 - 3·1, A = 2 + 2·5
        assert where_marked(volume) == pytest.approx((2, -12, 3 + 12 * qfac), abs=1e-5)


def test_qform_where_sform_is_empty(tmp_path):
    header = nifti_header(pixdim=(1, 2, 3, 4), quatern=(0, 0, 0), offset=(1, 2, 3), sform=np.zeros((3, 4)))
    assert where_marked(load(write(tmp_path / "v.nii", header))) == pytest.approx((-11, -5, 15))


def test_no_pose(tmp_path):
    volume = load(write(tmp_path / "v.nii", nifti_header(pixdim=(1, 2, 3, 4))))
    assert where_marked(volume) == pytest.approx((10, 3, 12)) and volume.orientation == ""


@pytest.mark.parametrize(("units", "scale"), [(0, 1), (1, 1000), (2, 1), (3, 0.001), (2 + 8, 1)])
def test_units(tmp_path, units, scale):
    volume = load(write(tmp_path / "v.nii", nifti_header(sform=SFORM, units=units)))
    assert where_marked(volume) == pytest.approx(np.array((-11, -5, 15)) * scale)
    volume = load(write(tmp_path / "q.nii", nifti_header(units=units)))
    assert volume.spacing == pytest.approx(np.array((2, 3, 4)) * scale)


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("magic", [b"ni1\0", b"\0\0\0\0"])
def test_pairs(tmp_path, magic, packed):
    header = bytes(nifti_header(sform=SFORM, magic=magic, voxels=0))[:348]
    pack, tail = (gzip.compress, ".gz") if packed else (bytes, "")
    (tmp_path / f"v.hdr{tail}").write_bytes(pack(header))
    (tmp_path / f"v.img{tail}").write_bytes(pack(marked().tobytes()))
    for name in (f"v.hdr{tail}", f"v.img{tail}"):
        volume = load(tmp_path / name)
        assert np.array_equal(volume.data, marked()) and volume.name == "v"
        if magic == b"ni1\0":
            assert where_marked(volume) == pytest.approx((-11, -5, 15))
        else:  # ANALYZE states no pose
            assert where_marked(volume) == pytest.approx((10, 3, 12)) and volume.orientation == ""
    (tmp_path / f"v.img{tail}").write_bytes(pack(marked().tobytes()[:-8]))
    refused_image(tmp_path / f"v.hdr{tail}")
    (tmp_path / f"v.img{tail}").unlink()
    refused(tmp_path / f"v.hdr{tail}", f"v.img{tail} is missing")


def refused_image(path):
    from persp_sw.errors import FileError

    with pytest.raises(FileError, match=r"v\.img.*truncated"):
        load(path)


@pytest.mark.parametrize(
    ("dtype", "scale", "kept"),
    [
        ("i2", (1, -1024), "i2"),
        ("u2", (1, -1024), "i2"),
        ("i2", (2, 0), "i2"),
        ("i2", (1, 40000), "u2"),
        ("i2", (100, 0), "f4"),  # up to 90000
        ("i2", (0.5, 0), "f4"),
        ("u1", (1, 1000), "i2"),
        ("f4", (2, 1), "f4"),
        ("i2", (0, 5), "i2"),  # a slope of 0 means none
        ("i2", (np.nan, 0), "i2"),
    ],
)
def test_rescale(tmp_path, dtype, scale, kept):
    code = {"u1": 2, "i2": 4, "f4": 16, "u2": 512}[dtype]
    data = (marked("i4") % 256 if dtype == "u1" else marked("i4")).astype("<" + dtype)
    volume = load(write(tmp_path / "v.nii", nifti_header(datatype=code, scale=scale), data))
    slope, intercept = scale if scale[0] > 0 else (1, 0)
    assert volume.data.dtype == np.dtype(kept)
    assert np.array_equal(volume.data, (data.astype(float) * slope + intercept).astype("f4"))


def test_frames_and_components(tmp_path):
    data = np.stack([marked(), marked() + 1000])
    path = write(tmp_path / "v.nii", nifti_header((*SIZE, 2)), data)
    refused(path, "2 frames")
    assert np.array_equal(load(path, frame=1).data, data[1])
    path = write(tmp_path / "w.nii", nifti_header((*SIZE, 1, 2)), data)  # the fifth size counts components
    refused(path, "2 components")
    assert np.array_equal(load(path, component=1).data, data[1])
    assert load(write(tmp_path / "x.nii", nifti_header((*SIZE, 1)))).size == SIZE
    rgb = np.stack([marked() % 256, marked() // 4, marked() // 5], axis=-1).astype("u1")
    path = write(tmp_path / "c.nii", nifti_header(datatype=128), rgb)
    refused(path, "3 components")
    assert np.array_equal(load(path, component=2).data, rgb[..., 2])
    path = write(tmp_path / "d.nii", nifti_header(datatype=128, scale=(2, 1)), rgb)
    length = np.linalg.norm(2.0 * rgb + 1, axis=-1)  # of the rescaled components
    assert np.allclose(load(path, component="magnitude").data, length, rtol=1e-6)


@pytest.mark.parametrize("ending", ["nii", "nii.gz"])
@pytest.mark.parametrize("cut", [2, 60, 419])
def test_truncated(tmp_path, ending, cut):
    """ITK fills such files up with zeros."""
    path = tmp_path / f"v.{ending}"
    body = (bytes(nifti_header(sform=SFORM)) + marked().tobytes())[:-cut]
    path.write_bytes(gzip.compress(body) if ending == "nii.gz" else body)
    refused(path, "truncated: 420", str(420 - cut))
    if ending == "nii.gz":
        write(path, nifti_header(sform=SFORM))
        path.write_bytes(path.read_bytes()[: -min(cut, 200)])
        refused(path, "damaged or cut off")


def test_voxels_further_on(tmp_path):
    for name in ("v.nii", "v.nii.gz"):
        path = write(tmp_path / name, nifti_header(voxels=352 + 33), gap=b"e" * 33)
        assert np.array_equal(load(path).data, marked()) and load(path).data.flags.carray


@pytest.mark.parametrize("spacing", [0, -1, np.nan, np.inf])
def test_bad_spacing(tmp_path, spacing):
    for options in ({}, {"quatern": (0, 0, 0)}):
        path = write(tmp_path / "v.nii", nifti_header(pixdim=(1, spacing, 3, 4), **options))
        refused(path, f"({float(spacing)}, 3.0, 4.0)", "spacing=(x, y, z)")
        assert load(path, spacing=(2, 3, 4)).spacing == (2, 3, 4)
    path = write(tmp_path / "s.nii", nifti_header(pixdim=(1, spacing, 3, 4), sform=SFORM))
    assert load(path).spacing == (2, 3, 4)  # the sform does not need it


def test_bad_headers(tmp_path):
    for name in ("far.nii", "far.nii.gz"):
        refused(write(tmp_path / name, nifti_header(voxels=1e18)), "again")
    path = write(tmp_path / "v.nii", nifti_header(datatype=1536))
    refused(path, "data type 1536")
    header = nifti_header()
    struct.pack_into("<h", header, 42, -7)
    refused(write(path, header), "sizes [-7, 6, 5]")
    struct.pack_into("<h", header, 40, 0)
    refused(write(path, header), "sizes [0]")
    header = nifti_header()
    struct.pack_into("<f", header, 108, np.nan)
    refused(write(path, header), "byte nan")
    path.write_bytes(bytes(nifti_header())[:300])
    refused(path, "too short")
    refused(write(path, nifti_header(magic=b"\0\0\0\0")), "is not a NIfTI")  # ANALYZE comes in pairs
    refused(write(path, nifti_header(quatern=(1, 1, 1))), "header is damaged")
    refused(write(path, nifti_header(scale=(2, np.inf))), "intercept")


def test_header_is_taken_as_it_is(tmp_path, capfd):
    """nibabel would put a spacing of its own for a bad one, and say so on the terminal."""
    header = nifti_header(pixdim=(0, 2, 3, 4), quatern=(0, 0, 0))  # a qfac of 0 counts as 1
    assert where_marked(load(write(tmp_path / "v.nii", header))) == pytest.approx((-10, -3, 12))
    assert capfd.readouterr() == ("", "")


def test_marker(tmp_path):
    assert load(write(tmp_path / "v.nii", nifti_header())).value_range == (1.0, float(MARKED))
