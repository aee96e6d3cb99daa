"""The command ``kinetile mutate``: changes a broad phase in one place at a time; lists what no check sees."""

from __future__ import annotations

import hashlib
import json as json_
import os
import sys
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinetile.cli.options import Json, registered_phase
from kinetile.cli.output import as_json, empty_table, show
from kinetile.cli.terminal import Bar, echo, exit_codes, notice
from kinetile.errors import BadOption, Refused
from kinetile.plugin.registry import registry

if TYPE_CHECKING:
    from kinetile_conformance.mutation.mutants import Mutant

SECONDS = 600.0
"""How long the author's tests may take on a mutant."""

Row = dict[str, Any]


def mutate(
    phase: Annotated[str, typer.Argument(metavar="NAME", help="The broad phase, such as sap-1d:axis=y.")],
    examples: Annotated[int, typer.Option(min=1, metavar="N", help="Scenes a check.")] = 10,
    compiled: Annotated[
        bool, typer.Option("--compiled", help="All checks, compiled: a minute for each that survives.")
    ] = False,
    limit: Annotated[int | None, typer.Option(min=1, metavar="N", help="So many mutants, by lot.")] = None,
    seed: Annotated[int, typer.Option(metavar="N", help="What drawing scenes and lots begins with.")] = 0,
    only: Annotated[
        str, typer.Option(metavar="TEXT", help="Mutants with this in their label: a file, a line, a kind.")
    ] = "",
    jobs: Annotated[int, typer.Option(min=1, metavar="N", help="Mutants at a time.")] = 1,
    also: Annotated[
        str | None,
        typer.Option(metavar="COMMAND", help="Run this on what survives, such as 'pytest -q tests'."),
    ] = None,
    record: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Keep what is found in this file, and judge what survives in it."),
    ] = None,
    listing: Annotated[bool, typer.Option("--list", help="List the mutants; judge none.")] = False,
    json: Json = False,
) -> None:
    """Change a broad phase in one place at a time, and list the changes that no check of the kit sees."""
    with exit_codes():
        from kinetile.kernel.compiled import INTERPRETED
        from kinetile_conformance.mutation.mutants import mutants_of, sample, source_of

        name, options = registered_phase(phase)
        source = source_of(name)
        every = mutants_of(source)
        mutants = sample(every, limit, seed, only)
        if listing:
            echo(as_json([m.as_dict() for m in mutants]) if json else "\n".join(map(_shown, mutants)))
            return
        if not hasattr(os, "fork"):
            raise Refused("mutants are judged in processes that are forked, which this system cannot do")
        if compiled == INTERPRETED:
            variables = os.environ | {"NUMBA_DISABLE_JIT": str(int(not compiled))}
            os.execve(sys.executable, [sys.executable, "-m", "kinetile", *sys.argv[1:]], variables)
        from kinetile_conformance.mutation.judging import KILLED, SURVIVED, Campaign, passes

        text = "\0".join(f"{each.module}\0{each.text}" for each in source.reached)
        digest = hashlib.sha256(text.encode()).hexdigest()[:16]
        found = _Found({"broad_phase": name, "source": digest, "mutants": len(every)}, record)
        how = {"options": dict(options), "compiled": compiled, "examples": examples, "seed": seed}
        alive = [each for each in mutants if found.fate(each.number) in ("", SURVIVED)]
        fresh = [
            each for each in alive if not any(how.items() <= row.items() for row in found.of(each.number))
        ]
        notice(f"judging {len(fresh)} of {len(every)} mutants of {phase}")
        features = sorted(getattr(registry().spec("broad phase", name), "features", ()))
        judged = Campaign(source, features, options, examples=examples, seed=seed, jobs=jobs).judge(fresh)
        named = {each.number: each for each in mutants}
        try:
            if also is not None and not passes(None, also):
                raise BadOption(f"--also {also!r} fails on the phase as it is; expected exit code 0")
            with Bar("mutants") as bar:
                for count, row in enumerate(judged if fresh else (), 1):
                    mutant = named[row["number"]]
                    found.take(mutant.as_dict() | row | how)
                    bar.show(count / len(fresh), f"{count} of {len(fresh)}: {mutant.label} {row['fate']}")
            for mutant in mutants if also is not None else ():
                if also is not None and found.fate(mutant.number) == SURVIVED:
                    notice(f"{mutant.label}: {also} ...")
                    if not passes(mutant, also, SECONDS):
                        found.take(mutant.as_dict() | {"fate": KILLED, "check": also})
        except KeyboardInterrupt:
            found.show(named, "interrupted", json)
            raise
        found.show(named, "complete", json)


def _shown(mutant: Mutant) -> str:
    """Return a mutant's label and lines."""
    lines = [*(f"    - {line}" for line in mutant.before), *(f"    + {line}" for line in mutant.after)]
    return "\n".join([f"#{mutant.number} {mutant.label}", *lines])


class _Found:
    """What came of mutants, in rows; with a path, kept in that file.

    The file is JSON Lines: the first says what is judged, each further one is a row, written as soon as it is
    known. Raises BadOption where the file is the record of something else, or cannot be used.
    """

    def __init__(self, head: Row, path: Path | None) -> None:
        self._head, self._path = head, path
        self._rows: list[Row] = []
        if path is None:
            return
        try:
            lines = path.read_text(encoding="utf-8").splitlines(keepends=True) if path.exists() else []
            whole = [line for line in lines if line.endswith("\n")]  # the last one may have been cut off
            first, *self._rows = [json_.loads(line) for line in whole] or [head]
            if first != head:
                raise BadOption(f"{path} is not the record of this: it is of {first}; expected {head}")
            path.write_text("".join(whole) or f"{json_.dumps(head)}\n", encoding="utf-8")
        except (OSError, ValueError) as error:
            raise BadOption(f"{path} cannot be used as a record: {error}") from error

    def of(self, number: int) -> list[Row]:
        """Return the rows of a mutant."""
        return [row for row in self._rows if row["number"] == number]

    def fate(self, number: int) -> str:
        """Return what has come of a mutant last; "": it has not been judged."""
        return next((str(row["fate"]) for row in reversed(self.of(number))), "")

    def take(self, row: Row) -> None:
        """Keep a row."""
        self._rows.append(row)
        if self._path is not None:
            with self._path.open("a", encoding="utf-8") as file:
                file.write(f"{json_.dumps(row)}\n")

    def show(self, mutants: dict[int, Mutant], status: str, json: bool) -> None:
        """Print what is known of these mutants."""
        rows = [self.of(number)[-1] for number in mutants if self.of(number)]
        fates = [f"killed by {row['check']}" if row["fate"] == "killed" else row["fate"] for row in rows]
        counts = Counter(fates).most_common()
        survivors = [row for row in rows if row["fate"] == "survived"]
        if json:
            known = {"status": status, "judged": len(rows), "counts": dict(counts), "survivors": survivors}
            echo(as_json(self._head | known | {"found": rows}))
            return
        table = empty_table("| fate", "> mutants")
        for fate, count in counts:
            table.add_row(fate, f"{count:,}")
        show(table, "")
        for row in survivors:
            show(f"survived  {_shown(mutants[row['number']])}")
        show(f"{len(rows)} of {self._head['mutants']} mutants judged, {len(survivors)} survived")
