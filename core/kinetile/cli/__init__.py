"""The command ``kinetile``.

Results go to stdout, as a table or (``--json``) as JSON; everything else goes to stderr. Exit codes: 0; 1 for
a divergence, a list of contacts that is wrong, a fault in the run or a phase that does not conform; 2 for
what cannot be done as it was asked for; 3 where the conformance kit's reference itself is in doubt; 4 where
the kit ran out of time; 130 after Ctrl-C (143 after SIGTERM, 129 after SIGHUP), when what was done until then
has been printed.

Each command has a file in ``kinetile.cli.commands``, which declares its options and carries it out. All of
them are imported here, so that a command's file imports what it needs only when it is called: a run should
spend its time running.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from kinetile import __version__
from kinetile.cli.commands import (
    new_plugin,
    plugins,
    recover,
    resume,
    run,
    scenes,
)
from kinetile.cli.commands.bench import events, frames, growth, scene, thesis
from kinetile.cli.commands.judging import choose, compare, conform, mutate, replay
from kinetile.cli.commands.showing import draw, view
from kinetile.cli.commands.study import plot as study_plot
from kinetile.cli.commands.study import run as study_run
from kinetile.cli.commands.study import status as study_status
from kinetile.cli.commands.study import table as study_table
from kinetile.cli.commands.truth import accuracy, certify_log, oracle
from kinetile.cli.options import is_file_name
from kinetile.cli.terminal import results_on_stdout

__all__ = ["app", "main"]

app = typer.Typer(
    name="kinetile",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


class _Bench(TyperGroup):
    """The benchmarks by name; a scene file where a name is expected is a benchmark as well."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        if is_file_name(args[0]) and args[0] not in self.commands:
            args = ["scene", *args]
        return super().resolve_command(ctx, args)


bench = typer.Typer(
    cls=_Bench,
    help="Measure speed; `kinetile bench FILE.toml` measures the broad phases on a scene of your own.",
    no_args_is_help=True,
)
study = typer.Typer(
    help="Run a table of scenes, phases and seeds; stop, go on, read, draw.", no_args_is_help=True
)


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


_COMMANDS: tuple[Callable[..., None], ...] = (
    run.run,
    resume.resume,
    recover.recover,
    draw.draw,
    view.view,
    choose.choose,
    compare.compare,
    conform.conform,
    replay.replay,
    mutate.mutate,
    new_plugin.new_plugin,
    plugins.plugins,
    scenes.scenes,
    oracle.oracle,
    certify_log.certify_log,
    accuracy.accuracy,
)
_BENCHMARKS: tuple[Callable[..., None], ...] = (
    events.events,
    thesis.thesis,
    growth.growth,
    frames.frames,
    scene.scene,
)

for _command in _COMMANDS:
    app.command()(_command)
for _benchmark in _BENCHMARKS:
    bench.command()(_benchmark)
app.add_typer(bench, name="bench")
study.command("run")(study_run.run_study)
study.command("status")(study_status.study_status)
study.command("table")(study_table.study_table)
study.command("plot")(study_plot.study_plot)
app.add_typer(study, name="study")


def main() -> None:
    """Run the command line."""
    with results_on_stdout():
        app()
