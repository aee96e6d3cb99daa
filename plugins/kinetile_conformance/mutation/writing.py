"""A phase written down once more, as a package of another name, with a change in it or none."""

from __future__ import annotations

import ast
from pathlib import Path

from kinetile_conformance.mutation.operators import Change
from kinetile_conformance.mutation.sources import PhaseSource, Source, place_in

__all__ = ["changed", "write"]


def changed(text: str, change: Change) -> str:
    """Return a source with one change."""
    old = text.encode()
    new = (old[: change.start] + change.new.encode() + old[change.end :]).decode()
    return f"{new}\n{change.needs}\n" if change.needs else new


def write(phase: PhaseSource, folder: Path, name: str, place: str = "", change: Change | None = None) -> str:
    """Write a phase into a folder as the package ``name``, with a change in the file ``place``.

    Returns the target of its specification, ``"package.module:Class"``.
    """
    room = folder / name
    room.mkdir(parents=True)
    (room / "__init__.py").touch()
    for source in phase.modules:
        here = place_in(phase, source)
        path = room / here
        path.parent.mkdir(parents=True, exist_ok=True)
        (path.parent / "__init__.py").touch()
        text = source.text if change is None or here != place else changed(source.text, change)
        path.write_text(_moved(phase, source, text, name), encoding="utf-8")
    inner = phase.modules[0].module.removeprefix(phase.package).removeprefix(".")
    return f"{'.'.join(filter(None, [name, inner]))}:{phase.class_name}"


def _moved(phase: PhaseSource, source: Source, text: str, name: str) -> str:
    """Return a text with what it imports found from its new place."""
    own = {each.module for each in phase.modules}
    tree = ast.parse(text)
    lines = text.encode().splitlines(keepends=True)
    ends = {
        (node.lineno, node.col_offset): node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)
    }
    for node in sorted(ends.values(), key=lambda each: -each.lineno):
        home = source.home_of(node)
        inside = home in own or any(f"{home}.{alias.name}" in own for alias in node.names)
        if inside == (node.level > 0):
            continue
        new = name + home.removeprefix(phase.package) if inside else home
        names = ", ".join(
            f"{each.name} as {each.asname}" if each.asname else each.name for each in node.names
        )
        assert node.end_lineno is not None
        begin = lines[node.lineno - 1][: node.col_offset]
        rest = lines[node.end_lineno - 1][node.end_col_offset :]
        height = node.end_lineno - node.lineno
        made = begin + f"from {new} import {names}".encode() + rest
        lines[node.lineno - 1 : node.end_lineno] = [made, *[b"\n"] * height]
    return b"".join(lines).decode()
