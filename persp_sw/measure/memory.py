"""Memory of the process: at present, and its peak, of a stretch of work where the system can tell."""

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
    return _status("VmHWM") or _usage()


def resident_bytes() -> int:
    """Resident size of the process now; where the system does not say, the largest since its start."""
    return _status("VmRSS") or _usage()


def _status(name: str) -> int | None:
    try:
        for line in _STATUS.read_text().splitlines():
            if line.startswith(f"{name}:"):
                return 1024 * int(line.split()[1])
    except OSError:
        pass
    return None


def _usage() -> int:
    unit = 1 if sys.platform == "darwin" else 1024
    return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
