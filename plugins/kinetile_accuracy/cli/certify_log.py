"""The command ``kinetile certify-log``: a list of contacts, checked by the specification, line by line."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from kinetile.cli.json_output import as_json, scene_summary
from kinetile.cli.options import Json, MaxContacts, Parameters, SceneName, find_scene, until_or_default
from kinetile.cli.terminal import DIFFERENT, Bar, exit_codes
from kinetile.errors import BadOption

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from kinetile.scene import Scene
    from kinetile_accuracy.answer.certify import CertifiedLog, LogProgress

__all__ = ["certify_log"]

_PARQUET = b"PAR1"


class _Log(NamedTuple):
    """What is to be checked: rows, how far they go (None: to the last), the fingerprint that they claim."""

    rows: NDArray[Any]
    until: float | None
    fingerprint: str | None = None


def certify_log(
    scene: SceneName,
    log: Annotated[
        str,
        typer.Argument(
            metavar="LOG",
            help="An event file, or lines 'epoch tick a b' in a text file; -: such lines on stdin.",
        ),
    ],
    parameters: Parameters = None,
    until: Annotated[
        float | None,
        typer.Option(
            help="Up to this time all contacts must be there; as in `run`, or what an event file says."
        ),
    ] = None,
    max_contacts: MaxContacts = None,
    json: Json = False,
) -> None:
    """Check a list of contacts by the specification; exit code 1, and the first line that is wrong."""
    with exit_codes():
        from kinetile_accuracy.answer.certify import LogCertifier

        this_scene = find_scene(scene, parameters)
        found = _read(log, this_scene, until, max_contacts)
        certifier = LogCertifier(
            this_scene, found.rows, found.until, max_contacts=max_contacts, fingerprint=found.fingerprint
        )
        with Bar("certifying") as bar:

            def show(state: LogProgress) -> None:
                bar.show(state.lines / state.total, f"{state.lines:,} lines right, time {state.time:.6g}")

            try:
                report = certifier.run(show)
            except KeyboardInterrupt:
                bar.close()
                _print(this_scene, log, certifier.report, json)
                raise
    _print(this_scene, log, report, json)
    if not report.right:
        raise typer.Exit(DIFFERENT)


def _read(log: str, scene: Scene, until: float | None, max_contacts: int | None) -> _Log:
    """Read what is to be checked; raise BadOption where it cannot be."""
    from kinetile.records.contacts import read_contacts
    from kinetile.records.row_log import SIGNATURE

    end = until_or_default(scene, until, max_contacts)
    if log == "-":
        return _lines(read_contacts(sys.stdin, "standard input"), end)
    try:
        with Path(log).open("rb") as file:
            if file.read(len(SIGNATURE)).startswith((_PARQUET, SIGNATURE)):
                return _events(log, scene, end if until is not None or max_contacts is not None else None)
        with Path(log).open(encoding="utf-8", errors="replace") as lines:
            return _lines(read_contacts(lines, log), end)
    except OSError as error:
        raise BadOption(f"the log {log!r} cannot be read: {error.strerror or error}") from error


def _lines(found: Any, end: float | None) -> _Log:
    return _Log(found.rows, end, found.fingerprint)


def _events(path: str, scene: Scene, end: float | None) -> _Log:
    """Read an event file, and how far it goes: a run that was broken off goes to its last row."""
    from kinetile.kernel.log import ANSWER
    from kinetile.records.reading import read_with_scene
    from kinetile.scene import relabelled

    (rows, metadata), its_scene = read_with_scene(path)
    if metadata["answer"] != ANSWER:
        raise BadOption(
            f"{path} is of answer {metadata['answer']}, and what is checked here is answer {ANSWER}: "
            "its contacts follow other rules"
        )
    if relabelled(its_scene, settings=scene.settings) != scene:
        raise BadOption(
            f"{path} is of another scene: the one in its metadata is not the one that is given here"
        )
    if end is None and metadata["status"] == "complete":
        reached = metadata["time"]
        end = reached if not len(rows) or reached > rows["time"][-1] else None
    return _Log(rows, end)


def _print(scene: Scene, log: str, report: CertifiedLog, json: bool) -> None:
    from kinetile.kernel.log import ANSWER

    if json:
        from kinetile.records.versions import versions

        result = {"versions": versions(), "answer": ANSWER, "scene": scene_summary(scene), "log": log}
        typer.echo(as_json(result | report.as_dict()))
        return
    typer.echo(f"{'standard input' if log == '-' else log}: {report}")
    if report.right:
        typer.echo(f"answer {ANSWER}, fingerprint {report.fingerprint}")
