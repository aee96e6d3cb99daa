"""Certificates of the tiles: the tick at which each fails, and the queued certificate of each body.

A tile fails by its width, or, as a corner, by its vertical order. Eight tiles are computed at a time. All is
computed from the flight plans, at the later of the two anchors, as ``falls`` expects it: no tick depends on
the other tiles of its eight.

A body owns the three tiles at its left ports, and is in the queue for the first of them to fail.
"""

from typing import NamedTuple

from kinetile.toolbox import (
    Kernel,
    Records,
    falls_eight,
    hook,
    position_after,
    reach_to,
    schedule,
    smaller,
    unchecked,
)
from kinetile.toolbox.lanes import (
    Floats,
    Ticks,
    Truths,
    Wholes,
    choose,
    eight,
    flights,
    lane,
    some,
    spread,
    spread_whole,
    to_floats,
    turned,
)
from kinetile.toolbox.ticks import with_shapes

from .web import (
    LOWER,
    OUTER,
    UPPER,
    State,
    Tile,
    Tiles,
    body_of,
    due_of,
    facing,
    left_bound,
    own_tile,
    port,
    right_bound,
    set_due,
    turns_to,
)


class Sides(NamedTuple):
    """One side of eight tiles: ports, and the flight plans of their bodies."""

    port: Wholes
    body: Wholes
    x: Floats
    y: Floats
    vx: Floats
    vy: Floats
    anchor: Ticks
    edge: Floats  # the offset of the bound to the right of its body's centre


@hook
def some_body(k: Kernel, p: int) -> int:
    """Returns the body of a port; for an edge of the arena, the body in the last slot."""
    return int(smaller(body_of(p), k.clock[0].bodies - 1))


@hook
def edge_of(k: Kernel, p: int) -> float:
    """Returns the offset of a port's bound to the right of its body's centre."""
    side = (p >> 3) & 1
    reach = reach_to(k.bodies[some_body(k, p)], side, k.clock[0].limits.skin)
    return reach if side == 1 else -reach


@hook
def _edges_of_shapes(body: Records, k: Kernel, ports: Wholes, reach: Floats) -> Floats:
    edge = reach
    for i in range(8):
        which = eight(0, 1, 2, 3, 4, 5, 6, 7) == spread_whole(i)
        edge = choose(which, spread(edge_of(k, lane(ports, i))), edge)
    return edge


@with_shapes(_edges_of_shapes)
@hook
def edges(body: Records, k: Kernel, ports: Wholes, reach: Floats) -> Floats:
    """Returns the offsets of the bounds of eight ports to the right of their bodies' centres, by the reaches
    of the bodies. The first argument is any body."""
    is_left = (ports & spread_whole(8)) == spread_whole(0)
    return choose(is_left, spread(0.0) - reach, reach)


@hook
def sides(k: Kernel, a: int, b: int, c: int, d: int, e: int, f: int, g: int, h: int) -> Sides:
    """Returns the sides of eight ports; an edge of the arena has some body's plan."""
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
    edge = edges(k.bodies[0], k, port, reach)
    return Sides(port, port >> spread_whole(4), x, y, vx, vy, anchor, edge)


@hook
def swapped(one: Sides) -> Sides:
    """Returns the sides with the first four lanes and the last four exchanged."""
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
def periods(k: Kernel, s: State, p: int, q: int) -> int:
    """Returns the number of periods along a tile, between the places in the plans at its two sides."""
    return int(turns_to(s, p) + k.images[some_body(k, q)].kx - k.images[some_body(k, p)].kx)


@hook
def periods_between(k: Kernel, s: State, left: Wholes, right: Wholes) -> Floats:
    """Returns the lengths of the periods along eight tiles."""
    count = eight(
        periods(k, s, lane(left, 0), lane(right, 0)),
        periods(k, s, lane(left, 1), lane(right, 1)),
        periods(k, s, lane(left, 2), lane(right, 2)),
        periods(k, s, lane(left, 3), lane(right, 3)),
        periods(k, s, lane(left, 4), lane(right, 4)),
        periods(k, s, lane(left, 5), lane(right, 5)),
        periods(k, s, lane(left, 6), lane(right, 6)),
        periods(k, s, lane(left, 7), lane(right, 7)),
    )
    return to_floats(count) * spread(k.clock[0].torus.x)


@hook
def failures(k: Kernel, s: State, left: Sides, right: Sides, wanted: Truths) -> tuple[Ticks, Truths]:
    """Returns the ticks at which tiles fail, and True if by vertical order; NEVER for unwanted tiles."""
    zero = spread(0.0)
    border = spread_whole(len(s.level))
    unit = spread(k.clock[0].per_tick)
    since = choose(left.anchor < right.anchor, right.anchor, left.anchor)
    left_x, left_y = position_after(left, to_floats(since - left.anchor) * unit)
    right_x, right_y = position_after(right, to_floats(since - right.anchor) * unit)
    width = (right_x + right.edge) - (left_x + left.edge)
    if len(s.turns) > 0:
        width = width + periods_between(k, s, left.port, right.port)
    rate = right.vx - left.vx
    none = zero < zero
    wanted = choose((left.body == border) | (right.body == border) | (left.body == right.body), none, wanted)
    tick = falls_eight(k, since, choose(wanted, width, zero), choose(wanted, rate, zero))
    rise = right_y - left_y
    climb = right.vy - left.vy
    seven = spread_whole(7)
    outer = spread_whole(OUTER)
    under = (left.port & seven) == spread_whole(LOWER)  # the left body is the upper one
    rise = choose(under, zero - rise, rise)
    climb = choose(under, zero - climb, climb)
    then = width * (zero - climb) + rate * rise  # the width when they are level, times -climb
    corner = ((left.port & seven) > outer) & ((right.port & seven) > outer) & (climb < zero)
    corner = corner & (spread(s.limits[0]) * climb <= then) & (then <= spread(s.limits[1]) * (zero - climb))
    corner = corner & wanted
    by_order = none
    if some(corner):
        level = falls_eight(k, since, choose(corner, rise, zero), choose(corner, climb, zero))
        by_order = level < tick
        tick = choose(by_order, level, tick)
    return tick, by_order


@hook
def reschedule(k: Kernel, s: State, body: int) -> None:
    """Schedules a body's certificate for the first of its three tiles to fail."""
    first = smaller(due_of(s, body, OUTER), smaller(due_of(s, body, UPPER), due_of(s, body, LOWER)))
    schedule(k, body, first)


@hook
def first_to_fail(s: State, body: int) -> Tile:
    """Returns the first to fail of the three tiles that a body owns."""
    outer = own_tile(body, OUTER)
    upper = own_tile(body, UPPER)
    lower = own_tile(body, LOWER)
    p, q, due = outer, facing(s, outer), due_of(s, body, OUTER)
    other = facing(s, upper)
    sooner = due_of(s, body, UPPER) < due
    p, q, due = upper if sooner else p, other if sooner else q, due_of(s, body, UPPER) if sooner else due
    other = facing(s, lower)
    sooner = due_of(s, body, LOWER) < due
    return Tile(lower if sooner else p, other if sooner else q)


@unchecked
@hook
def watch_around(k: Kernel, s: State, body: int) -> None:
    """Watches the six tiles at a body's ports: its own three at left ports, and three at right ports."""
    outer = own_tile(body, OUTER)
    upper = own_tile(body, UPPER)
    lower = own_tile(body, LOWER)
    before = port(left_bound(body), OUTER)
    over_it = port(right_bound(body), UPPER)
    under_it = port(right_bound(body), LOWER)
    first = facing(s, before)
    second = facing(s, over_it)
    third = facing(s, under_it)
    fourth = facing(s, outer)
    fifth = facing(s, upper)
    sixth = facing(s, lower)
    left = sides(k, outer, upper, lower, lower, first, second, third, third)
    right = sides(k, fourth, fifth, sixth, sixth, before, over_it, under_it, under_it)
    wanted = eight(1, 1, 1, 0, 1, 1, 1, 0) > spread_whole(0)
    tick, by_order = failures(k, s, left, right, wanted)
    set_due(s, outer, lane(tick, 0), lane(by_order, 0))
    set_due(s, upper, lane(tick, 1), lane(by_order, 1))
    set_due(s, lower, lane(tick, 2), lane(by_order, 2))
    set_due(s, first, lane(tick, 4), lane(by_order, 4))
    set_due(s, second, lane(tick, 5), lane(by_order, 5))
    set_due(s, third, lane(tick, 6), lane(by_order, 6))
    if body_of(first) < len(s.level):  # it may be the left edge
        reschedule(k, s, body_of(first))
    reschedule(k, s, body_of(second))
    reschedule(k, s, body_of(third))
    reschedule(k, s, body)


@hook
def watch_tiles(k: Kernel, s: State, tiles: Tiles) -> None:
    """Watches three tiles, for the bodies that own them."""
    one, two, three = tiles
    left = sides(
        k, one.left, two.left, three.left, three.left, one.right, two.right, three.right, three.right
    )
    wanted = eight(1, 1, 1, 0, 0, 0, 0, 0) > spread_whole(0)
    tick, by_order = failures(k, s, left, swapped(left), wanted)
    set_due(s, one.left, lane(tick, 0), lane(by_order, 0))
    set_due(s, two.left, lane(tick, 1), lane(by_order, 1))
    set_due(s, three.left, lane(tick, 2), lane(by_order, 2))
    if body_of(one.left) < len(s.level):  # it may be the left edge
        reschedule(k, s, body_of(one.left))
    reschedule(k, s, body_of(two.left))
    reschedule(k, s, body_of(three.left))
