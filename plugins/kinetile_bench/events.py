"""Speed of the broad phases: events a CPU second on the thesis's twelve scenes, a built-in study.

Each phase gets, on each scene, runs of about the same CPU time, always from the scene's start, with the
repeats of the phases taking turns, so that a machine that slows down slows all of them; the median counts.
Compilation and set-up are outside the timed loop. Beside the rates stand counts up to a fixed number of
contacts a disc, which are the same on every machine.
"""

from __future__ import annotations

import os
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from kinetile import registry
from kinetile.plugin.choices import write_phase
from kinetile_accuracy.environment import environment
from kinetile_bench.benchmark import Choice, Measured, phases_with_options
from kinetile_bench.study import Study, shipped_tables

BODIES = (25, 100, 400)
DENSITIES = (0.5, 0.25, 0.125, 0.01)
COUNTED = 50
"""Contacts a disc over which the counts are taken."""

_COUNTS = (
    "contacts_disc",
    "contacts_wall",
    "structural_events",
    "events",
    "certificates_updated",
    "newcomers",
    "partners_asked",
    "contacts_computed",
    "queue_max",
    "pairs_max",
    "fingerprint",
)


@dataclass(frozen=True)
class BenchRow:
    """One phase on one scene.

    Attributes:
        bodies, density: the scene.
        phase: the broad phase, with its options.
        events_per_cpu_second, contacts_per_cpu_second: medians over the repeats.
        slowest, fastest: events a CPU second of the slowest and the fastest repeat.
        events_per_contact: structural and all other events, over contacts.
        of_fastest: contacts a CPU second, over those of the phase that had the most on this scene.
        asked_per_contact, computed_per_contact: candidate checks, and exact solves, over contacts, as the
            counts have them.
        contacts: how many a timed run has, the median.
        cpu_seconds: of each repeat.
        counts: readings after COUNTED contacts a disc, the same on every machine.
    """

    bodies: int
    density: float
    phase: str
    events_per_cpu_second: float
    slowest: float
    fastest: float
    contacts_per_cpu_second: float
    of_fastest: float
    events_per_contact: float
    asked_per_contact: float
    computed_per_contact: float
    contacts: int
    cpu_seconds: tuple[float, ...]
    counts: Mapping[str, Any]


@dataclass(frozen=True)
class Bench(Measured):
    """All rows, and where and with what they were measured."""

    rows: tuple[BenchRow, ...]
    conditions: Mapping[str, Any]


def events_study(
    results: str | os.PathLike[str],
    phases: Sequence[Choice] | None = None,
    bodies: Sequence[int] = BODIES,
    densities: Sequence[float] = DENSITIES,
    *,
    seconds: float = 0.5,
    repeats: int = 5,
    seed: int = 1,
) -> Study:
    """Returns the study ``events``, or a part of it; its rows are in the folder ``results``.

    Broad phases (all that are registered, if None) run scenes of the recipe ``grid``. ``seconds`` is the CPU
    time of one run, about; ``repeats`` how often each is done.

    Raises StudyError for what cannot be run.
    """
    chosen = phases_with_options(registry().names("broad phase") if phases is None else phases)
    tables = shipped_tables("events") | {
        "phases": [write_phase(*each) for each in chosen],
        "seeds": [seed],
        "repeats": repeats,
        "seconds": seconds,
        "scenes": [
            {
                "recipe": "grid",
                "contacts": COUNTED * n,
                "parameters": {"density": list(densities), "bodies": n},
            }
            for n in bodies
        ],
    }
    return Study(tables, results)


def read_events(study: Study) -> Bench:
    """Returns the results of the rows of ``events_study``, and the conditions of the measurement."""
    runs: dict[tuple[float, int], dict[str, list[Mapping[str, Any]]]] = {}
    for row in study.rows().to_pylist():
        if row["status"] == "done":
            scene = runs.setdefault((-row["density"], row["bodies"]), {})
            scene.setdefault(row["phase"], []).append(row)
    found = []
    for _, scene in sorted(runs.items()):
        most = max(map(_contact_rate, scene.values()))
        found += [_row(of_phase, most) for of_phase in scene.values()]
    plan = study.plan
    conditions = {
        "seconds": plan.file.seconds,
        "repeats": plan.file.repeats,
        "seed": plan.scenes[0].combinations[0]["seed"],
        "counted_contacts_a_disc": COUNTED,
    }
    return Bench(tuple(found), environment() | conditions)


def _row(runs: Sequence[Mapping[str, Any]], most: float) -> BenchRow:
    """Returns a phase's row; ``most`` is the rate of contacts of the fastest phase on the scene."""
    counts = {name: runs[0][name] for name in _COUNTS}
    counted = max(counts["contacts_disc"] + counts["contacts_wall"], 1)
    rates = [run["events_per_cpu_second"] for run in runs]
    contacts = sum(run["rate_contacts"] or 0 for run in runs)
    speed = _contact_rate(runs)
    return BenchRow(
        bodies=runs[0]["bodies"],
        density=runs[0]["density"],
        phase=runs[0]["phase"],
        events_per_cpu_second=statistics.median(rates),
        slowest=min(rates),
        fastest=max(rates),
        contacts_per_cpu_second=speed,
        of_fastest=speed / most if most > 0.0 else 0.0,
        events_per_contact=sum(run["rate_events"] or 0 for run in runs) / contacts if contacts else 0.0,
        asked_per_contact=counts["partners_asked"] / counted,
        computed_per_contact=counts["contacts_computed"] / counted,
        contacts=int(statistics.median(run["rate_contacts"] or 0 for run in runs)),
        cpu_seconds=tuple(run["rate_cpu_seconds"] or 0.0 for run in runs),
        counts=counts,
    )


def _contact_rate(runs: Sequence[Mapping[str, Any]]) -> float:
    """Returns the contacts a CPU second of a phase's runs on a scene, the median."""
    return float(statistics.median(run["contacts_per_cpu_second"] for run in runs))
