"""The command ``kinetile``.

Results go to stdout, as a table or (``--json``) as JSON; everything else goes to stderr. Exit codes: 0; 1 for
a divergence, a fault in the run or a phase that does not conform; 2 for what cannot be done as it was asked
for; 3 where the conformance kit's reference itself is in doubt; 130 after Ctrl-C, when what was done until
then has been printed. What a command needs is imported by that command alone: a run should
spend its time running.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kinetile import __version__

__all__ = ["app", "main"]

app = typer.Typer(
    name="kinetile",
    help="Kinetic broad-phase collision detection in 2D.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
bench_app = typer.Typer(help="Measure speed.", no_args_is_help=True)
app.add_typer(bench_app, name="bench")

SceneName = Annotated[
    str, typer.Argument(metavar="SCENE", help="A recipe's name (see `kinetile scenes`) or a .toml file.")
]
Parameters = Annotated[
    list[str] | None, typer.Option("--set", "-s", metavar="KEY=VALUE", help="A parameter of the recipe.")
]
NarrowPhases = Annotated[
    list[str] | None,
    typer.Option("--narrow-phase", metavar="NAME", help="A narrow phase, instead of those the scene needs."),
]
Until = Annotated[
    float | None, typer.Option(help="Run until this time; the scene's own `until`, or one time unit.")
]
MaxContacts = Annotated[int | None, typer.Option(min=0, help="Stop after so many contacts.")]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"kinetile {__version__}")
        raise typer.Exit


@app.callback()
def _kinetile(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Kinetic broad-phase collision detection in 2D."""


@app.command()
def run(
    scene: SceneName = "grid",
    parameters: Parameters = None,
    broad_phase: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="The broad phase, with options if need be: sap-1d:axis=y."),
    ] = None,
    option: Annotated[
        list[str] | None,
        typer.Option("--option", "-o", metavar="KEY=VALUE", help="An option of the broad phase."),
    ] = None,
    narrow_phase: NarrowPhases = None,
    until: Until = None,
    max_contacts: MaxContacts = None,
    events: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write every event to a Parquet file.")
    ] = None,
    save_scene: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Save the scene, with what is chosen here, as a TOML file."),
    ] = None,
    explain: Annotated[
        bool, typer.Option("--explain", help="Say what is modelled and what is left out, and run nothing.")
    ] = False,
    audit: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="Check all that must hold, every N contacts (slow)."),
    ] = None,
    json: Json = False,
) -> None:
    """Run a scene and print what happened."""
    from kinetile.cli.commands.run import Wish
    from kinetile.cli.commands.run import run as carry_out

    carry_out(
        Wish(
            scene,
            parameters or (),
            broad_phase,
            option or (),
            narrow_phase or (),
            until,
            max_contacts,
            events,
            save_scene,
            json,
            explain,
            audit,
        )
    )


@app.command()
def compare(
    scene: SceneName = "grid",
    parameters: Parameters = None,
    broad_phases: Annotated[
        str,
        typer.Option(
            metavar="A,B,...",
            help="Broad phases, the first being the reference; with options: sap-1d:axis=y.",
        ),
    ] = "naive,sap-1d,sap-2d",
    narrow_phase: NarrowPhases = None,
    until: Until = None,
    max_contacts: MaxContacts = None,
    json: Json = False,
) -> None:
    """Run a scene under several broad phases; exit code 1, and the first difference, unless all agree."""
    from kinetile.cli.commands.others import compare_phases

    compare_phases(scene, parameters or (), broad_phases, narrow_phase or (), until, max_contacts, json)


@app.command()
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
    from kinetile.cli.commands.conform import Trial
    from kinetile.cli.commands.conform import conform as carry_out

    carry_out(
        Trial(phase, examples, check or (), expect_failure or (), save_to, shrink, seed, isolated, json)
    )


@app.command()
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
    from kinetile.cli.commands.conform import replay as carry_out

    carry_out(phase, file, check, json)


@app.command("new-plugin")
def new_plugin(
    name: Annotated[str, typer.Argument(help="What the broad phase is to be called.")],
    into: Annotated[Path, typer.Option(metavar="DIR", help="The folder to write the package into.")] = Path(),
) -> None:
    """Write a package with a broad phase that works, to begin one of your own with."""
    from kinetile.cli.commands.conform import create_plugin

    create_plugin(name, into)


@app.command()
def plugins(json: Json = False) -> None:
    """List the phases and recipes that are installed, and the plugins that failed to load."""
    from kinetile.cli.commands.others import list_plugins

    list_plugins(json)


@app.command()
def scenes(
    name: Annotated[str | None, typer.Argument(help="Show the parameters of this recipe.")] = None,
    json: Json = False,
) -> None:
    """List the recipes for scenes and their parameters."""
    from kinetile.cli.commands.others import list_scenes

    list_scenes(name, json)


@app.command()
def oracle(
    scene: SceneName,
    parameters: Parameters = None,
    until: Until = None,
    max_contacts: MaxContacts = None,
    against: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Say how far a run under this broad phase agrees."),
    ] = None,
    json: Json = False,
) -> None:
    """Certify the contacts of a scene in ball arithmetic; exit code 1 where a run differs."""
    from kinetile.cli.commands.oracle import oracle as carry_out

    carry_out(scene, parameters or (), until, max_contacts, against, json)


@app.command()
def accuracy(
    quick: Annotated[bool, typer.Option("--quick", help="Measure for about a minute.")] = False,
    full: Annotated[bool, typer.Option("--full", help="Measure for half an hour or so.")] = False,
    part: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Only this part: chart, queries, oracle, drift or rates."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="The folder for the page, its figures and the data; a new accuracy-report.",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Report speed against error: a page with its figures, and the data behind them."""
    from kinetile.cli.commands.accuracy import accuracy as carry_out

    carry_out(quick, full, part, out, json)


@bench_app.command("events")
def bench_events(
    phases: Annotated[
        str | None, typer.Option(metavar="A,B,...", help="Broad phases; all that are installed.")
    ] = None,
    bodies: Annotated[str, typer.Option(metavar="N,...", help="Numbers of discs.")] = "25,100,400",
    densities: Annotated[str, typer.Option(metavar="D,...", help="Area fractions.")] = "0.5,0.25,0.125,0.01",
    seconds: Annotated[float, typer.Option(min=0.001, help="CPU seconds of one run, about.")] = 0.5,
    repeats: Annotated[int, typer.Option(min=1, help="Runs of each phase on each scene.")] = 5,
    json: Json = False,
) -> None:
    """Measure events a CPU second of each broad phase on the thesis's twelve scenes."""
    from kinetile.cli.commands.others import bench

    bench(phases, bodies, densities, seconds, repeats, json)


@bench_app.command("thesis")
def bench_thesis(
    phases: Annotated[
        str, typer.Option(metavar="A,B,...", help="Broad phases.")
    ] = "naive,sap-1d,sap-2d,sweep-tiling",
    seeds: Annotated[int, typer.Option(min=1, metavar="K", help="Run each scene with the seeds 1 to K.")] = 6,
    until: Annotated[float, typer.Option(metavar="T", help="How much time is simulated.")] = 1.0,
    seconds: Annotated[
        float, typer.Option(min=0.0001, help="CPU seconds of the runs of a phase on a scene, at least.")
    ] = 0.05,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Write all cells as CSV, and figures 23 and 24, into this folder."),
    ] = None,
    json: Json = False,
) -> None:
    """Do the thesis's benchmark (section 5.3) again, and say which of its statements hold."""
    from kinetile.cli.commands.bench import thesis

    thesis(phases, seeds, until, seconds, out, json)


@bench_app.command("growth")
def bench_growth(
    phase: Annotated[str, typer.Option(metavar="NAME", help="The broad phase.")] = "sweep-tiling",
    bodies: Annotated[
        str, typer.Option(metavar="N,...", help="Numbers of discs; the next square number is taken.")
    ] = "100,1000,10000,100000",
    density: Annotated[float, typer.Option(help="Area fraction.")] = 0.5,
    seconds: Annotated[float, typer.Option(min=0.001, help="CPU seconds for each, at least.")] = 2.0,
    json: Json = False,
) -> None:
    """Measure time and memory of a broad phase against the number of discs."""
    from kinetile.cli.commands.bench import growth

    growth(phase, bodies, density, seconds, json)


def main() -> None:
    """Run the command line."""
    from kinetile.cli.terminal import results_on_stdout

    with results_on_stdout():
        app()
