"""DICOM folders that make no volume are refused, each by its own name."""

import numpy as np
import pytest
from dicom_writer import PIXELS, ULTRASOUND, dicom, slice_tags
from test_dicom import START, above, write_series
from volume_files import marked, refused

from persp_sw.errors import FileError
from persp_sw.volume.files import load


def write_at(folder, depths, **options):
    """Slices at these depths along S; the marker data have five."""
    folder.mkdir(exist_ok=True)
    for i, depth in enumerate(depths):
        tags = slice_tags(i, above(depth), **options)
        dicom(folder / f"im{i:03d}.dcm", marked()[i % 5], tags)
    return folder


@pytest.mark.parametrize(
    ("depths", "words"),
    [
        (
            [0, 2, 4, 8, 10],
            ("1 slice missing", "4 mm between im002.dcm and im003.dcm", "2 mm between others"),
        ),
        ([0, 2, 10, 12, 14], ("3 slices missing", "8 mm")),
        ([0, 2, 6], ("1 slice missing",)),
        ([0, 4, 6, 8, 10], ("1 slice missing",)),
        ([0, 2, 4.5, 7, 10], ("uneven spacing", "2 to 3 mm")),
        ([0, 1, 2.5, 5, 9], ("uneven spacing",)),
        ([0, 2, 2, 4, 6], ("1 of 5 slices lie where another lies", "im001.dcm and im002.dcm")),
        ([0, 0, 2, 2, 4, 4], ("3 of 6 slices", "phases")),
        ([0, 0, 0], ("2 of 3 slices",)),
    ],
)
def test_depths(tmp_path, depths, words):
    refused(write_at(tmp_path / "d", depths), *words)


@pytest.mark.parametrize("jitter", [0.0, 0.05, -0.05])
def test_rounded_positions_are_even(tmp_path, jitter):
    volume = load(write_at(tmp_path / "d", [0, 2, 4 + jitter, 6, 8]))
    assert volume.spacing[2] == 2


def test_gantry_tilt(tmp_path):
    folder = write_series(tmp_path / "d", step=(0, 0.5, 2))  # atan(0.5 / 2) = 14.0°
    refused(folder, "gantry tilt", "14.0°", "resample")


def test_sizes(tmp_path):
    folder = write_at(tmp_path / "d", [0, 2, 4])
    dicom(folder / "other.dcm", np.zeros((4, 4), "i2"), slice_tags(9, above(6)))
    refused(folder, "different sizes", "3 of 7×6, 1 of 4×4")


def test_orientations(tmp_path):
    folder = write_at(tmp_path / "d", [0, 2, 4])
    turned = slice_tags(9, above(6), orientation=(0, 1, 0, 0, 0, -1))
    dicom(folder / "other.dcm", marked()[0], turned)
    refused(folder, "different orientations", "other.dcm")


def test_pixel_spacings(tmp_path):
    folder = write_at(tmp_path / "d", [0, 2, 4])
    dicom(folder / "other.dcm", marked()[0], slice_tags(9, above(6), pixel=(0.75, 0.6)))
    refused(folder, "different pixel spacings", "other.dcm")


@pytest.mark.parametrize(
    ("tag", "words"),
    [("0020|0032", "no position"), ("0020|0037", "orientation"), ("0028|0030", "pixel spacings")],
)
def test_missing_geometry(tmp_path, tag, words):
    folder = write_at(tmp_path / "d", [0, 2, 4])
    dicom(folder / "other.dcm", marked()[0], slice_tags(9, above(6)) | {tag: None})
    refused(folder, words)


@pytest.mark.parametrize("spacing", ["0\\0.5", "-1\\0.5", "nan\\0.5"])
def test_bad_pixel_spacing(tmp_path, spacing):
    path = dicom(tmp_path / "v.dcm", marked()[0], slice_tags(0, START) | {"0028|0030": ("DS", spacing)})
    refused(path, "must be positive", "spacing=(x, y, z)")


def test_orientation_that_is_none(tmp_path):
    for orientation in ((0, 0, 0, 0, 0, 0), (1, 0, 0, 1, 0, 0), (2, 0, 0, 0, 2, 0)):
        path = dicom(tmp_path / "v.dcm", marked()[0], slice_tags(0, START, orientation=orientation))
        refused(path, "Image Orientation")


@pytest.mark.parametrize("cut", [2, 40, 84, 90, 96, 97, 200, 400])
def test_truncated_file(tmp_path, cut):
    folder = write_at(tmp_path / "d", [0, 2, 4])
    path = folder / "im002.dcm"
    path.write_bytes(path.read_bytes()[:-cut])
    for where in (folder, path):
        with pytest.raises(FileError, match=r"im002\.dcm: .*(truncated|damaged).*; "):
            load(where)


@pytest.mark.parametrize("after", [1, 3, 7, 8])  # 8: the head is whole, its value is not there
def test_cut_inside_the_head_of_an_element(tmp_path, after):
    """Nothing yet says that this would have been an image."""
    path = dicom(tmp_path / "v.dcm", marked()[0], slice_tags(0, START), sop=ULTRASOUND)
    whole = path.read_bytes()
    path.write_bytes(whole[: whole.index(b"\x08\x00\x60\x00") + after])
    refused(path, "truncated or damaged")


def test_too_few_pixels(tmp_path):
    """A well-formed file whose pixel element is short: GDCM fills it with whatever is in memory."""
    path = dicom(tmp_path / "v.dcm", marked()[0], slice_tags(0, START) | {PIXELS: ("OW", b"ab" * 20)})
    refused(path, "truncated", "40 of 84 bytes")


@pytest.mark.parametrize(
    ("syntax", "words"),
    [
        ("1.2.840.10008.1.2.4.201", "high-throughput JPEG 2000"),
        ("1.2.840.10008.1.2.4.102", "MPEG"),
        ("1.2.840.10008.1.2.4.112", "JPEG XL"),
        ("1.2.840.10008.1.2.4.90", "cannot be decoded"),  # JPEG 2000 is readable, but this stream is broken
        ("1.2.840.10008.1.2.4.50", "cannot be decoded"),
    ],
)
def test_compressed_pixels(tmp_path, syntax, words, capfd):
    stream = b"\xff\x4f\xff\x51" + bytes(range(60))
    path = dicom(tmp_path / "v.dcm", marked()[0], slice_tags(0, START), syntax=syntax, stream=stream)
    refused(path, words, syntax, "uncompressed")
    assert capfd.readouterr() == ("", "")  # the C codecs would have printed here


def test_readable_compression(tmp_path):
    """RLE, a stream made by hand: per byte plane one run-length segment (PS3.5 annex G)."""
    plane = np.full((6, 7), 1500, "<i2")
    high, low = 1500 >> 8, 1500 & 255
    segments = [bytes([257 - 42, high]), bytes([257 - 42, low])]
    head = np.array([2, 64, 66, *[0] * 13], "<u4").tobytes()
    tags = slice_tags(0, START)
    path = dicom(
        tmp_path / "v.dcm", plane, tags, syntax="1.2.840.10008.1.2.5", stream=head + b"".join(segments)
    )
    assert (load(path).data == 1500 - 1024).all()


@pytest.mark.parametrize("cut", [1, 4, 8, 20])
def test_truncated_compression(tmp_path, cut):
    """The last 8 bytes end the list of fragments; nothing else says that there are no more."""
    stream = b"\xff\x4f" + bytes(range(60))
    path = dicom(
        tmp_path / "v.dcm", marked()[0], slice_tags(0, START), syntax="1.2.840.10008.1.2.4.90", stream=stream
    )
    path.write_bytes(path.read_bytes()[:-cut])
    refused(path, "truncated or damaged")


def test_big_endian_of_32_bits(tmp_path):
    """GDCM swaps their bytes wrongly and says nothing."""
    path = dicom(tmp_path / "v.dcm", np.ones((6, 7), "u4"), slice_tags(0, START))
    whole = path.read_bytes().replace(b"1.2.840.10008.1.2.1\0", b"1.2.840.10008.1.2.2\0")
    start = whole.index(b"\x08\x00\x16\x00UI")
    path.write_bytes(whole[:start] + swapped(whole[start:]))
    refused(path, "32 bits in big-endian", "convert")


def swapped(data: bytes) -> bytes:
    """A flat explicit little-endian data set in big-endian order."""
    import struct

    out, at = b"", 0
    while at < len(data):
        group, number, vr, length = struct.unpack_from("<HH2sH", data, at)
        head = 8
        if vr in (b"OW", b"OB"):
            length, head = struct.unpack_from("<I", data, at + 8)[0], 12
        value = data[at + head : at + head + length]
        if vr == b"US":
            value = value[::-1]
        out += struct.pack(">HH2s", group, number, vr)
        out += struct.pack(">HI", 0, length) if head == 12 else struct.pack(">H", length)
        out, at = out + value, at + head + length
    return out


def test_tiff_and_dicom_in_one_folder(tmp_path):
    folder = write_at(tmp_path / "d", [0, 2])
    (folder / "a.tif").write_bytes(b"II*\0" + bytes(100))
    refused(folder, "DICOM (im00", "TIFF (a.tif)")
