"""Rules 5a, 6a, 7a and 11a of docs/specification.md: contacts of accelerated bodies, in integers.

A polynomial is the list of its coefficients, integers, from that of degree 0 on, of a whole number of ticks.
Contact is a matter of signs at whole ticks: the first n at which Q(n + 1) is below 0 and below Q(n). Let
dQ(n) = Q(n + 1) - Q(n), of one degree less. Where dQ is nowhere below 0, or everywhere, Q is monotone; so it
changes its sign at most once there, and bisection finds where. By induction that gives, for a polynomial of
any degree, all places at which it goes below 0 or comes back from there: no root is computed.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import comb

HORIZON = 1 << 62
"""A contact this many ticks after the later anchor, or later, does not count (rules 5, 5a, 6 and 6a)."""

Polynomial = Sequence[int]


def first_fall(q: Polynomial, start: int = 0) -> int | None:
    """Returns the first n from ``start`` on at which Q(n + 1) < min(0, Q(n)), or None."""
    steps = differences(q)
    for low, high in pairwise([start, *changes(steps, start), HORIZON]):
        falls = low < high and value_at(steps, low) < 0  # all the way
        if falls and value_at(q, high) < 0:
            return _first(q, low, high) - 1 if value_at(q, low) >= 0 else low
    return None


def met_again_from(q: Polynomial) -> int | None:
    """Returns from which n on two that have just met may meet again (rule 7a): the first with Q(n + 1) >
    Q(n), but 0 if they press on each other; None: from none on."""
    falls = differences(q)
    if value_at(falls, 1) < value_at(falls, 0) <= 0:
        return 0
    steps = [-each for each in falls]
    return 0 if value_at(steps, 0) < 0 else next(iter(changes(steps, 0)), None)


def changes(p: Polynomial, start: int) -> list[int]:
    """Returns the n after ``start`` at which p is below 0 and was not at n - 1, or the other way round."""
    if len(p) < 2:
        return []
    found = []
    for low, high in pairwise([start, *changes(differences(p), start), HORIZON]):
        if low < high and (value_at(p, low) < 0) != (value_at(p, high) < 0):
            found.append(_first(p, low, high))
    return found


def _first(p: Polynomial, low: int, high: int) -> int:
    """Returns the first n after ``low`` at which p is below 0 as it is at ``high``, or is not as it is not
    there. Before: it is the other way at ``low``, and changes once."""
    there = value_at(p, high) < 0
    while high - low > 1:
        middle = (low + high) >> 1
        low, high = (low, middle) if (value_at(p, middle) < 0) == there else (middle, high)
    return high


def value_at(p: Polynomial, n: int) -> int:
    """Returns p(n)."""
    value = 0
    for each in reversed(p):
        value = value * n + each
    return value


def differences(p: Polynomial) -> list[int]:
    """Returns p(n + 1) - p(n)."""
    return [sum(comb(k, power) * p[k] for k in range(power + 1, len(p))) for power in range(len(p) - 1)]
