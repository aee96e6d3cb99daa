"""A snapshot: everything that a simulation is at one moment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from kinetile.errors import RecordError
from kinetile.kernel.faults import JAMMED
from kinetile.run.composition import Composition
from kinetile.run.engine import Command, Engine
from kinetile.run.engine.ledger import Entries
from kinetile.run.saving.held import Held, hold
from kinetile.scene import Scene

if TYPE_CHECKING:
    from kinetile.run.saving.saves import CanBeSaved

__all__ = ["Phases", "Snapshot", "plain", "take"]

EMPTIED = ("met", "log")
"""Tables in which nothing is left between two chunks of a run."""

ELSEWHERE = (
    *("scene", "composition", "state", "clock", "ledger", "agenda", "commands", "loop", "skin"),
    *("overlapping", "_k", "dial", "count", "_taken", "_long_log", "_no_log"),
)
"""What of an engine is no plain number, and is held in a form of its own or follows from the others."""

PASSING = ("busy", "broken", "_ready", "_budget", "cpu_seconds", "compile_seconds")
"""What of an engine is of this process or this hour. Its seconds go on; in nothing else does it matter."""


@dataclass(frozen=True)
class Phases:
    """The phases of a simulation by name, with their options."""

    broad_phase: str
    options: Mapping[str, Any]
    narrow_phases: Mapping[str, Mapping[str, Any]]

    @classmethod
    def of(cls, composition: Composition) -> Phases:
        """Return the names of a composition."""
        narrow = {name: dict(options) for name, options in composition.narrow_phases.items()}
        return cls(composition.broad_phase, dict(composition.options), narrow)


@dataclass(frozen=True, eq=False, repr=False)
class Snapshot:
    """A simulation at one moment, as ``Simulation.snapshot`` returns it: to come back to, to compare.

    Two snapshots are equal where they hold the same bits: the same scene under the same phases, the same
    plans, structure, queue and contacts. What time the processor took plays no part. What is in a snapshot is
    nobody's business, and may be another thing in the next version.
    """

    scene: Scene
    phases: Phases
    prepared: Scene  # for which the phases were prepared,
    at_start: bool  # and whether with the bodies of the start
    composition: Composition | None  # the very one, in this process,
    versions: Mapping[str, str] | None  # or, from elsewhere, of what versions it was
    tables: Mapping[str, Held]
    state: Mapping[str, Held]
    base: int
    skin: tuple[float, ...]
    commands: int
    agenda: tuple[Command, ...]
    given: tuple[bytes, tuple[tuple[int, int], ...]]
    entries: Entries
    numbers: Mapping[str, Any]
    seconds: tuple[float, float]
    more: Mapping[str, Any]  # what of the simulation itself is a number

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Snapshot):
            return NotImplemented
        return self._values() == other._values() and all(
            mine.keys() == theirs.keys() and all(held.same(theirs[name]) for name, held in mine.items())
            for mine, theirs in ((self.tables, other.tables), (self.state, other.state))
        )

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<Snapshot: {len(self.scene)} bodies at first, under {self.phases.broad_phase}>"

    def __reduce__(self) -> tuple[Any, ...]:
        from kinetile.run.saving.form import pack, unpack

        return unpack, (b"".join(pack(self)),)

    def _values(self) -> tuple[Any, ...]:
        entries = self.entries
        ledger = entries.rows, entries.digest.hexdigest(), [rows.tobytes() for rows in entries.unrecorded]
        stands = self.at_start or self.prepared, self.prepared.capacity
        mine = (self.scene, self.phases, stands, self.base, self.skin, self.commands, self.agenda, self.given)
        return *mine, ledger, dict(self.numbers), dict(self.more)


def take(simulation: CanBeSaved) -> Snapshot:
    """Return a snapshot of a simulation that stands between two chunks.

    Raises RecordError where it has ended with a fault, so that nothing can go on from it.
    """
    engine = simulation._engine
    if len(engine.overlapping):  # they begin to pass each other, with the structure
        engine.build()
    prepared = engine.composition.prepared
    if engine.broken is not None or engine.dial.fault[0] not in (0, JAMMED):
        raise RecordError(
            "this simulation has ended with a fault and cannot go on, so it is not saved: what was saved "
            "before it can be taken up"
        )
    return Snapshot(
        scene=simulation.scene,
        phases=Phases.of(engine.composition),
        prepared=prepared,
        at_start=prepared.position is engine.scene.position,
        composition=engine.composition,
        versions=None,
        tables=_held(engine.k, EMPTIED),
        state=_held(engine.state),
        base=engine.clock.base,
        skin=tuple(engine.skin),
        commands=int(engine.commands),
        agenda=engine.agenda.later,
        given=simulation._given.content,
        entries=engine.ledger.entries,
        numbers=plain(engine),
        seconds=(engine.cpu_seconds, engine.compile_seconds),
        more={"audit": simulation._audit, "start_energy": simulation._start_energy},
    )


def _held(tables: Any, emptied: tuple[str, ...] = ()) -> dict[str, Held]:
    named = zip(tables._fields, tables, strict=True)
    return {name: hold(np.asarray(table), empty=name in emptied) for name, table in named}


def plain(engine: Engine) -> dict[str, Any]:
    """Return the numbers of an engine by name: all that it has besides what is held in a form of its own."""
    found = {name: value for name, value in vars(engine).items() if name not in (*ELSEWHERE, *PASSING)}
    for name, value in found.items():
        if not isinstance(value, bool | int | float | None):
            raise TypeError(
                f"Engine.{name} is no plain number: kinetile.run.saving has to say how it is held"
            )
    return found
