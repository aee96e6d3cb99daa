"""The command that exports: ``kinetile export`` writes frames of a run for other programs."""

from pathlib import Path
from typing import Annotated

from kinetile.cli import options as cli
from kinetile.cli.files import check_ending, check_new, file_errors
from kinetile.cli.terminal import echo, make_ready
from kinetile.errors import BadOption

MOST_FRAMES = 10_000_000
"""The most frames in a file: more are a mistake in --every."""


def export(
    source: Annotated[
        str, cli.argument("An event file (.parquet), a recipe's name or a scene's .toml file.", "SOURCE")
    ],
    out: Annotated[Path, cli.option("A new file that ends in .xyz, .extxyz or .gsd.", "FILE", "--to")],
    parameters: cli.Parameters = None,
    broad_phase: cli.BroadPhase = None,
    option: cli.Options = None,
    every: Annotated[
        float | None, cli.option("Time between frames; a hundredth of the whole.", "TIME")
    ] = None,
    begin: Annotated[
        float | None, cli.option("The first frame; without it, the start.", "TIME", "--from")
    ] = None,
    until: Annotated[
        float | None, cli.option("No frame after this time; by default the end of the run.", "TIME")
    ] = None,
    overwrite: Annotated[bool, cli.flag("Replace the file of --to.", "--overwrite")] = False,
    compiled: cli.Compiled = None,
) -> None:
    """Writes frames of a run for OVITO, ASE and others: extended XYZ, or GSD (needs the extra `export`).

    For example: kinetile export grid --every 0.1 --until 2 --to frames.xyz
    """
    from kinetile.records.frames import FORMS, check_form, frames_of, write_frames
    from kinetile.records.trajectory import Trajectory
    from kinetile.run.simulation import Simulation

    check_ending("--to", out, FORMS)
    check_form(out)
    check_new("--to", out, overwrite)
    run: Simulation | Trajectory
    if source.lower().endswith(".parquet"):
        if parameters or broad_phase or option:
            raise BadOption("an event file is a run that is over: it takes no parameters and no phases")
        with file_errors():
            run = Trajectory.read(source)
        end = run.end if until is None else until
    else:
        scene = cli.find_scene(source, parameters)
        name, options = cli.broad_choice(broad_phase, option)
        run = Simulation(scene, name, options=options or None, keep_contacts=False)
        make_ready(run)
        end = cli.until_or_default(scene, until, None) or scene.start
    start = run.scene.start if begin is None else begin
    step = (end - start) / 100 if every is None else every
    if not run.scene.start <= start <= end < float("inf"):
        raise BadOption(f"--from {start!r} --until {end!r}; expected times from the scene's start on")
    if not 0.0 < step < float("inf") and (end > start or every is not None):
        raise BadOption(f"--every is {step!r}; expected a time greater than 0")
    many = (end - start) / step * (1.0 + 1e-12) if end > start else 0.0
    if not many < MOST_FRAMES:
        raise BadOption(f"--every {step!r} makes {many:,.0f} frames; expected at most {MOST_FRAMES:,}")
    times = (min(start + k * step, end) for k in range(int(many) + 1))
    with file_errors(f"--to {out}"):
        count = write_frames(out, run.scene, frames_of(run, times))
    last = min(start + int(many) * step, end)
    echo(f"{out}: {count:,} frames, from time {start:.10g} to {last:.10g}")
