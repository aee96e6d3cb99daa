"""Failure times of certificates: an event does not undo its exchange at the same tick."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from kinetile.kernel.certificates.structural import falls, falls_eight, first_rise
from kinetile.kernel.compiled import hook
from kinetile.kernel.skin import Skin
from kinetile.kernel.tables import NEVER, allocate
from kinetile.kernel.vectors import floor, lane, pick
from two_forms import both_ways

pytestmark = pytest.mark.small

TICK = 2.0**-52


def tables(speed: float):
    k = allocate(2, 2, 1)
    clock = k.clock[0]
    clock.per_tick, clock.per_time = TICK, 1.0 / TICK
    skin = Skin.of(2, 1.0, speed, TICK)
    clock.limits.skin, clock.limits.theta = skin.delta, skin.theta
    return k


@given(st.floats(-1.0, 1.0), st.floats(1e-9, 1e9), st.integers(-(2**50), 2**50))
@settings(deadline=None)
def test_a_fast_exchange_was_taken_back_within_its_tick(gap, rate, since):
    """At its tick a fast body is still short of the crossing, by more than rounding explains; at the end of
    the tick it is past it."""
    k = tables(speed=rate)
    k.clock[0].now = since
    tick = falls(k, since, gap, -rate)
    if tick == NEVER:
        return
    k.clock[0].now = tick
    assert falls(k, since, -gap, rate) == NEVER


@given(st.floats(-1e-9, 0.0), st.floats(0.0, 1e6), st.integers(0, 2**40))
@settings(deadline=None)
def test_an_inversion_that_is_deep_at_the_end_of_the_tick_fails_now(gap, rate, later):
    k = tables(speed=1.0)
    clock = k.clock[0]
    clock.now = later
    end = gap + rate * ((later + 1) * TICK)
    if not math.isclose(end, -clock.limits.theta, rel_tol=1e-9):
        assert falls(k, 0, gap, rate) == (later if end < -clock.limits.theta else NEVER)


NUMBERS = np.arange(8, dtype=np.int32)


@both_ways
@hook
def fall_together(k, since, gap, rate, ticks):
    found = falls_eight(k, floor(pick(since, NUMBERS, 0)), pick(gap, NUMBERS, 0), pick(rate, NUMBERS, 0))
    for i in range(8):
        ticks[i] = lane(found, i)


@given(
    st.lists(
        st.tuples(
            st.integers(-(2**50), 2**50),
            st.one_of(st.floats(-1.0, 1.0), st.sampled_from([0.0, -0.0, 1e300, -1e300, 1e-15, -1e-15])),
            st.one_of(st.floats(-1e9, 1e9), st.sampled_from([0.0, -0.0, 5e-324, -5e-324, -1e-300])),
        ),
        min_size=8,
        max_size=8,
    ),
    st.integers(-(2**50), 2**50),
)
@settings(deadline=None)
def test_eight_at_a_time_fell_otherwise_than_one_at_a_time(quantities, now):
    """To the tick, in every lane; and how late the latest was is counted alike."""
    one, eight = tables(speed=1.0), tables(speed=1.0)
    one.clock[0].now = eight.clock[0].now = now
    expected = [falls(one, *quantity) for quantity in quantities]
    since, gap, rate = (np.array(column, dtype=np.float64) for column in zip(*quantities, strict=True))
    found = np.zeros(8, dtype=np.int64)
    fall_together(eight, since, gap, rate, found)
    assert found.tolist() == expected
    assert eight.counts[0].late == one.counts[0].late


@both_ways
@hook
def rise_together(k, g0, g1, g2, g3, g4, scale, ticks):
    found = first_rise(
        k,
        pick(g0, NUMBERS, 0),
        pick(g1, NUMBERS, 0),
        pick(g2, NUMBERS, 0),
        pick(g3, NUMBERS, 0),
        pick(g4, NUMBERS, 0),
        pick(scale, NUMBERS, 0),
    )
    for i in range(8):
        ticks[i] = lane(found, i)


def rises(*coefficients: tuple[float, ...], scale: float = 1.0, now: int = 0) -> list[int]:
    k, ticks = tables(1.0), np.zeros(8, dtype=np.int64)
    k.clock[0].now = now
    columns = np.zeros((8, 5))
    columns[:] = -1.0, 0.0, 0.0, 0.0, 0.0
    columns[: len(coefficients)] = coefficients
    rise_together(k, *(np.ascontiguousarray(column) for column in columns.T), np.full(8, scale), ticks)
    return ticks[: len(coefficients)].tolist()


SCALE = st.sampled_from([1.0, 0.0, 2.0**-60, 1e-6, 300.0, float("inf")])
COEFFICIENT = st.one_of(
    st.floats(-1e6, 1e6), st.integers(-9, 9).map(float), st.sampled_from([0.0, -0.0, 1e-200, -1e-200])
)


@given(st.lists(st.tuples(*[COEFFICIENT] * 5), min_size=1, max_size=8), SCALE, st.integers(-(2**50), 2**50))
@example([(0.0, 0.0, 0.0, -1.0, 23.0)], 1.0, 0)  # below zero by almost nothing: not now
@example([(-0.25, -7.0, -5.0, -1.0, 3.0), (-0.25, 1.0, -2.0, 7.0, -8.0)], 1.0, 0)  # bounds that are near
@example([(0.0, 0.0, 0.0, 0.0, -(2.0**-1030))], 1.0, 0)  # at the end of the tick it underflows: now
@settings(deadline=None)
def test_a_polynomial_is_below_zero_until_it_is_said_to_rise(polynomials, scale, now):
    """In whole numbers: it is below zero at the end of this tick, or the tick is now; and at 31 times up to
    the tick that is said."""
    for polynomial, tick in zip(polynomials, rises(*polynomials, scale=scale, now=now), strict=True):
        exact = [Fraction(each) for each in polynomial]
        sizes = [abs(each) for each in exact]

        def value(terms, t):
            return sum(each * t**power for power, each in enumerate(terms))

        end = Fraction(1, 2**52)
        rounding = Fraction(1, 2**45) * value(sizes, end) + Fraction(1, 2**1074)
        assert tick == now or value(exact, end) <= rounding
        assert tick != now or value(exact, end) >= -rounding
        length = min(tick - now, 2**62)
        for share in range(1, 32):
            t = max(Fraction(length * share, 31 * 2**52), end)
            if tick > now:
                assert value(exact, t) <= Fraction(1, 2**45) * value(sizes, t), (polynomial, tick, share)


def test_bounds_of_a_rise_are_near_where_it_is_simple():
    """A line, powers alone, a double root; one that has risen, and with a long scale two that rise late."""
    soon = rises(
        (-1.0, 4.0, 0.0, 0.0, 0.0),
        (-1.0, 0.0, 4.0, 0.0, 0.0),
        (-1.0, 0.0, 0.0, 8.0, 0.0),
        (-1.0, 0.0, 0.0, 0.0, 16.0),
        (-1.0, 2.0, -1.0, 0.0, 0.0),
        (1.0, 0.0, 0.0, 0.0, 0.0),
    )
    for tick, root in zip(soon[:4], (0.25, 0.5, 0.5, 0.5), strict=True):
        assert 0.99 * root < tick * TICK <= root
    assert 0.8 < soon[4] * TICK < 1.0
    assert soon[5] == 0
    never = rises((-1.0, -1.0, -1.0, -1.0, -1.0), (-1.0, 1e-4, 0.0, 0.0, 0.0), scale=1024.0)
    assert never == [NEVER, NEVER]
