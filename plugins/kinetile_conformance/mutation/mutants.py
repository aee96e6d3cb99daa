"""Mutants of a phase: every change of what its class reaches, numbered from top to bottom, module by module.

A definition reaches the names that it uses, in its own module and, by ``from`` imports, in the others; what
nothing reaches changes nothing. The audit is left out: it is the author's own judge, and a mutant of the
judge says nothing about the phase.

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

from kinetile_conformance.mutation.operators import Edit, SourceText, changes
from kinetile_conformance.mutation.sources import PhaseSource, Source, place_in

Place = tuple[str, str]
"""A module, and a name at its top level."""


def reached(phase: PhaseSource, audits: bool = False) -> dict[str, list[ast.stmt]]:
    """Return the statements at the top level of each module that the phase's class reaches."""
    homes = {source.module: _definitions(source) for source in phase.modules}
    ways = {source.module: _ways(phase, source) for source in phase.modules}
    found: dict[str, list[ast.stmt]] = {source.module: [] for source in phase.modules}
    seen: set[Place] = set()
    left: list[Place] = [(phase.modules[0].module, phase.class_name.partition(".")[0])]
    while left:
        place = left.pop()
        if place in seen:
            continue
        seen.add(place)
        module, name = place
        if name in ways.get(module, {}):
            home, inner = ways[module][name]
            left += [(home, inner)] if inner else [(home, each) for each in homes[home]]
        for statement in homes.get(module, {}).get(name, ()):
            if statement not in found[module]:
                found[module].append(statement)
            left += [(module, used) for used in _used(statement, audits)]
    for statements in found.values():
        statements.sort(key=lambda each: each.lineno)
    return found


def _definitions(source: Source) -> dict[str, list[ast.stmt]]:
    """Return the statements that define each name at a module's top level."""
    found: dict[str, list[ast.stmt]] = {}
    for statement in source.tree.body:
        if isinstance(statement, ast.Import | ast.ImportFrom):
            continue
        if isinstance(statement, ast.FunctionDef | ast.ClassDef):
            names = [statement.name]
        else:
            stores = (each for each in ast.walk(statement) if isinstance(each, ast.Name))
            names = [each.id for each in stores if isinstance(each.ctx, ast.Store)]
        for name in names:
            if name != "__all__":
                found.setdefault(name, []).append(statement)
    return found


def _ways(phase: PhaseSource, source: Source) -> dict[str, tuple[str, str]]:
    """Return for each name that is imported from a module of the phase that module and the name in it; no
    name for a whole module."""
    found = {}
    for _, each in source.imports():
        if each.whole and phase.named(f"{each.home}.{each.name}") is not None:
            found[each.alias] = (f"{each.home}.{each.name}", "")
        elif phase.named(each.home) is not None:
            found[each.alias] = (each.home, each.name)
    return found


def _used(statement: ast.stmt, audits: bool) -> set[str]:
    """Return the names that a statement uses, but for what is given as ``draw=`` or ``audit=``."""
    left_out = ("draw",) if audits else ("draw", "audit")
    unused = {
        id(each)
        for node in ast.walk(statement)
        if isinstance(node, ast.keyword) and node.arg in left_out
        for each in ast.walk(node.value)
    }
    names = (each for each in ast.walk(statement) if isinstance(each, ast.Name) and id(each) not in unused)
    return {each.id for each in names if isinstance(each.ctx, ast.Load)}


_EQUIVALENT = re.compile(r"#\s*mutate:\s*equivalent,?\s*(.*?)\s*$")


@dataclass(frozen=True)
class Equivalent:
    """A line that its author has marked: its mutants change nothing, for this reason."""

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
    change: Edit
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
        text = SourceText(source)
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
    """Return the mutants with a text in their label, and of these a random sample, in their order."""
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


def _lines(text: bytes, change: Edit) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the lines that a change touches, before and after."""
    first = text.rfind(b"\n", 0, change.start) + 1
    last = text.find(b"\n", change.end)
    last = len(text) if last < 0 else last
    after = text[first : change.start] + change.new.encode() + text[change.end : last]
    return tuple(text[first:last].decode().split("\n")), tuple(after.decode().split("\n"))
