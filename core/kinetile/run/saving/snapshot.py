"""A snapshot: the complete state of a simulation at one moment, and how an engine continues from it.

It holds the parts of the engine (``Engine.parts``) and the further state of the simulation. A restored
run continues with the same bits, structure included, under the same phases of the same version. Any
other broad phase takes over only plans, clock, commands and contacts so far, and builds its
structure at the present moment, as the engine itself does: that cannot change an
answer, only take time.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from importlib.metadata import version
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.errors import RecordError
from kinetile.kernel.compiled import python_of
from kinetile.kernel.compiled.fingerprint import fingerprint
from kinetile.kernel.log import CONTACT, LOG
from kinetile.kernel.loop.idle import NoState
from kinetile.kernel.skin import Skin
from kinetile.kernel.tables import JAMMED, allocate
from kinetile.plugin.calling import described
from kinetile.plugin.registry import registry
from kinetile.plugin.specs import Kind
from kinetile.run.compose import Composition, Rules
from kinetile.run.engine.agenda import Command
from kinetile.run.engine.bounds import Bounds
from kinetile.run.engine.engine import LOGS, Engine, Parts
from kinetile.run.engine.layout import as_bytes
from kinetile.run.engine.ledger import Entries
from kinetile.run.prepared import Prepared
from kinetile.run.saving.soundness import check_tables
from kinetile.scene import Scene


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

    Two snapshots are equal if they hold the same bits: the same scene under the same phases, the same
    plans, structure, queue and contacts. CPU times are not compared. The contents of a snapshot are private,
    and may change in the next version.
    """

    scene: Scene
    phases: SavedPhases
    prepared: Scene  # for which the phases were prepared,
    at_start: bool  # and whether with the bodies of the start
    versions: Mapping[str, str] | None  # its versions, if it comes from another process
    parts: Parts
    audit: int | None
    start_energy: float

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Snapshot):
            return NotImplemented
        return self._values() == other._values() and all(
            mine.keys() == theirs.keys() and all(_same_bits(mine[name], theirs[name]) for name in mine)
            for mine, theirs in (
                (self.parts.tables, other.parts.tables),
                (self.parts.state, other.parts.state),
            )
        )

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<Snapshot: {len(self.scene)} bodies at first, under {self.phases.broad_phase}>"

    def _values(self) -> tuple[Any, ...]:
        parts, entries = self.parts, self.parts.entries
        unrecorded = [rows.tobytes() for rows in entries.unrecorded]
        ledger = entries.rows, entries.digest.hexdigest(), unrecorded, entries.unstepped
        stands = self.at_start or self.prepared, self.prepared.capacity
        mine = (self.scene, self.phases, stands, self.parts.history.content, self.audit, self.start_energy)
        numbers = (parts.base, parts.bounds, parts.commands, parts.later, parts.numbers, parts.audits)
        return *mine, *numbers, parts.asked, parts.log_rows, parts.overlapping.tolist(), ledger


def take(engine: Engine, scene: Scene, audit: int | None, energy: float) -> Snapshot:
    """Returns a snapshot of an engine, between two chunks, and of the further state of its
    simulation.

    Raises RecordError if it has ended with a fault, so that no run can continue from it.
    """
    prepared = engine.composition.prepared
    if engine.broken is not None or engine.fields.fault.code[0] not in (0, JAMMED):
        raise RecordError(
            "this simulation has ended with a fault and cannot go on, so it is not saved: what was saved "
            "before it can be taken up"
        )
    return Snapshot(
        scene=scene,
        phases=SavedPhases.of(engine.composition),
        prepared=prepared,
        at_start=prepared.position is engine.scene.position,
        versions=None,
        parts=engine.parts(),
        audit=audit,
        start_energy=energy,
    )


def put_back(engine: Engine, scene: Scene, snapshot: Snapshot, anew: bool = False) -> None:
    """Makes an engine continue from a snapshot of its ``scene``: with the old structure, if it has the same
    phases and ``anew`` is not set.

    Raises RecordError for an unusable snapshot, Refused if the broad phase does not accept
    it: then the engine is unchanged.
    """
    if scene is not snapshot.scene and scene != snapshot.scene:
        raise RecordError(
            "this snapshot is of another scene: only a simulation of that one can go on from it"
        )
    mine, parts = SavedPhases.of(engine.composition), snapshot.parts
    if mine.narrow_phases != snapshot.phases.narrow_phases:
        raise RecordError(
            f"this snapshot is of a run with the narrow phases {', '.join(snapshot.phases.narrow_phases)}, "
            f"and this simulation has {', '.join(mine.narrow_phases)}, or other options of them: they make "
            "the contacts, so they have to be the same"
        )
    if {*parts.tables, *LOGS} != set(engine.k._fields):
        raise RecordError("this snapshot is of another version of kinetile, which has other tables")
    if parts.composition is None:  # it comes from another process
        try:
            check_tables(parts, engine.k, scene, snapshot.prepared)
        except (ValueError, LookupError, ArithmeticError, TypeError, AttributeError, MemoryError) as error:
            raise RecordError(f"no engine has the tables of this snapshot: {error}") from error
    if anew or mine != snapshot.phases:
        with engine.unchanged_if(BaseException):
            engine.adopt(parts, None)
            engine.renew()
    else:
        if parts.composition is None:
            odd = differences(snapshot.versions or {}, versions_of(engine.composition))
            if odd:
                raise RecordError(
                    f"what goes on here is not what was saved: {odd}; {_anew(engine.composition)}"
                )
        composition = _prepared(engine, snapshot)
        if composition is parts.composition:
            engine.adopt(parts, composition)
            return
        _check_state(composition, parts.state)
        with engine.unchanged_if(BaseException):
            engine.adopt(parts, composition)
            _judge_state(engine)


def _prepared(engine: Engine, snapshot: Snapshot) -> Composition:
    """Returns the phases, prepared for what those of the snapshot had been prepared for."""
    mine = engine.composition
    if mine is snapshot.parts.composition:
        return mine
    if not snapshot.at_start:
        return mine.prepared_for(snapshot.prepared)
    capacity = snapshot.prepared.capacity
    if mine.prepared.position is engine.scene.position and mine.prepared.capacity == capacity:
        return mine
    return mine.prepared_for(Prepared.of(engine.scene, capacity))


def _anew(composition: Composition) -> str:
    return (
        f"broad_phase={composition.broad_phase!r} (--broad-phase {composition.broad_phase}) goes on from it "
        "with a structure that is built anew, and has the same contacts"
    )


def _check_state(composition: Composition, state: Mapping[str, npt.NDArray[Any]]) -> None:
    """Raises RecordError unless the broad phase's state has its old layout."""
    now = composition.broad.state
    who = described("broad phase", composition.broad_phase)
    if tuple(now._fields) != tuple(state):
        raise RecordError(
            f"the state of {who} was saved with the fields {', '.join(state)}, and has the fields "
            f"{', '.join(now._fields)} now; {_anew(composition)}"
        )
    for name, array in zip(now._fields, map(np.asarray, now), strict=True):
        saved = state[name]
        if saved.shape != array.shape or elements(saved.dtype) != elements(array.dtype):
            raise RecordError(
                f"the state of {who} was saved with {name} of shape {saved.shape}, "
                f"{elements(saved.dtype)}, and prepare makes it of shape {array.shape}, {array.dtype} now; "
                f"{_anew(composition)}"
            )


def _judge_state(engine: Engine) -> None:
    """Raises RecordError for a state of the broad phase, from another process, that cannot be. One that has
    no audit is built anew: that may change structural events, and no contact."""
    composition = engine.composition
    audit, state = composition.broad.sound or composition.broad.audit, engine.state
    if not engine.fields.built[0]:
        engine.lay_out(engine.speed)  # it is only arranged so far
    elif audit is None and not isinstance(state, NoState):
        engine.renew()
    elif audit is not None:
        who = described("broad phase", composition.broad_phase)
        try:
            with np.errstate(all="ignore"):
                said = next(iter(audit(engine.k, state)), None)
        except Exception as error:  # a hostile state may make a foreign audit raise anything
            said = f"its audit raised {type(error).__name__}: {error}"
        if said is not None:
            raise RecordError(f"the state of {who} in this snapshot cannot be: {said}; {_anew(composition)}")


@cache
def elements(dtype: np.dtype[Any]) -> str:
    """Returns in words what an element is: names, kinds, order of bytes, places in the record."""
    return f"{dtype.descr} in {dtype.itemsize}"


def _same_bits(mine: npt.NDArray[Any], theirs: npt.NDArray[Any]) -> bool:
    """Whether two arrays hold the same bits: elements, shape, bytes."""
    alike = mine.shape == theirs.shape and elements(mine.dtype) == elements(theirs.dtype)
    return alike and bool(np.array_equal(as_bytes(mine), as_bytes(theirs)))


@cache
def layout() -> str:
    """Returns a digest of how all that is saved is laid out: the kernel's tables, field by field."""
    tables = allocate(1, 1, 1)
    said = [f"{name} {elements(table.dtype)}" for name, table in zip(tables._fields, tables, strict=True)]
    said += [elements(CONTACT), elements(LOG), *Command._fields, *Bounds._fields, *Skin._fields]
    said += [*(field.name for field in fields(Parts)), *Entries._fields]
    return hashlib.sha256("\n".join(said).encode()).hexdigest()


def versions_of(composition: Composition) -> dict[str, str]:
    """Returns the versions of kinetile and of the phases; a phase without one, added in this
    process, is identified by its code."""
    found = {"kinetile": version("kinetile")}
    found |= _version("broad phase", composition.broad_phase, composition.broad)
    parts = [composition.pair, composition.wall]
    for name in composition.narrow_phases:
        found |= _version("narrow phase", name, parts)
    for name in composition.rules.names if composition.rules is not None else ():
        found |= _version("response", name, composition.rules)
    return found


def differences(saved: Mapping[str, str], now: Mapping[str, str]) -> str:
    """Returns the changed versions, in words; "" if there are none."""
    names = [*saved, *(name for name in now if name not in saved)]
    odd = [name for name in names if saved.get(name) != now.get(name)]
    return "; ".join(
        f"{name} was {saved.get(name, 'not there')}, is {now.get(name, 'not there')}" for name in odd
    )


def _version(kind: Kind, name: str, parts: Any) -> dict[str, str]:
    provided = registry().provided(kind, name)
    if provided.distribution is not None and provided.version is not None:
        said = f"{provided.distribution} {provided.version}"
    else:
        said = f"of the code {_code(parts)}"
    return {f"{kind} {provided.spec.name}": said}


def _hooks_of(part: Any) -> list[Any]:
    """Returns the hooks of a part; of rules, those that respond."""
    return (
        [*part.hooks] if isinstance(part, Rules) else [hook for hook in vars(part).values() if callable(hook)]
    )


def _code(parts: Any) -> str:
    """Returns a digest of the hooks among the parts of a phase."""
    each = parts if isinstance(parts, list) else [parts]
    hooks = [hook for part in each if part is not None for hook in _hooks_of(part)]
    found = [fingerprint(python_of(hook), type(parts))[0] for hook in hooks]
    return hashlib.sha256("".join(found).encode()).hexdigest()[:16]
