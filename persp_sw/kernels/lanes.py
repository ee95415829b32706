"""Sixteen pixels as one LLVM vector: just enough operators to write a kernel as mathematics.

numba has no vector type and its loops over look-ups stay scalar, so `packet_vector` builds LLVM's
`<16 x float>` itself. Nothing here is made for one processor but `permute`: LLVM turns the rest into whatever
vectors there are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from llvmlite import ir

from .state import TILE

if TYPE_CHECKING:
    from collections.abc import Callable

_FLOAT, _INT32, _INT64 = ir.FloatType(), ir.IntType(32), ir.IntType(64)
_FLOATS, _INTS = ir.VectorType(_FLOAT, TILE), ir.VectorType(_INT32, TILE)
_CONTRACT = ("contract",)  # a·b + c may become one fused operation, as in the other kernels


class Floats:
    """16 float32 under construction in `builder`; `value` is the LLVM value."""

    def __init__(self, builder: ir.IRBuilder, value: ir.Value):
        self.builder, self.value = builder, value

    def _other(self, other: Floats | float) -> ir.Value:
        return other.value if isinstance(other, Floats) else ir.Constant(_FLOATS, [float(other)] * TILE)

    def _new(self, value: ir.Value) -> Floats:
        return Floats(self.builder, value)

    def __add__(self, other):
        return self._new(self.builder.fadd(self.value, self._other(other), flags=_CONTRACT))

    __radd__ = __add__

    def __sub__(self, other):
        return self._new(self.builder.fsub(self.value, self._other(other), flags=_CONTRACT))

    def __rsub__(self, other):
        return self._new(self.builder.fsub(self._other(other), self.value, flags=_CONTRACT))

    def __mul__(self, other):
        return self._new(self.builder.fmul(self.value, self._other(other), flags=_CONTRACT))

    __rmul__ = __mul__

    def __truediv__(self, other):
        return self._new(self.builder.fdiv(self.value, self._other(other), flags=_CONTRACT))

    def __rtruediv__(self, other):
        return self._new(self.builder.fdiv(self._other(other), self.value, flags=_CONTRACT))

    def __lt__(self, other):
        return self.builder.fcmp_ordered("<", self.value, self._other(other))

    def __ge__(self, other):
        return self.builder.fcmp_ordered(">=", self.value, self._other(other))

    def __gt__(self, other):
        return self.builder.fcmp_ordered(">", self.value, self._other(other))

    def is_number(self):
        """Mask of the lanes that are not NaN."""
        return self.builder.fcmp_ordered("ord", self.value, self.value)

    def at_least(self, bound: Floats | float) -> Floats:
        """The larger of the two; NaN becomes the bound."""
        bound = self._new(self._other(bound))
        return where(self.builder.fcmp_ordered(">", self.value, bound.value), self, bound)

    def at_most(self, bound: Floats | float) -> Floats:
        """The smaller of the two; NaN becomes the bound."""
        bound = self._new(self._other(bound))
        return where(self.builder.fcmp_ordered("<", self.value, bound.value), self, bound)

    def absolute(self) -> Floats:
        """Without their signs."""
        return self._of_each("fabs")

    def floor(self) -> Floats:
        """Largest whole number not above."""
        return self._of_each("floor")

    def square_root(self) -> Floats:
        """NaN of negative numbers."""
        return self._of_each("sqrt")

    def exponent_and_mantissa(self) -> tuple[Floats, Floats]:
        """See `_jit.exponent_and_mantissa`."""
        builder = self.builder
        bits = builder.bitcast(self.value, _INTS)
        exponent = builder.and_(builder.lshr(bits, _integers(23)), _integers(0xFF))
        exponent = builder.sitofp(builder.sub(exponent, _integers(127)), _FLOATS)
        mantissa = builder.or_(builder.and_(bits, _integers(0x7FFFFF)), _integers(0x3F800000))
        return self._new(exponent), self._new(builder.bitcast(mantissa, _FLOATS))

    def _of_each(self, operation: str) -> Floats:
        name = f"llvm.{operation}.v{TILE}f32"
        function = self.builder.module.globals.get(name) or ir.Function(
            self.builder.module, ir.FunctionType(_FLOATS, [_FLOATS]), name
        )
        return self._new(self.builder.call(function, [self.value]))

    def to_integers(self) -> ir.Value:
        """`<16 x i32>`, rounded towards zero; the lanes must be numbers."""
        return self.builder.fptosi(self.value, _INTS)


def _integers(number: int) -> ir.Constant:
    return ir.Constant(_INTS, [number] * TILE)


def where(mask: ir.Value, one: Floats, other: Floats | float) -> Floats:
    """`one` where the mask is set, else `other`."""
    return one._new(one.builder.select(mask, one.value, one._other(other)))


def constant(builder: ir.IRBuilder, values: list[float]) -> Floats:
    """Sixteen given numbers."""
    return Floats(builder, ir.Constant(_FLOATS, values))


def everywhere(builder: ir.IRBuilder, scalar: ir.Value) -> Floats:
    """One float32 in all lanes."""
    single = builder.insert_element(ir.Constant(_FLOATS, ir.Undefined), scalar, ir.Constant(_INT32, 0))
    return Floats(builder, shuffle(builder, single, single, [0] * TILE))


def shuffle(builder: ir.IRBuilder, one: ir.Value, other: ir.Value, order: list[int]) -> ir.Value:
    """The elements `order` of `one` and `other` laid end to end."""
    return builder.shuffle_vector(one, other, ir.Constant(ir.VectorType(_INT32, len(order)), order))


def load(builder: ir.IRBuilder, pointer: ir.Value, offset: ir.Value, *, signed: bool = True) -> Floats:
    """16 numbers of any type from pointer[offset …], aligned or not, as floats."""
    element = pointer.type.pointee
    address = builder.bitcast(builder.gep(pointer, [offset]), ir.VectorType(element, TILE).as_pointer())
    values = builder.load(address, align=1)
    if element != _FLOAT:
        values = builder.sitofp(values, _FLOATS) if signed else builder.uitofp(values, _FLOATS)
    return Floats(builder, values)


def store(builder: ir.IRBuilder, values: Floats, pointer: ir.Value, offset: ir.Value) -> None:
    """16 floats to pointer[offset …]."""
    address = builder.bitcast(builder.gep(pointer, [offset]), _FLOATS.as_pointer())
    builder.store(values.value, address, align=4)


def permute(builder: ir.IRBuilder, one: Floats, other: Floats, index: ir.Value) -> Floats:
    """Lane l of the result is number index[l] (its low 5 bits) of `one` and `other` laid end to end.

    The only operation that asks for one kind of processor: AVX-512.
    """
    name = "llvm.x86.avx512.vpermi2var.ps.512"
    function = builder.module.globals.get(name) or ir.Function(
        builder.module, ir.FunctionType(_FLOATS, [_FLOATS, _INTS, _FLOATS]), name
    )
    return Floats(builder, builder.call(function, [one.value, index, other.value]))


def look_up(builder: ir.IRBuilder, table: ir.Value, rows: ir.Value) -> list[Floats]:
    """The four columns of `rows` of a table with four floats a row.

    16 loads of a row each and a transpose: a gather of every column costs two to four times as much.
    """
    loaded = [_row(builder, table, rows, lane) for lane in range(TILE)]
    return [Floats(builder, column) for column in _transposed(builder, loaded)]


def look_up_differences(
    builder: ir.IRBuilder, table: ir.Value, rows: ir.Value, others: ir.Value
) -> list[Floats]:
    """The four columns of `others` less those of `rows`, of a table with four int32 a row."""
    pairs = [[_row(builder, table, which, lane) for which in (others, rows)] for lane in range(TILE)]
    columns = _transposed(builder, [builder.sub(*pair) for pair in pairs])
    return [Floats(builder, builder.sitofp(column, _FLOATS)) for column in columns]


def look_up_column(builder: ir.IRBuilder, table: ir.Value, rows: ir.Value, column: int) -> ir.Value:
    """`<16 x i32>`: one column of `rows` of a table with four int32 a row."""
    result = ir.Constant(_INTS, ir.Undefined)
    for lane in range(TILE):
        row = builder.zext(builder.extract_element(rows, ir.Constant(_INT32, lane)), _INT64)
        at = builder.add(builder.shl(row, ir.Constant(_INT64, 2)), ir.Constant(_INT64, column))
        number = builder.load(builder.gep(table, [at]))
        result = builder.insert_element(result, number, ir.Constant(_INT32, lane))
    return result


def look_up_float(builder: ir.IRBuilder, table: ir.Value, rows: ir.Value) -> Floats:
    """`rows` of a table of single floats."""
    result = ir.Constant(_FLOATS, ir.Undefined)
    for lane in range(TILE):
        row = builder.zext(builder.extract_element(rows, ir.Constant(_INT32, lane)), _INT64)
        number = builder.load(builder.gep(table, [row]))
        result = builder.insert_element(result, number, ir.Constant(_INT32, lane))
    return Floats(builder, result)


def any_set(builder: ir.IRBuilder, flags: ir.Value, rows: ir.Value) -> ir.Value:
    """Whether any of flags[rows], bytes, is not 0."""
    result = ir.Constant(ir.IntType(8), 0)
    for lane in range(TILE):
        row = builder.zext(builder.extract_element(rows, ir.Constant(_INT32, lane)), _INT64)
        result = builder.or_(result, builder.load(builder.gep(flags, [row])))
    return builder.icmp_unsigned("!=", result, ir.Constant(ir.IntType(8), 0))


def to_floats(builder: ir.IRBuilder, integers: ir.Value) -> Floats:
    """`<16 x i32>` as floats."""
    return Floats(builder, builder.sitofp(integers, _FLOATS))


def select(builder: ir.IRBuilder, mask: ir.Value, one: ir.Value, other: ir.Value) -> ir.Value:
    """Of two `<16 x i32>`, `one` where the mask is set."""
    return builder.select(mask, one, other)


def _row(builder: ir.IRBuilder, table: ir.Value, rows: ir.Value, lane: int) -> ir.Value:
    """The four numbers of row rows[lane]."""
    row = builder.zext(builder.extract_element(rows, ir.Constant(_INT32, lane)), _INT64)
    at = builder.gep(table, [builder.shl(row, ir.Constant(_INT64, 2))])
    address = builder.bitcast(at, ir.VectorType(table.type.pointee, 4).as_pointer())
    return builder.load(address, align=4)


def _transposed(builder: ir.IRBuilder, rows: list[ir.Value]) -> list[ir.Value]:
    """Sixteen rows of four as four columns of sixteen."""
    quarters = []  # [m]: the rows of lanes m, 4 + m, 8 + m and 12 + m, one in each 128 bits
    for m in range(4):
        halves = [shuffle(builder, rows[m + q], rows[m + q + 4], list(range(8))) for q in (0, 8)]
        quarters.append(shuffle(builder, *halves, list(range(16))))
    columns = []
    for high in (0, 2):  # columns 0 and 1, then 2 and 3
        order = [n + q for q in (0, 4, 8, 12) for n in (high, high + TILE, high + 1, high + 1 + TILE)]
        front = shuffle(builder, quarters[0], quarters[1], order)  # a column's lanes 0, 1, and the next's
        back = shuffle(builder, quarters[2], quarters[3], order)
        for first in (0, 2):
            order_2 = [
                n + q for q in (0, 4, 8, 12) for n in (first, first + 1, first + TILE, first + 1 + TILE)
            ]
            columns.append(shuffle(builder, front, back, order_2))
    return columns


def power_of_two(builder: ir.IRBuilder, shifted: Floats) -> Floats:
    """2^n where `shifted` = 1.5·2^23 + n, n whole, −126 … 127: n stands in the mantissa's low bits."""
    bits = builder.shl(builder.bitcast(shifted.value, _INTS), _integers(23))
    bias = _integers(((127 - 0x4B400000) << 23) & 0xFFFFFFFF)
    return Floats(builder, builder.bitcast(builder.add(bits, bias), _FLOATS))


def none(builder: ir.IRBuilder, mask: ir.Value) -> ir.Value:
    """Whether the mask is empty."""
    bits = builder.bitcast(mask, ir.IntType(TILE))
    return builder.icmp_unsigned("==", bits, ir.Constant(ir.IntType(TILE), 0))


def where_any(builder: ir.IRBuilder, mask: ir.Value, build: Callable[[], ir.Value]) -> ir.Value:
    """The truth value that `build` makes, made only if the mask is not empty; else false."""
    start, inside, after = builder.block, *(builder.append_basic_block() for _ in range(2))
    builder.cbranch(none(builder, mask), after, inside)
    builder.position_at_end(inside)
    made = build()
    last = builder.block
    builder.branch(after)
    builder.position_at_end(after)
    result = builder.phi(ir.IntType(1))
    result.add_incoming(made, last)
    result.add_incoming(ir.Constant(ir.IntType(1), 0), start)
    return result
