"""Fast access to fields of the clock and the counts between two chunks, and the occupied slots.
``k.clock[0].now`` makes two objects of NumPy, for two microseconds, some hundred times between two frames of
a game; a view of a field's eight bytes, made once, costs a twentieth."""

from collections.abc import Iterable, Iterator
from types import SimpleNamespace
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from kinetile.arrays import Integers
from kinetile.kernel.compiled import Packed, bound
from kinetile.kernel.tables import Kernel, Quantity, Records, column, declared, slots_taken

Fields: TypeAlias = Any
"""``fields_of(table).name[0]`` is the field ``name`` of the only record of a table, for reading and writing;
``fields_of(table).record.name[0]`` is a field of a record within it."""


def fields_of(table: Records) -> Fields:
    """Returns the fields of the only record of a table, each as a view of one plain number."""
    plain = table.view(np.ndarray)
    views = ((name, plain[name]) for name in plain.dtype.names)
    found = {name: fields_of(view) if view.dtype.names else memoryview(view) for name, view in views}
    return SimpleNamespace(**found)


def ticks_of(tables: Iterable[Any], *quantities: Quantity) -> Iterator[Integers]:
    """Yields the columns of tables with ticks of these quantities."""
    for table in tables:
        for field in declared(table.dtype, *quantities) if len(table) else ():
            yield column(table, field.name)


def all_ticks(k: Kernel, of_phase: Iterable[Any]) -> list[Integers]:
    """Returns the columns of all ticks of the tables, and those ``of_phase``."""
    return [*ticks_of(k, Quantity.TICK, Quantity.PAST, Quantity.DUE), *of_phase]


class _Taken(NamedTuple):
    """The occupied slots, with the numbers of their bodies, after so many insertions and removals."""

    changes: tuple[int, int]
    slots: npt.NDArray[np.intp]
    numbers: npt.NDArray[np.int32]


class Tables:
    """The kernel's tables, and values of them: ``fields`` of the clock, and ``count`` of the counts."""

    fields: Fields
    count: Fields
    _k: Kernel
    _taken: _Taken | None
    _state: Any = None
    _loop: Any = None
    _packed: Any = None
    _enter: Any = None
    as_python: bool = False  # the loop runs as Python
    _search: Any = None
    _ticks: list[Integers] | None = None  # their columns of ticks, and the phase's
    _command_bytes: memoryview | None = None

    @property
    def k(self) -> Kernel:
        """The tables; replaced when they grow."""
        return self._k

    @k.setter
    def k(self, tables: Kernel) -> None:
        if hasattr(self, "_k") and tables is self._k:
            return
        self._packed = self._enter = self._search = self._command_bytes = self._ticks = None
        if not hasattr(self, "_k") or tables.clock is not self._k.clock:
            self.fields, self.count, self._taken = fields_of(tables.clock), fields_of(tables.counts), None
        self._k = tables

    @property
    def state(self) -> Any:
        """The broad phase's state."""
        return self._state

    @state.setter
    def state(self, state: Any) -> None:
        self._state, self._packed, self._enter, self._search = state, None, None, None

    @property
    def loop(self) -> Any:
        """The composed loop."""
        return self._loop

    @loop.setter
    def loop(self, loop: Any) -> None:
        self._loop, self._enter = loop, None

    @property
    def packed(self) -> Any:
        """The tables, and the broad phase's state, as composed functions take them."""
        if self._packed is None:
            self._packed = Packed(self._k), Packed(self.state)
        return self._packed

    @property
    def enter(self) -> Any:
        """The loop for the tables: a function of its four numbers."""
        if self._enter is None:
            self._enter = bound(self.loop, *self.packed, given=range(4), compiled=not self.as_python)
        return self._enter

    @property
    def command_bytes(self) -> memoryview:
        """The bytes of the table of commands."""
        if self._command_bytes is None:
            self._command_bytes = memoryview(self._k.commands.view(np.ndarray).view(np.uint8))
        return self._command_bytes

    @property
    def taken(self) -> npt.NDArray[np.intp]:
        """The occupied slots, in the order of the bodies' numbers, read-only."""
        changes, known = (self.count.inserted[0], self.count.removed[0]), self._taken
        if known is None or known.changes != changes:
            number = self._k.queue.view(np.ndarray)["number"]
            slots = None if known is None or not len(known.slots) else self._with_newcomers(known, number)
            if slots is None or len(slots) != self.fields.present[0]:
                slots = slots_taken(self._k)
            slots.flags.writeable = False
            self._taken = known = _Taken(changes, slots, number[slots])
        return known.slots

    def _with_newcomers(self, known: _Taken, number: npt.NDArray[np.int32]) -> npt.NDArray[np.intp]:
        """Returns the slots still taken by the same bodies, and the slots of higher numbers: all, unless a
        planned body has been inserted, whose number is lower."""
        came = self._k.slots[known.numbers[-1] + 1 :]
        return np.concatenate([known.slots[number[known.slots] == known.numbers], came[came >= 0]])

    def forget_taken(self) -> None:
        """Forgets the occupied slots: they are found again."""
        self._taken = None

    @property
    def now(self) -> int:
        """The present tick, counted from the clock's base."""
        return int(self.fields.now[0])

    @property
    def met_now(self) -> int:
        """The number of contacts that have happened at the present tick."""
        return int(self.fields.met_there[0]) if self.fields.met_tick[0] == self.fields.now[0] else 0

    @property
    def due(self) -> int:
        """The number of commands that run before the next contact (``may_come`` is for the next alone)."""
        place = first = self.fields.lists.command[0]
        end = self.fields.lists.commands[0]
        if first < end:
            rows, moment = self._k.commands.view(np.ndarray), (self.now, self.met_now)
            while place < end and (rows["tick"][place], rows["after"][place]) <= moment:
                place += 1
        return int(place - first)

    @property
    def contacts(self) -> int:
        """Contacts of both kinds so far."""
        return int(self.count.contacts_disc[0] + self.count.contacts_wall[0])

    @property
    def events(self) -> int:
        """Events of all kinds so far."""
        count = self.count
        commands = count.turns[0] + count.inserted[0] + count.removed[0]
        return int(self.contacts + commands + count.structural[0])
