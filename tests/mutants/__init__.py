"""Mutants: phases with one fault each, to test whether the conformance kit finds it.

Two tables have the texts of phases, and their replacements: ``mutants.toml`` the mutants against which the
kit was made, each with the check that kills it, and ``families.toml`` the mutants that were written from the
contract alone, in families, before there were checks for them. Their bases are the built-in phases,
responses, and ``margins.py`` of this folder, a phase as authors write it. Some rows are spared: right
variations, which no check may condemn. Two are wrong and unseen with the default budget. A mutant is loaded
as its own package, a copy of ``kinetile_plugins`` with the changes, and registered under its own name.

Run as a program (``--help``), it judges them like ``kinetile conform`` with the default budget, and writes
the results into ``faults.json`` of the kit, from which ``--table`` prints the two tables of ``README.md``
beside this file. With ``NUMBA_DISABLE_JIT=1`` nothing has to be compiled: mutants that die on small scenes
do so within seconds, and the others take ten minutes.
"""

import argparse
import importlib
import json
import sys
import tempfile
import time
import tomllib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import kinetile as kt
import kinetile_conformance
import kinetile_plugins
from kinetile_conformance import Result, check_broad_phase, judging
from registering import registered

HERE = Path(__file__).parent

TABLES = HERE / "mutants.toml", HERE / "families.toml"
FOUND = Path(str(kinetile_conformance.__file__)).with_name("faults.json")
"""The faults that the kit finds, by the runner's last measurement; shipped with the kit."""

PLUGINS = Path(str(kinetile_plugins.__file__)).parent
FILES = {path.relative_to(PLUGINS).as_posix(): path for path in PLUGINS.rglob("*.py")}
FILES["margins.py"] = HERE / "margins.py"
"""The files of a mutant's package."""


def outcomes() -> dict[str, Any]:
    """Returns the results of the runner: ``faults``, each with its family and the check that killed it, or
    None, and ``variations``, each with the check that condemned it, or None."""
    if not FOUND.is_file():
        return {"kit": "", "faults": {}, "variations": {}}
    found: dict[str, Any] = json.loads(FOUND.read_text(encoding="utf-8"))
    return found


WRITTEN = outcomes()

HEAD = {"killed_by", "spared", "features", "family"}
FAMILY = "built-in phases"
"""The family of the mutants against which the kit was made."""

Spec: TypeAlias = kt.BroadPhaseSpec | kt.NarrowPhaseSpec | kt.ResponseSpec

KINDS = {"disc": "narrow phase", "convex": "narrow phase", "wall": "narrow phase", "restitution": "response"}
"""The kinds of bases that are not broad phases."""

UNDER = "cells"
"""The broad phase under which mutants of other kinds are judged."""


@dataclass(frozen=True)
class Change:
    """A text that a file of ``kinetile_plugins`` has once, and the text in its place."""

    file: str
    old: str
    new: str

    def made(self, source: str) -> str:
        if source.count(self.old) != 1:
            raise LookupError(f"{self.file} has {source.count(self.old)} times, not once: {self.old!r}")
        return source.replace(self.old, self.new)


@dataclass(frozen=True)
class Mutant:
    """A phase, or a response, with one thing wrong.

    Attributes:
        base: the phase from which it is made.
        family: its kind of fault; "variations" if it is right.
        name: the name under which it is registered.
        changes: its changes.
        killed_by: the check that fails, by its row or by the runner's last run; "" without one.
        right: True if it is right, so that no check may fail.
        features: the features that it declares.
    """

    base: str
    name: str
    family: str
    changes: Sequence[Change]
    killed_by: str
    right: bool
    features: frozenset[str]

    @classmethod
    def of(cls, base: str, name: str, row: dict[str, Any]) -> "Mutant":
        """Returns the mutant of a row of the table."""
        files = {key: value for key, value in row.items() if key not in HEAD}
        changes = [Change(file, old, new) for file, texts in files.items() for old, new in texts]
        right = "spared" in row
        return cls(
            base,
            f"{base}-{name}",
            "variations" if right else row.get("family", FAMILY),
            changes,
            row.get("killed_by") or WRITTEN["faults"].get(f"{base}-{name}", {}).get("killed_by") or "",
            right,
            frozenset(row.get("features", ())),
        )

    @property
    def kind(self) -> str:
        """The kind of its base: a broad phase, a narrow phase or a response."""
        return KINDS.get(self.base, "broad phase")

    def sources(self) -> Iterator[tuple[str, str]]:
        """Yields the files of its package, each with its text."""
        if unknown := {each.file for each in self.changes} - FILES.keys():
            raise LookupError(f"{self.name} changes files that do not exist: {', '.join(sorted(unknown))}")
        for file, path in FILES.items():
            text = path.read_text(encoding="utf-8")
            for change in self.changes:
                text = change.made(text) if change.file == file else text
            yield file, text

    def spec(self, folder: Path) -> Spec:
        """Writes its package into a folder, for imports; returns its spec."""
        package = f"mutant_{self.name.replace('-', '_')}"
        for file, text in self.sources():
            there = folder / package / file
            there.parent.mkdir(parents=True, exist_ok=True)
            there.write_text(text.replace("from kinetile_plugins", f"from {package}"), encoding="utf-8")
        if self.base == "margins":
            return kt.BroadPhaseSpec(self.name, f"{package}.margins:Margins", features=self.features)
        spec = kt.registry().spec(self.kind, self.base)
        target = str(spec.target).replace("kinetile_plugins", package)
        if isinstance(spec, kt.NarrowPhaseSpec):
            return kt.NarrowPhaseSpec(self.name, target, role=spec.role, shapes=spec.shapes)
        if isinstance(spec, kt.ResponseSpec):
            return kt.ResponseSpec(self.name, target, features=spec.features)
        return kt.BroadPhaseSpec(self.name, target, features=self.features)


ALL = {
    mutant.name: mutant
    for table in TABLES
    for base, rows in tomllib.loads(table.read_text(encoding="utf-8")).items()
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


def run_checks(name: str, folder: Path, on_result: Callable[[Result], None], **options: Any) -> None:
    """Judges a mutant, or ``UNDER`` with it, with these options of the kit."""
    with loaded(name, folder) as mutant:
        if mutant.kind == "broad phase":
            check_broad_phase(name, on_result=on_result, **options)
        elif mutant.kind == "narrow phase":
            check_broad_phase(UNDER, narrow_phases=[name], on_result=on_result, **options)
        else:
            response = kt.Response(name, e=1.0)
            check_broad_phase(UNDER, response=response, on_result=on_result, **options)


def judge(name: str, folder: Path, checks: Sequence[str] | None = None, **options: Any) -> Result | None:
    """Judges a mutant with the default budget, by the check that kills it or by others.

    Returns the first result that is not ok, a finished one if possible; None without one. A mutant that is
    to be spared is judged by all checks.
    """
    unjudged: list[Result] = []

    def stop(result: Result) -> None:
        if result.status == "not judged":
            unjudged.append(result)
        elif not result.ok:
            raise _Found(result)

    mutant = ALL[name]
    checks = checks or ([mutant.killed_by] if mutant.killed_by else None)
    try:
        run_checks(name, folder, stop, checks=checks, **options)
    except _Found as found:
        (result,) = found.args
        return result if isinstance(result, Result) else None
    return unjudged[0] if unjudged else None


def as_expected(name: str, found: Result | None) -> bool:
    """Returns True if a mutant is killed by its check, or spared without a check."""
    if found is None or found.status == "not judged":
        return found is None and not ALL[name].killed_by
    return found.check == ALL[name].killed_by


def note(name: str, check: str | None, by_all: bool) -> None:
    """Records the outcome of a mutant, and for a variation, whether all checks have judged it."""
    found = outcomes()
    if ALL[name].right:
        found["variations"][name] = {"condemned_by": check, "by_all_checks": by_all}
    else:
        day = time.strftime("%Y-%m-%d")
        found["faults"][name] = {"family": ALL[name].family, "killed_by": check, "judged": day}
    for kind in ("faults", "variations"):
        there = {each for each in found[kind] if each in ALL and ALL[each].right == (kind == "variations")}
        found[kind] = {each: found[kind][each] for each in sorted(there)}
    found["kit"] = kinetile_conformance.KIT_VERSION
    FOUND.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


def table() -> str:
    """Returns the page of the two tables."""
    found, counts = outcomes(), judging.faults()
    written = [counts[family] for family in counts if family != FAMILY]
    rows = [(family, *counts[family]) for family in sorted(counts)]
    rows += [("in families", sum(k for k, _ in written), sum(n for _, n in written))]
    days = sorted(row["judged"] for row in found["faults"].values() if "judged" in row)
    when = f"{len(days)} of {len(found['faults'])} on {days[0]} or later" if days else "no day is known"
    lines = [
        "# What the conformance kit finds",
        "",
        f"Printed by `python tests/mutants --table` from what is written down of kit {found['kit']}. A fault",
        "is a phase with one thing wrong (`tests/mutants`). Those of *built-in phases* are the faults",
        "against which the kit was made. Those in the other families were written from",
        "[the contract](../../docs/writing-a-broad-phase.md#the-contract) alone, before their checks. Each",
        f"was judged with the default budget by the check that kills it ({when}); one",
        "that lives, by checks of its family.",
        "`python tests/mutants --anew --write` judges all by all checks.",
        "",
        "| family | killed | faults | |",
        "|---|---|---|---|",
        *(f"| {family} | {killed} | {of} | {100 * killed // max(of, 1)} % |" for family, killed, of in rows),
        "",
        "## Faults that live",
        "",
        "`faults.json` of the kit has the check by which each of the others dies.",
        "",
        "| family | fault |",
        "|---|---|",
    ]
    faults = sorted(found["faults"].items(), key=lambda each: (each[1]["family"], each[0]))
    lines += [f"| {row['family']} | {name} |" for name, row in faults if row["killed_by"] is None]
    variations = found["variations"].items()
    full = [name for name, row in variations if row.get("by_all_checks")]
    lines += ["", "## Variations that are right", ""]
    lines += [
        f"Of {len(variations)} all checks have judged {len(full)} with the default budget, the others some."
    ]
    lines += ["", "| variation | all checks | condemned by |", "|---|---|---|"]
    lines += [
        f"| {name} | {'yes' if name in full else 'no'} | {_shown(row['condemned_by'], 'none')} |"
        for name, row in variations
    ]
    return "\n".join(lines) + "\n"


def _shown(check: str | None, none: str) -> str:
    return f"*{none}*" if check is None else f"`{check}`"


def main(*words: str) -> int:
    """Judges mutants and prints a line for each; returns the exit code, 1 if one is not as expected."""
    parser = argparse.ArgumentParser(prog="python tests/mutants", description="judge mutants by the kit")
    parser.add_argument("words", nargs="*", help="those whose names contain one of these; all")
    parser.add_argument("--family", action="append", help="those of this family; may be repeated")
    parser.add_argument("--check", action="append", help="by this check; may be repeated; else by its own")
    parser.add_argument("--anew", action="store_true", help="by all checks until one fails")

    parser.add_argument("--examples", type=int, help="scenes for each check")
    parser.add_argument("--json", type=Path, help="append a line for each; those that it has are not run")
    parser.add_argument("--write", action="store_true", help="write outcomes into faults.json of the kit")
    parser.add_argument("--table", action="store_true", help="print the page of the two tables")
    chosen = parser.parse_args(words)
    if chosen.table:
        print(table(), end="")
        return 0
    wrong = 0
    done = _lines_of(chosen.json)
    for name, line in done.items():
        if chosen.write and name in ALL:
            note(name, line["killed_by"], chosen.anew)
    for name, mutant in ALL.items():
        if not any(word in name for word in chosen.words or ("",)) or name in done:
            continue
        if chosen.family and mutant.family not in chosen.family:
            continue
        checks = chosen.check or (
            [each.name for each in kinetile_conformance.CHECKS] if chosen.anew else None
        )
        options = {key: value for key in ("examples",) if (value := getattr(chosen, key)) is not None}
        with tempfile.TemporaryDirectory() as folder:
            row, fine = _line(name, Path(folder), checks, options)
            wrong += not fine
            if chosen.write:
                note(name, row["killed_by"], chosen.anew)
        if chosen.json is not None:
            with chosen.json.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
    return int(wrong > 0)


def _line(
    name: str, folder: Path, checks: Sequence[str] | None, options: dict[str, Any]
) -> tuple[dict[str, Any], bool]:
    """Judges a mutant, and prints its line; returns its outcome, and True if it is as expected."""
    began = time.perf_counter()
    found = judge(name, folder, checks, shrink=False, explains=False, **options)
    fine = as_expected(name, found)
    killed = found.check if found is not None and found.status != "not judged" else None
    said = "spared" if ALL[name].right else "lives"
    if found is not None:
        said = f"{found.status} {found.check}: {(found.said or found.reason).splitlines()[0][:80]}"
    verdict = "ok   " if fine else "WRONG"
    print(f"{verdict} {name} ({time.perf_counter() - began:.0f} s): {said}", flush=True)
    return {"name": name, "family": ALL[name].family, "killed_by": killed}, fine


def _lines_of(path: Path | None) -> dict[str, dict[str, Any]]:
    if path is None or not path.is_file():
        return {}
    lines = map(json.loads, path.read_text(encoding="utf-8").splitlines())
    return {line["name"]: line for line in lines}
