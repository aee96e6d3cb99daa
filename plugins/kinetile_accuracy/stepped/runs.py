"""The runs behind the chart of speed against error: every method on scenes of one kind.

Times are processor time of the loop alone (static construction included, set-up and compilation apart), the
median of at least five runs, with Python's garbage collector off; the methods take turns, so that a machine
that slows down slows all of them. Errors are taken from other runs than the times.
"""

from __future__ import annotations

import gc
import math
import statistics
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.plugin.by_name import make_scene
from kinetile.run.simulation import Simulation
from kinetile.scene import Scene
from kinetile_accuracy.parts import Column
from kinetile_accuracy.stepped.encounters import Missed, first_encounters, missed_of
from kinetile_accuracy.stepped.peers import Watched, run_peer
from kinetile_accuracy.stepped.snapshot import Stepped, run_snapshots

__all__ = ["ROUNDS", "UNTIL", "Kind", "Method", "SpeedError", "Truth", "measure_rows", "truths"]

UNTIL = 1.0
"""How long is simulated where costs and overlaps are measured."""

ROUNDS = 5
"""Each method has at least so many timed runs on a scene."""

_SPACINGS = 4.0  # first encounters are looked for until a disc has flown so many times the grid's spacing
_ENOUGH = 0.01  # CPU seconds of a method on a scene, at least ...
_MOST = 20  # ... unless that takes more runs than this in a round

Kind = Literal["kinetic", "snapshots", "engine"]


@dataclass(frozen=True)
class SpeedError:
    """One method on one kind of scene; costs and overlaps: the median over the timed scenes."""

    bodies: Annotated[int, Column("of the scenes", "discs")]
    density: Annotated[float, Column("of the scenes", "density")]
    kind: Annotated[Kind, Column("kinetic, snapshots or engine")]
    method: Annotated[str, Column("broad phase, how snapshots find pairs, or engine", "method")]
    dt: Annotated[float | None, Column("the step, in the scene's time; kinetic methods have none", "dt")]
    cost: Annotated[float, Column("median run of a unit of simulated time", "CPU s per unit of time")]
    cost_low: Annotated[float, Column("of the cheapest of the scenes")]
    cost_high: Annotated[float, Column("of the dearest of the scenes")]
    deepest: Annotated[float, Column("of two discs, in radii", "deepest overlap / r")]
    deepest_low: Annotated[float, Column("the least of the scenes")]
    deepest_high: Annotated[float, Column("the greatest of the scenes")]
    depth_median: Annotated[
        float | None, Column("when found, in radii (engines: after that step)", "median overlap / r")
    ]
    energy_drift: Annotated[float, Column("relative change of the kinetic energy, at most", "energy drift")]
    contacts: Annotated[float, Column("of two discs in a unit of time, the mean", "contacts of discs")]
    events: Annotated[float | None, Column("of a kinetic method in a unit of time, the mean", "events")]
    encounters: Annotated[int, Column("how many were looked for", "first encounters")]
    missed: Annotated[int, Column("of them, those that are not the first contact of both discs", "missed")]
    passed: Annotated[int, Column("of them, those that get no impulse", "without an impulse")]
    unseen: Annotated[int, Column("of them, those that are not even seen as an overlap", "unseen")]
    missed_share: Annotated[float, Column("missed / first encounters", "share missed")]
    missed_error: Annotated[float, Column("standard error of that share")]


class Truth(NamedTuple):
    """A scene, the pairs of its first encounters, (k, 2), and the time of the last of them."""

    scene: Scene
    pairs: npt.NDArray[np.int64]
    last: float


class _Look(NamedTuple):
    """What a run found: contacts, with the snapshot of each, or its place in the order; all overlaps; and
    readings."""

    contacts: npt.NDArray[np.void]
    order: npt.NDArray[np.int64]
    overlaps: npt.NDArray[np.void]
    deepest: float
    depth_median: float | None
    energy_drift: float
    events: int | None


@dataclass(frozen=True)
class Method:
    """A way to simulate: a broad phase, snapshots, or an engine; the latter two with a step ``dt``."""

    kind: Kind
    name: str
    dt: float | None = None

    def cost(self, scene: Scene) -> float:
        """Return the CPU seconds of a unit of simulated time."""
        if self.kind != "kinetic":
            return self._stepped(scene, scene.start + UNTIL, "not").cpu_seconds / UNTIL
        simulation = Simulation(scene, self.name, keep_contacts=False)
        simulation.compile()
        simulation.run(scene.start + UNTIL)
        return simulation.readings.cpu_seconds / UNTIL

    def look(self, scene: Scene, until: float, watched: Watched = "depths") -> _Look:
        """Return what the method finds until a time."""
        if self.kind != "kinetic":
            run = self._stepped(scene, until, watched)
            contacts, order = run.contacts, run.contacts["step"]
            return _Look(contacts, order, run.overlaps, run.deepest, run.median_depth, run.energy_drift, None)
        simulation = Simulation(scene, self.name)
        simulation.run(until)
        contacts, readings = simulation.contacts, simulation.readings
        order = np.arange(len(contacts))
        found = readings.deepest_overlap, None, readings.energy_drift, readings.events
        return _Look(contacts, order, contacts, *found)

    def _stepped(self, scene: Scene, until: float, watched: Watched) -> Stepped:
        name: Any = self.name
        if self.kind == "engine":
            return run_peer(name, scene, self.dt or 0.0, until, watched=watched)
        return run_snapshots(scene, self.dt or 0.0, until, finder=name, parting=watched != "not")


def measure_rows(
    methods: Sequence[Method],
    bodies: int,
    density: float,
    *,
    seeds: int,
    encounters: int,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> list[SpeedError]:
    """Return a row for each method, on scenes of the recipe ``grid``.

    ``seeds`` scenes are timed; about so many first ``encounters`` are looked for, in as many scenes as that
    takes. ``progress`` is told how many steps are done, and how many there are.
    """
    scenes = [make_scene("grid", bodies=bodies, density=density, seed=seed + 1) for seed in range(seeds)]
    total = seeds + len(methods)
    progress(0, total)
    looks: list[list[_Look]] = [[] for _ in methods]
    costs: list[list[float]] = [[] for _ in methods]
    for k, scene in enumerate(scenes):
        for found_by, method in zip(looks, methods, strict=True):
            found_by.append(method.look(scene, scene.start + UNTIL))
        for cost_of, cost in zip(costs, _costs(methods, scene), strict=True):
            cost_of.append(cost)
        progress(k + 1, total)
    known = truths(bodies, density, encounters)
    rows = []
    for k, method in enumerate(methods):
        rows.append(_row(bodies, density, method, costs[k], looks[k], _missed(method, known)))
        progress(seeds + k + 1, total)
    return rows


def truths(bodies: int, density: float, encounters: int) -> list[Truth]:
    """Return scenes that together have at least so many first encounters, by the run with all pairs."""
    known: list[Truth] = []
    count, seed = 0, 0
    while count < encounters and seed < 10 * encounters:
        seed += 1
        scene = make_scene("grid", bodies=bodies, density=density, seed=seed)
        simulation = Simulation(scene, "naive")
        simulation.run(scene.start + _SPACINGS / math.sqrt(bodies))
        contacts = simulation.contacts
        first = contacts[first_encounters(contacts, bodies)]
        pairs = np.column_stack([first["a"], first["b"]]).astype(np.int64)
        if len(pairs):
            known.append(Truth(scene, pairs, float(first["time"].max())))
            count += len(pairs)
    return known


def _missed(method: Method, known: Sequence[Truth]) -> Missed:
    """Return how many first encounters a method misses."""
    total = Missed(0, 0, 0, 0)
    for scene, pairs, last in known:
        run = method.look(scene, last + 2.0 * (method.dt or 0.0), "contacts")
        total += missed_of(pairs, len(scene), run.contacts, run.order, run.overlaps)
    return total


def _costs(methods: Sequence[Method], scene: Scene) -> list[float]:
    """Return the cost of each method on a scene, the median of runs in which the methods take turns."""
    runs: list[list[float]] = [[] for _ in methods]
    with _no_collector():
        batches = [
            min(math.ceil(_ENOUGH / ROUNDS / max(method.cost(scene), 1e-9)), _MOST) for method in methods
        ]
        for _ in range(ROUNDS):
            for k, method in enumerate(methods):
                runs[k] += [method.cost(scene) for _ in range(batches[k])]
    return [statistics.median(each) for each in runs]


@contextmanager
def _no_collector() -> Iterator[None]:
    gc.collect()
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def _row(
    bodies: int,
    density: float,
    method: Method,
    costs: Sequence[float],
    looks: Sequence[_Look],
    missed: Missed,
) -> SpeedError:
    deepest = [look.deepest for look in looks]
    events = [look.events for look in looks if look.events is not None]
    medians = [look.depth_median for look in looks if look.depth_median is not None]
    return SpeedError(
        bodies=bodies,
        density=density,
        kind=method.kind,
        method=method.name,
        dt=method.dt,
        cost=statistics.median(costs),
        cost_low=min(costs),
        cost_high=max(costs),
        deepest=statistics.median(deepest),
        deepest_low=min(deepest),
        deepest_high=max(deepest),
        depth_median=statistics.median(medians) if medians else None,
        energy_drift=max(look.energy_drift for look in looks),
        contacts=statistics.mean(float((look.contacts["b"] >= 0).sum()) for look in looks) / UNTIL,
        events=statistics.mean(events) / UNTIL if events else None,
        encounters=missed.encounters,
        missed=missed.missed,
        passed=missed.passed,
        unseen=missed.unseen,
        missed_share=missed.share,
        missed_error=missed.error,
    )
