"""The command ``kinetile view``: a page in which a run plays."""

from __future__ import annotations

from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinetile.cli.options import Parameters, find_scene
from kinetile.cli.terminal import exit_codes, notice
from kinetile.errors import BadOption, RecordError
from kinetile.plugin.choices import read_phase

if TYPE_CHECKING:
    from kinetile.show.player import View

__all__ = ["VIEWS_GROUP", "view"]

VIEWS_GROUP = "kinetile.views"
"""Entry points by which plugins show scene files of their own kind: each is a function of a path, a broad
phase (or None) and ``until``, and returns a View, or None for a file that is not of its kind."""


def view(
    scene: Annotated[
        str,
        typer.Argument(
            metavar="SCENE",
            help="A recipe's name, a .toml file (a case that `kinetile conform` has saved, too), or an event "
            "file (.parquet).",
        ),
    ] = "grid",
    parameters: Parameters = None,
    broad_phase: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="The broad phase, with options if need be: sap-1d:axis=y."),
    ] = None,
    beside: Annotated[
        str | None, typer.Option(metavar="NAME", help="Another broad phase, beside the first, on one clock.")
    ] = None,
    begin: Annotated[
        float | None, typer.Option("--from", metavar="TIME", help="Show from this time on; the start.")
    ] = None,
    until: Annotated[
        float | None, typer.Option(help="Show until this time; the scene's own `until`, or one time unit.")
    ] = None,
    steps: Annotated[
        bool,
        typer.Option(
            "--steps/--no-steps", help="Step through the run too, to show what the broad phase does."
        ),
    ] = True,
    out: Annotated[Path, typer.Option(metavar="FILE", help="A new .html file.")] = Path("view.html"),
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the file of --out.")] = False,
    show: Annotated[bool, typer.Option("--open", help="Open the page in the browser.")] = False,
) -> None:
    """Write a page in which a run plays: one file, exact at any moment, event by event."""
    with exit_codes():
        _check_target(out, overwrite)
        page = _view(scene, parameters, broad_phase, beside, begin, until, steps)
        for note in page.notes:
            notice(f"kinetile: {note}")
        path = page.save(out, overwrite=overwrite)
    typer.echo(f"{path}: {path.stat().st_size / 1e6:.2f} MB")
    if show:
        typer.launch(path.resolve().as_uri())


def _view(
    scene: str,
    parameters: list[str] | None,
    broad_phase: str | None,
    beside: str | None,
    begin: float | None,
    until: float | None,
    steps: bool,
) -> View:
    phases: list[tuple[str | None, dict[str, Any]]] = [
        read_phase(each) for each in (broad_phase, beside) if each is not None
    ]
    if beside is not None and broad_phase is None:
        raise BadOption("--beside is for a second broad phase: name the first with --broad-phase")
    if scene.lower().endswith(".parquet"):
        from kinetile.show.player import view_file

        if phases or parameters:
            raise BadOption(
                f"{scene} is shown as it was recorded: --broad-phase, --beside and --set are for scenes"
            )
        try:
            return view_file(scene, begin=begin, until=until)
        except RecordError as error:
            raise BadOption(str(error)) from error
    path = Path(scene)
    if scene.lower().endswith(".toml") and path.is_file() and not beside:
        for point in metadata.entry_points(group=VIEWS_GROUP):
            view: View | None = point.load()(path, phases[0] if phases else None, until=until)
            if view is not None:
                if begin is not None or parameters:
                    raise BadOption(f"{scene} is a saved case, and plays from its start: no --from, no --set")
                return view
    from kinetile.show.player import view_scene

    found = find_scene(scene, parameters)
    title = path.name if path.is_file() else None
    return view_scene(found, phases or [(None, {})], begin=begin, until=until, steps=steps, title=title)


def _check_target(out: Path, overwrite: bool) -> None:
    """Raise BadOption before anything is run for a file that cannot be written."""
    if out.suffix.lower() not in (".html", ".htm"):
        raise BadOption(f"--out is {str(out)!r}; expected a name that ends in .html")
    if out.exists() and not overwrite:
        raise BadOption(f"--out: {out} is there already: choose another name, or say --overwrite")
    if not out.absolute().parent.is_dir():
        raise BadOption(f"--out {out}: there is no folder {str(out.absolute().parent)!r}")
