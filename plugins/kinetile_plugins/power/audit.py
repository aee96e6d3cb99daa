"""Audit of the triangulation: every invariant, checked slowly, between two events.

Structure is checked exactly: twins, turns around each site, ticks and their owners. Places are checked up to
the tolerance of the certificates: no triangle is turned over, and no site is more than theta below the plane
of a triangle beside it, now and at times up to the noted tick of its edge.
"""

from collections.abc import Iterator

import numpy as np

from kinetile.arrays import Integers
from kinetile.toolbox import NEVER, NOBODY, Kernel, Plan, positions_after, positions_now

from .certificates import NOISE
from .web import CORNERS, PER_LENGTH, THETA, UNIT, State, slots, succ


def audit(k: Kernel, s: State) -> Iterator[str]:
    """Yields a sentence for each invariant that does not hold."""
    there = np.flatnonzero(k.queue.number[: slots(s)] >= 0)
    h = np.flatnonzero(s.org >= 0)
    after, before = np.where(h & 3 == 2, h - 2, h + 1), np.where(h & 3 == 0, h + 2, h - 1)
    a, b, c = s.org[h], s.org[after], s.org[before]
    broken = list(_structure(s, there, h, a, b))
    yield from broken
    if broken:
        return  # the rest follows links
    owned = np.flatnonzero((a < slots(s)) & (a < b))
    d = s.org[before[np.searchsorted(h, s.twin[h[owned]])]]
    yield from _ticks(k, s, there, h, h[owned])
    yield from _places(k, s, there, h[owned], np.column_stack([a[owned], b[owned], c[owned], d]))


def _edge(s: State, h: int) -> str:
    return f"the edge from site {s.org[h]} to {s.org[succ(h)]}"


def _structure(s: State, there: Integers, h: Integers, a: Integers, b: Integers) -> Iterator[str]:
    """Yields faults of the triangles: corners are present bodies, edges are glued, turns are closed."""
    n, twin = slots(s), s.twin[h]
    if len(h) != 6 * len(there) + 6 or (np.bincount(h >> 2) % 3).any():
        yield f"there are {len(h)} half-edges in use, and {6 * len(there) + 6} for {len(there)} bodies"
        return
    for stranger in np.setdiff1d(a, [*there, *range(n, n + CORNERS)]):
        yield f"a triangle has a corner {stranger}, where no body is"
    hull = (a >= n) & (b >= n) & ((b - a) % CORNERS == 1)
    back = np.searchsorted(h, twin) % len(h)
    glued = (h[back] == twin) & (twin[back] == h) & (a[back] == b) & (b[back] == a)
    for i in np.flatnonzero(~np.where(hull, twin == NOBODY, glued)):
        yield f"{_edge(s, h[i])} is not glued to another triangle: its twin is {twin[i]}"
        return
    begins = np.bincount(a, minlength=n)
    for site in there.tolist():
        begin = g = int(s.first[site])
        turned = 0
        while s.org[g] == site and turned <= begins[site]:
            g = int(s.twin[g - 1 if g & 3 else g + 2])
            turned += 1
            if g == begin:
                break
        if s.org[g] != site or turned != begins[site]:
            yield f"a turn around body {site} comes to {turned} of its {begins[site]} edges"


def _ticks(k: Kernel, s: State, there: Integers, h: Integers, owned: Integers) -> Iterator[str]:
    """Yields each edge that is watched at a wrong half-edge, and each owner with a wrong queue entry."""
    due, now = s.due[h], k.clock[0].now
    for each in np.setdiff1d(h[due != NEVER], owned):
        yield f"{_edge(s, each)} is watched for a body that does not own it"
    for each in h[due < now]:
        yield f"{_edge(s, each)} failed {now - s.due[each]} ticks ago"
    soonest = np.full(len(s.first), NEVER)
    np.minimum.at(soonest, s.org[h], due)
    for body in there[k.queue.certificate[there] != soonest[there]]:
        queued = k.queue[body].certificate
        yield f"body {body} is queued for tick {queued}, its first edge fails at {soonest[body]}"


def _places(k: Kernel, s: State, there: Integers, h: Integers, sites: Integers) -> Iterator[str]:
    """Yields each triangle that is turned over, and a certificate that does not hold until its tick."""
    scale, now = s.scale, k.clock[0].now
    place, speed = np.column_stack([s.far_x, s.far_y]), np.zeros((len(s.first), 2))
    anchor, weight = np.full(len(s.first), -(2**62)), np.zeros(len(s.first))
    place[there] = positions_now(k)[there] * scale[PER_LENGTH]
    speed[there] = np.column_stack([k.bodies.vx, k.bodies.vy])[there] * scale[PER_LENGTH] * scale[UNIT]
    anchor[there] = k.bodies.anchor[there]
    weight[there] = (k.bodies.reach[there] * scale[PER_LENGTH]) ** 2
    for body in there[s.weight[there] != weight[there]]:
        yield f"body {body} has a weight of {s.weight[body]} instead of {weight[body]}"
    age = (now - anchor[sites].max(axis=1)) * 2.0**-52  # a certificate is not older, and good for 1,024 units
    ahead = np.minimum((s.due[h] - now) * 2.0**-52, 1024.0 - age)
    fast = np.abs(speed[sites[:, 1:]] - speed[sites[:, :1]]).sum(axis=2)
    for share in np.linspace(0.0, 1.0, 12):
        elapsed = np.maximum(share * ahead * (1.0 - 2.0**-20), 2.0**-52)
        at = positions_after(Plan.of_vectors(place[sites], speed[sites]), elapsed[:, None])
        rows = at[:, 1:] - at[:, :1]
        height = (rows**2).sum(axis=2) - weight[sites[:, 1:]] + weight[sites[:, :1]]
        area, depth = np.linalg.det(rows[:, :2]), -np.linalg.det(np.dstack([rows, height]))
        size = np.abs(rows).sum(axis=2) + fast * (elapsed + 2.0 * age)[:, None] + 2.0**-40
        rounding = 2.0 * NOISE * size.prod(axis=1) * (size.sum(axis=1) + 1.0)  # of plans, and of certificates
        for i in np.flatnonzero(area < -NOISE) if share == 0.0 else ():
            yield f"the triangle of {sites[i, :3]} is turned over by {-area[i]:.3g}"
        for i in np.flatnonzero((depth > scale[THETA] * area + rounding) & (s.due[h] > now)):
            yield (
                f"site {sites[i, 3]} is {depth[i] / area[i]:.3g} below the plane of {sites[i, :3]}, "
                f"{elapsed[i]:.3g} units from now and before their edge fails; {scale[THETA]:.3g} are allowed"
            )
            return
