"""How fast the broad phases are: events a CPU second on the thesis's twelve scenes.

Each phase gets, on each scene, runs of about the same CPU time, always from the scene's start, with the
repeats of the phases taking turns, so that a machine that slows down slows all of them; the median counts.
Compilation and set-up are outside the timed loop. Beside the rates stand counts up to a fixed number of
contacts a disc, which are the same on every machine.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from kinetile.bench.choices import Choice, phase_label, phases_with_options, simulation_of
from kinetile.bench.display import Displayed
from kinetile.bench.surroundings import surroundings

__all__ = [
    "BODIES",
    "DENSITIES",
    "Bench",
    "BenchRow",
    "bench_events",
    "conditions",
]

BODIES = (25, 100, 400)
DENSITIES = (0.5, 0.25, 0.125, 0.01)
COUNTED = 50
"""Contacts a disc over which the counts are taken."""

_SHORTEST_PILOT = 0.05  # CPU seconds: less than this says little about the rate
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
        asked_per_contact, computed_per_contact: partners that a body looked at, and contact times worked out
            exactly, over contacts, as the counts have them.
        contacts: how many a timed run has; the same in every repeat.
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
class Bench(Displayed):
    """All rows, and where and with what they were measured."""

    rows: tuple[BenchRow, ...]
    conditions: Mapping[str, Any]

    def as_dict(self) -> dict[str, Any]:
        """Return everything in plain types, fit for JSON."""
        return {"conditions": dict(self.conditions), "rows": [vars(row) for row in self.rows]}


def bench_events(
    phases: Sequence[Choice] | None = None,
    bodies: Sequence[int] = BODIES,
    densities: Sequence[float] = DENSITIES,
    *,
    seconds: float = 0.5,
    repeats: int = 5,
    seed: int = 1,
    start: Callable[[str, Any], Any] | None = None,
    finish: Callable[[BenchRow], Any] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Bench:
    """Measure broad phases (all that are registered, if None) on the scenes of the recipe ``grid``.

    ``seconds`` is the CPU time of one run, about; ``repeats`` how often each is done. ``start`` is called
    with a label and a simulation before a phase first runs, ``finish`` with each row, ``progress`` with the
    runs done and their total.

    Raises what ``Simulation`` and ``make_scene`` raise.
    """
    from kinetile.plugin.by_name import make_scene
    from kinetile.plugin.registry import registry

    chosen = phases_with_options(registry().names("broad phase") if phases is None else phases)
    total = len(bodies) * len(densities) * len(chosen) * (repeats + 1)
    done = 0
    rows: list[BenchRow] = []

    def tell() -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(done, total)

    for density in densities:
        for n in bodies:
            scene = make_scene("grid", bodies=n, density=density, seed=seed)
            pilots = []
            for choice in chosen:
                pilots.append(_pilot(scene, choice, seconds, start))
                tell()
            runs: list[list[Any]] = [[] for _ in chosen]
            for _ in range(repeats):
                for k, choice in enumerate(chosen):
                    runs[k].append(_timed(scene, choice, pilots[k][1]))
                    tell()
            most = max((_contact_rate(timed) for timed in runs), default=0.0)
            for k, choice in enumerate(chosen):
                rows.append(_row(n, density, choice, pilots[k][0], runs[k], most))
                if finish is not None:
                    finish(rows[-1])
    return Bench(tuple(rows), conditions(seconds, repeats, seed))


def conditions(seconds: float, repeats: int, seed: int = 1) -> dict[str, Any]:
    """Return versions, machine, and how the figures of ``bench_events`` were taken."""
    return surroundings() | {
        "seconds": seconds,
        "repeats": repeats,
        "seed": seed,
        "counted_contacts_a_disc": COUNTED,
    }


def _pilot(
    scene: Any, choice: tuple[str, Mapping[str, Any]], seconds: float, start: Callable[[str, Any], Any] | None
) -> tuple[dict[str, Any], int]:
    """Return the counts after COUNTED contacts a disc, and how many contacts a run of so many seconds has."""
    simulation = simulation_of(scene, choice)
    if start is not None:
        start(choice[0], simulation)
    simulation.run(max_contacts=COUNTED * len(scene))
    readings = simulation.readings.as_dict()
    counts = {name: readings[name] for name in _COUNTS}
    while (spent := simulation.readings.cpu_seconds) < min(_SHORTEST_PILOT, seconds):
        contacts = _contacts(simulation)
        if contacts == 0:
            return counts, 0
        simulation.run(max_contacts=contacts * (3 if spent > 0 else 10))
    return counts, max(math.ceil(_contacts(simulation) * seconds / spent), 1)


def _timed(scene: Any, choice: tuple[str, Mapping[str, Any]], contacts: int) -> Any:
    simulation = simulation_of(scene, choice)
    simulation.compile()
    simulation.run(max_contacts=contacts)
    return simulation.readings


def _row(
    n: int,
    density: float,
    choice: tuple[str, Mapping[str, Any]],
    counts: Mapping[str, Any],
    runs: Sequence[Any],
    most: float,
) -> BenchRow:
    """Return a phase's row; ``most`` is the rate of contacts of the fastest phase on the scene."""
    rates = [run.events_per_cpu_second for run in runs]
    contacts = runs[0].contacts_disc + runs[0].contacts_wall
    counted = max(counts["contacts_disc"] + counts["contacts_wall"], 1)
    speed = _contact_rate(runs)
    return BenchRow(
        bodies=n,
        density=density,
        phase=phase_label(*choice),
        events_per_cpu_second=statistics.median(rates),
        slowest=min(rates),
        fastest=max(rates),
        contacts_per_cpu_second=speed,
        of_fastest=speed / most if most > 0.0 else 0.0,
        events_per_contact=runs[0].events / contacts if contacts else 0.0,
        asked_per_contact=counts["partners_asked"] / counted,
        computed_per_contact=counts["contacts_computed"] / counted,
        contacts=contacts,
        cpu_seconds=tuple(run.cpu_seconds for run in runs),
        counts=counts,
    )


def _contact_rate(runs: Sequence[Any]) -> float:
    """Return the contacts a CPU second of a phase's runs on a scene, the median."""
    return float(statistics.median(run.contacts_per_cpu_second for run in runs))


def _contacts(simulation: Any) -> int:
    readings = simulation.readings
    return int(readings.contacts_disc + readings.contacts_wall)
