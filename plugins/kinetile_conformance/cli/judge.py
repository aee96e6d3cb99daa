"""The command ``kinetile judge``: a page and a JSON file about broad phases and programs, side by side."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from kinetile.cli.files import check_new, file_errors, try_folder
from kinetile.cli.options import Json, NarrowPhases, Repeats, argument, flag, option
from kinetile.cli.output import as_json
from kinetile.cli.terminal import INTERRUPTED, Bar, FirstSignal, echo, notice
from kinetile.errors import BadOption
from kinetile_conformance.cli.conform import (
    EXAMPLES,
    Answer,
    Ask,
    Checks,
    Examples,
    Seed,
    Within,
    compiling_first,
    to_judge,
)


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

    For example: kinetile judge cells sap-1d --out judged.html
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
