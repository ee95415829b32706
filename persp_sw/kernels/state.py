"""The pixels of a tile while it is composited, sections of 16 floats in `lanes`; α's polynomial."""

import numpy as np

TILE = 16  # pixels in a tile: one 512-bit vector of floats

# Accumulated colour and opacity; the ray's range, counted from `base`; the ray's world length in one slice
# interval; the opacity at which it stops; the scalars of two samples being composited, NaN where there is
# none. Of a pre-integrated sample, VALUE and SECOND hold the border of table rows where its piece of the
# ray begins, and their ENDs that where it ends; beyond the table, too.
(RED, GREEN, BLUE, ALPHA, RAY_NEAR, RAY_FAR, LENGTH, ENOUGH, VALUE, SECOND, VALUE_END, SECOND_END) = (
    np.uint64(TILE * n) for n in range(12)
)  # fmt: skip
SECTIONS = 12

# What gradients make of the two samples being composited, of the tile at work alone: factors of the colour,
# what is added to that, the factor of the extinction, and how many rows of the table the gradient's magnitude
# skips. Then room to work: the scalars of its neighbours on both sides along i, j and k, and later
# its normal, the ray's direction, the cosine between normal and eye, the normal's square, the factor of the
# colour before it is lit, and what is left of a light.
(
    LIT_RED, LIT_GREEN, LIT_BLUE, SHINE_RED, SHINE_GREEN, SHINE_BLUE, THICKER, SKIPPED,
) = (np.uint64(TILE * n) for n in range(8))  # fmt: skip
LIGHT_OF_SECOND = np.uint64(TILE * 8)
NEIGHBOURS = np.uint64(TILE * 16)
NORMAL, DIRECTION, COSINE, SQUARE, TINT, LEFT = (np.uint64(TILE * n) for n in (22, 25, 28, 29, 30, 31))
LIGHT_SECTIONS = 32

# α = 1 − 2^y is taken as 1 − 2^n·(1 + q) with q = 2^f − 1 = f·(c1 + f·(c2 + …)), |f| ≤ ½, the Taylor series
# of exp(f·ln 2), remainder below 6e-9: no cancellation, so the faintest media keep their relative accuracy.
MINUS_LOG2E = np.float32(-1.4426950408889634)
MINUS_LN2 = np.float32(-0.6931471805599453)
THIN = np.float32(0.05)  # optical depth below which a piece dims itself as its series' first term says
ROUNDER = np.float32(12582912.0)  # 1.5·2^23: adding it leaves the nearest integer in the low bits
# Rows beyond a table that pre-integration counts to: the float32 product of its sum and count stays finite.
FAR_ROW = np.float32(1e9)
EXP2_COEFFICIENTS = tuple(
    np.float32(c)
    for c in (
        0.6931471805599453,
        0.2402265069591007,
        0.0555041086648216,
        0.009618129107628,
        0.0013333558146428,
        0.000154035303933816,
        1.5252733804059841e-05,
    )
)
