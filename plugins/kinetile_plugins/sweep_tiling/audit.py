"""Every invariant of the web, checked slowly, between two events.

Structure is checked exactly: links, ends, walks, pairs, certificates. Geometry is checked with the skin as
tolerance, because events of one moment leave tiles of no width in either order: what is thinner than a skin
is not looked at.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from kinetile.toolbox import NEVER, Kernel, positions_now

from .web import LOWER, OUTER, UPPER, State, is_left

__all__ = ["around", "audit", "ends", "tiles"]


def name(p: int, n: int) -> str:
    """Return a port in words."""
    side = "R" if p >> 3 & 1 else "L"
    port = ("outer", "upper", "lower")[p & 7]
    if p >> 4 == n:
        return f"{'left' if side == 'R' else 'right'} edge"
    return f"{side}({p >> 4}).{port}"


def tiles(s: State) -> list[int]:
    """Return the left ports of all tiles, 3n + 1 of them."""
    n = len(s.level)
    own = [16 * body + port for body in range(n) for port in (UPPER, LOWER, 8 + OUTER)]
    return [*own, 16 * n + 8 + OUTER]


def ends(s: State, p: int) -> tuple[int, int]:
    """Return (top, bottom) of the tile at a port, as that port's bound knows them."""
    bound, port, body = p & ~7, p & 7, p >> 4
    if port == OUTER:
        return int(s.web[bound + 4 + UPPER]), int(s.web[bound + 4 + LOWER])
    if port == UPPER:
        return int(s.web[bound + 4 + UPPER]), body
    return body, int(s.web[bound + 4 + LOWER])


def around(s: State, body: int) -> Iterator[int]:
    """Walk the tiles above a body, then those below, from left to right; yield their left ports."""
    for side in (UPPER, LOWER):
        p = 16 * body + side
        while True:
            yield p
            q = int(s.web[p])
            if q >> 4 == body:
                break
            # an L bound that stands on the body is left by its other inner port, an R bound by its outer
            p = (q & ~7) + 3 - side if q & 8 == 0 else (q & ~7) + OUTER


def audit(k: Kernel, s: State) -> Iterator[str]:
    """Yield a sentence for each invariant that does not hold."""
    n = len(s.level)
    every = tiles(s)
    broken = False
    for p in every:
        q = int(s.web[p])
        if int(s.web[q]) != p or not is_left(p) or is_left(q):
            back = name(int(s.web[q]), n)
            yield f"the tile at {name(p, n)} is linked to {name(q, n)}, which is linked to {back}"
            broken = True
        elif ends(s, p) != ends(s, q):
            views = f"{ends(s, p)} from its left, {ends(s, q)} from its right"
            yield f"the tile {name(p, n)} - {name(q, n)} lies between {views}"
            broken = True
    if len({int(s.web[p]) for p in every}) != 3 * n + 1:
        yield f"there are not {3 * n + 1} tiles"
        broken = True
    if broken:
        return  # the rest would walk in circles
    yield from _pairs(k, s, every)
    yield from _walks(s, every)
    yield from _certificates(k, s, every)
    yield from _geometry(k, s, every)


def _pairs(k: Kernel, s: State, every: list[int]) -> Iterator[str]:
    """The candidate pairs are the tops and bottoms of the tiles, each held once a tile, and few."""
    n = len(s.level)
    wanted: Counter[tuple[int, int]] = Counter()
    for p in every:
        top, bottom = ends(s, p)
        if top < n and bottom < n:
            wanted[min(top, bottom), max(top, bottom)] += 1
    live = k.certificates[k.certificates.a >= 0]
    held = {(int(r.a), int(r.b)): int(r.holds) for r in live}
    if held != dict(wanted):
        odd = sorted(set(held.items()) ^ set(wanted.items()))[0]
        times = f"{wanted.get(odd[0], 0)} times, the kernel {held.get(odd[0], 0)} times"
        yield f"the tiles have the pair {odd[0]} {times}"
    if n >= 3 and len(held) > 3 * n - 6:
        yield f"there are {len(held)} candidate pairs, more than 3n - 6 = {3 * n - 6}"


def _walks(s: State, every: list[int]) -> Iterator[str]:
    """The walk around a body finds exactly the tiles that it bounds from below and from above."""
    n = len(s.level)
    bounded: list[Counter[int]] = [Counter() for _ in range(n + 2)]
    for p in every:
        for body in ends(s, p):
            bounded[body][p] += 1
    for body in range(n):
        walked: Counter[int] = Counter()
        for p in around(s, body):
            walked[p] += 1
            if walked.total() > 6 * n + 6:
                break
        if walked != bounded[body]:
            yield f"the walk around body {body} does not find the tiles that it bounds"


def _certificates(k: Kernel, s: State, every: list[int]) -> Iterator[str]:
    """Every tile that narrows has a failure time, not past, and its owner is queued for its first."""
    n = len(s.level)
    now = int(k.clock[0].now)
    for p in every:
        q = int(s.web[p])
        a, b = p >> 4, q >> 4
        if n in (a, b) or a == b:
            continue
        due = int(s.due[4 * a + (p & 3)])
        if k.bodies[b].vx < k.bodies[a].vx and due == NEVER:
            left, right = _edge(k, p), _edge(k, q)
            speed = float(k.bodies[a].vx - k.bodies[b].vx)
            if (right - left) / speed * float(k.clock[0].per_time) < 2.0**60:
                yield f"the tile {name(p, n)} - {name(q, n)} narrows, and has no failure time"
        if due < now:
            yield f"the tile {name(p, n)} - {name(q, n)} failed {now - due} ticks ago"
    for body in range(n):
        first = int(s.due[4 * body : 4 * body + 3].min())
        place = int(k.certificates[body].place)
        queued = int(k.queue[place].tick) if place >= 0 else NEVER
        if queued != first:
            yield f"body {body} is queued for tick {queued}, but its first tile fails at {first}"


def _edge(k: Kernel, p: int) -> float:
    """Return where the bound of a port is now."""
    body = k.bodies[p >> 4]
    at = body.x + body.vx * ((k.clock[0].now - body.anchor) * k.clock[0].tick)
    return float(at + body.reach if p & 8 else at - body.reach)


def _geometry(k: Kernel, s: State, every: list[int]) -> Iterator[str]:
    """Tiles that are wider than the skin lie where they say they lie, with nothing between top and bottom."""
    n = len(s.level)
    if n == 0:
        return
    place = positions_now(k)
    reach: Any = k.bodies.reach
    thin = 4.0 * float((reach - k.bodies.radius).max())
    left_of, right_of = place[:, 0] - reach, place[:, 0] + reach
    level = np.concatenate([place[:, 1], [np.inf, -np.inf]])
    for p in every:
        q = int(s.web[p])
        left = -np.inf if p >> 4 == n else _edge(k, p)
        right = np.inf if q >> 4 == n else _edge(k, q)
        tile = f"the tile {name(p, n)} - {name(q, n)}"
        if right - left < -thin:
            yield f"{tile} is {left - right} wider than nothing to the wrong side"
            continue
        if right - left <= thin:
            continue
        top, bottom = ends(s, p)
        if not level[top] > level[bottom]:
            yield f"{tile} has body {top} as its top and body {bottom} as its bottom, which is not below"
        for end in (top, bottom):
            if end < n and (left_of[end] > left + thin or right_of[end] < right - thin):
                yield f"{tile} is wider than body {end}, which bounds it"
        middle = 0.5 * (max(left, float(left_of.min()) - 1.0) + min(right, float(right_of.max()) + 1.0))
        between = (left_of < middle - thin) & (right_of > middle + thin)
        between &= (place[:, 1] > level[bottom]) & (place[:, 1] < level[top])
        if between.any():
            yield f"{tile} has body {int(np.flatnonzero(between)[0])} between its top and its bottom"
