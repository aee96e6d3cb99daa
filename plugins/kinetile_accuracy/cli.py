"""The commands ``oracle``, ``certify-log`` and ``accuracy``. Each imports its numerical modules only when it
runs: the oracle needs python-flint, the figures matplotlib, and ``kinetile --help`` needs neither."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from io import TextIOWrapper
from itertools import count, islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinetile.cli import options as cli
from kinetile.cli.files import file_errors, try_folder
from kinetile.cli.output import as_json, printed, rows_table, scene_summary, show
from kinetile.cli.terminal import DIFFERENT, EXIT_FAULT, Bar, echo, make_ready, notice
from kinetile.errors import BadOption

if TYPE_CHECKING:
    from rich.table import Table

    from kinetile import Scene
    from kinetile.arrays import Array
    from kinetile_accuracy.oracle.agreement import Agreement
    from kinetile_accuracy.oracle.oracle import CertifiedContact, CertifiedRun, Oracle
    from kinetile_accuracy.sections import Budget, Section
    from kinetile_accuracy.specification.certify import CertifiedLog, LogCertifier, LogProgress

app = typer.Typer()
_command = app.command(rich_help_panel="Accuracy")

SHOWN = 20
"""Contacts that the table of ``oracle`` shows from each end of a long list."""

_LONGEST = 1 << 12  # characters of a line: a contact has some 60
_PARQUET = b"PAR1"


@_command
def oracle(
    scene: cli.SceneName,
    parameters: cli.Parameters = None,
    until: cli.Until = None,
    max_contacts: cli.MaxContacts = None,
    against: Annotated[
        str | None, cli.option("Print how far a run under this broad phase agrees.", "NAME")
    ] = None,
    json: cli.Json = False,
    csv: cli.Csv = False,
) -> None:
    """Certifies the contacts of a scene in ball arithmetic; exit code 1 if a run differs.

    For example: kinetile oracle random -s bodies=20 --until 1
    """
    with Bar("certifying") as bar:
        from kinetile_accuracy.oracle.oracle import Oracle

        this_scene = cli.find_scene(scene, parameters)
        end = cli.until_or_default(this_scene, until, max_contacts)
        options = {"until": end, "max_contacts": max_contacts, "against": against}
        if against is not None:
            found = _run_against(against, this_scene, end, max_contacts, bar)
            certified, complete = found.oracle, found.complete
            bar.close()
            _print_oracle(this_scene, options, certified, found, json, csv)
            if found.disagreement is not None:
                raise typer.Exit(DIFFERENT)
        else:
            certifier = Oracle(this_scene, end)
            try:
                _follow(certifier, max_contacts, bar)
            finally:  # after Ctrl-C the certain contacts are printed
                bar.close()
                certified = certifier.certified
                _print_oracle(this_scene, options, certified, None, json, csv)
            complete = certified.complete
        if not complete:
            notice(f"kinetile: the requested end was not reached: {certified.ending}")
            raise typer.Exit(EXIT_FAULT)


def _follow(certifier: Oracle, max_contacts: int | None, bar: Bar) -> None:
    start, until = certifier.scene.start, certifier.until
    for number, met in enumerate(islice(certifier, max_contacts), 1):
        if number % 16 == 0:
            share = number / max_contacts if max_contacts else None
            if until is not None:
                share = (met.time.nearest - start) / ((until - start) or 1.0)
            bar.show(share, f"{certifier.bits} bits: time {met.time.nearest:.6g}, {number:,} contacts")


def _run_against(
    against: str, scene: Scene, until: float | None, max_contacts: int | None, bar: Bar
) -> Agreement:
    from kinetile import Simulation
    from kinetile.instruments import read_phase
    from kinetile_accuracy.oracle.agreement import certify
    from kinetile_accuracy.oracle.oracle import check_scope

    name, options = read_phase(against)
    simulation = Simulation(scene, name, options=options or None)
    check_scope(scene, simulation.narrow_phases)  # before the loop is compiled
    make_ready(simulation)

    def progress(certain: int, compared: int) -> None:
        if certain % 16 == 0:
            bar.show(min(certain / max(compared, 1), 1.0), f"{certain:,} contacts certified")

    return certify(simulation, until=until, max_contacts=max_contacts, progress=progress)


def _print_oracle(
    scene: Scene,
    options: dict[str, Any],
    certified: CertifiedRun,
    found: Agreement | None,
    json: bool,
    csv: bool,
) -> None:
    if json or csv:
        from kinetile.instruments import versions

        result: dict[str, Any] = {"versions": versions(), "scene": scene_summary(scene), "run": options}
        result["oracle"] = {
            "ended": certified.ended,
            "why": certified.ending,
            "bits": certified.bits,
            "undecidable": certified.undecidable and certified.undecidable._asdict(),
            "contacts": [  # the time with all certain digits, and as the nearest double
                met._asdict() | {"time": met.time.decimal(40), "nearest": met.time.nearest}
                for met in certified.contacts
            ],
        }
        result |= {} if found is None else {"agreement": found.as_dict()}
        printed(result, result["oracle"]["contacts"], json=json, csv=csv)
        return
    if found is not None:
        show(str(found), f"the oracle: {certified}")
    else:
        tables = [_contacts_table(certified.contacts)] if certified.contacts else []
        show(*tables, str(certified))


def _contacts_table(contacts: Sequence[CertifiedContact]) -> Table:
    from kinetile.toolbox import WALLS

    rows = []
    for index, (time, a, b, tied, head_on) in enumerate(contacts):
        partner = f"{WALLS[b]} wall" if b in WALLS else f"disc {b}"
        same = "same time" if tied else ""
        rows.append((f"{index}", time.decimal(), same, f"{a}", partner, f"{head_on:.6f}"))
    if len(rows) > 2 * SHOWN:
        rows[SHOWN:-SHOWN] = [("...", f"({len(rows) - 2 * SHOWN:,} more)", "", "", "", "")]
    return rows_table(("> contact", "| time", "", "> disc", "with", "> head-on"), rows)


@_command
def certify_log(
    scene: cli.SceneName,
    log: Annotated[
        str,
        cli.argument(
            "An event file, or lines 'epoch tick a b' in a text file; -: such lines on stdin.", "LOG"
        ),
    ],
    parameters: cli.Parameters = None,
    until: Annotated[
        float | None,
        cli.option(
            "Up to this time all contacts must be there; as in `run`, or an event file's own.", "TIME"
        ),
    ] = None,
    max_contacts: cli.MaxContacts = None,
    within: Annotated[
        float | None, cli.option("Lines are 'time a b', and times are right within this distance.", "D")
    ] = None,
    json: cli.Json = False,
) -> None:
    """Checks a list of contacts by the specification; exit code 1, with the first wrong line.

    For example: kinetile certify-log random contacts.txt --until 1
    """
    this_scene = cli.find_scene(scene, parameters)
    certifier = _certifier(log, this_scene, until, max_contacts, within)
    with Bar("certifying") as bar:

        def progress(state: LogProgress) -> None:
            bar.show(state.lines / state.total, f"{state.lines:,} lines right, time {state.time:.6g}")

        try:
            report = certifier.run(progress)
        except KeyboardInterrupt:
            bar.close()
            _print_certified(this_scene, log, certifier.report, json)
            raise
    _print_certified(this_scene, log, report, json)
    if not report.right:
        raise typer.Exit(DIFFERENT)


def _certifier(
    log: str, scene: Scene, until: float | None, max_contacts: int | None, within: float | None
) -> LogCertifier:
    import numpy as np

    from kinetile.instruments import SIGNATURE, open_regular, read_contacts
    from kinetile_accuracy.specification.certify import LogCertifier

    end = cli.until_or_default(scene, until, max_contacts)
    fingerprint: str | None = None
    with file_errors(f"the log {log!r} cannot be read"):
        if within is not None:
            lines = sys.stdin if log == "-" else open_regular(log)
            try:
                timed = np.loadtxt(lines, [("time", "f8"), ("a", "i8"), ("b", "i8")], ndmin=1)
            except ValueError as error:
                raise BadOption(f"{log}: {error}; expected lines 'time a b'") from error
            return LogCertifier(scene, timed, end, max_contacts=max_contacts, within=within)
        if log == "-":
            rows, fingerprint = read_contacts(sys.stdin, "standard input")
        else:
            with open_regular(log) as file:
                is_recorded = file.read(len(SIGNATURE)).startswith((_PARQUET, SIGNATURE))
            if is_recorded:
                given = until is not None or max_contacts is not None
                rows, end = _read_events(log, scene, end if given else None)
            else:
                with TextIOWrapper(open_regular(log), encoding="utf-8", errors="replace") as lines:
                    rows, fingerprint = read_contacts(iter(lambda: lines.readline(_LONGEST), ""), log)
    return LogCertifier(scene, rows, end, max_contacts=max_contacts, fingerprint=fingerprint)


def _read_events(path: str, scene: Scene, end: float | None) -> tuple[Array, float | None]:
    """Reads an event file and the time of its end: an interrupted run ends at its last row."""
    from kinetile.instruments import read_with_scene, relabelled

    (rows, metadata), its_scene = read_with_scene(path)
    if relabelled(its_scene, settings=scene.settings) != scene:
        here = "the scene in its metadata, with all its commands, is not the given one"
        raise BadOption(f"{path} is of another scene: {here}")
    if metadata["answer"] != scene.answer:
        here = f"this check is of answer {scene.answer}: its contacts follow other rules"
        raise BadOption(f"{path} is of answer {metadata['answer']}, and {here}")
    if end is None and metadata["status"] == "complete":
        reached = metadata["time"]
        end = reached if not len(rows) or reached > rows["time"][-1] else None
    return rows, end


def _print_certified(scene: Scene, log: str, report: CertifiedLog, json: bool) -> None:
    if json:
        from kinetile.instruments import versions

        result = {"versions": versions(), "answer": scene.answer, "scene": scene_summary(scene), "log": log}
        echo(as_json(result | report.as_dict()))
        return
    echo(f"{'standard input' if log == '-' else log}: {report}")
    if report.right and report.fingerprint:
        echo(f"answer {scene.answer}, fingerprint {report.fingerprint}")


@_command
def accuracy(
    quick: Annotated[bool, cli.flag("Measure for about a minute.", "--quick")] = False,
    full: Annotated[bool, cli.flag("Measure for about half an hour.", "--full")] = False,
    part: Annotated[
        list[str] | None,
        cli.option("Only this part: chart, queries, oracle, specification or drift.", "NAME"),
    ] = None,
    out: Annotated[
        Path | None,
        cli.option("The folder for the page, its figures and the data; a new accuracy-report.", "DIR"),
    ] = None,
    json: cli.Json = False,
) -> None:
    """Reports speed against error: a page with its figures, and the data behind them.

    For example: kinetile accuracy --quick --out report
    """
    from kinetile_accuracy.report import check_packages, measure_parts

    done: list[Section] = []
    with Bar("measuring") as bar:

        def finish(section: Section) -> None:
            bar.close()
            done.append(section)
            if not json:
                _print_section(section)

        def progress(what: str, step: int, steps: int) -> None:
            bar.show(step / max(steps, 1), what)

        if quick and full:
            raise BadOption("--quick and --full exclude each other: expected one of them")
        budget: Budget = "quick" if quick else "full" if full else "normal"
        parts = list(dict.fromkeys(part)) if part else None
        if out is None:
            names = ("accuracy-report" if k == 1 else f"accuracy-report-{k}" for k in count(1))
            out = next(each for each in map(Path, names) if not (each / "accuracy.html").exists())
        check_packages(parts)
        try_folder("--out", out, keep=True)
        try:
            measure_parts(budget, parts, progress=progress, finish=finish)
        finally:
            bar.close()
            if done:
                _write_page(done, out, budget, json)


def _print_section(section: Section) -> None:
    echo(section.title)
    for claim in section.claims:
        echo(f"{'holds' if claim.holds else 'DOES NOT HOLD'}: {claim.says}: {claim.measured}")
    for sentence in section.findings:
        echo(f"- {sentence}")
    for sentence in section.left_out:
        echo(f"- left out: {sentence}")
    echo()


def _write_page(done: Sequence[Section], out: Path, budget: Budget, json: bool) -> None:
    from kinetile_accuracy.environment import environment
    from kinetile_accuracy.report import section_as_dict, write_report

    written: list[Path] = []
    try:
        with file_errors(f"--out {out}"):
            written = write_report(done, out, budget=budget, conditions=environment())
    finally:
        if json:
            echo(as_json({"parts": [section_as_dict(section) for section in done], "files": written}))
    if not json:
        echo(f"written: {written[0]}, and {len(written) - 1} files with its figures and data beside it")
