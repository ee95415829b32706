"""Powers of cosines as highlights take them, in float32: portable and vector kernels against numpy."""

from __future__ import annotations

import numpy as np
import pytest
from test_packets import KINDS
from tolerances import PHONG_LOG, PHONG_POWER

from persp_sw._jit import VECTORS, exponent_and_mantissa, intrinsic, kernel, types
from persp_sw.kernels import lanes as simd
from persp_sw.kernels import packet_lit_vector, phong
from persp_sw.kernels.packet_vector import Tile, pointer
from persp_sw.kernels.state import TILE

_portable_power = phong.power_of
SMALLEST = float(np.finfo(np.float32).tiny)


@kernel
def portable(x, power, out):
    for n in range(x.shape[0]):
        out[n] = _portable_power(x[n], power)


@kernel
def taken_apart(x, exponents, mantissas):
    for n in range(x.shape[0]):
        exponents[n], mantissas[n] = exponent_and_mantissa(x[n])


@intrinsic
def _sixteen(_context, x, power, out, at):
    def build(context, builder, signature, arguments):
        data = Tile(builder, pointer(context, builder, signature.args[0], arguments[0]), arguments[3])
        result = Tile(builder, pointer(context, builder, signature.args[2], arguments[2]), arguments[3])
        power = simd.everywhere(builder, arguments[1])
        result.write(packet_lit_vector.power_of(builder, data.read(0), power), 0)
        return context.get_dummy_value()

    return types.void(x, types.float32, out, types.int64), build


@kernel
def vector(x, power, out):
    for at in range(0, x.shape[0], TILE):
        _sixteen(x, power, out, at)


def powers(kind, x, power):
    """Of any number of float32."""
    padded = np.resize(x.astype(np.float32), -(-x.size // TILE) * TILE)
    out = np.full(padded.shape, np.nan, np.float32)
    (vector if kind == "vector" else portable)(padded, np.float32(power), out)
    return out[: x.size]


def numbers(rng):
    """Cosines 1e-30 … 1 of all sizes, and many near 1, where highlights are."""
    every = np.concatenate([
        10.0 ** rng.uniform(-30, 0, 20000), 1 - 10.0 ** rng.uniform(-7, 0, 20000),
        2.0 ** -np.arange(100), np.nextafter(np.float32(2.0) ** -np.arange(99), np.float32(0)),
        [1.0, np.sqrt(2), 1 / np.sqrt(2), 0.5],
    ])  # fmt: skip
    return every.astype(np.float32)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("power", [0.1, 0.5, 1.0, 2.0, 7.5, 20.0, 50.0, 333.3, 1e3, 1e4])
def test_powers_are_right_to_a_few_bits_of_the_logarithm(kind, power, rng):
    x = numbers(rng)
    x = x[x <= 1]
    expected = x.astype(float) ** np.float64(np.float32(power))
    found = powers(kind, x, power).astype(float)
    told = expected > 2 * SMALLEST
    relative = np.abs(found[told] / expected[told] - 1)
    # y = power · log2 x, of which float32 keeps 24 bits.
    y = np.abs(np.log2(expected[told]))
    assert told.sum() > 20
    assert (relative < PHONG_POWER * (1 + y) + PHONG_LOG * power * np.minimum(1, 1 - x[told])).all()
    assert (found[~told] <= 4 * SMALLEST).all() and (found >= 0).all()


@pytest.mark.parametrize("kind", KINDS)
def test_of_one_any_power_is_one_and_of_nothing_and_less_nothing(kind):
    for power in (0.1, 1.0, 20.0, 1e4):
        assert (powers(kind, np.ones(3), power) == 1).all()
        assert not powers(kind, np.array([0.0, -0.0, -1e-30, -0.5, -1.0, np.nan]), power).any()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("power", [0.1, 1.0, 20.0, 1e4])
def test_larger_cosines_have_larger_powers(kind, power):
    """To rounding: highlights have no rings."""
    x = np.linspace(0.9, 1, 5000).astype(np.float32)
    found = powers(kind, x, power).astype(float)
    assert (found[1:] >= found[:-1] * (1 - PHONG_POWER * 2) - PHONG_LOG * power * found[:-1] * 0.1).all()


@pytest.mark.skipif(not VECTORS, reason="this processor, or PERSP_SW_KERNELS, has no AVX-512")
def test_both_kinds_agree(rng):
    x = numbers(rng)
    x = x[x <= 1]
    for power in (0.1, 20.0, 1e4):
        one, other = (powers(kind, x, power).astype(float) for kind in ("portable", "vector"))
        np.testing.assert_allclose(one, other, rtol=PHONG_POWER * 128, atol=SMALLEST)


def test_exponent_and_mantissa_are_exact(rng):
    x = np.concatenate([
        10.0 ** rng.uniform(-37, 38, 5000), 2.0 ** np.arange(-126, 128),
        np.nextafter(np.float32(2.0) ** np.arange(-125, 127), np.float32(0)), [SMALLEST],
    ]).astype(np.float32)  # fmt: skip
    exponents, mantissas = np.empty_like(x), np.empty_like(x)
    taken_apart(x, exponents, mantissas)
    m, n = np.frexp(x)
    np.testing.assert_array_equal(mantissas, 2 * m)
    np.testing.assert_array_equal(exponents, n - 1)
