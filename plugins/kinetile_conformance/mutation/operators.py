"""Mutation operators: edits of one thing at a time, as the replacement of an exact span of the source.

Each is a mistake that is easily made in a phase. Those of libraries are others: they know no certificate that
is not scheduled, no radius in place of a reach, no x in place of y.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import accumulate, pairwise

OPERATORS = (
    *("comparison", "sign", "truth", "dropped", "radius", "floor"),
    *("index", "extreme", "constant", "condition", "count", "name"),
)

SIGNS: dict[type[ast.AST], tuple[str, str, str]] = {
    ast.Lt: ("comparison", "<", "<="),
    ast.LtE: ("comparison", "<=", "<"),
    ast.Gt: ("comparison", ">", ">="),
    ast.GtE: ("comparison", ">=", ">"),
    ast.Eq: ("comparison", "==", "!="),
    ast.NotEq: ("comparison", "!=", "=="),
    ast.Add: ("sign", "+", "-"),
    ast.Sub: ("sign", "-", "+"),
    ast.And: ("truth", "and", "or"),
    ast.Or: ("truth", "or", "and"),
    ast.BitAnd: ("truth", "&", "|"),
    ast.BitOr: ("truth", "|", "&"),
}
PAIRS = {
    "extreme": (("smaller", "larger"), ("min", "max"), ("minimum", "maximum")),
    "radius": (("reach", "radius"),),
    "name": (("x", "y"), ("vx", "vy"), ("width", "height")),
}
RENAMED = {
    old: (operator, new)
    for operator, pairs in PAIRS.items()
    for pair in pairs
    for old, new in (pair, pair[::-1])
} | {"floor": ("floor", "trunc")}


@dataclass(frozen=True)
class Edit:
    """Bytes ``start`` to ``end`` of a source, and what stands there instead.

    ``operator`` is its kind and ``what`` what it does, in words; ``needs`` a line to stand at the source's
    end, for a name that the new text uses.
    """

    operator: str
    what: str
    start: int
    end: int
    new: str
    needs: str = ""

    def made(self, text: str) -> str:
        """Return a source with this edit."""
        old = text.encode()
        new = (old[: self.start] + self.new.encode() + old[self.end :]).decode()
        return f"{new}\n{self.needs}\n" if self.needs else new


Node = ast.expr | ast.stmt | ast.keyword


class SourceText:
    """A source to take spans from, in bytes, as the columns of ``ast`` are."""

    def __init__(self, text: str) -> None:
        self.bytes = text.encode()
        self._starts = [0, *accumulate(map(len, self.bytes.splitlines(keepends=True)))]

    def span(self, node: Node) -> tuple[int, int]:
        """Return where a node begins and ends."""
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        first = self._starts[node.lineno - 1] + node.col_offset
        return first, self._starts[node.end_lineno - 1] + node.end_col_offset

    def of(self, node: Node) -> str:
        """Return the words of a node."""
        start, end = self.span(node)
        return self.bytes[start:end].decode()

    def changes(self, node: ast.AST) -> Iterator[Edit]:
        """Yield all changes of one node."""
        match node:
            case ast.Compare(left, signs, rights):
                for sign, one, other in zip(signs, [left, *rights], rights, strict=False):
                    yield from self._swapped(sign, one, other)
            case ast.BoolOp(sign, values):
                for one, other in pairwise(values):
                    yield from self._swapped(sign, one, other)
            case ast.BinOp(left, ast.FloorDiv(), right):
                new = f"int(({self.of(left)}) / ({self.of(right)}))"
                yield Edit("floor", "// truncated", *self.span(node), new)
            case ast.BinOp(left, sign, right):
                yield from self._swapped(sign, left, right)
            case ast.UnaryOp(ast.USub() | ast.Not() as sign):
                operator, old = ("sign", "-") if isinstance(sign, ast.USub) else ("truth", "not ")
                start = self.span(node)[0]
                yield Edit(operator, f"{old.strip()} dropped", start, start + len(old), "")
            case ast.Attribute():
                yield from self._renamed(node)
            case ast.Subscript():
                yield from self._indices(node)
            case ast.Constant():
                yield from self._constants(node)
            case ast.Call():
                yield from self._calls(node)
            case ast.FunctionDef():
                yield from self._counts(node)
            case ast.If() | ast.While() | ast.IfExp():
                if not isinstance(node.test, ast.Constant):
                    for new in ("True", "False"):
                        yield Edit("condition", f"always {new.lower()}", *self.span(node.test), new)
            case ast.Expr(ast.Call(called)):
                yield Edit("dropped", f"{self.of(called)}(...)", *self.span(node), "pass")
            case ast.Assign() | ast.AugAssign():
                yield from self._assignments(node)

    def _swapped(self, sign: ast.AST, one: Node, other: Node, after: str = "") -> Iterator[Edit]:
        """A sign between two nodes and its counterpart: ``<`` and ``<=``, ``and`` and ``or``."""
        if type(sign) in SIGNS:
            operator, old, new = SIGNS[type(sign)]
            at = self.bytes.index(f"{old}{after}".encode(), self.span(one)[1], self.span(other)[0])
            yield Edit(operator, f"{old}{after} -> {new}{after}", at, at + len(old), new)

    def _renamed(self, node: ast.Attribute) -> Iterator[Edit]:
        """x for y, reach for radius, min for max, floor by truncation, and back."""
        home, old = self.of(node.value), node.attr
        if (
            old not in RENAMED
            or (old in ("reach", "radius") and home == "scene")  # a scene has no reach
            or (old in ("width", "height") and "limits" not in home)  # not the arena's
            or (old == "floor" and home not in ("np", "numpy", "math"))
        ):
            return
        operator, new = RENAMED[old]
        end = self.span(node)[1]
        yield Edit(operator, f"{old} -> {new}", end - len(old.encode()), end, new)

    def _indices(self, node: ast.Subscript) -> Iterator[Edit]:
        """An index greater by one; one that ends in a number is the constant's business."""
        for each in node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]:
            last = each.right if isinstance(each, ast.BinOp) else each
            if not isinstance(last, ast.Constant | ast.Slice | ast.UnaryOp | ast.Compare):
                end = self.span(each)[1]
                yield Edit("index", f"[{self.of(each)}] + 1", end, end, " + 1")

    def _constants(self, node: ast.Constant) -> Iterator[Edit]:
        """A whole number less by one, 0 made 1; True and False."""
        value = node.value
        if isinstance(value, bool):
            new = str(not value)
        elif isinstance(value, int | float) and value == int(value):
            new = repr(type(value)(value - 1 if value else 1))
        else:
            return
        yield Edit("constant", f"{self.of(node)} -> {new}", *self.span(node), new)

    def _calls(self, node: ast.Call) -> Iterator[Edit]:
        """``smaller`` and ``larger``, ``min`` and ``max``; a part of ``BroadPhaseParts`` dropped."""
        called = self.of(node.func)
        if isinstance(node.func, ast.Name) and RENAMED.get(called, ("",))[0] == "extreme":
            operator, new = RENAMED[called]
            needs = f"from kinetile.toolbox import {new}" if new in ("smaller", "larger") else ""
            yield Edit(operator, f"{called} -> {new}", *self.span(node.func), new, needs)
        if called.rpartition(".")[2] == "BroadPhaseParts":
            for part in node.keywords:
                if part.arg not in (None, "audit", "sound", "draw", "near", "state"):
                    start, end = self.span(part)
                    rest = self.bytes[end : self.span(node)[1]]
                    comma = len(rest) - len(rest.lstrip()) + 1 if rest.lstrip().startswith(b",") else 0
                    yield Edit("dropped", f"{part.arg}=...", start, end + comma, "")

    def _counts(self, node: ast.FunctionDef) -> Iterator[Edit]:
        """``return n - 1`` for ``return n``, in functions that return a whole number or do not say what."""
        says = None if node.returns is None else ast.unparse(node.returns).strip("'\"")
        counted = ast.Name if says is None else ast.Name | ast.Call | ast.BinOp | ast.Subscript
        for each in ast.walk(node) if says in (None, "int") else ():
            if isinstance(each, ast.Return) and isinstance(each.value, counted):
                new = f"({self.of(each.value)}) - 1"
                yield Edit("count", "return n -> n - 1", *self.span(each.value), new)

    def _assignments(self, node: ast.Assign | ast.AugAssign) -> Iterator[Edit]:
        """A store into an array or a record dropped; ``+=`` and ``-=``."""
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        if all(isinstance(each, ast.Subscript) for each in targets):
            yield Edit("dropped", f"{self.of(targets[0])} = ...", *self.span(node), "pass")
        if isinstance(node, ast.AugAssign):
            yield from self._swapped(node.op, node.target, node.value, "=")
