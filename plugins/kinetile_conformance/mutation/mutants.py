"""The mutants of a phase: every change of its source, numbered from top to bottom, module by module.

Left alone are docstrings, annotations, decorators, ``__all__``, ``raise`` and the conditions that lead to it
and to nothing else (option checks), ``assert``, and texts with fields. A line that ends in the comment
``# mutate: equivalent, because ...`` is left alone too, and its reason is listed.
"""

from __future__ import annotations

import ast
import random
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from kinetile_conformance.mutation.operators import Change, Text, changes
from kinetile_conformance.mutation.reached import reached
from kinetile_conformance.mutation.sources import PhaseSource, Source, place_in

__all__ = ["Equivalent", "Mutant", "equivalents_of", "mutants_of", "sample"]

_EQUIVALENT = re.compile(r"#\s*mutate:\s*equivalent,?\s*(.*?)\s*$")


@dataclass(frozen=True)
class Equivalent:
    """A line whose author says that its mutants change nothing, and why."""

    place: str
    line: int
    reason: str


@dataclass(frozen=True)
class Mutant:
    """A phase's source with one change.

    Attributes:
        number: which of the phase's mutants it is, from 1.
        label: where and what, unlike any other: ``events.py:88 comparison < -> <=``.
        place: the file within the phase's package.
        line: where the change begins.
        change: the change.
        before, after: the lines that it changes.
    """

    number: int
    label: str
    place: str
    line: int
    change: Change
    before: tuple[str, ...]
    after: tuple[str, ...]

    @property
    def diff(self) -> list[str]:
        """The lines as they were, and as they are."""
        return [*(f"- {line}" for line in self.before), *(f"+ {line}" for line in self.after)]


def mutants_of(phase: PhaseSource, audits: bool = False) -> list[Mutant]:
    """Return all mutants of a phase; with ``audits`` those of its audit as well."""
    found: list[Mutant] = []
    labels: Counter[str] = Counter()
    for module, statements in reached(phase, audits).items():
        source = phase.named(module)
        assert source is not None
        text = Text(source)
        place = place_in(phase, source)
        spared = {each.line for each in _marked(source, place)}
        seen: set[tuple[int, int, str]] = set()
        these = [change for each in statements for node in _mutable(each) for change in changes(text, node)]
        for change in sorted(these, key=lambda each: (each.start, each.end)):
            line = text.bytes[: change.start].count(b"\n") + 1
            key = (change.start, change.end, change.new)
            if line in spared or key in seen:
                continue
            seen.add(key)
            label = f"{place}:{line} {change.operator} {' '.join(change.what.split())}"
            labels[label] += 1
            if labels[label] > 1:
                label = f"{label} ({labels[label]})"
            before, after = _lines(text.bytes, change)
            found.append(Mutant(len(found) + 1, label, place, line, change, before, after))
    return found


def equivalents_of(phase: PhaseSource) -> list[Equivalent]:
    """Return the lines that their author has marked as having no mutants but equivalent ones."""
    return [each for source in phase.modules for each in _marked(source, place_in(phase, source))]


def sample(mutants: Sequence[Mutant], limit: int | None, seed: int = 0, only: str = "") -> list[Mutant]:
    """Return those whose label has a text in it, and of these so many, by lot, in their order."""
    chosen = [each for each in mutants if only in each.label]
    if limit is not None and limit < len(chosen):
        chosen = random.Random(seed).sample(chosen, limit)
    return sorted(chosen, key=lambda each: each.number)


def _marked(source: Source, place: str) -> Iterator[Equivalent]:
    for line, text in enumerate(source.text.splitlines(), 1):
        if said := _EQUIVALENT.search(text):
            yield Equivalent(place, line, said[1].removeprefix("because").strip())


def _mutable(node: ast.AST, inside: bool = False) -> Iterator[ast.AST]:
    """Yield the nodes of a statement that may be changed; ``inside`` of a function, that is."""
    if isinstance(node, ast.Raise | ast.Assert | ast.JoinedStr | ast.Import | ast.ImportFrom):
        return
    if (
        isinstance(node, ast.If)
        and all(isinstance(each, ast.Raise) for each in node.body)
        and not node.orelse
    ):
        return
    if isinstance(node, ast.Subscript) and not inside:
        return  # a type
    if isinstance(node, ast.keyword) and node.arg in ("audit", "draw", "dtype"):
        return
    yield node
    inside = inside or isinstance(node, ast.FunctionDef)
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "bases"):
            continue
        for each in value if isinstance(value, list) else [value]:
            if isinstance(each, ast.AST):
                yield from _mutable(each, inside)


def _lines(text: bytes, change: Change) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the lines that a change touches, before and after."""
    first = text.rfind(b"\n", 0, change.start) + 1
    last = text.find(b"\n", change.end)
    last = len(text) if last < 0 else last
    after = text[first : change.start] + change.new.encode() + text[change.end : last]
    return tuple(text[first:last].decode().split("\n")), tuple(after.decode().split("\n"))
