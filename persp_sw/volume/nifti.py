"""NIfTI-1, NIfTI-2 and ANALYZE 7.5 files: nibabel reads the header, `blocks` the voxels.

nibabel's array proxies would take gzipped files without their checksum, allocate whatever size a damaged
header states, and hold unpacked voxels twice, so they are not used. Nor is ITK, which zero-fills truncated
files and refuses sheared poses; the tests hold the two against each other.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..errors import FileError
from .blocks import plain_or_gzip, read_block, read_head
from .orientation import LPS_FROM_RAS, flipped, pose
from .stored import Progress, Stored, in_five_axes

_MM = {1: 1000.0, 3: 0.001}  # metres and micrometres; else millimetres
_ADVICE = "the header is damaged, export the file again"


def read(path: Path, progress: Progress | None) -> Stored:
    """Voxels and LPS pose in mm of a .nii, .nii.gz or .hdr/.img file.

    The pose is the sform where its code says there is one (sheared ones too), else the qform, else spacing
    alone, without orientation.
    """
    from nibabel.spatialimages import HeaderDataError

    header_path, image_path = _pair(path)
    header = _header(header_path, single=image_path == header_path)
    try:
        sizes = _sizes(header, path)
        slope, intercept = header.get_slope_inter()
        matrix, spacing, anatomical = _pose(header)
    except (HeaderDataError, ValueError) as error:
        raise FileError(f"{path}: {error}; {_ADVICE}") from None
    dtype, parts = _type(header, path)
    offset = float(header["vox_offset"])
    if not np.isfinite(offset) or offset < 0:
        raise FileError(f"{path}: the header puts the voxels at byte {offset}; {_ADVICE}")
    if image_path == header_path:
        offset = max(offset, header.sizeof_hdr + 4)
    count = int(np.prod(sizes, dtype=object)) * parts
    packing = plain_or_gzip(image_path)
    where = {"offset": int(offset)} if packing == "raw" else {"skip": int(offset)}
    block = read_block(image_path, dtype, count, packing=packing, progress=progress, **where)
    # Axes 7 6 5 4 3 2 1 of the file, then the parts of a voxel; the fifth holds vectors.
    data = block.reshape([*([1] * (7 - len(sizes))), *sizes[::-1], parts])
    data = in_five_axes(data, [0, 1, 3], [4, 5, 6], [2, 7])
    return Stored(data, matrix, spacing, anatomical, slope or 1.0, intercept or 0.0)


def _pair(path: Path) -> tuple[Path, Path]:
    """Header and image file: the same one for .nii, two for .hdr and .img."""
    from nibabel.filename_parser import types_filenames

    if not path.name.lower().removesuffix(".gz").endswith((".hdr", ".img")):
        return path, path
    kinds = (("header", ".hdr"), ("image", ".img"))
    names = types_filenames(str(path), kinds, trailing_suffixes=(".gz",))
    missing = next((name for name in names.values() if not Path(name).is_file()), None)
    if missing:
        raise FileError(f"{path}: its other half {Path(missing).name} is missing; put it beside this file")
    return Path(names["header"]), Path(names["image"])


def _header(path: Path, single: bool):
    """The header as it is: nibabel's checks would put spacings of its own for bad ones."""
    from nibabel import AnalyzeHeader, Nifti1Header, Nifti2Header

    head = read_head(path, Nifti2Header.sizeof_hdr)
    for kind in (Nifti1Header, Nifti2Header, *(() if single else (AnalyzeHeader,))):  # ANALYZE comes in pairs
        if kind.may_contain_header(head):
            return kind(head[: kind.sizeof_hdr], check=False)
    given = "is too short to be" if len(head) < AnalyzeHeader.sizeof_hdr else "is not"
    raise FileError(
        f"{path}: the file {given} a NIfTI or ANALYZE header; check what it is, or export it again"
    )


def _sizes(header, path: Path) -> tuple[int, ...]:
    sizes = header.get_data_shape()
    if len(sizes) != header["dim"][0] or min(sizes) < 1:
        raise FileError(f"{path}: the header states the sizes {list(sizes)}; {_ADVICE}")
    return sizes


def _type(header, path: Path) -> tuple[np.dtype, int]:
    """Type of a number, and how many of them make a voxel."""
    try:
        dtype = header.get_data_dtype()
    except KeyError:
        dtype = np.dtype(np.void)
    if dtype.names:  # RGB and RGBA
        return dtype[0], len(dtype.names)
    if dtype.kind == "c":
        return np.dtype(f"{dtype.byteorder}f{dtype.itemsize // 2}"), 2
    if dtype.kind not in "iuf":
        code = int(header["datatype"])
        raise FileError(
            f"{path}: NIfTI data type {code} is not supported; convert to float32 or an integer type"
        )
    return dtype, 1


def _pose(header):
    rank, named = int(header["dim"][0]), "xyzt_units" in header
    scale = _MM.get(int(header["xyzt_units"]) & 7, 1.0) if named else 1.0
    spacing = [float(s) * scale for s in header["pixdim"][1:4]]
    spacing = tuple(s if i < rank or s > 0 else 1.0 for i, s in enumerate(spacing))
    sform = header.get_sform(coded=True)[0] if named else None
    if sform is not None and np.isfinite(sform).all() and np.linalg.det(sform[:3, :3]) != 0:
        return flipped(np.diag([scale, scale, scale, 1]) @ sform, LPS_FROM_RAS), None, True
    if named and header["qform_code"] > 0:
        header["pixdim"][:4] = (-1 if header["pixdim"][0] < 0 else 1, 1, 1, 1)  # spacing is judged later
        turn = header.get_qform()
        return flipped(pose(turn[:3, :3].T, turn[:3, 3] * scale, spacing), LPS_FROM_RAS), spacing, True
    return pose(np.eye(3), spacing=spacing), spacing, False
