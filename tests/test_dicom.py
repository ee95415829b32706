"""DICOM series that make a volume: order, pose, rescaling, choice; all by hand."""

import numpy as np
import pytest
from dicom_writer import CT, ENHANCED_CT, IMPLICIT, PIXELS, dicom, enhanced_tags, slice_tags
from volume_files import MARKED, marked, refused, where_marked

from persp_sw.errors import FileError
from persp_sw.volume.dicom_series import list_series
from persp_sw.volume.files import load

START = np.array((10.0, 20.0, 30.0))


def above(depth):
    """Position of a slice `depth` mm above the first."""
    return START + np.array((0, 0, depth))


def write_series(
    folder,
    data=None,
    *,
    step=(0, 0, 2),
    order=None,
    slopes=None,
    shift=1024,
    syntax="1.2.840.10008.1.2.1",
    prefix="im",
    **tags,
):
    """One file a slice, names against positions; `data` [z, y, x] is what is read, where slopes are 1."""
    folder.mkdir(exist_ok=True)
    data = marked("<i2") if data is None else data
    for z, plane in enumerate(data):
        slope = slopes[z] if slopes else "1"
        position = START + z * np.array(step)
        written = slice_tags(z, position, slope=slope, **tags)
        dicom(
            folder / f"{prefix}{len(data) - z:03d}.dcm",
            plane + plane.dtype.type(shift),
            written,
            syntax=syntax,
        )
    return folder


@pytest.mark.parametrize("dtype", ["<i2", "<u2"])
@pytest.mark.parametrize("syntax", ["1.2.840.10008.1.2.1", IMPLICIT])
def test_upright(tmp_path, dtype, syntax):
    folder = write_series(tmp_path / "head", marked(dtype), syntax=syntax)
    for path in (folder, folder / "im002.dcm"):
        volume = load(path)
        assert np.array_equal(volume.data, marked()) and volume.data.dtype == np.int16
        assert volume.spacing == (0.5, 0.75, 2) and volume.orientation == "LPS"
        # voxel (5, 1, 3): (10 + 5·0.5, 20 + 1·0.75, 30 + 3·2)
        assert where_marked(volume) == pytest.approx((12.5, 20.75, 36))
    assert volume.name == "im002" and load(folder).name == "head"


@pytest.mark.parametrize(
    ("orientation", "step", "world", "letters"),
    [
        # coronal: x to L, y to I; the normal is x × y = to P
        ((1, 0, 0, 0, 0, -1), (0, 2, 0), (12.5, 26, 29.25), "LIP"),
        # the same slices listed from back to front: sorted along the normal all the same
        ((1, 0, 0, 0, 0, -1), (0, -2, 0), None, "LIP"),
        # sagittal: x to P, y to I, normal to R
        ((0, 1, 0, 0, 0, -1), (-2, 0, 0), (4, 22.5, 29.25), "PIR"),
        # turned by 53° about S: x = (0.6, 0.8, 0), y = (-0.8, 0.6, 0)
        ((0.6, 0.8, 0, -0.8, 0.6, 0), (0, 0, 2), (10 + 1.5 - 0.6, 20 + 2 + 0.45, 36), "PRS"),
    ],
)
def test_orientations(tmp_path, orientation, step, world, letters):
    volume = load(write_series(tmp_path / "d", orientation=orientation, step=step))
    assert volume.orientation == letters
    assert np.linalg.det(volume.world_from_object[:3, :3]) > 0
    if world is None:  # the first slice written is the last: the marker stays at its own slice's position
        world = START + np.array((2.5, 0, -0.75)) + 3 * np.array(step)
    assert where_marked(volume) == pytest.approx(world)


def test_slices_of_their_own_slope(tmp_path):
    """ITK's series reader gives all slices the type of the first and cuts fractions off."""
    slopes = ["1", "0.5", "2", "1", "1"]
    data = marked("<i2")
    volume = load(write_series(tmp_path / "d", data, slopes=slopes, shift=0))
    assert volume.data.dtype == np.float32
    wanted = data * np.array([1, 0.5, 2, 1, 1])[:, None, None] - 1024
    assert np.array_equal(volume.data, wanted.astype("f4")) and (wanted % 1 == 0.5).any()
    volume = load(write_series(tmp_path / "e", data * np.int16(2), slopes=["0.5"] * 5, shift=0))
    assert volume.data.dtype == np.int16 and np.array_equal(
        volume.data, data - 1024
    )  # whole: no need for floats


def test_without_rescale(tmp_path):
    folder = tmp_path / "d"
    folder.mkdir()
    for z, plane in enumerate((marked() % 256).astype("u1")):
        tags = slice_tags(z, above(z)) | {"0028|1052": None, "0028|1053": None}
        dicom(folder / f"{z}", plane, tags)
    assert load(folder).data.dtype == np.uint8


def test_strangers_are_ignored(tmp_path):
    folder = write_series(tmp_path / "d")
    (folder / "notes.txt").write_text("hello")
    (folder / "picture.jpg").write_bytes(b"\xff\xd8\xff\xe0" * 100)
    (folder / "short").write_bytes(b"\x08")
    (folder / "empty").touch()
    none = {PIXELS: None, "0028|0010": None, "0028|0011": None}
    dicom(folder / "report", marked()[0], none, sop="1.2.840.10008.5.1.4.1.1.88.11")
    dicom(folder / "DICOMDIR", marked()[0], none, sop="1.2.840.10008.1.3.10")
    assert load(folder).size == (7, 6, 5)
    assert [s.slices for s in list_series(folder)] == [5]


def test_sub_folders_of_a_disc(tmp_path):
    (tmp_path / "disc" / "patient").mkdir(parents=True)
    (tmp_path / "disc" / "autorun.inf").write_text("[autorun]")
    write_series(tmp_path / "disc" / "patient" / "series")
    assert load(tmp_path / "disc").size == (7, 6, 5)


def test_no_preamble(tmp_path):
    folder = tmp_path / "d"
    folder.mkdir()
    for z, plane in enumerate(marked()):
        dicom(folder / f"{z}", plane, slice_tags(z, above(z)), marked=False, syntax=IMPLICIT)
    assert np.array_equal(load(folder).data, marked() - 1024)


def test_several_series(tmp_path):
    folder = write_series(tmp_path / "d", uid="1.2.3.100", description="thin", number=3)
    write_series(folder, marked()[:2] + 1000, uid="1.2.3.200", description="thick", number=2, prefix="b")
    scout = dicom(
        folder / "scout", marked()[0], slice_tags(0, (0, 0, 0), uid="1.2.3.300", description="scout")
    )
    listed = list_series(folder)
    assert [(s.number, s.uid, s.description, s.slices) for s in listed] == [
        (1, "1.2.3.300", "scout", 1),
        (2, "1.2.3.200", "thick", 2),
        (3, "1.2.3.100", "thin", 5),
    ]
    assert listed[0].modality == "CT" and listed[0].size == (7, 6)
    message = refused(
        folder, "3 series", "series=N (--series N)", "1: …", "1.2.3.200", "CT thin, 5 slices of 7×6"
    )
    assert len(message.splitlines()) == 4
    for choice in (3, "3", "1.2.3.100"):
        assert np.array_equal(load(folder, series=choice).data, marked())
    assert load(folder, series=2).size == (7, 6, 2)
    assert load(folder / "b001.dcm").size == (7, 6, 2)  # a file stands for its series
    assert load(scout).size == (7, 6, 1)
    for wrong in (0, 4, -1, "1.2.3"):
        refused(folder, f"no series {wrong!r}", "CT thin", series=wrong)


def test_single_slice(tmp_path):
    volume = load(dicom(tmp_path / "v.dcm", marked()[3], slice_tags(0, START)))
    assert volume.size == (7, 6, 1) and volume.spacing == (0.5, 0.75, 2)  # slice thickness 2
    volume = load(dicom(tmp_path / "w.dcm", marked()[3], {"0020|000e": ("UI", "1.9")}))
    assert volume.spacing == (1, 1, 1) and volume.orientation == ""


def test_colour(tmp_path):
    rgb = {
        **slice_tags(0, START),
        "0028|0002": ("US", 3),
        "0028|0004": ("CS", "RGB"),
        "0028|0006": ("US", 0),
        "0028|1052": None,
        "0028|1053": None,
        PIXELS: ("OB", bytes(range(126))),
    }
    path = dicom(tmp_path / "v.dcm", np.zeros((6, 7), "u1"), rgb)
    refused(path, "3 components")
    assert np.array_equal(load(path, component=1).data.ravel(), np.arange(126)[1::3])


def test_progress(tmp_path):
    calls = []
    load(write_series(tmp_path / "d"), progress=lambda *call: calls.append(call))
    assert [c for c in calls if c[2] == "reading DICOM"] == [(i, 5, "reading DICOM") for i in range(1, 6)]
    assert (5, 5, "looking for DICOM") in calls


# --- multi-frame files --------------------------------------------------------------------------------------


@pytest.mark.parametrize("frames", [[0, 1, 2, 3, 4], [4, 3, 2, 1, 0], [2, 0, 4, 1, 3]])
def test_enhanced(tmp_path, frames):
    """GDCM keeps the frames in file order whatever their positions."""
    positions = [above(2 * z) for z in frames]
    path = dicom(tmp_path / "v.dcm", marked()[frames] + 1024, enhanced_tags(positions), sop=ENHANCED_CT)
    for where in (path, tmp_path):
        volume = load(where)
        assert np.array_equal(volume.data, marked()) and volume.data.dtype == np.int16
        assert where_marked(volume) == pytest.approx((12.5, 20.75, 36)) and volume.orientation == "LPS"


def test_enhanced_refusals(tmp_path):
    def with_positions(depths, **options):
        tags = enhanced_tags([above(z) for z in depths], **options)
        return dicom(tmp_path / "v.dcm", marked()[: len(depths)], tags, sop=ENHANCED_CT)

    refused(with_positions([0, 2, 4, 8]), "1 slice missing")
    refused(with_positions([0, 2, 0, 2]), "phases")
    refused(with_positions([0, 2, 4, 6], slopes=["1", "1", "2", "1"]), "different rescale slopes")
    cine = dicom(tmp_path / "v.dcm", marked(), {"0020|000e": ("UI", "1.2")})
    refused(cine, "5 of 5 slices", "no position")


def test_marker_survives_rescaling(tmp_path):
    volume = load(write_series(tmp_path / "d"))
    assert volume.value_range == (1, MARKED) and CT.startswith("1.2.840")
    with pytest.raises(FileError):
        list_series(tmp_path / "gone")
