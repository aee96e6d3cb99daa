"""Canaries: a compiled run in which each array lies between two zones that nothing may write to.

An array is copied into the middle of a larger buffer. To compiled code it is the same kind of array at
another place, so no other loop is compiled. A hook that writes just before or behind an array would otherwise
change whatever lies there; here it changes a zone, and afterwards the zones are checked.

Watched are the arrays of the state, and of the kernel's tables those that the engine has when it starts. Left
as they are: arrays that share memory with another one of the state, that are not contiguous, or that are
read-only; and the tables that the engine replaces while it runs (the turns, the log, and the pair set once it
has grown).
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.errors import KinetileError
from kinetile.kernel.log import INSERTED, REMOVED
from kinetile.run.advance import End, advance
from kinetile.run.arguments import read_insertion, read_removal
from kinetile.run.compose import Commands
from kinetile.run.engine.engine import Engine
from kinetile.run.prepared import Prepared
from kinetile.scene import Scene
from kinetile.toolbox import positions_now
from kinetile_conformance.cases import Subject, horizon


def exchange(engine: Engine, body: int, velocity: tuple[float, float]) -> None:
    """Remove a body, and insert another of its size in its place, in the middle of a watched run.

    So ``leave`` and ``enter`` are watched too, and a phase that has neither is rebuilt. Does nothing where
    the body has gone already; where the phase refuses the new body, it stays out.
    """
    if not 0 <= body < engine.numbers or engine.k.slots[body] < 0:
        return
    slot = engine.k.slots[body : body + 1]
    x, y = positions_now(engine.k, slot)[0].tolist()
    radius, mass = float(engine.k.bodies["radius"][slot[0]]), float(engine.k.mass[slot[0]])
    shape = int(engine.k.bodies["form"][slot[0]]) if engine.scene.shapes else None
    engine.carry_out(REMOVED, read_removal(engine, body))
    with contextlib.suppress(KinetileError, ValueError):
        rows, new = read_insertion(engine, (x, y), velocity, radius, mass, None, shape)
        engine.carry_out(INSERTED, rows, new)


ZONE = 1024
"""Bytes before an array and behind it that nothing may write to; more than one row of most arrays."""

CONTACTS = 300
SONG = 0xA5
LINE = 64
"""Bytes of a cache line: an array begins where in a line it began."""

Bytes = npt.NDArray[np.uint8]


def address(array: Any) -> int:
    """Return where an array begins, also where it has no elements."""
    return int(array.__array_interface__["data"][0])


class Cage(NamedTuple):
    """An array between two zones."""

    name: str
    array: Any
    original: Any
    before: Bytes
    behind: Bytes

    @classmethod
    def of(cls, name: str, array: Any) -> Cage:
        """Copy an array that lies in one piece into a cage."""
        zone = max(ZONE, 2 * array.itemsize, 2 * array.strides[0] if array.ndim else 0)
        zone += -zone % LINE
        memory = np.full(2 * zone + array.nbytes + LINE, SONG, dtype=np.uint8)
        first = zone + (address(array) - address(memory)) % LINE
        inside = memory[first : first + array.nbytes]
        inside[:] = np.frombuffer(array.tobytes(order="A"), dtype=np.uint8)
        order: Literal["C", "F"] = "C" if array.flags.c_contiguous else "F"
        made = np.ndarray(array.shape, array.dtype, memory.data, first, order=order).view(type(array))
        return cls(name, made, array, memory[first - zone : first], memory[first + array.nbytes :][:zone])

    def breach(self) -> str | None:
        """Return how far outside of the array something was written; None where nothing was."""
        for zone, side in ((self.before[::-1], "before its first"), (self.behind, "behind its last")):
            at = np.flatnonzero(zone != SONG)
            if len(at):
                row = max(self.array.strides[0] if self.array.ndim else 1, 1)
                rows = int(at[0]) // row + 1
                return f"{self.name} was written to {rows} {'row' if rows == 1 else 'rows'} {side}"
        return None


def caged(tables: NamedTuple, called: str) -> tuple[Any, list[Cage]]:
    """Return a named tuple with its arrays in cages, as far as they can be, and the cages."""
    cages = [
        Cage.of(f"{called}.{name}", array)
        for name, array in zip(type(tables)._fields, tables, strict=True)
        if (array.flags.c_contiguous or array.flags.f_contiguous)
        and array.flags.writeable
        and not any(other is not array and np.may_share_memory(array, other) for other in tables)
        and sum(other is array for other in tables) == 1
    ]
    of = {id(cage.original): cage.array for cage in cages}
    return type(tables)(*(of.get(id(array), array) for array in tables)), cages


def _moved(ticks: Any, cages: Sequence[Cage]) -> Any:
    """Return an array of ticks where it is now: it may be a view of one that has been copied into a cage."""
    for cage in cages:
        offset = address(ticks) - address(cage.original)
        if np.may_share_memory(ticks, cage.original) and offset >= 0:
            memory = cage.array.reshape(-1, order="A").view(np.ndarray).view(np.uint8)
            return np.ndarray(ticks.shape, ticks.dtype, memory, offset, ticks.strides)
    return ticks


def look_for_writes(subject: Subject, scene: Scene) -> str | None:
    """Run a phase on a scene with its arrays and the kernel's in cages; return what was written outside of
    one, None where nothing was.

    Raises Refused where the phase cannot do the scene.
    """
    room = Prepared.of(scene)
    composition = subject.composition(room)
    broad = composition.broad
    state, cages = caged(broad.state, "s")
    ticks = tuple(_moved(each, cages) for each in broad.ticks)
    composition = replace(composition, broad=replace(broad, state=state, ticks=ticks))
    engine = Engine(room, composition, keep_contacts=False, commands=Commands.ALL)
    engine.k, more = caged(engine.k, "k")
    try:
        until = horizon(scene)
        advance(engine, End(until, engine.clock.ticks(until), CONTACTS), None, lambda: None)
        for body in range(0, len(scene), 5):
            exchange(engine, body, (0.5 * engine.speed, 0.25 * engine.speed))
        advance(engine, End(until + 1.0, engine.clock.ticks(until + 1.0), 2 * CONTACTS), None, lambda: None)
        engine.lay_out(engine.speed)
        engine.build()
    except KinetileError:
        pass  # whether a run may end so is what other checks compare
    return next((said for cage in [*cages, *more] if (said := cage.breach()) is not None), None)
