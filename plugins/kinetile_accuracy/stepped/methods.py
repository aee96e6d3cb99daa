"""Methods of the chart of speed against error, measured on scenes of one kind: their cost and their errors.

After a few contacts a disc, two runs that differ by a rounding have different contacts. *First encounters*
are contacts of two discs that *have both touched nothing before*, no disc and no wall: all methods agree
until then. A method has such an encounter if it, too, has it as the first contact of both discs, with an
impulse, at any time; if several contacts are found at the same snapshot, each may be the first.

Times are processor time of the loop alone (with static construction, without set-up and compilation), the
median of at least five runs, with the methods in turn. Errors are taken from other runs.
"""

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

import kinetile as kt
from kinetile.arrays import Flags, Integers, Rows
from kinetile_accuracy.sections import Column
from kinetile_accuracy.stepped.engines import Watched, run_engine
from kinetile_accuracy.stepped.snapshots import STEPPED, SteppedRun, run_snapshots

UNTIL = 1.0
"""The simulated time of the measurements of costs and overlaps."""

ROUNDS = 5
"""The least number of timed runs of each method on a scene."""

_SPACINGS = 4.0  # first encounters are searched until a disc has flown this many times the grid's spacing
_ENOUGH = 0.01  # CPU seconds of a method on a scene, at least ...
_MOST = 20  # ... unless that takes more runs than this in a round

MethodKind = Literal["kinetic", "snapshots", "engine"]


def first_encounters(contacts: Rows, bodies: int) -> Integers:
    """Returns the numbers of the contacts, in the order of time, that are first encounters of two discs."""
    return np.flatnonzero(_first_of_both(contacts, bodies, np.arange(len(contacts))))


def _first_of_both(contacts: Rows, bodies: int, step: Integers) -> Flags:
    """Returns True for each contact of two discs at the step of the first contact of both."""
    one, discs = contacts["a"], contacts["b"] >= 0
    other = np.where(discs, contacts["b"], one)
    first = np.full(bodies, np.iinfo(np.int64).max)
    for body in (one, other):
        np.minimum.at(first, body, step)
    return np.asarray(discs & (first[one] == step) & (first[other] == step))


def found(pairs: npt.NDArray[np.integer[Any]], contacts: Rows, bodies: int) -> Flags:
    """Returns True for each of the ``pairs``, (k, 2), whose contact is the first of both discs, (k,)."""
    first = contacts[_first_of_both(contacts, bodies, contacts["step"])]
    a, b = first["a"].astype(np.int64), first["b"].astype(np.int64)
    wanted = np.sort(np.asarray(pairs, dtype=np.int64).reshape(-1, 2), axis=1)
    return np.isin(wanted[:, 0] * bodies + wanted[:, 1], np.minimum(a, b) * bodies + np.maximum(a, b))


@dataclass(frozen=True)
class SpeedError:
    """One method on one kind of scene; costs and overlaps: the median over the timed scenes."""

    bodies: Annotated[int, Column("of the scenes", "discs")]
    density: Annotated[float, Column("of the scenes", "density")]
    kind: Annotated[MethodKind, Column("kinetic, snapshots or engine")]
    method: Annotated[str, Column("broad phase, how snapshots find pairs, or engine", "method")]
    dt: Annotated[float | None, Column("the step, in the scene's time; empty for kinetic methods", "dt")]
    cost: Annotated[float, Column("median run of a unit of simulated time", "CPU s per unit of time")]
    cost_low: Annotated[float, Column("of the cheapest of the scenes")]
    cost_high: Annotated[float, Column("of the dearest of the scenes")]
    deepest: Annotated[float, Column("of two discs, in radii", "deepest overlap / r")]
    deepest_high: Annotated[float, Column("the greatest of the scenes")]
    energy_drift: Annotated[float, Column("relative change of the kinetic energy, at most", "energy drift")]
    contacts: Annotated[float, Column("of two discs in a unit of time, the mean", "contacts of discs")]
    events: Annotated[float | None, Column("of a kinetic method in a unit of time, the mean", "events")]
    encounters: Annotated[int, Column("how many were looked for", "first encounters")]
    missed: Annotated[int, Column("of them, those that are not the first contact of both discs", "missed")]
    missed_share: Annotated[float, Column("missed / first encounters", "share missed")]


class ReferenceRun(NamedTuple):
    """A scene, the pairs of its first encounters, (k, 2), and the time of the last of them."""

    scene: kt.Scene
    pairs: Integers
    last: float


@dataclass(frozen=True)
class Method:
    """A way to simulate: a broad phase, snapshots, or an engine; the latter two with a step ``dt``."""

    kind: MethodKind
    name: str
    dt: float | None = None

    def run(self, scene: kt.Scene, until: float, watched: Watched) -> SteppedRun:
        """Runs a scene to a time; the steps of a kinetic method are its events."""
        name: Any = self.name
        if self.kind == "engine":
            return run_engine(name, scene, self.dt or 0.0, until, watched=watched)
        if self.kind == "snapshots":
            return run_snapshots(scene, self.dt or 0.0, until, finder=name)
        simulation = kt.Simulation(scene, name, keep_contacts=watched != "not")
        simulation.compile()
        simulation.run(until)
        contacts = np.empty(0, STEPPED)
        if watched != "not":
            contacts = np.zeros(len(simulation.contacts), STEPPED)
            contacts["step"] = np.arange(len(contacts))
            contacts["a"], contacts["b"] = simulation.contacts["a"], simulation.contacts["b"]
        now, at_end = simulation.readings, (simulation.positions(), simulation.velocities())
        errors = now.deepest_overlap, now.unaccounted_energy
        return SteppedRun(0.0, now.events, *at_end, contacts, *errors, now.cpu_seconds)

    def cost(self, scene: kt.Scene) -> float:
        """Returns the CPU seconds of a unit of simulated time."""
        return self.run(scene, scene.start + UNTIL, "not").cpu_seconds / UNTIL


def measure_rows(
    methods: Sequence[Method],
    bodies: int,
    density: float,
    *,
    seeds: int,
    encounters: int,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> list[SpeedError]:
    """Returns a row for each method, on scenes of the recipe ``grid``: ``seeds`` scenes are timed; about this
    many first ``encounters`` are searched. ``progress`` gets the steps done, and their total."""
    scenes = [kt.make_scene("grid", bodies=bodies, density=density, seed=seed + 1) for seed in range(seeds)]
    total = seeds + len(methods)
    progress(0, total)
    observed: list[list[SteppedRun]] = []
    costs: list[list[float]] = []
    for k, scene in enumerate(scenes):
        observed.append([method.run(scene, scene.start + UNTIL, "depths") for method in methods])
        costs.append(_costs(methods, scene))
        progress(k + 1, total)
    known = reference_runs(bodies, density, encounters)
    sought = sum(len(each.pairs) for each in known)
    rows = []
    measured = zip(methods, zip(*observed, strict=True), zip(*costs, strict=True), strict=True)
    for k, (method, runs, cost) in enumerate(measured):
        deepest = [run.deepest for run in runs]
        pairs = [int((run.contacts["b"] >= 0).sum()) for run in runs]
        events = statistics.mean(run.steps for run in runs) / UNTIL if method.kind == "kinetic" else None
        missed = _missed(method, known)
        rows.append(
            SpeedError(
                bodies,
                density,
                method.kind,
                method.name,
                method.dt,
                cost=statistics.median(cost),
                cost_low=min(cost),
                cost_high=max(cost),
                deepest=statistics.median(deepest),
                deepest_high=max(deepest),
                energy_drift=max(run.energy_drift for run in runs),
                contacts=statistics.mean(pairs) / UNTIL,
                events=events,
                encounters=sought,
                missed=missed,
                missed_share=missed / sought,
            )
        )
        progress(seeds + k + 1, total)
    return rows


def reference_runs(bodies: int, density: float, encounters: int) -> list[ReferenceRun]:
    """Returns scenes that together have at least this many first encounters, by the run under ``naive``."""
    known: list[ReferenceRun] = []
    count, seed = 0, 0
    while count < encounters and seed < 10 * encounters:
        seed += 1
        scene = kt.make_scene("grid", bodies=bodies, density=density, seed=seed)
        simulation = kt.Simulation(scene, "naive")
        simulation.run(scene.start + _SPACINGS / math.sqrt(bodies))
        contacts = simulation.contacts
        first = contacts[first_encounters(contacts, bodies)]
        pairs = np.column_stack([first["a"], first["b"]]).astype(np.int64)
        if len(pairs):
            known.append(ReferenceRun(scene, pairs, float(first["time"].max())))
            count += len(pairs)
    return known


def _missed(method: Method, known: Sequence[ReferenceRun]) -> int:
    missed = 0
    for scene, pairs, last in known:
        run = method.run(scene, last + 2.0 * (method.dt or 0.0), "contacts")
        missed += int((~found(pairs, run.contacts, len(scene))).sum())
    return missed


def _costs(methods: Sequence[Method], scene: kt.Scene) -> list[float]:
    """Returns the cost of each method on a scene, the median of runs with the methods in turn."""
    batches = [min(math.ceil(_ENOUGH / ROUNDS / max(method.cost(scene), 1e-9)), _MOST) for method in methods]
    runs: list[list[float]] = [[] for _ in methods]
    for _ in range(ROUNDS):
        for method, count, costs in zip(methods, batches, runs, strict=True):
            costs += [method.cost(scene) for _ in range(count)]
    return list(map(statistics.median, runs))
