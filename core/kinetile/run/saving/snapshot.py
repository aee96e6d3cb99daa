"""A snapshot: a simulation at one moment, with its state (``RunState``) and the simulation's own values. To
continue, the phases are prepared for the bodies of that moment, in any process and under any broad phase."""

import hashlib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from typing import Any

import numpy as np

from kinetile.errors import RecordError
from kinetile.kernel.clock import SPAN, TICKS, Clock
from kinetile.kernel.log import INSERTED, REANCHORED, REMOVED, WALLS
from kinetile.kernel.plan import AcceleratedPlan, Plan, positions_after
from kinetile.kernel.tables import JAMS, LONG_AGO, NEVER, NOBODY, Quantity, Role, declared
from kinetile.run.compose import Composition
from kinetile.run.engine.bounds import unfit_pull
from kinetile.run.engine.commands import Command, command_of
from kinetile.run.engine.engine import Engine
from kinetile.run.engine.kept import Kept
from kinetile.run.engine.state import RunState, numbers_of
from kinetile.run.prepared import present_scene, widened
from kinetile.scene import Insert, Scene
from kinetile.scene.checks import LARGEST
from kinetile.scene.commands import OF_CODE, values_of
from kinetile.scene.shapes import Shape


@dataclass(frozen=True)
class SavedPhases:
    """The phases of a simulation by name, with their options."""

    broad_phase: str
    options: Mapping[str, Any]
    narrow_phases: Mapping[str, Mapping[str, Any]]

    @classmethod
    def of(cls, composition: Composition) -> "SavedPhases":
        """Returns the names of a composition."""
        narrow = {name: dict(options) for name, options in composition.narrow_phases.items()}
        return cls(composition.broad_phase, dict(composition.options), narrow)


@dataclass(frozen=True, eq=False, repr=False)
class Snapshot:
    """A simulation at one moment, as ``Simulation.snapshot`` returns it, for restoring and comparing.

    Two snapshots are equal if they hold the same bits: the same scene under the same phases, the same plans,
    commands and contacts. CPU times, counts that depend on the structure, and observations are not compared.
    The contents of a snapshot are private, and may change in the next version.
    """

    scene: Scene
    phases: SavedPhases
    whole: RunState | Kept
    audit: int | None
    start_energy: float
    observed: Mapping[str, Any] | None = None

    @property
    def state(self) -> RunState:
        """The state of the run."""
        return self.whole.state if isinstance(self.whole, Kept) else self.whole

    def __eq__(self, other: object) -> bool:
        return self._values() == other._values() if isinstance(other, Snapshot) else NotImplemented

    def __hash__(self) -> int:
        return int(self.state_fingerprint[:15], 16)  # the hash of a text would differ between processes

    @cached_property
    def state_fingerprint(self) -> str:
        """Hex digest of bodies, passings, clock and commands to come, as ``Simulation.state_fingerprint``."""
        contents, later = self.state.contents, self.state.later
        lengths = (*map(len, contents), self.state.base, later.ticks, self.state.shapes)
        found = [repr(lengths).encode(), later.rows.tobytes(), self.state.overlapping.tobytes()]
        for rows in (*contents[:3], contents.clock):  # counts belong to the past, stops to the caller
            names = (each.name for each in declared(rows.dtype, Role.CARRIED))
            found += [rows[name].tobytes() for name in names if not name.startswith("stops.")]
        return hashlib.sha256(b"".join(found)).hexdigest()

    def __repr__(self) -> str:
        return f"<Snapshot: {len(self.scene)} bodies at first, under {self.phases.broad_phase}>"

    def _values(self) -> tuple[Any, ...]:
        state, entries = self.state, self.state.entries
        tables = [state.overlapping, state.later.rows, *entries.unrecorded]
        for rows in state.contents:
            tables += (rows[field.name] for field in declared(rows.dtype, Role.CARRIED))
        return (
            *(self.scene, self.phases, self.audit, self.start_energy, state.history.content),
            *(state.history.names, state.history.told, state.history.kept, state.shapes),
            *(entries.rows, entries.digest.hexdigest(), entries.pending_events),
            [table.tobytes() for table in tables],
            *(state.base, state.bounds, state.commands, state.later.ticks, state.requested, state.audits),
        )


def resumed(snapshot: Snapshot, scene: Scene, composition: Composition) -> Engine:
    """Returns an engine that continues from a snapshot of a scene, under the phases of a composition.
    RecordError for another scene or other narrow phases, Refused if the broad phase refuses the bodies."""
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
    table = widened(scene, snapshot.state.shapes, snapshot.state.pull)
    contents = snapshot.state.contents
    present = present_scene(contents.plans, contents.clock["now"], table, composition.prepared.capacity)
    return Engine(scene, composition.prepared_for(present), state=snapshot.state)


def check_state(state: RunState, scene: Scene) -> None:
    """Raises ValueError for a state that no run of a scene has, in O(n). The compiled loop does not check
    indices, and a checksum detects only damage: so each value is compared with the range of its quantity, or
    its table."""
    with np.errstate(all="ignore"):
        for text in chain(_of_ranges(state, scene), _of_plans(state, scene), _of_commands(state, scene)):
            raise ValueError(text)  # the first: a wrong value is no index for the next check


def _of_ranges(state: RunState, scene: Scene) -> Iterator[str]:
    """Each value is in the range of its quantity."""
    numbers, shapes = numbers_of(scene, state.history), len(scene.shapes) + len(state.shapes)
    ranges: dict[Quantity, tuple[float, float]] = {
        Quantity.SLOT: (NOBODY, numbers - 1),
        **dict.fromkeys((Quantity.PARTNER, Quantity.NUMBER), (min(WALLS), numbers - 1)),
        Quantity.KIND: (0, len(scene.kinds) - 1),
        Quantity.SHAPE: (0, shapes - 1) if shapes else (NOBODY, NOBODY),
        Quantity.COUNT: (0, 1 << 61),
        Quantity.VALUE: (-math.inf, math.inf),
    }
    if len(state.contents.counts) != 1 or len(state.contents.clock) != 1:
        yield "it has not one clock with its counts"
    elif not all(map(math.isfinite, state.contents.counts[0].item())):
        yield "a count is not finite"
    for table, rows in state.contents._asdict().items():
        for name, _, quantity, _ in declared(rows.dtype):
            least, most = ranges.get(quantity, (LONG_AGO - SPAN, NEVER))  # ticks
            for value in rows[name][~((rows[name] >= least) & (rows[name] <= most))][:1].tolist():
                yield f"{name} of its {table} is {value}"
    now, fault = int(state.contents.clock["now"][0]), int(state.contents.clock["fault.code"][0])
    if not -1 <= now <= SPAN:
        yield f"now is {now}"
    if fault not in (0, *JAMS):
        yield f"the run had ended with fault {fault}"
    given = [*dict(state.history.told.inserted), *state.history.told.changed.values()]
    if not {*given} <= {*range(len(scene.kinds))}:
        yield f"kinds that commands have given are {given}"
    if not 0 <= state.base < 1 << 200:
        yield f"base is {state.base}"


def _of_plans(state: RunState, scene: Scene) -> Iterator[str]:
    """Bodies have possible places, speeds within the bound, a mass and a size; pairs have two bodies."""
    plans, passings, now = state.contents.plans, state.contents.passings, state.contents.clock["now"]
    number = plans["number"].astype(np.int64)
    if not (np.diff(number, prepend=-1) > 0).all():
        yield "a body has a number that there is not"
    if not np.isin([passings["a"], passings["b"]], number).all() or not (passings["a"] < passings["b"]).all():
        yield "a pair that passes is not of two bodies"
    own, supports = "whole_" if scene.resting else "a", plans["supports"]
    pulls = np.stack([plans[f"{own}x"], plans[f"{own}y"]], axis=-1)
    held = np.stack([plans["support"], plans["second"]], axis=-1)
    known = np.isin(held, number) | (held < 0)
    if not (supports <= 2 * scene.resting).all() or not known[np.arange(2) < supports[:, None]].all():
        yield "a body has an absent support"
    if scene.resting and not (plans["ledge"] >= now).all():
        yield "a body has not left its support"
    pull = state.pull or scene.pull
    if len(pull) != 2 or not all(type(each) is float and each >= 0.0 for each in pull):
        yield f"its largest accelerations are {pull}"
    elif wrong := unfit_pull(scene, pull):
        yield f"its largest accelerations are {pull}; expected {wrong}"
    most = sum(pull) * (1.0 + 2.0**-20)
    if not (np.abs(pulls) <= pull).all() or not (np.hypot(plans["ax"], plans["ay"]) <= most).all():
        yield "a body is accelerated by more than the run allows for"
    if (plans["anchor"] > np.maximum(now, 0)).any():
        yield "a plan begins after the present"
    # Immovable bodies have a speed of their own, which the bound, from energy, does not contain.
    speed = np.hypot(plans["vx"], plans["vy"])[np.isfinite(plans["mass"])]
    if not (speed <= state.bounds.speed * (1.0 + 2.0**-20)).all() or not state.bounds.speed < math.inf:
        yield "a body is faster than the run allows for"
    elapsed = (now - plans["anchor"]) * (scene.time_unit / TICKS)
    sizes = AcceleratedPlan(*map(np.abs, Plan.of(plans)))
    if not (positions_after(sizes, np.abs(elapsed)) <= 2.0**16 * LARGEST).all():
        yield "a body is farther away than any body can be"
    radius = plans["radius"]
    if not ((radius > 0.0) & (radius <= LARGEST) & (plans["mass"] > 0.0)).all():
        yield "a body has no radius or no mass"
    reach = np.array([each.reach for each in (*scene.shapes, *state.shapes)])
    if len(reach) and not np.array_equal(radius, reach[plans["form"]]):
        yield "a body has not the radius of its shape"
    pairs = state.overlapping
    whole = np.array_equal(number, np.arange(len(scene)))  # their slots are their numbers
    if len(pairs) and not (whole and ((pairs >= 0) & (pairs < len(scene))).all()):
        yield "a pair that overlaps at the start is not of two bodies"


def _of_commands(state: RunState, scene: Scene) -> Iterator[str]:
    """Each command is for a body present at its time, or inserts an absent one; they are sorted by time."""
    contents, numbers = state.contents, numbers_of(scene, state.history)
    table, clock = widened(scene, state.shapes, state.pull), Clock(scene.start, scene.time_unit)
    present = set(contents.plans["number"].tolist())
    waiting = [command_of(row, state.base) for row in contents.commands]
    last = int(contents.clock["now"][0]) + state.base * TICKS
    for each in (*waiting, *map(Command, *state.later)):
        body, code, row = each.body, each.code, each.row
        new = code == INSERTED
        known = 0 <= body < numbers and (body in present) != new
        if code not in (*OF_CODE, REANCHORED) or not known or each.ticks < last:
            yield f"a command for body {body} is impossible, or too late"
            return
        last = each.ticks
        if new:
            present.add(body)
        elif code == REMOVED:
            present.remove(body)
        right = 0 <= row["kind"] < len(scene.kinds) and 0 <= row["form"] < max(len(table.shapes), 1)
        if right and code != REANCHORED:
            made = each.as_scene_has_it(clock, table)
            right = not any(field.expected(value) for field, value in values_of(made).values())
            if isinstance(made, Insert) and isinstance(made.shape, Shape):
                right = right and made.radius == made.shape.reach
        if not right:
            yield f"a command for body {body} has values that no body has"
            return
