"""When tiles fail: by their width, or a corner by its vertical order. Eight tiles at a time.

All is computed from the flight plans, at the later of the two anchors, as ``falls`` asks for it: no tick
depends on which tiles are watched together.
"""

from __future__ import annotations

from typing import NamedTuple

from kinetile.kernel.vectors import (
    Floats,
    Ticks,
    Truths,
    Wholes,
    choose,
    eight,
    flights,
    some,
    spread,
    spread_whole,
    to_floats,
    turned,
)
from kinetile.toolbox import Kernel, falls_eight, hook, smaller

from .web import LOWER, OUTER, State, body_of

__all__ = ["Sides", "chosen", "failures", "sides", "swapped"]


class Sides(NamedTuple):
    """One side of eight tiles: ports, and the flight plans of their bodies."""

    port: Wholes
    body: Wholes
    x: Floats
    y: Floats
    vx: Floats
    vy: Floats
    anchor: Ticks
    edge: Floats  # how far right of its body's centre the bound is


@hook
def some_body(k: Kernel, p: int) -> int:
    """The body of a port; of an edge of the arena, the body in the last slot."""
    return int(smaller(body_of(p), k.clock[0].bodies - 1))


@hook
def sides(k: Kernel, a: int, b: int, c: int, d: int, e: int, f: int, g: int, h: int) -> Sides:
    """Return the sides of eight ports; an edge of the arena has some body's plan."""
    x, y, vx, vy, anchor, reach = flights(
        k.bodies,
        some_body(k, a),
        some_body(k, b),
        some_body(k, c),
        some_body(k, d),
        some_body(k, e),
        some_body(k, f),
        some_body(k, g),
        some_body(k, h),
    )
    port = eight(a, b, c, d, e, f, g, h)
    is_left = (port & spread_whole(8)) == spread_whole(0)
    edge = choose(is_left, spread(0.0) - reach, reach)
    return Sides(port, port >> spread_whole(4), x, y, vx, vy, anchor, edge)


@hook
def swapped(one: Sides) -> Sides:
    """Return the sides with the first four lanes and the last four exchanged."""
    return Sides(
        turned(one.port, 4),
        turned(one.body, 4),
        turned(one.x, 4),
        turned(one.y, 4),
        turned(one.vx, 4),
        turned(one.vy, 4),
        turned(one.anchor, 4),
        turned(one.edge, 4),
    )


@hook
def chosen(where: Truths, yes: Sides, no: Sides) -> Sides:
    """Return ``yes`` in the lanes where it is true, else ``no``."""
    return Sides(
        choose(where, yes.port, no.port),
        choose(where, yes.body, no.body),
        choose(where, yes.x, no.x),
        choose(where, yes.y, no.y),
        choose(where, yes.vx, no.vx),
        choose(where, yes.vy, no.vy),
        choose(where, yes.anchor, no.anchor),
        choose(where, yes.edge, no.edge),
    )


@hook
def failures(k: Kernel, s: State, left: Sides, right: Sides, asked: Truths) -> tuple[Ticks, Truths]:
    """Return when tiles fail, and whether by their vertical order; where it is not asked, never."""
    zero = spread(0.0)
    nobody = spread_whole(len(s.level))
    unit = spread(k.clock[0].tick)
    since = choose(left.anchor < right.anchor, right.anchor, left.anchor)
    left_time = to_floats(since - left.anchor) * unit
    right_time = to_floats(since - right.anchor) * unit
    width = (right.x + right.vx * right_time + right.edge) - (left.x + left.vx * left_time + left.edge)
    rate = right.vx - left.vx
    none = zero < zero
    asked = choose((left.body == nobody) | (right.body == nobody) | (left.body == right.body), none, asked)
    tick = falls_eight(k, since, choose(asked, width, zero), choose(asked, rate, zero))
    rise = (right.y + right.vy * right_time) - (left.y + left.vy * left_time)
    climb = right.vy - left.vy
    seven = spread_whole(7)
    outer = spread_whole(OUTER)
    under = (left.port & seven) == spread_whole(LOWER)  # the left body is the upper one
    rise = choose(under, zero - rise, rise)
    climb = choose(under, zero - climb, climb)
    then = width * (zero - climb) + rate * rise  # the width when they are level, times -climb
    corner = ((left.port & seven) > outer) & ((right.port & seven) > outer) & (climb < zero)
    corner = corner & (spread(s.limits[0]) * climb <= then) & (then <= spread(s.limits[1]) * (zero - climb))
    corner = corner & asked
    by_order = none
    if some(corner):
        level = falls_eight(k, since, choose(corner, rise, zero), choose(corner, climb, zero))
        by_order = level < tick
        tick = choose(by_order, level, tick)
    return tick, by_order
