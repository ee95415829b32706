"""A host in C++ that embeds Python: compiled where there is a compiler, and its picture checked."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from samples import ROOT, ball
from tolerances import CPP_BYTES

from persp_sw import Renderer, View, images, load
from vr_plugin.host_view import HostView, seen_in_world

SOURCE = ROOT / "vr_plugin" / "examples" / "cpp_host.cpp"
SIZE = (200, 150)


def flags() -> list[str]:
    """What the compiler needs for Python, EGL and OpenGL; skips where something is not there."""
    folder, library = (sysconfig.get_config_var(name) for name in ("LIBDIR", "LDLIBRARY"))
    include = sysconfig.get_paths()["include"]
    missing = [
        what
        for what, found in {
            "g++": shutil.which("g++"),
            "Python.h": (Path(include) / "Python.h").is_file(),
            "a shared libpython": library and ".so" in library and (Path(folder) / library).is_file(),
            "libegl-dev": Path("/usr/include/EGL/eglext.h").is_file(),
            "libopengl-dev": Path("/usr/include/GL/glext.h").is_file(),
        }.items()
        if not found
    ]
    if missing:
        pytest.skip(f"cannot compile a host in C++ without {', '.join(missing)}")
    python = f"python{sysconfig.get_config_var('LDVERSION')}"
    return [f"-I{include}", f"-L{folder}", f"-Wl,-rpath,{folder}", f"-l{python}", "-lEGL", "-lOpenGL"]


@pytest.mark.gl
def test_a_cpp_program_shows_the_volume_among_its_polygons(gl_context, tmp_path):
    program, volume_file, picture = tmp_path / "host", tmp_path / "ball.npy", tmp_path / "picture.ppm"
    np.save(volume_file, ball())
    command = ["g++", "-O1", "-Wall", "-Wextra", "-Werror", str(SOURCE), *flags(), "-o", str(program)]
    compiled = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert compiled.returncode == 0, compiled.stderr
    done = subprocess.run(
        [program, volume_file, picture],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), *filter(None, sys.path)])},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    drawn = np.asarray(Image.open(picture)).astype(int)

    # The same camera, 2.2 m before the middle, 0.7 rad high, and the same two rectangles.
    camera = View.look_at((0, 0, 2.2), (0, 0, 0), (0, 1, 0), np.degrees(0.7), SIZE)
    volume = load(volume_file)
    placed = np.eye(4)
    placed[:3, :3] /= max(volume.extent)
    placed[:3, 3] = -volume.centre / max(volume.extent)
    view = HostView(camera.clip_from_world(0.1, 20), np.eye(4), SIZE)
    shown = Renderer(volume).render(seen_in_world(view, placed, volume))
    behind, edge_behind = inside(camera, (-0.9, -0.3, 0.9, 0.3), -1.2)
    before, edge_before = inside(camera, (-0.5, -0.15, 0.0, 0.15), 0.9)
    scene = np.where(behind[..., None], (0.5, 0.03, 0.02), (0.01, 0.015, 0.03))
    through = shown[..., :3] + (1 - shown[..., 3:]) * scene
    expected = np.where(before[..., None], (0.02, 0.2, 0.4), through)
    error = np.abs(drawn - 255 * images.srgb(expected)).max(-1)
    error[edge_behind | edge_before] = 0
    clear = ~(edge_behind | edge_before)
    assert min((before & clear).sum(), (behind & ~before & clear & (shown[..., 3] > 0.2)).sum()) > 500
    assert error.max() < CPP_BYTES


def inside(camera: View, area: tuple[float, float, float, float], z: float) -> tuple[np.ndarray, np.ndarray]:
    """Pixels in a rectangle, and those so near its edge that rounding decides."""
    (left, bottom), (right, top) = camera.project([(*area[:2], z), (*area[2:], z)])  # rows downwards
    column, row = np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1]) + 0.5)
    depth = np.minimum.reduce([column - left, right - column, row - top, bottom - row])
    return depth > 0, np.abs(depth) < 0.01
