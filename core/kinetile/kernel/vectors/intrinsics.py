"""The functions of ``vectors`` as Numba intrinsics: portable LLVM vectors of eight, held in registers.

``interpreted`` has the meaning of each. Rows of a table are loaded and stored in one piece: a load that
covers several smaller stores has to wait until all of them are done.
"""

from __future__ import annotations

import operator
from typing import Any, cast

from llvmlite import ir
from numba import types as _types
from numba.core import cgutils as _cgutils
from numba.extending import intrinsic, models, overload, register_model
from numba.np.arrayobj import get_itemsize as _get_itemsize

from kinetile.kernel.vectors.interpreted import COLUMNS, LANES

types, cgutils = cast(Any, _types), cast(Any, _cgutils)

_INLINED: Any = {"forceinline": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
_DOUBLE, _WHOLE, _BIT, _WORD = ir.DoubleType(), ir.IntType(32), ir.IntType(1), ir.IntType(64)


class _Eight(_types.Type):
    """The type of eight values of an LLVM type."""

    def __init__(self, name: str, element: Any, one: Any) -> None:
        super().__init__(name=f"kinetile.eight({name})")
        self.one = one
        self.vector = ir.VectorType(element, LANES)


@register_model(_Eight)
class _EightModel(models.PrimitiveModel):
    """Held in registers, as an LLVM vector."""

    def __init__(self, manager: Any, fe_type: Any) -> None:
        cast(Any, super()).__init__(manager, fe_type, fe_type.vector)


_floats = _Eight("double", _DOUBLE, types.float64)
_wholes = _Eight("int32", _WHOLE, types.int32)
_ticks = _Eight("int64", _WORD, types.int64)
_truths = _Eight("bool", _BIT, types.boolean)


def _splat(builder: Any, value: Any, vector: Any) -> Any:
    """Return a vector with a value in all its lanes."""
    one = builder.insert_element(ir.Constant(vector, ir.Undefined), value, ir.Constant(_WHOLE, 0))
    zeros = ir.Constant(ir.VectorType(_WHOLE, LANES), [ir.Constant(_WHOLE, 0)] * LANES)
    return builder.shuffle_vector(one, one, zeros)


def _shuffle(builder: Any, one: Any, two: Any, lanes: list[int]) -> Any:
    """Return a vector of lanes of two."""
    mask = ir.Constant(ir.VectorType(_WHOLE, len(lanes)), [ir.Constant(_WHOLE, i) for i in lanes])
    return builder.shuffle_vector(one, two, mask)


def _data(context: Any, builder: Any, kind: Any, array: Any, element: Any) -> Any:
    """Return where an array's data begins, as a pointer to elements."""
    data = context.make_array(kind)(context, builder, value=array).data
    return builder.bitcast(data, element.as_pointer())


def _load(builder: Any, pointer: Any, vector: Any, align: int) -> Any:
    """Load a vector."""
    return builder.load(builder.bitcast(pointer, vector.as_pointer()), align=align)


def _binary(kinds: tuple[Any, Any], result: Any, build: Any) -> Any:
    """Return an intrinsic of two vectors."""

    @intrinsic
    def both(typing_context: Any, one: Any, two: Any) -> Any:
        def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return build(builder, *arguments)

        return result(*kinds), codegen

    return both


def _operator(symbol: Any, kind: Any, result: Any, build: Any) -> None:
    """Give two vectors of a kind an operator."""
    both = _binary((kind, kind), result, build)

    @overload(symbol, jit_options=_INLINED)
    def typed(one: Any, two: Any) -> Any:
        def run(one: Any, two: Any) -> Any:
            return both(one, two)

        return run if one == kind and two == kind else None


for _symbol, _name in ((operator.add, "fadd"), (operator.sub, "fsub"), (operator.mul, "fmul")):
    _operator(_symbol, _floats, _floats, lambda b, x, y, name=_name: getattr(b, name)(x, y))
_operator(operator.truediv, _floats, _floats, lambda b, x, y: b.fdiv(x, y))
for _symbol, _name in ((operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"), (operator.ge, ">=")):
    _operator(_symbol, _floats, _truths, lambda b, x, y, name=_name: b.fcmp_ordered(name, x, y))
for _kind in (_wholes, _ticks):
    for _symbol, _name in ((operator.lt, "<"), (operator.gt, ">"), (operator.eq, "==")):
        _operator(_symbol, _kind, _truths, lambda b, x, y, name=_name: b.icmp_signed(name, x, y))
    for _symbol, _name in ((operator.add, "add"), (operator.sub, "sub")):
        _operator(_symbol, _kind, _kind, lambda b, x, y, name=_name: getattr(b, name)(x, y))
_operator(operator.and_, _wholes, _wholes, lambda b, x, y: b.and_(x, y))
_operator(operator.rshift, _wholes, _wholes, lambda b, x, y: b.ashr(x, y))
_operator(operator.and_, _truths, _truths, lambda b, x, y: b.and_(x, y))
_operator(operator.or_, _truths, _truths, lambda b, x, y: b.or_(x, y))


@intrinsic
def spread(typing_context: Any, value: Any) -> Any:
    """Return eight times the same number."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _splat(builder, arguments[0], _floats.vector)

    return _floats(types.float64), codegen


@intrinsic
def spread_whole(typing_context: Any, value: Any) -> Any:
    """Return eight times the same whole number."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _splat(builder, builder.trunc(arguments[0], _WHOLE), _wholes.vector)

    return _wholes(types.int64), codegen


@intrinsic
def numbers(typing_context: Any, table: Any, first: Any) -> Any:
    """Return ``table[first:first + 8]`` of an array of int32, read in one piece."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, first = arguments
        at = builder.gep(_data(context, builder, signature.args[0], array, _WHOLE), [first])
        return _load(builder, at, _wholes.vector, 4)

    return _wholes(table, types.int64), codegen


def _names(context: Any, builder: Any, kind: Any, array: Any, first: Any) -> list[Any]:
    """Return eight numbers of an array, as words: read one by one, as they may have been stored, so that no
    load has to wait for several stores."""
    at = builder.gep(_data(context, builder, kind, array, _WHOLE), [first])
    each = [builder.gep(at, [ir.Constant(_WORD, i)]) for i in range(LANES)]
    return [builder.sext(builder.load_atomic(here, "unordered", 4), _WORD) for here in each]


@intrinsic
def fill(typing_context: Any, table: Any, first: Any, value: Any) -> Any:
    """Write a number to ``table[first:first + 8]`` of an array of int32."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, first, value = arguments
        at = builder.gep(_data(context, builder, signature.args[0], array, _WHOLE), [first])
        whole = _splat(builder, builder.trunc(value, _WHOLE), _wholes.vector)
        builder.store(whole, builder.bitcast(at, _wholes.vector.as_pointer()), align=4)
        return context.get_dummy_value()

    return types.void(table, types.int64, types.int64), codegen


@intrinsic
def numbered(typing_context: Any, value: Any, first: Any) -> Any:
    """Return numbers >= 2^-1000 with first, first + 1, ... (0 to 63) in their last six bits: each is less
    than it was, by less than 2^-45 of it."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        value, first = arguments
        vector = _ticks.vector
        less = ir.Constant(vector, [ir.Constant(_WORD, i - 64) for i in range(LANES)])
        mask = ir.Constant(vector, [ir.Constant(_WORD, -64)] * LANES)
        bits = builder.and_(builder.bitcast(value, vector), mask)
        bits = builder.add(bits, builder.add(less, _splat(builder, first, vector)))
        return builder.bitcast(bits, _floats.vector)

    return _floats(_floats, types.int64), codegen


@intrinsic
def number_in(typing_context: Any, value: Any) -> Any:
    """Return the last six bits of a number."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.and_(builder.bitcast(arguments[0], _WORD), ir.Constant(_WORD, 63))

    return types.int64(types.float64), codegen


@intrinsic
def root(typing_context: Any, value: Any) -> Any:
    """Return the square roots, correctly rounded; of a negative number, not a number."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        vector = _floats.vector
        kind = ir.FunctionType(vector, [vector])
        function = cgutils.get_or_insert_function(builder.module, kind, "llvm.sqrt.v8f64")
        return builder.call(function, arguments)

    return _floats(_floats), codegen


@intrinsic
def choose(typing_context: Any, where: Any, yes: Any, no: Any) -> Any:
    """Return ``yes`` in the lanes where it is true, else ``no``."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.select(*arguments)

    return yes(_truths, yes, yes), codegen


@intrinsic
def turned(typing_context: Any, value: Any, by: Any) -> Any:
    """Return the lanes turned round: lane i is what was lane i xor ``by`` (1, 2 or 4)."""
    if not isinstance(by, types.IntegerLiteral):
        return None
    distance = by.literal_value

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        vector, _ = arguments
        return _shuffle(builder, vector, vector, [i ^ distance for i in range(LANES)])

    return value(value, by), codegen


@intrinsic
def lane(typing_context: Any, value: Any, which: Any) -> Any:
    """Return one of the eight."""
    result = value.one

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        vector, which = arguments
        return builder.extract_element(vector, builder.trunc(which, _WHOLE))

    return result(value, types.int64), codegen


@intrinsic
def append(typing_context: Any, source: Any, first: Any, target: Any, end: Any) -> Any:
    """Copy eight numbers, ``source[first:first + 8]``, to ``target[end:end + 8]``; return the last.

    Both are arrays of int32. One load and one store; so seven numbers may be copied, and how many count.
    """

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        source, first, target, end = arguments
        here = builder.gep(_data(context, builder, signature.args[0], source, _WHOLE), [first])
        there = builder.gep(_data(context, builder, signature.args[2], target, _WHOLE), [end])
        block = _load(builder, here, _wholes.vector, 4)
        builder.store(block, builder.bitcast(there, _wholes.vector.as_pointer()), align=4)
        last = builder.extract_element(block, ir.Constant(_WHOLE, LANES - 1))
        return builder.sext(last, _WORD)

    return types.int64(source, types.int64, target, types.int64), codegen


@intrinsic
def prefetch(typing_context: Any, table: Any, row: Any) -> Any:
    """Ask the memory for the cache line in which a row of a table begins, and go on without waiting."""
    byte = ir.IntType(8)

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, row = arguments
        kind = signature.args[0]
        size = context.get_constant(types.intp, cast(Any, _get_itemsize)(context, kind))
        place = builder.gep(_data(context, builder, kind, array, byte), [builder.mul(row, size)])
        made = ir.FunctionType(ir.VoidType(), [byte.as_pointer(), _WHOLE, _WHOLE, _WHOLE])
        function = cgutils.get_or_insert_function(builder.module, made, "llvm.prefetch.p0")
        how = [ir.Constant(_WHOLE, number) for number in (0, 3, 1)]  # to read, into all caches, data
        builder.call(function, [place, *how])
        return context.get_dummy_value()

    return types.void(table, types.int64), codegen


@intrinsic
def product_error(typing_context: Any, a: Any, b: Any, product: Any) -> Any:
    """Return a * b - product exactly, for the rounded product: a fused multiply-add."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        a, b, product = arguments
        return builder.fma(a, b, builder.fneg(product))

    return types.float64(*[types.float64] * 3), codegen


@intrinsic
def lowest_bit(typing_context: Any, word: Any) -> Any:
    """Return the place of the lowest bit that is set in a word of 64; the word is not zero."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.cttz(arguments[0], ir.Constant(_BIT, 1))

    return types.int64(types.int64), codegen


@intrinsic
def eight(typing_context: Any, a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, g: Any, h: Any) -> Any:
    """Return eight whole numbers as a vector."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        found = ir.Constant(_wholes.vector, ir.Undefined)
        for i, value in enumerate(arguments):
            whole = builder.trunc(value, _WHOLE)
            found = builder.insert_element(found, whole, ir.Constant(_WHOLE, i))
        return found

    return _wholes(*[types.int64] * LANES), codegen


@intrinsic
def spread_ticks(typing_context: Any, value: Any) -> Any:
    """Return eight times the same tick."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _splat(builder, arguments[0], _ticks.vector)

    return _ticks(types.int64), codegen


@intrinsic
def flights(
    typing_context: Any, table: Any, a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, g: Any, h: Any
) -> Any:
    """Return x, y, vx, vy, anchor and reach of eight bodies.

    A record is a row of eight times eight bytes; the rows are loaded whole and turned into columns.
    """
    kinds = [_ticks if name == "anchor" else _floats for name in COLUMNS]
    result = types.Tuple(kinds)

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, *which = arguments
        record = signature.args[0].dtype
        if record.size != 8 * LANES:
            raise TypeError(f"a record of {8 * LANES} bytes is read at once, and this one has {record.size}")
        data = _data(context, builder, signature.args[0], array, _DOUBLE)
        rows = []
        for number in which:
            at = builder.gep(data, [builder.shl(number, ir.Constant(_WORD, 3))])
            rows.append(_load(builder, at, _floats.vector, 8))

        def column(c: int) -> Any:  # of two rows, of four, of all eight
            two = [c & 1, 8 + (c & 1), 2 + (c & 1), 10 + (c & 1)]
            two += [4 + (c & 1), 12 + (c & 1), 6 + (c & 1), 14 + (c & 1)]
            pairs = [_shuffle(builder, rows[i], rows[i + 1], two) for i in (0, 2, 4, 6)]
            first = c & 2
            four = [first, first + 1, 8 + first, 9 + first, 4 + first, 5 + first, 12 + first, 13 + first]
            halves = [_shuffle(builder, pairs[i], pairs[i + 1], four) for i in (0, 2)]
            begin = c & 4
            return _shuffle(builder, halves[0], halves[1], [begin + i for i in (0, 1, 2, 3, 8, 9, 10, 11)])

        columns = [
            builder.bitcast(column(record.offset(name) // 8), kind.vector)
            for name, kind in zip(COLUMNS, kinds, strict=True)
        ]
        return context.make_tuple(builder, result, columns)

    return result(table, *[types.int64] * LANES), codegen


@intrinsic
def places(typing_context: Any, table: Any, names: Any, first: Any) -> Any:
    """Return the four columns of the rows ``names[first:first + 8]`` of a table of four doubles a row: x, y,
    vx, vy of one of places."""
    result = types.UniTuple(_floats, 4)

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, names, first = arguments
        data = _data(context, builder, signature.args[0], array, _DOUBLE)
        row = ir.VectorType(_DOUBLE, 4)
        rows = []
        for number in _names(context, builder, signature.args[1], names, first):
            at = builder.gep(data, [builder.shl(number, ir.Constant(_WORD, 2))])
            rows.append(_load(builder, at, row, 8))
        # Rows i and i + 4 side by side; then pairs of columns of rows 0, 1, 4, 5 and of 2, 3, 6, 7, lane by
        # lane within halves of a vector, where a shuffle is cheapest.
        pairs = [_shuffle(builder, rows[i], rows[i + 4], list(range(8))) for i in range(4)]
        even, odd = [0, 8, 2, 10, 4, 12, 6, 14], [1, 9, 3, 11, 5, 13, 7, 15]
        left, right = [0, 1, 8, 9, 4, 5, 12, 13], [2, 3, 10, 11, 6, 7, 14, 15]
        x_vx, y_vy = (
            [_shuffle(builder, pairs[i], pairs[i + 1], lanes) for i in (0, 2)] for lanes in (even, odd)
        )
        found = [_shuffle(builder, one, two, lanes) for lanes in (left, right) for one, two in (x_vx, y_vy)]
        return context.make_tuple(builder, result, found)

    return result(table, names, types.int64), codegen


@intrinsic
def put_place(typing_context: Any, table: Any, number: Any, x: Any, y: Any, vx: Any, vy: Any) -> Any:
    """Write a row of a table of places in one piece: who reads it so need not wait for the parts."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, number, *values = arguments
        row = ir.VectorType(_DOUBLE, 4)
        whole = ir.Constant(row, ir.Undefined)
        for i, value in enumerate(values):
            whole = builder.insert_element(whole, value, ir.Constant(_WHOLE, i))
        data = _data(context, builder, signature.args[0], array, _DOUBLE)
        at = builder.gep(data, [builder.shl(number, ir.Constant(_WORD, 2))])
        builder.store(whole, builder.bitcast(at, row.as_pointer()), align=8)
        return context.get_dummy_value()

    return types.void(table, types.int64, *[types.float64] * 4), codegen


@intrinsic
def pick(typing_context: Any, table: Any, names: Any, first: Any) -> Any:
    """Return the entries ``names[first:first + 8]`` of an array of doubles."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, names, first = arguments
        if signature.args[0].layout != "C":
            raise TypeError("entries are picked from a contiguous array: k.mass and k.radii may not be one")
        data = _data(context, builder, signature.args[0], array, _DOUBLE)
        found = ir.Constant(_floats.vector, ir.Undefined)
        for i, number in enumerate(_names(context, builder, signature.args[1], names, first)):
            entry = builder.load(builder.gep(data, [number]))
            found = builder.insert_element(found, entry, ir.Constant(_WHOLE, i))
        return found

    return _floats(table, names, types.int64), codegen


@intrinsic
def to_floats(typing_context: Any, value: Any) -> Any:
    """Return ticks or whole numbers as doubles, rounded to nearest."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.sitofp(arguments[0], _floats.vector)

    return _floats(value), codegen


@intrinsic
def floor(typing_context: Any, value: Any) -> Any:
    """Return doubles, each smaller than 2^63 in size, rounded down."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        vector = _floats.vector
        kind = ir.FunctionType(vector, [vector])
        function = cgutils.get_or_insert_function(builder.module, kind, "llvm.floor.v8f64")
        return builder.fptosi(builder.call(function, arguments), _ticks.vector)

    return _ticks(_floats), codegen


@intrinsic
def bits(typing_context: Any, value: Any) -> Any:
    """Return a word with the bit of each lane set in which it is true."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.zext(builder.bitcast(arguments[0], ir.IntType(LANES)), _WORD)

    return types.int64(_truths), codegen


@intrinsic
def some(typing_context: Any, value: Any) -> Any:
    """Whether it is true in any lane."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        bits = builder.bitcast(arguments[0], ir.IntType(LANES))
        return builder.icmp_unsigned("!=", bits, ir.Constant(ir.IntType(LANES), 0))

    return types.boolean(_truths), codegen
