"""The command ``kinetile conform``: judges a broad phase."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinetile.cli.folder import try_folder
from kinetile.cli.json_output import as_json
from kinetile.cli.options import Json, registered_phase
from kinetile.cli.terminal import exit_codes, notice
from kinetile.errors import BadOption

if TYPE_CHECKING:
    from kinetile.conformance.report import Report, Result

__all__ = ["conform"]


def conform(
    phase: Annotated[
        str,
        typer.Argument(metavar="NAME", help="The broad phase, with options if need be: sap-1d:axis=y."),
    ],
    examples: Annotated[int, typer.Option(min=1, metavar="N", help="Scenes drawn for each check.")] = 100,
    check: Annotated[
        list[str] | None, typer.Option("--check", metavar="CHECK", help="Run this check, not all.")
    ] = None,
    expect_failure: Annotated[
        list[str] | None,
        typer.Option("--expect-failure", metavar="CHECK=REASON", help="A check that is known to fail."),
    ] = None,
    save_to: Annotated[
        Path, typer.Option(metavar="DIR", help="Where scenes that fail are saved, if there are any.")
    ] = Path("conformance-failures"),
    shrink: Annotated[bool, typer.Option(help="Look for the smallest scene that fails.")] = True,
    seed: Annotated[int, typer.Option(metavar="N", help="What the drawing of scenes begins with.")] = 0,
    isolated: Annotated[
        bool,
        typer.Option("--isolated/--in-process", help="Judge in processes with limits, or in this one."),
    ] = True,
    json: Json = False,
) -> None:
    """Judge a broad phase; exit code 1 if it does not conform, 3 if the reference itself is in doubt."""
    with exit_codes():
        name, options = registered_phase(phase)
        checks = [_check(each) for each in check or ()]
        expected = dict(map(_expectation, expect_failure or ()))
        try_folder("--save-to", save_to, keep=False)
        show = _Show(name, options, json)
        notice(f"judging {phase} on {examples} scenes a check{_compiling()} ...")
        try:
            report = _door(isolated)(
                name,
                options=options,
                examples=examples,
                checks=checks or None,
                expected_failures=expected,
                save_to=save_to,
                shrink=shrink,
                seed=seed,
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
