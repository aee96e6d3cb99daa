"""The command ``kinetile bench frames``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from kinetile.cli.json_output import printed
from kinetile.cli.options import Csv, Json, some_phases
from kinetile.cli.terminal import DIFFERENT, Bar, exit_codes, make_ready

if TYPE_CHECKING:
    from kinetile_bench.own.frames import FrameBench

__all__ = ["frames"]


def frames(
    phases: Annotated[
        str, typer.Option(metavar="A,B,...", help="Broad phases.")
    ] = "cells,sap-1d,sweep-tiling",
    frames: Annotated[int, typer.Option(metavar="N", help="Frames, a sixtieth of a unit each.")] = 600,
    bodies: Annotated[
        int, typer.Option(min=1, metavar="N", help="Number of discs; the next square number is taken.")
    ] = 1000,
    density: Annotated[float, typer.Option(help="Area fraction.")] = 0.25,
    speed: Annotated[float, typer.Option(help="Root of the mean square speed; the box is 1 wide.")] = 1.0,
    turned: Annotated[int, typer.Option(min=0, help="Discs that turn in each frame.")] = 50,
    exchanged: Annotated[int, typer.Option(min=0, help="Discs that go in each frame, and that come.")] = 5,
    json: Json = False,
    csv: Csv = False,
) -> None:
    """Measure what a frame of a game costs: discs turn, go and come, time runs on, all is read out.

    Exit code 1 unless all phases give the same contacts.
    """
    from kinetile_bench.growth import square_at_least
    from kinetile_bench.own.frames import Play, bench_frames

    done: list[FrameBench] = []
    with exit_codes(), Bar("playing") as bar:
        chosen = some_phases(phases)
        play = Play(square_at_least(bodies), density, speed, turned=turned, exchanged=exchanged)
        try:
            bench_frames(
                chosen,
                frames,
                play,
                start=lambda label, simulation: make_ready(simulation),
                finish=done.append,
                progress=lambda at, total: bar.show(at / total, f"{at:,} of {total:,} frames"),
            )
        finally:
            bar.close()
            if done:
                _print(done[-1], json, csv)
    if not done[-1].identical:
        raise typer.Exit(DIFFERENT)


def _print(measured: FrameBench, json: bool, csv: bool) -> None:
    result = measured.as_dict()
    if printed(result, result["rows"], json=json, csv=csv):
        return
    from kinetile.cli.tables import show
    from kinetile_bench.cli.play_tables import frames_notes, frames_table

    show(frames_table(measured), *frames_notes(measured))
