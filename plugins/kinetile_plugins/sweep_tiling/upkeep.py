"""The certificates: a body owns the three tiles at its left ports, and has one certificate in the queue, for
the first of them to fail."""

from __future__ import annotations

from kinetile.kernel.vectors import eight, lane, spread_whole
from kinetile.toolbox import Kernel, hook, schedule, smaller

from .events import Tile, Tiles
from .watch import chosen, failures, sides, swapped
from .web import (
    LOWER,
    OUTER,
    UPPER,
    State,
    body_of,
    due_of,
    facing,
    left_bound,
    own_tile,
    port,
    right_bound,
    set_due,
)

__all__ = ["first_to_fail", "settle", "watch_around", "watch_tiles"]


@hook
def settle(k: Kernel, s: State, body: int) -> None:
    """Schedule a body's certificate for the first of its three tiles to fail."""
    first = smaller(due_of(s, body, OUTER), smaller(due_of(s, body, UPPER), due_of(s, body, LOWER)))
    schedule(k, body, first)


@hook
def first_to_fail(s: State, body: int) -> Tile:
    """Which of the three tiles that a body owns fails first."""
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


@hook
def watch_around(k: Kernel, s: State, body: int) -> None:
    """Watch the six tiles at a body's ports: the three that it owns, and those at its right ports."""
    outer = own_tile(body, OUTER)
    upper = own_tile(body, UPPER)
    lower = own_tile(body, LOWER)
    before = port(left_bound(body), OUTER)
    over_it = port(right_bound(body), UPPER)
    under_it = port(right_bound(body), LOWER)
    first = facing(s, before)
    second = facing(s, over_it)
    third = facing(s, under_it)
    own = sides(k, outer, upper, lower, lower, before, over_it, under_it, under_it)
    fourth = facing(s, outer)
    fifth = facing(s, upper)
    sixth = facing(s, lower)
    far = sides(k, fourth, fifth, sixth, sixth, first, second, third, third)
    mine = eight(1, 1, 1, 0, 0, 0, 0, 0) > spread_whole(0)
    asked = eight(1, 1, 1, 0, 1, 1, 1, 0) > spread_whole(0)
    tick, by_order = failures(k, s, chosen(mine, own, far), chosen(mine, far, own), asked)
    set_due(s, outer, lane(tick, 0), lane(by_order, 0))
    set_due(s, upper, lane(tick, 1), lane(by_order, 1))
    set_due(s, lower, lane(tick, 2), lane(by_order, 2))
    set_due(s, first, lane(tick, 4), lane(by_order, 4))
    set_due(s, second, lane(tick, 5), lane(by_order, 5))
    set_due(s, third, lane(tick, 6), lane(by_order, 6))
    if body_of(first) < len(s.level):  # it may be the left edge
        settle(k, s, body_of(first))
    settle(k, s, body_of(second))
    settle(k, s, body_of(third))
    settle(k, s, body)


@hook
def watch_tiles(k: Kernel, s: State, tiles: Tiles) -> None:
    """Watch three tiles, for the bodies that own them."""
    one, two, three = tiles
    left = sides(
        k, one.left, two.left, three.left, three.left, one.right, two.right, three.right, three.right
    )
    asked = eight(1, 1, 1, 0, 0, 0, 0, 0) > spread_whole(0)
    tick, by_order = failures(k, s, left, swapped(left), asked)
    set_due(s, one.left, lane(tick, 0), lane(by_order, 0))
    set_due(s, two.left, lane(tick, 1), lane(by_order, 1))
    set_due(s, three.left, lane(tick, 2), lane(by_order, 2))
    if body_of(one.left) < len(s.level):  # it may be the left edge
        settle(k, s, body_of(one.left))
    settle(k, s, body_of(two.left))
    settle(k, s, body_of(three.left))
