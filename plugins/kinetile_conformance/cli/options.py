"""Options that the commands of the kit share."""

from __future__ import annotations

from typing import Annotated

import typer

EXAMPLES = 100
"""Scenes drawn for each check; ``runner.EXAMPLES``, without what that imports."""

Ask = Annotated[
    str | None,
    typer.Option(
        metavar="WHAT",
        help="Of programs: contacts of a run, pairs that may touch, or casts of two bodies. "
        "[default: contacts]",
    ),
]
Within = Annotated[
    float | None,
    typer.Option(metavar="D", help="Of programs: times to a relative distance, in place of ticks."),
]
Examples = Annotated[int, typer.Option(min=1, metavar="N", help="Scenes drawn for each check.")]
Checks = Annotated[
    list[str] | None, typer.Option("--check", metavar="CHECK", help="Run this check, not all.")
]
Seed = Annotated[int, typer.Option(metavar="N", help="What the drawing of scenes begins with.")]
NarrowPhases = Annotated[
    list[str] | None,
    typer.Option(
        "--narrow-phase",
        metavar="NAME",
        help="A narrow phase to judge with it, instead of the usual one; with options if need be.",
    ),
]
Answer = Annotated[
    str | None, typer.Option(metavar="NAME", help="A response to judge with it; with options if need be.")
]
