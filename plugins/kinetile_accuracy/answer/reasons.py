"""Why a line is wrong: in a sentence, from what the specification says of the bodies that it names."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinetile.kernel.log import REANCHORED, TURNED, WALLS
from kinetile_accuracy.answer.course import Course, Happening
from kinetile_accuracy.answer.exact import pair_tick, wall_tick

__all__ = ["Row", "named", "reason", "row_of", "when"]

Row = tuple[int, int, int, int]
"""A line: epoch, tick, a, b."""


def row_of(event: Happening) -> Row:
    """Return an event as a line."""
    return event.tick >> 52, event.tick & ((1 << 52) - 1), event.a, event.b


def when(tick: int) -> str:
    """Return a tick as a line has it."""
    return f"epoch {tick >> 52}, tick {tick & ((1 << 52) - 1)}"


def named(event: Happening) -> str:
    """Return who meets, or what else happens."""
    _, a, b = event
    if b in (TURNED, REANCHORED):
        return f"a turn of body {a}" if b == TURNED else f"the anchoring of body {a} by the clock"
    return f"body {a} with body {b}" if b >= 0 else f"body {a} with the {WALLS[b]} wall"


def reason(
    course: Course,
    found: Row,
    due: Happening | None,
    before: Happening | None,
    rest: NDArray[Any],
    end: int | None,
) -> tuple[str, Happening | None]:
    """Return why a line is wrong, and what should stand there (None: nothing that is known).

    Args:
        course: the scene after all lines before this one; it may be moved on.
        found: the line.
        due: what comes next up to ``end``, or without an end up to the line's tick; None: nothing.
        before: the line before it, which is right.
        rest: the lines behind it, with the fields epoch, tick, a, b.
        end: the tick of the end, or None.
    """
    amiss = _malformed(course, found)
    if amiss is not None:
        return amiss, due
    line = Happening((found[0] << 52) + found[1], *found[2:])
    own, why_not = _asked(course, line)
    if due is None and own is not None and end is None:
        due = course.next(own)
    if due is not None and due[1:] == line[1:]:
        off = abs(line.tick - due.tick)
        how = f"{off:,} tick{'s' if off > 1 else ''} {'earlier' if line.tick > due.tick else 'later'}"
        return f"{named(line)}: its tick should be {when(due.tick)}, {how}", due
    at = f"{named(line)} at {when(line.tick)}"
    if due is not None:
        first = f"{named(due)}, at {when(due.tick)}"
        follows = _place_in(rest, due)
        if follows is None and (own == line.tick or due.tick < line.tick):
            return f"{at}: before that comes {first}, and that is not in the log", due
        if own == line.tick or (follows == 0 and _follows(course, due, line)):
            place = "the next line" if follows == 0 else f"{(follows or 0) + 1:,} lines further on"
            return f"{at} is in the wrong order: before it comes {first}, which is {place}", due
    if before is not None and line.tick < before.tick:
        return f"{at} is earlier than the line before it, at {when(before.tick)}", due
    if due is None and end is not None and line.tick > end:
        return f"{at} is after the end, which is at {when(end)}", due
    return f"{at}: {why_not}" + ("" if due is None else f"; what comes next is {first}"), due


def _malformed(course: Course, found: Row) -> str | None:
    """Return what no line of a log of this scene can be."""
    _, tick, a, b = found
    count = len(course.plans)
    for body in (a, max(b, 0)):
        if not 0 <= body < count:
            return f"there is no body {body}: the scene has {count:,}"
    if not 0 <= tick < 1 << 52:
        return f"a tick is from 0 to 2^52 - 1, and this one is {tick}"
    if b >= 0:
        return None if a < b else f"the bodies {a} and {b} are not in ascending order"
    if b not in (*WALLS, TURNED, REANCHORED):
        return f"there is no wall {b}: the walls are -1 to -4"
    return "the scene has no walls" if b in WALLS and course.frame.arena is None else None


def _asked(course: Course, line: Happening) -> tuple[int | None, str]:
    """Return when the bodies of a line meet by their present plans, or None; and that in words."""
    tick, a, b = line
    if b < 0:
        if b not in WALLS:
            here = b == TURNED and course.will_turn(a, tick)
            return tick if here else None, "nothing of the kind happens then"
        met = wall_tick(course.plans[a], course.frame)
        if met is None:
            return None, "it flies towards no wall"
        if met[1] != b:
            return None, f"the wall that it meets first is the {WALLS[met[1]]} one, at {when(met[0])}"
        own: int | None = met[0]
    elif course.barred(a, b):
        since = when(course.plans[a].anchor)
        return None, f"these two are barred: they met at {since}, and neither has had another plan since"
    else:
        own = pair_tick(course.plans[a], course.plans[b])
    if own is None:
        return None, "by their present plans these two do not meet"
    return own, f"by the present plans that is at {when(own)}"


def _place_in(rest: NDArray[Any], event: Happening) -> int | None:
    """Return where an event stands in lines."""
    same = np.ones(len(rest), np.bool_)
    for name, value in zip(("epoch", "tick", "a", "b"), row_of(event), strict=True):
        same &= rest[name] == value
    return int(same.argmax()) if same.any() else None


def _follows(course: Course, due: Happening, line: Happening) -> bool:
    """Whether a line is right after what comes next has happened."""
    course.next(due.tick)
    course.happen()
    return course.next(line.tick) == line
