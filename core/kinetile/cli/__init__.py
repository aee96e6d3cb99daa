"""The command ``kinetile``.

Results go to stdout, as a table or (``--json``) as JSON; everything else goes to stderr. Exit codes: 0; 1 for
a divergence, a list of contacts that is wrong, a fault in the run or a phase that does not conform; 2 for
what cannot be done as it was asked for; 3 where the conformance kit's reference itself is in doubt; 4 where
the kit ran out of time; 130 after Ctrl-C, when what was done until then has been printed.

Each command has a file in ``kinetile.cli.commands``, which declares its options and carries it out. All of
them are imported here, so that a command's file imports what it needs only when it is called: a run should
spend its time running.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import typer

from kinetile import __version__
from kinetile.cli.commands import (
    accuracy,
    certify_log,
    new_plugin,
    oracle,
    plugins,
    recover,
    run,
    scenes,
)
from kinetile.cli.commands.bench import events, growth, thesis
from kinetile.cli.commands.judging import compare, conform, mutate, replay
from kinetile.cli.terminal import results_on_stdout

__all__ = ["app", "main"]

app = typer.Typer(
    name="kinetile",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
bench = typer.Typer(help="Measure speed.", no_args_is_help=True)


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
    recover.recover,
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
_BENCHMARKS: tuple[Callable[..., None], ...] = (events.events, thesis.thesis, growth.growth)

for _command in _COMMANDS:
    app.command()(_command)
for _benchmark in _BENCHMARKS:
    bench.command()(_benchmark)
app.add_typer(bench, name="bench")


def main() -> None:
    """Run the command line."""
    with results_on_stdout():
        app()
