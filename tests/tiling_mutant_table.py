"""The mutants of sweep-tiling: each rule changed or left out, each link, each end, each tile to be watched.

``tiling_mutants`` runs them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from kinetile.kernel.vectors import choose, floor, spread, spread_ticks, to_floats
from kinetile.toolbox import NEVER, hook

__all__ = ["MUTANTS", "UNCHANGED", "Change", "Mutant"]


class Change(NamedTuple):
    """Words of one module, and what stands there instead."""

    module: str
    old: str
    new: str


class Mutant(NamedTuple):
    """A name, what is changed, and what replaces ``falls_eight``, if anything."""

    name: str
    changes: tuple[Change, ...]
    falls: Any = None


def _without(function: str, *lines: str) -> Iterator[Mutant]:
    """One mutant for each of some lines of ``events``, without that line."""
    for line in lines:
        name = f"{function}: without {line.strip()}"
        yield Mutant(name, (Change(f"events:{function}", f"    {line}\n", ""),))


@hook
def predicted(k: Any, since: Any, gap: Any, rate: Any, early: float) -> tuple[Any, Any]:
    """Return in how many ticks gaps close, so many ticks early, and at which tick; nonsense where too far."""
    ticks = gap / (spread(0.0) - rate) * spread(k.clock[0].per_time) - spread(early)
    near = choose((ticks < spread(2.0**62)) & (ticks > spread(-(2.0**62))), ticks, spread(0.0))
    return ticks, since + floor(near)


@hook
def not_before_now(k: Any, tick: Any, ticks: Any) -> Any:
    """Return ticks, or now where they are past."""
    now = spread_ticks(k.clock[0].now)
    return choose((tick < now) | (ticks <= spread(-(2.0**62))), now, tick)


@hook
def past_is_dropped(k: Any, since: Any, gap: Any, rate: Any) -> Any:
    """What would have failed before now is taken for an error, and never fails (thesis, section 5.2)."""
    ticks, tick = predicted(k, since, gap, rate, 0.0)
    never = spread_ticks(NEVER)
    past = (tick < spread_ticks(k.clock[0].now)) | (ticks <= spread(-(2.0**62)))
    return choose((rate < spread(0.0)) & (ticks < spread(2.0**62)), choose(past, never, tick), never)


@hook
def a_little_early(k: Any, since: Any, gap: Any, rate: Any) -> Any:
    """Times have an epsilon of 2^-40 subtracted."""
    ticks, tick = predicted(k, since, gap, rate, 2.0**12)
    falls = (rate < spread(0.0)) & (ticks < spread(2.0**62))
    return choose(falls, not_before_now(k, tick, ticks), spread_ticks(NEVER))


@hook
def time_decides(k: Any, since: Any, gap: Any, rate: Any) -> Any:
    """An event is due unless it is past by more than an epsilon of 2^-40, whatever the rate's sign (thesis,
    section 5.2)."""
    ticks, tick = predicted(k, since, gap, rate, 0.0)
    due = (ticks < spread(2.0**62)) & (ticks > spread(-(2.0**62)))
    due = due & ((rate < spread(0.0)) | (rate > spread(0.0))) & (tick > spread_ticks(k.clock[0].now - 4096))
    return choose(due, not_before_now(k, tick, ticks), spread_ticks(NEVER))


@hook
def nothing_is_repaired(k: Any, since: Any, gap: Any, rate: Any) -> Any:
    """What lies deep on the wrong side and does not fall is left there."""
    ticks, tick = predicted(k, since, gap, rate, 0.0)
    falls = (rate < spread(0.0)) & (ticks < spread(2.0**62))
    return choose(falls, not_before_now(k, tick, ticks), spread_ticks(NEVER))


@hook
def judged_too_early(k: Any, since: Any, gap: Any, rate: Any) -> Any:
    """Whether an inversion is deep is asked at the present tick, not at its end: a fast body is still short
    of the crossing then, by what it flies in a tick."""
    clock = k.clock[0]
    zero = spread(0.0)
    ahead = to_floats(spread_ticks(clock.now) - since) * spread(clock.tick)
    deep = choose(rate < zero, zero < zero, gap + rate * ahead < spread(-clock.limits.theta))
    return choose(deep, spread_ticks(clock.now), nothing_is_repaired(k, since, gap, rate))


NOTED = "    set_due(s, {}, lane(tick, {}), lane(by_order, {}))\n"
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
        "link(s, port(b, OUTER), beyond_a, to_a - across)",
        "link(s, port(a, OUTER), beyond_b, to_b + across)",
        "link(s, port(b, o), port(a, p), -across)",
        "set_end(s, a, p, body_of(b))",
        "set_end(s, b, o, body_of(a))",
    ),
    *_without(
        "separate",
        "link(s, port(a, p), beyond_a, to_a + across)",
        "link(s, port(b, o), beyond_b, to_b - across)",
        "link(s, port(a, OUTER), port(b, OUTER), across)",
        "set_end(s, a, p, end(s, b, p))",
        "set_end(s, b, o, end(s, a, o))",
    ),
    *_without(
        "passing",
        "link(s, port(b, OUTER), beyond_a, to_a - across)",
        "link(s, port(b, o), port(a, OUTER), -across)",
        "link(s, port(a, p), beyond_b, to_b + across)",
        "set_end(s, b, o, end(s, a, o))",
        "set_end(s, a, p, body_of(b))",
    ),
    Mutant("links are noted on one side only", (Change("web:link", "    s.web[q] = p\n", ""),)),
    Mutant(
        "no corner rule",
        (Change("certificates:failures", "by_order = level < tick", "by_order = none"),),
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
        "a flip watches the tiles of one body only",
        (Change("__init__:repair", "for turn in range(2):", "for turn in range(1):"),),
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
            (Change("certificates:watch_tiles", NOTED.format(tile, lane, lane), ""),),
        )
        for which, tile, lane in (
            ("first", "one.left", 0),
            ("second", "two.left", 1),
            ("third", "three.left", 2),
        )
    ),
    *(
        Mutant(
            f"a new plan forgets {port}",
            (Change("certificates:watch_around", NOTED.format(tile, lane, lane), ""),),
        )
        for port, tile, lane in (
            ("R.outer", "outer", 0),
            ("L.upper", "upper", 1),
            ("L.lower", "lower", 2),
            ("L.outer", "first", 4),
            ("R.upper", "second", 5),
            ("R.lower", "third", 6),
        )
    ),
    Mutant(
        "a new plan does not queue the owners of other tiles",
        tuple(
            Change("certificates:watch_around", f"settle(k, s, body_of({tile}))", "pass")
            for tile in ("first", "second", "third")
        ),
    ),
    Mutant(
        "an event does not queue the owners",
        tuple(
            Change("certificates:watch_tiles", f"settle(k, s, body_of({tile}.left))", "pass")
            for tile in ("one", "two", "three")
        ),
    ),
    Mutant(
        "two others that come into sight are not offered",
        (Change("__init__:repair", "        offer(k, one, other)\n", ""),),
    ),
    Mutant(
        "a body that comes into sight is not named",
        (Change("__init__:repair", "    return 1\n", "    return 0\n"),),
    ),
    Mutant(
        "the walk leaves out what is under a body",
        (Change("web:near", "for side in (UPPER, LOWER):", "for side in (UPPER,):"),),
    ),
    Mutant(
        "the walk leaves out what stands on a body",
        (Change("web:next_along", "is_right_bound(q) else opposite(side)", "is_right_bound(q) else side"),),
    ),
    Mutant(
        "bounds without the skin",
        (
            Change(
                "certificates:sides",
                "    port = eight(",
                "    reach = reach - spread(k.clock[0].limits.skin)\n    port = eight(",
            ),
            Change(
                "construction:arrange",
                "right, bodies.reach[body], -bodies.reach[body]",
                "right, bodies.radius[body], -bodies.radius[body]",
            ),
        ),
    ),
)
