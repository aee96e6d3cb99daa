"""Findings: the fate of each mutant, the number of each fate, and the file that keeps them.

A campaign that was ended goes on where it was. Its file is JSON Lines: the first names the phase, its
options, a digest of its source, and how it is judged; each further one is the fate of a mutant in a round,
written as soon as it is known.
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from kinetile.errors import BadOption
from kinetile_conformance.mutation.mutants import Equivalent, Mutant
from kinetile_conformance.mutation.sources import PhaseSource

KILLED, HANGS, CRASHED, SURVIVED = "killed", "hangs", "crashed", "survived"


@dataclass(frozen=True)
class Finding:
    """The finding on one mutant.

    ``fate`` is one of killed (by ``check``), hangs (in ``check``), crashed, survived; ``said`` is what the
    check saw; ``tightness`` is, of a survivor, how many candidate pairs it has for each overlap of boxes.
    """

    mutant: Mutant
    fate: str
    check: str = ""
    said: str = ""
    cpu: float = 0.0
    tightness: float | None = None

    @classmethod
    def of(cls, mutant: Mutant, row: Mapping[str, Any]) -> Finding:
        """Return what ``as_dict`` was made of."""
        return cls(mutant, row["fate"], row["check"], row["said"], row["cpu_seconds"], row["tightness"])

    def as_dict(self) -> dict[str, Any]:
        """Return it, fit for JSON."""
        return {
            "number": self.mutant.number,
            "label": self.mutant.label,
            "operator": self.mutant.change.operator,
            "before": list(self.mutant.before),
            "after": list(self.mutant.after),
            "fate": self.fate,
            "check": self.check,
            "said": self.said,
            "cpu_seconds": self.cpu,
            "tightness": self.tightness,
        }


@dataclass(frozen=True)
class Findings:
    """All findings; ``tightness`` is that of the phase as it is, where it was measured."""

    name: str
    options: Sequence[Mapping[str, Any]]
    mutants: int
    found: tuple[Finding, ...]
    equivalent: tuple[Equivalent, ...]
    tightness: float | None = None

    @property
    def survivors(self) -> list[Finding]:
        """The mutants that nothing has killed, from the top of the source to its end."""
        return sorted((f for f in self.found if f.fate == SURVIVED), key=lambda each: each.mutant.number)

    def counts(self) -> dict[str, int]:
        """Return the number of mutants of each fate, and of those killed by each check."""
        by_check = Counter(each.check for each in self.found if each.fate == KILLED)
        rows = {f"killed by {check}": count for check, count in by_check.most_common()}
        fates = Counter(each.fate for each in self.found)
        return rows | {fate: fates[fate] for fate in (HANGS, CRASHED, SURVIVED)}

    def as_dict(self) -> dict[str, Any]:
        """Return all of it, fit for JSON."""
        return {
            "broad_phase": self.name,
            "options": [dict(each) for each in self.options],
            "mutants": self.mutants,
            "judged": len(self.found),
            "counts": self.counts(),
            "tightness": self.tightness,
            "survivors": [each.as_dict() for each in self.survivors],
            "found": [each.as_dict() for each in sorted(self.found, key=lambda f: f.mutant.number)],
            "equivalent": [vars(each) for each in self.equivalent],
        }

    def lines(self) -> list[str]:
        """Return lines of text on the survivors, each with its changed lines, and on what is equivalent."""
        said = []
        for each in self.survivors:
            loose = each.tightness is not None and each.tightness != self.tightness
            pairs = (
                f"  ({each.tightness:.2f} pairs an overlap, not {self.tightness:.2f})"
                if loose and self.tightness
                else ""
            )
            said += [f"survived  #{each.mutant.number} {each.mutant.label}{pairs}"]
            said += [f"    {line}" for line in each.mutant.diff]
        for line in self.equivalent:
            said.append(f"equivalent  {line.place}:{line.line}: {line.reason or 'no reason is given'}")
        return said


class Stage(NamedTuple):
    """Which round it is, from 1, which of the options that the phase is judged with, from 0, and how many
    scenes a check has."""

    round: int
    options: int
    examples: int


def head_of(
    phase: PhaseSource, name: str, options: Sequence[Mapping[str, Any]], **how: Any
) -> dict[str, Any]:
    """Return the first line of a campaign's file."""
    texts = "\0".join(f"{each.module}\0{each.text}" for each in phase.modules)
    digest = hashlib.sha256(texts.encode()).hexdigest()[:16]
    return {"broad_phase": name, "options": [dict(each) for each in options], "source": digest} | how


class CampaignFile:
    """The findings of a campaign, by stage; with a path, those of the file of that name as well.

    Args:
        head: what is judged, as ``head_of`` says it.
        mutants: all mutants of the phase.
        path: the file, made where there is none; None: nothing is kept.

    Raises:
        BadOption: the file is the record of something else, or none, or cannot be written.
    """

    def __init__(self, head: Mapping[str, Any], mutants: Sequence[Mutant], path: Path | None = None) -> None:
        self._path = path
        self._found: dict[Stage, dict[int, Finding]] = {}
        self._tightness: dict[Stage, float | None] = {}
        if path is None:
            return
        try:
            lines = path.read_text(encoding="utf-8").splitlines(keepends=True) if path.exists() else []
            whole = [line for line in lines if line.endswith("\n")]  # the last one may have been cut off
            rows = [json.loads(line) for line in whole] or [dict(head)]
            if rows[0] != head:
                odd = [
                    name for name in head if not isinstance(rows[0], dict) or rows[0].get(name) != head[name]
                ]
                raise BadOption(
                    f"{path} is not the record of this: it differs in {', '.join(odd) or 'more'}; expected "
                    "the same phase, options, source and seed, or another file"
                )
            path.write_text("".join(whole) or f"{json.dumps(dict(head))}\n", encoding="utf-8")
        except (OSError, ValueError) as error:
            raise BadOption(f"{path} cannot be used as a record: {error}") from error
        known = {each.number: each for each in mutants}
        for row in rows[1:]:
            stage = Stage(row["round"], row["as"], row["examples"])
            if "number" in row:
                self._keep(stage, Finding.of(known[row["number"]], row))
            else:
                self._tightness[stage] = row["tightness"]

    def found(self, stage: Stage) -> dict[int, Finding]:
        """Return what is known of a stage, by the numbers of the mutants."""
        return dict(self._found.get(stage, {}))

    def tightness(self, stage: Stage) -> float | None:
        """Return the over-reporting of the phase itself, as a stage has measured it."""
        return self._tightness.get(stage)

    def take(self, stage: Stage, finding: Finding) -> None:
        """Keep the finding on a mutant."""
        self._keep(stage, finding)
        self._write(stage, finding.as_dict())

    def end(self, stage: Stage, tightness: float | None) -> None:
        """Keep the over-reporting of the phase itself."""
        self._tightness[stage] = tightness
        self._write(stage, {"tightness": tightness})

    def _keep(self, stage: Stage, finding: Finding) -> None:
        self._found.setdefault(stage, {})[finding.mutant.number] = finding

    def _write(self, stage: Stage, row: Mapping[str, Any]) -> None:
        if self._path is not None:
            head = {"round": stage.round, "as": stage.options, "examples": stage.examples}
            with self._path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(head | dict(row)) + "\n")
