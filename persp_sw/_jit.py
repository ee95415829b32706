"""The only place that configures numba.

Kernels are compiled once and kept on disk. numba's cache does not notice an edit to a helper in another
file, so its folder carries a hash of all the sources that hold compiled code. `OMP_WAIT_POLICY=passive`
must be set before OpenMP starts: idle workers would otherwise spin and take the display's core.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
import time
from pathlib import Path

_PACKAGE = Path(__file__).parent


def _sources_hash() -> str:
    digest = hashlib.sha256()
    for path in sorted([*_PACKAGE.glob("kernels/*.py"), *_PACKAGE.glob("reference.py"), Path(__file__)]):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _cache_folder() -> Path:
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    folder = Path(home) / "persp_sw" / f"kernels-{_sources_hash()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        folder = Path(tempfile.gettempdir()) / f"persp_sw-kernels-{os.getuid()}-{_sources_hash()}"
        folder.mkdir(parents=True, exist_ok=True)
    return folder


os.environ.setdefault("OMP_WAIT_POLICY", "passive")
os.environ.setdefault("NUMBA_CACHE_DIR", str(_cache_folder()))

import numba  # noqa: E402

numba.config.THREADING_LAYER = "omp"

from llvmlite import ir  # noqa: E402
from numba import prange, types  # noqa: E402
from numba.core import event  # noqa: E402
from numba.extending import intrinsic  # noqa: E402

__all__ = [
    "bits_from_float",
    "compile_seconds",
    "float_from_bits",
    "kernel",
    "max_threads",
    "parallel_kernel",
    "popcount",
    "prange",
    "set_threads",
    "trailing_zeros",
]

# No fast-math: NaN marks voxels that are not there and must stay NaN. `contract` lets a*b + c fuse.
_OPTIONS = {"nogil": True, "cache": True, "fastmath": {"contract"}, "error_model": "numpy"}

kernel = numba.njit(**_OPTIONS)
parallel_kernel = numba.njit(parallel=True, **_OPTIONS)


@intrinsic
def popcount(_context, word):
    """Number of set bits of a uint64."""

    def build(context, builder, signature, arguments):
        return builder.ctpop(arguments[0])

    return types.uint64(types.uint64), build


@intrinsic
def trailing_zeros(_context, word):
    """Number of zero bits below the lowest set bit of a uint64; 64 for 0."""

    def build(context, builder, signature, arguments):
        return builder.cttz(arguments[0], ir.Constant(ir.IntType(1), 0))

    return types.uint64(types.uint64), build


@intrinsic
def bits_from_float(_context, number):
    """The bits of a float32 as int32."""

    def build(context, builder, signature, arguments):
        return builder.bitcast(arguments[0], ir.IntType(32))

    return types.int32(types.float32), build


@intrinsic
def float_from_bits(_context, bits):
    """The float32 that has these int32 bits."""

    def build(context, builder, signature, arguments):
        return builder.bitcast(arguments[0], ir.FloatType())

    return types.float32(types.int32), build


class _CompileClock(event.Listener):
    """Seconds that numba spent compiling; nested compilations are counted once."""

    def __init__(self):
        self.seconds = 0.0
        self._depth = 0
        self._start = 0.0

    def on_start(self, event):
        if self._depth == 0:
            self._start = time.perf_counter()
        self._depth += 1

    def on_end(self, event):
        self._depth -= 1
        if self._depth == 0:
            self.seconds += time.perf_counter() - self._start


_clock = _CompileClock()
event.register("numba:compile", _clock)


def compile_seconds() -> float:
    """Seconds spent compiling kernels so far; loading them from disk is not compiling."""
    return _clock.seconds


def max_threads() -> int:
    """Threads numba may use: the processor's cores, or NUMBA_NUM_THREADS."""
    return numba.config.NUMBA_NUM_THREADS


def set_threads(count: int) -> None:
    """Threads that the next parallel kernel of this Python thread uses, 1 … `max_threads()`."""
    numba.set_num_threads(count)
