"""Audit of the web: every invariant, checked slowly, between two events.

Structure is checked exactly: links, ends, pairs and certificates. A sweep over the bounds, in an order that
the links themselves allow, must make the same tiling again. Geometry is checked up to the skin, because
events of one moment leave coinciding bounds in either order.

On a cylinder there is no first bound, so the sweep is skipped; links, ends, pairs and geometry are checked.

The invariants, with their numbers:

* I1: links are symmetric; I2: a link joins a left port to a right one; I3: both sides of a tile agree about
  its top and bottom, which covers all ends. Exactly.
* I4: no tile is narrower than -2 theta, unless it fails at this tick; from the positions when this tick ends.
* I5: there are 3n + 1 tiles, each port used once. Exactly.
* I6: the bodies named as near a body are exactly the bodies on the other side of its tiles.
* I7: no circle: a sweep in the order of the links, without any coordinate, makes the same tiling. Exactly.
* I8: on every vertical line the tiles are the gaps between the bodies that the line crosses. One line is
  checked between each two bounds with more than four skins between them, or eight while repairs are pending.
* I9: every tile is watched for its tick of failure by the plans of its bodies, by width or order, and every
  body is queued for the first of its tiles. Exactly: to the tick.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from kinetile.arrays import Flags, Floats, Integers
from kinetile.toolbox import NEVER, Kernel, Plan, falls_many, positions_after, positions_now, reaches_of

from .web import ENDS, FLIPS, LOWER, OUTER, UPPER, State, near

CELLS = 1 << 20
"""Bodies and tiles times vertical lines that are compared at a time: bounds the memory of an audit."""


class AllTiles(NamedTuple):
    """All tiles of m bodies, 3m + 1 in the order of their left ports; on a cylinder 3m."""

    left: Integers  # left ports
    right: Integers  # the ports linked to them
    top: Integers  # bodies above and below, by the ends of the left bounds
    bottom: Integers
    away: Floats  # the periods from the left bound to the right one, by the places in their bodies' plans
    there: Integers  # (m,) the bodies
    slots: int  # the number of the edges' body

    def name(self, tile: Any) -> str:
        """Returns a tile in words."""
        left, right = (_port(int(ports[tile]), self.slots) for ports in (self.left, self.right))
        return f"the tile {left} - {right}"


def _port(p: int, n: int) -> str:
    if not 0 <= p < 16 * (n + 1) or p & 7 > LOWER:
        return f"place {p}, which is no port"
    side = "R" if p >> 3 & 1 else "L"
    if p >> 4 == n:
        return f"{'left' if side == 'R' else 'right'} edge"
    return f"{side}({p >> 4}).{('outer', 'upper', 'lower')[p & 7]}"


def _ends(web: Integers, ports: Integers) -> tuple[Integers, Integers]:
    """Returns the bodies above and below the tiles at some ports, by the ends of these ports' bounds."""
    bound, port, body = ports & ~7, ports & 7, ports >> 4
    top = np.where(port == LOWER, body, web[bound + ENDS + UPPER])
    bottom = np.where(port == UPPER, body, web[bound + ENDS + LOWER])
    return top, bottom


def tiles_of(k: Kernel, s: State) -> AllTiles:
    """Returns all tiles; the tile of the left edge is the last."""
    n = len(s.level)
    web, there = s.web.astype(np.int64), np.flatnonzero(k.queue.number >= 0)
    own = 16 * there[:, None] + np.array([UPPER, LOWER, 8 + OUTER])
    if not len(s.turns):
        left = np.append(own.ravel(), 16 * n + 8 + OUTER)
        return AllTiles(left, web[left], *_ends(web, left), np.zeros(len(left)), there, n)
    left = own.ravel()
    right, taken_off = web[left], np.append(k.images.kx[:n], np.zeros(len(s.due)))
    turns = s.turns[left] + taken_off[right >> 4] - taken_off[left >> 4]
    return AllTiles(left, right, *_ends(web, left), turns * k.clock[0].torus.x, there, n)


def audit(k: Kernel, s: State) -> Iterator[str]:
    """Yields a sentence for each invariant that does not hold; O(n^2)."""
    tiles = tiles_of(k, s)
    broken = list(_links(s, tiles))
    yield from broken
    if broken:
        return  # the rest follows links
    yield from _pairs(k, s, tiles)
    if not len(s.turns):
        yield from _sweep(s, len(tiles.there))
    yield from _certificates(k, s, tiles)
    yield from _geometry(k, s, tiles)


def _links(s: State, tiles: AllTiles) -> Iterator[str]:
    """Yields each tile whose two links, or whose ends by its two bounds, do not agree."""
    n = len(s.level)
    web = s.web.astype(np.int64)
    left, right = tiles.left, tiles.right
    port = np.isin(right >> 4, tiles.there) & (right & 7 <= LOWER)
    port &= (right & 7 != OUTER) == (right & 8 != 0)
    port |= (right == 16 * n) & (not len(s.turns))
    there = np.where(port, right, 16 * n)
    top, bottom = _ends(web, there)
    linked = port & (web[there] == left)
    for tile in np.flatnonzero(~linked):
        back = f"linked to {_port(int(web[there[tile]]), n)}" if port[tile] else "no right port"
        yield f"{tiles.name(tile)}: its right port is {back}"
    known = np.isin(tiles.top, [*tiles.there, n]) & np.isin(tiles.bottom, [*tiles.there, n + 1])
    known &= tiles.top != tiles.bottom
    for tile in np.flatnonzero(linked & ~(known & (top == tiles.top) & (bottom == tiles.bottom))):
        one, two = (int(tiles.top[tile]), int(tiles.bottom[tile])), (int(top[tile]), int(bottom[tile]))
        yield f"{tiles.name(tile)} lies between {one} from its left, {two} from its right"
    if len(s.turns):
        for tile in np.flatnonzero(linked & (s.turns[there] != -s.turns[left])):
            yield f"{tiles.name(tile)} leads through other periods from its left than from its right"
    if len(np.unique(right)) != len(left):
        yield f"there are not {len(left)} tiles"


def _pairs(k: Kernel, s: State, tiles: AllTiles) -> Iterator[str]:
    n = len(s.level)
    both = (tiles.top < n) & (tiles.bottom < n)
    top, bottom = tiles.top[both], tiles.bottom[both]
    wanted = set(zip(np.append(top, bottom).tolist(), np.append(bottom, top).tolist(), strict=True))
    bodies = tiles.there.tolist()
    named = {(body, other) for body in bodies for other in k.near[: near(k, s, body)].tolist()}
    for body, other in sorted(wanted - named):
        yield f"bodies {body} and {other} bound a tile, and {other} is not named as near {body}"
    for body, other in sorted(named - wanted):
        yield f"body {other} is named as near {body}, and they bound no tile"


def _sweep(s: State, bodies: int) -> Iterator[str]:
    """Yields a circle of links, and the first difference of a sweep in their order from the tiling.

    A bound is swept when all tiles that end at it have begun, so no coordinate is read. Two lists have the
    bodies on the sweep line (the body above, the body below), a third the open left port of each gap.
    """
    n = len(s.level)
    web = s.web.tolist()
    above, below = [n] * (n + 2), [n + 1] * (n + 2)
    opened: list[int] = [-1] * (n + 2)  # the open left port above a body, or above BOTTOM
    opened[n + 1] = 16 * n + 8 + OUTER
    begun = [0] * (2 * n)
    ready = [web[16 * n + 8 + OUTER] >> 3]
    swept = 0
    while ready:
        bound = ready.pop()
        if bound == 2 * n:
            continue  # the right edge
        swept += 1
        body, at = bound >> 1, 8 * bound
        high, low = web[at + ENDS + UPPER], web[at + ENDS + LOWER]
        name = f"the sweep comes to {'R' if bound & 1 else 'L'}({body})"
        if bound & 1 == 0:
            if above[low] != high or below[high] != low or opened[low] != web[at + OUTER]:
                yield f"{name} in a gap between {(high, low)} that is not open there"
                return
            above[low] = below[high] = body
            above[body], below[body] = high, low
            opened[low], opened[body] = at + LOWER, at + UPPER
            begins: tuple[int, ...] = (at + LOWER, at + UPPER)
        else:
            if above[body] != high or below[body] != low:
                yield f"{name} between {(above[body], below[body])}, but its ends are {(high, low)}"
                return
            if opened[low] != web[at + LOWER] or opened[body] != web[at + UPPER]:
                yield f"{name}, where other tiles end than are linked to it"
                return
            above[low], below[high] = high, low
            opened[low] = at + OUTER
            begins = (at + OUTER,)
        for p in begins:
            right = web[p] >> 3
            if right == 2 * n:
                continue
            begun[right] += 1
            if begun[right] == (2 if right & 1 else 1):
                ready.append(right)
    if swept != 2 * bodies:
        yield f"the sweep comes to {swept} of {2 * bodies} bounds: the tiles lie in a circle"
    elif bodies and (above[n + 1] != n or opened[n + 1] != web[16 * n + OUTER]):
        yield "the sweep does not end with one open tile at the right edge"


def _certificates(k: Kernel, s: State, tiles: AllTiles) -> Iterator[str]:
    """Yields each tile that is not watched for its tick of failure by the plans of its bodies, and each body
    that is not queued for its first tile."""
    there = tiles.there
    now = int(k.clock[0].now)
    left = tiles.left[: 3 * len(there)]
    owner, slot = left >> 4, left & 3
    due = s.due[4 * owner + slot]
    wanted, flips = _failures(k, s, tiles)
    flip = s.web[left + FLIPS].astype(bool)
    for tile in np.flatnonzero(due < now):
        yield f"{tiles.name(tile)} failed {now - int(due[tile])} ticks ago"
    for tile in np.flatnonzero(due != wanted):
        times = [("never" if tick == NEVER else f"at tick {tick}") for tick in (wanted[tile], due[tile])]
        yield f"{tiles.name(tile)} fails {times[0]} by the plans of its bodies, but is watched {times[1]}"
    for tile in np.flatnonzero(flip != flips):
        kind = "order" if flips[tile] else "width"
        yield f"{tiles.name(tile)} fails by its {kind}, but is watched otherwise"
    first, queued = s.due.reshape(-1, 4).min(axis=1), np.asarray(k.queue.certificate)
    for body in there[queued[there] != first[there]]:
        yield f"body {body} is queued for tick {queued[body]}, but its first tile fails at {first[body]}"


def _failures(k: Kernel, s: State, tiles: AllTiles) -> tuple[Integers, Flags]:
    """Returns the tick at which each body's tile fails by the present plans; True if by vertical order."""
    clock, bodies, own = k.clock[0], k.bodies, slice(3 * len(tiles.there))
    p, q, away = tiles.left[own], tiles.right[own], tiles.away[own]
    fails = (q >> 4 != tiles.slots) & (q >> 4 != p >> 4)
    a, b = p >> 4, np.where(fails, q >> 4, p >> 4)
    since = np.maximum(bodies.anchor[a], bodies.anchor[b])
    flown = (clock.per_tick * (since - bodies.anchor[each]) for each in (a, b))
    a_place, b_place = map(positions_after, (Plan.of(bodies[a]), Plan.of(bodies[b])), flown)
    reach = reaches_of(k)
    a_reach, b_reach = (np.where(port & 8, reach[of, 1], -reach[of, 0]) for port, of in ((p, a), (q, b)))
    width = (b_place[:, 0] + b_reach) - (a_place[:, 0] + a_reach) + away
    rate = bodies.vx[b] - bodies.vx[a]
    due = np.where(fails, falls_many(k, since, width, rate), NEVER)
    over = np.where(p & 7 == LOWER, -1.0, 1.0)
    rise = over * (b_place[:, 1] - a_place[:, 1])
    climb = over * (bodies.vy[b] - bodies.vy[a])
    corner = fails & (p & 7 != OUTER) & (q & 7 != OUTER) & (climb < 0.0)
    then = width * -climb + rate * rise
    corner &= (s.limits[0] * climb <= then) & (then <= s.limits[1] * -climb)
    level = np.where(corner, falls_many(k, since, rise, climb), NEVER)
    return np.minimum(due, level), level < due


def _geometry(k: Kernel, s: State, tiles: AllTiles) -> Iterator[str]:
    """Yields each tile of negative width, and each that is not a gap between bodies on a vertical line."""
    clock = k.clock[0]
    pending = s.due[4 * (tiles.left >> 4) + (tiles.left & 3)] <= clock.now
    flown = np.column_stack([k.bodies.vx, k.bodies.vy]) * clock.per_tick
    place = positions_now(k) + flown  # events of this tick have happened: they are right at its end
    reach = reaches_of(k)
    west = np.append(place[:, 0] - reach[:, 0], np.inf)  # with the edges, the bounds of body n
    east = np.append(place[:, 0] + reach[:, 1], -np.inf)
    left = np.where(tiles.left & 8, east[tiles.left >> 4], west[tiles.left >> 4])
    right = np.where(tiles.right & 8, east[tiles.right >> 4], west[tiles.right >> 4]) + tiles.away
    for tile in np.flatnonzero((right - left < -2.0 * clock.limits.theta) & ~pending):
        wrong = left[tile] - right[tile]
        yield f"{tiles.name(tile)} is {wrong} wider than nothing to the wrong side, and does not fail now"
    thin = (8.0 if pending.any() else 4.0) * float(clock.limits.skin)
    # The tiles on a vertical line are the gaps between the bodies on it (I8).
    level, period = place[:, 1], float(clock.torus.x)
    n, there = tiles.slots, tiles.there
    west, east = west[there], east[there]
    edges = np.concatenate([west, east])
    edges = np.sort(np.append(edges % period, edges % period + period) if period else edges)
    lines = 0.5 * (edges[1:] + edges[:-1])[np.diff(edges) > thin]
    upward = there[np.argsort(level[there])]
    rows = max(CELLS // (3 * n + 1), 1)
    for first in range(0, len(lines), rows):
        line = lines[first : first + rows, None]
        crossed = np.ones((len(line), n + 2), dtype=bool)  # of edges and bodies
        crossed[:, there] = _between(west, line, east, period)
        rank = np.zeros((len(line), n + 2), dtype=np.int64)  # from bottom to top; BOTTOM has 0
        rank[:, upward] = np.cumsum(crossed[:, upward], axis=1)
        rank[:, n] = crossed[:, there].sum(axis=1) + 1
        over = _between(left, line, right, period)
        good = crossed[:, tiles.top] & crossed[:, tiles.bottom]
        good &= rank[:, tiles.top] == rank[:, tiles.bottom] + 1
        for row, tile in np.argwhere(over & ~good):
            ends = f"body {tiles.top[tile]} and body {tiles.bottom[tile]}"
            yield f"{tiles.name(tile)} at x = {line[row, 0]} is not the gap between {ends}"
        gap = np.arange(len(there) + 1)
        gaps = np.sort(np.where(over, rank[:, tiles.bottom], n + 1), axis=1)[:, : len(gap)]
        wanted = np.where(gap < rank[:, n, None], gap, n + 1)
        for row in np.flatnonzero((gaps != wanted).any(axis=1)):
            yield f"at x = {line[row, 0]} a gap between two bodies has no tile, or two"


def _between(left: Floats, line: Floats, right: Floats, period: float) -> Flags:
    """Returns True for lines, or images of them, between left and right."""
    if period:
        line = left + (line - left) % period
    return (left < line) & (line < right)
