"""Failure times of certificates: what an event has exchanged it does not exchange back at the same tick."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from kinetile.kernel.certificates.structural import falls, falls_eight
from kinetile.kernel.compiled import hook
from kinetile.kernel.skin import Skin
from kinetile.kernel.tables import NEVER, allocate
from kinetile.kernel.vectors import floor, lane, pick

TICK = 2.0**-52


def tables(speed: float):
    k = allocate(2, 2, 1)
    clock = k.clock[0]
    clock.tick, clock.per_time = TICK, 1.0 / TICK
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


@hook
def fall_together(k, since, gap, rate, ticks):
    """Lay down what ``falls_eight`` says of eight quantities; ticks come as doubles."""
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
