"""VTK images, legacy and XML: what the vtk package reads, and what it would pass over."""

import sys
from importlib.util import find_spec

import numpy as np
import pytest
from volume_files import marked, refused, where_marked

from persp_sw.errors import MissingPackageError
from persp_sw.volume.files import load

HEAD = """# vtk DataFile Version 3.0
a title
{kind}
DATASET STRUCTURED_POINTS
DIMENSIONS {size}
{spacing}
ORIGIN 1 2 3
POINT_DATA {points}
{array}
"""


def legacy(
    path, data, *, kind="BINARY", array=None, size="7 6 5", spacing="SPACING 2 3 4", points=210, end=b""
):
    array = array or "SCALARS values short 1\nLOOKUP_TABLE default"
    head = HEAD.format(kind=kind, array=array, size=size, spacing=spacing, points=points).encode()
    body = data.astype(data.dtype.newbyteorder(">")).tobytes()
    if kind == "ASCII":
        body = "\n".join(map(str, data.ravel())).encode()
    path.write_bytes(head + body + end)
    return path


needs_vtk = pytest.mark.skipif(find_spec("vtkmodules") is None, reason="the extra vtk is not installed")


# The marker is voxel (5, 1, 3): (1 + 5·2, 2 + 1·3, 3 + 3·4) = (11, 5, 15).
@needs_vtk
@pytest.mark.parametrize("kind", ["BINARY", "ASCII"])
def test_legacy(tmp_path, kind):
    end = b"\nMETADATA\nINFORMATION 0\n"
    volume = load(legacy(tmp_path / "v.vtk", marked(), kind=kind, end=end))
    assert np.array_equal(volume.data, marked()) and volume.data.dtype == np.int16
    assert where_marked(volume) == pytest.approx((11, 5, 15)) and volume.orientation == ""
    volume = load(legacy(tmp_path / "v.vtk", marked(), kind=kind, spacing="ASPECT_RATIO 1 1 2"))
    assert where_marked(volume) == pytest.approx((6, 3, 9))
    volume = load(legacy(tmp_path / "v.vtk", marked(), array="SCALARS values short\nLOOKUP_TABLE default"))
    assert np.array_equal(volume.data, marked())


@needs_vtk
def test_legacy_components(tmp_path):
    vectors = np.stack([marked("f4"), 2 * marked("f4"), 2 * marked("f4")], axis=-1)
    for array in (
        "VECTORS v float",
        "SCALARS v float 3\nLOOKUP_TABLE default",
        "FIELD FieldData 1\nv 3 210 float",
    ):
        path = legacy(tmp_path / "v.vtk", vectors, array=array)
        refused(path, "3 components")
        assert np.array_equal(load(path, component="magnitude").data, 3 * marked("f4"))


@needs_vtk
@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"spacing": "SPACING 0 1 1"}, "(0.0, 1.0, 1.0)"),
        ({"spacing": "SPACING -1 1 1"}, "(-1.0, 1.0, 1.0)"),
        ({"spacing": "SPACING nan 1 1"}, "spacing"),  # VTK 9.2 does not read the word
        ({"spacing": "SPACING 1 1"}, "reading spacing"),
        ({"size": "7 6"}, "reading dimensions"),
        ({"size": "7 6 4"}, "VTK cannot read it"),
        ({"size": "7 6 0", "points": 0}, "VTK cannot read it"),
        ({"array": "SCALARS v bit 1\nLOOKUP_TABLE default"}, "VTK cannot read it"),
        ({"array": "TENSORS v float"}, "VTK cannot read it"),
        ({"size": "7 6 5000", "points": 210000}, "truncated"),
    ],
)
def test_legacy_refusals(tmp_path, options, words):
    refused(legacy(tmp_path / "v.vtk", marked(), **options), words)


@needs_vtk
@pytest.mark.parametrize("kind", ["BINARY", "ASCII"])
@pytest.mark.parametrize("cut", [10, 200])
def test_legacy_truncated(tmp_path, kind, cut, capfd):
    """VTK fills such files up."""
    path = legacy(tmp_path / "v.vtk", marked(), kind=kind)
    path.write_bytes(path.read_bytes()[:-cut])
    refused(path, "truncated")
    assert capfd.readouterr() == ("", "")


def test_points_that_cannot_be_there(tmp_path):
    """VTK would fill 8 GB before it noticed."""
    path = legacy(tmp_path / "v.vtk", marked(), size="2000 2000 1000", points=4_000_000_000)
    refused(path, "truncated: 4000000000 points", f"{path.stat().st_size} bytes")


def test_other_grids(tmp_path):
    path = legacy(tmp_path / "v.vtk", marked())
    path.write_bytes(path.read_bytes().replace(b"STRUCTURED_POINTS", b"POLYDATA"))
    refused(path, "POLYDATA", "STRUCTURED_POINTS")


XML = """<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian">
<ImageData WholeExtent="2 8 3 8 4 8" Origin="1 2 3" Spacing="{spacing}" Direction="{direction}">
<Piece Extent="2 8 3 8 4 8"><PointData Scalars="v">
<DataArray type="Int16" Name="v" format="ascii">{values}</DataArray>
</PointData></Piece></ImageData></VTKFile>"""


def xml(path, spacing="2 3 4", direction="1 0 0 0 1 0 0 0 1"):
    values = " ".join(map(str, marked().ravel()))
    path.write_text(XML.format(spacing=spacing, direction=direction, values=values))
    return path


def test_without_vtk(tmp_path, monkeypatch):
    for name in ("vtkmodules", "vtkmodules.vtkIOXML", "vtkmodules.vtkIOLegacy", "vtkmodules.vtkCommonCore"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(MissingPackageError, match=r'v\.vtk.*pip install "persp-sw\[vtk\]"'):
        load(legacy(tmp_path / "v.vtk", marked()))
    with pytest.raises(MissingPackageError, match=r'v\.vti.*pip install "persp-sw\[vtk\]"'):
        load(xml(tmp_path / "v.vti"))


@needs_vtk
def test_xml(tmp_path):
    volume = load(xml(tmp_path / "v.vti"))
    # The first voxel has index (2, 3, 4): the marker is index (7, 4, 7), (1 + 7·2, 2 + 4·3, 3 + 7·4)
    assert where_marked(volume) == pytest.approx((15, 14, 31)) and np.array_equal(volume.data, marked())
    volume = load(xml(tmp_path / "v.vti", direction="0 -1 0 1 0 0 0 0 1"))  # x runs along +y, y along -x
    assert where_marked(volume) == pytest.approx((1 - 12, 2 + 14, 31))


@needs_vtk
@pytest.mark.parametrize("spacing", ["0 1 1", "nan 1 1", "-1 1 1"])
def test_xml_spacing(tmp_path, spacing):
    refused(xml(tmp_path / "v.vti", spacing=spacing), f"({float(spacing.split()[0])}, 1.0, 1.0)")


@needs_vtk
@pytest.mark.parametrize("cut", [30, 300, 800])
def test_xml_truncated(tmp_path, cut, capfd):
    path = xml(tmp_path / "v.vti")
    path.write_bytes(path.read_bytes()[:-cut])
    refused(path, "truncated")
    assert capfd.readouterr() == ("", "")
