"""Signs of polynomials at whole ticks, in integers, for rules 5 to 7 of docs/specification.md.

A polynomial of a whole number of ticks is the list of its coefficients, integers, from degree 0 on. A contact
depends on signs at whole ticks: it is at the first n with Q(n + 1) below 0 and below Q(n). Let
dQ(n) = Q(n + 1) - Q(n), of one degree less. In an interval where dQ is nowhere below 0, or everywhere, Q is
monotone; so it changes its sign at most once there, and bisection finds the place. By induction this gives,
for a polynomial of any degree, all n with a fall below 0 or a return. No root decides: for
degrees 1 and 2 the bisection begins at the roots, which makes it short.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import isqrt

HORIZON = 1 << 62
"""A contact this many ticks after the later anchor, or later, does not count (rules 5 and 6)."""

Polynomial = Sequence[int]

Runs = list[tuple[int, int]]
"""A set of whole n: runs [low, high)."""


def first_fall(q: Polynomial, start: int = 0) -> int | None:
    """Returns the first n from ``start`` on with Q(n + 1) < min(0, Q(n)), or None."""
    steps = differences(q)
    for low, high in pairwise([start, *changes(steps, start), HORIZON]):
        falls = low < high and value_at(steps, low) < 0  # all the way
        if falls and value_at(q, high) < 0:
            return _first(q, low, high) - 1 if value_at(q, low) >= 0 else low
    return None


def counts_from(gaps: Sequence[Polynomial]) -> int | None:
    """Returns the first n at which two bodies that have just met may meet again (rules 7 and 7s): the first
    with growth of one of some gaps, but 0 if all of them shrink, more and more; None: no n."""
    steps = [differences(gap) for gap in gaps]
    if all(value_at(each, 1) < value_at(each, 0) <= 0 for each in steps):
        return 0
    grows = [where(0, [negated(each)]) for each in steps]
    return min((runs[0][0] for runs in grows if runs), default=None)


def where(start: int, below: Sequence[Polynomial], others: Sequence[Polynomial] = ()) -> Runs:
    """Returns the n from ``start`` on, up to the horizon, with some polynomials below 0, and others not
    below 0."""
    found = [(start, HORIZON)] if start < HORIZON else []
    for k, p in enumerate((*below, *others)):
        if not found:
            break
        ends = [start, *changes(p, start), HORIZON]
        first = int((value_at(p, start) < 0) != (k < len(below)))
        found = both(found, list(pairwise(ends))[first::2])
    return found


def both(one: Runs, other: Runs) -> Runs:
    """Returns the intersection of two sets."""
    pairs = ((max(a, c), min(b, d)) for a, b in one for c, d in other)
    return [(low, high) for low, high in pairs if low < high]


def changes(p: Polynomial, start: int) -> list[int]:
    """Returns the n after ``start`` with p below 0 and not below 0 at n - 1, or the other way round."""
    if not any(p[1:]):
        return []
    found = []
    for low, high in pairwise([start, *changes(differences(p), start), HORIZON]):
        if low < high and (value_at(p, low) < 0) != (value_at(p, high) < 0):
            found.append(_first(p, low, high))
    return found


def _first(p: Polynomial, low: int, high: int) -> int:
    """Returns the first n after ``low`` with p on the same side of 0 as at ``high`` (below 0, or not below).
    Needs p on the other side at ``low``, with one change between."""
    there, guesses = value_at(p, high) < 0, _near_roots(p)
    while high - low > 1:
        middle = next(guesses, (low + high) >> 1)
        if low < middle < high:
            low, high = (low, middle) if (value_at(p, middle) < 0) == there else (middle, high)
    return high


def _near_roots(p: Polynomial) -> Iterator[int]:
    """Yields n on both sides of each root of a polynomial of degree 1 or 2."""
    c, b, a = (*p[:3], 0)[:3]
    floors = []
    if any(p[3:]) or b * b < 4 * a * c:
        return
    if a:
        root = isqrt(b * b - 4 * a * c)
        floors = [(-b - root) // (2 * a), (-b + root) // (2 * a)]
    elif b:
        floors = [-c // b]
    for floor in floors:
        yield from (floor, floor + 1, floor - 1, floor + 2)


def value_at(p: Polynomial, n: int) -> int:
    """Returns p(n)."""
    value = 0
    for each in reversed(p):
        value = value * n + each
    return value


def negated(p: Polynomial) -> Polynomial:
    """Returns -p."""
    return [-each for each in p]


def differences(p: Polynomial) -> list[int]:
    """Returns p(n + 1) - p(n)."""
    return [after - before for after, before in zip(a_tick_later(p), p[:-1], strict=False)]


def a_tick_later(p: Polynomial) -> Polynomial:
    """Returns p(n + 1), by additions alone."""
    found = list(p)
    for low in range(len(found) - 1):
        for power in range(len(found) - 2, low - 1, -1):
            found[power] += found[power + 1]
    return found
