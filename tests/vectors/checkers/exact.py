"""The tick of contact of two discs or convex shapes, exactly: rules 5 and 5s of kinetile's specification."""

from fractions import Fraction
from itertools import chain
from math import isqrt


def time_of_impact(e, a, b):
    """Returns the tick of contact of a and b, in ticks of 2^-(52 + e), or None. A body has its
    core's corners (a disc: its centre), its radius, its place, its velocity, and the tick of its place.

    This one is exact: lengths, and the way in a tick, are whole numbers of one size.
    """
    (core_a, ra, at_a, va, anchor_a), (core_b, rb, at_b, vb, anchor_b) = a, b
    extents = (r + max(map(abs, chain(*core))) for core, r in ((core_a, ra), (core_b, rb)))
    strip = 2.0**-39 * sum(extents)
    inner = (ra + rb) - strip
    lengths = max(
        z.as_integer_ratio()[1] for z in chain(*core_a, *core_b, (ra, rb, strip, inner), at_a, at_b)
    )
    size = max(lengths, max(z.as_integer_ratio()[1] for z in (*va, *vb)) << 52 + e)

    def whole(z, size=size):
        top, bottom = z.as_integer_ratio()
        return top * (size // bottom)

    since = max(anchor_a, anchor_b)
    pace_a, pace_b = ([whole(z, size >> 52 + e) for z in v] for v in (va, vb))
    here = zip(at_a, pace_a, at_b, pace_b, strict=True)
    d = [whole(y) + w * (since - anchor_b) - whole(x) - v * (since - anchor_a) for x, v, y, w in here]
    v = [w - v for v, w in zip(pace_a, pace_b, strict=True)]
    # b's place, relative to a's, meets the hull of all differences of corners, grown by r
    corners = hull({(whole(x) - whole(p), whole(y) - whole(q)) for x, y in core_a for p, q in core_b})
    # among whole n each condition on d holds in one run, and the first n in all runs is sought
    ways = list(map(less, corners[1:] + corners[:1], corners))
    faces = []
    for corner, way in zip(corners, ways, strict=True) if len(corners) > 1 else ():
        n, at = (way[1], -way[0]), less(d, corner)
        faces.append((dot(n, at), dot(n, v), dot(way, at), dot(way, v), dot(way, way)))
    inside = both(*(below(g, w) for g, w, *_ in faces)) if len(faces) > 2 else EMPTY

    def near(r):
        """Returns the n at which b's place comes nearer than r to a face, or, by falling, to a corner."""
        ticks = [inside[0] - 1] if 0 < inside[0] <= inside[1] else []
        for g, w, u, z, tt in faces:
            over = [below(-1 - g, -w), below(-1 - u, -z), below(u - tt - 1, z)]
            ticks += first(below(g - ceil_sqrt(r * r * tt), w), *over) if w < 0 else []
        for k, corner in enumerate(corners):
            at, after, before = less(d, corner), ways[k], ways[k - 1]
            c, b, a = dot(at, at) - r * r, dot(at, v), dot(v, v)
            beside = [below(dot(after, at) - 1, dot(after, v)), below(-1 - dot(before, at), -dot(before, v))]
            beside += [(low + 1, high + 1) for low, high in beside]  # a tick before, too
            ticks += first(disc_below(c, b, a), below(2 * b - a, 2 * a), *beside)
        return ticks

    if ra + rb:  # on a straight path, an approach to within ``inner`` is before the parting
        ticks = near(whole(ra) + whole(rb)) if not faces or inner <= 0 or near(whole(inner)) else []
    else:
        width = whole(strip)
        deep = both(inside, *(below(g + isqrt(width * width * tt), w) for g, w, *_, tt in faces))
        nearest = max((Fraction(g * abs(g), tt) for g, *_, tt in faces), default=None)
        falls = all(w < 0 for g, w, *_, tt in faces if Fraction(g * abs(g), tt) == nearest)
        visited = deep[0] <= deep[1] and (inside[0] > 0 or (falls and inside[1] > 0))
        ticks = [max(inside[0] - 1, 0)] if visited else []
    return since + min(ticks) if ticks and min(ticks) < FAR else None


FAR = 1 << 62
EMPTY = (1, 0)


def below(c, b):
    """Returns the first and the last n, from 0 on, with c + b n < 0."""
    if b == 0:
        return (0, FAR) if c < 0 else EMPTY
    return (max(c // -b + 1, 0), FAR) if b < 0 else (0, (-c - 1) // b)


def disc_below(c, b, a):
    """Returns the first and the last n, from 0 on, with c + 2 b n + a n^2 < 0."""
    m = b * b - a * c
    if a == 0 or m <= 0:
        return EMPTY  # a body at rest does not fall, either
    return max((-b - ceil_sqrt(m)) // a + 1, 0), -((b - ceil_sqrt(m)) // a) - 1


def both(*runs):
    return max(low for low, _ in runs), min(high for _, high in runs)


def first(*runs):
    """Returns [n], n + 1 being the first in all runs; [] without one."""
    low, high = both((1, FAR), *runs)
    return [low - 1] if low <= high else []


def less(a, b):
    return a[0] - b[0], a[1] - b[1]


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1]


def ceil_sqrt(m):
    return isqrt(m - 1) + 1 if m else 0


def hull(places):
    """Returns the corners of the hull, anticlockwise."""
    corners = []
    for ordered in (sorted(places), sorted(places, reverse=True)):
        chain = []
        for place in ordered:
            while len(chain) > 1 and turn(*chain[-2:], place) <= 0:
                chain.pop()
            chain.append(place)
        corners += chain[:-1]
    return corners or list(places)


def turn(p, q, r):
    return (q[0] - p[0]) * (r[1] - q[1]) - (q[1] - p[1]) * (r[0] - q[0])
