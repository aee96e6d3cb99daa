"""The functions of ``vectors`` as Numba intrinsics: portable LLVM vectors of eight, held in registers.

The package documents each function; its code is here, in a table or under its name with an underscore. Rows
of a table are loaded and stored in one piece: a load that covers several smaller stores has to wait until all
of them are done.
"""

import operator
from collections.abc import Callable, Iterator
from inspect import signature
from typing import Any, ClassVar, NamedTuple, cast

from kinetile.kernel.compiled.backend import (
    ConcreteTemplate,
    Type,
    arrayobj,
    cgutils,
    infer_global,
    ir,
    lower_builtin,
    lowered,
    models,
    register_model,
    types,
)
from kinetile.kernel.vectors import COLUMNS, LANES

_DOUBLE, _WHOLE, _BIT, _WORD, _BYTE = ir.DoubleType(), *(ir.IntType(size) for size in (32, 1, 64, 8))


class _Eight(Type):
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
    one = builder.insert_element(ir.Constant(vector, ir.Undefined), value, ir.Constant(_WHOLE, 0))
    zeros = ir.Constant(ir.VectorType(_WHOLE, LANES), [ir.Constant(_WHOLE, 0)] * LANES)
    return builder.shuffle_vector(one, one, zeros)


def _shuffle(builder: Any, one: Any, two: Any, lanes: list[int]) -> Any:
    mask = ir.Constant(ir.VectorType(_WHOLE, len(lanes)), [ir.Constant(_WHOLE, i) for i in lanes])
    return builder.shuffle_vector(one, two, mask)


def _load(builder: Any, pointer: Any, vector: Any, align: int) -> Any:
    return builder.load(builder.bitcast(pointer, vector.as_pointer()), align=align)


def _operator(symbol: Any, kind: Any, result: Any, build: Any) -> None:
    """Gives two vectors of a kind an operator."""

    @cast(Any, infer_global)(symbol)
    class _Operator(ConcreteTemplate):
        key = symbol
        cases: ClassVar[list[Any]] = [result(kind, kind)]

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return build(builder, *arguments)

    cast(Any, lower_builtin)(symbol, kind, kind)(code)


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


class _Call(NamedTuple):
    """Where a call is compiled: Numba's context and builder, the signature."""

    context: Any
    builder: Any
    signature: Any

    def data(self, which: int, array: Any, element: Any) -> Any:
        """Returns a pointer to the elements of an array, the argument of this number."""
        made = self.context.make_array(self.signature.args[which])
        data = made(self.context, self.builder, value=array).data
        return self.builder.bitcast(data, element.as_pointer())

    def named(self, which: int, array: Any, first: Any) -> Iterator[Any]:
        """Yields eight numbers of an array, as words: read one by one, as they may have been stored, so that
        no load has to wait for several stores; and each at its use, because registers are few."""
        builder = self.builder
        at = builder.gep(self.data(which, array, _WHOLE), [first])
        for i in range(LANES):
            here = builder.gep(at, [ir.Constant(_WORD, i)])
            yield builder.sext(builder.load_atomic(here, "unordered", 4), _WORD)

    def nothing(self) -> Any:
        return self.context.get_dummy_value()


COMPILED: dict[str, Any] = {}
"""The intrinsics, by name."""


def _compiled(typed: Any, name: str = "") -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Marks the code of a function; ``typed`` is its signature, or returns it for types of arguments. Code
    with a ``name`` gets the builder alone."""

    def decorated(code: Callable[..., Any]) -> Callable[..., Any]:
        def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return code(builder if name else _Call(context, builder, signature), *arguments)

        def of(*given: Any) -> Any:
            return typed(*given) if callable(typed) else typed

        names, called = [*signature(code).parameters][1:], name or code.__name__[1:]
        COMPILED[called] = lowered(called, names, of, build)
        return code

    return decorated


def _eights(builder: Any, name: str, value: Any) -> Any:
    """Returns the result of an LLVM function for eight doubles."""
    kind = ir.FunctionType(_floats.vector, [_floats.vector])
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v8f64"), [value])


_SHORT: dict[str, tuple[Any, Callable[..., Any]]] = {
    "spread": (_floats(types.float64), lambda b, value: _splat(b, value, _floats.vector)),
    "spread_whole": (
        _wholes(types.int64),
        lambda b, value: _splat(b, b.trunc(value, _WHOLE), _wholes.vector),
    ),
    "spread_ticks": (_ticks(types.int64), lambda b, value: _splat(b, value, _ticks.vector)),
    "number_in": (
        types.int64(types.float64),
        lambda b, value: b.and_(b.bitcast(value, _WORD), ir.Constant(_WORD, 63)),
    ),
    "root": (_floats(_floats), lambda b, value: _eights(b, "sqrt", value)),
    "floor": (_ticks(_floats), lambda b, value: b.fptosi(_eights(b, "floor", value), _ticks.vector)),
    "to_floats": (_floats, lambda b, value: b.sitofp(value, _floats.vector)),
    "choose": (
        lambda where, yes, no: yes(_truths, yes, yes),
        lambda b, where, yes, no: b.select(where, yes, no),
    ),
    "followed": (
        lambda value: value(value),
        lambda b, value: _shuffle(b, value, value, [*range(1, LANES), 0]),
    ),
    "lane": (
        lambda value, which: value.one(value, types.int64),
        lambda b, value, which: b.extract_element(value, b.trunc(which, _WHOLE)),
    ),
    "product_error": (  # a fused multiply-add
        types.float64(*[types.float64] * 3),
        lambda b, x, y, product: b.fma(x, y, b.fneg(product)),
    ),
    "lowest_bit": (types.int64(types.int64), lambda b, word: b.cttz(word, ir.Constant(_BIT, 1))),
    "bits": (types.int64(_truths), lambda b, value: b.zext(b.bitcast(value, ir.IntType(LANES)), _WORD)),
}
"""Signature and code, by name, of functions that need the builder alone."""

for _name, (_typed, _code) in _SHORT.items():
    _compiled(_typed, _name)(_code)


@_compiled(lambda table, first: _wholes(table, types.int64))
def _numbers(call: _Call, table: Any, first: Any) -> Any:
    at = call.builder.gep(call.data(0, table, _WHOLE), [first])
    return _load(call.builder, at, _wholes.vector, 4)


@_compiled(lambda table, first, value: types.void(table, types.int64, types.int64))
def _fill(call: _Call, table: Any, first: Any, value: Any) -> Any:
    builder = call.builder
    at = builder.gep(call.data(0, table, _WHOLE), [first])
    whole = _splat(builder, builder.trunc(value, _WHOLE), _wholes.vector)
    builder.store(whole, builder.bitcast(at, _wholes.vector.as_pointer()), align=4)
    return call.nothing()


@_compiled(_floats(_floats, types.int64))
def _numbered(call: _Call, value: Any, first: Any) -> Any:
    builder, vector = call.builder, _ticks.vector
    less = ir.Constant(vector, [ir.Constant(_WORD, i - 64) for i in range(LANES)])
    mask = ir.Constant(vector, [ir.Constant(_WORD, -64)] * LANES)
    bits = builder.and_(builder.bitcast(value, vector), mask)
    bits = builder.add(bits, builder.add(less, _splat(builder, first, vector)))
    return builder.bitcast(bits, _floats.vector)


@_compiled(lambda value, by: value(value, by) if isinstance(by, types.IntegerLiteral) else None)
def _turned(call: _Call, value: Any, by: Any) -> Any:
    distance = call.signature.args[1].literal_value
    return _shuffle(call.builder, value, value, [i ^ distance for i in range(LANES)])


@_compiled(lambda source, first, target, end: types.int64(source, types.int64, target, types.int64))
def _append(call: _Call, source: Any, first: Any, target: Any, end: Any) -> Any:
    builder = call.builder
    here = builder.gep(call.data(0, source, _WHOLE), [first])
    there = builder.gep(call.data(2, target, _WHOLE), [end])
    block = _load(builder, here, _wholes.vector, 4)
    builder.store(block, builder.bitcast(there, _wholes.vector.as_pointer()), align=4)
    return builder.sext(builder.extract_element(block, ir.Constant(_WHOLE, LANES - 1)), _WORD)


@_compiled(lambda table, row: types.void(table, types.int64))
def _prefetch(call: _Call, table: Any, row: Any) -> Any:
    builder = call.builder
    size = call.context.get_constant(types.intp, arrayobj.get_itemsize(call.context, call.signature.args[0]))
    place = builder.gep(call.data(0, table, _BYTE), [builder.mul(row, size)])
    made = ir.FunctionType(ir.VoidType(), [_BYTE.as_pointer(), _WHOLE, _WHOLE, _WHOLE])
    function = cgutils.get_or_insert_function(builder.module, made, "llvm.prefetch.p0")
    how = [ir.Constant(_WHOLE, number) for number in (0, 3, 1)]  # to read, into all caches, data
    builder.call(function, [place, *how])
    return call.nothing()


@_compiled(_wholes(*[types.int64] * LANES))
def _eight(call: _Call, a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, g: Any, h: Any) -> Any:
    builder = call.builder
    found = ir.Constant(_wholes.vector, ir.Undefined)
    for i, value in enumerate((a, b, c, d, e, f, g, h)):
        found = builder.insert_element(found, builder.trunc(value, _WHOLE), ir.Constant(_WHOLE, i))
    return found


_FLIGHT = [_ticks if name == "anchor" else _floats for name in COLUMNS]


@_compiled(lambda table, *which: types.Tuple(_FLIGHT)(table, *[types.int64] * LANES))
def _flights(call: _Call, table: Any, a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, g: Any, h: Any) -> Any:
    # A record begins with a row of eight times eight bytes; these are loaded whole and turned into columns.
    builder, record = call.builder, call.signature.args[0].dtype
    if record.size < 8 * LANES:
        raise TypeError(f"{8 * LANES} bytes of a record are read at once, and this one has {record.size}")
    data = call.data(0, table, _DOUBLE)
    rows = []
    for number in (a, b, c, d, e, f, g, h):
        at = builder.gep(data, [builder.mul(number, ir.Constant(_WORD, record.size // 8))])
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
        for name, kind in zip(COLUMNS, _FLIGHT, strict=True)
    ]
    return call.context.make_tuple(builder, call.signature.return_type, columns)


@_compiled(lambda table, names, first: types.UniTuple(_floats, 4)(table, names, types.int64))
def _places(call: _Call, table: Any, names: Any, first: Any) -> Any:
    builder = call.builder
    data = call.data(0, table, _DOUBLE)
    row = ir.VectorType(_DOUBLE, 4)
    rows = []
    for number in call.named(1, names, first):
        at = builder.gep(data, [builder.shl(number, ir.Constant(_WORD, 2))])
        rows.append(_load(builder, at, row, 8))
    # Rows i and i + 2 side by side; then pairs of columns of rows 0 to 3 and of 4 to 7, lane by lane within
    # quarters of a vector; then whole quarters: all of these are single instructions without a mask.
    pairs = [_shuffle(builder, rows[i], rows[i + 2], list(range(8))) for i in (0, 1, 4, 5)]
    even, odd = [0, 8, 2, 10, 4, 12, 6, 14], [1, 9, 3, 11, 5, 13, 7, 15]
    left, right = [0, 1, 4, 5, 8, 9, 12, 13], [2, 3, 6, 7, 10, 11, 14, 15]
    x_vx, y_vy = ([_shuffle(builder, pairs[i], pairs[i + 1], lanes) for i in (0, 2)] for lanes in (even, odd))
    found = [_shuffle(builder, one, two, lanes) for lanes in (left, right) for one, two in (x_vx, y_vy)]
    return call.context.make_tuple(builder, call.signature.return_type, found)


@_compiled(lambda table, *rest: types.void(table, types.int64, *[types.float64] * 4))
def _put_place(call: _Call, table: Any, number: Any, x: Any, y: Any, vx: Any, vy: Any) -> Any:
    builder, row = call.builder, ir.VectorType(_DOUBLE, 4)
    whole = ir.Constant(row, ir.Undefined)
    for i, value in enumerate((x, y, vx, vy)):
        whole = builder.insert_element(whole, value, ir.Constant(_WHOLE, i))
    at = builder.gep(call.data(0, table, _DOUBLE), [builder.shl(number, ir.Constant(_WORD, 2))])
    builder.store(whole, builder.bitcast(at, row.as_pointer()), align=8)
    return call.nothing()


@_compiled(lambda table, names, first: _floats(table, names, types.int64))
def _pick(call: _Call, table: Any, names: Any, first: Any) -> Any:
    builder = call.builder
    if call.signature.args[0].layout != "C":
        raise TypeError("entries are picked from a contiguous array: k.mass and k.radii may not be one")
    data = call.data(0, table, _DOUBLE)
    found = ir.Constant(_floats.vector, ir.Undefined)
    for i, number in enumerate(call.named(1, names, first)):
        entry = builder.load(builder.gep(data, [number]))
        found = builder.insert_element(found, entry, ir.Constant(_WHOLE, i))
    return found


@_compiled(types.boolean(_truths))
def _some(call: _Call, value: Any) -> Any:
    word = call.builder.bitcast(value, ir.IntType(LANES))
    return call.builder.icmp_unsigned("!=", word, ir.Constant(ir.IntType(LANES), 0))
