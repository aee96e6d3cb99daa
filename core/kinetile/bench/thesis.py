"""The thesis's benchmark (section 5.3), restated so that it can be done again.

Twelve scenes of the recipe ``grid``: 25, 100 and 400 discs at four densities. Each broad phase runs each of
them for the same stretch of simulated time, with several seeds, which the thesis does not say it did. What is
noted is of two kinds. Counts (contacts, bound events, candidate pairs, the queue) are the same on every
machine. Times are processor time inside the loop, the static construction included and compilation apart: a
short run is repeated until there is enough to measure, and the phases take turns, scene by scene and seed by
seed, so that a machine that slows down slows all of them.

What the cells say is worked out in ``kinetile.bench.measures`` (spreads, exponents, the four measures of a
kinetic data structure) and ``kinetile.bench.statements`` (the thesis's statements).
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kinetile.bench.events import BODIES, DENSITIES, Choice, phase_label, phases_with_options, surroundings

__all__ = ["PHASES", "Cell", "ThesisBench", "bench_thesis", "thesis_conditions"]

PHASES = ("naive", "sap-1d", "sap-2d", "sweep-tiling")
"""The thesis's three, and its sweep-and-prune on two axes, which it left out of its figures."""

MOST_REPEATS = 200
"""Runs of one cell; the smallest scenes take 50 microseconds of the loop and a millisecond to set up."""

_ROUNDS = 5


@dataclass(frozen=True)
class Cell:
    """One broad phase on one scene.

    Attributes:
        density, bodies, seed: the scene.
        phase: the broad phase, with its options.
        until: how long was simulated, in the scene's time.
        cpu_seconds: of each run, from the scene's start to ``until``.
        contacts_disc, contacts_wall: contacts of two discs, of a disc with a wall.
        bound_events: failures of the broad phase's own certificates.
        certificates_updated: times a failure time was set anew, the static construction apart.
        certificates_live_max, queue_max: the most alive, the most queued at one time.
        pairs_mean, pairs_max: candidate pairs.
        pairs_of_one_body: the most candidate pairs of one body, at the end.
        pair_changes: candidate pairs that came or went, the static construction apart.
        fingerprint: digest of the contacts.
    """

    density: float
    bodies: int
    seed: int
    phase: str
    until: float
    cpu_seconds: tuple[float, ...]
    contacts_disc: int
    contacts_wall: int
    bound_events: int
    certificates_updated: int
    certificates_live_max: int
    queue_max: int
    pairs_mean: float
    pairs_max: int
    pairs_of_one_body: int
    pair_changes: int
    fingerprint: str

    @property
    def events(self) -> int:
        """Events of all kinds."""
        return self.contacts_disc + self.contacts_wall + self.bound_events

    @property
    def plan_changes(self) -> int:
        """How often a body got a new flight plan: two at a contact of discs."""
        return 2 * self.contacts_disc + self.contacts_wall

    @property
    def cost(self) -> float:
        """CPU seconds for one unit of simulated time, the median of the runs."""
        return statistics.median(self.cpu_seconds) / self.until


@dataclass(frozen=True)
class ThesisBench:
    """All cells, and where and with what they were measured."""

    cells: tuple[Cell, ...]
    conditions: Mapping[str, Any]

    @property
    def densities(self) -> tuple[float, ...]:
        """The densities, highest first."""
        return tuple(sorted({cell.density for cell in self.cells}, reverse=True))

    @property
    def bodies(self) -> tuple[int, ...]:
        """The numbers of discs, smallest first."""
        return tuple(sorted({cell.bodies for cell in self.cells}))

    @property
    def phases(self) -> tuple[str, ...]:
        """The broad phases in the order in which they ran."""
        return tuple(dict.fromkeys(cell.phase for cell in self.cells))

    def of(self, density: float, bodies: int, phase: str) -> tuple[Cell, ...]:
        """Return the cells of one scene and phase, one for each seed that was run."""
        wanted = (density, bodies, phase)
        found = [cell for cell in self.cells if (cell.density, cell.bodies, cell.phase) == wanted]
        return tuple(sorted(found, key=lambda cell: cell.seed))


def bench_thesis(
    phases: Sequence[Choice] = PHASES,
    bodies: Sequence[int] = BODIES,
    densities: Sequence[float] = DENSITIES,
    *,
    seeds: int = 6,
    until: float = 1.0,
    seconds: float = 0.05,
    start: Callable[[str, Any], Any] | None = None,
    finish: Callable[[Sequence[Cell]], Any] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> ThesisBench:
    """Run every phase on every scene with the seeds 1 to ``seeds``.

    ``until`` is the time that is simulated; ``seconds`` the CPU time that the runs of a phase on a scene with
    one seed have together, at least, unless that would be more than ``MOST_REPEATS`` runs. ``start`` is
    called with a label and a simulation before a phase first runs on a scene, ``finish`` with a scene's
    cells, ``progress`` with the steps done and their total.

    Raises what ``Simulation`` and ``make_scene`` raise.
    """
    from kinetile.plugin.by_name import make_scene

    chosen = phases_with_options(phases)
    total = seeds * len(bodies) * len(densities) * len(chosen) * 2
    done = 0

    def tell(steps: int) -> None:
        nonlocal done
        done += steps
        if progress is not None:
            progress(done, total)

    cells: list[Cell] = []
    for seed in range(1, seeds + 1):
        for density in densities:
            for n in bodies:
                scene = make_scene("grid", bodies=n, density=density, seed=seed)
                counts = []
                for choice in chosen:
                    counts.append(_counts(scene, choice, until, start))
                    tell(1)
                times = _times(scene, chosen, until, seconds, [each.pop("cpu_seconds") for each in counts])
                new = [
                    Cell(density, n, seed, phase_label(*choice), until, tuple(runs), **found)
                    for choice, runs, found in zip(chosen, times, counts, strict=True)
                ]
                tell(len(chosen))
                cells += new
                if finish is not None:
                    finish(new)
    return ThesisBench(tuple(cells), thesis_conditions(seeds, until, seconds))


def thesis_conditions(seeds: int, until: float, seconds: float) -> dict[str, Any]:
    """Return versions, machine, and how the cells were measured."""
    return surroundings() | {"seeds": seeds, "until": until, "seconds": seconds, "most_runs": MOST_REPEATS}


def _simulation(scene: Any, choice: tuple[str, Mapping[str, Any]]) -> Any:
    from kinetile.run.simulation import Simulation

    return Simulation(scene, choice[0], options=choice[1], keep_contacts=False)


def _counts(
    scene: Any,
    choice: tuple[str, Mapping[str, Any]],
    until: float,
    start: Callable[[str, Any], Any] | None,
) -> dict[str, Any]:
    """Return the counts of a run, those of the static construction taken off, and its CPU seconds."""
    simulation = _simulation(scene, choice)
    if start is not None:
        start(choice[0], simulation)
    pairs_first = len(simulation.candidate_pairs())
    built = simulation.readings
    simulation.run(until)
    pairs = simulation.candidate_pairs()
    found = simulation.readings
    made = found.certificates_created - built.certificates_created
    return {
        "cpu_seconds": found.cpu_seconds,
        "contacts_disc": found.contacts_disc,
        "contacts_wall": found.contacts_wall,
        "bound_events": found.structural_events,
        "certificates_updated": found.certificates_updated - built.certificates_updated,
        "certificates_live_max": found.certificates_live_max,
        "queue_max": found.queue_max,
        "pairs_mean": found.pairs_mean,
        "pairs_max": found.pairs_max,
        "pairs_of_one_body": int(np.bincount(pairs.ravel()).max()) if len(pairs) else 0,
        "pair_changes": made + (pairs_first + made - len(pairs)),
        "fingerprint": found.fingerprint,
    }


def _times(
    scene: Any,
    chosen: Sequence[tuple[str, Mapping[str, Any]]],
    until: float,
    seconds: float,
    expected: Sequence[float],
) -> list[list[float]]:
    """Return the CPU seconds of each phase's runs; the phases take turns, a fifth of their runs at a time."""
    runs: list[list[float]] = [[] for _ in chosen]
    waiting = set(range(len(chosen)))
    while waiting:
        for k in sorted(waiting):
            batch = math.ceil(seconds / _ROUNDS / expected[k]) if expected[k] > 0.0 else MOST_REPEATS
            for _ in range(min(batch, MOST_REPEATS // _ROUNDS)):
                simulation = _simulation(scene, chosen[k])
                simulation.compile()
                simulation.run(until)
                runs[k].append(simulation.readings.cpu_seconds)
            if sum(runs[k]) >= seconds or len(runs[k]) >= MOST_REPEATS:
                waiting.discard(k)
    return runs
