"""From a patient's file to the picture: left stays left, however the file is laid out."""

from pathlib import Path

import numpy as np
import pytest

import persp_sw as psw

sitk = pytest.importorskip("SimpleITK")

# A body 40 × 30 × 50 mm; a bright marker towards the patient's left, anterior and superior.
BODY = np.array([40.0, 30.0, 50.0])
MARKER_LPS = np.array([15.0, -10.0, 20.0])  # from the middle
MIDDLE_LPS = np.array([7.0, -3.0, 11.0])


def write(path: Path, axes: str, spacing=(1.0, 1.5, 2.0)) -> None:
    """The body with voxel axes growing towards the letters `axes`, as any scanner might store it."""
    towards = {
        "L": (1, 0, 0),
        "R": (-1, 0, 0),
        "P": (0, 1, 0),
        "A": (0, -1, 0),
        "S": (0, 0, 1),
        "I": (0, 0, -1),
    }
    direction = np.array([towards[letter] for letter in axes], float).T
    extent = np.abs(direction.T @ BODY)
    count = np.round(extent / spacing).astype(int) + 1
    origin = -direction @ ((count - 1) * spacing / 2) + MIDDLE_LPS
    data = np.full(count[::-1], 40, np.uint8)
    x, y, z = np.round(np.linalg.solve(direction * spacing, MARKER_LPS + MIDDLE_LPS - origin)).astype(int)
    data[z - 1 : z + 2, y - 1 : y + 2, x - 1 : x + 2] = 250
    image = sitk.GetImageFromArray(data)
    image.SetSpacing([float(s) for s in spacing])
    image.SetOrigin(origin.tolist())
    image.SetDirection(direction.ravel().tolist())
    sitk.WriteImage(image, str(path))


def marker_at(volume: psw.Volume, towards: tuple[int, int, int], up: tuple[int, int, int]) -> tuple[str, str]:
    """Which side of the picture, and which height, the marker is on, seen from `towards`."""
    transfer = psw.TransferFunction([(100, (1, 1, 1), 0), (250, (1, 1, 1), 0.9)])
    eye = volume.centre + 200 * np.array(towards, float)
    view = psw.View.look_at(eye, volume.centre, up, 30, (64, 64))
    alpha = psw.Renderer(volume, transfer).render(view)[..., 3]
    row, column = np.indices(alpha.shape) - 31.5
    assert alpha.max() > 0.3
    return (
        "left" if (column * alpha).sum() < 0 else "right",
        "top" if (row * alpha).sum() < 0 else "bottom",
    )


@pytest.mark.parametrize("axes", ["LPS", "RAS", "LAS", "RPI", "PSL", "IRA", "SLP"])
@pytest.mark.parametrize("suffix", [".nii", ".nii.gz", ".nrrd", ".mha"])
def test_a_patients_left_is_on_the_viewers_right_from_the_front(tmp_path: Path, axes: str, suffix: str):
    write(tmp_path / f"body{suffix}", axes)
    volume = psw.load(tmp_path / f"body{suffix}")
    assert volume.orientation == axes
    superior = (0, 0, 1)
    assert marker_at(volume, (0, -1, 0), superior) == ("right", "top")  # from anterior
    assert marker_at(volume, (0, 1, 0), superior) == ("left", "top")  # from posterior
    assert marker_at(volume, (1, 0, 0), superior) == ("left", "top")  # from the patient's left: anterior …
    assert marker_at(volume, (0, 0, -1), (0, -1, 0)) == ("right", "top")  # from the feet, as radiologists do
