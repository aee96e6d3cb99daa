"""The commands ``kinetile conform`` (a broad phase or a program), ``kinetile judge`` (several, side by side)
and ``kinetile replay`` (one check)."""

from __future__ import annotations

import json as as_text
import math
import shlex
import sys
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinetile.cli.files import check_new, file_errors, try_folder
from kinetile.cli.options import Json, NarrowPhases, Repeats, argument, flag, option, registered_phase
from kinetile.cli.output import as_json
from kinetile.cli.terminal import DIFFERENT, INTERRUPTED, Bar, FirstSignal, echo, notice
from kinetile.errors import BadOption

if TYPE_CHECKING:
    from kinetile_conformance.judging import Judged
    from kinetile_conformance.reporting import Result


EXAMPLES = 100
"""Scenes drawn for each check; ``runner.EXAMPLES``, without what that imports."""

Ask = Annotated[
    str | None,
    option(
        ("Of programs: contacts of a run, pairs that may touch, or casts of two bodies. [default: contacts]"),
        "WHAT",
    ),
]
Within = Annotated[float | None, option("Of programs: times to a relative distance, in place of ticks.", "D")]
Examples = Annotated[int, option("Scenes drawn for each check.", "N", least=1)]
Checks = Annotated[list[str] | None, option("Run this check, not all.", "CHECK", "--check")]
Seed = Annotated[int, option("What the drawing of scenes begins with.", "N")]
Answer = Annotated[str | None, option("A response to judge with it; with options if need be.", "NAME")]


def _list(wanted: bool) -> None:
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
        str | None, argument("The broad phase, with options if need be: sap-1d:axis=y.", "[NAME]")
    ] = None,
    command: Annotated[
        str | None, option("Judge this program instead, which is sent scenes over a pipe.", "CMD")
    ] = None,
    ask: Ask = None,
    within: Within = None,
    scene_seconds: Annotated[
        float | None, option("Seconds that the program has for a line. [default: 10]", "S")
    ] = None,
    narrow_phase: NarrowPhases = None,
    response: Answer = None,
    examples: Examples = EXAMPLES,
    check: Checks = None,
    save_to: Annotated[Path, option("Where scenes that fail are saved, if there are any.", "DIR")] = Path(
        "conformance-failures"
    ),
    shrink: Annotated[bool, flag("Look for the smallest scene that fails.")] = True,
    seed: Seed = 0,
    seconds: Annotated[
        float | None,
        option("CPU seconds for 100 scenes of a check, compiling apart. [default: 60; interpreted 600]", "S"),
    ] = None,
    isolated: Annotated[
        bool,
        flag(
            "Judge in a process with limits, or in this one: for a debugger; endless loops go on.",
            "--isolated/--in-process",
        ),
    ] = True,
    list_: Annotated[
        bool,
        flag(
            "Print what draws scenes, how many by default, and the check that looks at them.",
            "--list",
            callback=_list,
            is_eager=True,
        ),
    ] = False,
    json: Annotated[
        bool, flag("Print each result as a line of JSON, and the report as the last.", "--json")
    ] = False,
) -> None:
    """Judge a broad phase, alone or with a narrow phase, or a program over a pipe; exit code 1 if it does not
    conform, 3 if the reference itself is in doubt, 4 if it could not be judged.

    For example: kinetile conform cells --examples 20
    """
    if (phase is None) == (command is None):
        raise BadOption("expected the NAME of a broad phase or --command CMD, one of the two")
    of_phases = {"--narrow-phase": narrow_phase, "--response": response, "--seconds": seconds}
    of_phases["--in-process"] = None if isolated else True
    of_programs = {"--ask": ask, "--within": within, "--scene-seconds": scene_seconds}
    named = [phase] if phase is not None else [], [command] if command is not None else []
    (judged,), checks = to_judge(*named, check, of_phases, of_programs)
    try_folder("--save-to", save_to, keep=False)
    from kinetile_conformance import CHECKS

    first, bar, at, status = FirstSignal(), Bar("judging"), "", "complete"
    wide = max(len(each.name) for each in CHECKS)

    def tell_scene(name: str, count: int) -> None:
        nonlocal at
        first.check()
        at = f" in {name}, at scene {count:,}"
        bar.show(None, f"{name}: {count:,} scenes")

    def tell_result(result: Result) -> None:
        nonlocal at
        at = ""
        bar.close()
        if json:
            _line({"result": judged.report.row(result)})
        else:
            for line in judged.report.lines(result, wide):
                echo(line)

    if not json:
        echo(f"{judged.report.head}\n")
    who = " with ".join([judged.report.label, *judged.report.subject.beside])
    notice(f"judging {who} on {examples:,} scenes a check{compiling_first()} ...")
    how: dict[str, Any] = {"examples": examples, "checks": checks, "save_to": save_to, "shrink": shrink}
    try:
        with first, bar:
            judged.run(tell_result, on_scene=tell_scene, seed=seed, **how)
    except KeyboardInterrupt:
        status = "interrupted"
    if json:
        from kinetile.instruments import versions

        conforms = {"conforms": judged.report.conforms if status == "complete" else None}
        _line({"status": status, "versions": versions()} | judged.report.as_dict() | conforms)
    elif status == "complete":
        echo(f"\n{judged.report.foot}")
    if status != "complete":
        notice(f"kinetile: interrupted{at}")
        raise typer.Exit(128 + first.number if first.number else INTERRUPTED)
    if judged.report.exit_code:
        raise typer.Exit(judged.report.exit_code)


def _check_options(of_phases: Mapping[str, Any], of_programs: Mapping[str, Any], is_program: bool) -> None:
    for options, strange, whose in (
        (of_phases, is_program, "broad phases alone"),
        (of_programs, not is_program, "--command"),
    ):
        for name, value in options.items():
            if strange and value is not None:
                raise BadOption(f"{name} is for {whose}")
            if isinstance(value, float) and not 0.0 < value < math.inf:
                raise BadOption(f"{name} {value:g}: expected a number above 0")


def to_judge(
    phases: Sequence[str],
    commands: Sequence[str],
    checks: Sequence[str] | None,
    of_phases: Mapping[str, Any],
    of_programs: Mapping[str, Any],
) -> tuple[list[Judged], list[str] | None]:
    """Returns the phases under test, and the names of the checks; raises BadOption for wrong options."""
    _check_options(of_phases, of_programs, bool(commands))
    from kinetile import Response
    from kinetile.errors import one_of
    from kinetile_conformance import CHECKS, check_broad_phase, check_engine
    from kinetile_conformance.cases import Subject
    from kinetile_conformance.judging import Judged
    from kinetile_conformance.pipe import JUDGING, EngineReport
    from kinetile_conformance.runner import JudgingPlan

    asked, within = of_programs["--ask"] or "contacts", of_programs["--within"]
    if asked not in JUDGING:
        raise BadOption(f"--ask {asked}: expected {one_of(asked, JUDGING)}")
    if commands and asked == "casts" and within is None:
        raise BadOption("--ask casts needs --within D, the distance within which a time is right")
    if asked == "pairs" and within is not None:
        raise BadOption("--within is for times: whether two bodies touch is decided exactly")
    known = [check.name for check in CHECKS] if phases else [*JUDGING[asked]]
    for name in checks or ():
        if name not in known:
            raise BadOption(f"there is no check {name!r}; expected {one_of(name, known)}")
    answer = of_phases["--response"]
    name, options = registered_phase(answer, "response") if answer else ("", {})
    narrow = dict(registered_phase(each, "narrow phase") for each in of_phases["--narrow-phase"] or ())
    given: dict[str, Any] = {
        "narrow_phases": narrow,
        "response": Response(name, **options) if answer else None,
        "seconds": of_phases.get("--seconds"),
        "in_process": of_phases.get("--in-process"),
    }
    chosen = []
    for each in dict.fromkeys(phases):
        name, options = registered_phase(each)
        how: dict[str, Any] = {"options": options, **given}
        report = JudgingPlan.of_phase(name, how).report()
        chosen.append(Judged(report, partial(check_broad_phase, name, **how)))
    how = {"asked": asked, "within": within}
    for command in dict.fromkeys(commands):
        judge = partial(check_engine, command, seconds=of_programs.get("--scene-seconds"), **how)
        chosen.append(Judged(EngineReport(Subject(command, {}), "", **how), judge))
    return chosen, [*checks] if checks else None


def compiling_first() -> str:
    """Returns the reason for a long run, if loops are compiled."""
    from kinetile.instruments import NOTHING_IS_COMPILED

    first = "; a dozen run as Python, before loops are compiled that are not yet (about 10 s each)"
    return "" if NOTHING_IS_COMPILED else first


def _line(row: dict[str, Any]) -> None:
    echo(as_text.dumps(row, allow_nan=False, default=str))


def judge(
    phases: Annotated[
        list[str] | None, argument("Broad phases, as `conform` takes them.", "[NAME]...")
    ] = None,
    command: Annotated[
        list[str] | None, option("A program, as `conform` takes it.", "CMD", "--command")
    ] = None,
    out: Annotated[Path, option("For judge.html and judge.json.", "DIR")] = Path("judged"),
    overwrite: Annotated[bool, flag("Replace these files.", "--overwrite")] = False,
    narrow_phase: NarrowPhases = None,
    response: Answer = None,
    ask: Ask = None,
    within: Within = None,
    examples: Examples = EXAMPLES,
    check: Checks = None,
    repeats: Repeats = 3,
    seed: Seed = 0,
    json: Json = False,
) -> None:
    """Judge broad phases and programs, measure them on a dozen scenes, and write one page about all; exit
    codes are those of `conform`.

    For example: kinetile judge cells sap-1d --out judged
    """
    if not (phases or command):
        raise BadOption("expected the NAME of a broad phase, or --command CMD, or several of both")
    beside = {"--narrow-phase": narrow_phase, "--response": response}
    judged, checks = to_judge(phases or (), command or (), check, beside, {"--ask": ask, "--within": within})
    from kinetile_conformance.judging import Judgement
    from kinetile_conformance.page import page

    judgement = Judgement(judged, examples, seed, checks, repeats, out / "failures")
    try_folder("--out", out, keep=True)
    files = out / "judge.html", out / "judge.json"
    for path in files:
        check_new("--out", path, overwrite)
    names = ", ".join(each.report.label for each in judged)
    notice(f"judging {names} on {examples:,} scenes a check{compiling_first()} ...")
    first, bar = FirstSignal(), Bar("judging")

    def show(share: float | None, text: str) -> None:
        first.check()
        bar.show(share, text)

    try:
        with first, bar:
            judgement.run(show)
    except KeyboardInterrupt:
        notice("kinetile: interrupted; what was done until then is written")
    result = as_json(judgement.as_dict())
    from kinetile.instruments import write_file

    verdicts = [f"{each.report.label}: {each.error or each.verdict}" for each in judged]
    try:
        with file_errors(f"--out {out}"):
            write_file(files[0], page(judgement, shlex.join(["kinetile", *sys.argv[1:]])))
            write_file(files[1], result + "\n")
    finally:
        echo(result if json else "\n".join([*verdicts, *map(str, files)]))
    if judgement.status != "complete":
        raise typer.Exit(128 + first.number if first.number else INTERRUPTED)
    raise typer.Exit(judgement.exit_code)


def replay(
    phase: Annotated[str, argument("The broad phase.", "NAME")],
    file: Annotated[Path, argument("A scene file, such as `conform` saves.", "FILE")],
    check: Annotated[
        str | None, option("The check; the one that the file names, or same-contacts.", "CHECK")
    ] = None,
    json: Json = False,
) -> None:
    """Runs a check on a saved scene again; exit code 1 if it still fails.

    For example: kinetile replay conformance-failures/case.toml cells
    """
    from kinetile_conformance import Report
    from kinetile_conformance.api import replay as judge

    name, options = registered_phase(phase)
    with file_errors(str(file)):
        result = judge(name, file, check=check, options=options)
    if json:
        from kinetile.instruments import versions

        row: dict[str, Any] = {"broad_phase": name, "options": options, "file": str(file)}
        echo(as_json(row | {"fails": not result.ok, "versions": versions()} | Report.row(result)))
    else:
        bodies = f"{result.bodies} {'body' if result.bodies == 1 else 'bodies'}"
        echo(f"{'passes' if result.ok else 'still fails'}: {phase}, {result.check}, {file} ({bodies})")
        verdict = [f"verdict: {result.verdict}"] if result.verdict else []
        echo("\n".join(f"  {line}" for line in [result.sentence, *result.said.splitlines(), *verdict]))
    if not result.ok:
        raise typer.Exit(DIFFERENT)


app = typer.Typer()
for _command in (conform, judge, replay):
    app.command(rich_help_panel="Conformance")(_command)
