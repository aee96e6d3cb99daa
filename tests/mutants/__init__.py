"""Mutants: built-in broad phases with one thing wrong each, to see whether the conformance kit notices.

``mutants.toml`` is the table: texts of the built-in phases, the texts in their place, and the check that
kills the mutant. Some are spared: variations that are right, which no check may condemn. A few are wrong and
unseen by the kit with its default budget. A mutant is loaded as a package of its own, a copy of
``kinetile_plugins`` with the changes, and registered under its own name.

Run as a program, it judges the mutants whose names contain one of its arguments, or all, as ``kinetile
conform`` would with the default budget; it prints a line for each, and ends with 1 where a mutant lives that
should not, or is killed and should not be. With ``NUMBA_DISABLE_JIT=1`` nothing has to be compiled: those
that die on small scenes do so within seconds, and the others take ten minutes.
"""

from __future__ import annotations

import importlib
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import kinetile as kt
import kinetile_plugins
from kinetile_conformance import Result, check_broad_phase
from registering import registered

TABLE = Path(__file__).with_name("mutants.toml")
PLUGINS = Path(str(kinetile_plugins.__file__)).parent
HEAD = {"killed_by", "spared", "unseen", "features"}


@dataclass(frozen=True)
class Change:
    """A text that a file of ``kinetile_plugins`` has once, and the text in its place."""

    file: str
    old: str
    new: str

    def made(self, source: str) -> str:
        """Return a source with this change."""
        if source.count(self.old) != 1:
            raise LookupError(f"{self.file} has {source.count(self.old)} times, not once: {self.old!r}")
        return source.replace(self.old, self.new)


@dataclass(frozen=True)
class Mutant:
    """A built-in phase with one thing wrong.

    Attributes:
        base: the phase from which it is made.
        name: the name under which it is registered.
        changes: what is changed.
        killed_by: the check that fails; "" where none does.
        right: whether it is right, so that no check may fail.
        features: the features that it declares.
    """

    base: str
    name: str
    changes: Sequence[Change]
    killed_by: str
    right: bool
    features: frozenset[str]

    @classmethod
    def of(cls, base: str, name: str, row: dict[str, Any]) -> Mutant:
        """Return the mutant of a row of the table."""
        files = {key: value for key, value in row.items() if key not in HEAD}
        changes = [Change(file, old, new) for file, texts in files.items() for old, new in texts]
        features = frozenset(row.get("features", ()))
        return cls(base, f"{base}-{name}", changes, row.get("killed_by", ""), "spared" in row, features)

    def spec(self, folder: Path) -> kt.BroadPhaseSpec:
        """Write its package into a folder from which it can be imported; return its spec."""
        package = f"mutant_{self.name.replace('-', '_')}"
        for path in PLUGINS.rglob("*.py"):
            file = path.relative_to(PLUGINS).as_posix()
            text = path.read_text(encoding="utf-8")
            for change in self.changes:
                text = change.made(text) if change.file == file else text
            there = folder / package / file
            there.parent.mkdir(parents=True, exist_ok=True)
            there.write_text(text.replace("from kinetile_plugins", f"from {package}"), encoding="utf-8")
        if unknown := {each.file for each in self.changes if not (PLUGINS / each.file).is_file()}:
            raise LookupError(f"{self.name} changes files that do not exist: {', '.join(sorted(unknown))}")
        target = kt.registry().spec("broad phase", self.base).target
        return kt.BroadPhaseSpec(
            self.name, str(target).replace("kinetile_plugins", package), features=self.features
        )


ALL = {
    mutant.name: mutant
    for base, rows in tomllib.loads(TABLE.read_text(encoding="utf-8")).items()
    for mutant in (Mutant.of(base, name, row) for name, row in rows.items())
}
"""The mutants by name."""


@contextmanager
def loaded(name: str, folder: Path) -> Iterator[Mutant]:
    """Within this context a mutant is registered, and its package can be imported from a folder."""
    mutant = ALL[name]
    sys.path.insert(0, str(folder))
    try:
        with registered(mutant.spec(folder)):
            importlib.invalidate_caches()
            yield mutant
    finally:
        sys.path.remove(str(folder))


class _Found(Exception):
    """A check has failed: no other is run."""


def judge(name: str, folder: Path, checks: Sequence[str] | None = None, **options: Any) -> Result | None:
    """Judge a mutant with the default budget, by the check that kills it or by others.

    Returns the first result that is not ok; None where there is none. One that is to be spared is judged by
    all checks.
    """

    def stop(result: Result) -> None:
        if not result.ok:
            raise _Found(result)

    with loaded(name, folder) as mutant:
        checks = checks or ([mutant.killed_by] if mutant.killed_by else None)
        try:
            check_broad_phase(name, checks=checks, on_result=stop, **options)
        except _Found as found:
            (result,) = found.args
            return result if isinstance(result, Result) else None
    return None


def as_expected(name: str, found: Result | None) -> bool:
    """Whether a mutant is killed by its check, or spared where it has none."""
    if found is None or found.unjudged:
        return found is None and not ALL[name].killed_by
    return found.check == ALL[name].killed_by


def main(*words: str) -> int:
    """Judge mutants and print a line for each; return the exit code."""
    wrong = 0
    for name in ALL:
        if any(word in name for word in words or ("",)):
            began = time.perf_counter()
            with tempfile.TemporaryDirectory() as folder:
                found = judge(name, Path(folder), shrink=False)
            wrong += not as_expected(name, found)
            said = "spared"
            if found is not None:
                said = f"{found.status} {found.check}: {(found.said or found.reason).splitlines()[0][:80]}"
            verdict = "ok   " if as_expected(name, found) else "WRONG"
            print(f"{verdict} {name} ({time.perf_counter() - began:.0f} s): {said}", flush=True)
    return int(wrong > 0)
