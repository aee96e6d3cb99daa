"""Options that commands share: their declarations, and the scenes, phases and numbers read from them."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperArgument, TyperGroup

from kinetile.cli.files import file_errors
from kinetile.errors import BadOption
from kinetile.plugin.choices import read_assignments, read_option, read_phase, read_phases, read_value

if TYPE_CHECKING:
    from kinetile.plugin.specs import PluginKind
    from kinetile.scene import Scene


def option(help: str, metavar: str, *names: str, least: float | None = None, **more: Any) -> Any:
    """Returns an option of a command: its help, the placeholder of its value there (N or K for a whole
    number, FILE or DIR for a path), its names, and its least value."""

    def checked(value: Any) -> Any:
        if least is not None and value is not None and not value >= least:
            raise typer.BadParameter(f"found {value:g}; expected {least:g} or more")
        if metavar in ("FILE", "DIR") and value == Path("-"):
            raise typer.BadParameter("found '-'; expected a path: --contacts - alone writes to stdout")
        return value

    more |= {"callback": checked, "parser": _whole if metavar in ("N", "K") else None} if metavar else {}
    return typer.Option(*names, metavar=metavar, help=help, **more)


def _whole(text: Any) -> int:
    """Returns the whole number of a text, which may be written 1e3."""
    value = read_value(str(text))
    if isinstance(value, bool) or not isinstance(value, int | float) or value % 1 != 0:
        raise typer.BadParameter(f"found {text}; expected a whole number")
    return int(value)


def flag(help: str, *names: str, **more: Any) -> Any:
    """Returns an option of a command without a value: its help, and its names."""
    return option(help, "", *names, **more)


def argument(help: str, metavar: str) -> Any:
    """Returns an argument of a command: its help, and its placeholder there."""
    return typer.Argument(metavar=metavar, help=help)


SceneName = Annotated[str, argument("A recipe's name (see `kinetile scenes`) or a .toml file.", "SCENE")]
Parameters = Annotated[list[str] | None, option("A parameter of the recipe.", "KEY=VALUE", "--set", "-s")]
BroadPhase = Annotated[str | None, option("The broad phase, with options if needed: sap-1d:axis=y.", "NAME")]
Options = Annotated[list[str] | None, option("An option of the broad phase.", "KEY=VALUE", "--option", "-o")]
NarrowPhases = Annotated[
    list[str] | None, option("A narrow phase, instead of the scene's own.", "NAME", "--narrow-phase")
]
Until = Annotated[
    float | None, option("Run until this time; by default the scene's own `until`, or one time unit.", "TIME")
]
MaxContacts = Annotated[int | None, option("Stop after this number of contacts.", "N", least=0)]


def _compiled(context: typer.Context, way: str | None) -> str | None:
    """Sets how all loops of this process are compiled; the commands need not pass it on."""
    from kinetile.kernel.compiled import compiled_by_default

    ways = {"first": True, "meanwhile": None, "never": False}
    if way is not None:
        if way not in ways:
            raise typer.BadParameter(f"found {way}; expected first, meanwhile or never")
        context.with_resource(compiled_by_default(ways[way]))
    return way


Compiled = Annotated[
    str | None,
    typer.Option(
        "--compiled",
        metavar="first|meanwhile|never",
        help="Compile the loop first; meanwhile, and begin as Python (the default); or never.",
        callback=_compiled,
    ),
]


def _one_form(context: typer.Context, param: typer.CallbackParam, chosen: bool) -> bool:
    """Refuses two forms of the result together: the form that is read second finds the other."""
    for other in ("json", "csv", "quiet"):
        if chosen and context.params.get(other):
            raise typer.BadParameter(f"--{other} beside {param.opts[0]}; expected one of the two")
    return chosen


Json = Annotated[bool, flag("Print the result as JSON.", "--json", callback=_one_form)]
Csv = Annotated[bool, flag("Print the rows as CSV, with every digit.", "--csv", callback=_one_form)]
Quiet = Annotated[bool, flag("Print no result.", "--quiet", "-q", callback=_one_form)]
Verbose = Annotated[
    bool, flag("Print also the change of the energy, and the delay of structural events.", "--verbose")
]
Phases = Annotated[
    str | None, option("Broad phases; by default all that are installed.", "A,B,...", "--phases")
]
Seconds = Annotated[float, option("CPU seconds of one measured run, approximately.", "SECONDS", least=0)]
Repeats = Annotated[int, option("Measurements of each, in turn; medians count.", "N", least=1)]


def is_file_name(name: str) -> bool:
    """Returns True if this is the name of a scene's file, and not of its recipe."""
    return name.lower().endswith(".toml") or "/" in name or "\\" in name


MARKUP: Any = "rich" if sys.stdout is not None and sys.stdout.isatty() else None
"""Help has frames only on a terminal: in a pipe they would be padding."""


class CommandGroup(TyperGroup):
    """Commands; for a file in the place of a command, the message names the command that takes it."""

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Returns a command, whose help names its arguments without their Python types."""
        command: Any = super().get_command(ctx, cmd_name)
        if command is not None:
            command.rich_markup_mode = MARKUP
            for each in command.params:
                if isinstance(each, TyperArgument):  # Typer has no option that omits its type
                    each.display_type_rich = lambda ctx: None  # type: ignore[method-assign]
        return command

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Lists the commands with whole sentences, under the headings of Rich, if help is plain."""
        named = [(name, self.get_command(ctx, name)) for name in self.list_commands(ctx)]
        for heading in dict.fromkeys(getattr(each, "rich_help_panel", None) for _, each in named):
            those = [(name, each) for name, each in named if each.rich_help_panel == heading]
            with formatter.section(heading if isinstance(heading, str) else "Commands"):
                formatter.write_dl([(name, (each.help or "").partition("\n\n")[0]) for name, each in those])

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Returns a command with its arguments; fails for an unknown name."""
        if is_file_name(args[0]) and "run" in self.commands:
            ctx.fail(f"{args[0]!r} is not a command; expected {ctx.command_path} run {args[0]}")
        found = super().resolve_command(ctx, args)
        if found[1] is not None and (asks := found[1].get_help_option(ctx)) is not None:
            asks.metavar = ""
        return found

    def get_help_option(self, ctx: Any) -> Any:
        """Returns the option ``--help``, without a metavar: it takes no value."""
        asks = super().get_help_option(ctx)
        if asks is not None:
            asks.metavar = ""
        return asks


def find_scene(name: str, parameters: Sequence[str] | None) -> Scene:
    """Returns the scene of a TOML file (a name that ends in .toml, or contains a slash) or of a recipe."""
    if is_file_name(name):
        from kinetile.scene.files import load_scene

        if parameters:
            raise BadOption(
                f"a scene file takes no parameters (found {', '.join(parameters)}): they are for recipes, "
                "which `kinetile scenes` lists"
            )
        if not os.path.exists(name):
            raise BadOption(f"there is no scene file {name!r}")
        with file_errors(f"the scene file {name!r} cannot be read"):
            return load_scene(name)
    from kinetile.scene.by_name import make_scene, parse_parameters

    return make_scene(name, **parse_parameters(name, parameters or ()))


def until_or_default(scene: Scene, until: float | None, max_contacts: int | None) -> float | None:
    """Returns the end of a run: this one, the scene's, or one unit; None: only ``max_contacts`` ends it."""
    if until is not None:
        if not scene.start <= until < float("inf"):
            raise BadOption(
                f"--until is {until!r}; expected a time from the scene's start on, {scene.start!r}"
            )
        return until
    if scene.settings.until is not None or max_contacts is not None:
        return scene.settings.until  # it also ends a run with max_contacts, as in Simulation.run
    return scene.start + 1.0


def broad_choice(text: str | None, options: Sequence[str] | None) -> tuple[str | None, dict[str, Any]]:
    """Returns the broad phase of ``--broad-phase`` (None: not chosen) and its options, with ``--option``."""
    name, chosen = (None, {}) if text is None else read_phase(text)
    return name, chosen | read_assignments(options or (), "--option", read_option)


def narrow_choice(texts: Sequence[str] | None) -> dict[str, dict[str, Any]] | None:
    """Returns the narrow phases of ``--narrow-phase``, each with its options; None without one."""
    return dict(map(read_phase, texts or ())) or None


def phase_choices(text: str) -> list[tuple[str, dict[str, Any]]]:
    """Returns the broad phases of a list with commas, each with its options."""
    return [*map(read_phase, read_phases(text))]


def some_phases(text: str) -> list[tuple[str, dict[str, Any]]]:
    """Returns the broad phases of ``--phases``, with their options; it must name at least one."""
    chosen = phase_choices(text)
    if not chosen:
        raise BadOption("--phases names no phase; expected names, with commas between")
    return chosen


def read_numbers(text: str, kind: type, where: str) -> list[Any]:
    """Returns the numbers of a list with commas, at least one, each of a kind (int or float) and above 0."""
    numbers: list[Any] = []
    what = "whole numbers" if kind is int else "numbers"
    for piece in filter(None, (piece.strip() for piece in text.split(","))):
        try:
            numbers.append(_whole(piece) if kind is int else kind(piece))
        except (ValueError, typer.BadParameter):
            numbers.append(0)
        if not numbers[-1] > 0:
            raise BadOption(f"{where}: found {piece!r}; expected {what} greater than 0, with commas between")
    if not numbers:
        raise BadOption(f"{where} names no number; expected {what}, with commas between")
    return numbers


def registered_phase(text: str, kind: PluginKind = "broad phase") -> tuple[str, dict[str, Any]]:
    """Returns a phase's name (not an alias) and options; raises UnknownName."""
    from kinetile.plugin.registry import registry

    name, options = read_phase(text)
    return registry().spec(kind, name).name, options
