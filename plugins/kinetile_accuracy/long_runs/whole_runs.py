"""The part ``specification`` of the report: whole runs, certified contact by contact to their ends."""

from dataclasses import dataclass
from typing import Annotated

import kinetile as kt
from kinetile_accuracy import sections
from kinetile_accuracy.drawing import LOOKS, new_figure
from kinetile_accuracy.sections import Column, grouped, listed
from kinetile_accuracy.specification.certify import certify_log

SCENES: dict[str, tuple[str, dict[str, float | int]]] = {
    "dense gas": ("grid", {"bodies": 100, "density": 0.5}),
    "dilute gas": ("grid", {"bodies": 100, "density": 0.01}),
    "lattice of ties": ("lattice", {}),
    "many discs": ("grid", {"bodies": 400, "density": 0.25}),
}
"""Recipe and parameters, by the name of a scene here."""

CONTACTS: dict[sections.Budget, int] = {"quick": 2_000, "normal": 20_000, "full": 100_000}


@dataclass(frozen=True)
class WholeRun:
    """A run, certified contact by contact."""

    scene: Annotated[str, Column("the scene", "scene")]
    phase: Annotated[str, Column("the broad phase of the run", "broad phase")]
    bodies: Annotated[int, Column("how many discs", "discs")]
    contacts: Annotated[int, Column("contacts of the run", "contacts")]
    lines: Annotated[int, Column("how many of them, from the first one on, are right", "right")]
    right: Annotated[bool, Column("whether all are")]
    verdict: Annotated[str, Column("the certifier's sentence", "verdict")]


def measure(budget: sections.Budget, progress: sections.ReportProgress) -> sections.Section:
    """Certifies some runs to their ends."""
    rows: list[WholeRun] = []
    for name in SCENES:
        progress("runs against the specification", len(rows), len(SCENES))
        rows.append(certify_run(name, CONTACTS[budget]))
    wrong = [f"{row.scene}: {row.verdict}" for row in rows if not row.right]
    right = f"{sum(row.lines for row in rows):,} of {sum(row.contacts for row in rows):,} contacts"
    return sections.Section(
        name="specification",
        title="Certified to the end",
        about=(
            "The contacts of a scene are defined by a specification: exact times, rounded down to a tick, "
            "and plans that are rounded in a fixed way. So a run in doubles can be right to its end, and "
            "whether it is can be decided in integers, contact by contact (kinetile certify-log), without "
            f"the kernel. The runs are under {listed(list(grouped(rows, 'phase')))}."
        ),
        findings=tuple(wrong),
        claims=(
            sections.Claim("Every contact of a run is the one that the specification says", right, not wrong),
        ),
        tables=(sections.Table("runs", "The runs, and the certifier's verdict on each.", tuple(rows)),),
        pictures=(
            sections.ReportFigure(
                "runs",
                "The contacts of each run that are right, from the first one on; the frame is all of them.",
                lambda: _draw(rows),
            ),
        ),
    )


def _draw(rows: list[WholeRun]) -> sections.Figure:
    figure, panel = new_figure(height=0.5 + 0.26 * len(rows))
    names = [f"{row.scene}, {row.bodies:,} bodies" for row in rows]
    panel.barh(names, [row.contacts for row in rows], color="none", edgecolor="0.3")
    panel.barh(names, [row.lines for row in rows], color=LOOKS[0][0], alpha=0.7)
    panel.invert_yaxis()
    panel.set(xlabel="contacts")
    return figure


def certify_run(name: str, contacts: int) -> WholeRun:
    """Runs a scene for a number of contacts, or to its last one, and certifies each contact."""
    recipe, parameters = SCENES[name]
    scene = kt.make_scene(recipe, **parameters)
    sim = kt.Simulation(scene)
    sim.run(max_contacts=contacts)
    found = certify_log(scene, sim.contacts, max_contacts=contacts, fingerprint=sim.fingerprint)
    return WholeRun(name, sim.broad_phase, len(scene), found.total, found.lines, found.right, str(found))
