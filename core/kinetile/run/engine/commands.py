"""Commands of a run: the agenda of commands to come, and the history of interactive ones.

Commands of the present span of the clock are the rows of ``k.commands`` from ``command`` to ``commands`` of
``k.clock[0].lists``; commands of later spans wait in the agenda, in ticks since the start. An interactive
command runs next: its row is written into the free rows before the waiting ones, so its cost does not depend
on their number. The history is kept as bytes: as objects, the ten million commands of an hour of a game would
take four times the memory, and Python's collector would scan them.
"""

import math
from bisect import bisect_left, bisect_right, insort
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain, compress, groupby
from operator import itemgetter
from struct import Struct
from typing import Any, NamedTuple

import numpy as np

from kinetile.arrays import Array, Rows
from kinetile.kernel.clock import SPAN, TICKS, Clock
from kinetile.kernel.log import INSERTED, OF_KIND, REANCHORED, REMOVED
from kinetile.kernel.tables import COMMAND, Kernel, record_table
from kinetile.run.engine.fields import Fields, Tables
from kinetile.scene import Command as SceneCommand
from kinetile.scene import Insert, Scene, SetKind
from kinetile.scene.commands import OF_CLASS, OF_CODE, Does, doing, end_of
from kinetile.scene.reader import pull_of
from kinetile.scene.shapes import Shape

_NAMES: tuple[str, ...] = COMMAND.names or ()

COMMAND_ROWS = np.dtype((np.record, COMMAND))
"""Rows whose fields are attributes too, as hooks read them in Python."""

PACKED = Struct("=" + "".join({"i4": "i", "i8": "q", "f8": "d"}[COMMAND[name].str[1:]] for name in _NAMES))
"""A row as bytes: packed, and copied, in one step; NumPy takes one step for each field."""

_LEADING = ("tick", "x", "y", "vx", "vy", "radius", "mass", "body", "code", "after")
assert _NAMES[: len(_LEADING)] == _LEADING
_ZEROS = (0,) * (len(_NAMES) - len(_LEADING))

_FALLING = [each.code for each in doing(Does.FALLS)]

STILL = (0.0,) * 6
"""Place, velocity, radius and mass of a command without them."""

FRONT = 64
"""Initial number of free rows for interactive commands."""

LONGEST = 1 << 20
"""Bytes of a block above which no commands are joined to it: a frame of a game waits for that copy."""

LAST = 64
"""The number of commands, or of sets of turns, that are joined to a history at once."""

Bases = tuple[tuple[int, int], ...]
"""For commands from a row on, the base of the clock for their ticks: (first row, base) each."""


class Command(NamedTuple):
    """One command, at ``ticks`` since the start; the tick in its row is not used."""

    ticks: int
    row: Any

    @property
    def body(self) -> int:
        """The number of its body."""
        return int(self.row["body"])

    @property
    def moment(self) -> tuple[int, int]:
        """Its tick since the start, and the number of contacts of this tick before it."""
        return self.ticks, int(self.row["after"])

    @property
    def code(self) -> int:
        """Its kind (``kinetile.kernel.log``)."""
        return int(self.row["code"])

    def as_scene_has_it(self, clock: Clock, scene: Scene) -> SceneCommand:
        """Returns the command in a scene's form, with its exact time."""
        kind, row = OF_CODE[self.code].made, self.row
        time, epoch, tick = clock.moment(self.ticks)
        given: dict[str, Any] = {"time": time, "at": (epoch, tick, self.moment[1])}
        for name in (each for each in kind._fields if each != "name" and each not in given):
            found = tuple(row[column].item() for column in _COLUMNS.get(name, (name,)))
            given[name] = found if len(found) > 1 else found[0]
        if kind is SetKind:
            given["kind"] = scene.kinds[given["kind"]]
        if kind is Insert:
            given["kind"] = scene.kinds[given["kind"]] if scene.kinds != (0,) else None
            given["shape"] = scene.shapes[given["shape"]] if scene.shapes else None
            given["acceleration"] = given["acceleration"] if scene.accelerated else None
            given["lifetime"] = given["lifetime"] or None
        made: SceneCommand = kind(**given)
        return made


_COLUMNS = {
    "position": ("x", "y"),
    "velocity": ("vx", "vy"),
    "acceleration": ("ax", "ay"),
    "shape": ("form",),
}
"""The columns of a row for a field of a command; other fields have one column of their own name."""


class Planned(NamedTuple):
    """Commands as they run, with their ticks since the start; the ticks in the rows are not used."""

    ticks: tuple[int, ...]
    rows: Rows


def planned(scene: Scene, clock: Clock) -> Planned:
    """Returns the commands of a scene."""
    mass: dict[int, float] = dict(enumerate(scene.mass.tolist()))
    rows = []
    for each in scene.commands:
        if isinstance(each, Insert):
            mass[each.body] = each.mass
        adds = Does.FASTER in OF_CLASS[type(each)].does and not isinstance(each, Insert)
        values = {"mass": mass[each.body]} if adds else {}
        rows.append(row_of(each, scene, after=each.at[2] if each.at else 0, **values))
    ticks = (clock.tick_of(each.time, each.at) for each in scene.commands)
    return Planned(tuple(ticks), np.array(rows, COMMAND))


def row_of(command: SceneCommand, scene: Scene, **values: Any) -> tuple[Any, ...]:
    """Returns the values of a command's row, with other ``values`` of its columns."""
    given = command._asdict()
    for apart in ("time", "at", "name"):
        given.pop(apart, None)
    if isinstance(command, Insert | SetKind):
        given["kind"] = 0 if command.kind is None else scene.kinds.index(command.kind)
    if isinstance(command, Insert):
        shape = command.shape
        given["acceleration"] = pull_of(command, scene.gravity)
        given["lifetime"] = command.lifetime or 0.0
        given["shape"] = number_of(shape, command.mass, scene) if isinstance(shape, Shape) else 0
    values["code"] = OF_CLASS[type(command)].code
    for name, value in given.items():
        columns = _COLUMNS.get(name, (name,))
        values |= zip(columns, value if len(columns) > 1 else (value,), strict=True)
    row = tuple(values.pop(name, 0) for name in _NAMES)
    assert not values, f"a row of a command has no {', '.join(values)}"
    return row


def packed(tick: int, disc: Sequence[float], body: int, code: int, after: int) -> bytes:
    """Returns the row of a command, of a disc as in ``STILL``."""
    return PACKED.pack(tick, *disc, body, code, after, *_ZEROS)


def number_of(shape: Shape, mass: float, scene: Scene) -> int:
    """Returns a shape's number in a scene's table, for bodies of this mass; without one, its length."""
    for number, each in enumerate(scene.shapes):
        if each == shape and (mass == math.inf or number in scene.movable_shapes):
            return number
    return len(scene.shapes)


def squares_of(rows: Rows, drop: float) -> float:
    """Returns the sum of mass * speed^2 over commands: twice the energy that they can add, with ``drop`` for
    each insertion, acceleration and move, which it can gain by falling; 0 for immovable bodies."""
    if len(rows) == 1 and not drop:  # without NumPy's overhead for one number
        mass, vx, vy = (float(rows[name].item()) for name in ("mass", "vx", "vy"))
        return 0.0 if mass == math.inf else mass * (vx * vx + vy * vy)
    return float(np.dot(*_masses_and_squares(rows, drop)))


def _masses_and_squares(rows: Rows, drop: float) -> tuple[Array, Array]:
    mass, vx, vy = rows["mass"], rows["vx"], rows["vy"]
    if math.inf in mass.tolist():  # immovable
        mass = np.where(np.isinf(mass), 0.0, mass)
    squares = vx * vx + vy * vy
    if drop:
        squares += drop * np.isin(rows["code"], _FALLING)
    return mass, squares


class Agenda:
    """Commands as they run: by tick, re-anchorings first, then as given; ``later`` has later spans."""

    def __init__(self, later: Planned) -> None:
        self.later = later

    def load(self, k: Kernel, clock: Clock) -> Kernel:
        """Returns the tables with the commands before the next shift of the clock's base."""
        ticks, rows = self.later
        due = bisect_left(ticks, clock.base * TICKS + SPAN)
        if not due and len(k.commands):
            return k
        self.later = Planned(ticks[due:], rows[due:])
        coming = rows[:due].copy()
        coming["tick"] = [clock.relative(each) for each in ticks[:due]]
        return _with_rows(k, np.concatenate([waiting(k), coming]), FRONT)

    def plan_removal(self, tables: Tables, clock: Clock, body: int, ticks: int) -> None:
        """Adds the removal of a body, after the commands of that moment."""
        new, (later, rows) = np.zeros(1, COMMAND), self.later
        new["body"], new["code"] = body, REMOVED
        if ticks >= clock.base * TICKS + SPAN:
            at = _behind(later, rows["after"], ticks)
            self.later = Planned(
                (*later[:at], ticks, *later[at:]), np.concatenate([rows[:at], new, rows[at:]])
            )
            return
        new["tick"] = clock.relative(ticks)
        lists = tables.fields.lists
        if lists.command[0] == 0:
            tables.k = _with_rows(tables.k, waiting(tables.k), FRONT)
        lists.command[0] -= 1
        front = waiting(tables.k)
        at = _behind(front["tick"][1:], front["after"][1:], int(new["tick"][0]))
        front[:at] = front[1 : at + 1]
        front[at] = new[0]

    def cancel(self, k: Kernel, fields: Fields, body: int) -> None:
        """Forgets all commands for a removed body."""
        ticks, rows = self.later
        if ticks:
            others = rows["body"] != body
            self.later = Planned(tuple(compress(ticks, others.tolist())), rows[others])
        if fields.lists.command[0] < fields.lists.commands[0]:
            rows = waiting(k)
            stay = rows[rows["body"] != body]
            rows[len(rows) - len(stay) :] = stay
            fields.lists.command[0] += len(rows) - len(stay)

    def next(self, k: Kernel, clock: Clock) -> Command | None:
        """Returns the first command still to come, except re-anchorings."""
        return next(self._to_come(k, clock), None)

    def first_of_each(self, k: Kernel, clock: Clock) -> dict[int, int]:
        """Returns, by slots, the kernel's tick of the first command for each present body that has one."""
        first: dict[int, int] = {}
        for command in self._to_come(k, clock):
            slot = int(k.slots[command.body])
            if slot >= 0:
                first.setdefault(slot, clock.relative(command.ticks))
        return first

    def brings(self, k: Kernel, clock: Clock, body: int) -> bool:
        """Returns True if one of the commands is still to insert a body."""
        return any(each.code == INSERTED and each.body == body for each in self._to_come(k, clock))

    def squares(self, k: Kernel, drop: float) -> float:
        """Returns the sum of mass * speed^2 over all commands: twice the energy that they can add."""
        later = math.fsum(np.multiply(*_masses_and_squares(self.later.rows, drop)).tolist())
        return later + squares_of(waiting(k), drop)

    def _to_come(self, k: Kernel, clock: Clock) -> Iterator[Command]:
        commands = chain((command_of(row, clock.base) for row in waiting(k)), map(Command, *self.later))
        return (command for command in commands if command.code != REANCHORED)


def _behind(ticks: Sequence[int] | Array, after: Array, tick: int) -> int:
    """Returns the place behind the commands before the first contact of a tick, in their order."""
    return bisect_right(range(len(ticks)), (tick, 0), key=lambda at: (ticks[at], after[at]))


def command_of(row: Any, base: int) -> Command:
    """Returns a row as a command; ``base`` is the clock's base for the row's tick."""
    return Command(int(row["tick"]) + base * TICKS, row)


def waiting(k: Kernel) -> Rows:
    """Returns the rows of the kernel's commands that have not run yet, not a copy."""
    lists = k.clock[0].lists
    rows: Rows = k.commands.view(COMMAND, np.ndarray)[int(lists.command) : int(lists.commands)]
    return rows


def _with_rows(k: Kernel, rows: Rows, front: int) -> Kernel:
    table = record_table(COMMAND, front + len(rows))
    table.view(COMMAND, np.ndarray)[front:] = rows
    k.clock[0].lists.command, k.clock[0].lists.commands = front, len(table)
    return k._replace(commands=table)


def anchor_again(tables: Tables, bodies: Array) -> None:
    """Adds re-anchorings of bodies, at the first tick of a span whose commands are loaded."""
    rows = np.zeros(len(bodies), COMMAND_ROWS)
    rows["body"], rows["code"] = bodies, REANCHORED
    to_the_front(tables, rows)


def to_the_front(tables: Tables, rows: Rows) -> None:
    """Puts commands of the present moment before all waiting ones."""
    many, lists = len(rows), tables.fields.lists
    if many > lists.command[0]:
        tables.k = _with_rows(tables.k, waiting(tables.k), max(FRONT, 2 * many))
    command = lists.command[0]
    tables.command_bytes[(command - many) * PACKED.size : command * PACKED.size] = rows.tobytes()
    lists.command[0] = command - many


class KindHistory(NamedTuple):
    """The kinds that commands give, as numbers: (kind, count) for each run of inserted bodies, in their
    order; and, by the body's number, the last kind that a command gave it."""

    inserted: tuple[tuple[int, int], ...] = ()
    changed: Mapping[int, int] = {}

    def with_rows(self, rows: Rows) -> "KindHistory":
        """Returns this history with the kinds of later commands."""
        new = ((kind, 1) for kind in rows["kind"][rows["code"] == INSERTED].tolist())
        runs = groupby([*self.inserted[-1:], *new], itemgetter(0))
        inserted = tuple((kind, sum(many for _, many in run)) for kind, run in runs)
        change = rows[rows["code"] == OF_KIND]
        changed = dict(zip(change["body"].tolist(), change["kind"].tolist(), strict=True))
        return KindHistory(self.inserted[:-1] + inserted, {**self.changed, **changed})


class History:
    """Commands that have run, in the given order; unless they are ``kept``, only their kinds. It never
    changes, so a snapshot shares it. The last ``LAST`` commands are joined when it is read; blocks of about
    one size are joined."""

    def __init__(
        self,
        rows: tuple[bytes, ...] = (),
        bases: Bases = (),
        told: KindHistory | None = None,
        kept: bool = True,
    ) -> None:
        self.names: Mapping[str, int] = {}  # of inserted bodies with a name
        self.kept = kept
        self._rows = rows
        self._told = told or KindHistory()
        self._bases = bases
        self._last: tuple[tuple[int, bytes], ...] = ()  # each with the base of its ticks

    @property
    def content(self) -> tuple[bytes, Bases]:
        """All commands that are kept, as bytes, and the bases of their ticks."""
        self._take_in_last()
        return b"".join(self._rows), self._bases

    @property
    def told(self) -> KindHistory:
        """The kinds that all commands have given."""
        self._take_in_last()
        return self._told

    def with_rows(self, rows: Rows, base: int) -> "History":
        """Returns these commands and others after them; ``base`` is the clock's base for their ticks."""
        history = History(self._rows, self._bases, self._told, self.kept)
        history._last, history.names = (*self._last, (base, rows.tobytes())), self.names
        if len(history._last) >= LAST:
            history._take_in_last()
        return history

    def _take_in_last(self) -> None:
        for base, several in groupby(self._last, itemgetter(0)):
            rows = b"".join(each for _, each in several)
            self._told = self._told.with_rows(np.frombuffer(rows, COMMAND))
            if self.kept:
                if not self._bases or self._bases[-1][1] != base:
                    self._bases = (*self._bases, (sum(map(len, self._rows)) // COMMAND.itemsize, base))
                self._rows = _joined(self._rows, rows)
        self._last = ()

    def played(self, scene: Scene, clock: Clock) -> list[SceneCommand]:
        """Returns these commands with a scene's, at their exact times, except the scene's commands for bodies
        that had been removed before.

        A planned command precedes the commands by hand of its tick, unless it waited then for an insertion
        without room: such a command gets the contact number of the command that overtook it.
        """
        played, names = list[SceneCommand](), {body: name for name, body in self.names.items()}
        planned, gone = deque(scene.commands), set()
        for command, overtaken in self._commands():
            due = []
            while planned and _moment(planned[0], clock) <= command.moment:
                due.append(planned.popleft())
            due = [each for each in due if each.body not in gone]
            by_hand = command.as_scene_has_it(clock, scene)
            if isinstance(by_hand, Insert):
                if by_hand.lifetime is not None:
                    insort(planned, end_of(by_hand), key=lambda each: _moment(each, clock))
                by_hand = by_hand._replace(name=names.get(command.body), lifetime=None)
            first = len(due) - overtaken
            planned.extendleft(each._replace(at=by_hand.at) for each in reversed(due[first:]))
            played += [*due[:first], by_hand]
            if command.code == REMOVED:
                gone.add(command.body)
        return [*played, *(each for each in planned if each.body not in gone)]

    def _commands(self) -> Iterator[tuple[Command, int]]:
        content, bases = self.content
        rows = np.frombuffer(content, COMMAND)
        for at, (first, base) in enumerate(bases):
            end = bases[at + 1][0] if at + 1 < len(bases) else len(rows)
            yield from ((command_of(row, base), int(row["overtakes"])) for row in rows[first:end])


def _joined(blocks: tuple[bytes, ...], new: bytes) -> tuple[bytes, ...]:
    """Returns blocks with a new one, joined with the blocks before it that are not longer."""
    kept = list(blocks)
    while kept and len(kept[-1]) <= len(new) <= LONGEST:
        new = kept.pop() + new
    return (*kept, new)


def _moment(command: SceneCommand, clock: Clock) -> tuple[int, int]:
    return clock.tick_of(command.time, command.at), command.at[2] if command.at else 0
