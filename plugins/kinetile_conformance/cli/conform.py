"""The commands ``kinetile conform``, which judges a broad phase or a program, and ``kinetile replay``, which
runs one check again."""

from __future__ import annotations

import json as as_text
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinetile.cli.files import file_errors, try_folder
from kinetile.cli.options import Json, registered_phase
from kinetile.cli.output import as_json
from kinetile.cli.terminal import DIFFERENT, INTERRUPTED, Bar, FirstSignal, echo, notice
from kinetile.errors import BadOption
from kinetile_conformance.cli.options import (
    EXAMPLES,
    Answer,
    Ask,
    Checks,
    Examples,
    NarrowPhases,
    Seed,
    Within,
)

if TYPE_CHECKING:
    from kinetile_conformance.reporting import Report, Result


def _list(wanted: bool) -> None:
    """Print the table of strategies and observations, and end."""
    if wanted:
        from kinetile_conformance.checks import CHECKS, OTHERWISE, table

        for observation in dict.fromkeys(check.observation for check in CHECKS):
            echo(f"{observation.name}: {observation.sentence}.")
        rows = table(EXAMPLES)
        wide = max(len(strategy) for strategy, _, _ in rows)
        for strategy, count, name in rows:
            echo(f"{strategy:{wide}}  {count:4}  {name}")
        for observation, why in OTHERWISE.items():
            echo(f"{observation.name} on other scenes: {why}")
        raise typer.Exit()


def conform(
    phase: Annotated[
        str | None,
        typer.Argument(metavar="[NAME]", help="The broad phase, with options if need be: sap-1d:axis=y."),
    ] = None,
    command: Annotated[
        str | None,
        typer.Option(metavar="CMD", help="Judge this program instead, which is sent scenes over a pipe."),
    ] = None,
    ask: Ask = None,
    within: Within = None,
    scene_seconds: Annotated[
        float | None,
        typer.Option(metavar="S", help="Seconds that the program has for a line. [default: 10]"),
    ] = None,
    narrow_phase: NarrowPhases = None,
    response: Answer = None,
    examples: Examples = EXAMPLES,
    check: Checks = None,
    save_to: Annotated[
        Path, typer.Option(metavar="DIR", help="Where scenes that fail are saved, if there are any.")
    ] = Path("conformance-failures"),
    shrink: Annotated[bool, typer.Option(help="Look for the smallest scene that fails.")] = True,
    seed: Seed = 0,
    seconds: Annotated[
        float | None,
        typer.Option(
            metavar="S",
            help="CPU seconds for 100 scenes of a check, compiling apart. [default: 60; interpreted 600]",
        ),
    ] = None,
    isolated: Annotated[
        bool,
        typer.Option(
            "--isolated/--in-process",
            help="Judge in a process with limits, or in this one: for a debugger; endless loops go on.",
        ),
    ] = True,
    list_: Annotated[
        bool,
        typer.Option(
            "--list",
            callback=_list,
            is_eager=True,
            help="Print what draws scenes, how many by default, and the check that looks at them.",
        ),
    ] = False,
    json: Annotated[
        bool, typer.Option("--json", help="Print each result as a line of JSON, and the report as the last.")
    ] = False,
) -> None:
    """Judge a broad phase, alone or with a narrow phase, or a program over a pipe; exit code 1 if it does not
    conform, 3 if the reference itself is in doubt, 4 if it could not be judged."""
    if (phase is None) == (command is None):
        raise BadOption("expected the NAME of a broad phase or --command CMD, one of the two")
    of_phases = {
        "--narrow-phase": narrow_phase,
        "--response": response,
        "--seconds": seconds,
        "--in-process": None if isolated else True,
    }
    of_programs = {"--within": within, "--scene-seconds": scene_seconds}
    strange: dict[str, Any] = of_phases if command is not None else {"--ask": ask, **of_programs}
    for option, value in strange.items():
        if value is not None:
            raise BadOption(f"{option} is for {'--command' if command is None else 'broad phases'}")
    above_nought({"--seconds": seconds, "--scene-seconds": scene_seconds})
    if command is None:
        unfinished, judge = judge_of_phase(str(phase), narrow_phase or (), response, seconds, isolated)
    else:
        unfinished, judge = judge_of_program(command, ask or "contacts", within, scene_seconds)
    checks = [check_called(each, (ask or "contacts") if command is not None else "") for each in check or ()]
    try_folder("--save-to", save_to, keep=False)
    show = _ReportPrinter(unfinished, json)
    who = " with ".join([command or str(phase), *(narrow_phase or ()), *([response] if response else ())])
    notice(f"judging {who} on {examples:,} scenes a check{compiling_first()} ...")
    first = FirstSignal()
    try:
        with first:
            report = judge(
                examples=examples,
                checks=checks or None,
                save_to=save_to,
                shrink=shrink,
                seed=seed,
                on_result=show.result,
                on_scene=show.scene,
            )
    except KeyboardInterrupt:
        show.end(show.unfinished, "interrupted")
        notice(f"kinetile: interrupted{show.at}")
        raise typer.Exit(128 + first.number if first.number else INTERRUPTED) from None
    show.end(replace(report, results=show.unfinished.results), "complete")
    if report.exit_code:
        raise typer.Exit(report.exit_code)


def above_nought(numbers: Mapping[str, float | None]) -> None:
    """Raise BadOption unless the numbers of these options are above 0."""
    for option, value in numbers.items():
        if value is not None and not 0.0 < value < math.inf:
            raise BadOption(f"{option} {value:g}: expected a number above 0")


def judge_of_phase(
    phase: str,
    narrow_phase: Sequence[str],
    response: str | None,
    seconds: float | None,
    isolated: bool,
) -> tuple[Report, Callable[..., Report]]:
    """Return the report without results on a broad phase, and what judges it."""
    from kinetile.scene import Response
    from kinetile_conformance import check_broad_phase
    from kinetile_conformance.runner import Plan

    name, options = registered_phase(phase)
    answer, with_options = registered_phase(response, "response") if response else ("", {})
    given: dict[str, Any] = {
        "options": options,
        "narrow_phases": dict(registered_phase(each, "narrow phase") for each in narrow_phase),
        "response": Response(answer, **with_options) if response else None,
        "seconds": seconds,
        "in_process": not isolated,
    }
    return Plan.of(name, given).report(()), partial(check_broad_phase, name, **given)


def judge_of_program(
    command: str, ask: str, within: float | None, seconds: float | None
) -> tuple[Report, Callable[..., Report]]:
    """Return the report without results on a program, and what judges it."""
    from kinetile.errors import one_of
    from kinetile_conformance import check_engine  # says which extra is missing
    from kinetile_conformance.pipe import SECONDS, EngineReport
    from kinetile_conformance.questions import QUESTIONS

    above_nought({"--within": within})
    if ask not in QUESTIONS:
        raise BadOption(f"--ask {ask}: expected {one_of(ask, QUESTIONS)}")
    if ask == "casts" and within is None:
        raise BadOption("--ask casts needs --within D, the distance within which a time is right")
    if ask == "pairs" and within is not None:
        raise BadOption("--within is for times: whether two bodies touch is decided exactly")
    judge = partial(check_engine, command, asked=ask, within=within, seconds=seconds or SECONDS)
    return EngineReport(command, {}, "", (), asked=ask, within=within), judge


def compiling_first() -> str:
    """Return what comes first, where loops are compiled."""
    from kinetile.kernel.compiled import INTERPRETED

    return "" if INTERPRETED else "; loops that are not compiled yet are compiled first (about 10 s each)"


class _ReportPrinter:
    """Prints a report as it comes into being."""

    def __init__(self, unfinished: Report, json: bool) -> None:
        from kinetile_conformance import CHECKS

        self.unfinished = unfinished
        self._json = json
        self._wide = max(len(check.name) for check in CHECKS)
        if not json:
            echo(f"{self.unfinished.head}\n")
        self.at = ""
        self._bar = Bar("judging")

    def scene(self, check: str, count: int) -> None:
        """Show how far a check is, on a terminal."""
        self.at = f" in {check}, at scene {count:,}"
        self._bar.show(None, f"{check}: {count:,} scenes")

    def result(self, result: Result) -> None:
        """Print a result; files are named as seen from here."""
        self.at = ""
        self._bar.close()
        shown = replace(result, case=_from_here(result.case))
        others = [each for each in self.unfinished.results if each.check != shown.check]
        self.unfinished = replace(self.unfinished, results=(*others, shown))
        if self._json:
            _line({"result": self.unfinished.row(shown)})
        else:
            echo("\n".join(self.unfinished.lines(shown, self._wide)))

    def end(self, report: Report, status: str) -> None:
        """Print the lines below the results, or all of it as a line of JSON."""
        self._bar.close()
        if self._json:
            from kinetile.versions import versions

            found = {"status": status, "versions": versions()} | report.as_dict()
            _line(found if status == "complete" else found | {"conforms": None})
        elif status == "complete":
            echo(f"\n{report.foot}")


def _line(row: dict[str, Any]) -> None:
    """Print a line of JSON at once."""
    echo(as_text.dumps(row, allow_nan=False, default=str))


def _from_here(path: Path | None) -> Path | None:
    """Return a path in the working folder as relative to it, and any other as it is."""
    here = Path.cwd()
    return path.relative_to(here) if path is not None and path.is_relative_to(here) else path


def check_called(name: str, asked: str = "") -> str:
    """Return the name of a check, or of one that asks a program so; raise BadOption where there is none of
    this name."""
    from kinetile.errors import one_of
    from kinetile_conformance import CHECKS

    known = [check.name for check in CHECKS]
    if asked:
        from kinetile_conformance.pipe import JUDGING

        known = [each for each, judging in JUDGING.items() if judging.asked == asked]
    if name not in known:
        raise BadOption(f"there is no check {name!r}; expected {one_of(name, known)}")
    return name


def replay(
    phase: Annotated[str, typer.Argument(metavar="NAME", help="The broad phase.")],
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A scene file, such as `conform` saves.")],
    check: Annotated[
        str | None,
        typer.Option(metavar="CHECK", help="The check; the one that the file names, or same-contacts."),
    ] = None,
    json: Json = False,
) -> None:
    """Run a check on a saved scene again; exit code 1 if it still fails."""
    from kinetile_conformance import Report
    from kinetile_conformance.api import replay as judge

    name, options = registered_phase(phase)
    with file_errors(str(file)):
        result = judge(name, file, check=check, options=options)
    if json:
        from kinetile.versions import versions

        row: dict[str, Any] = {"broad_phase": name, "options": options, "file": str(file)}
        echo(as_json(row | {"fails": not result.ok, "versions": versions()} | Report.row(result)))
    else:
        bodies = f"{result.bodies} {'body' if result.bodies == 1 else 'bodies'}"
        echo(
            f"{'passes' if result.ok else 'still fails'}: {phase}, {result.check}, {file} ({bodies})\n"
            f"  {result.sentence}"
        )
        for line in [*result.said.splitlines(), *([f"verdict: {result.verdict}"] if result.verdict else [])]:
            echo(f"  {line}")
    if not result.ok:
        raise typer.Exit(DIFFERENT)
