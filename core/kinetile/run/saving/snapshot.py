"""A snapshot: a simulation at one moment, and how a run goes on from it.

It holds the state of the run (``RunState``) and what the simulation adds. To go on, the phases are prepared
for the bodies of that moment, and their structure is built: in the same program, in another process and under
another broad phase alike. That cannot change an answer, only take time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from kinetile.errors import RecordError
from kinetile.kernel.clock import SPAN, TICKS
from kinetile.kernel.log import INSERTED, REANCHORED, REMOVED, TURNED, WALLS
from kinetile.kernel.plan import Plan, positions_after
from kinetile.kernel.tables import COUNTS, JAMMED, NOBODY
from kinetile.run.compose import Composition
from kinetile.run.engine.agenda import command_of
from kinetile.run.engine.contents import CARRIED, COSTS, RunState, numbers_of
from kinetile.run.engine.engine import Engine
from kinetile.run.prepared import standing, with_shapes
from kinetile.scene import Scene
from kinetile.scene.checks import LARGEST


@dataclass(frozen=True)
class SavedPhases:
    """The phases of a simulation by name, with their options."""

    broad_phase: str
    options: Mapping[str, Any]
    narrow_phases: Mapping[str, Mapping[str, Any]]

    @classmethod
    def of(cls, composition: Composition) -> SavedPhases:
        """Returns the names of a composition."""
        narrow = {name: dict(options) for name, options in composition.narrow_phases.items()}
        return cls(composition.broad_phase, dict(composition.options), narrow)


@dataclass(frozen=True, eq=False, repr=False)
class Snapshot:
    """A simulation at one moment, as ``Simulation.snapshot`` returns it: to restore, to compare.

    Two snapshots are equal if they hold the same bits: the same scene under the same phases, the same plans,
    commands and contacts. CPU times are not compared, nor counts that depend on the structure, nor what was
    observed. The contents of a snapshot are private, and may change in the next version.
    """

    scene: Scene
    phases: SavedPhases
    state: RunState
    audit: int | None
    start_energy: float
    observed: Mapping[str, Any] | None = None

    def __eq__(self, other: object) -> bool:
        return self._values() == other._values() if isinstance(other, Snapshot) else NotImplemented

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<Snapshot: {len(self.scene)} bodies at first, under {self.phases.broad_phase}>"

    def _values(self) -> tuple[Any, ...]:
        state, contents, entries = self.state, self.state.contents, self.state.entries
        tables = contents.plans, contents.passings, contents.commands, state.overlapping, *entries.unrecorded
        counts = [contents.counts[name].tobytes() for name in COUNTS.names or () if name not in COSTS]
        ledger = entries.rows, entries.digest.hexdigest(), entries.unstepped
        mine = self.scene, self.phases, self.audit, self.start_energy, state.history.content, ledger
        rows = [table.tobytes() for table in tables], counts, contents.clock
        return (
            *mine,
            *rows,
            state.base,
            state.bounds,
            state.commands,
            state.later,
            state.requested,
            state.audits,
        )


def take(
    engine: Engine,
    scene: Scene,
    audit: int | None,
    energy: float,
    observed: Callable[[], Mapping[str, Any] | None],
) -> Snapshot:
    """Returns a snapshot of an engine, between two chunks, and of the further state of its
    simulation.

    Raises RecordError if it has ended with a fault, so that no run can continue from it.
    """
    if engine.broken is not None or engine.fields.fault.code[0] not in (0, JAMMED):
        raise RecordError(
            "this simulation has ended with a fault and cannot go on, so it is not saved: what was saved "
            "before it can be taken up"
        )
    return Snapshot(scene, SavedPhases.of(engine.composition), engine.run_state(), audit, energy, observed())


def gone_on(snapshot: Snapshot, scene: Scene, composition: Composition) -> Engine:
    """Returns an engine that goes on from a snapshot of a scene, under the phases of a composition.

    Raises RecordError for a snapshot of another scene or of other narrow phases, Refused if the broad phase
    does not accept the bodies.
    """
    if scene is not snapshot.scene and scene != snapshot.scene:
        raise RecordError(
            "this snapshot is of another scene: only a simulation of that one can go on from it"
        )
    saved, mine = snapshot.phases.narrow_phases, SavedPhases.of(composition).narrow_phases
    if mine != saved:
        raise RecordError(
            f"this snapshot is of a run with the narrow phases {', '.join(saved)}, and this simulation has "
            f"{', '.join(mine)}, or other options of them: they make the contacts, so they have to be the "
            "same"
        )
    table = with_shapes(scene, snapshot.state.shapes)
    present = standing(snapshot.state.contents, table, composition.prepared.capacity)
    return Engine(scene, composition.prepared_for(present), state=snapshot.state)


def check_state(state: RunState, scene: Scene) -> None:
    """Raises ValueError for a state that no run of a scene has.

    The compiled loop reads indices without looking at them, and a checksum detects damage only: so of a state
    from a file each value that becomes an index is compared with its table, and the others with the range of
    their kind. What is left describes some run. O(n).
    """
    with np.errstate(all="ignore"):
        for said in (*_of_plans(state, scene), *_of_numbers(state, scene), *_of_commands(state, scene)):
            raise ValueError(said)


def _of_plans(state: RunState, scene: Scene) -> Iterator[str]:
    """Bodies are where they can be, no faster than the bound, of a mass and a size; pairs are of two."""
    plans, passings, now = state.contents.plans, state.contents.passings, state.contents.clock["now"]
    number, numbers = plans["number"].astype(np.int64), numbers_of(scene, state.history)
    in_order = (np.diff(number, prepend=-1) > 0).all() and (number < numbers).all()
    met = (plans["last"] >= NOBODY) & (plans["last"] < numbers)
    kinds = (plans["kind"] >= 0) & (plans["kind"] < len(scene.kinds))
    if not in_order or not met.all() or not kinds.all():
        yield "a body has a number, a partner or a kind that there is not"
    if not np.isin([passings["a"], passings["b"]], number).all() or not (passings["a"] < passings["b"]).all():
        yield "a pair that passes is not of two bodies"
    if ((plans["anchor"] > max(now, 0)) | (plans["anchor"] < -(1 << 62) - SPAN)).any():
        yield "a plan begins after the present, or too long ago"
    # Immovable bodies have a speed of their own, which the bound, from energy, does not hold.
    speed = np.hypot(plans["vx"], plans["vy"])[np.isfinite(plans["mass"])]
    if not (speed <= state.bounds.speed * (1.0 + 2.0**-20)).all() or not state.bounds.speed < math.inf:
        yield "a body is faster than the run allows for"
    elapsed = (now - plans["anchor"]) * (scene.time_unit / TICKS)
    sizes = Plan(*map(np.abs, Plan.of(plans)))
    if not (positions_after(sizes, np.abs(elapsed)) <= 2.0**16 * LARGEST).all():
        yield "a body is farther away than any body can be"
    radius = plans["radius"]
    if not ((radius > 0.0) & (radius <= LARGEST) & (plans["mass"] > 0.0)).all():
        yield "a body has no radius or no mass"
    shapes = (*scene.shapes, *state.shapes)
    if not ((plans["form"] >= -(not shapes)) & (plans["form"] < len(shapes))).all():
        yield "a body has a shape that there is not"
    reach = np.array([each.reach for each in shapes])
    if shapes and not np.array_equal(radius, reach[plans["form"]]):
        yield "a body has not the radius of its shape"
    pairs = state.overlapping
    whole = np.array_equal(number, np.arange(len(scene)))  # their slots are their numbers
    if len(pairs) and not (whole and ((pairs >= 0) & (pairs < len(scene))).all()):
        yield "a pair that overlaps at the start is not of two bodies"


def _of_numbers(state: RunState, scene: Scene) -> Iterator[str]:
    """Numbers of the clock, and counts, are in their ranges."""
    clock, counts = state.contents.clock, state.contents.counts
    in_range = dict.fromkeys(("met_there", "jam.window"), (0, 1 << 62))
    numbers = numbers_of(scene, state.history)
    in_range |= {"now": (-1, SPAN + 1), "torus.number": (0, numbers + 1)}
    in_range |= dict.fromkeys(("fault.a", "fault.b"), (min(WALLS), numbers))
    for name in CARRIED:
        least, end = in_range.get(name, (-(1 << 63), 1 << 63))
        if not least <= clock[name] < end:
            yield f"{name} is {clock[name]}"
    if clock["fault.code"] not in (0, JAMMED):
        yield f"the run had ended with fault {clock['fault.code']}"
    counted = counts[0].item() if len(counts) == 1 else (math.nan,)
    if not all(0 <= each < 1 << 61 if isinstance(each, int) else math.isfinite(each) for each in counted):
        yield "a count is none"
    if not 0 <= state.base < 1 << 200:
        yield f"base is {state.base}"


def _of_commands(state: RunState, scene: Scene) -> Iterator[str]:
    """Each command is for a body that is there by then, or inserts one that is not, in the order of time."""
    contents, numbers = state.contents, numbers_of(scene, state.history)
    shapes = (*scene.shapes, *state.shapes)
    present = set(contents.plans["number"].tolist())
    waiting = [command_of(row, state.base) for row in contents.commands]
    last = contents.clock["now"] + state.base * TICKS
    for each in (*waiting, *state.later):
        new = each.code == INSERTED
        known = 0 <= each.body < numbers and (each.body in present) != new
        if each.code not in (TURNED, REANCHORED, INSERTED, REMOVED) or not known or each.ticks < last:
            yield f"a command for body {each.body} is none, or too late"
            return
        last = each.ticks
        if new:
            present.add(each.body)
        elif each.code == REMOVED:
            present.remove(each.body)
        right = not new or (0.0 < each.radius <= LARGEST and each.mass > 0.0)
        if new and shapes:
            right = right and 0 <= each.form < len(shapes) and each.radius == shapes[each.form].reach
        flies = all(abs(each[at]) <= LARGEST for at in range(3, 7))
        if not right or not flies or not 0 <= each.kind < len(scene.kinds):
            yield f"a command for body {each.body} has values that no body has"
            return
