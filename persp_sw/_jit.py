"""The only place that configures numba.

Kernels are compiled once and kept on disk. numba's cache does not notice an edit to a helper in another
file, so its folder carries a hash of all the sources that hold compiled code. `OMP_WAIT_POLICY=passive`
must be set before OpenMP starts: idle workers would otherwise spin and take the display's core.
"""

from __future__ import annotations

import functools
import hashlib
import inspect
import os
import tempfile
import time
from pathlib import Path

import llvmlite.binding

from .errors import SettingsError

_PACKAGE = Path(__file__).parent


def _sources_hash() -> str:
    digest = hashlib.sha256()
    for path in sorted([*_PACKAGE.glob("kernels/*.py"), *_PACKAGE.glob("reference/*.py"), Path(__file__)]):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _variant() -> str:
    return f"{_sources_hash()}-{'vector' if VECTORS else 'portable'}"


def _cache_folder() -> Path:
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    folder = Path(home) / "persp_sw" / f"kernels-{_variant()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        folder = Path(tempfile.gettempdir()) / f"persp_sw-kernels-{os.getuid()}-{_variant()}"
        folder.mkdir(parents=True, exist_ok=True)
    return folder


def _has_vectors() -> bool:
    """Whether kernels may use AVX-512; PERSP_SW_KERNELS=portable says no, =vector insists."""
    wanted = os.environ.get("PERSP_SW_KERNELS", "")
    if wanted not in ("", "portable", "vector"):
        raise SettingsError(f"PERSP_SW_KERNELS is 'portable' or 'vector'; given {wanted!r}")
    if wanted or "NUMBA_CPU_NAME" in os.environ:  # numba compiles for another processor than this
        return wanted == "vector"
    features = llvmlite.binding.get_host_cpu_features()
    return all(features.get(name, False) for name in ("avx512f", "avx512dq", "avx512bw", "avx512vl"))


VECTORS = _has_vectors()

os.environ.setdefault("OMP_WAIT_POLICY", "passive")

import numba  # noqa: E402

# Not in the environment: a child process may want other kernels, and numba would hand it these.
if "NUMBA_CACHE_DIR" not in os.environ:
    numba.config.CACHE_DIR = str(_cache_folder())
numba.config.THREADING_LAYER = "omp"

from llvmlite import ir  # noqa: E402
from numba import prange, types  # noqa: E402
from numba.core import event  # noqa: E402
from numba.extending import intrinsic, overload  # noqa: E402

__all__ = [
    "VECTORS",
    "bits_of",
    "byte_now",
    "compile_seconds",
    "exponent_and_mantissa",
    "inlined_kernel",
    "intrinsic",
    "kernel",
    "kernel_by_type",
    "lean_kernel",
    "max_threads",
    "parallel_kernel",
    "popcount",
    "power_of_two",
    "prange",
    "prefetch",
    "set_threads",
    "trailing_zeros",
    "types",
]

# No fast-math: NaN marks voxels that are not there and must stay NaN. `contract` lets a*b + c fuse.
_OPTIONS = {"nogil": True, "cache": True, "fastmath": {"contract"}, "error_model": "numpy"}

kernel = numba.njit(**_OPTIONS)
parallel_kernel = numba.njit(parallel=True, **_OPTIONS)
# For helpers of inner loops, which may not make arrays: else references are counted, atomically, at
# every call, 10 ns each.
lean_kernel = numba.njit(_nrt=False, **_OPTIONS)
# An array is passed as eight numbers: a call with ten of them for every packet took longer than the packet.
inlined_kernel = numba.njit(_nrt=False, forceinline=True, **_OPTIONS)


def kernel_by_type(stub):
    """Decorator: the function below, given the argument types, returns the inlined kernel that `stub` means.

    It has the stub's parameters, and so has the kernel. One caller's body then serves several types, each
    compiled, and kept on disk, only when it is used.
    """
    options = {name: value for name, value in _OPTIONS.items() if name != "cache"}

    def decorate(choose):
        @functools.wraps(choose)
        def chosen(*types_):
            return choose(*types_).py_func

        chosen.__signature__ = inspect.signature(choose)
        return overload(stub, jit_options={"_nrt": False, "forceinline": True, **options})(chosen)

    return decorate


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
def bits_of(_context, flags):
    """Which of the first 64 bytes of a contiguous uint8 array are not 0, as uint64; the first is bit 0."""

    def build(context, builder, signature, arguments):
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        bytes_ = ir.VectorType(ir.IntType(8), 64)
        loaded = builder.load(builder.bitcast(data, bytes_.as_pointer()), align=1)
        return builder.bitcast(builder.icmp_unsigned("!=", loaded, bytes_(None)), ir.IntType(64))

    return types.uint64(flags), build


@intrinsic
def byte_now(_context, flags):
    """The first byte of a uint8 array as it is in memory now: another thread may have written it.

    A plain load would be taken out of the loop, and never see that. LLVM leaves a monotonic one where it is;
    on x86 and ARM it is an ordinary load.
    """

    def build(context, builder, signature, arguments):
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        return builder.load_atomic(data, "monotonic", 1)

    return types.uint8(flags), build


@intrinsic
def power_of_two(_context, shifted):
    """2^n as float32, where `shifted` = 1.5·2^23 + n is float32 and n an integer, −126 … 127.

    Integer arithmetic in numba widens to 64 bits, which halves the vectors; this stays in 32.
    """

    def build(context, builder, signature, arguments):
        word = ir.IntType(32)
        mantissa = builder.bitcast(arguments[0], word)  # its low bits are those of n
        exponent = builder.shl(mantissa, ir.Constant(word, 23))
        bias = ir.Constant(word, ((127 - 0x4B400000) << 23) & 0xFFFFFFFF)
        return builder.bitcast(builder.add(exponent, bias), ir.FloatType())

    return types.float32(types.float32), build


@intrinsic
def exponent_and_mantissa(_context, x):
    """(n, m) as float32, x = m·2^n, 1 ≤ m < 2, of a normal float32 > 0; two numbers of any other."""

    def build(context, builder, signature, arguments):
        word = ir.IntType(32)
        bits = builder.bitcast(arguments[0], word)
        exponent = builder.and_(builder.lshr(bits, ir.Constant(word, 23)), ir.Constant(word, 0xFF))
        exponent = builder.sitofp(builder.sub(exponent, ir.Constant(word, 127)), ir.FloatType())
        one = ir.Constant(word, 0x3F800000)
        mantissa = builder.or_(builder.and_(bits, ir.Constant(word, 0x7FFFFF)), one)
        mantissa = builder.bitcast(mantissa, ir.FloatType())
        return context.make_tuple(builder, signature.return_type, (exponent, mantissa))

    return types.UniTuple(types.float32, 2)(types.float32), build


@intrinsic
def prefetch(_context, array, index):
    """Ask for the cache line of array[index], a one-dimensional array's; nothing happens beyond its ends."""

    def build(context, builder, signature, arguments):
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        byte, word = ir.IntType(8).as_pointer(), ir.IntType(32)
        name = "llvm.prefetch.p0"
        function = builder.module.globals.get(name) or ir.Function(
            builder.module, ir.FunctionType(ir.VoidType(), [byte, word, word, word]), name
        )
        read, everywhere, is_data = ir.Constant(word, 0), ir.Constant(word, 3), ir.Constant(word, 1)
        address = builder.bitcast(builder.gep(data, [arguments[1]]), byte)
        builder.call(function, [address, read, everywhere, is_data])
        return context.get_dummy_value()

    return types.void(array, types.int64), build


class _CompileClock(event.Listener):
    """Seconds that numba's compiler was busy or being waited for; what is nested is counted once."""

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
# Held while a kernel is compiled and while it is loaded from disk; numba has no event for loading alone.
event.register("numba:compiler_lock", _clock)


def compile_seconds() -> float:
    """Seconds spent so far on compiling kernels or loading them from disk."""
    return _clock.seconds


def max_threads() -> int:
    """Threads numba may use: the processor's cores, or NUMBA_NUM_THREADS."""
    return numba.config.NUMBA_NUM_THREADS


def set_threads(count: int) -> None:
    """Threads that the next parallel kernel of this Python thread uses, 1 … `max_threads()`."""
    numba.set_num_threads(count)
