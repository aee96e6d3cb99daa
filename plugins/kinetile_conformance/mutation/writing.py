"""A mutant on disk: written as a package of another name, or put in place of the installed module.

Under another package's name, relative imports within the phase's modules stand as they are; all others are
made absolute.

The author's own tests run in the installed package itself. A ``sitecustomize`` on the path of the command
makes every interpreter that it starts compile the changed text in place of the file's.
"""

from __future__ import annotations

import ast
import os
import subprocess
import tempfile
from pathlib import Path

from kinetile.errors import BadOption
from kinetile_conformance.mutation.mutants import Mutant
from kinetile_conformance.mutation.operators import Edit
from kinetile_conformance.mutation.sources import PhaseSource, Source, place_in


def changed(text: str, change: Edit) -> str:
    """Return a source with one change."""
    old = text.encode()
    new = (old[: change.start] + change.new.encode() + old[change.end :]).decode()
    return f"{new}\n{change.needs}\n" if change.needs else new


def write(phase: PhaseSource, folder: Path, name: str, place: str = "", change: Edit | None = None) -> str:
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


_HOOK = """\
import importlib.machinery, importlib.util, sys

MODULE, FILE, TEXT, PACKAGE = {found!r}


class Loader(importlib.machinery.SourceFileLoader):
    def get_code(self, name):
        with open(TEXT, "rb") as text:
            return compile(text.read(), FILE, "exec", dont_inherit=True)


class Finder:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name == MODULE:
            loader = Loader(name, FILE)
            return importlib.util.spec_from_file_location(
                name, FILE, loader=loader, submodule_search_locations=PACKAGE
            )


sys.meta_path.insert(0, Finder)
"""


def try_tests(command: str) -> None:
    """Run a command on the phase as it is; raise BadOption where it does not end with exit code 0."""
    code = _run(command, dict(os.environ), None)
    if code != 0:
        raise BadOption(f"--also {command!r} ends with exit code {code} on the phase as it is; expected 0")


def passes(phase: PhaseSource, mutant: Mutant, command: str, seconds: float | None = None) -> bool:
    """Return whether a command ends with exit code 0 on a mutant, and in so many seconds."""
    source = next(each for each in phase.modules if place_in(phase, each) == mutant.place)
    with tempfile.TemporaryDirectory(prefix="kinetile-mutant-") as folder:
        text = Path(folder) / "changed"
        text.write_text(changed(source.text, mutant.change), encoding="utf-8")
        path = str(source.path.absolute())
        inner = [str(source.path.parent.absolute())] if source.is_package else None
        found = (source.module, path, str(text), inner)
        (Path(folder) / "sitecustomize.py").write_text(_HOOK.format(found=found), encoding="utf-8")
        paths = filter(None, [folder, os.environ.get("PYTHONPATH")])
        return _run(command, {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}, seconds) == 0


def _run(command: str, environment: dict[str, str], seconds: float | None) -> int | None:
    """Return the exit code of a command; None where it took too long."""
    process = subprocess.Popen(
        command,
        shell=True,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        return process.wait(seconds)
    except subprocess.TimeoutExpired:
        return None
    finally:
        if process.poll() is None:
            os.killpg(process.pid, 9)
            process.wait()
