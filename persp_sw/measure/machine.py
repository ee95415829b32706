"""What was measured on: processor, cores, what else ran, versions."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from .. import __version__
from ..quality.processor import processor


def describe_machine() -> dict[str, Any]:
    """For reports; names no host. `load`: processes that ran or waited in the last minute; None if untold."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    versions = {"persp_sw": __version__, "python": platform.python_version()}
    for package in ("numpy", "numba", "llvmlite", "vtk"):
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            continue
    return {
        "processor": processor(),
        "cores": cores,
        "load": round(os.getloadavg()[0], 1) if hasattr(os, "getloadavg") else None,
        "system": platform.system(),
        "versions": versions,
    }
