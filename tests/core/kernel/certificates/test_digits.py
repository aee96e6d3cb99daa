"""Whole numbers in limbs against Python's."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kinetile.kernel.certificates.digits import CELLS, LIMB, ZERO, add_product, carry, put, put_count, room

pytestmark = pytest.mark.small

doubles = st.floats(allow_nan=False, allow_infinity=False)
powers = st.sampled_from([0, -52, -60, -1100])
ONE, TWO, COUNT, PRODUCT = 0, CELLS, 2 * CELLS, 3 * CELLS


def value(m: np.ndarray, row: int, cells: int, zero: int) -> Fraction:
    digits = m[row : row + cells].tolist()
    return sum((Fraction(2) ** (LIMB * (i - zero)) * digit for i, digit in enumerate(digits)), Fraction(0))


@settings(deadline=None)
@given(st.lists(doubles, max_size=4), powers, st.sampled_from([1, -1]))
def test_a_sum_of_doubles_is_exact_and_knows_its_sign(summands, power, sign):
    m = np.zeros(5 * CELLS, dtype=np.int64)
    first, end = CELLS, 0
    for each in summands:
        first, end = room(first, end, each, power)
        put(m, ONE, each, power, sign)
    exact = sum((sign * Fraction(each) * Fraction(2) ** power for each in summands), Fraction(0))
    assert value(m, ONE, CELLS, ZERO) == exact
    assert first >= 0
    assert end <= CELLS
    assert carry(m, ONE, first, end, 1) == (exact > 0) - (exact < 0)
    assert value(m, ONE, CELLS, ZERO) == exact
    assert np.abs(m).max() <= 1 << (LIMB - 1)
    assert carry(m, ONE, first, end, -1) == (exact < 0) - (exact > 0)
    assert value(m, ONE, CELLS, ZERO) == -exact


@settings(deadline=None)
@given(doubles, doubles, st.integers(0, 1 << 62), powers)
def test_products_are_exact(a, b, count, power):
    """For two doubles, and for a double and a count of ticks; added to a given sum."""
    m = np.zeros(5 * CELLS, dtype=np.int64)
    first, end = room(*room(CELLS, 0, a, 0), b, power)
    put(m, ONE, a, 0, 1)
    put(m, TWO, b, power, 1)
    put_count(m, COUNT, count)
    end = max(end, 8)
    first = min(first, end - 8)
    speed = Fraction(b) * Fraction(2) ** power
    add_product(m, ONE, TWO, first, end - 3, COUNT, 0, 3)
    place = Fraction(a) + speed * count
    assert carry(m, ONE, first, end, 1) == (place > 0) - (place < 0)
    assert value(m, ONE, CELLS, ZERO) == place
    carry(m, TWO, first, end, 1)
    add_product(m, PRODUCT, ONE, first, end, TWO, first, end)
    product = place * speed
    assert carry(m, PRODUCT, 2 * first, 2 * end, 1) == (product > 0) - (product < 0)
    assert value(m, PRODUCT, 2 * CELLS, 2 * ZERO) == product


def test_what_is_no_finite_number_has_no_room():
    for value in (float("inf"), float("-inf"), float("nan")):
        assert room(CELLS, 0, value, 0)[1] > CELLS
