"""Indices: arrays whose index is never negative, for the kernel's own hooks, and NumPy's for those of others.

To NumPy, and so to Numba, an index below 0 counts from the end: a comparison and a choice at each of some
two hundred places of a loop. No hook of kinetile's own counts from the end, so within the loop its arrays
have a type of which no index is wrapped (``plain``). Authors of other hooks may count on it, so theirs get
the same arrays under NumPy's type (``wrapping``). Both are a matter of types alone, and cost no instruction.

What other hooks return is an index of the loop: ``kernel.loop.foreign`` checks it first.
"""

from __future__ import annotations

from typing import Any, TypeVar, cast

from kinetile.kernel.compiled.hooks import INTERPRETED

T = TypeVar("T")


if INTERPRETED:

    def plain(tables: T) -> T:
        """Return ``tables`` as they are: an index of NumPy's is checked in any case."""
        return tables

    def wrapping(given: T) -> T:
        """Return what is given as it is."""
        return given

else:
    import operator

    from llvmlite import ir
    from numba.core import types as _types
    from numba.extending import intrinsic, lower_builtin, models, register_model
    from numba.np import arrayobj as _arrayobj

    types, arrayobj = cast(Any, _types), cast(Any, _arrayobj)

    class _Plain(_types.Array):
        """The type of an array of one dimension, as one ``of`` NumPy's, whose index is not wrapped."""

        def __init__(self, of: Any) -> None:
            self.of = of
            cast(Any, super()).__init__(
                of.dtype, 1, of.layout, readonly=not of.mutable, name=f"plain({of.name})", aligned=of.aligned
            )

        @property
        def key(self) -> Any:
            """What tells this type from others."""
            return "plain", self.of.key

        def copy(self, *given: Any, **fields: Any) -> Any:
            """Return a type made from this one: NumPy's."""
            return self.of.copy(*given, **fields)

    @register_model(_Plain)
    class _PlainModel(models.ArrayModel):
        """Held as any array."""

    def _index(context: Any, builder: Any, kind: Any, value: Any) -> tuple[Any, Any]:
        """Return an index as a word, and its type: one without a sign is not wrapped. A constant is left to
        NumPy's way, which costs nothing then."""
        found = context.cast(builder, value, kind, types.intp)
        return found, types.intp if isinstance(found, ir.Constant) else types.uintp

    def _read(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, kind = signature.args
        index, kind = _index(context, builder, kind, arguments[1])
        unwrapped = signature.return_type(array, kind)
        return arrayobj.getitem_arraynd_intp(context, builder, unwrapped, (arguments[0], index))

    def _write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, kind, value = signature.args
        index, kind = _index(context, builder, kind, arguments[1])
        unwrapped = signature.return_type(array, kind, value)
        return arrayobj.setitem_array(context, builder, unwrapped, (arguments[0], index, arguments[2]))

    cast(Any, lower_builtin)(operator.getitem, _Plain, types.Integer)(_read)
    cast(Any, lower_builtin)(operator.setitem, _Plain, types.Integer, types.Any)(_write)

    def _with(kind: Any, kinds: list[Any]) -> Any:
        """Return the type of a tuple with other types in it, which are held as those that are there."""
        if isinstance(kind, types.NamedUniTuple):
            return types.NamedUniTuple(kinds[0], len(kinds), kind.instance_class)
        if isinstance(kind, types.NamedTuple):
            return types.NamedTuple(kinds, kind.instance_class)
        return (
            types.UniTuple(kinds[0], len(kinds)) if isinstance(kind, types.UniTuple) else types.Tuple(kinds)
        )

    def _plain_kind(kind: Any) -> Any:
        return _Plain(kind) if type(kind) is types.Array and kind.ndim == 1 else kind

    def _numpy_kind(kind: Any) -> Any:
        if isinstance(kind, types.BaseTuple) and len(kind):
            return _with(kind, [_numpy_kind(each) for each in kind])
        return kind.of if isinstance(kind, _Plain) else kind

    def _as_given(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return arguments[0]

    @intrinsic
    def plain(typing_context: Any, tables: Any) -> Any:
        """Return a named tuple of arrays that are ``disowned``, with a type whose index is never negative for
        those of one dimension."""
        return _with(tables, [_plain_kind(kind) for kind in tables])(tables), _as_given

    @intrinsic
    def wrapping(typing_context: Any, given: Any) -> Any:
        """Return what is given, with the arrays in it, which are ``disowned``, under NumPy's types."""
        return _numpy_kind(given)(given), _as_given
