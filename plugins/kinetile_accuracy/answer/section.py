"""The part of the report on whole runs: each contact of them is the specification's, to their ends."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import kinetile as kt
from kinetile_accuracy.answer.certify import certify_log
from kinetile_accuracy.parts import Budget, Claim, Column, Progress, Section, Table
from kinetile_accuracy.wording import listed

__all__ = ["CASES", "CONTACTS", "Checked", "measure"]


class Case(NamedTuple):
    """A scene: what it is called here, its recipe and parameters."""

    name: str
    recipe: str
    parameters: dict[str, float | int]


CASES = (
    Case("dense gas", "grid", {"bodies": 100, "density": 0.5}),
    Case("dilute gas", "grid", {"bodies": 100, "density": 0.01}),
    Case("lattice of ties", "lattice", {}),
    Case("many discs", "grid", {"bodies": 400, "density": 0.25}),
)
CONTACTS: dict[Budget, int] = {"quick": 2_000, "normal": 20_000, "full": 100_000}


@dataclass(frozen=True)
class Checked:
    """A run that was checked contact by contact."""

    scene: Annotated[str, Column("what is simulated", "scene")]
    bodies: Annotated[int, Column("how many discs", "discs")]
    contacts: Annotated[int, Column("contacts of the run", "contacts")]
    lines: Annotated[int, Column("how many of them, from the first one on, are right", "right")]
    right: Annotated[bool, Column("whether all are")]
    verdict: Annotated[str, Column("the certifier's sentence", "verdict")]


def measure(budget: Budget, progress: Progress) -> Section:
    """Check some runs to their ends."""
    rows: list[Checked] = []
    for case in CASES:
        progress("runs against the specification", len(rows), len(CASES))
        rows.append(check(case, CONTACTS[budget]))
    wrong = [f"{row.scene}: {row.verdict}" for row in rows if not row.right]
    said = f"{sum(row.lines for row in rows):,} of {sum(row.contacts for row in rows):,} contacts"
    return Section(
        name="answer",
        title="Certified to the end",
        about=(
            "The contacts of a scene are defined by a specification: exact times, rounded down to a tick, "
            "and plans that are rounded in a fixed way. So a run in doubles can be right to its end, and "
            "whether it is can be decided in integers, contact by contact (kinetile certify-log), without "
            "the kernel."
        ),
        findings=(f"Right are {said}, in runs of {listed([row.scene for row in rows])}.", *wrong),
        claims=(Claim("Every contact of a run is the one that the specification says", said, not wrong),),
        tables=(Table("runs", "The runs, and what the certifier says of each.", tuple(rows)),),
    )


def check(case: Case, contacts: int) -> Checked:
    """Run a scene for so many contacts, or for as long as there are any, and check each of them."""
    scene = kt.make_scene(case.recipe, **case.parameters)
    sim = kt.Simulation(scene)
    sim.run(max_contacts=contacts)
    found = certify_log(scene, sim.contacts, max_contacts=contacts, fingerprint=sim.fingerprint)
    return Checked(case.name, len(scene), found.total, found.lines, found.right, str(found))
