"""Commands: interventions in a running scene from outside, each at its time.

They run in the order of their times; commands of one tick of the clock run in the given order. ``at`` is the
exact time, as (epoch, tick, contacts): whole units of the scene's clock since its start, ticks of 2**-52 of a
unit, and the number of contacts of that tick that precede the command, mostly 0. ``time`` is ``at``, rounded.
Bodies of the start are numbered from 0; each inserted one has a new number, which is never reused.
"""

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from enum import Flag, auto
from typing import Any, NamedTuple, TypeAlias, cast

from kinetile.errors import Mistake, constructed, nearest
from kinetile.kernel.log import ACCELERATED, INSERTED, MOVED, OF_KIND, REMOVED, TURNED
from kinetile.scene.bodies import Coordinates
from kinetile.scene.checks import (
    FARTHEST,
    PERIODIC_BODY,
    PERIODIC_SHAPE,
    SMALLEST,
    TOLERANCE,
    Extent,
    is_finite,
    shown,
)
from kinetile.scene.frame import check_time
from kinetile.scene.shapes import SEGMENTS, Shape, disc
from kinetile.scene.values import VALUES, Value

Called: TypeAlias = Any
"""A body: its number, or its name in the scene, until a scene has the command."""


@constructed
class Turn(NamedTuple):
    """A change of one body's flight plan: from ``time`` on it flies with ``velocity``."""

    body: Called
    time: float
    velocity: Coordinates
    at: tuple[int, int, int] | None = None


@constructed
class Insert(NamedTuple):
    """An insertion at ``time``, of a disc of some ``radius`` or of a ``shape``, which may be given by its
    number in the scene's table. ``body`` is the body's number, -1 before it has one; commands may use its
    ``name`` instead. ``kind`` is by default the scene's first, and ``acceleration`` is by default gravity. In
    a scene with shapes the body has a shape, and the radius of the circle that holds it. After a ``lifetime``
    it is removed: the scene gets a ``Remove`` for that, unless it has an earlier one of this body."""

    time: float
    position: Coordinates
    velocity: Coordinates
    radius: float = 0.0
    mass: float = 1.0
    body: int = -1
    at: tuple[int, int, int] | None = None
    kind: str | int | None = None
    shape: Shape | int | None = None
    acceleration: Coordinates | None = None
    name: str | None = None
    lifetime: float | None = None

    @property
    def reaches(self) -> tuple[float, float, float, float]:
        """The reaches of the body: left, right, bottom and top, from its position (rule 6s)."""
        return self.shape.reaches if isinstance(self.shape, Shape) else (self.radius,) * 4


@constructed
class Remove(NamedTuple):
    """A removal of a body at ``time``."""

    body: Called
    time: float
    at: tuple[int, int, int] | None = None


@constructed
class Accelerate(NamedTuple):
    """A change of one body's flight plan: from ``time`` on it has this ``acceleration``."""

    body: Called
    time: float
    acceleration: Coordinates
    at: tuple[int, int, int] | None = None


@constructed
class SetKind(NamedTuple):
    """A change of one body's kind: from ``time`` on its contacts have the responses of this ``kind``."""

    body: Called
    time: float
    kind: str | int
    at: tuple[int, int, int] | None = None


@constructed
class Move(NamedTuple):
    """A change of one body's place: at ``time`` it is at ``position``, with the velocity that it has then, as
    if it were removed and inserted in one tick (rule 11m)."""

    body: Called
    time: float
    position: Coordinates
    at: tuple[int, int, int] | None = None


Command: TypeAlias = Turn | Insert | Remove | Accelerate | SetKind | Move


class Does(Flag):
    """Further effects of a command: it inserts a body or removes one (``kernel/loop/commands.py`` has both as
    well); a body may be faster after it, at once or because it falls from there."""

    NO_MORE = 0
    BRINGS, TAKES, FASTER, FALLS = auto(), auto(), auto(), auto()


class CommandKind(NamedTuple):
    """The names of a class of commands: their ``code`` in the log, their ``word`` in files, the kind of their
    ``event``, and the words for one and for many, ``said``. And their effects: ``gives``, the value that they
    give to a present body, as key in files, in words and in form; and ``does``, further effects."""

    made: Any
    code: int
    word: str
    event: str
    said: tuple[str, str]
    gives: tuple[str, str, str] | None
    does: Does


_VELOCITY = ("velocity", "a velocity", "[vx, vy]")
_PULL = ("acceleration", "an acceleration", "[ax, ay]")
_KIND = ("kind", "a kind", "the name of a kind")
_PLACE = ("position", "a position", "[x, y]")
_CHANGES, _PULLS = ("change of kind", "changes of kind"), ("acceleration", "accelerations")
_COMES = Does.BRINGS | Does.FASTER | Does.FALLS

COMMAND_KINDS = (
    CommandKind(Turn, TURNED, "turn", "turn", ("turn", "turns"), _VELOCITY, Does.FASTER),
    CommandKind(Accelerate, ACCELERATED, "accelerate", "accelerate", _PULLS, _PULL, Does.FASTER | Does.FALLS),
    CommandKind(SetKind, OF_KIND, "set-kind", "kind", _CHANGES, _KIND, Does.NO_MORE),
    CommandKind(Move, MOVED, "move", "move", ("move", "moves"), _PLACE, _COMES | Does.TAKES),
    CommandKind(Insert, INSERTED, "insert", "insert", ("insertion", "insertions"), None, _COMES),
    CommandKind(Remove, REMOVED, "remove", "remove", ("removal", "removals"), None, Does.TAKES),
)
"""All kinds of commands: files, events, saved runs and engines use this table. The kernel has their effects
on bodies (``kernel/loop/commands.py``)."""


def doing(what: Does) -> tuple[CommandKind, ...]:
    """Returns the kinds of commands with one of these effects."""
    return tuple(each for each in COMMAND_KINDS if each.does & what)


OF_CODE = {each.code: each for each in COMMAND_KINDS}
OF_CLASS = {each.made: each for each in COMMAND_KINDS}
COME_OR_GO = doing(Does.BRINGS | Does.TAKES)
"""The kinds of commands that insert or remove bodies."""

_SHAPES = "a list of shapes to count in, shapes=[...] or [[shapes]]"


def values_of(command: Command) -> dict[str, tuple[Value, Any]]:
    """Returns the given fields of a command, without a shape: names, the expected value, the given one."""
    new = isinstance(command, Insert)
    return {
        name: (VALUES["new body" if new and name == "body" else name], value)
        for name, value in command._asdict().items()
        if name != "shape" and (value is not None or command._field_defaults.get(name, 0) is not None)
    }


def called(
    commands: Sequence[tuple[str, Any]], names: Sequence[str | None], bodies: int, mistakes: list[Mistake]
) -> list[tuple[str, Any]]:
    """Returns commands, each with its place, with numbers instead of names. Insertions get the next numbers
    after the bodies of the start and all given numbers; ``names``, and the names of insertions, become
    numbers. Appends mistakes of names."""
    inserted = [at for at, (_, each) in enumerate(commands) if isinstance(each, Insert)]
    valid = [at for at in inserted if not VALUES["new body"].expected(commands[at][1].body)]
    free = max([bodies - 1, *(commands[at][1].body for at in valid)]) + 1
    found, known = list(commands), dict[str, int]()
    for at in valid:
        where, command = commands[at]
        if command.body < 0:
            found[at], free = (where, command._replace(body=free)), free + 1
    for body, name in enumerate(names):
        _note_name(known, name, body, f"names[{body}]", mistakes)
    for where, command in (found[at] for at in inserted):
        _note_name(known, command.name, command.body, f"{where}.name", mistakes)
    for at, (where, command) in enumerate(found):
        name = getattr(command, "body", None)
        if isinstance(name, str) and not isinstance(command, Insert):
            if name not in known:
                expected = f"a number, or {name_like(name, known)}"
                mistakes.append(Mistake(f"{where}.body", shown(name), expected))
            found[at] = where, command._replace(body=known.get(name, 0))
    return found


def name_like(name: str, known: Iterable[str]) -> str:
    """Returns the text after "expected" for a name that no body has."""
    meant = nearest(name, known)
    return f"a name of a body; did you mean {meant!r}?" if meant else "a name of a body"


def _note_name(known: dict[str, int], name: Any, body: Any, where: str, mistakes: list[Mistake]) -> None:
    if name is not None:
        wrong = VALUES["name"].mistakes(name, where)
        if not wrong and known.setdefault(name, body) != body:
            wrong = [Mistake(where, shown(name), f"another name: it is the name of body {known[name]}")]
        mistakes += wrong


def numbered(commands: Iterable[Any], kind: str | int | None = None) -> list[Command]:
    """Returns commands in their stored form, with plain numbers; an insertion without a kind gets this."""
    kept: list[Command] = []
    for command in commands:
        plain = {name: field.plain(value) for name, (field, value) in values_of(command).items()}
        command = command._replace(**plain)
        if isinstance(command, Insert) and command.kind is None:
            command = command._replace(kind=kind)
        kept.append(command)
    return kept


def end_of(new: Insert) -> Remove:
    """Returns the removal of a body with a lifetime."""
    return Remove(new.body, new.time + cast("float", new.lifetime))


def with_ends(commands: Iterable[tuple[str, Command]]) -> list[tuple[str, Command]]:
    """Returns commands, each with its place, with removals after insertions instead of lifetimes."""
    found, known = list[tuple[str, Command]](), list(commands)
    gone = {each.body: each.time for _, each in known if isinstance(each, Remove)}
    for where, each in known:
        found.append((where, each))
        if isinstance(each, Insert) and each.lifetime is not None:
            found[-1] = where, each._replace(lifetime=None)
            if not gone.get(each.body, math.inf) <= end_of(each).time:
                found.append((f"{where}.lifetime", end_of(each)))
    return found


def counted(commands: Iterable[Command]) -> str:
    """Returns the number of commands of each kind, in words; "none" without commands."""
    counts = Counter(map(type, commands))
    many = ((counts[each.made], each.said) for each in COMMAND_KINDS)
    return ", ".join(f"{count:,} {said[count > 1]}" for count, said in many if count) or "none"


def speeds(commands: Iterable[Command]) -> list[float]:
    """Returns the squares of the speeds that commands give to bodies."""
    given = (command.velocity for command in commands if isinstance(command, Turn | Insert))
    return [vx * vx + vy * vy for vx, vy in given]


def shape_of(command: Any, where: str, table: Sequence[Shape], mistakes: list[Mistake]) -> Shape | None:
    """Returns the shape of a body that a command inserts, a disc by its radius; None for other commands, and
    for an invalid shape or radius. Appends the mistakes of a shape."""
    if not isinstance(command, Insert):
        return None
    shape: Any = command.shape
    if shape is None:
        return None if VALUES["radius"].expected(command.radius) else disc(command.radius)
    if not isinstance(shape, Shape):
        if VALUES["shape"].expected(shape) or shape >= len(table):
            numbers = f"the number of one, 0 to {len(table) - 1}" if table else f"with its number {_SHAPES}"
            mistakes.append(Mistake(f"{where}.shape", shown(shape), f"a shape, or {numbers}"))
            return None
        shape = table[shape]
    if not is_finite(command.radius) or command.radius not in (0.0, shape.reach):
        one = "one of the two: a shape has its own size"
        mistakes.append(Mistake(f"{where}.radius", "a radius beside a shape", one))
    if not shape.is_solid and command.mass != math.inf:
        mistakes.append(Mistake(f"{where}.shape", *SEGMENTS))
    return cast(Shape, shape)


def with_shape(command: Any, shape: Shape | None, shaped: bool) -> Any:
    """Returns an insertion with the shape of its body, if the scene has shapes, and with its radius; other
    commands as they are. The mistakes of a shape have been reported."""
    if shape is not None:
        return command._replace(shape=shape if shaped else None, radius=shape.reach)
    wrong = isinstance(command, Insert) and command.shape is not None
    return command._replace(shape=None, radius=SMALLEST) if wrong else command


def check_command(command: Any, where: str, start: float | None, extent: Extent | None) -> list[Mistake]:
    """Checks one command by itself; without a ``start`` or an ``extent`` of an arena, these are None."""
    if not isinstance(command, Command):
        *kinds, last = sorted(f"kinetile.{each.made.__name__}(...)" for each in COMMAND_KINDS)
        return [Mistake(where, shown(command), f"{', '.join(kinds)} or {last}")]
    mistakes = []
    for name, (field, value) in values_of(command).items():
        at = f"{where}.{name}"
        mistakes += field.mistakes(value, at) or (check_time(value, at, start) if name == "time" else [])
    if isinstance(command, Insert) and extent is not None and not mistakes:
        mistakes += _check_place(command, where, extent)
    if isinstance(command, Move) and extent is not None and not mistakes:
        mistakes += check_move(command.position, f"{where}.position", extent)
    return mistakes


def check_turn(turn: Any, where: str, bodies: int, start: float | None) -> list[Mistake]:
    """Checks one turn, (body, time, (vx, vy)), of one of the bodies that are present at the start."""
    try:
        command = Turn(*turn)
    except TypeError:
        return [Mistake(where, shown(turn), "a turn: (body, time, (vx, vy))")]
    mistakes = check_command(command, where, start, None)
    if not VALUES["body"].expected(command.body) and command.body >= bodies:
        there = f"the number of a body, 0 to {bodies - 1}" if bodies else "no turns in a scene without bodies"
        mistakes.insert(0, Mistake(f"{where}.body", shown(command.body), there))
    return mistakes


def check_move(position: Coordinates, where: str, extent: Extent) -> list[Mistake]:
    """Checks the new place of a moved body of any size; its room is checked when it moves."""
    for place, side, period in zip(position, extent.sides, extent.periods, strict=True):
        far = FARTHEST * period if period else math.inf
        low, high = (0.0, side) if extent.walled and not period else (-far, far)
        if not low <= place <= high:
            return [Mistake(where, shown(position), f"a place in [{low!r}, {high!r}] along this axis")]
    return []


def _check_place(command: Insert, where: str, extent: Extent) -> list[Mistake]:
    shape, r, allowed = command.shape, command.radius, TOLERANCE * command.radius
    reaches = command.reaches
    wide, narrow = (2.0, PERIODIC_BODY) if shape is None else (4.0, PERIODIC_SHAPE)
    each_axis = zip(command.position, extent.sides, extent.periods, (reaches[:2], reaches[2:]), strict=True)
    for place, side, period, (low, high) in each_axis:
        if period and not (wide * r < period and abs(place) <= FARTHEST * period):
            return [Mistake(where, f"one at {list(command.position)} that reaches {r:g} far", narrow)]
        if extent.walled and not period and not low - allowed <= place <= side - (high - allowed):
            what = "disc" if shape is None else "body"
            sides = f"[0, {extent.sides[0]!r}] x [0, {extent.sides[1]!r}]"
            inside = f"the whole {what} inside the arena, {sides}"
            return [Mistake(f"{where}.position", shown(command.position), inside)]
    return []


def check_presence(commands: Sequence[Command], places: Sequence[str], bodies: int) -> list[Mistake]:
    """Follows the present bodies, command by command in their order: no body is inserted or removed twice,
    and only present bodies turn. ``places`` are the places of the commands in the input."""
    mistakes = []
    there, gone = set(range(bodies)), set[int]()
    for command, where in zip(commands, places, strict=True):
        body = command.body
        if isinstance(command, Insert):
            if body in there or body in gone:
                found = f"{body}, the number of {'another body' if body in there else 'one that has gone'}"
                mistakes.append(Mistake(f"{where}.body", found, "a number that is not used before"))
            there.add(body)
        elif body not in there:
            found = f"{body}, which {'has gone by then' if body in gone else 'is not there then'}"
            mistakes.append(Mistake(f"{where}.body", found, "the number of a body that is there"))
        elif isinstance(command, Remove):
            there.remove(body)
            gone.add(body)
    return mistakes
