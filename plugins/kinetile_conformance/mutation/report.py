"""What came of the mutants: how many were killed, by what, and which were not."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from kinetile_conformance.mutation.mutants import Equivalent, Mutant

__all__ = ["CRASHED", "HANGS", "KILLED", "SURVIVED", "Finding", "Findings"]

KILLED, HANGS, CRASHED, SURVIVED = "killed", "hangs", "crashed", "survived"


@dataclass(frozen=True)
class Finding:
    """What came of one mutant.

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
    """What came of all; ``tightness`` is that of the phase as it is, where it was measured."""

    name: str
    options: Sequence[Mapping[str, Any]]
    mutants: int
    found: tuple[Finding, ...]
    equivalent: tuple[Equivalent, ...]
    tightness: float | None = None

    @property
    def survivors(self) -> list[Finding]:
        """Those that nothing has killed, from the top of the source to its end."""
        return sorted((f for f in self.found if f.fate == SURVIVED), key=lambda each: each.mutant.number)

    def counts(self) -> dict[str, int]:
        """Return how many there are of each fate, and by which check those were killed that were."""
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
        """Return the survivors for people, each with the lines that are changed, and what is equivalent."""
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
