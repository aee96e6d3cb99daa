"""The command ``kinetile mutate``: changes a broad phase in one place at a time; says what nobody notices."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinetile.cli.json_output import as_json
from kinetile.cli.options import Json, registered_phase
from kinetile.cli.terminal import Bar, exit_codes, notice

if TYPE_CHECKING:
    from kinetile.conformance.mutation import Finding, Findings, Mutant

__all__ = ["mutate"]

SECONDS = 600.0
"""How long the author's tests may take on a mutant."""


def mutate(
    phase: Annotated[
        str,
        typer.Argument(metavar="NAME", help="The broad phase, with options if need be: sap-1d:axis=y."),
    ],
    examples: Annotated[
        int,
        typer.Option(
            min=0, metavar="N", help="Scenes a check for what survives the first round; 0: only that."
        ),
    ] = 100,
    limit: Annotated[int | None, typer.Option(min=1, metavar="N", help="So many mutants, by lot.")] = None,
    seed: Annotated[int, typer.Option(metavar="N", help="What drawing scenes and lots begins with.")] = 0,
    only: Annotated[
        str, typer.Option(metavar="TEXT", help="Mutants with this in their label: a file, a line, a kind.")
    ] = "",
    jobs: Annotated[int, typer.Option(min=1, metavar="N", help="Processes side by side.")] = 1,
    audits: Annotated[bool, typer.Option("--audits", help="Change the phase's audit, too.")] = False,
    compiled: Annotated[
        bool, typer.Option("--compiled", help="Compile in the first round too: ten seconds a mutant.")
    ] = False,
    also: Annotated[
        str | None,
        typer.Option(metavar="COMMAND", help="Run this on what survives, such as 'pytest -q tests'."),
    ] = None,
    listing: Annotated[bool, typer.Option("--list", help="List the mutants; judge none.")] = False,
    json: Json = False,
) -> None:
    """Change a broad phase in one place at a time, and list the changes that no check of the kit sees."""
    with exit_codes():
        from kinetile.conformance.mutation import (
            Findings,
            equivalents_of,
            mutants_of,
            sample,
            source_of,
            try_tests,
        )

        name, options = registered_phase(phase)
        source = source_of(name)
        mutants = mutants_of(source, audits)
        chosen = sample(mutants, limit, seed, only)
        if listing:
            _print_mutants(chosen, json)
            return
        show = _Show(Findings(name, options, len(mutants), (), tuple(equivalents_of(source))), chosen, json)
        notice(f"judging {len(chosen)} of {len(mutants)} mutants of {phase}")
        try:
            if also is not None:
                try_tests(also)
            show.judge(source, examples, compiled, seed, jobs)
            if also is not None:
                show.test(source, also)
        except KeyboardInterrupt:
            show.end("interrupted")
            raise
        show.end("complete")


class _Show:
    """Judges mutants, and prints what is known when that ends, one way or the other."""

    def __init__(self, findings: Findings, chosen: list[Mutant], json: bool) -> None:
        self.findings = findings
        self.left = chosen
        self._found: dict[int, Finding] = {}
        self._all = len(chosen)
        self._json = json

    def judge(self, source: Any, examples: int, compiled: bool, seed: int, jobs: int) -> None:
        """Judge the mutants in one round, and what survives in a second."""
        from dataclasses import replace

        from kinetile.conformance.mutation import campaign, first_round, second_round
        from kinetile.plugin.registry import registry

        features = sorted(getattr(registry().spec("broad phase", self.findings.name), "features", ()))
        rounds = [first_round(compiled), *([second_round(examples)] if examples else [])]
        for number, how in enumerate(rounds, 1):
            if not self.left:
                return
            notice(f"round {number}: {len(self.left)} mutants, {how.examples} scenes a check ...")
            with Bar(f"round {number}") as bar:
                count = 0
                total = len(self.left)

                def found(finding: Finding, bar: Bar = bar, total: int = total) -> None:
                    nonlocal count
                    count += 1
                    self._found[finding.mutant.number] = finding
                    alive = sum(each.fate == "survived" for each in self._found.values())
                    bar.show(count / total, f"{count} of {total}, {alive} alive: {finding.mutant.label}")

                tight = campaign(
                    source,
                    features,
                    self.findings.options,
                    self.left,
                    how,
                    seed=seed,
                    jobs=jobs,
                    on_finding=found,
                )
            self.findings = replace(self.findings, tightness=tight)
            alive = (each.mutant for each in self._found.values() if each.fate == "survived")
            self.left = sorted(alive, key=lambda mutant: mutant.number)

    def test(self, source: Any, command: str) -> None:
        """Run the author's tests on what survives."""
        from dataclasses import replace

        from kinetile.conformance.mutation import passes

        notice(f"{len(self.left)} mutants: {command} ...")
        with Bar("tests") as bar:
            for count, mutant in enumerate(self.left, 1):
                bar.show(count / len(self.left), f"{count} of {len(self.left)}: {mutant.label}")
                if not passes(source, mutant, command, SECONDS):
                    was = self._found[mutant.number]
                    self._found[mutant.number] = replace(was, fate="killed", check=command)

    def end(self, status: str) -> None:
        """Print what is known."""
        from dataclasses import replace

        findings = replace(self.findings, found=tuple(self._found.values()))
        if self._json:
            from kinetile.records.versions import versions

            typer.echo(as_json({"status": status, "versions": versions()} | findings.as_dict()))
            return
        from kinetile.cli.tables import empty_table, show

        table = empty_table("| fate", "> mutants")
        for fate, count in findings.counts().items():
            table.add_row(fate, f"{count:,}")
        show(table, "", *findings.lines())
        show(
            f"{len(findings.found)} of {findings.mutants} mutants judged, {len(findings.survivors)} survived"
        )


def _print_mutants(mutants: list[Mutant], json: bool) -> None:
    """Print the mutants, each with its lines."""
    if json:
        rows = [{"number": m.number, "label": m.label, "before": m.before, "after": m.after} for m in mutants]
        typer.echo(as_json(rows))
        return
    for each in mutants:
        typer.echo("\n".join([f"#{each.number} {each.label}", *(f"    {line}" for line in each.diff)]))
