"""The command ``kinetile``.

Results go to stdout, as a table or (``--json``) as JSON; everything else goes to stderr. Exit codes: 0 for
success; 1 for a divergence, a wrong list of contacts, a fault in the run or a phase that does not conform; 2
for an invalid command; 3 if the reference of the conformance kit itself is in doubt;
4 if the kit ran out of time; 130 after Ctrl-C (143 after SIGTERM, 129 after SIGHUP), after the partial
result. Further commands come from plugins: an entry point of the group ``kinetile.commands`` names a
``typer.Typer``, which is imported only for ``--help``, or a name that the framework does not have.
"""

from collections.abc import Callable
from typing import Annotated, Any

import typer

from kinetile.cli import cache, compare, export, plugins, run, show
from kinetile.cli.options import MARKUP, CommandGroup, flag
from kinetile.cli.terminal import echo, exit_codes, notice, results_on_stdout
from kinetile.versions import __version__

COMMANDS_GROUP = "kinetile.commands"
"""The group of entry points of the plugins' commands."""


class _WithPlugins(CommandGroup):
    """The framework's commands, and the commands of plugins if a name is not among these. Errors and signals
    become a message and an exit code: Typer would end without a message, a signal without clearing up."""

    _complete = False

    def make_context(self, *given: Any, **more: Any) -> Any:
        with exit_codes():
            return super().make_context(*given, **more)

    def invoke(self, ctx: Any) -> Any:
        with exit_codes():
            return super().invoke(ctx)

    def list_commands(self, ctx: Any) -> list[str]:
        self._load()
        return super().list_commands(ctx)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if cmd_name not in self.commands:
            self._load()
        return super().get_command(ctx, cmd_name)

    def _load(self) -> None:
        """Adds the commands of all installed plugins, once; if two share a name, the first stays."""
        if self._complete:
            return
        self._complete = True
        self.commands["cache"] = self.commands.pop("cache")  # Typer lists groups before commands
        from kinetile.plugin.registry import installed

        for plugin in installed(COMMANDS_GROUP):
            try:
                offered = plugin.load()
                if not isinstance(offered, typer.Typer):
                    raise TypeError(f"it is a {type(offered).__name__}; expected a typer.Typer")
                found = typer.main.get_group(offered).commands
            except Exception as error:  # foreign code: the other commands still work
                notice(f"kinetile: no commands from {plugin.plugin}: {error}")
                continue
            for name, command in found.items():
                if name in self.commands:
                    notice(f"kinetile: {plugin.plugin} has a command {name!r} as well")
                else:
                    self.commands[name] = command


app = typer.Typer(
    name="kinetile",
    cls=_WithPlugins,
    rich_markup_mode=MARKUP,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        echo(f"kinetile {__version__}")
        raise typer.Exit


@app.callback()
def _kinetile(
    version: Annotated[
        bool, flag("Print the version.", "--version", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Kinetic broad-phase collision detection in 2D."""


_PANELS: dict[str, tuple[Callable[..., None], ...]] = {
    "Run": (run.run, run.resume, run.recover, compare.compare),
    "Show": (show.draw, show.view, export.export),
    "Plugins and scenes": (plugins.scenes, plugins.plugins, plugins.new_plugin),
}
for _panel, _commands in _PANELS.items():
    for _command in _commands:
        app.command(rich_help_panel=_panel)(_command)
app.add_typer(cache.app, name="cache", rich_help_panel="Compiled loops")


def main() -> None:
    """Runs the command line."""
    with results_on_stdout():
        app()
