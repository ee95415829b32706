"""The door `load`: kinds of files, choices, progress, names, and what it says of files it cannot take."""

import gzip
import os
import sys

import numpy as np
import pytest
from data_folder import volume_path
from dicom_writer import dicom, slice_tags
from volume_files import MARK, MARKED, SIZE, marked, metaimage, nifti_header, nrrd, refused

from persp_sw.errors import FileError, PerspSWError, VolumeError
from persp_sw.volume.files import load

ENDINGS = ("nrrd", "nhdr", "mha", "mhd", "nii", "nii.gz", "hdr", "img", "dcm", "tif", "npy", "vti", "vtk")


# --- choosing -----------------------------------------------------------------------------------------------


def test_frames(tmp_path):
    frames = np.stack([marked(), marked() + 1000])
    path = nrrd(tmp_path / "v.nrrd", frames)
    refused(path, "2 frames", "frame=N (--frame N)", "0 to 1")
    assert np.array_equal(load(path, frame=0).data, frames[0])
    assert np.array_equal(load(path, frame=1).data, frames[1])
    held = load(path, frame=1).data.base
    assert held is None or held.size == 210  # the other frame is not kept in memory
    for wrong in (2, -1, "x", 0.5, True):
        refused(path, f"no frame {wrong!r}", "has 2 frames", frame=wrong)
    packed = nrrd(tmp_path / "z.nrrd", frames, end=gzip.compress(frames.tobytes()), encoding="gzip")
    held = load(packed, frame=1).data.base
    assert held is None or held.size == 210
    path = nrrd(tmp_path / "one.nrrd", frames[:1])
    assert load(path).size == SIZE and load(path, frame=0).size == SIZE


def test_components(tmp_path):
    vectors = np.stack([marked(), 2 * marked(), -2 * marked()], axis=-1)
    path = metaimage(tmp_path / "v.mha", vectors, "ElementNumberOfChannels = 3", sizes=SIZE)
    refused(path, "3 components", "component=N (--component N)", "0 to 2", '"magnitude"')
    assert np.array_equal(load(path, component=2).data, vectors[..., 2])
    assert np.array_equal(load(path, component="1").data, vectors[..., 1])
    length = load(path, component="magnitude").data
    assert length.dtype == np.float32 and np.array_equal(length, 3 * marked())  # 1² + 2² + 2² = 3²
    for wrong in (3, -1, "length"):
        refused(path, f"no component {wrong!r}", "has 3 components", component=wrong)


def test_real_frames_and_components():
    path = volume_path("carotid_velocity.nrrd")
    refused(path, "3 components")
    parts = [load(path, component=i).data.astype(np.float64) for i in range(3)]
    assert parts[0].shape == (45, 49, 76)
    length = load(path, component="magnitude").data
    assert np.allclose(length, np.sqrt(sum(p * p for p in parts)), rtol=1e-6)
    path = volume_path("nibabel_example4d.nrrd")
    refused(path, "2 frames")
    first, second = load(path, frame=0), load(path, frame=1)
    assert first.size == (128, 96, 24) and first.data.dtype == np.int16
    assert np.allclose(first.spacing, (2, 2, 2.2), atol=1e-6)
    assert not np.array_equal(first.data, second.data)


def test_series_only_for_dicom(tmp_path):
    refused(nrrd(tmp_path / "v.nrrd", marked()), "series=1", "NRRD", series=1)


def test_spacing_replaces_pose(tmp_path):
    path = nrrd(
        tmp_path / "v.nrrd",
        marked(),
        "space: RAS",
        "space directions: (2,0,0) (0,3,0) (0,0,0)",
        "space origin: (1,2,3)",
    )
    refused(path, "(2.0, 3.0, 0.0)", "spacing=(x, y, z)")
    volume = load(path, spacing=(1, 2, 4))
    assert np.array_equal(volume.world_from_object, np.diag([1, 2, 4, 1])) and volume.orientation == ""
    refused(path, "positive", error=VolumeError, spacing=(1, 2, -4))


def test_names(tmp_path):
    path = tmp_path / "a.head.nii.gz"
    path.write_bytes(gzip.compress(bytes(nifti_header()) + marked().tobytes()))
    assert load(path).name == "a.head"
    assert load(nrrd(tmp_path / "B.NRRD", marked())).name == "B"


def test_progress(tmp_path):
    calls = []
    path = nrrd(tmp_path / "v.nrrd", marked(), end=gzip.compress(marked().tobytes()), encoding="gzip")
    load(path, progress=lambda *call: calls.append(call))
    assert calls[-1] == (420, 420, "unpacking")
    calls.clear()
    load(nrrd(tmp_path / "w.nrrd", marked()), progress=lambda *call: calls.append(call))
    assert [c[0] for c in calls] == [1, 2, 3, 4, 5] and calls[-1][1] == 5


def test_interrupt_passes(tmp_path):
    def interrupt(*_):
        raise KeyboardInterrupt

    (tmp_path / "d").mkdir()
    for i in range(2):
        dicom(tmp_path / "d" / f"{i}.dcm", marked()[i], slice_tags(i, (0, 0, 2 * i)))
    for path in (nrrd(tmp_path / "v.nrrd", marked()), tmp_path / "d"):
        with pytest.raises(KeyboardInterrupt):
            load(path, progress=interrupt)


# --- what no volume is --------------------------------------------------------------------------------------


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize(
    "content", [b"0123456789", b"this is a text\nwith lines\n\nand words" * 20, b"\0" * 600]
)
def test_wrong_contents(tmp_path, ending, content, capfd):
    path = tmp_path / f"v.{ending}"
    path.write_bytes(content)
    if ending in ("hdr", "img"):
        (tmp_path / f"v.{'img' if ending == 'hdr' else 'hdr'}").write_bytes(content)
    with pytest.raises(FileError) as caught:
        load(path)
    assert str(tmp_path / "v.") in str(caught.value) and ";" in str(caught.value)
    assert "ITK" not in str(caught.value) and capfd.readouterr() == ("", "")


@pytest.mark.parametrize("ending", [*ENDINGS, "raw", "unknown"])
def test_empty_and_missing(tmp_path, ending):
    path = tmp_path / f"v.{ending}"
    refused(path, "no such file")
    path.touch()
    refused(path, "empty", "again")


def test_unknown_ending(tmp_path):
    path = tmp_path / "v.xyz"
    path.write_bytes(b"x" * 500)
    refused(path, ".nrrd", ".nii.gz", ".mha", ".dcm", ".tif", ".npy", ".vti", "shape=")
    path = tmp_path / "IM0001"  # DICOM files need no ending
    dicom(path, marked()[0], slice_tags(1, (0, 0, 0)))
    assert load(path).size == (7, 6, 1)


def test_folder_without_volumes(tmp_path):
    refused(tmp_path, "no DICOM image and no TIFF page")
    (tmp_path / "notes.txt").write_text("nothing")
    refused(tmp_path, "no DICOM image and no TIFF page")


def test_neither_file_nor_folder(tmp_path):
    os.mkfifo(tmp_path / "v.nrrd")
    refused(tmp_path / "v.nrrd", "neither a file nor a folder")


@pytest.mark.parametrize("ending", ["nrrd", "dcm", "raw"])
def test_no_permission(tmp_path, ending, monkeypatch):
    path = nrrd(tmp_path / f"v.{ending}", marked())
    path.chmod(0)
    if os.access(path, os.R_OK):  # the superuser may read everything
        from pathlib import Path

        opened = Path.open

        def denied(self, *args, **options):
            if self == path:
                raise PermissionError(13, "Permission denied", str(self))
            return opened(self, *args, **options)

        monkeypatch.setattr(Path, "open", denied)
    refused(path, "Permission denied", "permissions")


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_not_finite(tmp_path, value):
    data = marked("<f4")
    data[:2] = value
    volume = load(nrrd(tmp_path / "v.nrrd", data, kind="float"))
    assert volume.nonfinite == 2 * 42 and volume.value_range[1] == MARKED
    data[:] = value
    refused(nrrd(tmp_path / "w.nrrd", data, kind="float"), "NaN", error=VolumeError)


def test_singular_pose(tmp_path):
    path = nrrd(tmp_path / "v.nrrd", marked(), "space: LPS", "space directions: (1,0,0) (2,0,0) (0,0,1)")
    refused(path, "singular", error=VolumeError)


def test_nothing_heavy_is_imported_early():
    import subprocess

    heavy = "{'SimpleITK', 'tifffile', 'vtkmodules', 'PIL', 'nibabel', 'nrrd', 'pydicom'}"
    code = f"import sys, persp_sw.volume.files; print({heavy} & set(sys.modules))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "set()"


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["nrrd", "mha", "nii", "npy"])
def test_damaged_headers_raise_only_our_errors(tmp_path, kind, seed):
    path = tmp_path / f"v.{kind}"
    if kind == "nrrd":
        nrrd(
            path, marked(), "space: LPS", "space directions: (1,0,0) (0,2,0) (0,0,3)", "space origin: (1,2,3)"
        )
    elif kind == "mha":
        metaimage(
            path, marked(), "ElementSpacing = 1 2 3", "Offset = 1 2 3", "TransformMatrix = 1 0 0 0 1 0 0 0 1"
        )
    elif kind == "nii":
        path.write_bytes(nifti_header(sform=np.eye(3, 4)) + marked().tobytes())
    else:
        np.save(path, marked())
    whole, rng, read = path.read_bytes(), np.random.default_rng(seed), 0
    for _ in range(40):
        damaged = bytearray(whole)
        for at in rng.integers(0, len(whole) - marked().nbytes, rng.integers(1, 6)):
            damaged[at] = rng.choice([0, 255, ord("0"), ord("9"), ord("-"), rng.integers(256)])
        path.write_bytes(damaged)
        try:
            read += load(path).size != ()
        except PerspSWError as error:
            assert "v." + kind in str(error)
    assert read > 0 or kind == "npy"  # some stay readable, so the loop tests both ways


def test_marker_helper():
    x, y, z = MARK
    assert marked()[z, y, x] == MARKED and (marked() == MARKED).sum() == 1
