"""Kernels for any processor: the environment chooses them; their pictures are those of the vector kernels."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from samples import ROOT, spawn
from tolerances import PORTABLE_2D, PORTABLE_IMAGE, PORTABLE_LIT
from views import DIRECTIONS, view_of

from persp_sw import (
    Light,
    Lighting,
    Look,
    Modulation,
    Renderer,
    Settings,
    TransferFunction,
    Volume,
    _jit,
)
from persp_sw.optics.transfer2d import Box, TransferFunction2D

DTYPES = [np.uint8, np.float32]  # test_packets has all; each is compiled anew here
HAZE = TransferFunction([(0, (0.2, 0.4, 0.9), 0), (255, (1, 0.7, 0.4), 0.5)], 1.0)


def pictures() -> dict[str, np.ndarray]:
    """Eye images of all voxel types, one and two samples an interval; with two levels of detail for some."""
    z, y, x = np.indices((12, 14, 80))
    data = 120 + 100 * np.sin(0.3 * x + 0.2) * np.cos(0.4 * y - 0.3) * np.sin(0.3 * z + 0.7)
    found = {}
    for dtype in DTYPES:
        volume = Volume(data.astype(dtype))
        for samples in (1, 2):
            renderer = Renderer(volume, HAZE, Settings(samples_per_interval=samples, residual=0))
            for number, (towards, quality) in enumerate([(DIRECTIONS[0], 1.0), (DIRECTIONS[3], 0.25)]):
                renderer.settings = Settings(samples_per_interval=samples, residual=0, quality=quality)
                view = view_of(volume, towards, distance=0.9)
                image = renderer.composite(view.eye, [view.wall])
                found[f"{np.dtype(dtype)}, {samples} samples, view {number}"] = image.pixels
    return found


LIGHTS = (Light((1, 2, 3), (1, 0.6, 0.2), shadows=True), Light((-2, -1, 1), (0.1, 0.3, 1)))
LOOKS = {
    "headlight": Look(Lighting()),
    "lights, modulated": Look(Lighting(lights=LIGHTS, model="blinn"), Modulation(0.0, 0.3, 0.7, 0.5), 1.5),
}
SHAPES = TransferFunction2D([Box((60, 260), (0, 60), (1, 0.5, 0.2), 0.4, 1.0)], 1.0)


def lit_pictures() -> dict[str, np.ndarray]:
    """Eye images with light, plain and pre-integrated, and of a two-dimensional function."""
    z, y, x = np.indices((12, 14, 80))
    data = 120 + 100 * np.sin(0.3 * x + 0.2) * np.cos(0.4 * y - 0.3) * np.sin(0.3 * z + 0.7)
    volume = Volume(data.astype(np.uint8))
    found = {}
    for transfer, name, look, preintegrated in (
        (HAZE, "headlight", LOOKS["headlight"], False),
        (HAZE, "lights, modulated", LOOKS["lights, modulated"], False),
        (HAZE, "headlight", LOOKS["headlight"], True),
        (HAZE, "lights, modulated", LOOKS["lights, modulated"], True),
        (SHAPES, "shapes", LOOKS["lights, modulated"], False),
    ):
        for number, (towards, quality) in enumerate([(DIRECTIONS[0], 1.0), (DIRECTIONS[3], 0.25)]):
            settings = Settings(preintegrated=preintegrated, residual=0, quality=quality)
            view = view_of(volume, towards, distance=0.9)
            renderer = Renderer(volume, transfer, settings, look=look)
            image = renderer.composite(view.eye, [view.wall])
            found[f"{name}, {preintegrated=}, view {number}"] = image.pixels
    return found


def child(program: str, *arguments: object, **environment: str) -> str:
    """What a Python process of its own prints, which sees the tests and the package."""
    inherited = {name: value for name, value in os.environ.items() if name != "NUMBA_CPU_NAME"}
    path = os.pathsep.join([str(ROOT), str(ROOT / "tests")])
    done = subprocess.run(
        [sys.executable, "-c", program, *map(str, arguments)],
        env={**inherited, "PYTHONPATH": path, **environment},
        capture_output=True,
        text=True,
        timeout=900,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


_DRAW = """
import sys
import numpy
import test_portable
from persp_sw import _jit
from persp_sw.kernels import packet, packet_portable
assert not _jit.VECTORS and packet.classified is packet_portable
numpy.savez(sys.argv[1], **getattr(test_portable, sys.argv[2])())
"""


def drawn_portably(which: str, folder: Path) -> dict[str, np.ndarray]:
    """What a process with portable kernels draws: the pictures of a function here."""
    child(_DRAW, folder / "portable.npz", which, PERSP_SW_KERNELS="portable")
    return dict(np.load(folder / "portable.npz"))


NEEDS_VECTORS = pytest.mark.skipif(not _jit.VECTORS, reason="these are the portable kernels already")


@NEEDS_VECTORS
def test_portable_kernels_draw_the_same_pictures(tmp_path: Path):
    ours, portable = pictures(), drawn_portably("pictures", tmp_path)
    assert sorted(portable) == sorted(ours)
    for name, picture in ours.items():
        assert picture[:, 3].max() > 0.5, name
        assert np.abs(picture - portable[name]).max() < PORTABLE_IMAGE, name


@NEEDS_VECTORS
@pytest.mark.slow  # compiles for a minute and more; test_packet_lit has each part of it
def test_portable_kernels_light_the_same_pictures(tmp_path: Path):
    ours, portable = lit_pictures(), drawn_portably("lit_pictures", tmp_path)
    assert sorted(portable) == sorted(ours)
    for name, picture in ours.items():
        off = np.abs(picture - portable[name])
        assert picture[:, 3].max() > 0.5, name
        assert off.max() < (PORTABLE_2D if "shapes" in name else PORTABLE_LIT), name


_TELL = """
import numba
from persp_sw import _jit
print(_jit.VECTORS, numba.config.CACHE_DIR)
"""


def test_the_environment_chooses_and_compiled_kernels_are_kept_apart():
    """Also where a process that has kernels starts another: that one may not be given them."""
    portable, where = child(_TELL, PERSP_SW_KERNELS="portable").split()
    vector, elsewhere = child(_TELL, PERSP_SW_KERNELS="vector").split()
    assert (portable, vector) == ("False", "True")
    if "NUMBA_CACHE_DIR" not in os.environ:
        assert where.endswith("-portable")
        assert elsewhere.endswith("-vector")


def test_numba_compiling_for_another_processor_means_portable():
    assert child(_TELL, PERSP_SW_KERNELS="", NUMBA_CPU_NAME="generic").startswith("False")


def test_a_wrong_choice_is_told(ball_file: Path, tmp_path: Path):
    done = spawn("render", ball_file, "-o", tmp_path / "a.png", PERSP_SW_KERNELS="fast")
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr == "error: PERSP_SW_KERNELS is 'portable' or 'vector'; given 'fast'\n"
