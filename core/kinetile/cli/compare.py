"""The command ``kinetile compare``: one scene under several broad phases."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinetile.cli import options as cli
from kinetile.cli.output import printed, scene_summary, show, table_of
from kinetile.cli.terminal import DIFFERENT, EXIT_FAULT, Bar, make_ready, notice

if TYPE_CHECKING:
    from kinetile.comparison import Comparison, PhaseOutcome
    from kinetile.run.simulation import Simulation


_PHASES = "Broad phases, the first as the reference; by default all that take the scene."
ComparedPhases = Annotated[str | None, cli.option(_PHASES, "A,B,...")]


def compare(
    scene: cli.SceneName = "grid",
    parameters: cli.Parameters = None,
    phases: ComparedPhases = None,
    narrow_phase: cli.NarrowPhases = None,
    until: cli.Until = None,
    max_contacts: cli.MaxContacts = None,
    compiled: cli.Compiled = None,
    json: cli.Json = False,
    csv: cli.Csv = False,
) -> None:
    """Runs a scene under several broad phases; exit code 1, with the first difference, unless all agree.

    For example: kinetile compare lattice --phases naive,cells --until 4
    """
    from kinetile.comparison import Comparison
    from kinetile.comparison import compare as compare_phases

    done: list[PhaseOutcome] = []
    this_scene = cli.find_scene(scene, parameters)
    end = cli.until_or_default(this_scene, until, max_contacts)
    choices = None if phases is None else cli.phase_choices(phases)
    with Bar("comparing", this_scene.start, max_contacts) as bar:

        def start(label: str, simulation: Simulation) -> None:
            bar.what = label
            make_ready(simulation)

        try:
            comparison = compare_phases(
                this_scene,
                choices,
                end,
                max_contacts=max_contacts,
                narrow_phases=cli.narrow_choice(narrow_phase),
                start=start,
                finish=done.append,
                progress=bar,
            )
        except KeyboardInterrupt:
            _print_comparison(Comparison(tuple(done)), None, json, csv)
            raise
    run = {"until": end, "max_contacts": max_contacts}
    _print_comparison(comparison, {"scene": scene_summary(this_scene), "run": run}, json, csv)
    if not comparison.identical:
        raise typer.Exit(DIFFERENT)
    if comparison.fault is not None:
        notice("kinetile: the phases agree, but none of them reached the requested end")
        raise typer.Exit(EXIT_FAULT)


def _print_comparison(comparison: Comparison, head: dict[str, Any] | None, json: bool, csv: bool) -> None:
    """Prints a comparison, or the finished runs of an interrupted one (no head)."""
    from kinetile.versions import versions

    status = {"status": "complete" if head else "interrupted", "versions": versions()}
    found = comparison.as_dict() | ({} if head else {"identical": None})
    if printed(status | (head or {}) | found, found["phases"], json=json, csv=csv):
        return
    columns: dict[str, Callable[[PhaseOutcome], str]] = {
        "broad phase": lambda each: each.phase,
        "> contacts": lambda each: f"{each.contacts:,}",
        "> time": lambda each: f"{each.time:.10g}",
        "> events": lambda each: f"{each.events:,}",
        "> CPU s": lambda each: f"{each.cpu_seconds:.3g}",
        "fingerprint": lambda each: each.fingerprint[:16],
        "ended by": lambda each: (each.fault or "").partition(":")[0],
    }
    show(table_of(comparison.outcomes, columns))
    if head and comparison.identical:
        contacts = comparison.outcomes[0].contacts
        show(f"identical: {contacts:,} contacts, the end and every body's state agree bit for bit")
        if comparison.fault is not None:
            show(f"but every run ended in a fault: {comparison.fault}")
    show(*map(str, comparison.divergences))
