"""Failure times of certificates: what an event has exchanged it does not exchange back at the same tick."""

from __future__ import annotations

import math

from hypothesis import given, settings
from hypothesis import strategies as st

from kinetile.kernel.certificates import falls
from kinetile.kernel.skin import Skin
from kinetile.kernel.tables import NEVER, allocate

TICK = 2.0**-52


def tables(speed: float):
    k = allocate(2, 2, 1)
    clock = k.clock[0]
    clock.tick, clock.per_time = TICK, 1.0 / TICK
    skin = Skin.of(2, 1.0, speed, TICK)
    clock.skin, clock.theta = skin.delta, skin.theta
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
    if not math.isclose(end, -clock.theta, rel_tol=1e-9):
        assert falls(k, 0, gap, rate) == (later if end < -clock.theta else NEVER)
