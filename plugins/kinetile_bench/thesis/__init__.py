"""The thesis's benchmark (section 5.3), restated so that it can be repeated.

Twelve scenes of the recipe ``grid``: 25, 100 and 400 discs at four densities, run by each broad phase for the
same simulated time, with several seeds, which the thesis does not mention. Counts (contacts, bound events,
candidate pairs, the queue) are the same on every machine. Times are processor time inside the loop, with
static construction, without compilation: a short run is repeated, and the phases take turns.
"""

import math
import statistics
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

from kinetile import Simulation, make_scene
from kinetile.instruments import write_phase
from kinetile_accuracy.environment import environment
from kinetile_accuracy.sections import grouped
from kinetile_bench.benchmark import Choice, NamedPhase, PhasesMeasured, phases_with_options, prepared
from kinetile_bench.event_rates import BODIES, DENSITIES

PHASES = ("naive", "sap-1d", "sap-2d", "sweep-tiling", "cells", "power")
"""The thesis's three; sweep-and-prune on two axes, not in its figures; and two that it does not have."""

MOMENTS = 17
"""Evenly spaced moments of a run, from its start to its end, that count candidate pairs."""

MOST_RUNS = 40
"""The most runs of one phase in one round."""

COUNTED = (
    *("events", "structural_events", "contacts_disc", "contacts_wall"),
    *("certificates_updated", "partners_asked", "contacts_computed"),
)
"""Readings of a run that are counts, the same on every machine; structural events are bound events."""


@dataclass(frozen=True)
class Cell:
    """One broad phase on one scene, up to ``until``: ``cpu_seconds``, the median run of each round, and
    ``counts``: ``COUNTED``, without the static construction, ``contacts``, ``queue_max``, ``candidate_pairs``
    (the mean of some moments), and the ``fingerprint``."""

    density: float
    bodies: int
    seed: int
    phase: str
    until: float
    cpu_seconds: tuple[float, ...]
    counts: Mapping[str, Any]

    @property
    def scene(self) -> tuple[float, int, int]:
        """The scene: its density, number of discs and seed."""
        return self.density, self.bodies, self.seed

    @property
    def fingerprint(self) -> str:
        """The digest of the contacts."""
        return str(self.counts["fingerprint"])

    @property
    def cost(self) -> float:
        """CPU seconds for one unit of simulated time, the median of the rounds."""
        return statistics.median(self.cpu_seconds) / self.until

    @property
    def unrest(self) -> float:
        """The slowest round's time over the fastest's: a measure of other load; infinite for one."""
        return max(self.cpu_seconds) / min(self.cpu_seconds) if len(self.cpu_seconds) > 1 else math.inf


class ThesisScene(NamedTuple):
    """A scene of the benchmark, with all seeds."""

    density: float
    bodies: int

    def __str__(self) -> str:
        return f"{self.density:g}/{self.bodies}".removeprefix("0")


class ThesisBench(PhasesMeasured):
    """The result: all cells."""

    @cached_property
    def _cells(self) -> dict[tuple[float, int, str], dict[int, Cell]]:
        groups = grouped(self.rows, "density", "bodies", "phase")
        return {key: {cell.seed: cell for cell in cells} for key, cells in groups.items()}

    @property
    def phases(self) -> tuple[str, ...]:
        """The broad phases in the order of their runs."""
        return tuple(dict.fromkeys(cell.phase for cell in self.rows))

    def of(self, scene: ThesisScene, phase: str) -> Mapping[int, Cell]:
        """Returns the cells of one scene and phase, by their seeds."""
        return self._cells.get((*scene, phase), {})

    def scenes(self, *phases: str) -> list[ThesisScene]:
        """Returns the scenes that all of these phases have run."""
        every = dict.fromkeys(ThesisScene(density, bodies) for density, bodies, _ in self._cells)
        return [scene for scene in every if all(self.of(scene, phase) for phase in phases)]

    def by_density(self, *phases: str) -> dict[float, list[ThesisScene]]:
        """Returns these scenes by their density."""
        return grouped(self.scenes(*phases), "density")

    def mean(self, scene: ThesisScene, phase: str, count: str) -> float:
        """Returns the mean of a count over the seeds."""
        return statistics.fmean(cell.counts[count] for cell in self.of(scene, phase).values())


def bench_thesis(
    phases: Sequence[Choice] = PHASES,
    bodies: Sequence[int] = BODIES,
    densities: Sequence[float] = DENSITIES,
    *,
    seeds: int = 6,
    until: float = 1.0,
    seconds: float = 0.01,
    repeats: int = 5,
    start: Callable[[Any], Any] = Simulation.compile,
    progress: Callable[[int, int], None] | None = None,
) -> Iterator[ThesisBench]:
    """Runs every phase on every scene with the seeds 1 to ``seeds``; yields the result so far after each
    scene and seed. ``repeats`` is the number of rounds, ``seconds`` the least CPU time in each that the runs
    of a phase on a scene with one seed have together, unless that takes more than ``MOST_RUNS``."""
    chosen = phases_with_options(phases)
    conditions = {"seeds": seeds, "until": until, "seconds": seconds, "repeats": repeats}
    plan = [(density, n, seed) for density in densities for n in bodies for seed in range(1, seeds + 1)]
    cells: list[Cell] = []
    for done, (density, n, seed) in enumerate(plan, start=1):
        scene = make_scene("grid", bodies=n, density=density, seed=seed)
        counts = [_counts(scene, choice, until, start) for choice in chosen]
        times: list[list[float]] = [[] for _ in chosen]
        for number in range(repeats):
            for k in sorted(range(len(chosen)), reverse=number % 2 == 1):
                times[k].append(_time(scene, chosen[k], until, seconds))
        for choice, spent, found in zip(chosen, times, counts, strict=True):
            cells.append(Cell(density, n, seed, write_phase(*choice), until, tuple(spent), found))
        if progress is not None:
            progress(done, len(plan))
        yield ThesisBench(tuple(cells), environment() | conditions)


def _time(scene: Any, choice: NamedPhase, until: float, seconds: float) -> float:
    spent: list[float] = []
    least = time.get_clock_info("thread_time").resolution
    while not spent or (len(spent) < MOST_RUNS and sum(spent) < seconds):
        simulation = prepared(scene, choice)
        simulation.run(until)
        spent.append(max(simulation.readings.cpu_seconds, least))
    return statistics.median(spent)


def _counts(scene: Any, choice: NamedPhase, until: float, start: Callable[[Any], Any]) -> dict[str, Any]:
    simulation = prepared(scene, choice, start)
    simulation.build()
    built = simulation.readings.as_dict()
    pairs = [len(simulation.candidate_pairs())]
    for moment in range(1, MOMENTS):
        simulation.run(scene.start + (until - scene.start) * moment / (MOMENTS - 1))
        pairs.append(len(simulation.candidate_pairs()))
    found = simulation.readings.as_dict()
    counts = {name: found[name] - built[name] for name in COUNTED}
    counts["contacts"] = counts["contacts_disc"] + counts["contacts_wall"]
    counts["candidate_pairs"] = statistics.fmean(pairs)
    return counts | {name: found[name] for name in ("queue_max", "fingerprint")}
