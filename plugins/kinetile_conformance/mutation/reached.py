"""What of a phase's source is its own doing: all that its class reaches, but not by way of its audit.

A phase's audit is its author's own judge, and a mutant of the judge says nothing about the phase. What
nothing reaches changes nothing. A definition reaches the names that it uses, in its own module and, by
``from`` imports, in the others.
"""

from __future__ import annotations

import ast

from kinetile_conformance.mutation.sources import PhaseSource, Source

__all__ = ["reached"]

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
