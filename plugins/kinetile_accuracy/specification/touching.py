"""Rules 5, 7 and 11 of docs/specification.md, and 5s, 7s and 11s: the ticks of contact and of parting.

Signs of polynomials of whole n (``signs``) decide all cases: d(n) beyond the line of a face, over the face,
or beside a corner, and its approach. Lengths are integers, as in ``arithmetic``.

Nothing here is shared with the kernel.
"""

from collections.abc import Iterable, Sequence
from fractions import Fraction

from kinetile_accuracy.specification.arithmetic import Separation, Whole
from kinetile_accuracy.specification.shapes import Difference, Face, dot, less
from kinetile_accuracy.specification.signs import (
    HORIZON,
    Polynomial,
    a_tick_later,
    both,
    counts_from,
    differences,
    first_fall,
    negated,
    where,
)

Path = Sequence[Whole]
"""d(n) by its three coefficients, which are vectors."""


def touching_tick(
    m: Difference | None, flight: Separation, met: bool = False, earliest: int | None = None
) -> int | None:
    """Returns the tick of contact of two bodies, not before the ``earliest``; None: no contact. ``m`` is the
    difference of their shapes, None for discs; ``met``: they have just met each other."""
    if met and flight.ways[2] == (0, 0):
        return None
    start = 0 if earliest is None else max(earliest - flight.since, 0)
    if m is None or len(m.corners) == 1:
        q = _gap(m, flight)
        again = counts_from([q]) if met else 0
        wait = None if again is None else first_fall(q, max(start, again))
    else:
        m, d = _in_one_unit(m, flight)
        again = counts_from([_along(d, e) for e in _outward(m, d[0])]) if met else 0
        wait = None if again is None else _contact(m, d, max(start, again))
    return None if wait is None else flight.since + wait


def parting_tick(m: Difference | None, flight: Separation, begun: int) -> int | None:
    """Returns the parting tick of two bodies that have passed through each other since ``begun``, or None."""
    start = max(begun - flight.since, 0)
    if m is None or len(m.corners) == 1:
        wait = first_fall(negated(_gap(m, flight)), start)
    else:
        m, d = _in_one_unit(m, flight)
        exits = (first_fall(negated(_beyond(d, face)), start) for face in m.faces)
        wait = _first(_crossings(m, d, m.radius, start, -1) if m.radius else exits)
    return None if wait is None else flight.since + wait


def _contact(m: Difference, d: Path, start: int) -> int | None:
    """Returns the first n from ``start`` on that is the contact of the place d(n) with a difference of more
    than one corner (rule 5s); None: no contact."""
    if m.radius:
        return _contact_with_margin(m, d, start)
    inside = where(start, [_beyond(d, face) for face in m.faces]) if len(m.faces) > 2 else []
    deep = where(start, [negated(_squared(d, face, m.flush)) for face in m.faces])
    for low, high in inside:
        if not both([(low, high)], deep):
            continue
        if low > start:
            return low - 1
        falls = where(low, [differences(_beyond(d, face)) for face in _nearest_faces(m, _at(d, low))])
        if falls and falls[0][0] + 1 < high:
            return falls[0][0]
    return None


def _contact_with_margin(m: Difference, d: Path, start: int) -> int | None:
    """Returns the first n from ``start`` on after which d comes nearer than R, and, before it parts, nearer
    than R less the strip."""

    def nearer(radius: int, start: int) -> int | None:
        inside = where(start, [_beyond(d, face) for face in m.faces]) if len(m.faces) > 2 else []
        entered = [low - 1 for low, _ in inside if low > start]
        return _first([*_crossings(m, d, radius, start, 1), *entered])

    while (begin := nearer(m.radius, start)) is not None and m.inner > 0:
        deep, end = nearer(m.inner, begin), _first(_crossings(m, d, m.radius, begin + 1, -1))
        if deep is not None and (end is None or deep < end):
            break
        if end is None:
            return None
        start = end
    return begin


def _crossings(m: Difference, d: Path, radius: int, start: int, way: int) -> Iterable[int]:
    """Yields the n of d's entry within a radius of a face that it is over then, or of a corner that it is
    beside, with approach (``way`` is 1); or of its exit, with growing distance (-1)."""

    def crossing(square: Polynomial, gap: Polynomial, there: list[Polynomial]) -> Iterable[int]:
        within = [a_tick_later(square), differences(gap)]
        within = within if way > 0 else [negated(each) for each in within]
        return (low for low, _ in where(start, within, there)[:1])

    for face in m.faces:
        g, end = _beyond(d, face), (face.start[0] + face.way[0], face.start[1] + face.way[1])
        over = [g, _along(d, face.way, face.start), negated(_along(d, face.way, end))]
        yield from crossing(_squared(d, face, radius), g, [a_tick_later(each) for each in over])
    for k, corner in enumerate(m.corners):
        q = _disc(d, corner, radius)
        beside = [negated(_along(d, m.ways[k], corner)), _along(d, m.ways[k - 1], corner)]
        yield from crossing(q, q, [*beside, *(a_tick_later(each) for each in beside)])


def _first(found: Iterable[int | None]) -> int | None:
    return min((n for n in found if n is not None and n < HORIZON), default=None)


def _outward(m: Difference, here: Whole) -> list[Whole]:
    """Returns the outward directions of M at the features that are nearest to a place (rule 7s)."""
    gaps = [dot(face.normal, less(here, face.start)) for face in m.faces]
    if m.radius:
        for face, gap in zip(m.faces, gaps, strict=True):
            along = dot(face.way, less(here, face.start))
            if gap > 0 and 0 <= along <= dot(face.way, face.way):
                return [face.normal]
        for k, corner in enumerate(m.corners) if max(gaps) > 0 or len(m.corners) == 2 else ():
            away = less(here, corner)
            if dot(away, m.ways[k]) <= 0 <= dot(away, m.ways[k - 1]):
                return [away]
    return [face.normal for face in _nearest_faces(m, here)]


def _nearest_faces(m: Difference, here: Whole) -> list[Face]:
    """Returns the faces with the largest g/|n|."""
    gaps = [dot(face.normal, less(here, face.start)) for face in m.faces]
    squares = [
        Fraction(gap * abs(gap), dot(face.normal, face.normal))
        for gap, face in zip(gaps, m.faces, strict=True)
    ]
    return [face for face, square in zip(m.faces, squares, strict=True) if square == max(squares)]


def _in_one_unit(m: Difference, flight: Separation) -> tuple[Difference, Path]:
    """Returns a difference and d(n) as integers that count the same lengths."""
    bits = max(m.bits, flight.bits)
    finer = bits - flight.bits
    return m.finer(bits), [(x << finer, y << finer) for x, y in flight.ways]


def _gap(m: Difference | None, flight: Separation) -> Polynomial:
    """Returns Q of rule 5, for discs, or for shapes whose difference is a point."""
    if m is None:
        return _disc(flight.ways, (0, 0), flight.reach)
    m, d = _in_one_unit(m, flight)
    return _disc(d, m.corners[0], m.radius)


def _disc(d: Path, corner: Whole, radius: int) -> Polynomial:
    """Returns |d - corner|^2 - radius^2."""
    (x, y), (vx, vy), (hx, hy) = less(d[0], corner), d[1], d[2]
    q = [x * x + y * y - radius * radius, 2 * (x * vx + y * vy), vx * vx + vy * vy]
    if hx or hy:
        q[2] += 2 * (x * hx + y * hy)
        q += [2 * (vx * hx + vy * hy), hx * hx + hy * hy]
    return q


def _along(d: Path, way: Whole, start: Whole = (0, 0)) -> Polynomial:
    """Returns way . (d - start)."""
    return [dot(way, less(d[0], start)), dot(way, d[1]), dot(way, d[2])]


def _beyond(d: Path, face: Face) -> Polynomial:
    """Returns g for a face."""
    return _along(d, face.normal, face.start)


def _squared(d: Path, face: Face, width: int) -> Polynomial:
    """Returns g^2 - width^2 n.n for a face."""
    c, b, a = _beyond(d, face)
    square = width * width * dot(face.normal, face.normal)
    return [c * c - square, 2 * b * c, b * b + 2 * a * c, 2 * a * b, a * a]


def _at(d: Path, n: int) -> Whole:
    return d[0][0] + n * (d[1][0] + n * d[2][0]), d[0][1] + n * (d[1][1] + n * d[2][1])
