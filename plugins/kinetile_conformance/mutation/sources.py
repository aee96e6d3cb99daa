"""Sources of a phase: the module of its class, and the modules of the same package that this imports.

``import package.module`` without ``as`` is not followed; ``from . import module``, ``from .module import
name`` and their absolute forms are.
"""

from __future__ import annotations

import ast
import importlib.util
import inspect
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from pathlib import Path

from kinetile.errors import BadOption
from kinetile.plugin.registry import registry


@dataclass(frozen=True)
class Import:
    """``from module import name as alias``, resolved.

    ``home`` is the full name of the module that it is taken from; ``whole`` says that the name is itself a
    module.
    """

    home: str
    name: str
    alias: str
    whole: bool


@dataclass(frozen=True)
class Source:
    """One module: its full name, its file, and its text; ``is_package`` where it is an ``__init__``."""

    module: str
    path: Path
    text: str
    is_package: bool

    @cached_property
    def tree(self) -> ast.Module:
        """The text, parsed."""
        return ast.parse(self.text)

    @cached_property
    def _starts(self) -> list[int]:
        """Where each line begins, in bytes."""
        return [0, *accumulate(map(len, self.text.encode().splitlines(keepends=True)))]

    def offset(self, line: int, column: int) -> int:
        """Return where a line (from 1) and a column (in bytes, as in ``ast``) stand in the text, in bytes."""
        return self._starts[line - 1] + column

    def home_of(self, node: ast.ImportFrom) -> str:
        """Return the full name of the module that a ``from`` names."""
        if node.level == 0:
            return node.module or ""
        package = self.module if self.is_package else self.module.rpartition(".")[0]
        parts = package.split(".")[: len(package.split(".")) - node.level + 1]
        return ".".join([*parts, *filter(None, [node.module])])

    def imports(self) -> Iterator[tuple[ast.ImportFrom, Import]]:
        """Yield what is imported by ``from``, but for what only a type checker sees."""
        unseen = {
            id(each)
            for node in ast.walk(self.tree)
            if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
            for inner in node.body
            for each in ast.walk(inner)
        }
        for node in ast.walk(self.tree):
            if isinstance(node, ast.ImportFrom) and id(node) not in unseen:
                home = self.home_of(node)
                for alias in node.names:
                    whole = _is_module(f"{home}.{alias.name}")
                    yield node, Import(home, alias.name, alias.asname or alias.name, whole)


@dataclass(frozen=True)
class PhaseSource:
    """All modules of a phase, that of its class first; ``package`` is what their names begin with."""

    package: str
    class_name: str
    modules: tuple[Source, ...]

    def named(self, module: str) -> Source | None:
        """Return the module of a full name, if it is one of the phase's."""
        return next((each for each in self.modules if each.module == module), None)


def source_of(name: str) -> PhaseSource:
    """Return the source of a broad phase.

    Raises UnknownName; PhaseError where it does not import; BadOption where its source is in no file.
    """
    found = registry().broad_phase(name)
    module = found.__module__
    try:
        path = Path(inspect.getsourcefile(found) or "")
        source = _read(module, path)
    except (OSError, TypeError, SyntaxError, UnicodeDecodeError) as error:
        raise BadOption(
            f"broad phase {name!r}: the source of its class {module}.{found.__qualname__} is in no file "
            "that can be read; mutants are made of source files"
        ) from error
    package = module if source.is_package else module.rpartition(".")[0]
    modules = [source]
    for each in modules:
        for _, imported in each.imports():
            wanted = f"{imported.home}.{imported.name}" if imported.whole else imported.home
            within = package and (wanted == package or wanted.startswith(f"{package}."))
            if within and wanted not in [known.module for known in modules]:
                spec = importlib.util.find_spec(wanted)
                if spec is not None and spec.origin is not None and spec.origin.endswith(".py"):
                    modules.append(_read(wanted, Path(spec.origin)))
    return PhaseSource(package, found.__qualname__, tuple(modules))


def place_in(phase: PhaseSource, source: Source) -> str:
    """Return where a module is written within the new package: ``events.py``, ``rooms/web.py``."""
    inner = source.module.removeprefix(phase.package).removeprefix(".").replace(".", "/")
    if source.is_package:
        return f"{inner}/__init__.py".removeprefix("/")
    return f"{inner}.py"


def _read(module: str, path: Path) -> Source:
    return Source(module, path, path.read_text(encoding="utf-8"), path.name == "__init__.py")


def _is_module(name: str) -> bool:
    try:
        return importlib.util.find_spec(name) is not None
    except (ImportError, AttributeError, ValueError):
        return False
