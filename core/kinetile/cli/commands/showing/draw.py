"""The command ``kinetile draw``: a moment of a scene as a picture, with the structure of its broad phase."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kinetile.cli.options import Parameters, SceneName, find_scene
from kinetile.cli.terminal import Bar, exit_codes, make_ready
from kinetile.errors import BadOption
from kinetile.plugin.choices import read_assignments, read_phase

if TYPE_CHECKING:
    from kinetile.run.simulation import Simulation

__all__ = ["draw"]

FORMS = ("svg", "png", "pdf")


def draw(
    scene: SceneName,
    out: Annotated[Path, typer.Option(metavar="FILE", help="A new file that ends in .svg, .png or .pdf.")],
    parameters: Parameters = None,
    at: Annotated[
        float | None, typer.Option(metavar="TIME", help="The moment; without it, the start.")
    ] = None,
    broad_phase: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="The broad phase, with options if need be: sap-1d:axis=y."),
    ] = None,
    option: Annotated[
        list[str] | None,
        typer.Option("--option", "-o", metavar="KEY=VALUE", help="An option of the broad phase."),
    ] = None,
    roles: Annotated[
        str | None,
        typer.Option(metavar="ROLE,...", help="Of the structure only these: bound, tile, cell, pair, ..."),
    ] = None,
    velocities: Annotated[
        bool, typer.Option("--velocities", help="Draw velocities, too, as arrows.")
    ] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the file of --out.")] = False,
) -> None:
    """Draw a moment of a scene, with what its broad phase keeps: bounds, tiles, cells, pairs."""
    with exit_codes():
        form = out.suffix.lower().lstrip(".")
        if form not in FORMS:
            raise BadOption(f"--out is {str(out)!r}; expected a name that ends in .svg, .png or .pdf")
        _check_target(out, overwrite)
        if form != "svg":
            from kinetile.show.picture.printed import check_printing

            check_printing()
        this_scene = find_scene(scene, parameters)
        if at is not None and not this_scene.start <= at < float("inf"):
            raise BadOption(
                f"--at is {at!r}; expected a time from the scene's start on, {this_scene.start!r}"
            )
        name, options = (None, {}) if broad_phase is None else read_phase(broad_phase)
        options |= read_assignments(option or (), "--option")

        from kinetile.run.simulation import Simulation

        simulation = Simulation(this_scene, name, options=options or None)
        wanted = None if roles is None else [role.strip() for role in roles.split(",")]
        _run_to(simulation, at)
        _write(out, _drawn(simulation, wanted, form, velocities))


def _run_to(simulation: Simulation, at: float | None) -> None:
    make_ready(simulation)
    if at is not None and at > simulation.scene.start:
        with Bar("running", simulation.scene.start, None) as bar:
            simulation.run(until=at, progress=bar)


def _drawn(simulation: Simulation, roles: list[str] | None, form: str, velocities: bool) -> bytes:
    from kinetile.show.picture import as_printed, as_svg, take_picture

    try:
        picture = take_picture(simulation, roles)
    except ValueError as error:
        raise BadOption(f"--roles: {error}") from error
    return as_svg(picture, velocities) if form == "svg" else as_printed(picture, form, velocities)


def _check_target(out: Path, overwrite: bool) -> None:
    from kinetile.scene.targets import writable_target

    try:
        target = writable_target(out)
    except OSError as error:
        raise BadOption(f"--out {out}: {error.strerror}") from error
    if target.exists() and not overwrite:
        raise BadOption(f"--out: {out} is there already: choose another name, or say --overwrite")
    if not target.parent.is_dir():
        raise BadOption(f"--out {out}: there is no folder {str(target.parent)!r}")


def _write(out: Path, drawn: bytes) -> None:
    try:
        out.write_bytes(drawn)
    except OSError as error:
        raise BadOption(f"--out {out}: {error.strerror or error}") from error
