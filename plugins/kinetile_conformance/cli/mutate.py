"""The command ``kinetile mutate``: changes a broad phase in one place at a time; lists what no check sees."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinetile.cli.options import Json, registered_phase
from kinetile.cli.output import as_json
from kinetile.cli.terminal import Bar, exit_codes, notice
from kinetile.errors import BadOption

if TYPE_CHECKING:
    from kinetile_conformance.mutation.campaign import Round
    from kinetile_conformance.mutation.findings import CampaignFile, Finding, Findings, Stage
    from kinetile_conformance.mutation.mutants import Mutant


SECONDS = 600.0
"""How long the author's tests may take on a mutant."""


def mutate(
    phases: Annotated[
        list[str],
        typer.Argument(
            metavar="NAME...",
            help="The broad phase; with options, also more than once: sap-1d sap-1d:axis=y. What survives "
            "with the first is judged with the next.",
        ),
    ],
    examples: Annotated[
        int,
        typer.Option(
            min=0, metavar="N", help="Scenes a check in the last round, which is compiled; 0: without it."
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
        bool, typer.Option("--compiled", help="Compile in all rounds: half a minute a mutant.")
    ] = False,
    also: Annotated[
        str | None,
        typer.Option(metavar="COMMAND", help="Run this on what survives, such as 'pytest -q tests'."),
    ] = None,
    record: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Keep what is found in this file, and go on from what is in it."),
    ] = None,
    minutes: Annotated[
        float | None, typer.Option(min=0.0, metavar="M", help="Stop after so many minutes by the clock.")
    ] = None,
    listing: Annotated[bool, typer.Option("--list", help="List the mutants; judge none.")] = False,
    json: Json = False,
) -> None:
    """Change a broad phase in one place at a time, and list the changes that no check of the kit sees."""
    with exit_codes():
        from kinetile_conformance.mutation.findings import CampaignFile, Findings, head_of
        from kinetile_conformance.mutation.mutants import equivalents_of, mutants_of, sample
        from kinetile_conformance.mutation.sources import source_of
        from kinetile_conformance.mutation.writing import try_tests

        name, options = _one_phase(phases)
        source = source_of(name)
        mutants = mutants_of(source, audits)
        chosen = sample(mutants, limit, seed, only)
        if listing:
            _print_mutants(chosen, json)
            return
        how = {"audits": audits, "compiled": compiled, "seed": seed}
        kept = CampaignFile(head_of(source, name, options, **how), mutants, record)
        findings = Findings(name, options, len(mutants), (), tuple(equivalents_of(source)))
        show = _CampaignPrinter(findings, chosen, json, kept, minutes)
        notice(f"judging {len(chosen)} of {len(mutants)} mutants of {' and '.join(phases)}")
        status = "complete"
        try:
            if also is not None:
                try_tests(also)
            show.judge(source, examples, compiled, seed, jobs)
            if also is not None:
                show.test(source, also)
        except _TimeIsUp:
            status = "stopped"
            notice(f"kinetile: stopped after {minutes:g} minutes")
        except KeyboardInterrupt:
            show.end("interrupted")
            raise
        show.end(status)


class _TimeIsUp(Exception):
    """The minutes are over."""


def _one_phase(texts: list[str]) -> tuple[str, list[dict[str, Any]]]:
    """Return the name of the one phase that is meant, and the options with which it is to be judged."""
    found = [registered_phase(text) for text in texts]
    names = list(dict.fromkeys(name for name, _ in found))
    if len(names) > 1:
        raise BadOption(
            f"one phase at a time is changed, with one or several options; found {', '.join(names)}"
        )
    return names[0], [options for _, options in found]


class _CampaignPrinter:
    """Judges mutants, and prints what is known when that ends, one way or the other."""

    def __init__(
        self,
        findings: Findings,
        chosen: list[Mutant],
        json: bool,
        record: CampaignFile,
        minutes: float | None,
    ) -> None:
        self.findings = findings
        self.left = chosen
        self._found: dict[int, Finding] = {}
        self._json = json
        self._record = record
        self._until = math.inf if minutes is None else time.monotonic() + 60.0 * minutes

    def judge(self, source: Any, examples: int, compiled: bool, seed: int, jobs: int) -> None:
        """Judge the mutants round by round, in each with all options, for as long as they survive."""
        from kinetile_conformance.mutation.campaign import rounds_of
        from kinetile_conformance.mutation.findings import Stage

        for number, how in enumerate(rounds_of(examples, compiled), 1):
            for place, options in enumerate(self.findings.options):
                if self.left:
                    self._judge(source, Stage(number, place, how.examples), options, how, seed, jobs)

    def _judge(
        self, source: Any, stage: Stage, options: Mapping[str, Any], how: Round, seed: int, jobs: int
    ) -> None:
        """Judge what is left in one round, with one choice of options, but for what is known already."""
        from kinetile.plugin.registry import registry
        from kinetile_conformance.mutation.campaign import campaign

        features = sorted(getattr(registry().spec("broad phase", self.findings.name), "features", ()))
        known = self._record.found(stage)
        numbers = {each.number for each in self.left}
        self._found |= {number: each for number, each in known.items() if number in numbers}
        fresh = [each for each in self.left if each.number not in known]
        words = "".join(f":{key}={value}" for key, value in options.items())
        before = f", {len(self.left) - len(fresh)} of them before" if len(fresh) < len(self.left) else ""
        notice(
            f"round {stage.round}: {len(self.left)} mutants{before}, {how.examples} scenes a check, "
            f"{self.findings.name}{words} ..."
        )
        if fresh:
            with Bar(f"round {stage.round}") as bar:

                def found(finding: Finding) -> None:
                    self._found[finding.mutant.number] = finding
                    self._record.take(stage, finding)
                    count = len(self._record.found(stage))
                    alive = sum(each.fate == "survived" for each in self._record.found(stage).values())
                    bar.show(
                        min(count / len(self.left), 1.0),
                        f"{count} of {len(self.left)}, {alive} alive: {finding.mutant.label}",
                    )
                    if time.monotonic() > self._until:
                        raise _TimeIsUp

                tight = campaign(
                    source, features, options, fresh, how, seed=seed, jobs=jobs, on_finding=found
                )
            self._record.end(stage, tight)
        self.findings = replace(self.findings, tightness=self._record.tightness(stage))
        alive = (self._found[each.number] for each in self.left)
        self.left = [each.mutant for each in alive if each.fate == "survived"]

    def test(self, source: Any, command: str) -> None:
        """Run the author's tests on what survives."""
        from kinetile_conformance.mutation.writing import passes

        notice(f"{len(self.left)} mutants: {command} ...")
        with Bar("tests") as bar:
            for count, mutant in enumerate(self.left, 1):
                bar.show(count / len(self.left), f"{count} of {len(self.left)}: {mutant.label}")
                if not passes(source, mutant, command, SECONDS):
                    was = self._found[mutant.number]
                    self._found[mutant.number] = replace(was, fate="killed", check=command)

    def end(self, status: str) -> None:
        """Print what is known."""
        findings = replace(self.findings, found=tuple(self._found.values()))
        if self._json:
            from kinetile.versions import versions

            typer.echo(as_json({"status": status, "versions": versions()} | findings.as_dict()))
            return
        from kinetile.cli.output import empty_table, show

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
