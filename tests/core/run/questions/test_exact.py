"""Exact comparisons: whole numbers against more digits than they need."""

from __future__ import annotations

from fractions import Fraction
from functools import cmp_to_key
from math import isqrt

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from kinetile.run.questions.exact import (
    compare_roots,
    difference_of_roots,
    in_order,
    whole,
)

BITS = 2000

small = st.integers(0, 40)
large = st.integers(0, 2**300)
numbers = st.one_of(small, small.map(lambda i: i * i), large, small.map(lambda i: 12 * i * i))


def digits(a: int) -> int:
    """Return the root of a number to many digits; a difference of two is 0 only if it is 0."""
    return isqrt(a << 2 * BITS)


@given(a=numbers, b=numbers, c=st.one_of(st.integers(-40, 40), st.integers(-(2**150), 2**150)))
@example(a=0, b=0, c=0)
@example(a=27, b=12, c=0)
@example(a=48, b=48, c=0)
def test_roots_are_compared_exactly(a, b, c):
    difference = digits(a) - digits(b) - (c << BITS)
    sign = 0 if abs(difference) <= 1 else (1 if difference > 0 else -1)
    assert compare_roots(a, b, c) == sign
    assert compare_roots(b, a, -c) == -sign


@given(
    root=st.integers(1, 2**200),
    more=st.integers(1, 2**80),
    n=st.integers(1, 2**120),
    exponent=st.integers(0, 300),
)
def test_the_difference_of_roots_is_the_nearest_double(root, more, n, exponent):
    dot = root + more
    d = root * root + n % 7
    if dot * dot <= d:
        return
    found = difference_of_roots(dot, d, n, 1 << exponent)
    true = Fraction(((dot << BITS) - digits(d)) << BITS, isqrt(n << 2 * BITS) << BITS) / (1 << exponent)
    off = abs(Fraction(found) - true)
    for other in (np.nextafter(found, 0.0), np.nextafter(found, np.inf)):
        assert off <= abs(Fraction(float(other)) - true) + Fraction(1, 2**500)


@given(odd=st.integers(2**53, 2**54 - 1), root=st.integers(0, 2**70), scale=st.integers(1, 1000))
@example(odd=2**53 + 1, root=0, scale=1)
@example(odd=2**54 - 1, root=3, scale=7)
def test_between_two_doubles_the_even_one(odd, root, scale):
    """A difference of 54 bits is a whole number: half of them lie in the middle between two doubles."""
    dot = root + odd
    assert difference_of_roots(dot * scale, root * root * scale * scale, scale * scale, 1) == float(odd)


@given(values=st.lists(st.tuples(st.integers(0, 30), st.integers(0, 4)), max_size=20))
def test_in_order_is_sorted(values):
    """Bounds of many widths round about values of which many are equal."""
    exact = [value for value, _ in values]
    lower = np.array([value - width for value, width in values], dtype=float)
    upper = np.array([value + width for value, width in values], dtype=float)

    def compare(i: int, j: int) -> int:
        assert lower[i] <= upper[j] or lower[j] <= upper[i] or len(values) > 2
        return exact[i] - exact[j]

    expected = sorted(range(len(values)), key=cmp_to_key(lambda i, j: exact[i] - exact[j]))
    assert in_order(lower, upper, compare) == expected


def test_what_is_in_order_is_not_asked():
    def compare(i: int, j: int) -> int:
        raise AssertionError("nothing overlaps")

    assert in_order(np.array([3.0, 1.0, 2.0]), np.array([3.5, 1.5, 2.5]), compare) == [1, 2, 0]


@given(numbers=st.lists(st.floats(allow_nan=False, allow_infinity=False), max_size=6))
def test_doubles_as_whole_numbers(numbers):
    wholes, unit = whole(numbers)
    assert unit & (unit - 1) == 0
    assert [Fraction(each, unit) for each in wholes] == list(map(Fraction, numbers))
