"""Why a line is wrong: in a sentence, from what the specification says of the bodies that it names."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kinetile.accuracy.answer.course import Course, Happening
from kinetile.accuracy.answer.exact import pair_tick, wall_tick
from kinetile.kernel.log import REANCHORED, TURNED, WALLS

if TYPE_CHECKING:
    Row = tuple[int, int, int, int]

__all__ = ["named", "reason", "when"]


def when(tick: int) -> str:
    """Return a tick as a log writes it."""
    return f"epoch {tick >> 52}, tick {tick & ((1 << 52) - 1)}"


def named(event: Happening) -> str:
    """Return who meets, or what else happens."""
    _, a, b = event
    if b == TURNED:
        return f"a turn of body {a}"
    if b == REANCHORED:
        return f"body {a} is anchored by the clock"
    return f"body {a} with body {b}" if b >= 0 else f"body {a} with the {WALLS[b]} wall"


def reason(
    course: Course,
    found: Row,
    due: Happening | None,
    before: Happening | None,
    rest: NDArray[Any],
    end: int | None,
    turns: bool,
) -> tuple[str, Happening | None]:
    """Return why a line is wrong, and what should stand there (None: nothing).

    Args:
        course: the scene, after all lines before this one.
        found: the line.
        due: what comes next up to ``end``, or without an end up to the line's tick; None: nothing.
        before: the line before it.
        rest: the lines behind it, with the fields epoch, tick, a, b.
        end: the tick of the end, or None.
        turns: whether turns are among the lines.
    """
    epoch, tick, a, b = found
    line = Happening((epoch << 52) + tick, a, b)
    amiss = _malformed(course, found, turns)
    if amiss is not None:
        return amiss, due
    own, why_not = _tick_of(course, line)
    if due is None and own is not None and end is None:
        due = course.next(own)
    if due is not None and (due.a, due.b) == (a, b):
        late = line.tick - due.tick
        how = f"{abs(late):,} tick{'s' if abs(late) > 1 else ''} {'earlier' if late > 0 else 'later'}"
        return f"{named(line)}: its tick should be {when(due.tick)}, {how}", due
    if due is not None and a == due.a and b < 0 and due.b < 0 and own is not None:
        return f"{named(line)} at {when(line.tick)}: it meets the {WALLS[due.b]} wall, at {when(due.tick)}", due
    follows = None if due is None else _where(rest, due)
    if due is not None and follows is None and (own == line.tick or due.tick <= line.tick):
        what = f"{named(line)} at {when(line.tick)}: before that comes {named(due)}, at {when(due.tick)}"
        return f"{what}, and that is not in the list", due
    if own == line.tick and due is not None:
        nth = "the next line" if follows == 0 else f"{(follows or 0) + 1:,} lines further on"
        what = f"{named(line)} at {when(line.tick)} is in the wrong order: before it comes {named(due)}"
        return f"{what}, at {when(due.tick)}, which is {nth}", due
    if before is not None and line.tick < before.tick:
        return f"{named(line)} at {when(line.tick)} is before the line before it, {when(before.tick)}", due
    if end is not None and line.tick > end and due is None:
        return f"{named(line)} at {when(line.tick)} is after the end, {when(end)}", due
    if own is not None:
        why_not = f"by their present plans they would meet at {when(own)}"
    return f"{named(line)} at {when(line.tick)}: {why_not}" + _instead(due), due


def _instead(due: Happening | None) -> str:
    return "" if due is None else f"; what comes next is {named(due)}, at {when(due.tick)}"
