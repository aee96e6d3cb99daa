"""Views: the tables in a loop, two numbers for each array, and as NumPy's arrays for checked hooks.

To Numba an array is seven numbers, two of them for counting references. Each call of a hook passes all of
them on, and each pass of an array that has an owner is counted atomically, which is most of the cost of a
small function. And an index below 0 counts from the end: a comparison and a choice at each of some two
hundred places of a loop. So in a loop an array of the tables is a view: its address and its length, with an
index that is never negative. This saves instructions, and a quarter of the time to compile a loop.

Numba would read the tables, a named tuple of some thirty arrays, for 6 us at each call from Python, and pass
all of their numbers on at each call of a hook. So a composed function takes an address (``composer.Packed``)
of a row of words for each array. ``disowned`` copies the rows to memory that no store to a table can change:
there the optimiser holds them in registers. Hooks take the address of that copy, which saves an eighth of the
time to compile a loop.

Authors may use NumPy indexing and slicing, so ``composer`` passes the same tables as NumPy's arrays
(``wrapping``) to every hook that is not marked ``unchecked``. A body's number that such a hook returns is an
index of the loop: ``kernel.loop.checked`` compares it first.
"""

import hashlib
import operator
from functools import cache
from itertools import accumulate
from typing import Any, cast

from kinetile.kernel.compiled import plain
from kinetile.kernel.compiled.backend import (
    Array,
    AttributeTemplate,
    NativeValue,
    Type,
    arrayobj,
    both,
    cgutils,
    infer_getattr,
    intrinsic,
    ir,
    lower_builtin,
    lower_getattr_generic,
    models,
    numba,
    register_model,
    types,
    unbox,
)


class _View(Array):
    """The type of a view of an array of one dimension without gaps; ``of`` is NumPy's type of it."""

    def __init__(self, of: Any) -> None:
        self.of = of
        cast(Any, super()).__init__(
            of.dtype, 1, "C", readonly=not of.mutable, name=f"view({of.name})", aligned=of.aligned
        )

    @property
    def key(self) -> Any:
        return "view", self.of.key

    @property
    def iterator_type(self) -> Any:
        return self.of.iterator_type

    def copy(self, *given: Any, **fields: Any) -> Any:
        return self.of.copy(*given, **fields)


@register_model(_View)
class ViewModel(models.StructModel):
    """The address of the elements, and their number."""

    def __init__(self, manager: Any, kind: Any) -> None:
        members = [("data", types.CPointer(kind.dtype)), ("count", types.intp)]
        cast(Any, super()).__init__(manager, kind, members)


def _place(context: Any, builder: Any, view: Any, kind: Any, index: Any) -> Any:
    found = context.cast(builder, index, kind, types.intp)
    return builder.gep(builder.extract_value(view, 0), [found], inbounds=True)


def _read(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    kind, index = signature.args
    place = _place(context, builder, arguments[0], index, arguments[1])
    return arrayobj.load_item(context, builder, kind.of, place)


def _write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    kind, index, given = signature.args
    place = _place(context, builder, arguments[0], index, arguments[1])
    value = context.cast(builder, arguments[2], given, kind.dtype)
    arrayobj.store_item(context, builder, kind.of, value, place)


def _count(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return builder.extract_value(arguments[0], 1)


def _whole(context: Any, builder: Any, kind: Any, view: Any) -> Any:
    """Returns NumPy's array of a view, without an owner."""
    made = context.make_array(kind.of)(context, builder)
    size = context.get_constant(types.intp, arrayobj.get_itemsize(context, kind.of))
    arrayobj.populate_array(
        made,
        data=builder.extract_value(view, 0),
        shape=[builder.extract_value(view, 1)],
        strides=[size],
        itemsize=size,
        meminfo=None,
    )
    return made._getvalue()


def _as_numpy(implementation: Any) -> Any:
    """Returns the implementation by NumPy's array, for operations that a view lacks."""

    def lowered(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind, *rest = signature.args
        whole = _whole(context, builder, kind, arguments[0])
        given = signature.return_type(kind.of, *rest)
        return implementation(context, builder, given, (whole, *arguments[1:]))

    return lowered


for _key, _kinds, _lowered in (
    (operator.getitem, (_View, types.Integer), _read),
    (operator.setitem, (_View, types.Integer, types.Any), _write),
    (len, (_View,), _count),
    (operator.getitem, (_View, types.SliceType), _as_numpy(arrayobj.getitem_arraynd_intp)),
    (operator.setitem, (_View, types.SliceType, types.Any), _as_numpy(arrayobj.setitem_array)),
    ("getiter", (_View,), _as_numpy(arrayobj.getiter_array)),
):
    cast(Any, lower_builtin)(_key, *_kinds)(_lowered)


def _with(kind: Any, kinds: list[Any]) -> Any:
    if not len(kind):
        return kind
    named = isinstance(kind, types.BaseNamedTuple)
    return types.BaseTuple.from_types(kinds, kind.instance_class if named else None)


def _viewed(kind: Any) -> Any:
    simple = type(kind) is types.Array and kind.ndim == 1 and kind.layout == "C"
    return _View(kind) if simple else kind


class _Packed(Type):
    """The type of tables by the address of their rows (``packed``); ``of`` is the type of the named tuple."""

    def __init__(self, of: Any) -> None:
        self.of = of
        made_from = f"{of.instance_class.__module__} {of.name}"
        digest = hashlib.sha256(made_from.encode()).hexdigest()[:16]
        cast(Any, super()).__init__(f"tables({of.instance_class.__name__} {digest})")


@register_model(_Packed)
class _PackedModel(models.PrimitiveModel):
    """An address."""

    def __init__(self, manager: Any, kind: Any) -> None:
        words = [ir.IntType(8).as_pointer(), *[ir.IntType(64)] * 2]
        row = [word for each in kind.of for word in words[:1] + words[1:] * each.ndim]
        cast(Any, super()).__init__(manager, kind, ir.LiteralStructType(row).as_pointer())


def _address(kind: Any, given: Any, c: Any) -> Any:
    address = c.pyapi.long_as_voidptr(given)
    return NativeValue(c.builder.bitcast(address, c.context.get_value_type(kind)))


unbox(_Packed)(_address)


@cache
def _members(kind: Any) -> list[tuple[Any, int]]:
    """Returns the type of each array in the loop, and the place of its row of words."""
    lengths = [1 + 2 * each.ndim for each in kind.of]
    return list(zip(map(_viewed, kind.of), accumulate(lengths, initial=0), strict=False))


@infer_getattr
class _PackedAttributes(AttributeTemplate):
    """The arrays, by their names."""

    key = _Packed

    def generic_resolve(self, kind: Any, name: str) -> Any:  # type: ignore[override]
        fields = kind.of.fields
        return _members(kind)[fields.index(name)][0] if name in fields else None


def _word(builder: Any, address: Any, at: int) -> Any:
    return builder.gep(address, [ir.IntType(32)(0), ir.IntType(32)(at)], inbounds=True)


def _member(context: Any, builder: Any, kind: Any, address: Any, name: str) -> Any:
    view, first = _members(kind)[kind.of.fields.index(name)]
    made = context.make_helper(builder, view)
    words = [builder.load(_word(builder, address, first + i)) for i in range(1 + 2 * view.ndim)]
    data = builder.bitcast(words[0], made.data.type)
    if isinstance(view, _View):
        made.data, made.count = data, words[1]
    else:
        size = context.get_constant(types.intp, arrayobj.get_itemsize(context, view))
        lengths, steps = words[1 : 1 + view.ndim], words[1 + view.ndim :]
        arrayobj.populate_array(made, data, lengths, steps, size, meminfo=None)
    return made._getvalue()


lower_getattr_generic(_Packed)(_member)


def _copied(context: Any, builder: Any, kind: Any, address: Any) -> Any:
    """Returns the address of the function's own copy of the rows of words. The optimiser holds these in
    registers; it must assume that stores to tables change the other rows."""
    own = cgutils.alloca_once(builder, context.get_value_type(kind).pointee)
    for at in range(len(own.type.pointee.elements)):
        builder.store(builder.load(_word(builder, address, at)), _word(builder, own, at))
    return own


def packed_kind(tables: Any) -> Any:
    """Returns the type of packed tables like these."""
    return _Packed(numba.typeof(tables))


def _numpy_kind(kind: Any) -> Any:
    if isinstance(kind, _Packed):
        return kind.of
    if isinstance(kind, types.BaseTuple):
        return _with(kind, [_numpy_kind(each) for each in kind])
    return kind.of if isinstance(kind, _View) else kind


def _wrapped(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """Returns a value with all views in it as NumPy's arrays. One that has an owner gets one more reference:
    the caller drops this reference, and would otherwise drop one of the owner's."""
    if isinstance(kind, _View):
        return _whole(context, builder, kind, value)
    if isinstance(kind, _Packed):
        arrays = [_member(context, builder, kind, value, name) for name in kind.of.fields]
        views = _with(kind.of, [view for view, _ in _members(kind)])
        return _wrapped(context, builder, views, context.make_tuple(builder, views, arrays))
    if not isinstance(kind, types.BaseTuple):
        context.nrt.incref(builder, kind, value)
        return value
    parts = [
        _wrapped(context, builder, each, builder.extract_value(value, at)) for at, each in enumerate(kind)
    ]
    return context.make_tuple(builder, _numpy_kind(kind), parts)


@both(plain.disowned)
@intrinsic
def disowned(typing_context: Any, tables: Any) -> Any:
    """Returns tables that the optimiser holds in registers. The caller keeps their owners alive."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _copied(context, builder, tables, arguments[0])

    return tables(tables), code


@both(plain.pointer)
@intrinsic
def pointer(typing_context: Any, numbers: Any) -> Any:
    """Returns the address of an array, or of a view, for functions marked ``apart``."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        if isinstance(numbers, _View):
            return builder.extract_value(arguments[0], 0)
        return context.make_array(numbers)(context, builder, value=arguments[0]).data

    return types.CPointer(numbers.dtype)(numbers), code


@both(plain.zeros)
@intrinsic
def zeros(typing_context: Any, count: Any) -> Any:
    """Returns an array of ``count`` 64-bit integers, a constant, all zero: on the caller's stack, and gone
    with it. For an array from NumPy Numba compiles five functions."""
    if not isinstance(count, types.IntegerLiteral):
        return None
    kind, length = types.Array(types.int64, 1, "C"), ir.IntType(64)(count.literal_value)

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        made, size = context.make_array(kind)(context, builder), ir.IntType(64)(8)
        data = cgutils.alloca_once(builder, made.data.type.pointee, length)
        cgutils.memset(builder, data, builder.mul(length, size), 0)
        arrayobj.populate_array(made, data, [length], [size], size, None)
        return made._getvalue()

    return kind(count), code


@both(plain.numbers_from)
@intrinsic
def numbers_from(typing_context: Any, tables: Any, first: Any) -> Any:
    """Returns the tables with ``numbers`` from an index on. The hook that calls this does not return them:
    their rows are its own."""
    view, row = _members(tables)[tables.of.fields.index("numbers")]

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        own, start = _copied(context, builder, tables, arguments[0]), arguments[1]
        data, count = _word(builder, own, row), _word(builder, own, row + 1)
        size = context.get_constant(types.intp, arrayobj.get_itemsize(context, view))
        builder.store(builder.gep(builder.load(data), [builder.mul(start, size)]), data)
        builder.store(builder.sub(builder.load(count), start), count)
        return own

    return tables(tables, types.intp), code


@both(plain.with_shadows)
@intrinsic
def with_shadows(typing_context: Any, tables: Any) -> Any:
    """Returns the tables for a broad phase (``SEEN``). The hook that calls this does not return them: their
    rows are its own."""
    fields, rows = tables.of.fields, dict(zip(tables.of.fields, _members(tables), strict=True))
    kinds = [tables.of[fields.index(plain.SEEN.get(name, name))] for name in fields]

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        own = _copied(context, builder, tables, arguments[0])
        for name, other in plain.SEEN.items():
            for at in range(3):
                word = builder.load(_word(builder, arguments[0], rows[other][1] + at))
                builder.store(word, _word(builder, own, rows[name][1] + at))
        return own

    return _Packed(_with(tables.of, kinds))(tables), code


@both(plain.wrapping)
@intrinsic
def wrapping(typing_context: Any, given: Any) -> Any:
    """Returns its argument with NumPy's arrays in place of the views in it."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _wrapped(context, builder, given, arguments[0])

    return _numpy_kind(given)(given), code
