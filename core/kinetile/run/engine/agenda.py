"""Commands of a run: the agenda of those to come, and the history of interactive ones.

Commands of the present span of the clock are in the kernel: the rows of ``k.commands`` from ``command`` to
``commands`` of ``k.clock[0].lists``. Those of later spans wait in the agenda, in ticks since the start, and
are moved to the kernel when their span begins.

An interactive command is the next one to run, so its row goes in front of the waiting ones: into rows of
commands that have already run, or into rows that are left free for it. The cost does not depend on the number
of waiting commands.

The history is kept as bytes, row after row. An hour of a game has some ten million commands: as objects they
would take four times the memory, and Python's collector would scan all of them now and then.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator
from itertools import chain, groupby
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.kernel.clock import SPAN, TICKS, Clock
from kinetile.kernel.log import INSERTED, REANCHORED, REMOVED, TURNED
from kinetile.kernel.plan import Plan
from kinetile.kernel.tables import COMMAND, Kernel, record_table
from kinetile.run.engine.fields import Fields
from kinetile.scene import Insert, Remove, Scene, Turn, with_commands
from kinetile.scene.shapes import Shape

Rows = npt.NDArray[np.void]
"""Commands in the kernel's form (``kinetile.kernel.tables.COMMAND``), in its ticks."""

ROWS = np.dtype((np.record, COMMAND))
"""Rows whose fields are attributes too, as hooks that are interpreted read them."""

_BYTES = np.dtype((np.void, COMMAND.itemsize))
"""A row as bytes: NumPy copies fields one by one."""

FRONT = 64
"""Initial number of free rows for interactive commands."""

LONGEST = 1 << 20
"""Bytes of commands above which no others are joined to them: a frame of a game waits for that copy."""

LAST = 64
"""The number of commands, or of sets of turns, that are joined to a history at once."""

Bases = tuple[tuple[int, int], ...]
"""For commands from a row on, the base of the clock for their ticks: (first row, base) each."""


class Command(NamedTuple):
    """One command, at ``ticks`` since the start, for the body of a number; ``code`` is its kind
    (``kinetile.kernel.log``). ``mass`` is that of the body, for any kind; ``after`` is the number of
    contacts of this tick that come before."""

    ticks: int
    body: int
    code: int
    x: float = 0.0
    y: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    radius: float = 0.0
    mass: float = 0.0
    after: int = 0
    kind: int = 0
    form: int = 0

    def squares(self, drop: float) -> float:
        """Mass times speed squared: twice the energy that it can add; 0 for immovable bodies. An inserted
        body can gain ``drop`` by falling."""
        more = drop if self.code == INSERTED else 0.0
        return self.mass * (self.vx * self.vx + self.vy * self.vy + more) if self.mass < math.inf else 0.0

    def as_scene_has_it(self, clock: Clock, scene: Scene) -> Turn | Insert | Remove:
        """Returns the command in a scene's form, with its exact time."""
        time, epoch, tick = clock.moment(self.ticks)
        at = (epoch, tick, self.after)
        if self.code == REMOVED:
            return Remove(self.body, time, at)
        if self.code == TURNED:
            return Turn(self.body, time, (self.vx, self.vy), at)
        place, flies = (self.x, self.y), (self.vx, self.vy)
        kind = scene.kinds[self.kind] if scene.kinds != (0,) else None
        shape = scene.shapes[self.form] if scene.shapes else None
        return Insert(time, place, flies, self.radius, self.mass, self.body, at, kind, shape)


def planned(scene: Scene, clock: Clock) -> list[Command]:
    """Returns the commands of a scene."""
    mass: dict[int, float] = dict(enumerate(scene.mass.tolist()))
    return [_command(each, clock, mass, scene) for each in scene.commands]


def _command(command: Turn | Insert | Remove, clock: Clock, mass: dict[int, float], scene: Scene) -> Command:
    ticks, after = _moment(command, clock)
    if isinstance(command, Remove):
        return Command(ticks, command.body, REMOVED, after=after)
    vx, vy = command.velocity
    if isinstance(command, Turn):
        return Command(ticks, command.body, TURNED, vx=vx, vy=vy, mass=mass[command.body], after=after)
    mass[command.body] = command.mass
    x, y = command.position
    kind = 0 if command.kind is None else scene.kinds.index(command.kind)
    form = number_of(command.shape, command.mass, scene) if isinstance(command.shape, Shape) else 0
    place, flight = (x, y, vx, vy), (command.radius, command.mass, after, kind)
    return Command(ticks, command.body, INSERTED, *place, *flight, form)


def number_of(shape: Shape, mass: float, scene: Scene) -> int:
    """Returns the number of a shape in the table of a scene, as bodies of this mass may have it; if there is
    none, the number of shapes."""
    for number, each in enumerate(scene.shapes):
        if each == shape and (mass == math.inf or number in scene.movable_shapes):
            return number
    return len(scene.shapes)


_FIELDS = (*Plan._fields, "radius", "mass", "after", "kind", "form")


def command_of(row: Any, base: int) -> Command:
    """Returns a row as a command; ``base`` is that of the clock whose ticks it has."""
    rest = {name: row[name].item() for name in _FIELDS}
    return Command(int(row["tick"]) + base * TICKS, int(row["body"]), int(row["code"]), **rest)


def _rows_of(commands: list[Command], clock: Clock) -> Rows:
    rows = np.zeros(len(commands), COMMAND)
    if commands:
        ticks, body, code, *fields = zip(*commands, strict=True)
        rows["tick"] = [clock.relative(tick) for tick in ticks]
        rows["body"], rows["code"] = body, code
        for name, column in zip(_FIELDS, fields, strict=True):
            rows[name] = column
    return rows


def squares_of(rows: Rows, drop: float) -> float:
    """Returns the sum of mass * speed^2 over commands: twice the energy that they can add, with ``drop`` for
    each insertion."""
    mass, vx, vy = rows["mass"], rows["vx"], rows["vy"]
    if math.inf in mass.tolist():  # immovable
        mass = np.where(np.isinf(mass), 0.0, mass)
    squares = vx * vx + vy * vy
    if drop:
        squares += drop * (rows["code"] == INSERTED)
    return float(np.dot(mass, squares))


class Agenda:
    """Commands in the order in which they run: by tick, re-anchorings first, then as given."""

    def __init__(self, commands: Iterable[Command]) -> None:
        self._later: list[Command] = []
        self.put(*commands)

    @property
    def later(self) -> tuple[Command, ...]:
        """The commands of later spans; those of the present one are in the kernel's tables."""
        return tuple(self._later)

    def put(self, *commands: Command) -> None:
        """Adds commands of later spans, or of one that is loaded now."""
        self._later.extend(commands)
        self._later.sort(key=lambda command: (command.ticks, command.code != REANCHORED))

    def load(self, k: Kernel, clock: Clock) -> Kernel:
        """Returns the tables with the commands before the next shift of the clock's base."""
        end = clock.base * TICKS + SPAN
        due = [command for command in self._later if command.ticks < end]
        del self._later[: len(due)]
        return _with_rows(k, np.concatenate([waiting(k), _rows_of(due, clock)]), FRONT)

    def cancel(self, k: Kernel, fields: Fields, body: int) -> None:
        """Forgets all commands for a removed body."""
        if self._later:
            self._later = [command for command in self._later if command.body != body]
        if fields.lists.command[0] < fields.lists.commands[0]:
            rows = waiting(k)
            stay = rows[rows["body"] != body]
            rows[len(rows) - len(stay) :] = stay
            fields.lists.command[0] += len(rows) - len(stay)

    def next(self, k: Kernel, clock: Clock) -> Command | None:
        """Returns the first command still to come, except re-anchorings."""
        return next(self._to_come(k, clock), None)

    def first_of_each(self, k: Kernel, clock: Clock) -> dict[int, int]:
        """Returns by occupied slots the kernel's tick of the first command for the body, if there is one."""
        first: dict[int, int] = {}
        for command in self._to_come(k, clock):
            slot = int(k.slots[command.body])
            if slot >= 0:
                first.setdefault(slot, clock.relative(command.ticks))
        return first

    def brings(self, k: Kernel, clock: Clock, body: int) -> bool:
        """Whether a body is still to be inserted by one of the commands."""
        return any(each.code == INSERTED and each.body == body for each in self._to_come(k, clock))

    def squares(self, k: Kernel, drop: float) -> float:
        """Returns the sum of mass * speed^2 over all commands: twice the energy that they can add."""
        later = math.fsum(each.squares(drop) for each in self._later)
        return later + squares_of(waiting(k), drop)

    def _to_come(self, k: Kernel, clock: Clock) -> Iterator[Command]:
        commands = chain((command_of(row, clock.base) for row in waiting(k)), self._later)
        return (command for command in commands if command.code != REANCHORED)


def waiting(k: Kernel) -> Rows:
    """Returns the rows of the kernel's commands that have not run yet, not a copy."""
    lists = k.clock[0].lists
    rows: Rows = k.commands.view(COMMAND, np.ndarray)[int(lists.command) : int(lists.commands)]
    return rows


def _with_rows(k: Kernel, rows: Rows, front: int) -> Kernel:
    """Returns the tables with other commands, and a number of free rows before them."""
    table = record_table(COMMAND, front + len(rows))
    table.view(COMMAND, np.ndarray)[front:] = rows
    k.clock[0].lists.command, k.clock[0].lists.commands = front, len(table)
    return k._replace(commands=table)


def to_the_front(k: Kernel, fields: Fields, rows: Rows) -> Kernel:
    """Puts commands of the present moment before all that wait; returns the tables."""
    many = len(rows)
    if many > fields.lists.command[0]:
        k = _with_rows(k, waiting(k), max(FRONT, 2 * many))
    command = fields.lists.command[0]
    np.frombuffer(k.commands, _BYTES)[command - many : command] = np.frombuffer(rows, _BYTES)
    fields.lists.command[0] = command - many
    return k


class History:
    """Commands in the order in which they were given, all of them already run.

    It never changes, so a snapshot shares it. The last commands wait until it is read, or they are
    ``LAST``; blocks of rows of about one size are joined: so there are few, and a command costs much the same
    however many came before it.
    """

    def __init__(
        self, rows: tuple[bytes, ...] = (), inserted: tuple[bytes, ...] = (), bases: Bases = ()
    ) -> None:
        self._rows = rows
        self._inserted = inserted  # bodies and kinds of insertions, so that kinds are read at once
        self._bases = bases
        self._last: tuple[tuple[int, bytes], ...] = ()  # each with the base of its ticks

    @property
    def content(self) -> tuple[bytes, Bases]:
        """All commands, as bytes, and the bases of their ticks."""
        self._take_in_last()
        return b"".join(self._rows), self._bases

    @classmethod
    def of(cls, rows: bytes, bases: Bases) -> History:
        """Returns the history with this content."""
        return cls((rows,), (_inserted(np.frombuffer(rows, COMMAND)),), bases)

    def with_rows(self, rows: Rows, base: int) -> History:
        """Returns these commands and others after them; ``base`` is that of the clock of their ticks."""
        history = History(self._rows, self._inserted, self._bases)
        history._last = (*self._last, (base, rows.tobytes()))
        if len(history._last) >= LAST:
            history._take_in_last()
        return history

    def _take_in_last(self) -> None:
        for base, several in groupby(self._last, itemgetter(0)):
            rows = b"".join(each for _, each in several)
            if not self._bases or self._bases[-1][1] != base:
                first = sum(map(len, self._rows)) // COMMAND.itemsize
                self._bases = (*self._bases, (first, base))
            came = _inserted(np.frombuffer(rows, COMMAND))
            self._inserted = _joined(self._inserted, came) if came else self._inserted
            self._rows = _joined(self._rows, rows)
        self._last = ()

    @property
    def inserted(self) -> npt.NDArray[np.int64]:
        """The inserted bodies, each with the number of its kind, (m, 2)."""
        self._take_in_last()
        return np.frombuffer(b"".join(self._inserted), np.int64).reshape(-1, 2)

    def in_scene(self, scene: Scene, clock: Clock) -> Scene:
        """Returns a scene with these commands, at their exact times, and without its own commands for bodies
        that had been removed by then.

        A planned command comes before those by hand of its tick, unless it waited then for an insertion
        without room: such commands are given the number of contacts of what overtook them.
        """
        played: list[Turn | Insert | Remove] = []
        planned, gone = deque(scene.commands), set()
        for command, overtaken in self._commands():
            due = []
            while planned and _moment(planned[0], clock) <= (command.ticks, command.after):
                due.append(planned.popleft())
            due = [each for each in due if each.body not in gone]
            by_hand = command.as_scene_has_it(clock, scene)
            first = len(due) - overtaken
            planned.extendleft(each._replace(at=by_hand.at) for each in reversed(due[first:]))
            played += [*due[:first], by_hand]
            if command.code == REMOVED:
                gone.add(command.body)
        played += (each for each in planned if each.body not in gone)
        return with_commands(scene, played, kinds=scene.kinds)

    def _commands(self) -> Iterator[tuple[Command, int]]:
        """Yields the commands, each with the number of planned ones that it overtook."""
        content, bases = self.content
        rows = np.frombuffer(content, COMMAND)
        for at, (first, base) in enumerate(bases):
            end = bases[at + 1][0] if at + 1 < len(bases) else len(rows)
            yield from ((command_of(row, base), int(row["overtakes"])) for row in rows[first:end])


def _joined(blocks: tuple[bytes, ...], new: bytes) -> tuple[bytes, ...]:
    """Returns blocks with a new one, joined with those before it that are no longer than it."""
    kept = list(blocks)
    while kept and len(kept[-1]) <= len(new) <= LONGEST:
        new = kept.pop() + new
    return (*kept, new)


def _inserted(rows: Rows) -> bytes:
    """Returns the bodies and kinds of the insertions among commands."""
    came = rows[rows["code"] == INSERTED]
    return np.column_stack([came["body"], came["kind"]]).astype(np.int64).tobytes() if len(came) else b""


def _moment(command: Turn | Insert | Remove, clock: Clock) -> tuple[int, int]:
    """Returns when a command of a scene happens: its tick since the start, and after how many contacts."""
    return clock.tick_of(command.time, command.at), command.at[2] if command.at else 0
