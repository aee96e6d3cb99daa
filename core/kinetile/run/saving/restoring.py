"""A snapshot put back into a simulation: as it was, or under another broad phase, built anew."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from kinetile.errors import RecordError
from kinetile.kernel.skin import Skin
from kinetile.kernel.tables import record_table
from kinetile.plugin.calling import described
from kinetile.run.composition import Commands, Composition
from kinetile.run.engine import Engine, Given
from kinetile.run.engine.commands.agenda import Agenda
from kinetile.run.interrupts import Unbroken
from kinetile.run.saving.held import Held, fill
from kinetile.run.saving.snapshot import Phases, Snapshot, plain
from kinetile.run.saving.versions import differences, versions_of
from kinetile.scene import spacious

if TYPE_CHECKING:
    from kinetile.run.saving.saves import CanBeSaved

__all__ = ["as_it_was", "built_anew", "put_back"]

Tables = TypeVar("Tables", bound=tuple[Any, ...])


def put_back(simulation: CanBeSaved, snapshot: Snapshot, anew: bool = False) -> None:
    """Have a simulation go on from a snapshot of its scene: as it was, where it has the same phases and its
    structure is not to be built ``anew``.

    Raises RecordError for a snapshot that cannot be gone on from, Refused where the broad phase cannot do
    what it is to go on with: then the simulation is as it was.
    """
    if simulation.scene is not snapshot.scene and simulation.scene != snapshot.scene:
        raise RecordError(
            "this snapshot is of another scene: only a simulation of that one can go on from it"
        )
    engine = simulation._engine
    mine = Phases.of(engine.composition)
    if mine.narrow_phases != snapshot.phases.narrow_phases:
        raise RecordError(
            f"this snapshot is of a run with the narrow phases {', '.join(snapshot.phases.narrow_phases)}, "
            f"and this simulation has {', '.join(mine.narrow_phases)}, or other options of them: they make "
            "the contacts, so they have to be the same"
        )
    if snapshot.numbers.keys() != plain(engine).keys() or set(snapshot.tables) != set(engine.k._fields):
        raise RecordError(
            "this snapshot is of another version of kinetile, with other numbers beside its tables"
        )
    if anew or mine != snapshot.phases:
        built_anew(engine, snapshot)
    else:
        as_it_was(engine, snapshot)
    simulation._given = Given.of(snapshot.given)
    simulation._audit = snapshot.more["audit"]
    simulation._start_energy = snapshot.more["start_energy"]


def as_it_was(engine: Engine, snapshot: Snapshot) -> None:
    """Put everything back, to the last bit. The phases are those of the snapshot."""
    _check_versions(engine.composition, snapshot)
    composition = _prepared(engine, snapshot)
    state = composition.broad.state
    _check_state(composition, snapshot.state)
    with Unbroken():
        engine.composition, engine.state = composition, state
        for name, array in zip(state._fields, state, strict=True):
            fill(array, snapshot.state[name])
        engine.k = _refilled(engine.k, snapshot.tables)
        _put_numbers(engine, snapshot)


def built_anew(engine: Engine, snapshot: Snapshot) -> None:
    """Put back what a run is, and have the engine's own broad phase build its structure for it now."""
    before = dict(vars(engine)), engine.clock.base, engine.ledger.entries
    with Unbroken():
        try:
            engine.k = _refilled(engine.k, snapshot.tables, fresh=True)
            _put_numbers(engine, snapshot)
            engine.renew()
        except BaseException:
            numbers, engine.clock.base, engine.ledger.entries = before
            vars(engine).update(numbers)
            raise


def _prepared(engine: Engine, snapshot: Snapshot) -> Composition:
    """Return the phases, prepared for what those of the snapshot had been prepared for."""
    mine = engine.composition
    if mine is snapshot.composition:
        return mine
    if not snapshot.at_start:
        return mine.prepared_for(snapshot.prepared)
    capacity = snapshot.prepared.capacity
    if mine.prepared.position is engine.scene.position and mine.prepared.capacity == capacity:
        return mine
    return mine.prepared_for(spacious(engine.scene, capacity))


def _check_versions(composition: Composition, snapshot: Snapshot) -> None:
    """Raise RecordError for a snapshot from elsewhere, of another version than what is to go on here."""
    if snapshot.composition is None:
        odd = differences(snapshot.versions or {}, versions_of(composition))
        if odd:
            raise RecordError(f"what goes on here is not what was saved: {odd}; {_anew(composition)}")


def _anew(composition: Composition) -> str:
    return (
        f"broad_phase={composition.broad_phase!r} (--broad-phase {composition.broad_phase}) goes on from it "
        "with a structure that is built anew, and has the same contacts"
    )


def _check_state(composition: Composition, state: Mapping[str, Held]) -> None:
    """Raise RecordError unless the broad phase's state is laid out as it was."""
    now = composition.broad.state
    who = described("broad phase", composition.broad_phase)
    if tuple(now._fields) != tuple(state):
        raise RecordError(
            f"the state of {who} was saved with the fields {', '.join(state)}, and has the fields "
            f"{', '.join(now._fields)} now; {_anew(composition)}"
        )
    for name, array in zip(now._fields, now, strict=True):
        if not state[name].fits(np.asarray(array)):
            raise RecordError(
                f"the state of {who} was saved with {name} of shape {state[name].shape}, "
                f"{state[name].elements}, and prepare makes it of shape {array.shape}, {array.dtype} now; "
                f"{_anew(composition)}"
            )


def _refilled(tables: Tables, held: Mapping[str, Held], *, fresh: bool = False) -> Tables:
    """Return tables with what was held of them: in their old places where they are as long, unless all are to
    be ``fresh``."""
    found = []
    for name, table in zip(tables._fields, tables, strict=True):  # type: ignore[attr-defined]
        saved = held[name]
        if fresh or table.shape != saved.shape:
            if isinstance(table, np.recarray):
                table = record_table(np.dtype(table.dtype), saved.shape[0])
            else:
                table = np.zeros(saved.shape, table.dtype)
        fill(table, saved)
        found.append(table)
    return type(tables)(*found)


def _put_numbers(engine: Engine, snapshot: Snapshot) -> None:
    """Put back what is no table."""
    vars(engine).update(snapshot.numbers)
    engine.cpu_seconds, engine.compile_seconds = snapshot.seconds
    engine.clock.base = snapshot.base
    engine.skin = Skin(*snapshot.skin)
    engine.agenda = Agenda(snapshot.agenda)
    engine.overlapping = engine.overlapping[:0]
    engine._taken = None
    engine.ledger.entries = snapshot.entries
    engine.broken = None
    engine.commands = Commands(snapshot.commands)
    loop = engine.composition.loop(engine.commands)
    engine._ready = engine._ready and loop is engine.loop
    engine.loop = loop
