"""Audit of the triangulation: every invariant, checked slowly, between two events.

Structure is checked exactly: twins, turns around each site, ticks and their owners. Places are checked up to
what the certificates allow: no triangle is turned over, and no site is more than theta below the plane of a
triangle beside it, now and at times up to the tick at which its edge is said to fail.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.toolbox import NEVER, Kernel, positions_now

from .certificates import NOISE
from .web import CORNERS, PER_LENGTH, THETA, UNIT, State, far_points, slots

Integers = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

TIMES = 12
"""Times at which a certificate is computed again, from now to its tick."""


class Web(NamedTuple):
    """All half-edges that are used, with the four sites of the edge of each; d is NOBODY at the hull."""

    h: Integers
    twin: Integers
    a: Integers
    b: Integers
    c: Integers
    d: Integers

    def name(self, i: Any) -> str:
        """Returns an edge in words."""
        return f"the edge from site {self.a[i]} to {self.b[i]}"

    def owned(self, n: int) -> npt.NDArray[np.bool_]:
        """Returns which of them begin at the owner of their edge, of n slots for bodies."""
        return np.asarray((self.a < n) & (self.a < self.b))


def web_of(s: State) -> Web:
    """Returns all half-edges that are used; no number in it is beyond the end of a table."""
    h = np.flatnonzero(s.org >= 0)
    after, before = np.where(h & 3 == 2, h - 2, h + 1), np.where(h & 3 == 0, h + 2, h - 1)
    twin = s.twin[h].astype(np.int64)
    g = np.where((twin < len(s.org)) & (twin >= 0), twin, h)
    d = np.where(twin < 0, -1, s.org[np.where(g & 3 == 0, g + 2, g - 1)])
    a, b, c = (s.org[each].astype(np.int64) for each in (h, after, before))
    return Web(h, twin, a, b, c, d)


def audit(k: Kernel, s: State) -> Iterator[str]:
    """Yields a sentence for each invariant that does not hold."""
    web = web_of(s)
    broken = list(_structure(k, s, web))
    yield from broken
    if not broken:  # the rest follows links
        yield from _ticks(k, s, web)
        yield from _places(k, s, web)


def _structure(k: Kernel, s: State, web: Web) -> Iterator[str]:
    """Triangles of bodies that are there, glued edge to edge, once around each."""
    n = slots(s)
    there = np.flatnonzero(k.queue.number[:n] >= 0)
    sites = np.append(there, np.arange(n, n + CORNERS))
    if len(web.h) != 3 * (2 * len(there) + 2) or (np.bincount(web.h >> 2) % 3).any():
        yield f"there are {len(web.h)} half-edges in use, and {6 * len(there) + 6} for {len(there)} bodies"
        return
    for i in np.flatnonzero(~np.isin(web.a, sites)):
        yield f"a triangle has a corner {web.a[i]}, where no body is"
    hull = (web.a >= n) & (web.b >= n) & ((web.b - web.a) % CORNERS == 1)
    row = np.full(len(s.org), -1)
    row[web.h] = np.arange(len(web.h))
    back = row[np.where((web.twin >= 0) & (web.twin < len(s.org)), web.twin, web.h)]
    glued = (back >= 0) & (web.a[back] == web.b) & (web.b[back] == web.a) & (web.twin[back] == web.h)
    for i in np.flatnonzero(~np.where(hull, web.twin == -1, glued)):
        yield f"{web.name(i)} is not glued to another triangle: its twin is {web.twin[i]}"
        return
    begins = np.bincount(web.a, minlength=n + CORNERS)
    for site in there.tolist():
        begin = h = int(s.first[site])
        turned = 0
        while s.org[h] == site and turned <= begins[site]:
            h = int(s.twin[h - 1 if h & 3 else h + 2])
            turned += 1
            if h == begin:
                break
        if s.org[h] != site or turned != begins[site]:
            yield f"a turn around body {site} comes to {turned} of its {begins[site]} edges"


def _ticks(k: Kernel, s: State, web: Web) -> Iterator[str]:
    """Each edge is watched at one of its half-edges, and its owner is queued for the first of its own."""
    n = slots(s)
    due = s.due[web.h]
    for i in np.flatnonzero(~web.owned(n) & (due != NEVER)):
        yield f"{web.name(i)} is watched for a body that does not own it"
    for i in np.flatnonzero(due < k.clock[0].now):
        yield f"{web.name(i)} failed {k.clock[0].now - due[i]} ticks ago"
    soonest = np.full(n + CORNERS, NEVER)
    np.minimum.at(soonest, web.a, due)
    for body in np.flatnonzero(k.queue.number[:n] >= 0):
        for said, tick in (("notes", s.soonest[body]), ("is queued for", k.queue[body].own)):
            if tick != soonest[body]:
                yield f"body {body} {said} tick {tick}, and its first edge fails at {soonest[body]}"


def _places(k: Kernel, s: State, web: Web) -> Iterator[str]:
    """No triangle is turned over, and certificates hold until their ticks."""
    n, scale, clock = slots(s), s.scale, k.clock[0]
    there = np.flatnonzero(k.queue.number[:n] >= 0)
    place, speed, weight = np.zeros((n + CORNERS, 2)), np.zeros((n + CORNERS, 2)), np.zeros(n + CORNERS)
    place[there] = positions_now(k)[there] * scale[PER_LENGTH]
    speed[there] = np.column_stack([k.bodies.vx, k.bodies.vy])[there] * scale[PER_LENGTH] * scale[UNIT]
    weight[there] = (k.bodies.reach[there] * scale[PER_LENGTH]) ** 2
    place[n:] = far_points(s)
    for body in there[s.weight[there] != weight[there]]:
        yield f"body {body} has a weight of {s.weight[body]} instead of {weight[body]}"
    first = web.h & 3 == 0
    area = _area(place + speed * 2.0**-52, web)
    for i in np.flatnonzero(first & (area < -NOISE)):
        yield f"the triangle of {web.a[i]}, {web.b[i]} and {web.c[i]} is turned over by {-area[i]:.3g}"
    watched = np.flatnonzero(web.owned(n))
    edges = Web(*(column[watched] for column in web))
    due = s.due[edges.h]
    sites = np.column_stack([edges.a, edges.b, edges.c, edges.d])
    anchor = np.append(k.bodies.anchor[:n], np.full(CORNERS, -(2**62)))[sites].max(axis=1)
    age = (clock.now - anchor) * 2.0**-52  # a certificate is not older, and good for 1,024 units
    ahead = np.minimum((due - clock.now) * 2.0**-52, 1024.0 - age)
    for share in np.linspace(0.0, 1.0, TIMES):
        elapsed = np.maximum(share * ahead * (1.0 - 2.0**-20), 2.0**-52)
        depth, size = _depth(place, speed, weight, edges, elapsed)
        rounding = _rounding(place, speed, edges, elapsed + 2.0 * age)
        for i in np.flatnonzero((depth > scale[THETA] * size + rounding) & (due > clock.now)):
            yield (
                f"site {edges.d[i]} is {depth[i] / size[i]:.3g} below the plane of {edges.a[i]}, "
                f"{edges.b[i]} and {edges.c[i]}, {elapsed[i]:.3g} units from now, and {scale[THETA]:.3g} are "
                "allowed; their edge does not fail before"
            )
            return


def _area(place: Floats, web: Web) -> Floats:
    """Returns twice the areas of triangles."""
    one, two = place[web.b] - place[web.a], place[web.c] - place[web.a]
    return np.asarray(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])


def _rows(place: Floats, speed: Floats, edges: Web, elapsed: Floats) -> list[Floats]:
    """Returns the places of b, c and d relative to a, at a time for each edge."""
    a = place[edges.a] + speed[edges.a] * elapsed[:, None]
    return [place[each] + speed[each] * elapsed[:, None] - a for each in (edges.b, edges.c, edges.d)]


def _depth(
    place: Floats, speed: Floats, weight: Floats, edges: Web, elapsed: Floats
) -> tuple[Floats, Floats]:
    """Returns how deep d is below the plane of a, b and c, times twice their area; and that."""
    rows = _rows(place, speed, edges, elapsed)
    sites = (edges.b, edges.c, edges.d)
    b, c, d = (
        (x, y, x * x + y * y - weight[site] + weight[edges.a])
        for (x, y), site in zip((row.T for row in rows), sites, strict=True)
    )
    size = b[0] * c[1] - b[1] * c[0]
    turned = b[2] * (c[0] * d[1] - c[1] * d[0]) + c[2] * (d[0] * b[1] - d[1] * b[0]) + d[2] * size
    return -turned, size


def _rounding(place: Floats, speed: Floats, edges: Web, elapsed: Floats) -> Floats:
    """Returns what rounding may make of a depth, times twice the area: of plans, and of certificates."""
    b, c, d = (
        np.abs(place[each] - place[edges.a]).sum(axis=1)
        + np.abs(speed[each] - speed[edges.a]).sum(axis=1) * elapsed
        + 2.0**-40
        for each in (edges.b, edges.c, edges.d)
    )
    return np.asarray(2.0 * NOISE * (b * c * d * (b + c + d + 1.0)))
