"""Views: the tables as a loop sees them, two numbers for each array, and as NumPy's for checked hooks.

To Numba an array is seven numbers, of which two are for counting references. Each call of a hook hands on all
of them, for each array of the tables, and each pass of an array that has an owner is counted atomically,
which is most of the cost of a small function. And an index below 0 counts from the end: a comparison and a
choice at each of some two hundred places of a loop. So at the loop's entry (``disowned``) an array becomes a
view of its own type: where it begins and how many elements it has. Its index is never negative. That saves
instructions, and a quarter of the time to compile a loop.

An author may count on NumPy's way, and slice and search as he likes, so ``composer`` hands the same tables as
NumPy's arrays (``wrapping``) to every hook that is not marked ``unchecked``. A number of a body that such a
hook returns is an index of the loop: ``kernel.loop.checked`` compares it first.
"""

from __future__ import annotations

from typing import Any, TypeVar, cast

from kinetile.kernel.compiled.hooks import INTERPRETED

T = TypeVar("T")


if INTERPRETED:

    def disowned(tables: T) -> T:
        """Return ``tables`` as they are: interpreted code counts no references worth saving."""
        return tables

    def wrapping(given: T) -> T:
        """Return what is given as it is."""
        return given

    def pointer(numbers: Any) -> Any:
        """Return an array as it is."""
        return numbers

    def numbers_from(tables: Any, first: int) -> Any:
        """Return the tables with numbers that begin at one of them."""
        return tables._replace(numbers=tables.numbers[first:])

else:
    import operator

    from kinetile.kernel.compiled.backend import (
        Array,
        arrayobj,
        cgutils,
        intrinsic,
        lower_builtin,
        models,
        register_model,
        types,
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
            """What tells this type from others."""
            return "view", self.of.key

        @property
        def iterator_type(self) -> Any:
            """The type of what goes through the elements: NumPy's."""
            return self.of.iterator_type

        def copy(self, *given: Any, **fields: Any) -> Any:
            """Return a type made from this one, of a slice say: NumPy's."""
            return self.of.copy(*given, **fields)

    @register_model(_View)
    class ViewModel(models.StructModel):
        """Where the elements begin, and how many there are."""

        def __init__(self, manager: Any, kind: Any) -> None:
            members = [("data", types.CPointer(kind.dtype)), ("count", types.intp)]
            cast(Any, super()).__init__(manager, kind, members)

    def _place(context: Any, builder: Any, view: Any, kind: Any, index: Any) -> Any:
        """Return the address of an element."""
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
        """Return NumPy's array of a view, without an owner."""
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
        """Return how NumPy's array does what a view does not do by itself."""

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
        """Return the type of a tuple with other types in it."""
        if not len(kind):
            return kind
        named = isinstance(kind, types.BaseNamedTuple)
        return types.BaseTuple.from_types(kinds, kind.instance_class if named else None)

    def _viewed(kind: Any) -> Any:
        simple = type(kind) is types.Array and kind.ndim == 1 and kind.layout == "C"
        return _View(kind) if simple else kind

    def _numpy_kind(kind: Any) -> Any:
        if isinstance(kind, types.BaseTuple):
            return _with(kind, [_numpy_kind(each) for each in kind])
        return kind.of if isinstance(kind, _View) else kind

    def _wrapped(context: Any, builder: Any, kind: Any, value: Any) -> Any:
        """Return a value with all views in it as NumPy's arrays. One that has an owner is referred to once
        more: the caller drops this reference, and without it one of the owner's."""
        if isinstance(kind, _View):
            return _whole(context, builder, kind, value)
        if not isinstance(kind, types.BaseTuple):
            context.nrt.incref(builder, kind, value)
            return value
        parts = [
            _wrapped(context, builder, each, builder.extract_value(value, at)) for at, each in enumerate(kind)
        ]
        return context.make_tuple(builder, _numpy_kind(kind), parts)

    @intrinsic
    def disowned(typing_context: Any, tables: Any) -> Any:
        """Return a named tuple of arrays, each viewing the same memory without a reference to its owner.

        Those of one dimension become views, others stay NumPy's arrays.

        The caller keeps the owners alive for as long as the views are in use.
        """
        kinds = [_viewed(kind) for kind in tables]

        def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            parts = []
            for at, (kind, view) in enumerate(zip(tables, kinds, strict=True)):
                value = builder.extract_value(arguments[0], at)
                if isinstance(kind, types.Array):
                    array = context.make_array(kind)(context, builder, value=value)
                    if isinstance(view, _View):
                        made = cgutils.create_struct_proxy(view)(context, builder)
                        made.data, made.count = array.data, array.nitems
                        value = made._getvalue()
                    else:
                        array.meminfo = cgutils.get_null_value(array.meminfo.type)
                        array.parent = cgutils.get_null_value(array.parent.type)
                        value = array._getvalue()
                parts.append(value)
            return context.make_tuple(builder, signature.return_type, parts)

        return _with(tables, kinds)(tables), code

    @intrinsic
    def pointer(typing_context: Any, numbers: Any) -> Any:
        """Return where an array, or a view of one, begins: as functions marked ``apart`` take it."""

        def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            if isinstance(numbers, _View):
                return builder.extract_value(arguments[0], 0)
            return context.make_array(numbers)(context, builder, value=arguments[0]).data

        return types.CPointer(numbers.dtype)(numbers), code

    @intrinsic
    def numbers_from(typing_context: Any, tables: Any, first: Any) -> Any:
        """Return the tables with numbers, a view, that begin at one of them."""
        at = tables.instance_class._fields.index("numbers")
        kind = tables[at]

        def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            whole, start = arguments
            old = builder.extract_value(whole, at)
            given = cgutils.create_struct_proxy(kind)(context, builder, value=old)
            given.data = builder.gep(given.data, [start])
            given.count = builder.sub(given.count, start)
            made = builder.insert_value(whole, given._getvalue(), at)
            context.nrt.incref(builder, tables, made)
            return made

        return tables(tables, types.intp), code

    @intrinsic
    def wrapping(typing_context: Any, given: Any) -> Any:
        """Return what is given with NumPy's arrays in place of the views in it."""

        def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return _wrapped(context, builder, given, arguments[0])

        return _numpy_kind(given)(given), code
