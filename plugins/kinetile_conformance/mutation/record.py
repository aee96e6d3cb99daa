"""What has been found so far, in a file: a campaign that was ended goes on where it was.

The file is JSON Lines. The first says what is judged: the phase, with which options, a digest of its source,
and how. Each further one is what came of a mutant in a round, written as soon as it is known.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from kinetile.errors import BadOption
from kinetile_conformance.mutation.mutants import Mutant
from kinetile_conformance.mutation.report import Finding
from kinetile_conformance.mutation.sources import PhaseSource

__all__ = ["Record", "Stage", "head_of"]


class Stage(NamedTuple):
    """Which round it is, from 1, which of the options that the phase is judged with, from 0, and how many
    scenes a check has."""

    round: int
    options: int
    examples: int


def head_of(
    phase: PhaseSource, name: str, options: Sequence[Mapping[str, Any]], **how: Any
) -> dict[str, Any]:
    """Return what the first line of a record says."""
    texts = "\0".join(f"{each.module}\0{each.text}" for each in phase.modules)
    digest = hashlib.sha256(texts.encode()).hexdigest()[:16]
    return {"broad_phase": name, "options": [dict(each) for each in options], "source": digest} | how


class Record:
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
        """Return how much the phase itself over-reports, as a stage has measured it."""
        return self._tightness.get(stage)

    def take(self, stage: Stage, finding: Finding) -> None:
        """Note what came of a mutant."""
        self._keep(stage, finding)
        self._write(stage, finding.as_dict())

    def end(self, stage: Stage, tightness: float | None) -> None:
        """Note how much the phase itself over-reports."""
        self._tightness[stage] = tightness
        self._write(stage, {"tightness": tightness})

    def _keep(self, stage: Stage, finding: Finding) -> None:
        self._found.setdefault(stage, {})[finding.mutant.number] = finding

    def _write(self, stage: Stage, row: Mapping[str, Any]) -> None:
        if self._path is not None:
            head = {"round": stage.round, "as": stage.options, "examples": stage.examples}
            with self._path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(head | dict(row)) + "\n")
