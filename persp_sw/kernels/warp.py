"""The software warp: faces of an eye image to the pixels of a view.

A face's pixel coordinates are a projective function of the view's, (U, V, W) = H·(column, row, 1) and
u = U/W, v = V/W. So along a row of the view everything that decides whether a face shows a pixel is linear in
the column: what a face shows is one interval, and no pixel has to ask which face is its own.
"""

import numpy as np
from llvmlite import ir

from .._jit import intrinsic, kernel, parallel_kernel, prange, types

_F = np.float32
_CHUNK = 64  # pixels whose places are found together, as vectors
_ONE = np.uint64(1)


@intrinsic
def _look_up(_context, pixels, at, below, fraction_u, fraction_v, out, to):
    """out[to] = pixels interpolated between at, at + 1, below and below + 1; four floats as one vector."""

    def build(context, builder, signature, arguments):
        pixel, word = ir.VectorType(ir.FloatType(), 4), ir.IntType(64)
        source, target = (
            builder.bitcast(
                context.make_array(signature.args[n])(context, builder, arguments[n]).data, pixel.as_pointer()
            )
            for n in (0, 5)
        )

        def read(index, further):
            address = builder.gep(source, [builder.add(index, ir.Constant(word, further))])
            return builder.load(address, align=4)

        def mix(one, other, share):
            difference = builder.fsub(other, one, flags=("contract",))
            return builder.fadd(
                one, builder.fmul(share, difference, flags=("contract",)), flags=("contract",)
            )

        def everywhere(scalar):
            first = builder.insert_element(
                ir.Constant(pixel, ir.Undefined), scalar, ir.Constant(ir.IntType(32), 0)
            )
            return builder.shuffle_vector(
                first, first, ir.Constant(ir.VectorType(ir.IntType(32), 4), [0] * 4)
            )

        across, down = everywhere(arguments[3]), everywhere(arguments[4])
        above = mix(read(arguments[1], 0), read(arguments[1], 1), across)
        under = mix(read(arguments[2], 0), read(arguments[2], 1), across)
        builder.store(mix(above, under, down), builder.gep(target, [arguments[6]]), align=4)
        return context.get_dummy_value()

    arguments = (pixels, types.uint64, types.uint64, types.float32, types.float32, out, types.uint64)
    return types.void(*arguments), build


@kernel
def _limit(constant, slope, interval):
    """Narrow the interval [begin, end) of columns to those where constant + slope·(column + ½) ≥ 0.

    Two faces that share a border ask with the same numbers and opposite signs: each pixel is one's.
    """
    if slope > 0.0:
        interval[0] = max(interval[0], np.ceil(-constant / slope - 0.5))
    elif slope < 0.0:
        interval[1] = min(interval[1], np.ceil(constant / -slope - 0.5))
    elif constant < 0.0:
        interval[1] = -np.inf


@kernel
def _count(tangents, y, first, count, alone, counts):
    """How much a face counts for pixels of a row, see `geometry.seams`."""
    t = tangents
    for n in range(np.uint64(count)):
        x = np.float64(first + np.int64(n)) + 0.5
        scale = 1.0 / (t[2, 0] * x + t[2, 1] * y + t[2, 2])
        t_i = (t[0, 0] * x + t[0, 1] * y + t[0, 2]) * scale
        t_j = (t[1, 0] * x + t[1, 1] * y + t[1, 2]) * scale
        counts[n] = _F(max(1.0 / max(abs(t_i), abs(t_j), 1.0) - alone, 0.0))


@kernel
def _clear_rest(pixels, shown, written):
    """Clear what a row held before, but for the faces' columns; `written` is then all of these."""
    column, begin, end = written[0], len(pixels), 0
    for face in range(len(shown)):
        if shown[face, 0] < shown[face, 1]:
            begin, end = min(begin, shown[face, 0]), max(end, shown[face, 1])
    while column < written[1]:
        held, following = column, written[1]
        for face in range(len(shown)):
            if shown[face, 0] <= column < shown[face, 1]:
                held = max(held, shown[face, 1])
            elif column < shown[face, 0] < shown[face, 1]:
                following = min(following, shown[face, 0])
        if held == column:
            pixels[column:following] = _F(0.0)
            held = following
        column = held
    written[0], written[1] = begin, end


@parallel_kernel
def warp(face_from_view, borders, inner, tangents_from_view, alone, sizes, pixels, written, out):
    """Look every pixel's ray up in the faces that show it, bilinearly; nothing outside the faces.

    Parameters
    ----------
    face_from_view
        float64 (n, 3, 3): H of each face, to coordinates in which pixel centres are whole numbers.
    borders
        float64 (n, m, 3): a face shows the pixel points p = (column, row, 1) with b·p ≥ 0 for its m borders
        b.
    inner
        float64 (n, m, 3): likewise where it does so alone; else it is mixed with others (`geometry.seams`).
    tangents_from_view
        float64 (n, 3, 3): likewise, to the tangents of each face; asked where faces are mixed.
    alone
        c of the seams: how much faces count where they are mixed.
    sizes
        int64 (n, 3): width, height and first pixel in `pixels`.
    pixels
        float32 (total, 4): the faces' pixels, row by row.
    written
        int64 (height, 2): columns [begin, end) of each row of `out` that may not be 0; overwritten.
    out
        float32 (height, width, 4), overwritten.
    """
    flat = out.reshape(-1)
    faces = len(sizes)
    for row in prange(out.shape[0]):
        y = row + 0.5
        interval, shown = np.empty(2), np.zeros((faces, 2), np.int64)
        at, below = np.empty(_CHUNK, np.uint64), np.empty(_CHUNK, np.uint64)
        across, down = np.empty(_CHUNK, np.float32), np.empty(_CHUNK, np.float32)
        counts, found = np.empty(_CHUNK, np.float32), np.empty(4 * _CHUNK, np.float32)
        total = np.zeros(out.shape[1] if faces > 1 else 0, np.float32)
        mixed_begin, mixed_end = out.shape[1], 0
        for face in range(faces):
            h, width, height = face_from_view[face], sizes[face, 0], sizes[face, 1]
            u_0, v_0, w_0 = h[0, 1] * y + h[0, 2], h[1, 1] * y + h[1, 2], h[2, 1] * y + h[2, 2]
            u_x, v_x, w_x = h[0, 0], h[1, 0], h[2, 0]
            last_u, last_v = width - 1.0, height - 1.0
            interval[0], interval[1] = 0.0, np.float64(out.shape[1])
            for n in range(borders.shape[1]):
                b = borders[face, n]
                _limit(b[1] * y + b[2], b[0], interval)
            _limit(w_0, w_x, interval)
            _limit(u_0, u_x, interval)
            _limit(v_0, v_x, interval)
            _limit(last_u * w_0 - u_0, last_u * w_x - u_x, interval)
            _limit(last_v * w_0 - v_0, last_v * w_x - v_x, interval)
            begin = np.int64(min(interval[0], np.float64(out.shape[1])))
            end = max(np.int64(max(interval[1], 0.0)), begin)
            shown[face, 0], shown[face, 1] = begin, end
            for n in range(inner.shape[1]):
                b = inner[face, n]
                _limit(b[1] * y + b[2], b[0], interval)
            alone_begin = min(max(np.int64(min(interval[0], np.float64(end))), begin), end)
            alone_end = min(max(np.int64(max(interval[1], 0.0)), alone_begin), end)
            for piece in range(3):
                mixed = piece != 1
                piece_begin = begin if piece == 0 else alone_begin if piece == 1 else alone_end
                piece_end = alone_begin if piece == 0 else alone_end if piece == 1 else end
                for first in range(piece_begin, piece_end, _CHUNK):
                    count = min(piece_end - first, _CHUNK)
                    for n in range(np.uint64(count)):
                        x = np.float64(first + np.int64(n)) + 0.5
                        scale = 1.0 / (w_0 + w_x * x)
                        u = min(max((u_0 + u_x * x) * scale, 0.0), last_u)
                        v = min(max((v_0 + v_x * x) * scale, 0.0), last_v)
                        left, top = min(np.floor(u), last_u - 1.0), min(np.floor(v), last_v - 1.0)
                        across[n], down[n] = _F(u - left), _F(v - top)
                        start = np.uint64(sizes[face, 2] + np.int64(top) * width + np.int64(left))
                        at[n], below[n] = start, start + np.uint64(width)
                    to = np.uint64(row * out.shape[1] + first)
                    if not mixed:
                        for n in range(np.uint64(count)):
                            _look_up(pixels, at[n], below[n], across[n], down[n], flat, to + n)
                        continue
                    mixed_begin, mixed_end = min(mixed_begin, first), max(mixed_end, first + count)
                    _count(tangents_from_view[face], y, first, count, alone, counts)
                    for n in range(np.uint64(count)):
                        _look_up(pixels, at[n], below[n], across[n], down[n], found, n)
                    for n in range(np.uint64(count)):
                        old = total[first + n]
                        total[first + n] = old + counts[n]
                        for channel in range(4):
                            more = counts[n] * found[4 * n + channel]
                            value = out[row, first + n, channel]
                            out[row, first + n, channel] = more + (value if old > _F(0.0) else _F(0.0))
        for x in range(mixed_begin, mixed_end):
            if total[x] > _F(0.0):
                for channel in range(4):
                    out[row, x, channel] /= total[x]
        _clear_rest(out[row], shown, written[row])
