"""Commands that measure speed: ``choose``, ``bench`` with its benchmarks, and ``study``."""

from typing import Any

import typer

from kinetile.cli.options import CommandGroup, is_file_name
from kinetile_bench.cli.bench import choose, events, scene, thesis
from kinetile_bench.cli.study import run_study, study_rows, study_table

_PANEL = "Speed"


class _Bench(CommandGroup):
    """The benchmarks by name; a scene file in place of a name is a benchmark as well."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        if is_file_name(args[0]) and args[0] not in self.commands:
            args = ["scene", *args]
        return super().resolve_command(ctx, args)


bench = typer.Typer(
    cls=_Bench,
    help="Measure speed; `kinetile bench FILE.toml` measures the broad phases on a scene of your own.\n\n"
    "For example: kinetile bench events --bodies 400",
    no_args_is_help=True,
)
for _benchmark in (events, scene, thesis):
    bench.command()(_benchmark)

study = typer.Typer(
    cls=CommandGroup,
    help="Run a table of scenes, phases and seeds; stop, continue, read.\n\n"
    "For example: kinetile study run plan.toml",
    no_args_is_help=True,
)
study.command("run")(run_study)
study.command("table")(study_table)
study.command("rows")(study_rows)

app = typer.Typer()
app.command(rich_help_panel=_PANEL)(choose)
app.add_typer(bench, name="bench", rich_help_panel=_PANEL)
app.add_typer(study, name="study", rich_help_panel=_PANEL)
