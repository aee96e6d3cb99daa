"""Mutation operators: edits of one thing at a time, as the replacement of an exact span of the source.

Each is a mistake that is easily made. They work on the nodes of ``ast``, whose columns say where a thing
stands; signs between two expressions are no nodes and are found among the tokens.
"""

from __future__ import annotations

import ast
import io
import tokenize
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from kinetile_conformance.mutation.sources import Source


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


class SourceText:
    """A source to take spans from."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.bytes = source.text.encode()
        readline = io.StringIO(source.text).readline
        self._signs = [
            (source.offset(row, len(token.line[:column].encode())), token.string)
            for token in tokenize.generate_tokens(readline)
            for row, column in [token.start]
            if token.type == tokenize.OP or token.string in ("and", "or", "not")
        ]

    def span(self, node: ast.expr | ast.stmt | ast.keyword) -> tuple[int, int]:
        """Return where a node begins and ends, in bytes."""
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        first = self.source.offset(node.lineno, node.col_offset)
        return first, self.source.offset(node.end_lineno, node.end_col_offset)

    def of(self, node: ast.expr | ast.stmt | ast.keyword) -> str:
        """Return the words of a node."""
        start, end = self.span(node)
        return self.bytes[start:end].decode()

    def sign(self, words: str, start: int, end: int) -> tuple[int, int]:
        """Return the span of the first sign of these words between two places."""
        at = next(at for at, found in self._signs if start <= at < end and found == words)
        return at, at + len(words)

    def signs(self, words: str, start: int, end: int) -> Iterator[tuple[int, int]]:
        """Yield the spans of all signs of these words between two places."""
        for at, found in self._signs:
            if start <= at < end and found == words:
                yield at, at + len(words)


Operator = Callable[[SourceText, ast.AST], Iterator[Edit]]

COMPARISONS: dict[type[ast.cmpop], tuple[str, str]] = {
    ast.Lt: ("<", "<="),
    ast.LtE: ("<=", "<"),
    ast.Gt: (">", ">="),
    ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
}
SIGNS: dict[type[ast.operator], tuple[str, str]] = {ast.Add: ("+", "-"), ast.Sub: ("-", "+")}
TRUTHS: dict[type[ast.operator], tuple[str, str]] = {ast.BitAnd: ("&", "|"), ast.BitOr: ("|", "&")}
FLOORS = {"floor": "trunc"}
ENDS = {"smaller": "larger", "larger": "smaller", "min": "max", "max": "min"}
ENDS |= {"minimum": "maximum", "maximum": "minimum"}
NAMES = {"x": "y", "y": "x", "vx": "vy", "vy": "vx", "width": "height", "height": "width"}
RADII = {"reach": "radius", "radius": "reach"}


def comparison(text: SourceText, node: ast.AST) -> Iterator[Edit]:
    """``<`` and ``<=``, ``>`` and ``>=``, ``==`` and ``!=``."""
    if isinstance(node, ast.Compare):
        sides = [node.left, *node.comparators]
        for left, kind, right in zip(sides, node.ops, sides[1:], strict=False):
            if type(kind) in COMPARISONS:
                old, new = COMPARISONS[type(kind)]
                span = text.sign(old, text.span(left)[1], text.span(right)[0])
                yield Edit("comparison", f"{old} -> {new}", *span, new)


def sign(text: SourceText, node: ast.AST) -> Iterator[Edit]:
    """``+`` and ``-``, also in ``+=``; a minus dropped."""
    if isinstance(node, ast.BinOp) and type(node.op) in SIGNS:
        old, new = SIGNS[type(node.op)]
        span = text.sign(old, text.span(node.left)[1], text.span(node.right)[0])
        yield Edit("sign", f"{old} -> {new}", *span, new)
    if isinstance(node, ast.AugAssign) and type(node.op) in SIGNS:
        old, new = SIGNS[type(node.op)]
        span = text.sign(f"{old}=", text.span(node.target)[1], text.span(node.value)[0])
        yield Edit("sign", f"{old}= -> {new}=", *span, f"{new}=")
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        start = text.span(node)[0]
        yield Edit("sign", "- dropped", start, start + len("-"), "")


def truth(text: SourceText, node: ast.AST) -> Iterator[Edit]:
    """``and`` and ``or``, ``&`` and ``|``; a ``not`` dropped."""
    if isinstance(node, ast.BoolOp):
        old, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
        for left, right in zip(node.values, node.values[1:], strict=False):
            span = text.sign(old, text.span(left)[1], text.span(right)[0])
            yield Edit("truth", f"{old} -> {new}", *span, new)
    if isinstance(node, ast.BinOp) and type(node.op) in TRUTHS:
        old, new = TRUTHS[type(node.op)]
        span = text.sign(old, text.span(node.left)[1], text.span(node.right)[0])
        yield Edit("truth", f"{old} -> {new}", *span, new)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        start = text.span(node)[0]
        yield Edit("truth", "not dropped", start, start + len("not "), "")


def dropped(text: SourceText, node: ast.AST) -> Iterator[Edit]:
    """A call that stands alone, a store into an array or a record, a part of ``BroadPhaseParts``."""
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
        yield Edit("dropped", f"{text.of(node.value.func)}(...)", *text.span(node), "pass")
    if isinstance(node, ast.Assign | ast.AugAssign):
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        if all(isinstance(each, ast.Subscript) for each in targets):
            yield Edit("dropped", f"{text.of(targets[0])} = ...", *text.span(node), "pass")
    if isinstance(node, ast.Call) and text.of(node.func).rpartition(".")[2] == "BroadPhaseParts":
        for part in node.keywords:
            if part.arg not in (None, "audit", "draw", "near", "state"):
                start, end = text.span(part)
                after = text.bytes[end : text.span(node)[1]]
                comma = len(after) - len(after.lstrip()) + 1 if after.lstrip().startswith(b",") else 0
                yield Edit("dropped", f"{part.arg}=...", start, end + comma, "")


def radius(text: SourceText, node: ast.AST) -> Iterator[Edit]:
    """``reach`` and ``radius`` of bodies. A scene has no reach."""
    if isinstance(node, ast.Attribute) and node.attr in RADII and text.of(node.value) != "scene":
        yield _renamed(text, node, "radius", RADII[node.attr])


def floor(text: SourceText, node: ast.AST) -> Iterator[Edit]:
    """``floor`` by truncation, and so ``//``."""
    if (
        isinstance(node, ast.Attribute)
        and node.attr in FLOORS
        and text.of(node.value) in ("np", "math", "numpy")
    ):
        yield _renamed(text, node, "floor", FLOORS[node.attr])
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.FloorDiv):
        new = f"int(({text.of(node.left)}) / ({text.of(node.right)}))"
        yield Edit("floor", "// truncated", *text.span(node), new)


def index(text: SourceText, node: ast.AST) -> Iterator[Edit]:
    """An index greater by one; one that ends in a number is the constant's business."""
    if isinstance(node, ast.Subscript):
        for each in node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]:
            ends = each.right if isinstance(each, ast.BinOp) else each
            if not isinstance(ends, ast.Constant | ast.Slice | ast.UnaryOp | ast.Compare):
                end = text.span(each)[1]
                yield Edit("index", f"[{text.of(each)}] + 1", end, end, " + 1")


def extreme(text: SourceText, node: ast.AST) -> Iterator[Edit]:
    """``smaller`` and ``larger``, ``min`` and ``max``."""
    if isinstance(node, ast.Call):
        called = node.func
        if isinstance(called, ast.Name) and called.id in ENDS:
            new = ENDS[called.id]
            needs = f"from kinetile.toolbox import {new}" if new in ("smaller", "larger") else ""
            yield Edit("extreme", f"{called.id} -> {new}", *text.span(called), new, needs)
        if isinstance(called, ast.Attribute) and called.attr in ENDS:
            yield _renamed(text, called, "extreme", ENDS[called.attr])


def constant(text: SourceText, node: ast.AST) -> Iterator[Edit]:
    """A whole number less by one, 0 made 1; True and False."""
    if isinstance(node, ast.Constant):
        value = node.value
        if isinstance(value, bool):
            new = str(not value)
        elif isinstance(value, int | float) and value == int(value):
            new = repr(type(value)(value - 1 if value else 1))
        else:
            return
        yield Edit("constant", f"{text.of(node)} -> {new}", *text.span(node), new)


def condition(text: SourceText, node: ast.AST) -> Iterator[Edit]:
    """A condition that is always true, or always false."""
    if isinstance(node, ast.If | ast.While | ast.IfExp) and not isinstance(node.test, ast.Constant):
        for new in ("True", "False"):
            yield Edit("condition", f"always {new.lower()}", *text.span(node.test), new)


def count(text: SourceText, node: ast.AST) -> Iterator[Edit]:
    """``return n - 1`` for ``return n``, in functions that return a whole number or do not say what."""
    if isinstance(node, ast.FunctionDef):
        says = node.returns
        if says is None or (
            isinstance(says, ast.Name | ast.Constant) and text.of(says).strip("'\"") == "int"
        ):
            for each in ast.walk(node):
                value = each.value if isinstance(each, ast.Return) else None
                if isinstance(value, ast.Name | ast.Call | ast.BinOp | ast.Subscript) and (
                    says is not None or isinstance(value, ast.Name)
                ):
                    start, end = text.span(value)
                    new = f"({text.of(value)}) - 1"
                    yield Edit("count", "return n -> n - 1", start, end, new)


def other_name(text: SourceText, node: ast.AST) -> Iterator[Edit]:
    """x for y, vx for vy, width for height, and back."""
    if isinstance(node, ast.Attribute) and node.attr in NAMES:
        if node.attr in ("width", "height") and "limits" not in text.of(node.value):
            return  # not the arena's
        yield _renamed(text, node, "name", NAMES[node.attr])


def _renamed(text: SourceText, node: ast.Attribute, operator: str, new: str) -> Edit:
    """Return the change of an attribute's name."""
    end = text.span(node)[1]
    return Edit(operator, f"{node.attr} -> {new}", end - len(node.attr.encode()), end, new)


OPERATORS: tuple[Operator, ...] = (
    comparison,
    sign,
    truth,
    dropped,
    radius,
    floor,
    index,
    extreme,
    constant,
    condition,
    count,
    other_name,
)


def changes(text: SourceText, node: ast.AST) -> Iterator[Edit]:
    """Yield all changes of one node."""
    for operator in OPERATORS:
        yield from operator(text, node)
