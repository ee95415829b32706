"""Which processor this is, as people name it."""

from __future__ import annotations

import platform
from pathlib import Path


def processor() -> str:
    """The processor's model; of a machine that does not tell it, its architecture."""
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
