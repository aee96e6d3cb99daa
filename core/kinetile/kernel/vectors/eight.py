"""Vectors of eight, their operators, and what takes or gives one lane after the other."""

from __future__ import annotations

import math
import operator
from fractions import Fraction
from typing import Any, TypeAlias, cast

import numpy as np

from kinetile.kernel.compiled import INTERPRETED

__all__ = [
    "LANES",
    "Floats",
    "Ticks",
    "Truths",
    "Wholes",
    "append",
    "choose",
    "lane",
    "lowest_bit",
    "numbers",
    "product_error",
    "root",
    "spread",
    "spread_whole",
    "turned",
]

LANES = 8
SPLIT = 2.0**27 + 1.0
TINY, HUGE = 2.0**-960, 2.0**990

Floats: TypeAlias = Any
Wholes: TypeAlias = Any
Ticks: TypeAlias = Any
Truths: TypeAlias = Any

if INTERPRETED:

    def spread(value: float) -> Floats:
        """Return eight times the same number."""
        return np.full(LANES, value)

    def spread_whole(value: int) -> Wholes:
        """Return eight times the same whole number."""
        return np.full(LANES, value, dtype=np.int32)

    def numbers(table: Any, first: int, end: int, filler: int) -> Wholes:
        """Return ``table[first:first + 8]``, with ``filler`` in place of what lies at ``end`` or beyond."""
        found = spread_whole(filler)
        found[: max(end - first, 0)] = table[first : min(first + LANES, end)]
        return found

    def root(value: Floats) -> Floats:
        """Return the square roots, correctly rounded; of a negative number, not a number."""
        with np.errstate(invalid="ignore"):
            return np.sqrt(value)

    def choose(where: Truths, yes: Any, no: Any) -> Any:
        """Return ``yes`` in the lanes where it is true, else ``no``."""
        return np.where(where, yes, no)

    def lane(value: Any, which: int) -> Any:
        """Return one of the eight."""
        return value[which]

    def turned(value: Any, by: int) -> Any:
        """Return the lanes turned round: lane i is what was lane i xor ``by`` (1, 2 or 4)."""
        return value[np.arange(LANES) ^ by]

    def append(source: Any, first: int, target: Any, end: int) -> int:
        """Copy eight numbers, ``source[first:first + 8]``, to ``target[end:end + 8]``; return the last.

        Both are arrays of int32. One load and one store; so seven numbers may be copied, and how many count.
        """
        target[end : end + LANES] = source[first : first + LANES]
        return int(source[first + LANES - 1])

    def product_error(a: float, b: float, product: float) -> float:
        """Return a * b - product exactly, for the rounded product (Dekker 1971); by rationals, and rounded as
        a fused multiply-add does it, where a part of a product would be subnormal or infinite."""
        if not (TINY < abs(product) < HUGE and abs(a) < HUGE and abs(b) < HUGE) and math.isfinite(product):
            return float(Fraction(float(a)) * Fraction(float(b)) - Fraction(float(product)))
        t = SPLIT * a
        a_high = t - (t - a)
        a_low = a - a_high
        t = SPLIT * b
        b_high = t - (t - b)
        b_low = b - b_high
        return ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low

    def lowest_bit(word: int) -> int:
        """Return the place of the lowest bit that is set in a word of 64; the word is not zero."""
        word = int(word)
        return (word & -word).bit_length() - 1

else:
    from llvmlite import ir
    from numba import types
    from numba.core import cgutils as _cgutils
    from numba.extending import intrinsic, models, overload, register_model

    cgutils = cast(Any, _cgutils)

    _INLINED: Any = {"forceinline": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    _DOUBLE, _WHOLE, _BIT, _WORD = ir.DoubleType(), ir.IntType(32), ir.IntType(1), ir.IntType(64)

    class _Eight(types.Type):
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
    def numbers(typing_context: Any, table: Any, first: Any, end: Any, filler: Any) -> Any:
        """Return ``table[first:first + 8]``, with ``filler`` in place of what lies at ``end`` or beyond.

        Eight places of the table are read: it has to be that much longer than ``end``.
        """

        def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            array, first, end, filler = arguments
            at = builder.gep(_data(context, builder, signature.args[0], array, _WHOLE), [first])
            left, filler = builder.sub(end, first), builder.trunc(filler, _WHOLE)
            found = ir.Constant(_wholes.vector, ir.Undefined)
            for i in range(LANES):  # one by one: see above
                place = ir.Constant(_WHOLE, i)
                number = builder.load_atomic(builder.gep(at, [ir.Constant(_WORD, i)]), "unordered", 4)
                counts = builder.icmp_signed("<", ir.Constant(_WORD, i), left)
                found = builder.insert_element(found, builder.select(counts, number, filler), place)
            return found

        return _wholes(table, types.int64, types.int64, types.int64), codegen

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
