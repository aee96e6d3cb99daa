"""The commands ``kinetile choose`` and ``kinetile bench`` with its benchmarks.

Numerical modules are imported inside the commands, so that ``--help`` is quick.
"""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Annotated, Any

import typer

from kinetile.cli import options as cli
from kinetile.cli.files import try_folder
from kinetile.cli.output import printed, scene_summary, show
from kinetile.cli.terminal import DIFFERENT, Bar, make_ready, notice
from kinetile.errors import BadOption


def events(
    phases: cli.Phases = None,
    bodies: Annotated[
        str, cli.option("Numbers of discs; the next square numbers are taken.", "N,...")
    ] = "25,100,400",
    densities: Annotated[str, cli.option("Area fractions.", "D,...")] = "0.5,0.25,0.125,0.01",
    seconds: cli.Seconds = 0.5,
    repeats: cli.Repeats = 6,
    json: cli.Json = False,
    csv: cli.Csv = False,
) -> None:
    """Measures events a CPU second of each broad phase on the thesis's twelve scenes.

    Exit code 1 unless all phases give the same contacts.

    For example: kinetile bench events --bodies 100,400 --densities 0.5
    """
    from kinetile_bench.event_rates import bench_events

    with Bar("measuring") as bar:
        chosen = None if phases is None else cli.phase_choices(phases)
        sizes = cli.read_numbers(bodies, int, "--bodies")
        fractions = cli.read_numbers(densities, float, "--densities")
        how: Any = {"seconds": seconds, "repeats": repeats, "start": make_ready, "progress": bar.count}
        _print_last(bench_events(chosen, sizes, fractions, **how), bar, json, csv)


def thesis(
    phases: Annotated[
        str, cli.option("Broad phases.", "A,B,...")
    ] = "naive,sap-1d,sap-2d,sweep-tiling,cells,power",
    seeds: Annotated[int, cli.option("Run each scene with the seeds 1 to K.", "K", least=1)] = 6,
    until: Annotated[float, cli.option("The simulated time.", "T")] = 1.0,
    seconds: cli.Seconds = 0.01,
    repeats: cli.Repeats = 5,
    out: Annotated[
        Path | None, cli.option("Draw figures 23 and 24, and events a contact, into this folder.", "DIR")
    ] = None,
    json: cli.Json = False,
    csv: cli.Csv = False,
) -> None:
    """Repeats the thesis's benchmark (section 5.3), and prints which of its statements hold.

    Exit code 1 unless all phases give the same contacts.

    For example: kinetile bench thesis --seeds 1
    """
    from kinetile_accuracy.drawing import matplotlib_module
    from kinetile_bench.thesis import ThesisBench, bench_thesis
    from kinetile_bench.thesis.statements import statements

    def more(found: ThesisBench) -> dict[str, Any]:
        return {"statements": statements(found), "files": [] if out is None else draw(found, out)}

    with Bar("measuring") as bar:
        if not 0.0 < until < float("inf"):
            raise BadOption(f"--until is {until!r}; expected a time greater than 0")
        chosen = cli.some_phases(phases)
        if out is not None:  # before the measurement
            from kinetile_bench.thesis.figures import draw

            matplotlib_module()
            try_folder("--out", out, keep=True)
        how: Any = {"seeds": seeds, "until": until, "seconds": seconds, "repeats": repeats}
        _print_last(bench_thesis(chosen, start=make_ready, progress=bar.count, **how), bar, json, csv, more)


def scene(
    scene: cli.SceneName,
    parameters: cli.Parameters = None,
    phases: cli.Phases = None,
    narrow_phase: cli.NarrowPhases = None,
    until: cli.Until = None,
    max_contacts: cli.MaxContacts = None,
    seconds: cli.Seconds = 0.0,
    repeats: cli.Repeats = 3,
    json: cli.Json = False,
    csv: cli.Csv = False,
) -> None:
    """Measures the broad phases on a scene of your own, like `kinetile bench trace.toml`.

    Exit code 1 unless all phases give the same contacts.

    For example: kinetile bench trace.toml
    """
    from kinetile_bench.user_scene import bench_scene

    with Bar("measuring") as bar:
        chosen = None if phases is None else cli.some_phases(phases)
        this_scene = cli.find_scene(scene, parameters)
        end = cli.until_or_default(this_scene, until, max_contacts)
        how: Any = {"max_contacts": max_contacts, "narrow_phases": cli.narrow_choice(narrow_phase)}
        how |= {"seconds": seconds, "repeats": repeats, "start": make_ready, "progress": bar.count}
        found = bench_scene(this_scene, chosen, end, **how)
        _print_last([found], bar, json, csv, lambda _: {"scene": scene_summary(this_scene)})


def choose(
    scene: cli.SceneName,
    parameters: cli.Parameters = None,
    phases: cli.Phases = None,
    until: cli.Until = None,
    seconds: cli.Seconds = 0.1,
    repeats: cli.Repeats = 5,
    json: cli.Json = False,
    csv: cli.Csv = False,
) -> None:
    """Tries the broad phases on a scene for some thousands of contacts each, and recommends one.

    Exit code 1 unless all phases give the same contacts.

    For example: kinetile choose grid -s bodies=1000
    """
    from kinetile_bench import user_scene

    with Bar("measuring") as bar:
        chosen = None if phases is None else cli.some_phases(phases)
        this_scene = cli.find_scene(scene, parameters)
        end, own = until and cli.until_or_default(this_scene, until, None), this_scene.settings.until
        if end is not None and own is not None and end > own:
            notice(f"kinetile: --until {end!r} is after the scene's own end, {own!r}")
        how: Any = {"until": end, "seconds": seconds, "repeats": repeats}
        found = user_scene.choose(this_scene, chosen, start=make_ready, progress=bar.count, **how)
        _print_last([found], bar, json, csv, lambda _: {"scene": scene_summary(this_scene)})


def _print_last(
    measured: Iterable[Any],
    bar: Bar,
    json: bool,
    csv: bool,
    more: Callable[[Any], dict[str, Any]] = lambda _: {},
) -> None:
    """Prints the last result, with ``more``; exit code 1 unless all contacts agree."""
    found = None
    try:
        for found in measured:  # noqa: B007
            pass
    finally:  # a signal does not discard finished measurements
        bar.close()
        if found is not None:
            beside = more(found)
            if not printed(beside | found.as_dict(), found.rows, json=json, csv=csv):
                from kinetile_bench.cli.tables import printed_parts

                show(*printed_parts(found, **beside))
    if found is not None and not found.identical:
        raise typer.Exit(DIFFERENT)
