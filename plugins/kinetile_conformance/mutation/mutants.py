"""Mutants of a phase: every change of what its class reaches, numbered from top to bottom, module by module.

A definition reaches the names that it uses, in its own module and, by ``from`` imports, in others of the same
package; what nothing reaches changes nothing. ``import package.module`` is not followed. The audit and the
drawing are left out: they judge and show the phase, and a mutant of the judge says nothing about the phase.

Left alone are docstrings, annotations, decorators, ``__all__``, ``raise`` and the conditions that lead to it
and to nothing else (option checks), ``assert``, texts with fields, and lines that end in the comment
``# mutate: equivalent, because ...``.
"""

from __future__ import annotations

import ast
import importlib.util
import inspect
import random
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from kinetile.errors import BadOption
from kinetile.plugin.registry import registry
from kinetile_conformance.mutation.operators import Edit, SourceText

_EQUIVALENT = re.compile(rb"#\s*mutate:\s*equivalent")


@dataclass(frozen=True)
class Source:
    """One module: its full name, its file, and its text."""

    module: str
    path: Path
    text: str

    @cached_property
    def tree(self) -> ast.Module:
        """The text, parsed."""
        return ast.parse(self.text)

    @cached_property
    def imports(self) -> dict[str, tuple[str, str]]:
        """For each name that is imported by ``from``, the module and the name in it."""
        package = self.module if self.path.name == "__init__.py" else self.module.rpartition(".")[0]
        found: dict[str, tuple[str, str]] = {}
        for node in ast.walk(self.tree):
            if isinstance(node, ast.ImportFrom):
                said = "." * node.level + (node.module or "")
                home = importlib.util.resolve_name(said, package)
                found |= {each.asname or each.name: (home, each.name) for each in node.names}
        return found

    @cached_property
    def definitions(self) -> dict[str, list[ast.stmt]]:
        """The statements that define each name at the module's top level."""
        found: dict[str, list[ast.stmt]] = {}
        for node in self.tree.body:
            if isinstance(node, ast.Import | ast.ImportFrom):
                continue
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                names = [node.name]
            else:
                stored = (each for each in ast.walk(node) if isinstance(each, ast.Name))
                names = [each.id for each in stored if isinstance(each.ctx, ast.Store)]
            for name in names:
                if name != "__all__":
                    found.setdefault(name, []).append(node)
        return found


@dataclass(frozen=True)
class PhaseSource:
    """The source of a phase: its class, as ``"package.module:Class"``, and the statements that this reaches,
    by module."""

    target: str
    reached: dict[Source, list[ast.stmt]]


def source_of(name: str) -> PhaseSource:
    """Return the source of a broad phase.

    Raises UnknownName; PhaseError where it does not import; BadOption where its source is in no file.
    """
    found = registry().broad_phase(name)
    module, qualname = found.__module__, found.__qualname__
    try:
        first = _source(module, inspect.getsourcefile(found) or "")
        assert first.tree
    except (OSError, TypeError, SyntaxError, UnicodeDecodeError) as error:
        raise BadOption(
            f"broad phase {name!r}: the source of its class {module}.{qualname} is in no file "
            "that can be read; mutants are made of source files"
        ) from error
    package = module if first.path.name == "__init__.py" else module.rpartition(".")[0]
    return PhaseSource(f"{module}:{qualname}", reached(first, package, qualname))


def reached(first: Source, package: str, name: str) -> dict[Source, list[ast.stmt]]:
    """Return the statements that a class reaches, by module."""
    sources = {first.module: first}
    found: dict[Source, list[ast.stmt]] = {first: []}
    seen: set[tuple[Source, str]] = set()
    left = [(first, name.partition(".")[0])]

    def loaded(module: str) -> Source | None:
        if module not in sources and package and f"{module}.".startswith(f"{package}."):
            with suppress(ImportError):
                spec = importlib.util.find_spec(module)
                if spec is not None and spec.origin is not None and spec.origin.endswith(".py"):
                    sources[module] = _source(module, spec.origin)
        return sources.get(module)

    while left:
        source, name = left.pop()
        if (source, name) in seen:
            continue
        seen.add((source, name))
        if name in source.imports:
            home, inner = source.imports[name]
            if (whole := loaded(f"{home}.{inner}")) is not None:
                left += [(whole, each) for each in whole.definitions]
            elif (other := loaded(home)) is not None:
                left.append((other, inner))
        for node in source.definitions.get(name, ()):
            statements = found.setdefault(source, [])
            if node not in statements:
                statements.append(node)
            left += [(source, used) for used in _used(node)]
    for statements in found.values():
        statements.sort(key=lambda each: each.lineno)
    return found


def _source(module: str, path: str) -> Source:
    return Source(module, Path(path), Path(path).read_text(encoding="utf-8"))


def _used(statement: ast.stmt) -> set[str]:
    """Return the names that a statement uses, but for what is given as ``draw=`` or ``audit=``."""
    keywords = (node for node in ast.walk(statement) if isinstance(node, ast.keyword))
    unused = {
        id(each)
        for node in keywords
        if node.arg in ("draw", "audit", "sound")
        for each in ast.walk(node.value)
    }
    names = (each for each in ast.walk(statement) if isinstance(each, ast.Name) and id(each) not in unused)
    return {each.id for each in names if isinstance(each.ctx, ast.Load)}


@dataclass(frozen=True)
class Mutant:
    """A phase's source with one change.

    Attributes:
        number: which of the phase's mutants it is, from 1.
        label: where and what, unlike any other: ``events.py:88 comparison < -> <=``.
        source: the module that is changed.
        change: the change.
        before, after: the lines that it changes.
    """

    number: int
    label: str
    source: Source
    change: Edit
    before: list[str]
    after: list[str]

    @property
    def text(self) -> str:
        """The module's text, with the change."""
        return self.change.made(self.source.text)

    def as_dict(self) -> dict[str, Any]:
        """Return what there is to show of it, fit for JSON."""
        shown = {"number": self.number, "label": self.label, "operator": self.change.operator}
        return shown | {"before": self.before, "after": self.after}


def mutants_of(phase: PhaseSource) -> list[Mutant]:
    """Return all mutants of a phase."""
    found: list[Mutant] = []
    labels: Counter[str] = Counter()
    home = next(iter(phase.reached)).path.parent
    for source, statements in phase.reached.items():
        place = source.path.relative_to(home).as_posix()
        text = SourceText(source.text)
        these = [change for each in statements for node in _mutable(each) for change in text.changes(node)]
        for change in dict.fromkeys(sorted(these, key=lambda each: (each.start, each.end))):
            line = text.bytes[: change.start].count(b"\n") + 1
            if _EQUIVALENT.search(text.bytes.split(b"\n")[line - 1]):
                continue
            label = f"{place}:{line} {change.operator} {' '.join(change.what.split())}"
            labels[label] += 1
            if labels[label] > 1:
                label = f"{label} ({labels[label]})"
            found.append(Mutant(len(found) + 1, label, source, change, *_lines(text.bytes, change)))
    return found


def sample(mutants: Sequence[Mutant], limit: int | None, seed: int = 0, only: str = "") -> list[Mutant]:
    """Return the mutants with a text in their label, and of these a random sample, in their order."""
    chosen = [each for each in mutants if only in each.label]
    if limit is not None and limit < len(chosen):
        chosen = random.Random(seed).sample(chosen, limit)
    return sorted(chosen, key=lambda each: each.number)


def _mutable(node: ast.AST, inside: bool = False) -> Iterator[ast.AST]:
    """Yield the nodes of a statement that may be changed; ``inside`` of a function, that is."""
    match node:
        case ast.Raise() | ast.Assert() | ast.JoinedStr() | ast.Import() | ast.ImportFrom():
            return
        case ast.If(orelse=[]) if all(isinstance(each, ast.Raise) for each in node.body):
            return
        case ast.Subscript() if not inside:
            return  # a type
        case ast.keyword(arg="audit" | "sound" | "draw" | "dtype"):
            return
    yield node
    inside = inside or isinstance(node, ast.FunctionDef)
    for name, value in ast.iter_fields(node):
        if name not in ("annotation", "returns", "decorator_list", "bases"):
            for each in value if isinstance(value, list) else [value]:
                if isinstance(each, ast.AST):
                    yield from _mutable(each, inside)


def _lines(text: bytes, change: Edit) -> tuple[list[str], list[str]]:
    """Return the lines that a change touches, before and after."""
    first = text.rfind(b"\n", 0, change.start) + 1
    last = text.find(b"\n", change.end)
    last = len(text) if last < 0 else last
    after = text[first : change.start] + change.new.encode() + text[change.end : last]
    return text[first:last].decode().split("\n"), after.decode().split("\n")
