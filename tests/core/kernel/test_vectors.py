"""Each vector primitive against its meaning in NumPy, bit for bit, on ordinary and on hard numbers.

Compiled, the functions are LLVM vectors; interpreted, they are NumPy arrays. Both are held against what is
written here, so each against the other: CI runs this file interpreted as well.
"""

from __future__ import annotations

import math
import os
import subprocess
import sys
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from kinetile.kernel import vectors
from kinetile.kernel.compiled import INTERPRETED, hook
from kinetile.kernel.tables import BODY, PLACE, record_table

LANES = vectors.LANES
HARD = (
    *(0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, np.nan, 5e-324, -5e-324, 2.0**-1022, -(2.0**-1023)),
    *(1.7976931348623157e308, -1.7976931348623157e308, 1.0 + 2.0**-52, 1.0 - 2.0**-53, 1e-200, 1e200, 0.1),
)

number = st.one_of(st.sampled_from(HARD), st.floats(width=64))
eight = arrays.arrays(np.float64, LANES, elements=number)
wholes = arrays.arrays(
    np.int32, LANES, elements=st.one_of(st.integers(-2, 3), st.integers(-(2**31), 2**31 - 1))
)


def same(found: Any, expected: Any) -> None:
    """Assert that two arrays are the same, to the last bit but for which not-a-number it is."""
    found, expected = np.asarray(found), np.asarray(expected)
    assert found.dtype == expected.dtype
    assert np.array_equal(np.isnan(found), np.isnan(expected)) if found.dtype == np.float64 else True
    real = ~np.isnan(found) if found.dtype == np.float64 else np.ones(found.shape, dtype=bool)
    assert found[real].tobytes() == expected[real].tobytes()


# Vectors live in registers only: they are put together from a table, and laid down lane by lane.

EIGHT = np.arange(LANES, dtype=np.int32)


@hook
def load(values: Any, numbers: Any) -> Any:
    return vectors.pick(values, numbers, 0)


@hook
def lay_down(vector: Any, out: Any) -> None:
    for i in range(8):
        out[i] = vectors.lane(vector, i)


@hook
def sums(one: Any, two: Any, numbers: Any, out: Any) -> None:
    a = load(one, numbers)
    b = load(two, numbers)
    lay_down(a + b, out[0])
    lay_down(a - b, out[1])
    lay_down(a * b, out[2])
    lay_down(a / b, out[3])
    lay_down(vectors.root(a), out[4])


@given(eight, eight)
@settings(deadline=None, max_examples=150)
def test_arithmetic(one, two):
    out = np.zeros((5, LANES))
    sums(one, two, EIGHT, out)
    with np.errstate(all="ignore"):
        for found, expected in zip(
            out, (one + two, one - two, one * two, one / two, np.sqrt(one)), strict=True
        ):
            same(found, expected)


@hook
def comparisons(one: Any, two: Any, numbers: Any, out: Any) -> None:
    a = load(one, numbers)
    b = load(two, numbers)
    lay_down(a < b, out[0])
    lay_down(a <= b, out[1])
    lay_down(a > b, out[2])
    lay_down(a >= b, out[3])
    lay_down((a < b) & (b < a), out[4])
    lay_down((a < b) | (b < a), out[5])


@given(eight, eight)
@settings(deadline=None, max_examples=100)
def test_comparisons_with_what_is_not_a_number_are_false(one, two):
    out = np.zeros((6, LANES), dtype=np.bool_)
    comparisons(one, two, EIGHT, out)
    less, more = one < two, one > two
    for found, expected in zip(
        out, (less, one <= two, more, one >= two, less & more, less | more), strict=True
    ):
        same(found, expected)


@hook
def choices(one: Any, two: Any, numbers: Any, whole: Any, out: Any, who: Any) -> None:
    a = load(one, numbers)
    b = load(two, numbers)
    w = vectors.numbers(whole, 0)
    lay_down(vectors.choose(a < b, a, b), out[0])
    lay_down(vectors.spread(one[3]), out[1])
    lay_down(vectors.choose(a < b, w, vectors.spread_whole(-7)), who[0])
    lay_down(vectors.choose(w == vectors.spread_whole(whole[2]), w, vectors.spread_whole(1 << 30)), who[1])


@given(eight, eight, wholes)
@settings(deadline=None, max_examples=100)
def test_choices(one, two, whole):
    out, who = np.zeros((2, LANES)), np.zeros((2, LANES), dtype=np.int32)
    choices(one, two, EIGHT, whole, out, who)
    same(out[0], np.where(one < two, one, two))
    same(out[1], np.full(LANES, one[3]))
    same(who[0], np.where(one < two, whole, -7).astype(np.int32))
    same(who[1], np.where(whole == whole[2], whole, 1 << 30).astype(np.int32))


@hook
def blocks(table: Any, first: int, end: int, filler: int, out: Any) -> None:
    vectors.fill(table, end, filler)
    lay_down(vectors.numbers(table, first), out)


@given(st.integers(0, 20), st.integers(0, 20), st.integers(-2, 2**31 - 1))
@settings(deadline=None, max_examples=100)
def test_eight_numbers_are_written_and_read(first, end, filler):
    table = np.arange(100, 100 + 20 + LANES, dtype=np.int32)
    expected = table.copy()
    expected[end : end + LANES] = filler
    out = np.zeros(LANES, dtype=np.int32)
    blocks(table, first, end, filler, out)
    same(out, expected[first : first + LANES])
    same(table, expected)


@hook
def number_all(values: Any, names: Any, first: int, out: Any, places: Any) -> None:
    lay_down(vectors.numbered(vectors.pick(values, names, 0), first), out)
    for i in range(8):
        places[i] = vectors.number_in(out[i])


delays = arrays.arrays(
    np.float64, LANES, elements=st.floats(2.0**-1000, math.inf) | st.sampled_from([2.0**-1000, 1.0, math.inf])
)


@given(delays, st.integers(0, 7).map(lambda block: LANES * block))
@settings(deadline=None, max_examples=200)
def test_a_number_in_the_last_bits_makes_a_delay_less_and_by_next_to_nothing(values, first):
    """The order of delays that differ by more stays, and an infinite one is the largest."""
    out, places = np.zeros(LANES), np.zeros(LANES, dtype=np.int64)
    number_all(values, EIGHT, first, out, places)
    assert places.tolist() == list(range(first, first + LANES))
    assert (out < values).all()
    finite = np.isfinite(values)
    assert (out[finite] > values[finite] * (1.0 - 2.0**-45)).all()
    assert (out[~finite] > 2.0**1023).all()
    bits = (values.view(np.int64) & -64) - 64 + np.arange(first, first + LANES)
    same(out, bits.view(np.float64))


@hook
def rows(table: Any, which: Any, out: Any) -> None:
    x, y, vx, vy = vectors.places(table, which, 0)
    lay_down(x, out[0])
    lay_down(y, out[1])
    lay_down(vx, out[2])
    lay_down(vy, out[3])


@hook
def write(table: Any, which: int, x: float, y: float, vx: float, vy: float) -> None:
    vectors.put_place(table, which, x, y, vx, vy)


@given(
    st.lists(st.tuples(number, number, number, number), min_size=1, max_size=20),
    st.lists(st.integers(0, 19), min_size=LANES, max_size=LANES),
)
@settings(deadline=None, max_examples=100)
def test_places_are_those_of_the_table(values, which):
    table = record_table(PLACE, len(values))
    for at, row in enumerate(values):
        write(table, at, *row)
    chosen = np.array(which, dtype=np.int32) % len(values)
    out = np.zeros((4, LANES))
    rows(table, chosen, out)
    for column, name in zip(out, ("x", "y", "vx", "vy"), strict=True):
        same(column, np.array(table[name])[chosen])
        same(column, np.array(values)[chosen, ["x", "y", "vx", "vy"].index(name)])


@hook
def picked(values: Any, which: Any, out: Any) -> None:
    lay_down(load(values, which), out)


@given(
    st.lists(number, min_size=1, max_size=20), st.lists(st.integers(0, 19), min_size=LANES, max_size=LANES)
)
@settings(deadline=None)
def test_entries_are_picked(values, which):
    out = np.zeros(LANES)
    chosen = np.array(which, dtype=np.int32) % len(values)
    picked(np.array(values), chosen, out)
    same(out, np.array(values)[chosen])


@hook
def turns(values: Any, numbers: Any, out: Any) -> None:
    a = load(values, numbers)
    lay_down(vectors.turned(a, 1), out[0])
    lay_down(vectors.turned(a, 2), out[1])
    lay_down(vectors.turned(a, 4), out[2])


@given(eight)
@settings(deadline=None)
def test_lanes_are_turned_round(values):
    out = np.zeros((3, LANES))
    turns(values, EIGHT, out)
    for found, by in zip(out, (1, 2, 4), strict=True):
        same(found, values[np.arange(LANES) ^ by])


@hook
def appended(source: Any, first: int, target: Any, end: int) -> int:
    return vectors.append(source, first, target, end)


@given(st.lists(st.integers(0, 7), min_size=1, max_size=12))
@settings(deadline=None)
def test_blocks_are_appended(counts):
    source = np.arange(LANES * len(counts), dtype=np.int32)
    source[LANES - 1 :: LANES] = counts
    target = np.full(LANES * (len(counts) + 1), -1, dtype=np.int32)
    end = 0
    for block in range(len(counts)):
        end += appended(source, LANES * block, target, end)
    expected = [LANES * block + i for block, count in enumerate(counts) for i in range(count)]
    assert target[:end].tolist() == expected


@hook
def lowest(word: int) -> int:
    return vectors.lowest_bit(word)


@given(st.integers(-(2**63), 2**63 - 1).filter(bool))
@settings(deadline=None)
def test_the_lowest_bit(word):
    assert lowest(np.int64(word)) == min(bit for bit in range(64) if word >> bit & 1)


@hook
def errors(one: Any, two: Any, out: Any) -> None:
    for i in range(8):
        out[i] = vectors.product_error(one[i], two[i], one[i] * two[i])


ordinary = arrays.arrays(
    np.float64, LANES, elements=st.floats(1e-120, 1e120) | st.floats(-1e120, -1e-120) | st.just(0.0)
)


@given(ordinary, ordinary)
@settings(deadline=None, max_examples=100)
def test_the_error_of_a_product_is_exact(one, two):
    out = np.zeros(LANES)
    errors(one, two, out)
    exact = [
        Fraction(a) * Fraction(b) - Fraction(a * b) for a, b in zip(one.tolist(), two.tolist(), strict=True)
    ]
    assert [Fraction(each) for each in out.tolist()] == exact


finite = arrays.arrays(np.float64, LANES, elements=st.floats(allow_nan=False, allow_infinity=False))


@given(finite, finite)
@settings(deadline=None, max_examples=100)
def test_the_error_of_a_product_of_any_size_is_the_exact_one_rounded(one, two):
    """Also where it is below the smallest double, or a product of halves would be beyond the largest."""
    out = np.zeros(LANES)
    with np.errstate(all="ignore"):
        errors(one, two, out)
        two = np.where(np.isfinite(one * two), two, 0.0)
        out = np.where(two == 0.0, 0.0, out)
    for a, b, found in zip(one.tolist(), two.tolist(), out.tolist(), strict=True):
        assert found == float(Fraction(a) * Fraction(b) - Fraction(a * b))


@hook
def of_ticks(ticks: Any, values: Any, numbers: Any, out: Any, floats: Any, truths: Any) -> None:
    many = vectors.spread_ticks(ticks[0])
    lay_down(many, out[0])
    lay_down(vectors.to_floats(many), floats)
    low = vectors.floor(load(values, numbers))
    lay_down(low, out[1])
    lay_down(vectors.eight(numbers[7], numbers[6], numbers[5], numbers[4], 3, 2, 1, 0), truths)


@given(
    st.integers(-(2**63), 2**63 - 1),
    arrays.arrays(np.float64, LANES, elements=st.floats(-(2.0**62), 2.0**62)),
)
@settings(deadline=None)
def test_ticks(tick, values):
    out, floats, truths = (
        np.zeros((2, LANES), dtype=np.int64),
        np.zeros(LANES),
        np.zeros(LANES, dtype=np.int32),
    )
    of_ticks(np.array([tick]), values, EIGHT, out, floats, truths)
    same(out[0], np.full(LANES, tick))
    same(floats, np.full(LANES, float(tick)))
    assert out[1].tolist() == [math.floor(value) for value in values.tolist()]
    assert truths.tolist() == [7, 6, 5, 4, 3, 2, 1, 0]


@hook
def any_less(one: Any, two: Any, numbers: Any) -> bool:
    return vectors.some(load(one, numbers) < load(two, numbers))


@given(eight, eight)
@settings(deadline=None)
def test_whether_it_is_true_anywhere(one, two):
    assert bool(any_less(one, two, EIGHT)) == bool((one < two).any())


@hook
def lanes_that_are_less(one: Any, two: Any, numbers: Any) -> int:
    return vectors.bits(load(one, numbers) < load(two, numbers))


@given(eight, eight)
@settings(deadline=None)
def test_where_it_is_true(one, two):
    expected = sum(1 << lane for lane in range(LANES) if one[lane] < two[lane])
    assert lanes_that_are_less(one, two, EIGHT) == expected


@hook
def plans(bodies: Any, which: Any, out: Any, anchors: Any) -> None:
    x, y, vx, vy, anchor, reach = vectors.flights(
        bodies, which[0], which[1], which[2], which[3], which[4], which[5], which[6], which[7]
    )
    lay_down(x, out[0])
    lay_down(y, out[1])
    lay_down(vx, out[2])
    lay_down(vy, out[3])
    lay_down(reach, out[4])
    lay_down(anchor, anchors)


@given(
    arrays.arrays(np.float64, (12, 5), elements=number),
    arrays.arrays(np.int64, 12, elements=st.integers(-(2**63), 2**63 - 1)),
    st.lists(st.integers(0, 11), min_size=LANES, max_size=LANES),
)
@settings(deadline=None)
def test_flight_plans_are_those_of_the_bodies(values, ticks, which):
    bodies = record_table(BODY, 12)
    for column, name in zip(values.T, ("x", "y", "vx", "vy", "reach"), strict=True):
        bodies[name] = column
    bodies.anchor = ticks
    chosen = np.array(which, dtype=np.int32)
    out, anchors = np.zeros((5, LANES)), np.zeros(LANES, dtype=np.int64)
    plans(bodies, chosen, out, anchors)
    for found, column in zip(out, values.T, strict=True):
        same(found, column[chosen])
    same(anchors, ticks[chosen])


@pytest.mark.slow
@pytest.mark.skipif(INTERPRETED, reason="there is no vector")
def test_a_machine_without_long_vectors_has_the_same_bits(tmp_path):
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", __file__, "-k", "not machine"]
    generic = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run(command, env=os.environ | generic, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
