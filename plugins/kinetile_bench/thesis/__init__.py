"""The thesis's benchmark (section 5.3), restated so that it can be done again: a study that ships.

Twelve scenes of the recipe ``grid``: 25, 100 and 400 discs at four densities. Each broad phase runs each of
them for the same stretch of simulated time, with several seeds, which the thesis does not mention. Two kinds
of numbers are kept. Counts (contacts, bound events, candidate pairs, the queue) are the same on every
machine. Times are processor time inside the loop, the static construction included and compilation apart: a
short run is repeated until there is enough to measure, and the phases take turns, several times on each scene
with each seed, so that a machine that slows down slows all of them, and the same run has several times.

A cell sums up the rows of one scene under one phase. What follows from the cells is computed in
``kinetile_bench.thesis.measures`` (spreads, exponents, the four measures of a kinetic data structure) and
``kinetile_bench.thesis.statements`` (the thesis's statements).
"""

from __future__ import annotations

import math
import os
import statistics
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

from kinetile.plugin.choices import write_phase
from kinetile_accuracy.environment import environment
from kinetile_bench.benchmark import Choice, Measured, phases_with_options
from kinetile_bench.events import BODIES, DENSITIES
from kinetile_bench.study import Study, shipped_tables

PHASES = ("naive", "sap-1d", "sap-2d", "sweep-tiling")
"""The thesis's three, and its sweep-and-prune on two axes, which it left out of its figures."""

ROUNDS = 5
"""How often the phases take turns on a scene."""


@dataclass(frozen=True)
class Cell:
    """One broad phase on one scene.

    Attributes:
        density, bodies, seed: the scene.
        phase: the broad phase, with its options.
        until: how long was simulated, in the scene's time.
        cpu_seconds: of a run from the scene's start to ``until``, the median of each round. In a round all
            phases run one after the other, so that other load of the machine falls on all of them.
        contacts_disc, contacts_wall: contacts of two discs, of a disc with a wall.
        bound_events: failures of the broad phase's own certificates.
        certificates_updated: how often the broad phase computed when a body's certificate fails.
        partners_asked: candidate checks: bodies whose bound of a contact another body computed.
        contacts_computed: exact solves.
        queue_max: the most bodies queued at one time.
        pairs_mean, pairs_max: candidate pairs, at 17 moments of the run, evenly apart.
        pairs_of_one_body: the most candidate pairs of one body, at these moments.
        pair_changes: candidate pairs that came, as the broad phase counts them, or went: the difference.
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
        return self.contacts + self.bound_events

    @property
    def contacts(self) -> int:
        """Contacts of all kinds."""
        return self.contacts_disc + self.contacts_wall

    @property
    def partners_per_event(self) -> float:
        """Candidate checks for one event."""
        return self.partners_asked / max(self.events, 1)

    @property
    def microseconds_per_event(self) -> float:
        """CPU microseconds for one event, from the median of the rounds."""
        return 1e6 * self.cost * self.until / max(self.events, 1)

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
        """How many times as long the slowest round took as the fastest: a measure of other load.

        One round does not show it: infinite.
        """
        return max(self.cpu_seconds) / min(self.cpu_seconds) if len(self.cpu_seconds) > 1 else math.inf


class ThesisScene(NamedTuple):
    """A scene of the benchmark, with all seeds."""

    density: float
    bodies: int

    def __str__(self) -> str:
        return f"{plain(self.density)}/{self.bodies}"


def plain(density: float) -> str:
    """Returns a density as the thesis's readers write it: .5."""
    return f"{density:g}".removeprefix("0")


@dataclass(frozen=True)
class ThesisBench(Measured):
    """All cells, and where and with what they were measured."""

    rows: tuple[Cell, ...]
    conditions: Mapping[str, Any]

    @cached_property
    def densities(self) -> tuple[float, ...]:
        """The densities, highest first."""
        return tuple(sorted({cell.density for cell in self.rows}, reverse=True))

    @cached_property
    def bodies(self) -> tuple[int, ...]:
        """The numbers of discs, smallest first."""
        return tuple(sorted({cell.bodies for cell in self.rows}))

    @cached_property
    def phases(self) -> tuple[str, ...]:
        """The broad phases in the order in which they ran."""
        return tuple(dict.fromkeys(cell.phase for cell in self.rows))

    @property
    def unrest(self) -> float:
        """The cells' unrest, the median of all."""
        return statistics.median(cell.unrest for cell in self.rows)

    @cached_property
    def _cells(self) -> dict[tuple[float, int, str], dict[int, Cell]]:
        found: dict[tuple[float, int, str], dict[int, Cell]] = {}
        for cell in sorted(self.rows, key=lambda cell: cell.seed):
            found.setdefault((cell.density, cell.bodies, cell.phase), {})[cell.seed] = cell
        return found

    def of(self, scene: ThesisScene, phase: str) -> tuple[Cell, ...]:
        """Returns the cells of one scene and phase, one for each seed that was run."""
        return tuple(self._cells.get((*scene, phase), {}).values())

    def scenes(self, *phases: str) -> list[ThesisScene]:
        """Returns the scenes that all these phases have run, by density from the highest, then by size."""
        every = [ThesisScene(density, n) for density in self.densities for n in self.bodies]
        return [scene for scene in every if all(self.of(scene, phase) for phase in phases)]

    def seed_by_seed(self, scene: ThesisScene, phases: Sequence[str]) -> list[list[Cell]]:
        """Returns the cells of the phases on a scene, one list for each seed that all of them have run."""
        found = [self._cells[(*scene, phase)] for phase in phases]
        return [
            [cells[seed] for cells in found] for seed in found[0] if all(seed in cells for cells in found)
        ]

    def mean(self, scene: ThesisScene, phase: str, quantity: str) -> float:
        """Returns the mean of an attribute of the cells over the seeds."""
        return statistics.fmean(getattr(cell, quantity) for cell in self.of(scene, phase))


def thesis_study(
    results: str | os.PathLike[str],
    phases: Sequence[Choice] = PHASES,
    bodies: Sequence[int] = BODIES,
    densities: Sequence[float] = DENSITIES,
    *,
    seeds: int = 6,
    until: float = 1.0,
    seconds: float = 0.01,
    repeats: int = ROUNDS,
) -> Study:
    """Returns the study ``thesis``, or a part of it; its rows are in the folder ``results``.

    Every phase runs every scene with the seeds 1 to ``seeds``, up to the time ``until``, in this many rounds
    (``repeats``). ``seconds`` is the CPU time that the runs of a phase on a scene with one seed have together
    in a round, at least, unless that would be more than 40 runs.

    Raises StudyError for what cannot be run.
    """
    tables = shipped_tables("thesis") | {
        "phases": [write_phase(*each) for each in phases_with_options(phases)],
        "seeds": list(range(1, seeds + 1)),
        "repeats": repeats,
        "until": until,
        "seconds": seconds,
        "scenes": [
            {"recipe": "grid", "parameters": {"density": list(densities), "bodies": list(bodies)}},
        ],
    }
    return Study(tables, results)


def read_bench(study: Study) -> ThesisBench:
    """Returns the cells of ``thesis_study`` of which all rounds have been run, and how they were measured."""
    cells: dict[tuple[Any, ...], list[Mapping[str, Any]]] = {}
    for row in study.rows().to_pylist():
        if row["status"] == "done":
            cells.setdefault((row["density"], row["bodies"], row["seed"], row["phase"]), []).append(row)
    plan = study.plan
    whole = [rows for rows in cells.values() if len(rows) == plan.file.repeats]
    conditions = {
        "seeds": len({each["seed"] for each in plan.scenes[0].combinations}),
        "until": plan.scenes[0].until,
        "seconds": plan.file.seconds,
        "repeats": plan.file.repeats,
    }
    return ThesisBench(tuple(map(_cell, whole)), environment() | conditions)


def _cell(rounds: Sequence[Mapping[str, Any]]) -> Cell:
    """Returns what the rows of one scene under one phase come to; counts are the same in all of them."""
    row = rounds[0]
    least = time.get_clock_info("process_time").resolution
    same = (
        *("density", "bodies", "seed", "phase", "until", "contacts_disc", "contacts_wall", "queue_max"),
        *("pairs_mean", "pairs_of_one_body", "pair_changes", "fingerprint"),
    )
    return Cell(
        **{name: row[name] for name in same},
        cpu_seconds=tuple(max(each["cpu_seconds"], least) for each in rounds),
        bound_events=row["structural_events"],
        certificates_updated=row["certificates_updated"] - row["construction_updated"],
        partners_asked=row["partners_asked"] - row["construction_asked"],
        contacts_computed=row["contacts_computed"] - row["construction_computed"],
        pairs_max=row["pairs_most"],
    )
