"""The time of impact of two discs or convex shapes, exactly: rules 5 and 5s of kinetile's specification."""

from fractions import Fraction
from itertools import chain
from math import floor, isqrt


def time_of_impact(e, a, b):
    """Return when a and b begin to touch, in ticks of 2^-(52 + e), or None. A body has the corners of its
    core (a disc: its centre), its radius, its place, its velocity, and the tick at which it is there.

    This one is exact: lengths, and what is flown in a tick, are whole numbers of one size.
    """
    (core_a, ra, at_a, va, anchor_a), (core_b, rb, at_b, vb, anchor_b) = a, b
    extents = (r + max(map(abs, chain(*core))) for core, r in ((core_a, ra), (core_b, rb)))
    strip = 2.0**-39 * sum(extents)
    lengths = max(z.as_integer_ratio()[1] for z in chain(*core_a, *core_b, (ra, rb, strip), at_a, at_b))
    size = max(lengths, max(z.as_integer_ratio()[1] for z in (*va, *vb)) << 52 + e)

    def whole(z, size=size):
        top, bottom = z.as_integer_ratio()
        return top * (size // bottom)

    since = max(anchor_a, anchor_b)
    pace_a, pace_b = ([whole(z, size >> 52 + e) for z in v] for v in (va, vb))
    here = zip(at_a, pace_a, at_b, pace_b, strict=True)
    d = [whole(y) + w * (since - anchor_b) - whole(x) - v * (since - anchor_a) for x, v, y, w in here]
    v, r = [w - v for v, w in zip(pace_a, pace_b, strict=True)], whole(ra) + whole(rb)
    # b's place, seen from a's, flies past the hull of all differences of corners, grown by r
    corners = hull({(whole(x) - whole(p), whole(y) - whole(q)) for x, y in core_a for p, q in core_b})
    # who leaves all of it on one side of the way, but for a strip, does not meet it
    beyond = signed_square((whole(strip) if corners[1:] else 0) - r) * dot(v, v)
    sides = [(d[0] - x) * v[1] - (d[1] - y) * v[0] for x, y in corners]
    if not max(map(signed_square, sides)) > beyond < -min(map(signed_square, sides)):
        return None
    faces = []  # g, u: the place across and along it; w, z: how they grow; t.t: the square of its length
    for (x, y), (p, q) in zip(corners, corners[1:] + corners[:1], strict=True) if corners[1:] else ():
        n, t, at = (q - y, x - p), (p - x, q - y), (d[0] - x, d[1] - y)
        faces.append((dot(n, at), dot(t, at), dot(n, v), dot(t, v), dot(t, t)))
    if faces and all(g <= 0 and (len(faces) > 2 or 0 <= u <= tt) for g, u, _, _, tt in faces):
        depths = [(Fraction(g * g, tt), w) for g, _, w, _, tt in faces]
        return since if all(w < 0 for depth, w in depths if depth == min(depths)[0]) else None
    discs = [(dot(at, at) - r * r, dot(at, v)) for at in ((d[0] - x, d[1] - y) for x, y in corners)]
    over = [(g * g - r * r * tt, w) for g, u, w, _, tt in faces if g > 0 and 0 <= u <= tt]
    gap, growth = over[0] if over else min(discs)
    if gap <= 0:
        return since if growth < 0 else None
    times = []
    if r:
        vv = dot(v, v)
        roots = [(-B, B * B - vv * Q) for Q, B in discs if B < 0]
        times += [(p - ceil_sqrt(m)) // vv for p, m in roots if m > 0]
        for g, u, w, z, tt in faces:
            # it comes to within r of the line where -w u is c - z sqrt(m)
            m, c = r * r * tt, z * g - u * w
            over = signed_square(c + tt * w) <= signed_square(z) * m <= signed_square(c)
            if w < 0 < g and g * g > m and over:
                times.append((g - ceil_sqrt(m)) // -w)
    elif len(faces) > 2 and any(f[2] < 0 for f in faces) and all(w or g < 0 for g, _, w, _, _ in faces):
        enters = max(Fraction(g, -w) for g, _, w, _, _ in faces if w < 0)
        if enters >= 0 and all(enters < Fraction(-g, w) for g, _, w, _, _ in faces if w > 0):
            times.append(floor(enters))
    return since + min(times) if times and min(times) < 1 << 62 else None


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1]


def signed_square(a):
    return a * abs(a)


def ceil_sqrt(m):
    return isqrt(m - 1) + 1 if m else 0


def hull(places):
    """Return the corners of the hull, anticlockwise."""
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
