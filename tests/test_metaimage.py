"""MetaImage files: poses by hand and against ITK, detached data, and refusals."""

import zlib

import numpy as np
import pytest
from volume_files import itk, marked, metaimage, refused, where_marked

from persp_sw.errors import FileError
from persp_sw.volume.files import load

PLACE = ("ElementSpacing = 2 3 4", "Offset = 1 2 3", "AnatomicalOrientation = RAI")


# The marker is voxel (5, 1, 3): steps of 2·5, 3·1 and 4·3 along the rows of TransformMatrix, from (1, 2, 3).
@pytest.mark.parametrize(
    ("turn", "world", "letters"),
    [
        ("1 0 0 0 1 0 0 0 1", (11, 5, 15), "LPS"),
        ("-1 0 0 0 1 0 0 0 1", (-9, 5, 15), "RPS"),
        ("0 1 0 -1 0 0 0 0 1", (-2, 12, 15), "PRS"),  # x steps along P: 2 + 10; y along R: 1 - 3
        ("0.6 0.8 0 -0.8 0.6 0 0 0 1", (4.6, 11.8, 15), "PRS"),  # 1 + 6 - 2.4, 2 + 8 + 1.8
    ],
)
def test_pose(tmp_path, turn, world, letters):
    path = metaimage(tmp_path / "v.mha", marked(), f"TransformMatrix = {turn}", *PLACE)
    volume = load(path)
    assert where_marked(volume) == pytest.approx(world)
    assert volume.orientation == letters and volume.spacing == pytest.approx((2, 3, 4))
    data, matrix = itk(path)
    assert np.array_equal(volume.data, data) and np.allclose(volume.world_from_object, matrix)


def test_no_pose(tmp_path):
    volume = load(metaimage(tmp_path / "v.mha", marked()))
    assert where_marked(volume) == pytest.approx((5, 1, 3)) and volume.orientation == ""
    volume = load(metaimage(tmp_path / "v.mha", marked(), "ElementSize = 1 2 3", "Position = 1 1 1"))
    assert where_marked(volume) == pytest.approx((6, 3, 10)) and volume.orientation == ""


def test_itk_writes_what_we_read(tmp_path):
    import SimpleITK as sitk

    image = sitk.GetImageFromArray(marked("<u2"))
    image.SetSpacing((2, 3, 4))
    image.SetOrigin((1, 2, 3))
    image.SetDirection((0, 0, 1, -1, 0, 0, 0, -1, 0))
    for name, packed in (
        ("a.mha", 0),
        ("b.mha", 1),
        ("c.mhd", 0),
        ("d.mhd", 1),
        ("e.nrrd", 1),
        ("f.nhdr", 1),
    ):
        sitk.WriteImage(image, str(tmp_path / name), useCompression=bool(packed))
        volume = load(tmp_path / name)
        assert np.array_equal(volume.data, marked("<u2")) and volume.data.dtype == np.uint16
        assert where_marked(volume) == pytest.approx((13, -8, 0))  # 1 + 4·3, 2 - 2·5, 3 - 3·1
        assert volume.orientation == "AIL"


@pytest.mark.parametrize("key", ["BinaryDataByteOrderMSB", "ElementByteOrderMSB"])
def test_big_endian(tmp_path, key):
    path = metaimage(tmp_path / "v.mha", marked(">i2"), f"{key} = True")
    assert np.array_equal(load(path).data, marked()) and load(path).data.dtype == np.int16


@pytest.mark.parametrize(
    ("kind", "code"), [("UCHAR", "u1"), ("CHAR", "i1"), ("USHORT", "u2"), ("FLOAT", "f4"), ("LONG", "i4")]
)
def test_types(tmp_path, kind, code):
    data = (marked("i8") % 100).astype(code)
    assert np.array_equal(load(metaimage(tmp_path / "v.mha", data, kind=f"MET_{kind}")).data, data)


def test_detached(tmp_path):
    (tmp_path / "v.raw").write_bytes(b"x" * 9 + marked().tobytes())
    for skip in (9, -1):
        path = metaimage(tmp_path / "v.mhd", marked(), f"HeaderSize = {skip}", name="v.raw")
        assert np.array_equal(load(path).data, marked())
    (tmp_path / "v.zraw").write_bytes(zlib.compress(marked().tobytes()))
    path = metaimage(tmp_path / "z.mhd", marked(), "CompressedData = True", name="v.zraw")
    assert np.array_equal(load(path).data, marked())
    (tmp_path / "v.txt").write_text(" ".join(map(str, marked().ravel())))
    path = metaimage(tmp_path / "t.mhd", marked(), "BinaryData = False", name="v.txt")
    assert np.array_equal(load(path).data, marked())
    refused(metaimage(tmp_path / "m.mhd", marked(), name="gone.raw"), "gone.raw is missing", "beside")


def test_one_file_per_slice(tmp_path):
    for z, plane in enumerate(marked()):
        (tmp_path / f"s{z + 1:02d}.raw").write_bytes(plane.tobytes())
    names = "LIST\n" + "\n".join(f"s{z + 1:02d}.raw" for z in range(5))
    for name in (names, "s%02d.raw 1 5 1"):
        assert np.array_equal(load(metaimage(tmp_path / "v.mhd", marked(), name=name)).data, marked())
    refused(metaimage(tmp_path / "v.mhd", marked(), name="s%02d.raw 1 6"), "s06.raw is missing")
    refused(metaimage(tmp_path / "v.mhd", marked(), name="s%02d.raw 1 4"), "evenly over 4 files")
    refused(metaimage(tmp_path / "v.mhd", marked(), name="s%02d.raw a b"), "names no file")


def test_frames(tmp_path):
    data = np.stack([marked(), marked() + 1000])
    path = metaimage(tmp_path / "v.mha", data, "ElementSpacing = 2 3 4 9")
    refused(path, "2 frames")
    assert np.array_equal(load(path, frame=1).data, data[1])
    assert where_marked(load(path, frame=0)) == pytest.approx((10, 3, 12))


@pytest.mark.parametrize("cut", [2, 60])
def test_truncated(tmp_path, cut, capfd):
    path = metaimage(tmp_path / "v.mha", marked())
    path.write_bytes(path.read_bytes()[:-cut])
    refused(path, "truncated: 420", str(420 - cut))
    packed = zlib.compress(marked().tobytes())[:-cut]
    path = metaimage(
        tmp_path / "z.mha", np.frombuffer(packed, "u1"), "CompressedData = True", sizes=(7, 6, 5)
    )
    refused(path, "damaged or cut off")
    (tmp_path / "v.raw").write_bytes(marked().tobytes()[:-cut])
    with pytest.raises(FileError, match=r"v\.raw: truncated"):
        load(metaimage(tmp_path / "d.mhd", marked(), name="v.raw"))
    assert capfd.readouterr() == ("", "")  # MetaIO would have printed here


@pytest.mark.parametrize("spacing", ["0 1 2", "-1 1 2", "nan 1 2", "inf 1 2"])
def test_bad_spacing(tmp_path, spacing):
    path = metaimage(tmp_path / "v.mha", marked(), f"ElementSpacing = {spacing}")
    refused(path, "spacing (", "spacing=(x, y, z)")
    assert load(path, spacing=(1, 1, 2)).spacing == (1, 1, 2)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (b"ElementSpacing = 2 3 4", b"ElementSpacing = 2 3", "ElementSpacing = 2 3"),
        (b"ElementSpacing = 2 3 4", b"ElementSpacing = a b c", "ElementSpacing = a b c"),
        (b"DimSize = 7 6 5", b"DimSize = 7 6", "DimSize = 7 6"),
        (b"DimSize = 7 6 5", b"DimSize = 7 6 0", "[7, 6, 0]"),
        (b"DimSize = 7 6 5", b"DimSize = 7 6 -5", "[7, 6, -5]"),
        (b"DimSize = 7 6 5", b"DimSize = 7 6 nan", "DimSize = 7 6 nan"),
        (b"DimSize = 7 6 5", b"DimSize = 7 6 50000000", "truncated"),
        (b"NDims = 3", b"NDims = 9", "NDims = 9"),
        (b"MET_SHORT", b"MET_OTHER", "MET_OTHER"),
        (b"ElementDataFile = LOCAL", b"ElementDataFile = ", "names no file"),
        (b"ElementDataFile", b"ElementDataFail", "ElementDataFile"),
    ],
)
def test_bad_headers(tmp_path, old, new, words):
    path = metaimage(tmp_path / "v.mha", marked(), *PLACE)
    assert old in path.read_bytes()
    path.write_bytes(path.read_bytes().replace(old, new))
    refused(path, words)
