"""The thesis's benchmark (section 5.3), restated so that it can be done again.

Twelve scenes of the recipe ``grid``: 25, 100 and 400 discs at four densities. Each broad phase runs each of
them for the same stretch of simulated time, with several seeds, which the thesis does not say it did. What is
noted is of two kinds. Counts (contacts, bound events, candidate pairs, the queue) are the same on every
machine. Times are processor time inside the loop, the static construction included and compilation apart: a
short run is repeated until there is enough to measure, and the phases take turns, several times on each scene
with each seed, so that a machine that slows down slows all of them, and the same run has several times.

What the cells say is worked out in ``kinetile.bench.measures`` (spreads, exponents, the four measures of a
kinetic data structure) and ``kinetile.bench.thesis_statements.statements`` (the thesis's statements).
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kinetile.bench.choices import Choice, phase_label, phases_with_options, simulation_of
from kinetile.bench.display import Displayed
from kinetile.bench.events import BODIES, DENSITIES
from kinetile.bench.surroundings import surroundings

__all__ = ["PHASES", "Cell", "ThesisBench", "bench_thesis", "thesis_conditions"]

PHASES = ("naive", "sap-1d", "sap-2d", "sweep-tiling")
"""The thesis's three, and its sweep-and-prune on two axes, which it left out of its figures."""

ROUNDS = 5
"""How often the phases take turns on a scene."""

MOMENTS = 17
"""Moments of a run, evenly apart from its start to its end, at which the candidate pairs are counted."""

MOST_RUNS = 40
"""Runs of a phase in a round; the smallest scenes take 50 microseconds of the loop and a millisecond to set
up."""


@dataclass(frozen=True)
class Cell:
    """One broad phase on one scene.

    Attributes:
        density, bodies, seed: the scene.
        phase: the broad phase, with its options.
        until: how long was simulated, in the scene's time.
        cpu_seconds: of a run from the scene's start to ``until``, in each round. In a round all phases run
            one after the other, so that what the machine does besides falls on all of them.
        contacts_disc, contacts_wall: contacts of two discs, of a disc with a wall.
        bound_events: failures of the broad phase's own certificates.
        certificates_updated: times the broad phase set anew when a body's certificate fails.
        partners_asked: bodies that another looked at for their contact.
        contacts_computed: contact times worked out exactly.
        queue_max: the most bodies queued at one time.
        pairs_mean, pairs_max: candidate pairs, at ``MOMENTS`` moments.
        pairs_of_one_body: the most candidate pairs of one body, at these moments.
        pair_changes: candidate pairs that came, as the broad phase said, or went, as is left then.
        fingerprint: digest of the contacts.

    What the static construction does is not in the counts.
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
    partners_asked: int
    contacts_computed: int
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
        """CPU seconds for one unit of simulated time, the median of the rounds."""
        return statistics.median(self.cpu_seconds) / self.until

    @property
    def unrest(self) -> float:
        """How many times as long the slowest round took as the fastest: what the machine did besides."""
        return max(self.cpu_seconds) / min(self.cpu_seconds)


@dataclass(frozen=True)
class ThesisBench(Displayed):
    """All cells, and where and with what they were measured."""

    cells: tuple[Cell, ...]
    conditions: Mapping[str, Any]

    def displayed_rows(self) -> Sequence[Cell]:
        """Return the rows."""
        return self.cells

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

    @property
    def unrest(self) -> float:
        """The cells' unrest, the median of all."""
        return statistics.median(cell.unrest for cell in self.cells)

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
    one seed have together, about, unless that would be more than ``MOST_RUNS`` in a round, or less than one.
    ``start`` is called with a label and a simulation before a phase first runs on a scene, ``finish`` with a
    scene's cells, ``progress`` with the steps done and their total.

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
    return surroundings() | {"seeds": seeds, "until": until, "seconds": seconds, "rounds": ROUNDS}


def _counts(
    scene: Any,
    choice: tuple[str, Mapping[str, Any]],
    until: float,
    start: Callable[[str, Any], Any] | None,
) -> dict[str, Any]:
    """Return the counts of a run, those of the static construction taken off, and its CPU seconds."""
    simulation = simulation_of(scene, choice)
    if start is not None:
        start(choice[0], simulation)
    pairs = [simulation.candidate_pairs()]
    built = simulation.readings
    for moment in range(1, MOMENTS):
        simulation.run(until * moment / (MOMENTS - 1))
        pairs.append(simulation.candidate_pairs())
    found = simulation.readings
    numbers = [len(each) for each in pairs]
    came = found.newcomers - built.newcomers
    return {
        "cpu_seconds": found.cpu_seconds,
        "contacts_disc": found.contacts_disc,
        "contacts_wall": found.contacts_wall,
        "bound_events": found.structural_events,
        "certificates_updated": found.certificates_updated - built.certificates_updated,
        "partners_asked": found.partners_asked - built.partners_asked,
        "contacts_computed": found.contacts_computed - built.contacts_computed,
        "queue_max": found.queue_max,
        "pairs_mean": statistics.fmean(numbers),
        "pairs_max": max(numbers),
        "pairs_of_one_body": max(int(np.bincount(each.ravel(), minlength=1).max()) for each in pairs),
        "pair_changes": came + (numbers[0] + came - numbers[-1]),
        "fingerprint": found.fingerprint,
    }


def _times(
    scene: Any,
    chosen: Sequence[tuple[str, Mapping[str, Any]]],
    until: float,
    seconds: float,
    expected: Sequence[float],
) -> list[list[float]]:
    """Return the mean CPU seconds of a run for each phase and round; every other round goes backwards."""
    rounds: list[list[float]] = [[] for _ in chosen]
    sizes = [
        min(math.ceil(seconds / ROUNDS / each), MOST_RUNS) if each > 0.0 else MOST_RUNS for each in expected
    ]
    for number in range(ROUNDS):
        turns = range(len(chosen)) if number % 2 == 0 else reversed(range(len(chosen)))
        for k in turns:
            mean = statistics.fmean(_timed(scene, chosen[k], until) for _ in range(sizes[k]))
            rounds[k].append(max(mean, time.get_clock_info("process_time").resolution))
    return rounds


def _timed(scene: Any, choice: tuple[str, Mapping[str, Any]], until: float) -> float:
    """Return the CPU seconds of a run from the scene's start."""
    simulation = simulation_of(scene, choice)
    simulation.compile()
    simulation.run(until)
    return float(simulation.readings.cpu_seconds)
