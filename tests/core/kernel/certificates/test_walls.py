"""When a body reaches a wall, and when a gap is below zero: ticks against integers (rule 6)."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import lanes
from encounters import FAR, TICK, accelerated_walls, compiled, reached, true_reach, walls, whole
from kinetile.kernel.certificates.quadratic import first_below
from kinetile.kernel.compiled import NOTHING_IS_COMPILED
from kinetile.kernel.tables import NEVER
from kinetile_accuracy.specification.signs import first_fall, value_at

UNIT = 1 << 52


@compiled
def fall_all(table, since, found):
    """Writes when the gap of each row, far, slope, pull, is below zero at the end of a tick from one on."""
    for i in range(len(table)):
        far, _, _, slope, pull, tick = table[i]
        found[i] = first_below(far, slope, pull, since[i], tick, 1.0 / tick)


@pytest.mark.parametrize("family", [walls, accelerated_walls])
@pytest.mark.parametrize("seed", lanes.first(1, range(26), many=3))
def test_the_tick_is_that_of_the_rule(family, seed):
    table = family(np.random.default_rng(seed), lanes.examples(10_000 if seed else 600))
    truth = [true_reach(*row) for row in table.tolist()]
    both = zip(reached(table), truth, table.tolist(), strict=True)
    assert [f"{row}: {tick}, not {true}" for tick, true, row in both if tick != true] == []
    assert {0, NEVER} < set(truth)


@pytest.mark.parametrize("seed", lanes.first(1, range(26), many=3))
def test_a_gap_is_below_zero_at_the_end_of_its_tick(seed):
    rng = np.random.default_rng(seed)
    table = accelerated_walls(rng, lanes.examples(10_000 if seed else 600))
    table[:, 0] -= table[:, 1] + table[:, 2]
    since, found = np.zeros((2, len(table)), dtype=np.int64)
    for _ in range(3):
        fall_all(table, since, found)
        for tick, start, row in zip(found.tolist(), since.tolist(), table.tolist(), strict=True):
            far, _, _, slope, pull, unit = map(Fraction, row)
            c = whole([far, slope * unit, pull * unit * unit / 2])
            falls = start if value_at(c, start + 1) < 0 else first_fall(c, start)
            assert tick == (NEVER if falls is None else falls), row
        since = np.maximum(np.minimum(found, FAR - 3) + rng.integers(-2, 3, len(table)), 0)


def test_a_wall_on_its_edges():
    def tick(far: float, radius: float, speed: float = 1.0) -> int:
        return reached(np.array([[far, 0.0, radius, -speed, 0.0, TICK]]))[0]

    assert tick(0.5, 0.5) == tick(0.25, 0.5) == tick(-1.0, 0.5) == 0
    assert tick(1.0, 0.5) == 2**51
    assert tick(math.nextafter(1.0, 0.0), 0.5) == 2**51 - 1
    assert tick(math.nextafter(1.0, 2.0), 0.5) == 2**51 + 1
    assert tick(1024.5, 0.5) == NEVER
    assert tick(math.nextafter(1024.5, 0.0), 0.5) == FAR - 2**10
    assert tick(1.0, 0.5, 5e-324) == NEVER


def test_a_ball_on_a_floor_and_one_at_a_ceiling_that_pulls_it_away():
    def tick(far: float, near: float, slope: float, pull: float) -> int:
        return reached(np.array([[far, near, 0.25, slope, pull, TICK]]))[0]

    assert tick(2.25, 0.0, 0.0, -1.0) == 2 * UNIT
    assert tick(0.25, 0.0, 2.0, -2.0) == 2 * UNIT  # from the floor, and back at 4 and 6
    assert tick(0.25, 0.0, 0.0, 1.0) == NEVER
    assert tick(0.25, 0.0, 0.0, -1.0) == 0
    assert tick(1.25, 0.0, -1.0, 0.5) == NEVER  # comes to the wall, and no farther
    assert tick(1.25, 0.0, -1.0, 0.0) == UNIT
    assert tick(0.25, 0.0, 2.0**-53, -1.0) == 1  # rises by less than the rounding of its place
    assert tick(math.nextafter(1024.25, 0.0), 0.0, -1.0, 0.0) == FAR - 2**10
    assert tick(2.25, 0.0, -math.inf, 1.0) == tick(math.nan, 0.0, -1.0, 1.0) == NEVER


coarse = st.integers(-64, 64).map(lambda number: number / 16)
numbers = st.one_of(st.floats(-2.0, 2.0), coarse, st.floats(-(2.0**900), 2.0**900))
sizes = numbers.map(abs)


@settings(deadline=None, max_examples=30 if NOTHING_IS_COMPILED else 100)
@given(numbers, numbers, sizes.filter(bool), sizes.filter(bool), st.sampled_from([TICK, 2.0**-60, 2.0**-952]))
def test_of_any_wall(far, near, radius, speed, tick):
    row = far, near, radius, -speed, 0.0, tick
    assert reached(np.array([row])) == [true_reach(*row)]
