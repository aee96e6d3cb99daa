"""The ticks of contacts against integers: all that is hard to tell, compiled and interpreted."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import encounters
from encounters import (
    FAMILIES,
    FAR,
    TICK,
    answers,
    mirrored,
    reached,
    rows,
    touches,
    true_answers,
    true_reach,
    true_reaches,
    walls,
)
from kinetile.kernel.compiled import NOTHING_IS_COMPILED
from kinetile.kernel.tables import NEVER

SOME = 60 if NOTHING_IS_COMPILED else 1_500


def drawn(family: str, seed: int, count: int) -> np.ndarray:
    return FAMILIES[family](np.random.default_rng(seed), count)


def wrong(found: list, truth: list, table: np.ndarray) -> list[str]:
    both = zip(found, truth, table.tolist(), strict=True)
    return [f"{row}: {tick}, not {true}" for tick, true, row in both if tick != true]


def assert_true(table: np.ndarray) -> None:
    assert wrong(answers(table), true_answers(table), table) == []


MANY = [pytest.param(100_000, marks=(pytest.mark.long, pytest.mark.compiled))]


@pytest.mark.parametrize("count", [SOME, *MANY])
@pytest.mark.parametrize("family", FAMILIES)
def test_the_tick_is_the_floor_of_the_root(family, count):
    """Of the first root, at which two discs touch, and of the last, at which they part."""
    for seed in range(1, 2 if count == SOME else 11):
        assert_true(drawn(family, seed, count))


@pytest.mark.parametrize("family", FAMILIES)
def test_both_orders_have_one_tick(family):
    """Where the anchors are one, neither body is the first."""
    table = drawn(family, 2, SOME // 4)
    table["elapsed"] = 0
    assert touches(table) == touches(mirrored(table))


@pytest.mark.parametrize("count", [5 * SOME, *MANY])
def test_walls(count):
    table = walls(np.random.default_rng(3), count)
    truth = true_reaches(table)
    assert wrong(reached(table), truth, table) == []
    assert {0, NEVER} < set(truth)


def a_few_of_all() -> list[list[int]]:
    found = [touches(drawn(family, 5, 40)) for family in FAMILIES]
    return [*found, reached(walls(np.random.default_rng(5), 200))]


@pytest.mark.compiled
def test_interpreted_and_compiled_are_one(monkeypatch):
    found = a_few_of_all()
    for name in ("plans", "answer_all", "reach_all"):
        monkeypatch.setattr(encounters, name, getattr(encounters, name).py_func)
    assert a_few_of_all() == found


def test_what_the_definition_says_of_edges():
    def tick(**plans: float) -> int:
        usual = {"x2": 3.0, "vx": 1.0, "radius": 0.5, "radius2": 0.5}
        return touches(rows(1, **{**usual, **plans}))[0]

    unit = 2**52
    assert tick() == 2 * unit
    assert tick(vx=0.0) == NEVER  # at rest
    assert tick(vx=-1.0) == NEVER  # receding
    assert tick(x2=1.0) == 0  # touching
    assert tick(x2=0.5) == 0  # overlapping
    assert tick(x2=1.0, vx=-1.0) == NEVER  # touching, but receding
    assert tick(x2=0.0, y2=1.0) == NEVER  # touching, and sliding
    assert tick(x2=0.0, y2=2.0**-600, vy=2.0**-600) == 0  # approaching, by less than a double
    assert tick(y2=1.0) == NEVER  # tangent
    assert tick(y2=math.nextafter(1.0, 0.0)) == 3 * unit - 2**26  # not by a rounding
    assert tick(x2=1025.0) == NEVER  # at 2^62
    assert tick(x2=math.nextafter(1025.0, 0.0)) == FAR - 2**10
    assert tick(vx=5e-324) == NEVER
    assert tick(x2=math.inf) == tick(vx=math.nan) == tick(radius=math.inf) == NEVER


def test_a_wall_on_its_edges():
    def tick(far: float, radius: float, speed: float = 1.0) -> int:
        return reached(np.array([[far, 0.0, radius, speed, TICK]]))[0]

    assert tick(0.5, 0.5) == tick(0.25, 0.5) == tick(-1.0, 0.5) == 0
    assert tick(1.0, 0.5) == 2**51
    assert tick(math.nextafter(1.0, 0.0), 0.5) == 2**51 - 1
    assert tick(math.nextafter(1.0, 2.0), 0.5) == 2**51 + 1
    assert tick(1024.5, 0.5) == NEVER
    assert tick(math.nextafter(1024.5, 0.0), 0.5) == FAR - 2**10
    assert tick(1.0, 0.5, 5e-324) == NEVER


finite = st.floats(-(2.0**900), 2.0**900)
near_one = st.floats(-2.0, 2.0)
coarse = st.integers(-64, 64).map(lambda number: number / 16)
numbers = st.one_of(near_one, coarse, finite)
sizes = numbers.map(abs)
ticks = st.one_of(st.integers(0, FAR), st.integers(0, 62).map(lambda power: 1 << power))


@settings(deadline=None, max_examples=30 if NOTHING_IS_COMPILED else 100)
@given(
    st.lists(numbers, min_size=8, max_size=8),
    st.lists(sizes, min_size=2, max_size=2),
    ticks,
    st.sampled_from([TICK, 2.0**-60, 2.0**-300, 2.0**-952]),
)
@example([0.0, 0.0, 1.0, 0.0, 3.0, 1.0, 0.0, 0.0], [0.5, 0.5], 0, TICK)
def test_of_any_numbers(places, radii, elapsed, tick):
    names = ("x", "y", "vx", "vy", "x2", "y2", "vx2", "vy2")
    plans = dict(zip(names, places, strict=True))
    table = rows(1, **plans, radius=radii[0], radius2=radii[1], elapsed=elapsed)
    table["tick"] = tick
    assert_true(table)


@settings(deadline=None, max_examples=30 if NOTHING_IS_COMPILED else 100)
@given(numbers, numbers, sizes.filter(bool), sizes.filter(bool), st.sampled_from([TICK, 2.0**-60, 2.0**-952]))
def test_of_any_wall(far, near, radius, speed, tick):
    assert reached(np.array([[far, near, radius, speed, tick]]))[0] == true_reach(
        far, near, radius, speed, tick
    )
