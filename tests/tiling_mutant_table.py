"""The mutants of sweep-tiling: each rule changed or left out, each link, each end, each tile to be watched.

``tiling_mutants`` runs them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

from kinetile.toolbox import NEVER, hook

__all__ = ["MUTANTS", "UNCHANGED", "Change", "Mutant"]


class Change(NamedTuple):
    """Words of one module, and what stands there instead."""

    module: str
    old: str
    new: str


class Mutant(NamedTuple):
    """A name, what is changed, and what replaces ``falls``, if anything."""

    name: str
    changes: tuple[Change, ...]
    falls: Any = None


def _without(function: str, *lines: str) -> Iterator[Mutant]:
    """One mutant for each of some lines of ``events``, without that line."""
    for line in lines:
        name = f"{function}: without {line.strip()}"
        yield Mutant(name, (Change(f"events:{function}", f"    {line}\n", ""),))


@hook
def past_is_dropped(k: Any, since: int, gap: float, rate: float) -> int:
    """What would have failed before now is taken for an error, and never fails (thesis, section 5.2)."""
    if rate < 0.0:
        ticks = gap / -rate * k.clock[0].per_time
        if not ticks < 2.0**62:
            return NEVER
        tick = since + int(math.floor(max(ticks, -(2.0**62))))
        return NEVER if tick < k.clock[0].now else tick
    return NEVER


@hook
def a_little_early(k: Any, since: int, gap: float, rate: float) -> int:
    """Times have an epsilon of 2^-40 subtracted."""
    if rate < 0.0:
        ticks = gap / -rate * k.clock[0].per_time - 2.0**12
        if not ticks < 2.0**62:
            return NEVER
        return max(since + int(math.floor(max(ticks, -(2.0**62)))), int(k.clock[0].now))
    return NEVER


@hook
def time_decides(k: Any, since: int, gap: float, rate: float) -> int:
    """An event is due unless it is past by more than an epsilon of 2^-40, whatever the rate's sign (thesis,
    section 5.2)."""
    if rate != 0.0:
        ticks = gap / -rate * k.clock[0].per_time
        if -(2.0**62) < ticks < 2.0**62:
            tick = since + int(math.floor(ticks))
            if tick > k.clock[0].now - 4096:
                return max(tick, int(k.clock[0].now))
    return NEVER


@hook
def nothing_is_repaired(k: Any, since: int, gap: float, rate: float) -> int:
    """What lies deep on the wrong side and does not fall is left there."""
    if rate < 0.0:
        ticks = gap / -rate * k.clock[0].per_time
        if not ticks < 2.0**62:
            return NEVER
        return max(since + int(math.floor(max(ticks, -(2.0**62)))), int(k.clock[0].now))
    return NEVER


@hook
def judged_too_early(k: Any, since: int, gap: float, rate: float) -> int:
    """Whether an inversion is deep is asked at the present tick, not at its end: a fast body is still short
    of the crossing then, by what it flies in a tick."""
    clock = k.clock[0]
    if rate < 0.0:
        ticks = gap / -rate * clock.per_time
        if not ticks < 2.0**62:
            return NEVER
        return max(since + int(math.floor(max(ticks, -(2.0**62)))), int(clock.now))
    if gap + rate * ((clock.now - since) * clock.tick) < -clock.theta:
        return int(clock.now)
    return NEVER


THREE = "        for tile in change.tiles:\n            watch(k, s, tile)\n"
THREE += "            settle(k, s, body_of(tile))\n"
SIX = "        watch(k, s, tile)\n        if which > 1:"
ABOVE = "    if one.vy != two.vy:\n        return bool(one.vy > two.vy)\n"

UNCHANGED = "nothing is changed"

MUTANTS: tuple[Mutant, ...] = (
    Mutant(UNCHANGED, ()),
    Mutant(
        "the thesis's meeting: outer of b := upper of a",
        (Change("events:join", "beyond_a = facing(s, port(a, p))", "beyond_a = facing(s, port(a, o))"),),
    ),
    *_without(
        "join",
        "link(s, port(b, OUTER), beyond_a)",
        "link(s, port(a, OUTER), beyond_b)",
        "link(s, port(b, o), port(a, p))",
        "set_end(s, a, p, body_of(b))",
        "set_end(s, b, o, body_of(a))",
    ),
    *_without(
        "separate",
        "link(s, port(a, p), beyond_a)",
        "link(s, port(b, o), beyond_b)",
        "link(s, port(a, OUTER), port(b, OUTER))",
        "set_end(s, a, p, end(s, b, p))",
        "set_end(s, b, o, end(s, a, o))",
    ),
    *_without(
        "passing",
        "link(s, port(b, OUTER), beyond_a)",
        "link(s, port(b, o), port(a, OUTER))",
        "link(s, port(a, p), beyond_b)",
        "set_end(s, b, o, end(s, a, o))",
        "set_end(s, a, p, body_of(b))",
    ),
    Mutant("links are noted on one side only", (Change("web:link", "    s.web[q] = p\n", ""),)),
    Mutant(
        "no corner rule",
        (Change("__init__:watch", "                    if level < tick:", "                    if False:"),),
    ),
    Mutant(
        "a flip relinks nothing",
        (Change("events:flip", "    separate(s, a, b, p)\n    join(s, a, b, opposite(p))\n", ""),),
    ),
    Mutant(
        "a flip parts and does not meet", (Change("events:flip", "    join(s, a, b, opposite(p))\n", ""),)
    ),
    Mutant(
        "a flip meets in the old order",
        (Change("events:flip", "join(s, a, b, opposite(p))", "join(s, a, b, p)"),),
    ),
    Mutant(
        "a flip watches three tiles only",
        (
            Change(
                "__init__:repair",
                "        for turn in range(12):  # all tiles of both bodies\n",
                "        for turn in (0, 1, 6):\n",
            ),
        ),
    ),
    Mutant(
        "a corner counts as narrow up to nothing",
        (Change("construction:arrange", "s.limits[:] = tie, max(", "s.limits[:] = tie, 0.0 * max("),),
    ),
    Mutant("past events are dropped", (), past_is_dropped),
    Mutant("an epsilon is subtracted from times", (), a_little_early),
    Mutant("times decide, with an epsilon", (), time_decides),
    Mutant("deep inversions are not repaired", (), nothing_is_repaired),
    Mutant("deep inversions are judged before the end of the tick", (), judged_too_early),
    Mutant("ties at a meeting by number alone", (Change("events:stands_above", ABOVE, ""),)),
    Mutant(
        "ties at a meeting by the wrong velocity",
        (Change("events:stands_above", "one.vy > two.vy", "one.vy < two.vy"),),
    ),
    Mutant(
        "a meeting with the wrong one above",
        (Change("events:stands_above", "bool(rise > 0.0)", "bool(rise < 0.0)"),),
    ),
    *(
        Mutant(
            f"an event forgets to watch its {which} tile",
            (
                Change(
                    "__init__",
                    THREE,
                    THREE.replace(
                        "watch(k, s, tile)",
                        f"if tile != change.tiles.{which}:\n                watch(k, s, tile)",
                        1,
                    ),
                ),
            ),
        )
        for which in ("first", "second", "third")
    ),
    *(
        Mutant(
            f"a new plan forgets {port}",
            (
                Change(
                    "__init__",
                    SIX,
                    SIX.replace(
                        "watch(k, s, tile)", f"if which != {which}:\n            watch(k, s, tile)", 1
                    ),
                ),
            ),
        )
        for which, port in enumerate(("R.outer", "L.upper", "L.lower", "L.outer", "R.upper", "R.lower"))
    ),
    Mutant(
        "a new plan does not queue the owners of other tiles",
        (Change("__init__:replan", "if which > 1:", "if which == 2:"),),
    ),
    Mutant(
        "an event does not queue the owners",
        (Change("__init__", THREE, THREE.replace("            settle(k, s, body_of(tile))\n", "", 1)),),
    ),
    Mutant(
        "a pair that parts stays",
        (Change("__init__:repair", "        release(k, s, change.gone)\n", ""),),
    ),
    Mutant(
        "a pair that meets is not held", (Change("__init__:repair", "        hold(k, s, change.come)\n", ""),)
    ),
    Mutant(
        "bounds without the skin",
        (
            Change(
                "__init__:reach_to",
                "body.reach if is_right_bound(p) else -body.reach",
                "body.radius if is_right_bound(p) else -body.radius",
            ),
            Change(
                "construction:arrange",
                "right, bodies.reach[body], -bodies.reach[body]",
                "right, bodies.radius[body], -bodies.radius[body]",
            ),
        ),
    ),
)
