"""Flight plans of eight bodies, and ticks."""

from __future__ import annotations

from typing import Any

import numpy as np

from kinetile.kernel.compiled import INTERPRETED
from kinetile.kernel.vectors.eight import LANES, Floats, Ticks, Truths, Wholes

__all__ = ["eight", "flights", "floor", "some", "spread_ticks", "to_floats"]

COLUMNS = ("x", "y", "vx", "vy", "anchor", "reach")

if INTERPRETED:

    def eight(a: int, b: int, c: int, d: int, e: int, f: int, g: int, h: int) -> Wholes:
        """Return eight whole numbers as a vector."""
        return np.array([a, b, c, d, e, f, g, h], dtype=np.int32)

    def spread_ticks(value: int) -> Ticks:
        """Return eight times the same tick."""
        return np.full(LANES, value, dtype=np.int64)

    def flights(
        table: Any, a: int, b: int, c: int, d: int, e: int, f: int, g: int, h: int
    ) -> tuple[Floats, Floats, Floats, Floats, Ticks, Floats]:
        """Return x, y, vx, vy, anchor and reach of eight bodies."""
        rows = table[[a, b, c, d, e, f, g, h]]
        return tuple(np.array(rows[name]) for name in COLUMNS)  # type: ignore[return-value]

    def to_floats(value: Ticks) -> Floats:
        """Return ticks as doubles, rounded to nearest."""
        return value.astype(np.float64)

    def floor(value: Floats) -> Ticks:
        """Return doubles, each smaller than 2^63 in size, rounded down."""
        return np.floor(value).astype(np.int64)

    def some(value: Truths) -> bool:
        """Whether it is true in any lane."""
        return bool(value.any())

else:
    from llvmlite import ir
    from numba import types
    from numba.extending import intrinsic

    from kinetile.kernel.vectors.eight import (
        _DOUBLE,
        _WHOLE,
        _WORD,
        _data,
        _floats,
        _load,
        _shuffle,
        _splat,
        _ticks,
        _truths,
        _wholes,
        cgutils,
    )

    @intrinsic
    def eight(
        typing_context: Any, a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, g: Any, h: Any
    ) -> Any:
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

        A body's record is a row of eight times eight bytes; the rows are loaded whole and turned into columns.
        """
        kinds = [_ticks if name == "anchor" else _floats for name in COLUMNS]
        result = types.Tuple(kinds)

        def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            array, *which = arguments
            record = signature.args[0].dtype
            assert record.size == 8 * LANES
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
                return _shuffle(builder, *halves, [begin + i for i in (0, 1, 2, 3, 8, 9, 10, 11)])

            columns = [column(record.offset(name) // 8) for name in COLUMNS]
            columns = [builder.bitcast(values, kind.vector) for values, kind in zip(columns, kinds, strict=True)]
            return context.make_tuple(builder, result, columns)

        return result(table, *[types.int64] * LANES), codegen

    @intrinsic
    def to_floats(typing_context: Any, value: Any) -> Any:
        """Return ticks as doubles, rounded to nearest."""

        def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.sitofp(arguments[0], _floats.vector)

        return _floats(_ticks), codegen

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
    def some(typing_context: Any, value: Any) -> Any:
        """Whether it is true in any lane."""

        def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            bits = builder.bitcast(arguments[0], ir.IntType(LANES))
            return builder.icmp_unsigned("!=", bits, ir.Constant(ir.IntType(LANES), 0))

        return types.boolean(_truths), codegen
