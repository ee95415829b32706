"""NRRD files: poses by hand and against ITK, every encoding, and refusals."""

import bz2
import gzip

import numpy as np
import pytest
from volume_files import MARKED, SIZE, itk, marked, nrrd, refused, where_marked

from persp_sw.errors import FileError
from persp_sw.volume.files import load


# The marker is voxel (5, 1, 3); steps of 2, 3, 4 from (1, 2, 3) put it at (1 + 10, 2 + 3, 3 + 12)
# = (11, 5, 15) in the file's own space; LPS then turns the sign of R and A.
@pytest.mark.parametrize(
    ("space", "world", "letters"),
    [
        ("left-posterior-superior", (11, 5, 15), "LPS"),
        ("LPS", (11, 5, 15), "LPS"),
        ("right-anterior-superior", (-11, -5, 15), "RAS"),
        ("RAS", (-11, -5, 15), "RAS"),
        ("left-anterior-superior", (11, -5, 15), "LAS"),
        ("LAS", (11, -5, 15), "LAS"),
        ("scanner-xyz", (11, 5, 15), ""),
        ("3D-right-handed", (11, 5, 15), ""),
    ],
)
def test_spaces(tmp_path, space, world, letters):
    fields = (f"space: {space}", "space directions: (2,0,0) (0,3,0) (0,0,4)", "space origin: (1,2,3)")
    path = nrrd(tmp_path / "v.nrrd", marked(), *fields)
    volume = load(path)
    assert where_marked(volume) == pytest.approx(world)
    assert volume.orientation == letters and volume.spacing == (2, 3, 4)
    data, matrix = itk(path)
    assert np.array_equal(volume.data, data) and np.allclose(volume.world_from_object, matrix)


def test_left_handed_space_is_mirrored_once(tmp_path):
    fields = ("space: 3D-left-handed", "space directions: (2,0,0) (0,3,0) (0,0,4)", "space origin: (1,2,3)")
    assert where_marked(load(nrrd(tmp_path / "v.nrrd", marked(), *fields))) == pytest.approx((11, 5, -15))


@pytest.mark.parametrize(
    ("directions", "world", "letters"),
    [
        ("(-2,0,0) (0,3,0) (0,0,4)", (-9, 5, 15), "RPS"),  # mirrored: 1 - 10
        ("(0,0,-2) (3,0,0) (0,4,0)", (4, 14, -7), "ILP"),  # permuted: 1 + 3·1, 2 + 4·3, 3 - 2·5
        (
            "(1.2,1.6,0) (-2.4,1.8,0) (0,0,4)",
            (4.6, 11.8, 15),
            "PRS",
        ),  # turned by 53°: 1 + 6 - 2.4, 2 + 8 + 1.8
        ("(2,0,0) (1,3,0) (0,0,4)", (12, 5, 15), "LPS"),  # sheared
    ],
)
def test_directions(tmp_path, directions, world, letters):
    fields = ("space: LPS", f"space directions: {directions}", "space origin: (1,2,3)")
    path = nrrd(tmp_path / "v.nrrd", marked(), *fields)
    volume = load(path)
    assert where_marked(volume) == pytest.approx(world)
    assert volume.orientation == letters
    assert np.allclose(volume.world_from_object, itk(path)[1])


@pytest.mark.parametrize("fields", [(), ("spacings: 1 2 3",), ("space dimension: 3",)])
def test_no_space(tmp_path, fields):
    volume = load(nrrd(tmp_path / "v.nrrd", marked(), *fields))
    spacing = (1, 2, 3) if "spacings: 1 2 3" in fields else (1, 1, 1)
    assert where_marked(volume) == pytest.approx(np.multiply((5, 1, 3), spacing))
    assert volume.orientation == ""


RAS_TIME = (
    "space: right-anterior-superior-time",
    "space directions: (2,0,0,0) (0,3,0,0) (0,0,4,0) (0,0,0,7)",
)


@pytest.mark.parametrize(
    ("axis", "fields"),
    [
        (3, ()),
        (3, ("kinds: domain domain domain time",)),
        (3, ("kinds: domain domain domain list", "spacings: 1 1 1 nan")),
        (
            3,
            (
                "space: LPS",
                "space directions: (1,0,0) (0,1,0) (0,0,1) none",
                "kinds: domain domain domain list",
            ),
        ),
        (3, ("space: LPS", "space directions: (1,0,0) (0,1,0) (0,0,1) none")),
        (3, ("space: LPST", "space directions: (1,0,0,0) (0,1,0,0) (0,0,1,0) (0,0,0,9)")),
        (
            0,
            (
                "space: LPS",
                "space directions: none (1,0,0) (0,1,0) (0,0,1)",
                "kinds: list domain domain domain",
            ),
        ),
    ],
)
def test_frame_axes(tmp_path, axis, fields):
    frames = np.stack([marked(), marked() + 1000], axis=3 - axis)
    path = nrrd(tmp_path / "v.nrrd", frames, *fields)
    refused(path, "2 frames")
    assert np.array_equal(load(path, frame=1).data, marked() + 1000)
    assert where_marked(load(path, frame=0)) == pytest.approx((5, 1, 3))


def test_time_keeps_the_side(tmp_path):
    """ITK leaves such files in RAS."""
    path = nrrd(tmp_path / "v.nrrd", np.stack([marked()] * 2), *RAS_TIME, "space origin: (1,2,3,0)")
    volume = load(path, frame=0)
    assert where_marked(volume) == pytest.approx((-11, -5, 15)) and volume.orientation == "RAS"


@pytest.mark.parametrize(
    ("axis", "fields"),
    [
        (3, ("kinds: domain domain domain vector",)),
        (3, ("kinds: space space space 3-color",)),
        (0, ("kinds: vector domain domain domain",)),
        (2, ("kinds: domain domain covariant-vector domain",)),
        (
            0,
            (
                "space: LPS",
                "space directions: none (1,0,0) (0,1,0) (0,0,1)",
                "kinds: vector domain domain domain",
            ),
        ),
        (0, ("space: LPS", "space directions: none (1,0,0) (0,1,0) (0,0,1)")),
    ],
)
def test_component_axes(tmp_path, axis, fields):
    parts = np.stack([marked(), marked() + 1000, marked() + 2000], axis=3 - axis)
    path = nrrd(tmp_path / "v.nrrd", parts, *fields)
    refused(path, "3 components")
    assert np.array_equal(load(path, component=2).data, marked() + 2000)
    assert where_marked(load(path, component=0)) == pytest.approx((5, 1, 3))


def test_frames_of_components(tmp_path):
    data = np.arange(2 * 210 * 3, dtype="<i2").reshape(2, 5, 6, 7, 3)
    path = nrrd(tmp_path / "v.nrrd", data, "kinds: vector domain domain domain time")
    refused(path, "2 frames and 3 components")
    refused(path, "3 components", frame=1)
    assert np.array_equal(load(path, frame=1, component=2).data, data[1, ..., 2])


@pytest.mark.parametrize("packing", ["raw", "gzip", "gz", "bzip2", "hex", "ascii"])
@pytest.mark.parametrize("attached", [True, False])
def test_encodings(tmp_path, packing, attached):
    packed = packed_bytes(packing)
    if attached:
        path = nrrd(tmp_path / "v.nrrd", marked(), end=packed, encoding=packing)
    else:
        (tmp_path / "v.data").write_bytes(b"two\nlines\n" + packed)
        path = nrrd(
            tmp_path / "v.nhdr", marked(), "data file: v.data", "line skip: 2", end=b"\n", encoding=packing
        )
    assert np.array_equal(load(path).data, marked())
    shorter = packed_bytes(packing, marked().ravel()[:-4])
    target = path if attached else tmp_path / "v.data"
    target.write_bytes(target.read_bytes().replace(packed, shorter))
    refused(target if not attached else path, "420") if attached else refused_detached(path, target)


def packed_bytes(packing, data=None):
    data = marked() if data is None else data
    pack = {
        "gzip": gzip.compress,
        "gz": gzip.compress,
        "bzip2": bz2.compress,
        "hex": lambda b: b.hex().encode(),
    }
    if packing == "ascii":
        return " ".join(map(str, data.ravel())).encode()
    return pack.get(packing, bytes)(data.tobytes())


def refused_detached(path, target):
    with pytest.raises(FileError, match=f"{target.name}: truncated"):
        load(path)


@pytest.mark.parametrize("cut", [1, 9, 30, 200])
def test_truncated_gzip(tmp_path, cut):
    packed = gzip.compress(marked().tobytes())
    refused(nrrd(tmp_path / "v.nrrd", marked(), end=packed[:-cut], encoding="gzip"), "damaged or cut off")


def test_flipped_bit_in_gzip(tmp_path):
    for after in (b"", b"more than the voxels"):
        packed = bytearray(gzip.compress(marked().tobytes() + after, compresslevel=0))
        path = nrrd(tmp_path / "v.nrrd", marked(), end=bytes(packed), encoding="gzip")
        assert np.array_equal(load(path).data, marked())
        packed[100] ^= 1  # stored, not deflated: only the checksum can tell
        refused(nrrd(path, marked(), end=bytes(packed), encoding="gzip"), "damaged")


def test_spaces_in_vectors_and_names(tmp_path):
    """What pynrrd alone would not take, and Teem writes or reads."""
    fields = (
        *("Space: LPS", "spacedirections: ( 2, 0, 0 ) (0, 3, 0) (0,0,4)", "space origin: (1, 2, 3)"),
        *('space units: "mm" "mm" "m', "key:=value: and more", "kinds:space space space"),
    )
    volume = load(nrrd(tmp_path / "v.nrrd", marked(), *fields))
    assert where_marked(volume) == pytest.approx((11, 5, 15)) and volume.orientation == "LPS"


def test_one_file_per_slice(tmp_path):
    for z, plane in enumerate(marked()):
        (tmp_path / f"s{z + 1:02d}.raw").write_bytes(plane.tobytes())
    names = "\n".join(f"s{z + 1:02d}.raw" for z in range(5))
    listed = nrrd(tmp_path / "list.nhdr", marked(), f"data file: LIST\n{names}", end=b"\n")
    pattern = nrrd(tmp_path / "pattern.nhdr", marked(), "data file: s%02d.raw 1 5 1", end=b"\n")
    for path in (listed, pattern):
        assert np.array_equal(load(path).data, marked())
    (tmp_path / "s03.raw").unlink()
    for path in (listed, pattern):
        refused(path, "s03.raw is missing")


def test_detached_file_with_head(tmp_path):
    (tmp_path / "v.raw").write_bytes(b"x" * 13 + marked().tobytes())
    for skip in (13, -1):
        path = nrrd(tmp_path / "v.nhdr", marked(), "datafile: v.raw", f"byte skip: {skip}", end=b"\n")
        assert np.array_equal(load(path).data, marked())


@pytest.mark.parametrize(
    ("kind", "code"),
    [
        ("uchar", "u1"),
        ("int8", "i1"),
        ("unsigned short", "u2"),
        ("float", "f4"),
        ("double", "f8"),
        ("int", "i4"),
    ],
)
@pytest.mark.parametrize("order", ["little", "big"])
def test_types(tmp_path, kind, code, order):
    data = (marked("i8") % 100).astype(("<" if order == "little" else ">") + code)
    path = nrrd(tmp_path / "v.nrrd", data, kind=kind)
    path.write_bytes(path.read_bytes().replace(b"endian: little", f"endian: {order}".encode()))
    volume = load(path)
    assert np.array_equal(volume.data, data) and np.array_equal(itk(path)[0], data)
    assert volume.data.dtype == {"u1": "u1", "i1": "i2", "u2": "u2", "i4": "i2"}.get(code, "f4")


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        (("spacings: 0 1 2",), "(0.0, 1.0, 2.0)"),
        (("spacings: -1 1 2",), "(-1.0, 1.0, 2.0)"),
        (("spacings: nan 1 2",), "(nan, 1.0, 2.0)"),
        (("spacings: 1 2",), "spacings: 1 2"),
        (("spacings: a b c",), "spacings: a b c"),
        (("space: LPS", "space directions: (0,0,0) (0,1,0) (0,0,1)"), "(0.0, 1.0, 1.0)"),
        (("space: LPS", "space directions: (nan,0,0) (0,1,0) (0,0,1)"), "(nan, 1.0, 1.0)"),
        (("space: LPS", "space directions: (1,0,0) (0,1,0)"), "space directions"),
        (("space: LPS", "space directions: (1,0,0) (0,1) (0,0,1)"), "space directions"),
        (("space: LPS", "space directions: (1,0,0) (0,1,0) (0,0,1)", "space origin: (x)"), "space origin"),
        (("kinds: vector vector domain",), "1 spatial axes"),
        (("byte skip: many",), "byte skip"),
        (("no field",), "'no field'"),
    ],
)
def test_bad_fields(tmp_path, fields, words):
    refused(nrrd(tmp_path / "v.nrrd", marked(), *fields), words)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (b"sizes: 7 6 5", b"sizes: 7 6", "sizes 7 6"),
        (b"sizes: 7 6 5", b"sizes: 7 6 0", "sizes 7 6 0"),
        (b"sizes: 7 6 5", b"sizes: 7 6 9", "truncated: 756"),
        (b"sizes: 7 6 5", b"sizes: 7 6 999999999999", "truncated"),
        (b"type: int16", b"type: block", "type: block"),
        (b"encoding: raw", b"encoding: zrl", "encoding: zrl"),
        (b"dimension: 3\n", b"", "dimension None"),
    ],
)
def test_bad_headers(tmp_path, old, new, words):
    path = nrrd(tmp_path / "v.nrrd", marked())
    path.write_bytes(path.read_bytes().replace(old, new))
    refused(path, words)


def test_truncated_header(tmp_path):
    path = nrrd(tmp_path / "v.nrrd", marked())
    path.write_bytes(path.read_bytes()[:60])
    refused(path, "no end")


def test_missing_data_file(tmp_path):
    refused(
        nrrd(tmp_path / "v.nhdr", marked(), "data file: gone.raw", end=b"\n"), "gone.raw is missing", "beside"
    )


def test_values_of_the_marker(tmp_path):
    assert load(nrrd(tmp_path / "v.nrrd", marked())).data.max() == MARKED and SIZE == (7, 6, 5)
