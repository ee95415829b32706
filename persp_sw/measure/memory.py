"""Peak memory of the process, of a stretch of work where the system can tell."""

from __future__ import annotations

import resource
import sys
from pathlib import Path

_STATUS, _CLEAR = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def restart_peak() -> bool:
    """Forget the peak so far; False where the system cannot (then peaks are those since the start)."""
    try:
        _CLEAR.write_text("5")  # Linux: the peak resident size becomes the present one
    except OSError:
        return False
    return True


def peak_bytes() -> int:
    """Largest resident size of the process, libraries and volume included, since `restart_peak`."""
    try:
        for line in _STATUS.read_text().splitlines():
            if line.startswith("VmHWM:"):
                return 1024 * int(line.split()[1])
    except OSError:
        pass
    unit = 1 if sys.platform == "darwin" else 1024
    return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
