"""Each vector primitive, as Python and compiled, against its meaning in NumPy, bit for bit, on ordinary and
on hard numbers."""

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
from kinetile.kernel.compiled import NOTHING_IS_COMPILED, hook
from kinetile.kernel.tables import BODY, PLAN_NUMBERS, record_table
from two_forms import both_ways

pytestmark = pytest.mark.usefixtures("compiled_here")

LANES = vectors.LANES
HARD = (
    *(0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, np.nan, 5e-324, -5e-324, 2.0**-1022, -(2.0**-1023)),
    *(1.7976931348623157e308, -1.7976931348623157e308, 1.0 + 2.0**-52, 1.0 - 2.0**-53, 1e-200, 1e200, 0.1),
)

number = st.one_of(st.sampled_from(HARD), st.floats(width=64))
tick = st.integers(-(2**63), 2**63 - 1)
eight = arrays.arrays(np.float64, LANES, elements=number)
wholes = arrays.arrays(
    np.int32, LANES, elements=st.one_of(st.integers(-2, 3), st.integers(-(2**31), 2**31 - 1))
)


def same(found: Any, expected: Any) -> None:
    found, expected = np.asarray(found), np.asarray(expected)
    assert found.dtype == expected.dtype
    real = ~np.isnan(expected) if found.dtype == np.float64 else np.ones(found.shape, dtype=bool)
    assert np.isnan(found[~real]).all()
    assert found[real].tobytes() == expected[real].tobytes()


# Vectors exist in registers only: they are put together from a table, and laid down lane by lane.

EIGHT = np.arange(LANES, dtype=np.int32)


@hook
def load(values: Any, numbers: Any) -> Any:
    return vectors.pick(values, numbers, 0)


@hook
def lay_down(vector: Any, out: Any) -> None:
    for i in range(8):
        out[i] = vectors.lane(vector, i)


@both_ways
@hook
def of_doubles(one: Any, two: Any, numbers: Any, floats: Any, truths: Any) -> tuple[int, bool]:
    a = load(one, numbers)
    b = load(two, numbers)
    lay_down(a + b, floats[0])
    lay_down(a - b, floats[1])
    lay_down(a * b, floats[2])
    lay_down(a / b, floats[3])
    lay_down(vectors.root(a), floats[4])
    lay_down(vectors.choose(a < b, a, b), floats[5])
    lay_down(vectors.spread(one[3]), floats[6])
    lay_down(vectors.turned(a, 1), floats[7])
    lay_down(vectors.turned(a, 2), floats[8])
    lay_down(vectors.turned(a, 4), floats[9])
    lay_down(vectors.followed(a), floats[10])
    lay_down(a < b, truths[0])
    lay_down(a <= b, truths[1])
    lay_down(a > b, truths[2])
    lay_down(a >= b, truths[3])
    lay_down((a < b) & (b < a), truths[4])
    lay_down((a < b) | (b < a), truths[5])
    return vectors.bits(a < b), vectors.some(a < b)


@given(eight, eight, arrays.arrays(np.int32, LANES, elements=st.integers(0, LANES - 1)))
@settings(deadline=None, max_examples=30)
def test_eight_doubles(one, two, picked):
    """Comparisons with NaN are false."""
    floats, truths = np.zeros((11, LANES)), np.zeros((6, LANES), dtype=np.bool_)
    with np.errstate(all="ignore"):
        word, anywhere = of_doubles(one, two, picked, floats, truths)
    first = one[3]
    one, two = one[picked], two[picked]
    less, more = one < two, one > two
    turned = [one[np.arange(LANES) ^ by] for by in (1, 2, 4)] + [np.roll(one, -1)]
    with np.errstate(all="ignore"):
        same(floats[:5], [one + two, one - two, one * two, one / two, np.sqrt(one)])
    same(floats[5:], [np.where(less, one, two), np.full(LANES, first), *turned])
    same(truths, [less, one <= two, more, one >= two, less & more, less | more])
    assert (word, anywhere) == (sum(1 << i for i in range(LANES) if less[i]), less.any())


@both_ways
@hook
def of_wholes(one: Any, two: Any, out: Any) -> None:
    a = vectors.numbers(one, 0)
    b = vectors.numbers(two, 0)
    lay_down(a + b, out[0])
    lay_down(a - b, out[1])
    lay_down(a & b, out[2])
    lay_down(a >> (b & vectors.spread_whole(31)), out[3])
    lay_down(vectors.choose(a < b, a, vectors.spread_whole(-7)), out[4])
    lay_down(vectors.choose(a > b, a, vectors.spread_whole(1 << 30)), out[5])
    lay_down(vectors.choose(a == vectors.spread_whole(one[2]), b, a), out[6])
    lay_down(vectors.eight(one[7], one[6], one[5], one[4], 3, 2, 1, 0), out[7])


@given(wholes, wholes)
@settings(deadline=None, max_examples=40)
def test_eight_whole_numbers(one, two):
    out = np.zeros((8, LANES), dtype=np.int32)
    of_wholes(one, two, out)
    chosen = [
        np.where(one < two, one, np.int32(-7)),
        np.where(one > two, one, np.int32(1 << 30)),
        np.where(one == one[2], two, one),
    ]
    eight = np.array([*one[:3:-1], 3, 2, 1, 0], dtype=np.int32)
    same(out, [one + two, one - two, one & two, one >> (two & 31), *chosen, eight])


@both_ways
@hook
def of_ticks(ticks: Any, values: Any, numbers: Any, out: Any, floats: Any) -> None:
    many = vectors.spread_ticks(ticks[0])
    low = vectors.floor(load(values, numbers))
    lay_down(many, out[0])
    lay_down(low, out[1])
    lay_down(low - many, out[2])
    lay_down(vectors.to_floats(many), floats)


@given(tick, arrays.arrays(np.float64, LANES, elements=st.floats(-(2.0**62), 2.0**62)))
@settings(deadline=None)
def test_eight_ticks(tick, values):
    out, floats = np.zeros((3, LANES), dtype=np.int64), np.zeros(LANES)
    of_ticks(np.array([tick]), values, EIGHT, out, floats)
    low = np.array([math.floor(value) for value in values.tolist()])
    same(out, [np.full(LANES, tick), low, low - tick])
    same(floats, np.full(LANES, float(tick)))


@both_ways
@hook
def blocks(table: Any, first: int, end: int, filler: int, out: Any) -> None:
    vectors.fill(table, end, filler)
    lay_down(vectors.numbers(table, first), out)


@given(st.integers(0, 20), st.integers(0, 20), st.integers(-2, 2**31 - 1))
@settings(deadline=None, max_examples=40)
def test_eight_numbers_are_written_and_read(first, end, filler):
    table = np.arange(100, 100 + 20 + LANES, dtype=np.int32)
    expected = table.copy()
    expected[end : end + LANES] = filler
    out = np.zeros(LANES, dtype=np.int32)
    blocks(table, first, end, filler, out)
    same(out, expected[first : first + LANES])
    same(table, expected)


@both_ways
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


@both_ways
@hook
def number_all(values: Any, names: Any, first: int, out: Any, places: Any) -> None:
    lay_down(vectors.numbered(vectors.pick(values, names, 0), first), out)
    for i in range(8):
        places[i] = vectors.number_in(out[i])


delays = arrays.arrays(
    np.float64, LANES, elements=st.floats(2.0**-1000, math.inf) | st.sampled_from([2.0**-1000, 1.0, math.inf])
)


@given(delays, st.integers(0, 7).map(lambda block: LANES * block))
@settings(deadline=None, max_examples=60)
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


@both_ways
@hook
def rows(places: Any, bodies: Any, which: Any, out: Any, anchors: Any) -> None:
    x, y, vx, vy = vectors.places(places, which, 0)
    lay_down(x, out[0])
    lay_down(y, out[1])
    lay_down(vx, out[2])
    lay_down(vy, out[3])
    x, y, vx, vy, anchor, reach = vectors.flights(
        bodies, which[0], which[1], which[2], which[3], which[4], which[5], which[6], which[7]
    )
    lay_down(x, out[4])
    lay_down(y, out[5])
    lay_down(vx, out[6])
    lay_down(vy, out[7])
    lay_down(reach, out[8])
    lay_down(anchor, anchors)


@both_ways
@hook
def write(table: Any, which: int, x: float, y: float, vx: float, vy: float) -> None:
    vectors.put_place(table, which, x, y, vx, vy)


@given(
    arrays.arrays(np.float64, (12, 5), elements=number),
    arrays.arrays(np.int64, 12, elements=tick),
    arrays.arrays(np.int32, LANES, elements=st.integers(0, 11)),
)
@settings(deadline=None, max_examples=40)
def test_places_and_flight_plans_are_those_of_the_tables(values, ticks, which):
    places, bodies = record_table(PLAN_NUMBERS, 12), record_table(BODY, 12)
    for at, row in enumerate(values[:, :4].tolist()):
        write(places, at, *row)
    for column, name in zip(values.T, ("x", "y", "vx", "vy", "reach"), strict=True):
        bodies[name] = column
    bodies.anchor = ticks
    out, anchors = np.zeros((9, LANES)), np.zeros(LANES, dtype=np.int64)
    rows(places, bodies, which, out, anchors)
    chosen = values[which].T
    same(out, [*chosen[:4], *chosen])
    same(anchors, ticks[which])


@both_ways
@hook
def lowest(word: int) -> int:
    return vectors.lowest_bit(word)


@given(tick.filter(bool))
@settings(deadline=None)
def test_the_lowest_bit(word):
    assert lowest(np.int64(word)) == min(bit for bit in range(64) if word >> bit & 1)


@both_ways
@hook
def errors(one: Any, two: Any, out: Any) -> None:
    for i in range(8):
        out[i] = vectors.product_error(one[i], two[i], one[i] * two[i])


finite = st.floats(allow_nan=False, allow_infinity=False)
ordinary = st.floats(1e-120, 1e120) | st.floats(-1e120, -1e-120) | st.just(0.0)
factors = arrays.arrays(np.float64, LANES, elements=finite | ordinary)


@given(factors, factors)
@settings(deadline=None, max_examples=60)
def test_the_error_of_a_product_is_the_exact_one_rounded(one, two):
    """Also where it is below the smallest double, or a product of halves would be beyond the largest."""
    out = np.zeros(LANES)
    with np.errstate(all="ignore"):
        errors(one, two, out)
        beyond = ~np.isfinite(one * two)
    for a, b, found in zip(one[~beyond].tolist(), two[~beyond].tolist(), out[~beyond].tolist(), strict=True):
        assert found == float(Fraction(a) * Fraction(b) - Fraction(a * b))


@pytest.mark.slow
@pytest.mark.skipif(NOTHING_IS_COMPILED, reason="there is no vector")
def test_a_machine_without_long_vectors_has_the_same_bits(tmp_path):
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", __file__, "-k", "not machine"]
    generic = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run(command, env=os.environ | generic, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


@pytest.mark.interpreted
def test_the_error_of_an_exact_product_was_a_zero_with_a_minus():
    a, b = 3.0, 2.0**30 - 1.0
    for one, two in ((a, b), (-a, b), (a, -b), (-a, -b)):
        assert math.copysign(1.0, vectors.product_error(one, two, one * two)) == 1.0
