"""Speed of the broad phases: events a CPU second on the thesis's twelve scenes, or on larger ones. Each phase
gets, on each scene, runs of about the same CPU time, always from the scene's start, without compilation and
set-up. The repeats of the phases take turns, forwards and backwards (A B B A)."""

import math
import os
import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from kinetile import Simulation, make_scene
from kinetile.errors import Refused
from kinetile.instruments import write_phase
from kinetile_accuracy.environment import environment
from kinetile_bench.benchmark import Choice, NamedPhase, PhasesMeasured, phases_with_options, prepared

BODIES = (25, 100, 400)
DENSITIES = (0.5, 0.25, 0.125, 0.01)
COUNTED = 50
"""Contacts a disc in the run that gives the counts."""

SHORTEST = 0.05
"""CPU seconds: a shorter run says little about a rate."""


@dataclass(frozen=True)
class EventsRow:
    """One phase on one scene; without numbers if it is ``refused``.

    Attributes:
        events_per_cpu_second, contacts_per_cpu_second, cpu_seconds_per_time: medians over the repeats.
        best, of_fastest: contacts a CPU second of the fastest repeat; and the ratio of the median to the best
            phase's on this scene.
        asked_per_contact, computed_per_contact: candidate checks, and exact solves, as in the counts.
        exponent: the exponent of the growth of CPU time a unit of simulated time with the number of discs.
        contacts, cpu_seconds: the number of contacts of a timed run; the CPU time of each repeat.
        counts: readings after COUNTED contacts a disc, the same on every machine.
    """

    bodies: int
    density: float
    phase: str
    refused: str | None = None
    events_per_cpu_second: float = 0.0
    contacts_per_cpu_second: float = 0.0
    best: float = 0.0
    of_fastest: float = 0.0
    events_per_contact: float = 0.0
    asked_per_contact: float = 0.0
    computed_per_contact: float = 0.0
    cpu_seconds_per_time: float = 0.0
    exponent: float | None = None
    contacts: int = 0
    cpu_seconds: tuple[float, ...] = ()
    counts: Mapping[str, Any] | None = None

    @property
    def scene(self) -> tuple[float, int]:
        """The scene: its density and its number of discs."""
        return self.density, self.bodies

    @property
    def fingerprint(self) -> str | None:
        """The digest of the counted contacts."""
        return None if self.counts is None else str(self.counts["fingerprint"])


class EventsBench(PhasesMeasured):
    """The result: an ``EventsRow`` for each phase on each scene. ``conditions["load"]`` is the machine's mean
    load of a minute, at the start and after each scene; None if a system has no such value."""


def square_at_least(n: int) -> int:
    """Returns the smallest square number that is at least ``n``: a size of the recipe ``grid``."""
    return (math.isqrt(max(n, 1) - 1) + 1) ** 2


def bench_events(
    phases: Sequence[Choice] | None = None,
    bodies: Sequence[int] = BODIES,
    densities: Sequence[float] = DENSITIES,
    *,
    seconds: float = 0.5,
    repeats: int = 6,
    seed: int = 1,
    start: Callable[[Any], Any] = Simulation.compile,
    progress: Callable[[int, int], None] | None = None,
) -> Iterator[EventsBench]:
    """Measures broad phases (None: all registered) on scenes of the recipe ``grid``; yields the result so far
    after each scene. ``bodies`` are raised to square numbers. ``seconds`` is the approximate CPU time of one
    run. Calls ``start`` with a simulation before a phase first runs, ``progress`` with the finished runs and
    their total. Raises the errors of ``Simulation`` and ``make_scene``, but Refused becomes a row."""
    chosen = phases_with_options(phases)
    sizes = sorted(set(map(square_at_least, bodies)))
    plan = [(density, n) for density in densities for n in sizes]
    conditions = {"seconds": seconds, "repeats": repeats, "seed": seed, "counted_contacts_a_disc": COUNTED}
    conditions = environment() | conditions
    loads = [_load()]
    rows: list[EventsRow] = []
    for k, (density, n) in enumerate(plan):
        scene = make_scene("grid", bodies=n, density=density, seed=seed)
        counted = [_counted(scene, choice, n, density, seconds, start) for choice in chosen]
        able = [at for at, row in enumerate(counted) if row.refused is None]
        runs: dict[int, list[Any]] = {at: [] for at in able}
        for repeat in range(repeats):
            for at in able if repeat % 2 else reversed(able):
                runs[at].append(prepared(scene, chosen[at]))
                runs[at][-1].run(max_contacts=counted[at].contacts)
            if progress is not None:
                progress(k * repeats + repeat + 1, len(plan) * repeats)
        measured = [_measured(row, runs[at]) if at in runs else row for at, row in enumerate(counted)]
        most = max((row.contacts_per_cpu_second for row in measured), default=0.0) or 1.0
        before = {row.phase: row for row in rows if row.density == density}
        for row in measured:
            share, exponent = row.contacts_per_cpu_second / most, _exponent(before.get(row.phase), row)
            rows.append(replace(row, of_fastest=share, exponent=exponent))
        loads.append(_load())
        yield EventsBench(tuple(rows), conditions | {"load": tuple(loads)})


def _counted(
    scene: Any, choice: NamedPhase, n: int, density: float, seconds: float, start: Callable[[Any], Any]
) -> EventsRow:
    row = EventsRow(n, density, write_phase(*choice))
    try:
        simulation = prepared(scene, choice, start)
        simulation.run(max_contacts=COUNTED * n)
    except Refused as refused:
        return replace(row, refused=str(refused))
    found = simulation.readings
    counts = {name: value for name, value in found.as_dict().items() if "second" not in name}
    while found.cpu_seconds < min(SHORTEST, seconds):
        simulation.run(max_contacts=found.contacts * (3 if found.cpu_seconds > 0.0 else 10))
        found = simulation.readings
    return replace(
        row,
        asked_per_contact=counts["partners_asked"] / (COUNTED * n),
        computed_per_contact=counts["contacts_computed"] / (COUNTED * n),
        contacts=max(math.ceil(found.contacts * seconds / found.cpu_seconds), 1),
        counts=counts,
    )


def _load() -> float | None:
    return round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None


def _measured(row: EventsRow, runs: Sequence[Any]) -> EventsRow:
    found = [run.readings for run in runs]
    rates = [each.contacts_per_cpu_second for each in found]
    return replace(
        row,
        events_per_cpu_second=statistics.median(each.events_per_cpu_second for each in found),
        contacts_per_cpu_second=statistics.median(rates),
        best=max(rates),
        events_per_contact=found[0].events / row.contacts,
        cpu_seconds_per_time=statistics.median(run.readings.cpu_seconds / run.time for run in runs),
        cpu_seconds=tuple(each.cpu_seconds for each in found),
    )


def _exponent(before: EventsRow | None, row: EventsRow) -> float | None:
    if before is None or not before.cpu_seconds_per_time > 0.0 < row.cpu_seconds_per_time:
        return None
    ratio = row.cpu_seconds_per_time / before.cpu_seconds_per_time
    return math.log(ratio) / math.log(row.bodies / before.bodies)
