"""The commands that show: ``kinetile draw`` (a moment as a picture) and ``view`` (a run as a page)."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from kinetile.cli import options as cli
from kinetile.cli.files import check_ending, check_new, file_errors
from kinetile.cli.terminal import Bar, FirstSignal, echo, make_ready, notice
from kinetile.errors import BadOption
from kinetile.plugin.choices import read_phase, read_phases
from kinetile.targets import write_file

if TYPE_CHECKING:
    from kinetile.show.player import View
    from kinetile.show.player.view import ShownPhase

VIEWS_GROUP = "kinetile.views"
"""The group of entry points of plugins that show their own kind of scene files: each is a function of a path,
a broad phase (or None) and ``until``, and returns a View, or None for a file of another kind."""

PairsOption = Annotated[
    bool | None, cli.flag("Draw lines between pairs of bodies; by default, up to 400.", "--pairs/--no-pairs")
]


def draw(
    scene: cli.SceneName,
    out: Annotated[Path, cli.option("A new file that ends in .svg, .png or .pdf.", "FILE")],
    parameters: cli.Parameters = None,
    at: Annotated[float | None, cli.option("The moment; without it, the start.", "TIME")] = None,
    broad_phase: cli.BroadPhase = None,
    option: cli.Options = None,
    roles: Annotated[
        str | None, cli.option("Only these parts of the structure: bound, tile, cell, pair, ...", "ROLE,...")
    ] = None,
    pairs: PairsOption = None,
    velocities: Annotated[bool, cli.flag("Draw velocities as arrows.", "--velocities")] = False,
    bare: Annotated[bool, cli.flag("Draw no numbers, caption and legend (.svg).", "--bare")] = False,
    space_time: Annotated[
        str | None,
        cli.option(
            "Draw a run instead of a moment: x or y to the right, time upwards, from --at to --until.",
            "AXIS",
            "--space-time",
        ),
    ] = None,
    until: Annotated[
        float | None,
        cli.option("The end of --space-time; without it, the scene's own, or one time unit.", "TIME"),
    ] = None,
    overwrite: Annotated[bool, cli.flag("Replace the file of --out.", "--overwrite")] = False,
    compiled: cli.Compiled = None,
) -> None:
    """Draws a moment of a scene with the structure of its broad phase: bounds, tiles, cells, pairs.

    For example: kinetile draw grid --at 0.1 --broad-phase sap-2d --out moment.svg
    """
    form = check_ending("--out", out, (".svg", ".png", ".pdf"))[1:]
    check_new("--out", out, overwrite)
    if bare and form != "svg":
        raise BadOption(f"--bare is for an .svg; {out} is a .{form}")
    if form != "svg":
        from kinetile.show.printed import check_printing

        check_printing()
    this_scene = cli.find_scene(scene, parameters)
    start, last = this_scene.start, this_scene.settings.until if until is None else None
    if at is not None and not (start <= at < float("inf") and (last is None or at <= last)):
        to = "" if last is None else f", to its end, {last!r}"
        raise BadOption(f"--at is {at!r}; expected a time from the scene's start on, {start!r}{to}")
    name, options = cli.broad_choice(broad_phase, option)

    from kinetile.run.simulation import Simulation

    simulation = Simulation(this_scene, name, options=options or None)
    wanted = None if roles is None else [role.strip() for role in roles.split(",")]
    if space_time is not None and (form != "svg" or wanted is not None or pairs is not None or velocities):
        raise BadOption("--space-time draws an .svg, with no structure and no velocities")
    if until is not None and space_time is None:
        raise BadOption("--until is the end of --space-time; a moment is chosen by --at")
    make_ready(simulation)
    if at is not None and at > this_scene.start:
        with Bar("running", this_scene.start) as bar:
            simulation.run(until=at, progress=bar)
    if space_time is None:
        from kinetile.show.picture import PAIRS_DRAWN, take_picture
        from kinetile.show.printed import as_printed
        from kinetile.show.svg import as_svg

        try:
            picture = take_picture(simulation, wanted, pairs=pairs)
        except ValueError as error:
            raise BadOption(f"--roles: {error}") from error
        if picture.left_out:
            notice(f"kinetile: pairs are left out, they are more than {PAIRS_DRAWN}; --pairs draws them")
        drawn = as_svg(picture, velocities, bare) if form == "svg" else as_printed(picture, form, velocities)
    else:
        from kinetile.show.space_time import space_time_svg, take_space_time

        end = cli.until_or_default(this_scene, until, None)
        if end is None or not simulation.time < end:
            raise BadOption(f"--until is {end!r}; expected a time after --at, {simulation.time!r}")
        drawn = space_time_svg(take_space_time(simulation, end, space_time))
    with file_errors(f"--out {out}"):
        write_file(out, drawn)


def view(
    scene: Annotated[
        str,
        cli.argument(
            "A recipe's name, a .toml file (a scene, or a case that `kinetile conform` saved), or an event "
            "file (.parquet); without it, the recipe grid, by default with 60 bodies.",
            "SCENE",
        ),
    ] = "",
    parameters: cli.Parameters = None,
    broad_phase: cli.BroadPhase = None,
    beside: Annotated[
        str | None, cli.option("More broad phases, beside the first, on the same clock.", "NAME,...")
    ] = None,
    begin: Annotated[
        float | None, cli.option("Show from this time on; without it, the start.", "TIME", "--from")
    ] = None,
    until: Annotated[
        float | None, cli.option("Show until this time; the scene's own `until`, or one time unit.", "TIME")
    ] = None,
    at: Annotated[float | None, cli.option("The time that the page shows first.", "TIME")] = None,
    steps: Annotated[
        bool, cli.flag("Include every step of the broad phase between contacts.", "--steps/--no-steps")
    ] = True,
    pairs: PairsOption = None,
    out: Annotated[
        Path, cli.option("A new file: .html, a page, or .gif or .mp4, a film (extra `film`).", "FILE")
    ] = Path("view.html"),
    seconds: Annotated[
        float | None, cli.option("Duration of the film in seconds; 8 by default.", "SECONDS")
    ] = None,
    width: Annotated[int | None, cli.option("Width of the film in pixels; 640.", "N")] = None,
    overwrite: Annotated[bool, cli.flag("Replace an existing file.", "--overwrite")] = False,
    show: Annotated[bool, cli.flag("Open the page in the browser.", "--open")] = False,
    compiled: cli.Compiled = None,
) -> None:
    """Writes an interactive page that plays a run: one file, exact at any moment, event by event.

    With --out FILE.gif or FILE.mp4, a film of the run.

    For example: kinetile view random --beside cells --broad-phase naive --open
    """
    form = check_ending("--out", out, (".html", ".gif", ".mp4"))
    check_new("--out", out, overwrite)
    if not scene and not parameters:
        parameters, pairs = ["bodies=60"], bool(pairs)  # lines between pairs would hide so many bodies
    scene = scene or "grid"
    of_film = {"seconds": seconds, "width": width}
    options: dict[str, Any] = {name: value for name, value in of_film.items() if value is not None}
    if form == ".html":
        for given in options:
            raise BadOption(f"--{given} is for a film: expected --out FILE.gif")
        page = _view(scene, parameters, broad_phase, beside, (begin, until, at), steps, pairs)
        for note in page.notes:
            notice(f"kinetile: {note}")
        page.save(out, overwrite=overwrite)
    else:
        if beside is not None or at is not None or scene.lower().endswith(".parquet"):
            raise BadOption("a film shows a scene under one broad phase: no --beside, --at, event file")
        from kinetile.run.simulation import Simulation
        from kinetile.show.film import film
        from kinetile.show.player.view import window
        from kinetile.show.printed import check_printing

        check_printing("Drawing a film")
        this_scene = cli.find_scene(scene, parameters)
        begin, until = window(this_scene, begin, until)
        name, of_phase = cli.broad_choice(broad_phase, None)
        simulation = Simulation(this_scene, name, options=of_phase or None)
        shown = film(simulation, until, begin=begin, structure=steps, pairs=pairs, **options)
        make_ready(simulation)
        with FirstSignal() as signals, Bar("drawing") as bar:

            def progress(done: int, total: int) -> None:
                signals.check()
                bar.show(done / total, f"{done} of {total} frames")

            shown.save(out, overwrite=overwrite, progress=progress)
    echo(f"{out}: {out.stat().st_size / 1e6:.2f} MB")
    if show:
        typer.launch(out.resolve().as_uri())


def _view(
    scene: str,
    parameters: list[str] | None,
    broad_phase: str | None,
    beside: str | None,
    times: tuple[float | None, float | None, float | None],
    steps: bool,
    pairs: bool | None,
) -> View:
    from kinetile.show.player import view_file, view_scene

    begin, until, at = times
    first = [] if broad_phase is None else [broad_phase]
    phases: list[ShownPhase] = [*map(read_phase, [*first, *read_phases(beside or "")])]
    if beside is not None and not first:
        raise BadOption("--beside is for more broad phases: name the first with --broad-phase")
    if scene.lower().endswith(".parquet"):
        if phases or parameters or times != (None, None, None):
            raise BadOption(
                f"{scene} is shown as it was recorded: --broad-phase, --beside, --set, --from, --until and "
                "--at are for scenes"
            )
        with file_errors():
            return view_file(scene)
    if scene.lower().endswith(".toml") and os.path.isfile(scene) and not beside:
        from kinetile.plugin.registry import installed

        for plugin in installed(VIEWS_GROUP):
            with file_errors(f"the scene file {scene!r} cannot be read"):
                view: View | None = cast(Any, plugin.load())(
                    Path(scene), phases[0] if phases else None, until=until
                )
            if view is not None:
                if begin is not None or parameters or at is not None:
                    raise BadOption(
                        f"{scene} is a saved case, and plays from its start: no --from, no --set, no --at"
                    )
                return view
    found = cli.find_scene(scene, parameters)
    wanted: dict[str, Any] = {"begin": begin, "until": until, "at": at, "steps": steps, "pairs": pairs}
    with Bar("recording") as bar:
        return view_scene(found, phases or [(None, {})], progress=bar.show, **wanted)
