"""The commands ``conform``, ``replay`` and ``new-plugin``: for authors of broad phases."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import typer

from kinetile.cli.commands.run import as_json
from kinetile.cli.folder import try_folder
from kinetile.cli.terminal import DIFFERENT, exit_codes, notice
from kinetile.errors import BadOption
from kinetile.plugin.choices import read_phase

if TYPE_CHECKING:
    from kinetile.conformance.report import Report, Result

__all__ = ["Trial", "conform", "create_plugin", "replay"]


class Trial(NamedTuple):
    """What was asked for on the command line of ``kinetile conform``."""

    phase: str
    examples: int
    checks: Sequence[str]
    expected: Sequence[str]
    save_to: Path
    shrink: bool
    seed: int
    isolated: bool
    json: bool


def conform(trial: Trial) -> None:
    """Judge a phase and print each result as it comes; raises typer.Exit with the report's exit code."""
    with exit_codes():
        name, options = _phase(trial.phase)
        checks = [_check(each) for each in trial.checks]
        expected = dict(map(_expectation, trial.expected))
        try_folder("--save-to", trial.save_to, keep=False)
        show = _Show(name, options, trial.json)
        notice(f"judging {trial.phase} on {trial.examples} scenes a check{_compiling()} ...")
        try:
            report = _door(trial.isolated)(
                name,
                options=options,
                examples=trial.examples,
                checks=checks or None,
                expected_failures=expected,
                save_to=trial.save_to,
                shrink=trial.shrink,
                seed=trial.seed,
                on_result=show.result,
            )
        except KeyboardInterrupt:
            show.end(show.unfinished, "interrupted")
            raise
        show.end(replace(report, results=show.unfinished.results), "complete")
    if report.exit_code:
        raise typer.Exit(report.exit_code)


def _compiling() -> str:
    """Return what makes the first check slow, where loops are compiled."""
    from kinetile.kernel.compiled import INTERPRETED

    return "" if INTERPRETED else "; a loop that is not compiled yet is compiled first (about 10 s each)"


def _door(isolated: bool) -> Any:
    """Return the function that judges: in processes of its own, or in this one."""
    from kinetile.conformance import check_broad_phase

    if isolated:
        from kinetile.conformance.isolation import check_isolated

        return check_isolated
    return check_broad_phase


class _Show:
    """Prints a report as it comes into being."""

    def __init__(self, name: str, options: dict[str, Any], json: bool) -> None:
        from kinetile.conformance import CHECKS, Report
        from kinetile.plugin.registry import registry

        owner = registry().provided("broad phase", name)
        source = f"{owner.distribution or 'this process'} {owner.version or ''}".strip()
        self.unfinished: Report = Report(name, options, source, ())
        self._json = json
        self._wide = max(len(check.name) for check in CHECKS)
        if not json:
            typer.echo(f"{self.unfinished.head}\n")

    def result(self, result: Result) -> None:
        """Print a result; files are named as seen from here."""
        shown = replace(result, case=_from_here(result.case), picture=_from_here(result.picture))
        self.unfinished = replace(self.unfinished, results=(*self.unfinished.results, shown))
        if not self._json:
            typer.echo("\n".join(self.unfinished.lines(shown, self._wide)))

    def end(self, report: Report, status: str) -> None:
        """Print what stands below the results, or all of it as JSON."""
        if self._json:
            from kinetile.records.versions import versions

            found = {"status": status, "versions": versions()} | report.as_dict()
            typer.echo(as_json(found if status == "complete" else found | {"conforms": None}))
        elif status == "complete":
            typer.echo(f"\n{report.foot}")


def _from_here(path: Path | None) -> Path | None:
    """Return a path in the working folder as relative to it, and any other as it is."""
    here = Path.cwd()
    return path.relative_to(here) if path is not None and path.is_relative_to(here) else path


def replay(phase: str, file: Path, check: str | None, json: bool) -> None:
    """Run a case again and print what comes of it; raises typer.Exit(DIFFERENT) if it still fails."""
    with exit_codes():
        from kinetile.conformance.replay import replay as judge

        name, options = _phase(phase)
        result = judge(name, file, check=check, options=options)
    if json:
        from kinetile.records.versions import versions

        row: dict[str, Any] = {
            "broad_phase": name,
            "options": options,
            "check": result.check,
            "sentence": result.sentence,
            "file": str(file),
            "bodies": result.bodies,
            "fails": not result.ok,
            "said": result.said or None,
            "verdict": result.verdict or None,
            "versions": versions(),
        }
        typer.echo(as_json(row))
    else:
        bodies = f"{result.bodies} {'body' if result.bodies == 1 else 'bodies'}"
        typer.echo(
            f"{'passes' if result.ok else 'still fails'}: {phase}, {result.check}, {file} ({bodies})\n"
            f"  {result.sentence}"
        )
        for line in [*result.said.splitlines(), *([f"verdict: {result.verdict}"] if result.verdict else [])]:
            typer.echo(f"  {line}")
    if not result.ok:
        raise typer.Exit(DIFFERENT)


def create_plugin(name: str, into: Path) -> None:
    """Write a new plugin's package and print what to do next."""
    with exit_codes():
        from kinetile.plugin.new_plugin import new_plugin

        folder = new_plugin(name, into)
    written = sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())
    typer.echo(f"{folder}: {', '.join(written)}")
    typer.echo("to make its broad phase known here, and judge it:")
    typer.echo(f"  cd {shlex.quote(str(folder))}\n  pip install -e '.[test]'\n  pytest")


def _phase(text: str) -> tuple[str, dict[str, Any]]:
    """Return a phase's name (not an alias) and options; raise UnknownName."""
    from kinetile.plugin.registry import registry

    name, options = read_phase(text)
    return registry().spec("broad phase", name).name, options


def _check(name: str) -> str:
    """Return the name of a check; raise BadOption where there is none of this name."""
    from kinetile.conformance import CHECKS
    from kinetile.errors import one_of

    known = [check.name for check in CHECKS]
    if name not in known:
        raise BadOption(f"there is no check {name!r}; expected {one_of(name, known)}")
    return name


def _expectation(text: str) -> tuple[str, str]:
    """Return the check and the reason of ``CHECK=REASON``."""
    check, equals, reason = text.partition("=")
    if not equals or not reason.strip():
        raise BadOption(f"--expect-failure {text!r}: expected CHECK=REASON, such as makes-progress='issue 7'")
    return _check(check.strip()), reason.strip()
