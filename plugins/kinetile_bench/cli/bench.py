"""The commands ``kinetile choose`` and ``kinetile bench`` with its benchmarks.

Numerical modules are imported inside the commands, so that ``--help`` is quick.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinetile.cli.files import try_folder
from kinetile.cli.options import (
    Csv,
    Json,
    MaxContacts,
    NarrowPhases,
    Parameters,
    Phases,
    Repeats,
    SceneName,
    Seconds,
    Until,
    find_scene,
    narrow_choice,
    phase_choices,
    read_numbers,
    some_phases,
    until_or_default,
)
from kinetile.cli.output import printed, scene_summary
from kinetile.cli.terminal import DIFFERENT, Bar, exit_codes, make_ready, notice
from kinetile.errors import BadOption, MissingExtra
from kinetile_bench.cli.study import end, run_with_bar

if TYPE_CHECKING:
    from kinetile import Scene
    from kinetile_bench.study import Study
    from kinetile_bench.thesis import ThesisBench


_KEEP = "Keep all rows in this folder, and go on with those that are there"


def _results(help: str) -> Any:
    return typer.Option("--results", "--out", metavar="DIR", help=help)


def events(
    phases: Phases = None,
    bodies: Annotated[str, typer.Option(metavar="N,...", help="Numbers of discs.")] = "25,100,400",
    densities: Annotated[str, typer.Option(metavar="D,...", help="Area fractions.")] = "0.5,0.25,0.125,0.01",
    seconds: Seconds = 0.5,
    repeats: Repeats = 5,
    results: Annotated[Path | None, _results(f"{_KEEP}.")] = None,
    json: Json = False,
    csv: Csv = False,
) -> None:
    """Measure events a CPU second of each broad phase on the thesis's twelve scenes."""
    from kinetile_bench.events import events_study, read_events

    with exit_codes():
        chosen = None if phases is None else phase_choices(phases)
        sizes = read_numbers(bodies, int, "--bodies")
        fractions = read_numbers(densities, float, "--densities")
        with _rows_in(results) as folder:
            study = events_study(folder, chosen, sizes, fractions, seconds=seconds, repeats=repeats)
            _run(study, read_events, lambda found: _print(found, json, csv))


def growth(
    phases: Annotated[
        str, typer.Option("--phases", "--phase", metavar="NAME", help="The broad phase, one.")
    ] = "sweep-tiling",
    bodies: Annotated[
        str, typer.Option(metavar="N,...", help="Numbers of discs; the next square number is taken.")
    ] = "100,1000,10000,100000",
    density: Annotated[float, typer.Option(help="Area fraction.")] = 0.5,
    seconds: Seconds = 2.0,
    repeats: Repeats = 1,
    results: Annotated[Path | None, _results(f"{_KEEP}.")] = None,
    json: Json = False,
    csv: Csv = False,
) -> None:
    """Measure time and memory of a broad phase against the number of discs."""
    from kinetile_bench.growth import growth_study, read_growth

    with exit_codes():
        sizes = read_numbers(bodies, int, "--bodies")
        chosen = some_phases(phases)
        if len(chosen) > 1:
            raise BadOption(f"--phases names {len(chosen)} phases; expected one, whose growth is measured")
        with _rows_in(results) as folder:
            study = growth_study(folder, chosen[0], sizes, density, seconds=seconds, repeats=repeats)
            _run(study, read_growth, lambda found: _print(found, json, csv))


def thesis(
    phases: Annotated[
        str, typer.Option(metavar="A,B,...", help="Broad phases.")
    ] = "naive,sap-1d,sap-2d,sweep-tiling",
    seeds: Annotated[int, typer.Option(min=1, metavar="K", help="Run each scene with the seeds 1 to K.")] = 6,
    until: Annotated[float, typer.Option(metavar="T", help="How much time is simulated.")] = 1.0,
    seconds: Seconds = 0.01,
    repeats: Repeats = 5,
    results: Annotated[
        Path | None, _results(f"{_KEEP}; write rows.csv and figures 23 and 24 beside them.")
    ] = None,
    json: Json = False,
    csv: Csv = False,
) -> None:
    """Do the thesis's benchmark (section 5.3) again, and say which of its statements hold."""
    from kinetile_accuracy.drawing import check_figures
    from kinetile_bench.thesis import read_bench, thesis_study

    with exit_codes():
        if not 0.0 < until < float("inf"):
            raise BadOption(f"--until is {until!r}; expected a time greater than 0")
        chosen = some_phases(phases)
        with _rows_in(results) as folder:
            if results is not None:
                try:  # before the measurement
                    check_figures()
                except MissingExtra as error:
                    notice(f"kinetile: {error}; everything else is done without it")
            study = thesis_study(folder, chosen, seeds=seeds, until=until, seconds=seconds, repeats=repeats)

            def show(found: ThesisBench) -> None:
                _print_thesis(found, [] if results is None else _write(study, results), json, csv)

            _run(study, read_bench, show)


def frames(
    phases: Annotated[
        str, typer.Option(metavar="A,B,...", help="Broad phases.")
    ] = "cells,sap-1d,sweep-tiling",
    frames: Annotated[int, typer.Option(metavar="N", help="Frames, a sixtieth of a unit each.")] = 600,
    bodies: Annotated[
        int, typer.Option(min=1, metavar="N", help="Number of discs; the next square number is taken.")
    ] = 1000,
    density: Annotated[float, typer.Option(help="Area fraction.")] = 0.25,
    speed: Annotated[float, typer.Option(help="Root of the mean square speed; the box is 1 wide.")] = 1.0,
    turned: Annotated[int, typer.Option(min=0, help="Discs that turn in each frame.")] = 50,
    exchanged: Annotated[int, typer.Option(min=0, help="Discs that go in each frame, and that come.")] = 5,
    json: Json = False,
    csv: Csv = False,
) -> None:
    """Measure what a frame of a game costs: discs turn, go and come, time runs on, all is read out.

    Exit code 1 unless all phases give the same contacts.
    """
    from kinetile_bench.frames import Play, bench_frames
    from kinetile_bench.growth import square_at_least

    with exit_codes(), Bar("playing") as bar:
        chosen = some_phases(phases)
        play = Play(square_at_least(bodies), density, speed, turned=turned, exchanged=exchanged)

        def progress(at: int, total: int) -> None:
            bar.show(at / total, f"{at:,} of {total:,} frames")

        _last(bench_frames(chosen, frames, play, start=make_ready, progress=progress), bar, json, csv)


def counters(
    phases: Phases = None,
    bodies: Annotated[
        str, typer.Option(metavar="N,...", help="Numbers of discs; the next square numbers are taken.")
    ] = "100,1600",
    densities: Annotated[str, typer.Option(metavar="D,...", help="Area fractions.")] = "0.5",
    contacts: Annotated[
        int, typer.Option(metavar="N", help="Contacts that are counted, after ten a disc.")
    ] = 1_000_000,
    json: Json = False,
    csv: Csv = False,
) -> None:
    """Count instructions, mispredicted branches and cache misses a contact, with Linux's perf.

    Exit code 1 unless all phases give the same contacts.
    """
    from kinetile.plugin.registry import registry
    from kinetile_bench.counters import bench_counters

    with exit_codes(), Bar("counting") as bar:
        chosen = registry().names("broad phase") if phases is None else some_phases(phases)
        sizes = read_numbers(bodies, int, "--bodies")
        fractions = read_numbers(densities, float, "--densities")
        rows = bench_counters(chosen, sizes, fractions, contacts, start=make_ready, progress=bar.count)
        _last(rows, bar, json, csv)


def scene(
    scene: SceneName,
    parameters: Parameters = None,
    phases: Phases = None,
    narrow_phase: NarrowPhases = None,
    until: Until = None,
    max_contacts: MaxContacts = None,
    seconds: Seconds = 0.0,
    repeats: Repeats = 3,
    json: Json = False,
    csv: Csv = False,
) -> None:
    """Measure the broad phases on a scene of your own: `kinetile bench trace.toml` does.

    Exit code 1 unless all phases give the same contacts.
    """
    from kinetile_bench.user_scene import bench_scene

    def measure(of_scene: Scene, chosen: Any, **how: Any) -> Any:
        end_ = until_or_default(of_scene, until, max_contacts)
        how |= {"max_contacts": max_contacts, "narrow_phases": narrow_choice(narrow_phase)}
        return bench_scene(of_scene, chosen, end_, repeats=repeats, seconds=seconds, **how)

    _on_scene(scene, parameters, phases, measure, json, csv)


def choose(
    scene: SceneName,
    parameters: Parameters = None,
    phases: Phases = None,
    until: Until = None,
    seconds: Seconds = 0.1,
    repeats: Repeats = 5,
    json: Json = False,
    csv: Csv = False,
) -> None:
    """Try the broad phases on a scene for some thousands of contacts each, and recommend one.

    Exit code 1 unless all phases give the same contacts.
    """
    from kinetile_bench import user_scene

    def measure(of_scene: Scene, chosen: Any, **how: Any) -> Any:
        return user_scene.choose(of_scene, chosen, until=until, seconds=seconds, repeats=repeats, **how)

    _on_scene(scene, parameters, phases, measure, json, csv, rows="candidates")


def _on_scene(
    name: str,
    parameters: list[str] | None,
    phases: str | None,
    measure: Callable[..., Any],
    json: bool,
    csv: bool,
    rows: str = "rows",
) -> None:
    """Measures phases on a scene and prints the result; exit code 1 unless their contacts agree."""
    with exit_codes(), Bar("measuring") as bar:
        chosen = None if phases is None else some_phases(phases)
        scene = find_scene(name, parameters)
        found = measure(scene, chosen, start=make_ready, progress=bar.count)
    _print(found, json, csv, of_scene=scene_summary(scene), rows=rows)
    if not found.identical:
        raise typer.Exit(DIFFERENT)


def _last(measured: Iterable[Any], bar: Bar, json: bool, csv: bool) -> None:
    """Measures to the end and prints the last result; exit code 1 unless all contacts agree."""
    found = None
    try:
        for each in measured:
            found = each
    finally:  # a signal does not discard finished measurements
        bar.close()
        if found is not None:
            _print(found, json, csv)
    if found is not None and not found.identical:
        raise typer.Exit(DIFFERENT)


def _print(
    found: Any, json: bool, csv: bool, *, of_scene: Mapping[str, Any] | None = None, rows: str = "rows"
) -> None:
    """Prints a result: all of it as JSON, its rows as CSV, or tables."""
    result = ({} if of_scene is None else {"scene": of_scene}) | found.as_dict()
    if not printed(result, result[rows], json=json, csv=csv):
        from kinetile.cli.output import show
        from kinetile_bench.cli.tables import printed_parts

        show(*printed_parts(found))


@contextmanager
def _rows_in(results: Path | None) -> Iterator[Path]:
    """Yields the folder of a benchmark's rows: ``results``, tried first, or a temporary one."""
    if results is not None:
        try_folder("--results", results, keep=True)
        yield results
        return
    with TemporaryDirectory() as folder:
        yield Path(folder)


def _run(study: Study, read: Callable[[Study], Any], show: Callable[[Any], None]) -> None:
    """Runs a study, one task at a time; shows its results before the errors and the exit code."""
    status, number = run_with_bar(study, quiet_core=True)
    found = read(study)
    if found.rows:
        show(found)
    rows = study.rows().select(["phase", "status", "error"]).to_pylist()
    for phase, end_, error in dict.fromkeys(tuple(row.values()) for row in rows if row["status"] != "done"):
        notice(f"kinetile: {phase}: {end_}: {error}")
    end(status, number)


def _write(study: Study, folder: Path) -> list[Path]:
    """Writes the rows and, where that can be done, the figures; returns the files."""
    from kinetile_bench.results import write_rows

    try:
        written = [folder / "rows.csv"]
        write_rows(study.rows(), written[0])
        with suppress(MissingExtra):  # said before the start
            written += study.plot(folder)
    except OSError as error:
        raise BadOption(f"--results {folder}: {error.strerror or error}") from error
    return written


def _print_thesis(bench: ThesisBench, written: list[Path], json: bool, csv: bool) -> None:
    from kinetile_bench.thesis.measures import exponents, summaries
    from kinetile_bench.thesis.statements import statements

    scenes, fits, found = summaries(bench), exponents(bench), statements(bench)
    result: dict[str, Any] = {"conditions": dict(bench.conditions), "scenes": scenes, "exponents": fits}
    result["statements"] = [statement.as_dict() for statement in found]
    result |= {"cells": [vars(cell) for cell in bench.rows], "files": written}
    if not printed(result, result["cells"], json=json, csv=csv):
        from kinetile.cli.output import show
        from kinetile_bench.cli.thesis_tables import thesis_parts

        show(*thesis_parts(bench, scenes, fits, found), *(f"written: {path}" for path in written))
