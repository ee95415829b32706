"""Volumes that come along with other packages, by names that stand where a file's path does."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np

from ..errors import FileError, MissingPackageError
from .grid import Volume
from .ssdf import read_ssdf


def stent() -> Volume:
    """The CT of a stent in an aorta that the package visvis brings along; visvis itself is not imported.

    Raises
    ------
    MissingPackageError
        visvis is not installed, or without the scan.
    """
    package = importlib.util.find_spec("visvis")
    home = Path(package.origin).parent if package and package.origin else Path()
    path = home / "visvisResources" / "stent_vol.ssdf"
    if not path.is_file():
        raise MissingPackageError(
            "the demo's CT scan comes in the package visvis, which is not here: "
            "pip install 'persp-sw[demo]', or show a volume of your own (persp-sw demo --volume FILE)"
        )
    content = read_ssdf(path)
    levels, scale = content.get("vol"), content.get("colorscale")
    if not isinstance(levels, np.ndarray) or not isinstance(scale, float):
        raise FileError(f"{path} holds no scan (vol, colorscale); install visvis again")
    return Volume(np.rint(levels * scale).astype(np.int16), name="stent in an aorta, CT")


# A name as of a file, and what it stands for. No file of ours ends so.
EXAMPLES = {"stent.demo": stent}


def example_name(path: str | Path) -> str | None:
    """The name of the example that a path means, whatever folder it says; None: it is a path."""
    name = Path(path).name
    return name if name in EXAMPLES and not Path(path).exists() else None
