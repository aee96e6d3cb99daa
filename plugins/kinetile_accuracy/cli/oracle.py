"""The command ``kinetile oracle``: the certified contacts of a scene, or how far a run agrees with them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinetile.cli.json_output import printed, scene_summary
from kinetile.cli.options import (
    Csv,
    Json,
    MaxContacts,
    Parameters,
    SceneName,
    Until,
    find_scene,
    until_or_default,
)
from kinetile.cli.terminal import DIFFERENT, FAULT, Bar, exit_codes, make_ready, notice
from kinetile.plugin.choices import read_phase

if TYPE_CHECKING:
    from rich.table import Table

    from kinetile.scene import Scene
    from kinetile_accuracy.certified.certify import Agreement
    from kinetile_accuracy.certified.oracle import CertifiedContact, CertifiedRun, OracleProgress

__all__ = ["oracle"]

SHOWN = 20
"""Contacts that the table shows from each end of a long list."""


def oracle(
    scene: SceneName,
    parameters: Parameters = None,
    until: Until = None,
    max_contacts: MaxContacts = None,
    against: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Say how far a run under this broad phase agrees."),
    ] = None,
    json: Json = False,
    csv: Csv = False,
) -> None:
    """Certify the contacts of a scene in ball arithmetic; exit code 1 where a run differs."""
    from kinetile_accuracy.certified.oracle import Oracle

    found: Agreement | None = None
    with exit_codes():
        this_scene = find_scene(scene, parameters)
        end = until_or_default(this_scene, until, max_contacts)
        asked = {"until": end, "max_contacts": max_contacts, "against": against}
        truth = Oracle(this_scene)
        with Bar("certifying", this_scene.start, max_contacts) as bar:
            progress = _shown_on(bar, this_scene, end, max_contacts)
            try:
                if against is None:
                    truth.run(end, max_contacts=max_contacts, progress=progress)
                else:
                    found = _run_against(against, truth, end, max_contacts, progress)
            except KeyboardInterrupt:
                bar.close()
                _print(this_scene, asked, truth.certified, None, json, csv)
                raise
    _print(this_scene, asked, truth.certified, found, json, csv)
    if found is not None and found.disagreement is not None:
        raise typer.Exit(DIFFERENT)
    if not (truth.certified.complete if found is None else found.complete):
        why = truth.certified.ending if found is None or found.fault is None else found.fault
        notice(f"kinetile: the end that was asked for was not reached: {why}")
        raise typer.Exit(FAULT)


def _run_against(
    against: str,
    truth: Any,
    until: float | None,
    max_contacts: int | None,
    progress: Callable[[OracleProgress], None],
) -> Agreement:
    from kinetile.run.simulation import Simulation
    from kinetile_accuracy.certified.certify import certify

    name, options = read_phase(against)
    simulation = Simulation(truth.scene, name, options=options or None)
    make_ready(simulation)
    return certify(simulation, until=until, max_contacts=max_contacts, oracle=truth, progress=progress)


def _shown_on(
    bar: Bar, scene: Scene, until: float | None, max_contacts: int | None
) -> Callable[[OracleProgress], None]:
    """Return what shows the oracle's progress on a bar."""

    def show(state: OracleProgress) -> None:
        shares = []
        if until is not None and until > scene.start:
            shares.append((state.time - scene.start) / (until - scene.start))
        if max_contacts:
            shares.append(state.contacts / max_contacts)
        text = f"{state.bits} bits: time {state.time:.6g}, {state.contacts:,} contacts"
        bar.show(min(max(shares), 1.0) if shares else None, text)

    return show


def _print(
    scene: Scene,
    asked: dict[str, Any],
    certified: CertifiedRun,
    found: Agreement | None,
    json: bool,
    csv: bool,
) -> None:
    if json or csv:
        from kinetile.records.versions import versions

        result: dict[str, Any] = {"versions": versions(), "scene": scene_summary(scene), "run": asked}
        result["oracle"] = {
            "ended": certified.ended,
            "why": certified.ending,
            "bits": certified.bits,
            "undecidable": certified.undecidable and certified.undecidable._asdict(),
            "contacts": [_plainly(contact) for contact in certified.contacts],
        }
        result |= {} if found is None else {"agreement": found.as_dict()}
        printed(result, result["oracle"]["contacts"], json=json, csv=csv)
        return
    from kinetile.cli.tables import show

    if found is not None:
        show(str(found), f"the oracle: {certified}")
    elif certified.contacts:
        show(_table(certified.contacts), str(certified))
    else:
        show(str(certified))


def _plainly(contact: CertifiedContact) -> dict[str, Any]:
    """Return a contact in plain types: its time as all digits that are certain, and as the nearest double."""
    time = {"time": contact.time.decimal(40), "nearest": contact.time.nearest}
    return time | {"a": contact.a, "b": contact.b, "tied": contact.tied, "head_on": contact.head_on}


def _table(contacts: Sequence[CertifiedContact]) -> Table:
    """Return the contacts as a table; of very many, the first and the last."""
    from kinetile.cli.tables import empty_table
    from kinetile.kernel.log import WALLS

    table = empty_table("> contact", "| time", "", "> disc", "with", "> head-on")
    left_out = range(SHOWN, len(contacts) - SHOWN)
    for index, contact in enumerate(contacts):
        if index in left_out:
            if index == SHOWN:
                table.add_row("...", f"({len(left_out):,} more)")
            continue
        partner = f"disc {contact.b}" if contact.b >= 0 else f"{WALLS[contact.b]} wall"
        same = "same time" if contact.tied else ""
        table.add_row(
            f"{index}", contact.time.decimal(), same, f"{contact.a}", partner, f"{contact.head_on:.6f}"
        )
    return table
