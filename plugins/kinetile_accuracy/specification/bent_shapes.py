"""Rules 5a, 7a and 11a of docs/specification.md, and 5t, 7t and 11t: accelerated bodies, in integers.

A *set* of whole n from a start on is a list of runs [low, high). Whether d(n) is beyond the line of a face,
over the face or nearest to a corner are signs of polynomials of n; where one of them is below 0 follows from
the places at which it changes its sign (``bent``). All else are intersections of such sets.

Nothing here is shared with the kernel.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

from kinetile_accuracy.specification import bent
from kinetile_accuracy.specification.arithmetic import PairQuadratic
from kinetile_accuracy.specification.bent import HORIZON, Polynomial
from kinetile_accuracy.specification.shapes import Difference, Exact, Face, dot, less, whole

Runs = list[tuple[int, int]]

Parabola = Sequence[Exact]
"""d(n), by its three coefficients: vectors."""


def bent_tick(m: Difference | None, course: PairQuadratic, met: bool, earliest: int) -> int | None:
    """Returns the tick of contact of two bodies of a scene with accelerations, not before the ``earliest``;
    None: none. ``m`` is the difference of their shapes, None of discs; ``met``: they have just met each
    other."""
    start = max(earliest - course.since, 0)
    if m is not None and len(m.corners) > 1:
        wait = contact(m, course.exact(), start, met)
    else:
        q = _quartic(m, course)
        again = bent.met_again_from(q) if met else 0
        wait = None if again is None else bent.first_fall(q, max(start, again))
    return None if wait is None else course.since + wait


def bent_parting_tick(m: Difference | None, course: PairQuadratic, begun: int) -> int | None:
    """Returns the tick at which two such bodies part that have ``begun`` to pass through each other."""
    start = max(begun - course.since, 0)
    if m is not None and len(m.corners) > 1:
        wait = parting(m, course.exact(), start)
    else:
        wait = bent.first_fall(_negated(_quartic(m, course)), start)
    return None if wait is None else course.since + wait


def _quartic(m: Difference | None, course: PairQuadratic) -> Polynomial:
    """Returns Q of rule 5a, of discs, or of shapes whose difference is a point."""
    return course.quartic() if m is None else _disc(m, m.corners[0], course.exact())


def contact(m: Difference, d: Parabola, start: int, met: bool) -> int | None:
    """Returns the first n from ``start`` on that is the contact of the place d(n) with a difference of more
    than one corner (rule 5t); None: none."""
    if met:
        again = _counts_from(m, d)
        if again is None:
            return None
        start = max(start, again)
    if m.radius:
        found = []
        for face in m.faces:
            within = [_below(_squared(face, d, m.radius), start), *_over(face, d, start)]
            found.append(_nearer(within, _beyond(face, d), start))
        for k, corner in enumerate(m.corners):
            q = _disc(m, corner, d)
            after, before = (_along(corner, way, d) for way in (m.ways[k], m.ways[k - 1]))
            beside = [_not_below(_negated(after), start), _not_below(before, start)]
            found.append(_nearer([_below(q, start), *beside], q, start))
        return min((each for each in found if each is not None and each < HORIZON), default=None)
    return _first_visit(m, d, start) if len(m.faces) > 2 else None


def parting(m: Difference, d: Parabola, start: int) -> int | None:
    """Returns the first n from ``start`` on at whose end d(n) is outside of M with its margin (rule 11t)."""
    runs: Runs = []
    if len(m.faces) > 2:
        runs += _all([_not_below(_negated(_beyond(face, d)), start) for face in m.faces])
    if m.radius:
        for face in m.faces:
            near = _not_below(_negated(_squared(face, d, m.radius)), start)
            runs += _all([near, *_over(face, d, start)])
        runs += [run for corner in m.corners for run in _not_below(_negated(_disc(m, corner, d)), start)]
    n = start + 1
    for low, high in sorted(runs):
        if low <= n < high:
            n = high
    return n - 1 if n - 1 < HORIZON else None


def _first_visit(m: Difference, d: Parabola, start: int) -> int | None:
    """Returns the contact where R = 0."""
    inside = _all([_below(_beyond(face, d), start) for face in m.faces])
    deep = _all([inside, *(_below(_negated(_squared(face, d, m.flush)), start) for face in m.faces)])
    for low, high in inside:
        if not _all([[(low, high)], deep]):
            continue
        if low > start:
            return low - 1 if low - 1 < HORIZON else None
        face = _nearest_face(m, _at(d, start))
        falls = _below(bent.differences(_beyond(face, d)), start)
        if falls and falls[0][0] + 1 < high:
            return falls[0][0]
    return None


def _nearer(within: Sequence[Runs], gap: Polynomial, start: int) -> int | None:
    """Returns the first n at whose end d is within all of some sets, and nearer by its gap than at n: over a
    face and within R of it, or nearest to a corner and within R."""
    ends = [(low - 1, high - 1) for low, high in _all(within)]
    runs = _all([ends, _below(bent.differences(gap), start)])
    return min((max(low, start) for low, high in runs if high > start), default=None)


def _counts_from(m: Difference, d: Parabola) -> int | None:
    """Returns from which n on two that have just met may meet again (rule 7t); None: from none on."""
    away = _away(m, d[0])
    rate, bend = dot(away, d[1]) + dot(away, d[2]), dot(away, d[2])
    if rate > 0 or bend < 0:
        return 0
    if bend == 0:
        return None
    n = math.floor(-rate / (2 * bend)) + 1  # rate + 2 bend n > 0
    return n if n <= HORIZON else None


def _away(m: Difference, here: Exact) -> Exact:
    """Returns the way out of M at the feature that is nearest to a place (rule 7t)."""
    if m.radius:
        for face in m.faces:
            along = dot(face.way, less(here, face.start))
            if dot(face.normal, less(here, face.start)) > 0 and 0 <= along <= dot(face.way, face.way):
                return face.normal
        inside = all(dot(face.normal, less(here, face.start)) <= 0 for face in m.faces)
        for k, corner in enumerate(m.corners) if not inside or len(m.corners) == 2 else ():
            away = less(here, corner)
            if dot(away, m.ways[k]) <= 0 <= dot(away, m.ways[k - 1]):
                return away
    return _nearest_face(m, here).normal


def _nearest_face(m: Difference, here: Exact) -> Face:
    """Returns the face with the largest g/|n|, of several the first."""

    def distance(face: Face) -> Fraction:
        gap = dot(face.normal, less(here, face.start))
        return gap * abs(gap) / dot(face.normal, face.normal)

    return max(m.faces, key=distance)


def _at(d: Parabola, n: int) -> Exact:
    return d[0][0] + n * (d[1][0] + n * d[2][0]), d[0][1] + n * (d[1][1] + n * d[2][1])


def _along(start: Exact, way: Exact, d: Parabola) -> Polynomial:
    """Returns way . (d - start) as a polynomial, times some positive number."""
    return whole([dot(way, less(d[0], start)), dot(way, d[1]), dot(way, d[2])])


def _beyond(face: Face, d: Parabola) -> Polynomial:
    """Returns g, as a polynomial."""
    return _along(face.start, face.normal, d)


def _over(face: Face, d: Parabola, start: int) -> list[Runs]:
    """Returns the sets in which d is over a face, on its outer side."""
    end = face.start[0] + face.way[0], face.start[1] + face.way[1]
    return [
        _not_below(_beyond(face, d), start),
        _not_below(_along(face.start, face.way, d), start),
        _not_below(_negated(_along(end, face.way, d)), start),
    ]


def _squared(face: Face, d: Parabola, width: Fraction) -> Polynomial:
    """Returns g^2 - width^2 n.n, as a polynomial."""
    g = [dot(face.normal, each) for each in (less(d[0], face.start), d[1], d[2])]
    return whole(_less_square(_square(g), width**2 * dot(face.normal, face.normal)))


def _disc(m: Difference, corner: Exact, d: Parabola) -> Polynomial:
    """Returns |d - corner|^2 - R^2, as a polynomial."""
    ways = less(d[0], corner), d[1], d[2]
    squares = [_square([way[axis] for way in ways]) for axis in range(2)]
    return whole(_less_square([x + y for x, y in zip(*squares, strict=True)], m.radius**2))


def _square(p: Sequence[Fraction]) -> list[Fraction]:
    a, b, c = p
    return [a * a, 2 * a * b, b * b + 2 * a * c, 2 * b * c, c * c]


def _less_square(p: list[Fraction], square: Fraction) -> list[Fraction]:
    return [p[0] - square, *p[1:]]


def _negated(p: Polynomial) -> Polynomial:
    return [-each for each in p]


def _below(p: Polynomial, start: int, is_below: bool = True) -> Runs:
    """Returns the set in which a polynomial is below 0, or is not, up to one after the horizon."""
    ends = [start, *bent.changes(p, start), HORIZON + 2]
    first = int((bent.value_at(p, start) < 0) != is_below)
    return [(ends[i], ends[i + 1]) for i in range(first, len(ends) - 1, 2)]


def _not_below(p: Polynomial, start: int) -> Runs:
    return _below(p, start, is_below=False)


def _all(sets: Sequence[Runs]) -> Runs:
    """Returns the intersection of sets."""
    found = sets[0]
    for other in sets[1:]:
        pairs = ((max(a, c), min(b, d)) for a, b in found for c, d in other)
        found = sorted((low, high) for low, high in pairs if low < high)
    return found
