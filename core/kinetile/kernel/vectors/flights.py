"""Rows and columns: the plans and places of eight bodies; and ticks."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from kinetile.kernel.compiled import INTERPRETED
from kinetile.kernel.vectors.eight import LANES, Floats, Ticks, Truths, Wholes

__all__ = [
    "eight",
    "flights",
    "floor",
    "pick",
    "places",
    "put_place",
    "some",
    "spread_ticks",
    "to_floats",
]

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
        x, y, vx, vy, anchor, reach = (np.array(rows[name]) for name in COLUMNS)
        return x, y, vx, vy, anchor, reach

    def places(table: Any, which: Wholes) -> tuple[Floats, Floats, Floats, Floats]:
        """Return x, y, vx, vy of eight rows of a table of places."""
        rows = table[which]
        x, y, vx, vy = (np.array(rows[name]) for name in ("x", "y", "vx", "vy"))
        return x, y, vx, vy

    def put_place(table: Any, number: int, x: float, y: float, vx: float, vy: float) -> None:
        """Write a row of a table of places in one piece: who reads it so need not wait for the parts."""
        table[number] = (x, y, vx, vy)

    def pick(table: Any, which: Wholes) -> Floats:
        """Return eight entries of an array of doubles."""
        return np.array(table[which])

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
    from numba import types as _types
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

    types = cast(Any, _types)

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
                return _shuffle(
                    builder, halves[0], halves[1], [begin + i for i in (0, 1, 2, 3, 8, 9, 10, 11)]
                )

            columns = [
                builder.bitcast(column(record.offset(name) // 8), kind.vector)
                for name, kind in zip(COLUMNS, kinds, strict=True)
            ]
            return context.make_tuple(builder, result, columns)

        return result(table, *[types.int64] * LANES), codegen

    @intrinsic
    def places(typing_context: Any, table: Any, which: Any) -> Any:
        """Return x, y, vx, vy of eight rows of a table of places."""
        result = types.UniTuple(_floats, 4)

        def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            array, which = arguments
            data = _data(context, builder, signature.args[0], array, _DOUBLE)
            row = ir.VectorType(_DOUBLE, 4)
            rows = []
            for i in range(LANES):
                number = builder.sext(builder.extract_element(which, ir.Constant(_WHOLE, i)), _WORD)
                at = builder.gep(data, [builder.shl(number, ir.Constant(_WORD, 2))])
                rows.append(_load(builder, at, row, 8))
            pairs = [_shuffle(builder, rows[2 * i], rows[2 * i + 1], list(range(8))) for i in range(4)]

            def columns(c: int) -> list[Any]:  # two columns of four rows each, then of all eight
                lanes = [c, c + 4, c + 8, c + 12, c + 1, c + 5, c + 9, c + 13]
                upper = _shuffle(builder, pairs[0], pairs[1], lanes)
                lower = _shuffle(builder, pairs[2], pairs[3], lanes)
                return [
                    _shuffle(builder, upper, lower, [0, 1, 2, 3, 8, 9, 10, 11]),
                    _shuffle(builder, upper, lower, [4, 5, 6, 7, 12, 13, 14, 15]),
                ]

            return context.make_tuple(builder, result, columns(0) + columns(2))

        return result(table, _wholes), codegen

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
    def pick(typing_context: Any, table: Any, which: Any) -> Any:
        """Return eight entries of an array of doubles."""

        def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            array, which = arguments
            data = _data(context, builder, signature.args[0], array, _DOUBLE)
            found = ir.Constant(_floats.vector, ir.Undefined)
            for i in range(LANES):
                place = ir.Constant(_WHOLE, i)
                number = builder.sext(builder.extract_element(which, place), _WORD)
                found = builder.insert_element(found, builder.load(builder.gep(data, [number])), place)
            return found

        return _floats(table, _wholes), codegen

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
