"""Commands: interventions in a running scene from outside, each at its time.

They run in the order of their times, and at one tick of the clock in the given
order. ``at`` is the exact time, as (epoch, tick, contacts): whole units of the scene's clock since its start,
ticks of 2**-52 of one, and the number of contacts of that very tick that come before, mostly none; then
``time`` is that, rounded. A body has a number: those of the start are numbered from 0, and each inserted
body has a new one, which is never reused.
"""

from __future__ import annotations

import math
import operator
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple, TypeAlias, cast

from kinetile.errors import Mistake
from kinetile.kernel.clock import TICKS
from kinetile.scene.bodies import Numbers
from kinetile.scene.checks import (
    FARTHEST,
    LARGEST,
    PERIODIC_BODY,
    PERIODIC_SHAPE,
    SMALLEST,
    TOLERANCE,
    Extent,
    as_kind,
    check_pair,
    check_time,
    is_finite,
    is_kind,
    shown,
)
from kinetile.scene.shapes import SEGMENTS, Shape, disc


class Turn(NamedTuple):
    """A change of one body's flight plan: from ``time`` on it flies with ``velocity``."""

    body: int
    time: float
    velocity: Numbers
    at: tuple[int, int, int] | None = None


class Insert(NamedTuple):
    """An insertion at ``time``, of a disc of some ``radius`` or of a ``shape``, which may be given by its
    number in the scene's table; ``body`` is its number, -1 before it has one; ``kind`` is by default the
    scene's first. In a scene with shapes it has a shape, and the radius of the circle that holds it."""

    time: float
    position: Numbers
    velocity: Numbers
    radius: float = 0.0
    mass: float = 1.0
    body: int = -1
    at: tuple[int, int, int] | None = None
    kind: str | int | None = None
    shape: Shape | int | None = None


class Remove(NamedTuple):
    """A removal of a body at ``time``."""

    body: int
    time: float
    at: tuple[int, int, int] | None = None


Command: TypeAlias = Turn | Insert | Remove

_SHAPES = "a list of shapes to count in, shapes=[...] or [[shapes]]"

_PAIRS = {"position": "[x, y]", "velocity": "[vx, vy]"}


def numbered(commands: Iterable[Any], bodies: int, kind: str | int | None = None) -> list[Command]:
    """Returns commands in their stored form, with plain numbers; an insertion without a number gets the next
    one, in the given order, after those of the start and all given ones, and one without a kind gets this
    one."""
    kept: list[Command] = []
    taken = [command.body for command in commands if isinstance(command, Insert)]
    free = max([bodies - 1, *taken]) + 1
    for command in commands:
        exact = None if command.at is None else tuple(map(int, command.at))
        command = command._replace(body=int(command.body), time=float(command.time), at=exact)
        if not isinstance(command, Remove):
            vx, vy = map(float, command.velocity)
            command = command._replace(velocity=(vx, vy))
        if isinstance(command, Insert):
            x, y = map(float, command.position)
            radius, mass = float(command.radius), float(command.mass)
            own = kind if command.kind is None else as_kind(command.kind)
            command = command._replace(position=(x, y), radius=radius, mass=mass, kind=own)
            if command.body < 0:
                command, free = command._replace(body=free), free + 1
        kept.append(command)
    return kept


def counted(commands: Iterable[Command]) -> str:
    """Returns how many commands of each kind there are, in words; "none" if there are none."""
    words = {Turn: "turn", Insert: "insertion", Remove: "removal"}
    counts = Counter(words[type(command)] for command in commands)
    found = ((word, counts[word]) for word in words.values() if counts[word])
    return ", ".join(f"{count:,} {word}{'s' * (count > 1)}" for word, count in found) or "none"


def speeds(commands: Iterable[Command]) -> list[float]:
    """Returns the squares of the speeds that commands give to bodies."""
    given = (command.velocity for command in commands if not isinstance(command, Remove))
    return [vx * vx + vy * vy for vx, vy in given]


def shape_of(command: Any, where: str, table: Sequence[Shape], mistakes: list[Mistake]) -> Shape | None:
    """Returns the shape of a body that a command inserts, a disc by its radius; None for other commands, and
    for a shape or a radius that is none. Appends the mistakes of a shape."""
    if not isinstance(command, Insert):
        return None
    shape: Any = command.shape
    if shape is None:
        right = is_finite(command.radius) and SMALLEST <= command.radius <= LARGEST
        return disc(command.radius) if right else None
    if not isinstance(shape, Shape):
        if not _is_number_of_body(shape, False) or shape >= len(table):
            numbers = f"the number of one, 0 to {len(table) - 1}" if table else f"with its number {_SHAPES}"
            wanted = f"a shape, or {numbers}"
            mistakes.append(Mistake(f"{where}.shape", shown(shape), wanted))
            return None
        shape = table[shape]
    if not is_finite(command.radius) or command.radius not in (0.0, shape.reach):
        mistakes.append(Mistake(f"{where}.radius", "a radius beside a shape", "one of the two"))
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
    """Checks one command by itself; ``check_presence`` checks that its body is present.

    ``start`` and ``extent``, of the arena, are None if they are not known, or there is none.
    """
    if not isinstance(command, Command):
        expected = "kinetile.Insert(...), kinetile.Remove(...) or kinetile.Turn(...)"
        return [Mistake(where, shown(command), expected)]
    mistakes = check_time(command.time, where, start)
    if command.at is not None and not is_exact(command.at):
        mistakes.append(Mistake(f"{where}.at", shown(command.at), EXACT))
    if not _is_number_of_body(command.body, isinstance(command, Insert)):
        mistakes.append(Mistake(f"{where}.body", shown(command.body), "the number of a body"))
    return mistakes + _check_body(command, where, extent)


def check_turn(turn: Any, where: str, bodies: int, start: float | None) -> list[Mistake]:
    """Checks one turn, (body, time, (vx, vy)), of one of the bodies that are present at the start."""
    try:
        command = Turn(*turn)
    except TypeError:
        return [Mistake(where, shown(turn), "a turn: (body, time, (vx, vy))")]
    mistakes = check_command(command, where, start, None)
    if _is_number_of_body(command.body, False) and command.body >= bodies:
        there = f"the number of a body, 0 to {bodies - 1}" if bodies else "no turns in a scene without bodies"
        mistakes.insert(0, Mistake(f"{where}.body", shown(command.body), there))
    return mistakes


def _check_body(command: Any, where: str, extent: Extent | None) -> list[Mistake]:
    mistakes = []
    for name, axes in _PAIRS.items():
        given = getattr(command, name, None)
        if given is not None or isinstance(command, Insert):
            mistakes += check_pair(given, f"{where}.{name}", axes)
    if not isinstance(command, Insert):
        return mistakes
    if command.kind is not None and not is_kind(command.kind):
        mistakes.append(Mistake(f"{where}.kind", shown(command.kind), "a kind, a name or a small number"))
    for name, number in (("radius", command.radius), ("mass", command.mass)):
        if name == "mass" and number == math.inf:
            continue
        if not (is_finite(number) and SMALLEST <= number <= LARGEST):
            mistakes.append(
                Mistake(f"{where}.{name}", shown(number), "a number from 2**-200 to 2**200, greater than 0")
            )
    if extent is not None and not mistakes:
        shape, r, allowed = command.shape, command.radius, TOLERANCE * command.radius
        reaches = shape.reaches if isinstance(shape, Shape) else (r, r, r, r)
        wide, narrow = (2.0, PERIODIC_BODY) if shape is None else (4.0, PERIODIC_SHAPE)
        each_axis = zip(
            command.position, extent.sides, extent.periods, (reaches[:2], reaches[2:]), strict=True
        )
        for place, side, period, (low, high) in each_axis:
            if period and not (wide * r < period and abs(place) <= FARTHEST * period):
                mistakes.append(Mistake(where, shown(command), narrow))
                break
            if extent.walled and not period and not low - allowed <= place <= side - (high - allowed):
                what = "disc" if shape is None else "body"
                expected = (
                    f"the whole {what} inside the arena, [0, {extent.sides[0]!r}] x [0, {extent.sides[1]!r}]"
                )
                mistakes.append(Mistake(f"{where}.position", shown(command.position), expected))
                break
    return mistakes


EXACT = "(epoch, tick, contacts), whole numbers, none below 0, tick < 2**52"


def is_exact(moment: Any) -> bool:
    """Whether something is an exact moment, (epoch, tick, contacts)."""
    try:
        epoch, tick, contacts = map(operator.index, moment)
    except (TypeError, ValueError):
        return False
    return epoch >= 0 and contacts >= 0 and 0 <= tick < TICKS


def _is_number_of_body(body: Any, may_be_none: bool) -> bool:
    try:
        return not isinstance(body, bool) and (-1 if may_be_none else 0) <= operator.index(body) < 2**31
    except TypeError:
        return False


def check_presence(commands: Sequence[Command], places: Sequence[str], bodies: int) -> list[Mistake]:
    """Follows the present bodies, command by command in their order: no body is inserted or removed twice,
    and only present bodies turn. ``places`` are those of the commands in the input."""
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
